//! Which crates the workspace needs: one version of each, but for those that `deny.toml` gives reasons for.

use std::collections::BTreeMap;
use std::fs;

use crate::source::root;

#[test]
fn crates_in_several_versions_are_those_of_deny_toml() {
    let read = |name: &str| fs::read_to_string(root().join(name)).expect("a file of the workspace");
    let lock = read("Cargo.lock");
    let mut versions: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    let mut name = "";
    for line in lock.lines() {
        if let Some(text) = line.strip_prefix("name = ") {
            name = text.trim_matches('"');
        } else if let Some(text) = line.strip_prefix("version = ")
            && !name.is_empty()
        {
            versions.entry(name).or_default().push(text.trim_matches('"'));
            name = "";
        }
    }
    // The versions in a lock file are in order: all but the last are beside the newest.
    let mut beside: Vec<String> = versions
        .iter()
        .flat_map(|(name, all)| all[..all.len() - 1].iter().map(move |v| format!("{name}@{v}")))
        .collect();
    let deny = read("deny.toml");
    let mut skipped: Vec<String> = deny
        .lines()
        .filter_map(|line| line.trim().strip_prefix("{ crate = \"")?.split('"').next())
        .map(str::to_owned)
        .collect();
    beside.sort();
    skipped.sort();
    assert_eq!(beside, skipped, "left those of Cargo.lock, right those of deny.toml");
}
