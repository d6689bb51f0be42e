//! Results are read by fields, not by keys of their JSON.

use crate::source::product;

/// Crates that read results.
const READERS: [&str; 6] =
    ["dgd-cli", "dgd-job", "dgd-page", "dgd-python", "dgd-watch", "dgd-work"];

/// These read a job file, which is a request, and the schema.
const EXCEPTIONS: [&str; 2] =
    ["crates/dgd-job/src/job/read.rs", "crates/dgd-work/src/output/result/schema.rs"];

#[test]
fn no_result_is_read_by_a_key() {
    let mut found = Vec::new();
    for (path, text) in READERS.into_iter().flat_map(product) {
        if !EXCEPTIONS.contains(&path.as_str()) {
            let lines = text.lines().filter(|line| is_read_by_key(line));
            found.extend(lines.map(|line| format!("{path}: {}", line.trim())));
        }
    }
    assert!(
        found.is_empty(),
        "give the result a type in `dgd_work::result`:\n{}",
        found.join("\n")
    );
}

/// Whether a value is indexed by a string and not assigned.
fn is_read_by_key(line: &str) -> bool {
    line.match_indices("[\"").any(|(start, _)| {
        let before = line[..start].chars().next_back();
        let is_index = before.is_some_and(|c| c.is_alphanumeric() || "_)]".contains(c));
        let rest = line[start + 2..].split_once("\"]").map_or("", |(_, rest)| rest);
        is_index && !rest.trim_start().starts_with("= ")
    })
}
