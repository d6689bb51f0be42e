//! Sentences that name arguments, which each face writes in its own way.

pub mod argument;

use std::fmt;

use argument::{Argument, ArgumentUse, Spelling, neutral};

/// A text with arguments in it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Sentence {
    pieces: Vec<SentencePiece>,
}

/// A piece of a sentence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SentencePiece {
    /// Text.
    Text(String),
    /// An argument, which is shown between backticks.
    Argument(ArgumentUse),
}

impl Sentence {
    /// Appends a piece, or another sentence.
    pub fn push(&mut self, more: impl Into<Sentence>) {
        self.pieces.extend(more.into().pieces);
    }

    /// The pieces in order.
    pub fn pieces(&self) -> &[SentencePiece] {
        &self.pieces
    }

    /// The first argument that it names.
    pub fn argument(&self) -> Option<Argument> {
        self.pieces.iter().find_map(|piece| match piece {
            SentencePiece::Argument(given) => Some(given.argument),
            SentencePiece::Text(_) => None,
        })
    }

    /// The text for the users of a face.
    pub fn spelled(&self, spelling: Spelling) -> String {
        let piece = |piece: &SentencePiece| match piece {
            SentencePiece::Text(text) => text.clone(),
            SentencePiece::Argument(given) => format!("`{}`", spelling(given)),
        };
        self.pieces.iter().map(piece).collect()
    }
}

/// As a library says it.
impl fmt::Display for Sentence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.spelled(neutral))
    }
}

impl From<SentencePiece> for Sentence {
    fn from(piece: SentencePiece) -> Self {
        Sentence { pieces: vec![piece] }
    }
}

impl From<String> for Sentence {
    fn from(text: String) -> Self {
        SentencePiece::Text(text).into()
    }
}

impl From<&str> for Sentence {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

impl From<Argument> for Sentence {
    fn from(argument: Argument) -> Self {
        ArgumentUse::from(argument).into()
    }
}

impl From<ArgumentUse> for Sentence {
    fn from(given: ArgumentUse) -> Self {
        SentencePiece::Argument(given).into()
    }
}

impl From<&ArgumentUse> for Sentence {
    fn from(given: &ArgumentUse) -> Self {
        given.clone().into()
    }
}

impl From<&Sentence> for Sentence {
    fn from(sentence: &Sentence) -> Self {
        sentence.clone()
    }
}

/// A sentence of texts, arguments and sentences: `sentence!["give it by ", Argument::Noise]`.
#[macro_export]
macro_rules! sentence {
    ($($piece:expr),+ $(,)?) => {{
        let mut sentence = $crate::sentence::Sentence::default();
        $(sentence.push($piece);)+
        sentence
    }};
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_face_writes_the_arguments_of_a_sentence() {
        let inner = sentence![" or ", Argument::Until.taking("T")];
        let sentence = sentence!["give ", Argument::Every, inner];
        assert_eq!(sentence.to_string(), "give `every` or `until = T`");
        let loud = |given: &ArgumentUse| given.argument.name().to_uppercase();
        assert_eq!(sentence.spelled(loud), "give `EVERY` or `UNTIL`");
        assert_eq!(sentence.argument(), Some(Argument::Every));
    }
}
