//! A formula that resembles a missing term, for programs and as text.

use dgd_discover::{Discovery, FormulaGuess, GuessedTerm, UnexplainedError, Verdict};

use super::law;
use super::result_json::number;
use crate::output::quantity::rounded;
use crate::result::discover::{GuessEntry, GuessTermEntry, LawFile};

/// The sentence when no formula fits.
const NONE: &str = "no simple formula of the model’s names fits";

/// Whether formulas were searched: not if named effects or laws explain the recordings.
pub(super) fn is_told(discovery: &Discovery) -> bool {
    discovery.verdict == Verdict::Unexplained && discovery.rivals.is_empty()
}

/// As text, with its caveat. Code is between backticks.
pub(super) fn words(unexplained: &UnexplainedError) -> String {
    let Some(guess) = &unexplained.guess else { return NONE.to_owned() };
    let held_out = if guess.is_of_recordings {
        "on validation recordings"
    } else {
        "on parts of the recordings that it was not fitted to"
    };
    format!(
        "a guess, not a finding: what is missing looks like `{}`; R² {held_out} {}. With it in the model the \
         mean square of the errors falls from {} to {} times that of the noise. Nothing confirms that form.",
        guess.formula,
        rounded(guess.r2_held_out, 2),
        rounded(guess.left_before, 2),
        rounded(guess.left_after, 2),
    )
}

/// For programs.
pub(super) fn entry(guess: &FormulaGuess) -> GuessEntry {
    let term = |term: &GuessedTerm| GuessTermEntry {
        value: number(term.coefficient / term.unit.factor),
        unit: term.unit.symbol.to_string(),
        std: term.std.and_then(|std| number(std / term.unit.factor)),
        factor: term.factor.clone(),
    };
    GuessEntry {
        formula: guess.formula.clone(),
        coefficients: guess.terms.iter().map(term).collect(),
        r2_held_out: number(guess.r2_held_out),
        held_out: held_out(guess.is_of_recordings).to_owned(),
        left_before: number(guess.left_before),
        left_after: number(guess.left_after),
    }
}

/// What was held out.
pub(super) fn held_out(is_of_recordings: bool) -> &'static str {
    if is_of_recordings { "recordings" } else { "parts" }
}

/// The formula as an effect file, with its parameters and the ranges over which it was compared with recordings.
pub(super) fn as_file(guess: &FormulaGuess, file: &str) -> LawFile {
    LawFile {
        file: file.to_owned(),
        formula: guess.formula.clone(),
        parameters: guess.parameters.iter().map(law::constant).collect(),
        range: law::ranges(&guess.ranges),
    }
}
