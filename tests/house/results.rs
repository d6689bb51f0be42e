//! Results are read by fields, not by keys of their JSON.

use crate::source::files;

/// What reads results.
const READERS: [&str; 6] =
    ["dgd-cli", "dgd-job", "dgd-page", "dgd-python", "dgd-watch", "dgd-work"];

/// Reads a job file, which is a request.
const REQUEST: [&str; 2] = ["job", "read"];

#[test]
fn no_result_is_read_by_a_key() {
    let mut found = Vec::new();
    for name in READERS {
        for file in files(name) {
            // The schema is compared with its file by a test.
            let is_test = file.path.iter().any(|part| part == "tests" || part == "schema");
            if is_test || file.path == REQUEST {
                continue;
            }
            let product = file.text.split("#[cfg(test)]").next().unwrap_or_default();
            for line in product.lines().filter(|line| is_read_by_key(line)) {
                found.push(format!("{name}: {}: {}", file.path.join("/"), line.trim()));
            }
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
