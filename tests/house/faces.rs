//! The library knows no command line: no option of it stands in a text below the command.

use crate::source::{CRATES, product};

/// The crates that write for the users of one face.
const FACES: [&str; 2] = ["dgd-cli", "dgd-python"];

/// The string literals of code, each with the line where it begins; those of comments are none.
fn literals(code: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    let mut line = 1;
    let mut rest = code;
    while let Some(c) = rest.chars().next() {
        let skipped = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("'\"'") || rest.starts_with("'\\\"'") {
            rest[1..].find('\'').map_or(rest.len(), |end| end + 2)
        } else if let Some(length) = literal(rest) {
            found.push((line, &rest[..length]));
            length
        } else {
            c.len_utf8()
        };
        line += rest[..skipped].matches('\n').count();
        rest = &rest[skipped..];
    }
    found
}

/// The length of the string literal with which a text begins, if it does.
fn literal(text: &str) -> Option<usize> {
    let raw = text.strip_prefix('r').unwrap_or_default();
    let hashes = raw.chars().take_while(|c| *c == '#').count();
    if raw[hashes..].starts_with('"') {
        let end = format!("\"{}", "#".repeat(hashes));
        let begin = hashes + 2;
        return Some(text[begin..].find(&end).map_or(text.len(), |at| begin + at + end.len()));
    }
    let inside = text.strip_prefix('"')?;
    let mut is_escaped = false;
    let end = inside.find(|c: char| {
        let ends = c == '"' && !is_escaped;
        is_escaped = c == '\\' && !is_escaped;
        ends
    });
    Some(end.map_or(text.len(), |end| end + 2))
}

/// The command of another program that builds this one; its options are the same for every face.
const BUILD: &str = "\"cargo install ";

/// Whether a text has an option: two hyphens before a letter, and nothing or something else than a letter before them.
fn has_option(text: &str) -> bool {
    text.match_indices("--").any(|(at, _)| {
        let before = text[..at].chars().next_back();
        let behind = text[at + 2..].chars().next();
        behind.is_some_and(|c| c.is_ascii_lowercase())
            && before.is_none_or(|c| !c.is_alphanumeric() && c != '-' && c != '!')
    })
}

#[test]
fn texts_below_the_faces_name_no_options() {
    let mut found = Vec::new();
    for name in CRATES.into_iter().filter(|name| !FACES.contains(name)) {
        for (path, code) in product(name) {
            let is_ours = |text: &str| has_option(text) && !text.starts_with(BUILD);
            let literals = literals(&code).into_iter().filter(|(_, text)| is_ours(text));
            found.extend(literals.map(|(line, text)| format!("{path}:{line}: {text}")));
        }
    }
    assert!(found.is_empty(), "name an `Argument`, which each face spells: {found:#?}");
}

#[test]
fn options_are_found_in_literals_of_every_kind() {
    let code = "let a = \"give `--every`\"; // \"--no\"\nlet b = r#\"[\"--data\"]\"#;\nlet c = '\"'; \"x--y\"";
    let found: Vec<usize> = literals(code)
        .into_iter()
        .filter(|(_, text)| has_option(text))
        .map(|(line, _)| line)
        .collect();
    assert_eq!(found, [1, 2]);
    assert!(has_option("dgd fit m.dgd --data") && !has_option("a --> b, x--, <!--text"));
}
