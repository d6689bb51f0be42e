//! Pages that show commands with their output: each command is run as shown, and must print the shown output.
//!
//! | block | content |
//! |---|---|
//! | `sh` | commands, one a line; those of `dgd` are run |
//! | `text` | lines that the commands before it print, in this order; `…` stands for any others |
//! | `dgd` | with a `model` line, the file that the following commands read |
//! | `text,of FILE`, `diff,of FILE` | lines of that file |

use std::fs;
use std::path::Path;

use tempfile::TempDir;

use crate::support::{dgd_in, root};

/// A fenced block: its info string, and its text.
fn blocks(page: &str) -> Vec<(String, String)> {
    let mut blocks: Vec<(String, String)> = Vec::new();
    let mut is_open = false;
    for line in page.lines() {
        if let Some(info) = line.strip_prefix("```") {
            is_open = !is_open;
            if is_open {
                blocks.push((info.to_owned(), String::new()));
            }
        } else if let (true, Some((_, text))) = (is_open, blocks.last_mut()) {
            text.push_str(line);
            text.push('\n');
        }
    }
    blocks
}

/// Normalises blanks, because tables have more or fewer of them depending on their numbers.
fn words(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Checks that lines occur in a text in order, with others between them only where `…` stands.
fn verify_shown(shown: &str, said: &str, what: &str) {
    let text: Vec<String> = said.lines().map(words).collect();
    let mut position = 0;
    let mut may_skip = true;
    for line in shown.lines().map(words) {
        if line == "…" {
            may_skip = true;
            continue;
        }
        let result = text[position..].iter().position(|own| *own == line);
        let skipped = result.unwrap_or_else(|| {
            panic!("{what} does not show\n{line}\nbut\n{}", text[position..].join("\n"))
        });
        assert!(may_skip || skipped == 0, "{what} has more before\n{line}");
        position += skipped + 1;
        may_skip = false;
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder") {
        let entry = entry.expect("an entry").path();
        let place = to.join(entry.file_name().expect("a name"));
        if entry.is_dir() {
            copy(&entry, &place);
        } else {
            fs::copy(&entry, &place).expect("a copy");
        }
    }
}

/// Runs all commands of a page except those selected by `is_left_out`, in a folder with copies of these files.
fn verify(name: &str, copies: &[&str], is_left_out: fn(&str) -> bool) -> usize {
    let page = fs::read_to_string(root().join(name)).expect("a page");
    let folder = TempDir::new().expect("a folder");
    for path in copies {
        copy(&root().join(path), &folder.path().join(path));
    }
    let (mut said, mut run) = (None::<String>, 0);
    for (info, text) in blocks(&page) {
        let (language, mark) = info.split_once(',').unwrap_or((&info, ""));
        match (language, mark.strip_prefix("of ")) {
            ("sh", _) => {
                said = Some(String::new());
                for line in text.lines().map(|line| line.trim_end_matches(" &&")) {
                    let expected = ["dgd ", "cargo run --release -- "];
                    let arguments = expected.iter().find_map(|start| line.strip_prefix(start));
                    let Some(arguments) = arguments.filter(|_| !is_left_out(line)) else {
                        said = None;
                        continue;
                    };
                    let arguments: Vec<&str> = arguments.split(' ').collect();
                    let ran = dgd_in(folder.path(), &arguments).done();
                    if let Some(said) = &mut said {
                        said.push_str(&ran.err);
                        said.push_str(&ran.out);
                    }
                    run += 1;
                }
            }
            (_, Some(file)) => {
                let content = fs::read_to_string(folder.path().join(file)).expect(file);
                verify_shown(&format!("…\n{text}"), &content, file);
            }
            ("text", None) => {
                // Output that follows without a command is a block of its own.
                if let Some(said) = said.take() {
                    verify_shown(&text, &said, name);
                }
            }
            ("dgd", None) => {
                let model = text.lines().find_map(|line| line.strip_prefix("model "));
                if let Some(model) = model {
                    fs::write(folder.path().join(format!("{model}.dgd")), &text).expect("a model");
                }
            }
            _ => {}
        }
    }
    run
}

#[test]
fn the_tutorial_goes_as_it_is_told() {
    assert_eq!(verify("docs/tutorial.md", &["examples/tutorial"], |_| false), 9);
}

#[test]
fn the_readme_shows_what_its_commands_say() {
    // `.ci/run` runs the others, as they are in the README.
    let run = verify("README.md", &["models", "examples/data"], |line| {
        line.starts_with("cargo run --release -- ")
    });
    assert_eq!(run, 2);
}

#[test]
fn what_is_not_said_is_found() {
    let text = "a 1\nb  2\nc\n";
    verify_shown("…\nb 2\n…\nc\n", text, "it");
    for wrong in ["a 2\n", "a 1\nc\n", "c\nb 2\n"] {
        assert!(std::panic::catch_unwind(|| verify_shown(wrong, text, "it")).is_err(), "{wrong}");
    }
}
