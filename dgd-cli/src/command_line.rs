//! The command line, as it can be typed again.

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
    let words = std::env::args_os().skip(1).filter(|word| word != "--resume");
    let words = words.map(|word| quoted(word.to_string_lossy().into_owned()));
    let words: Vec<String> = std::iter::once("dgd".to_owned()).chain(words).collect();
    words.join(" ")
}
