//! Every file begins with a sentence that says what it is.

use crate::source::{CRATES, File, files, source};

/// Whether a file begins with a sentence of documentation.
fn says_what_it_is(file: &File) -> bool {
    let lines = file.text.lines().map_while(|line| line.strip_prefix("//!"));
    let first: Vec<&str> = lines.map(str::trim).take_while(|line| !line.is_empty()).collect();
    let first = first.join(" ");
    first.ends_with(['.', ':']) || first.contains(". ")
}

#[test]
fn each_file_begins_with_a_sentence_that_says_what_it_is() {
    let mut silent = Vec::new();
    for name in CRATES {
        let silent_ones = files(name).into_iter().filter(|file| !says_what_it_is(file));
        silent
            .extend(silent_ones.map(|file| format!("{}/{}.rs", source(name), file.path.join("/"))));
    }
    assert!(silent.is_empty(), "files without a first `//!` sentence:\n{}", silent.join("\n"));
}

#[test]
fn a_heading_or_a_later_comment_is_not_such_a_sentence() {
    let file = |text: &str| File { path: vec!["x".to_owned()], text: text.to_owned() };
    for text in
        ["//! Reads tables.\nuse a;", "//! Reads\n//! tables. Slowly\n", "//! Drawn:\n//!\n//! | |"]
    {
        assert!(says_what_it_is(&file(text)), "{text}");
    }
    for text in
        ["", "use a;\n//! Reads tables.", "//!\n//! Reads tables.", "//! Tables\n\nfn f() {}"]
    {
        assert!(!says_what_it_is(&file(text)), "{text}");
    }
}
