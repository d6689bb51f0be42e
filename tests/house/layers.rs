//! No circle between crates, nor between folders of a crate; no folder with more entries than one takes in.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use crate::source::{CRATES, File, files, folder};

/// A folder holds no more files and folders.
const MOST_SIBLINGS: usize = 15;

#[test]
fn crates_use_only_those_before_them() {
    for (k, name) in CRATES.iter().enumerate() {
        let manifest = fs::read_to_string(folder(name).join("Cargo.toml")).expect("a manifest");
        let Some(start) = manifest.find("\n[dependencies]").map(|start| start + 1) else {
            continue;
        };
        let section = &manifest[start..];
        let end = section[1..].find("\n[").map_or(section.len(), |end| end + 1);
        for line in section[..end].lines().filter(|line| line.starts_with("dgd-")) {
            let used = line.split(['.', ' ', '=']).next().unwrap_or_default();
            let position = CRATES.iter().position(|other| *other == used);
            assert!(position.is_some_and(|used| used < k), "{name} depends on {used}");
            let apart = ["dgd-compiler", "dgd-runtime"];
            assert!(
                !(apart.contains(name) && apart.contains(&used)),
                "the compiler and the runtime do not depend on each other"
            );
        }
    }
}

/// Which folder beside it uses which, and in which file.
type Uses = BTreeMap<(String, String), String>;

/// For each folder that has folders, which of these uses which other.
fn uses_between_folders(name: &str) -> BTreeMap<Vec<String>, Uses> {
    let all = files(name);
    let folders: BTreeSet<&[String]> = all.iter().map(File::folders).collect();
    let is_folder = |path: &[String]| folders.iter().any(|folder| folder.starts_with(path));
    let mut found: BTreeMap<Vec<String>, Uses> = BTreeMap::new();
    for file in &all {
        let own = file.folders();
        for used in file.uses() {
            let len = (1..=used.len()).take_while(|len| is_folder(&used[..*len])).count();
            let common = own.iter().zip(&used[..len]).take_while(|(own, used)| own == used).count();
            if common < own.len() && common < len {
                let uses = found.entry(own[..common].to_vec()).or_default();
                let pair = (own[common].clone(), used[common].clone());
                uses.entry(pair).or_insert_with(|| file.path.join("/"));
            }
        }
    }
    found
}

/// A circle among the uses, as the files that close it.
fn circle(uses: &Uses) -> Option<Vec<String>> {
    let reaches = |from: &str, to: &str| {
        let mut reached = BTreeSet::from([from.to_owned()]);
        let mut next = vec![from.to_owned()];
        while let Some(folder) = next.pop() {
            for (_, used) in uses.keys().filter(|(user, _)| *user == folder) {
                if reached.insert(used.clone()) {
                    next.push(used.clone());
                }
            }
        }
        reached.contains(to)
    };
    let closing = uses.iter().filter(|((user, used), _)| reaches(used, user));
    let said: Vec<String> =
        closing.map(|((user, used), file)| format!("{user} → {used} in {file}.rs")).collect();
    (!said.is_empty()).then_some(said)
}

#[test]
fn folders_do_not_use_each_other_in_circles() {
    let mut wrong = Vec::new();
    for name in CRATES {
        for (within, uses) in uses_between_folders(name) {
            let circle = circle(&uses).into_iter().flatten();
            wrong.extend(circle.map(|said| format!("{name}/src/{}: {said}", within.join("/"))));
        }
    }
    assert!(wrong.is_empty(), "folders in circles:\n{}", wrong.join("\n"));
}

#[test]
fn a_circle_is_seen() {
    let uses = |pairs: &[(&str, &str)]| -> Uses {
        pairs.iter().map(|(a, b)| (((*a).into(), (*b).into()), "file".into())).collect()
    };
    assert_eq!(circle(&uses(&[("a", "b"), ("b", "c"), ("a", "c")])), None);
    assert!(circle(&uses(&[("a", "b"), ("b", "c"), ("c", "a")])).is_some());
}

#[test]
fn folders_can_be_taken_in_at_a_glance() {
    let mut wrong = Vec::new();
    for name in CRATES {
        let mut entries: BTreeMap<Vec<String>, BTreeSet<String>> = BTreeMap::new();
        for file in files(name) {
            for len in 0..file.path.len() {
                entries
                    .entry(file.path[..len].to_vec())
                    .or_default()
                    .insert(file.path[len].clone());
            }
        }
        for (within, entries) in entries {
            let own =
                entries.iter().filter(|entry| !matches!(entry.as_str(), "mod" | "lib" | "main"));
            let count = own.count();
            if count > MOST_SIBLINGS {
                wrong.push(format!("{name}/src/{}: {count}", within.join("/")));
            }
        }
    }
    assert!(wrong.is_empty(), "more than {MOST_SIBLINGS} entries:\n{}", wrong.join("\n"));
}
