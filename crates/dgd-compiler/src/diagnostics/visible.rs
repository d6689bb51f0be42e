//! Escapes characters that a terminal would act on instead of showing.

use std::borrow::Cow;
use std::fmt::Write as _;

/// The text with invisible characters that have an effect (moving the cursor, changing the direction of writing,
/// hiding) written as in Rust: `\u{202e}`. Line feeds and tabs stay.
pub fn visible(text: &str) -> Cow<'_, str> {
    if !text.chars().any(is_obeyed) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_obeyed(c) {
            // Writing to a string does not fail.
            let _ = write!(shown, "{}", c.escape_unicode());
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
}

/// Whether a terminal acts on a character instead of showing it: controls, marks and overrides of direction, and
/// characters without width that do not join letters.
fn is_obeyed(c: char) -> bool {
    match c {
        '\n' | '\t' => false,
        '\u{61c}'
        | '\u{180e}'
        | '\u{200b}'
        | '\u{200e}'..='\u{200f}'
        | '\u{2028}'..='\u{202e}'
        | '\u{2060}'..='\u{206f}'
        | '\u{feff}'
        | '\u{fff9}'..='\u{fffb}'
        | '\u{e0000}'..='\u{e007f}' => true,
        c => c.is_control(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_mislead_a_terminal_is_written_out() {
        for (text, shown) in [
            ("mud weight\n\tρ", "mud weight\n\tρ"),
            ("a\u{202e}b", "a\\u{202e}b"),
            ("\u{1b}[2J\r\u{9b}", "\\u{1b}[2J\\u{d}\\u{9b}"),
            ("\u{2066}x\u{2069}\u{200b}", "\\u{2066}x\\u{2069}\\u{200b}"),
            // Joiners are part of words.
            ("می\u{200c}شود", "می\u{200c}شود"),
        ] {
            assert_eq!(visible(text), shown);
        }
    }
}
