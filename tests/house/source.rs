//! The workspace's Rust files as text.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// The crates of the workspace, each of which uses only those before it. Tests may use any.
pub(crate) const CRATES: [&str; 19] = [
    "dgd-scratch",
    "dgd-signature",
    "dgd-compiler",
    "dgd-macros",
    "dgd-runtime",
    "dgd-identify",
    "dgd-execute",
    "dgd-screen",
    "dgd-discover",
    "dgd-data",
    "dgd-plot",
    "dgd-page",
    "dgd-work",
    "dgd-job",
    "dgd-lsp",
    "dgd-watch",
    "dgd-cli",
    "dgd-python",
    "dgd",
];

pub(crate) fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The folder of a crate; the root package has the root.
pub(crate) fn folder(name: &str) -> PathBuf {
    root().join(below_root(name))
}

/// The folder of a crate's sources, from the root.
pub(crate) fn source(name: &str) -> String {
    below_root(name).join("src").display().to_string()
}

/// The two crates that models and solvers of others use stand beside `models`; the root package has the root.
fn below_root(name: &str) -> PathBuf {
    match name {
        "dgd" => PathBuf::new(),
        "dgd-macros" | "dgd-runtime" => PathBuf::from(name),
        _ if name.starts_with("dgd-") => PathBuf::from("crates").join(name),
        _ => PathBuf::from(name),
    }
}

/// A Rust file of a crate.
pub(crate) struct File {
    /// Folders and name below `src`, without the ending.
    pub(crate) path: Vec<String>,
    pub(crate) text: String,
}

impl File {
    /// The folders below `src` that it lies in.
    pub(crate) fn folders(&self) -> &[String] {
        &self.path[..self.path.len() - 1]
    }

    /// The path of its module.
    pub(crate) fn module(&self) -> &[String] {
        match self.path.last().map(String::as_str) {
            Some("mod" | "lib" | "main") => self.folders(),
            _ => &self.path,
        }
    }

    /// The modules of its own crate that it names, as paths below the crate's root; items are named with them.
    pub(crate) fn uses(&self) -> BTreeSet<Vec<String>> {
        let code = code(&self.text);
        let mut found = BTreeSet::new();
        let mut words = words(&code).into_iter().peekable();
        while let Some(word) = words.next() {
            let mut base = match word {
                "crate" => Vec::new(),
                "super" => {
                    let mut module = self.module().to_vec();
                    module.pop();
                    module
                }
                _ => continue,
            };
            let mut depth = 0;
            let mut stack = vec![base.clone()];
            let mut fresh = false;
            while let Some(word) = words.peek().copied() {
                match word {
                    "::" => fresh = true,
                    "super" if fresh => {
                        base.pop();
                        fresh = false;
                    }
                    "{" if fresh => {
                        depth += 1;
                        stack.push(base.clone());
                    }
                    "," if depth > 0 => {
                        found.insert(base.clone());
                        base.clone_from(&stack[depth]);
                        fresh = true;
                    }
                    "}" if depth > 0 => {
                        found.insert(base.clone());
                        stack.pop();
                        depth -= 1;
                        base.clone_from(&stack[depth]);
                        fresh = false;
                    }
                    name if fresh && is_name(name) => {
                        base.push(name.to_owned());
                        fresh = false;
                    }
                    _ if depth > 0 => fresh = false,
                    _ => break,
                }
                if word == "{" {
                    fresh = true;
                }
                words.next();
            }
            found.insert(base);
        }
        found
    }
}

/// The text without comments and without what is within quotes.
pub(crate) fn code(text: &str) -> String {
    let mut code = String::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let len = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if first == '"' {
            match raw_end(&code) {
                Some(end) => rest[1..].find(&end).map_or(rest.len(), |at| 1 + at + end.len()),
                None => quoted_len(rest, '"'),
            }
        } else if first == '\'' && is_character(rest) {
            quoted_len(rest, '\'')
        } else {
            code.push(first);
            rest = &rest[first.len_utf8()..];
            continue;
        };
        code.push_str(if matches!(first, '"' | '\'') { "\"\"" } else { "" });
        rest = &rest[len..];
    }
    code
}

/// Whether a quote begins a character rather than a lifetime.
fn is_character(text: &str) -> bool {
    let mut chars = text.chars().skip(1);
    chars.next() == Some('\\') || chars.next() == Some('\'')
}

/// What ends a raw string whose prefix `code` ends in; `None` for other strings.
fn raw_end(code: &str) -> Option<String> {
    let prefix = code.trim_end_matches('#');
    let word = prefix.rsplit(|c: char| !c.is_alphanumeric() && c != '_').next()?;
    matches!(word, "r" | "br").then(|| format!("\"{}", &code[prefix.len()..]))
}

/// The length of a string or character with its quotes, of which a backslash hides one.
fn quoted_len(text: &str, quote: char) -> usize {
    let mut is_hidden = false;
    let end = text.char_indices().skip(1).find(|(_, c)| {
        let is_end = *c == quote && !is_hidden;
        is_hidden = *c == '\\' && !is_hidden;
        is_end
    });
    end.map_or(text.len(), |(at, _)| at + 1)
}

pub(crate) fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Names, `::` and single other characters.
pub(crate) fn words(code: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut rest = code.trim_start();
    while let Some(first) = rest.chars().next() {
        let len = if first.is_alphanumeric() || first == '_' {
            rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len())
        } else if rest.starts_with("::") {
            2
        } else {
            first.len_utf8()
        };
        words.push(&rest[..len]);
        rest = rest[len..].trim_start();
    }
    words
}

/// The Rust files in a crate's `src`, in the order of their paths.
pub(crate) fn files(name: &str) -> Vec<File> {
    let source = folder(name).join("src");
    let mut found = Vec::new();
    walk(&source, &mut Vec::new(), &mut found).expect("the sources can be read");
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

/// The code of a crate's files, by their paths from the root, without unit tests.
pub(crate) fn product(name: &str) -> impl Iterator<Item = (String, String)> {
    let is_product = |file: &File| !file.path.iter().any(|part| part == "tests");
    files(name).into_iter().filter(is_product).map(move |file| {
        let path = format!("{}/{}.rs", source(name), file.path.join("/"));
        (path, without_tests(&file.text).to_owned())
    })
}

/// The text before a module of unit tests; one in another file does not end it.
pub(crate) fn without_tests(text: &str) -> &str {
    let is_here =
        |start: &usize| text[*start..].lines().nth(1).is_some_and(|line| line.contains('{'));
    let mut modules = text.match_indices("#[cfg(test)]\nmod ").map(|(start, _)| start);
    modules.find(is_here).map_or(text, |end| &text[..end])
}

fn walk(folder: &Path, below: &mut Vec<String>, found: &mut Vec<File>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = |part: Option<&std::ffi::OsStr>| part.map(|p| p.to_string_lossy().into_owned());
        if path.is_dir() {
            below.extend(name(path.file_name()));
            walk(&path, below, found)?;
            below.pop();
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            let mut own = below.clone();
            own.extend(name(path.file_stem()));
            found.push(File { path: own, text: fs::read_to_string(&path)? });
        }
    }
    Ok(())
}

#[test]
fn uses_are_read_from_groups_and_from_the_middle_of_code() {
    let file = |path: &[&str], text: &str| File {
        path: path.iter().map(ToString::to_string).collect(),
        text: text.to_owned(),
    };
    let text = "use crate::a::{self, b::C, d::{E, F}};\nuse super::g::H; // crate::no\nfn f() { crate::i::j() }";
    let uses = file(&["x", "y"], text).uses();
    let named: Vec<String> = uses.iter().map(|path| path.join("::")).collect();
    for path in ["a::self", "a::b::C", "a::d::E", "a::d::F", "x::g::H", "i::j"] {
        assert!(named.contains(&path.to_owned()), "{path} in {named:?}");
    }
    assert!(!named.iter().any(|path| path.contains("no")), "{named:?}");
    assert!(file(&["x", "mod"], "use super::g;").uses().contains(&vec!["g".to_owned()]));
}

#[test]
fn comments_and_quotes_are_no_code() {
    let text = "a /* b */ \"c\\\"d\" 'e' '\\'' <'f> r#\"g \"h\"# // \"i\n\"http://\" j";
    let code = code(text);
    let code = words(&code).into_iter().filter(|word| is_name(word)).collect::<Vec<_>>().join(" ");
    assert_eq!(code, "a f r j");
}
