//! A formula that resembles a missing term, as text and JSON.

use dgd_discover::{Discovery, FormulaGuess, UnexplainedError, Verdict};
use serde_json::{Value, json};

use super::law;
use super::result_json::tidy;
use crate::output::quantity::rounded;

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

/// For programs; `null` without a formula.
pub(super) fn value(guess: Option<&FormulaGuess>) -> Value {
    let Some(guess) = guess else { return Value::Null };
    let coefficients: Vec<Value> = (guess.terms.iter())
        .map(|term| {
            json!({
                "value": tidy(term.coefficient / term.unit.factor),
                "unit": term.unit.symbol,
                "std": term.std.map(|std| tidy(std / term.unit.factor)),
                "factor": term.factor,
            })
        })
        .collect();
    json!({
        "formula": guess.formula,
        "coefficients": coefficients,
        "r2_held_out": tidy(guess.r2_held_out),
        "held_out": if guess.is_of_recordings { "recordings" } else { "parts" },
        "left_before": tidy(guess.left_before),
        "left_after": tidy(guess.left_after),
    })
}

/// The formula as an effect file, with its parameters and the ranges over which it was compared with recordings.
pub(super) fn as_file(guess: &FormulaGuess, file: &str) -> Value {
    json!({
        "file": file,
        "formula": guess.formula,
        "parameters": guess.parameters.iter().map(law::constant).collect::<Vec<_>>(),
        "range": law::ranges(&guess.ranges),
    })
}
