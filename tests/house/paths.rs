//! Files and folders that the map and the decisions name exist.

use std::fs;
use std::path::Path;

use crate::source::root;

const ENDINGS: [&str; 9] = [".rs", ".py", ".js", ".mjs", ".md", ".json", ".toml", ".html", "/"];

/// Files and folders below a folder, as paths from the root; folders end with `/`.
fn walk(folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).expect("a folder of the workspace").flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if ["target", "node_modules", ".git"].contains(&name.as_str()) {
            continue;
        }
        let path = entry.path();
        let shown = path.strip_prefix(root()).expect("a path below the root").to_string_lossy();
        let shown = shown.replace('\\', "/");
        if path.is_dir() {
            found.push(format!("/{shown}/"));
            walk(&path, found);
        } else {
            found.push(format!("/{shown}"));
        }
    }
}

/// `a/{b,c}.rs` as `a/b.rs` and `a/c.rs`.
fn expanded(path: &str) -> Vec<String> {
    let parts = path.split_once('{').and_then(|(before, rest)| {
        rest.split_once('}').map(|(inner, behind)| (before, inner, behind))
    });
    match parts {
        Some((before, inner, behind)) => {
            inner.split(',').map(|one| format!("{before}{one}{behind}")).collect()
        }
        None => vec![path.to_owned()],
    }
}

/// The paths among the quoted words of a text.
fn named(text: &str) -> Vec<String> {
    let is_path = |word: &&str| {
        ENDINGS.iter().any(|ending| word.ends_with(ending))
            && word.chars().all(|c| c.is_ascii_alphanumeric() || "_./{},-".contains(c))
    };
    let words = text.lines().flat_map(|line| line.split('`').skip(1).step_by(2));
    words.filter(is_path).flat_map(expanded).collect()
}

#[test]
fn paths_in_the_map_and_the_decisions_exist() {
    let mut all = Vec::new();
    walk(&root(), &mut all);
    let is_page = |path: &&String| {
        Path::new(path.as_str()).extension().is_some_and(|ending| ending == "md")
            && (path.starts_with("/docs/decisions/")
                || ["/ARCHITECTURE.md", "/docs/layout.md"].contains(&path.as_str()))
    };
    let mut missing = Vec::new();
    for page in all.iter().filter(is_page) {
        let text = fs::read_to_string(root().join(&page[1..])).expect("a page");
        for path in named(&text) {
            let end = format!("/{path}");
            if !all.iter().any(|known| known.ends_with(&end)) {
                missing.push(format!("{page}: `{path}`"));
            }
        }
    }
    assert!(missing.is_empty(), "no such files:\n{}", missing.join("\n"));
}

#[test]
fn paths_are_read_from_quoted_words() {
    let text = "see `a/{b,c}.rs`, `f(x)`, `docs/` and `a.b`\nor `x y.rs`";
    assert_eq!(named(text), ["a/b.rs", "a/c.rs", "docs/"]);
}
