//! Other names for everything in a model and its effects.

use std::collections::BTreeMap;

/// Words after which a name is declared.
const DECLARING: [&str; 12] = [
    "model",
    "effect",
    "form",
    "constant",
    "let",
    "function",
    "input",
    "parameter",
    "state",
    "modes",
    "equation",
    "output",
];

/// New names by old ones: each as long as the old one, so that nothing is laid out otherwise, and
/// without an underscore, so that a name made of two can be taken apart again.
#[derive(Debug)]
pub(crate) struct Renaming(BTreeMap<String, String>);

impl Renaming {
    /// New names for all that some texts declare, but for names of one letter.
    pub(crate) fn of<'a>(texts: impl Iterator<Item = &'a str>) -> Renaming {
        let mut renaming = Renaming(BTreeMap::new());
        for line in texts.flat_map(str::lines) {
            let code = line.split(['#', '/']).next().unwrap_or_default();
            let mut declares = false;
            for word in pieces(code, is_of_a_name) {
                if declares && word.len() > 1 && word.starts_with(is_of_a_name) {
                    renaming.add(word);
                }
                declares = DECLARING.contains(&word) || (declares && word.trim().is_empty());
            }
        }
        renaming
    }

    fn add(&mut self, old: &str) {
        let width = old.len() - 1;
        let known = self.0.keys().filter(|other| other.len() == old.len()).count();
        let new = format!("z{known:0width$}");
        assert_eq!(new.len(), old.len(), "there are new names enough");
        self.0.entry(old.to_owned()).or_insert(new);
    }

    /// A text with the new names in the places of the old ones.
    pub(crate) fn forth(&self, text: &str) -> String {
        let new = |word| self.0.get(word).map_or(word, |new| new.as_str());
        pieces(text, is_of_a_name).map(new).collect()
    }

    /// The same back again.
    pub(crate) fn back(&self, text: &str) -> String {
        let old: BTreeMap<&str, &str> =
            self.0.iter().map(|(old, new)| (new.as_str(), old.as_str())).collect();
        pieces(text, |c| c.is_ascii_alphanumeric())
            .map(|word| old.get(word).copied().unwrap_or(word))
            .collect()
    }

    /// The old names.
    pub(crate) fn old_names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }
}

fn is_of_a_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// Words and what is between them, in order.
fn pieces(text: &str, is_of_a_word: impl Fn(char) -> bool) -> impl Iterator<Item = &str> {
    let mut rest = text;
    std::iter::from_fn(move || {
        let is_word = is_of_a_word(rest.chars().next()?);
        let end = rest.find(|c| is_of_a_word(c) != is_word).unwrap_or(rest.len());
        let (piece, behind) = rest.split_at(end);
        rest = behind;
        Some(piece)
    })
}

/// Words that could be names.
pub(crate) fn words(text: &str) -> impl Iterator<Item = &str> {
    pieces(text, is_of_a_name)
}
