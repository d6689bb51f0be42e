//! The command line, as it can be typed again.

use std::ffi::{OsStr, OsString};
use std::sync::OnceLock;

/// The words behind `dgd`.
static WORDS: OnceLock<Vec<OsString>> = OnceLock::new();

/// Has these words be the command line; a process has one.
pub(crate) fn set(words: Vec<OsString>) {
    let _ = WORDS.set(words);
}

/// The words behind `dgd`.
pub(crate) fn words() -> impl Iterator<Item = &'static OsStr> {
    WORDS.get().into_iter().flatten().map(OsString::as_os_str)
}

/// The command line of this process, to be typed again. It gives the same without `--resume`.
pub(crate) fn command_line() -> String {
    let quoted = |word: String| {
        let is_plain = |c: char| c.is_alphanumeric() || "-_./=,:+".contains(c);
        if !word.is_empty() && word.chars().all(is_plain) {
            word
        } else {
            format!("'{}'", word.replace('\'', "'\\''"))
        }
    };
    let words = words().filter(|word| *word != "--resume");
    let words = words.map(|word| quoted(word.to_string_lossy().into_owned()));
    let words: Vec<String> = std::iter::once("dgd".to_owned()).chain(words).collect();
    words.join(" ")
}
