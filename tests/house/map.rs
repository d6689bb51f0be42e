//! The map of files in `docs/files.md`, made of their first lines.

use std::fmt::Write as _;
use std::fs;

use crate::source::{CRATES, File, files, root};

/// What a file says that it is for.
fn purpose(file: &File) -> Option<String> {
    let lines = file.text.lines().take_while(|line| line.starts_with("//!"));
    let sentence: Vec<&str> = lines
        .map(|line| line.trim_start_matches("//!").trim())
        .take_while(|line| !line.is_empty())
        .collect();
    let sentence = sentence.join(" ");
    let end = sentence.find(". ").map_or(sentence.len(), |end| end + 1);
    (end > 0).then(|| without_links(&sentence[..end]))
}

/// The text alone where rustdoc has a link: `[text](path)` and `[text]`.
fn without_links(sentence: &str) -> String {
    let mut parts = sentence.split("](");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        text.push_str(part.split_once(')').map_or("", |(_, rest)| rest));
    }
    text.replace("[`", "`").replace("`]", "`")
}

fn map() -> (String, Vec<String>) {
    let mut text = String::from(
        "# Map of files\n\nEach file's first sentence. Written by `UPDATE_GOLDEN=1 cargo test --test house`; where to begin is in\n[ARCHITECTURE.md](../ARCHITECTURE.md).\n",
    );
    let mut silent = Vec::new();
    for name in CRATES {
        let source = if name == "dgd" { "src".to_owned() } else { format!("{name}/src") };
        let _ = write!(text, "\n## {source}\n\n| file | |\n|---|---|\n");
        for file in files(name) {
            let path = file.path.join("/");
            match purpose(&file) {
                Some(purpose) => {
                    let purpose = purpose.replace('|', "\\|");
                    let _ = writeln!(text, "| `{path}.rs` | {purpose} |");
                }
                None => silent.push(format!("{source}/{path}.rs")),
            }
        }
    }
    (text, silent)
}

#[test]
fn each_file_says_what_it_is_for_and_the_map_has_it() {
    let (map, silent) = map();
    assert!(silent.is_empty(), "files without a first `//!` line:\n{}", silent.join("\n"));
    let path = root().join("docs/files.md");
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        fs::write(&path, &map).expect("the map can be written");
    }
    let found = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        found == map,
        "docs/files.md is not what the files say: UPDATE_GOLDEN=1 cargo test --test house"
    );
}
