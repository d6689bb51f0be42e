//! How the command line writes options, which job files contain word by word.

use dgd_work::{Argument, ArgumentUse, Spelling};

/// The notation of a command line, which the caller provides.
#[derive(Debug, Clone, Copy)]
pub struct OptionSyntax {
    /// An argument within a sentence.
    pub spelling: Spelling,
    /// The words that give an argument.
    pub words: fn(&ArgumentUse) -> Vec<String>,
    /// The argument that a word gives, and its value if that is in the same word.
    pub read: fn(&str) -> Option<GivenWord<'_>>,
}

/// An argument that a word gives, and its value if that is in the same word.
pub type GivenWord<'a> = (Argument, Option<&'a str>);

impl OptionSyntax {
    /// All values of an argument among the words of a command.
    pub(crate) fn values(&self, words: &[String], argument: Argument) -> Vec<String> {
        let mut values = Vec::new();
        let mut words = words.iter();
        while let Some(word) = words.next() {
            match (self.read)(word) {
                Some((read, Some(value))) if read == argument => values.push(value.to_owned()),
                Some((read, None)) if read == argument => values.extend(words.next().cloned()),
                _ => {}
            }
        }
        values
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Options with a sign before them.
    pub(crate) const PLUS: OptionSyntax = OptionSyntax {
        spelling: |given| format!("+{}", given.argument.name()),
        words: |given| {
            let name = format!("+{}", given.argument.name());
            std::iter::once(name).chain(given.value().map(str::to_owned)).collect()
        },
        read: |word| {
            let (name, value) = match word.strip_prefix('+')?.split_once('=') {
                Some((name, value)) => (name, Some(value)),
                None => (word.strip_prefix('+')?, None),
            };
            Some((Argument::all().find(|argument| argument.name() == name)?, value))
        },
    };

    #[test]
    fn values_stand_in_a_word_of_their_own_or_behind_a_sign() {
        let words = ["+apply", "leak", "x", "+apply=wear", "+free", "a"].map(str::to_owned);
        assert_eq!(PLUS.values(&words, Argument::Apply), ["leak", "wear"]);
        assert_eq!(PLUS.values(&words, Argument::Free), ["a"]);
    }
}
