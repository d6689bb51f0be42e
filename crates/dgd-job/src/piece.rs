//! A piece of work: one command line for one well and one occasion.

use std::fmt;

use dgd_work::{Argument, ArgumentUse};
use serde::{Deserialize, Serialize};

use crate::syntax::OptionSyntax;

/// The task of a piece.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PieceKind {
    /// A fit.
    Fit,
    /// The fit from one of several starting points.
    Start {
        /// Its number, from 0.
        number: u32,
        /// The number of starting points.
        of: u32,
    },
    /// Refits to a share of many resampled data sets.
    Replicates {
        /// Number of the first, from 0.
        from: usize,
        /// Their number.
        count: usize,
    },
    /// The profile of an estimate.
    Profile {
        /// Its name.
        of: String,
    },
    /// A search for missing terms of the model.
    Discover,
}

impl PieceKind {
    /// The name of its command.
    pub fn command(&self) -> &'static str {
        match self {
            PieceKind::Discover => "discover",
            PieceKind::Fit
            | PieceKind::Start { .. }
            | PieceKind::Replicates { .. }
            | PieceKind::Profile { .. } => "fit",
        }
    }

    /// The options that limit a command to this share of its work.
    fn options(&self) -> Vec<ArgumentUse> {
        match self {
            PieceKind::Fit | PieceKind::Discover => Vec::new(),
            PieceKind::Start { number, of } => {
                vec![Argument::Starts.with(of), Argument::StartPoint.with(number)]
            }
            PieceKind::Replicates { from, count } => {
                vec![Argument::Bootstrap.with(count), Argument::BootstrapFrom.with(from)]
            }
            PieceKind::Profile { of } => vec![Argument::Profile.with(of)],
        }
    }
}

/// As used in sentences.
impl fmt::Display for PieceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PieceKind::Fit => f.write_str("fit"),
            PieceKind::Discover => f.write_str("discover"),
            PieceKind::Start { number, of } => write!(f, "start {number} of {of}"),
            PieceKind::Replicates { from, count } => {
                write!(f, "replicates {from} to {}", from + count - 1)
            }
            PieceKind::Profile { of } => write!(f, "profile of `{of}`"),
        }
    }
}

/// A piece of work. All paths are relative to the folder of the job file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Piece {
    /// The well.
    pub well: String,
    /// The date of its recordings, as given in the job file.
    pub when: String,
    /// Its task.
    pub kind: PieceKind,
    /// The model file.
    pub model: String,
    /// Training recordings.
    pub data: Vec<String>,
    /// Recordings for validation.
    pub valid: Vec<String>,
    /// Options of the command.
    pub options: Vec<String>,
    /// Seed of everything random.
    pub seed: u64,
}

impl Piece {
    /// The arguments of its command, after `dgd`.
    pub fn words(&self, syntax: OptionSyntax) -> Vec<String> {
        let mut words = vec![self.kind.command().to_owned(), self.model.clone()];
        let mut give = |given: &ArgumentUse| words.extend((syntax.words)(given));
        for (argument, files) in [(Argument::Data, &self.data), (Argument::Valid, &self.valid)] {
            for file in files {
                give(&argument.with(file));
            }
        }
        words.extend(self.options.iter().cloned());
        let seed = (self.seed != 0).then(|| Argument::Seed.with(self.seed));
        words.extend(self.kind.options().iter().chain(&seed).flat_map(syntax.words));
        words
    }

    /// Its command line, to be typed in the folder of the job file.
    pub fn command(&self, syntax: OptionSyntax) -> String {
        shell(std::iter::once("dgd".to_owned()).chain(self.words(syntax)))
    }
}

/// Quotes words for a shell.
pub fn shell(words: impl IntoIterator<Item = String>) -> String {
    let quoted = |word: String| {
        let is_plain = |c: char| c.is_alphanumeric() || "-_./=,:+".contains(c);
        if !word.is_empty() && word.chars().all(is_plain) {
            word
        } else {
            format!("'{}'", word.replace('\'', "'\\''"))
        }
    };
    words.into_iter().map(quoted).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::syntax::tests::PLUS;

    #[test]
    fn a_piece_is_a_command_line() {
        let piece = Piece {
            well: "A 1".into(),
            when: "2024".into(),
            kind: PieceKind::Start { number: 3, of: 20 },
            model: "m.dgd".into(),
            data: vec!["a b.csv".into(), "c.csv".into()],
            valid: vec!["d.csv".into()],
            options: vec!["+set".into(), "c0=1 [m]".into()],
            seed: 7,
        };
        assert_eq!(
            piece.command(PLUS),
            "dgd fit m.dgd +data 'a b.csv' +data c.csv +valid d.csv +set 'c0=1 [m]' +starts 20 \
             +start-point 3 +seed 7"
        );
        let replicates = PieceKind::Replicates { from: 40, count: 20 };
        let other = Piece { kind: replicates, seed: 0, ..piece };
        assert!(other.command(PLUS).ends_with("+bootstrap 20 +bootstrap-from 40"));
        assert_eq!(other.kind.to_string(), "replicates 40 to 59");
        let text = serde_json::to_string(&other).expect("it serialises");
        assert_eq!(serde_json::from_str::<Piece>(&text).expect("and back"), other);
    }
}
