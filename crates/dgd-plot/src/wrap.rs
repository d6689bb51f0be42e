//! Breaks text into lines of a given width.

use crate::font::Font;
use crate::text::{MathText, Script};

/// Breaks the text into lines no wider than `width`: at spaces, else after a punctuation mark, else anywhere. A line
/// has at least one character.
pub(crate) fn wrap(text: &MathText, font: &Font, size: f64, width: f64) -> Vec<MathText> {
    let characters: Vec<(char, Script)> =
        text.runs().iter().flat_map(|run| run.text.chars().map(|c| (c, run.script))).collect();
    let mut lines = Vec::new();
    let mut start = 0;
    while start < characters.len() {
        let end = line_end(&characters[start..], font, size, width) + start;
        let mut line = MathText::default();
        for &(character, script) in trim(&characters[start..end]) {
            line.push(character.encode_utf8(&mut [0; 4]), script);
        }
        lines.push(line);
        start = end;
    }
    lines.retain(|line| !line.is_empty());
    lines
}

/// The number of characters in the first line.
fn line_end(characters: &[(char, Script)], font: &Font, size: f64, width: f64) -> usize {
    let mut used = 0.0;
    let (mut at_space, mut at_sign) = (None, None);
    for (i, &(character, script)) in characters.iter().enumerate() {
        used += size * script.scale() * font.advance(character);
        // Widths are sums of rounded quotients; a text measured as `width` must fit into it.
        if used > width + 1e-6 && character != ' ' && i > 0 {
            return at_space.or(at_sign).unwrap_or(i);
        }
        match character {
            ' ' => at_space = Some(i + 1),
            '/' | '·' | ',' | ';' | '.' | '_' | '-' => at_sign = Some(i + 1),
            _ => {}
        }
    }
    characters.len()
}

fn trim(mut characters: &[(char, Script)]) -> &[(char, Script)] {
    while let [(' ', _), rest @ ..] | [rest @ .., (' ', _)] = characters {
        characters = rest;
    }
    characters
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text::tests::show;

    #[test]
    fn lines_break_at_spaces_then_signs_then_anywhere() {
        let font = Font::embedded();
        let wrap = |text: &str, width: f64| -> Vec<String> {
            super::wrap(&MathText::plain(text), &font, 10.0, width).iter().map(show).collect()
        };
        assert_eq!(wrap("one two", 1000.0), ["one two"]);
        assert_eq!(wrap("one two", 30.0), ["one", "two"]);
        assert_eq!(wrap("abc/def", 25.0), ["abc/", "def"]);
        assert_eq!(wrap("abcdef", 18.0), ["abc", "def"]);
        assert_eq!(wrap("ab", 0.0), ["a", "b"]);
        assert!(wrap("  ", 0.0).is_empty());
    }
}
