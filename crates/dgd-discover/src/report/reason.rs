//! Explains the verdict in sentences that quote the numbers.

use std::fmt::Write as _;

use dgd_runtime::System;
use dgd_runtime::signature::number::short;

use crate::fit::{FittedStructure, SearchData, chi_square, mean, slack};
use crate::library::StructureId;
use crate::search::{EffectSearch, JudgedOutcome, Thresholds};

/// Mean squares of residuals relative to the noise's variance.
#[derive(Debug, Clone, Copy, PartialEq)]
struct RemainingError {
    training: f64,
    /// `None` without validation data, or if it cannot be simulated.
    validation: Option<f64>,
}

impl RemainingError {
    fn measure(fitted: &FittedStructure, data: &SearchData<'_>) -> RemainingError {
        let square = |residuals: &[Vec<Vec<f64>>]| mean(&chi_square(residuals, &data.noise));
        RemainingError {
            training: square(&fitted.residuals(data)).unwrap_or(f64::NAN),
            validation: fitted.held_out_residuals(data).and_then(|residuals| square(&residuals)),
        }
    }

    fn of_tried(search: &EffectSearch<'_>, structure: StructureId) -> RemainingError {
        RemainingError {
            training: search.training_square(structure).unwrap_or(f64::NAN),
            validation: search.held_out_square(structure),
        }
    }

    /// `1.02 times the noise variance (validation data: 1.05 times)`
    fn words(self) -> String {
        let mut words = format!("{} times the noise variance", ratio(self.training));
        if let Some(validation) = self.validation {
            let _ = write!(words, " (validation data: {} times)", ratio(validation));
        }
        words
    }

    /// Whether it is as small as noise.
    fn is_small(self, thresholds: &Thresholds) -> bool {
        self.training <= thresholds.explained
            && self.validation.is_none_or(|v| v <= thresholds.explained_held_out)
    }
}

/// An output whose residuals exceed its noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ExcessOutput {
    /// Its position.
    pub output: usize,
    /// Mean square of its residuals relative to the noise's variance.
    square: f64,
    /// The limit for noise.
    limit: f64,
    in_validation: bool,
}

impl ExcessOutput {
    /// The output furthest above its limit.
    pub(crate) fn find(
        fitted: &FittedStructure,
        data: &SearchData<'_>,
        thresholds: &Thresholds,
    ) -> Option<ExcessOutput> {
        let above = |residuals: Vec<Vec<Vec<f64>>>, limit: f64, in_validation: bool| {
            let squares = chi_square(&residuals, &data.noise);
            let slack = slack(&squares, &data.noise, thresholds.explained);
            let squares = squares.into_iter().zip(slack).enumerate();
            let squares = squares.filter(|(_, ((_, n), _))| *n > 0);
            let of_output = move |(output, ((sum, n), slack)): (usize, ((f64, usize), f64))| {
                ExcessOutput { output, square: sum / n as f64, limit: slack * limit, in_validation }
            };
            squares.map(of_output).collect::<Vec<ExcessOutput>>()
        };
        let training = above(fitted.residuals(data), thresholds.explained, false);
        let validation =
            (!data.valid.is_empty()).then(|| fitted.held_out_residuals(data)).flatten();
        let validation = validation.map(|all| above(all, thresholds.explained_held_out, true));
        let outputs = training.into_iter().chain(validation.into_iter().flatten());
        outputs
            .filter(|one| one.square > one.limit)
            .max_by(|a, b| (a.square / a.limit).total_cmp(&(b.square / b.limit)))
    }

    /// `have 1.19 times`, of training data or of validation data.
    pub(crate) fn words(&self) -> String {
        let place = if self.in_validation { "in validation data " } else { "" };
        format!("still have {place}{} times", ratio(self.square))
    }
}

/// The reason for a law or a plain cause. The base model and the corrected one are as reported, each with the data that
/// it was fitted to.
pub(crate) fn reason_of_law(
    (before, data): (&FittedStructure, &SearchData<'_>),
    (after, data_after): (&FittedStructure, &SearchData<'_>),
) -> String {
    format!(
        "{}.",
        falls(RemainingError::measure(before, data), RemainingError::measure(after, data_after))
    )
}

/// The reason for the verdict; `before` and `after` are the base model and the named one, as reported.
pub(crate) fn reason(
    search: &EffectSearch<'_>,
    outcome: JudgedOutcome,
    before: &FittedStructure,
    after: &FittedStructure,
    data: &SearchData<'_>,
) -> String {
    let names = |of: StructureId| {
        let names = of.effects().map(|c| format!("`{}`", search.called(c)));
        match names.collect::<Vec<String>>().as_slice() {
            [one, other] => format!("{one} and {other}"),
            [first @ .., last] if !first.is_empty() => format!("{}, and {last}", first.join(", ")),
            few => few.concat(),
        }
    };
    let thresholds = &search.thresholds;
    let base = RemainingError::measure(before, data);
    match outcome {
        JudgedOutcome::Sufficient => {
            let samples = search.training_error(StructureId::BASE).map_or(0, |(_, n)| n);
            sufficient(base, base.is_small(thresholds), search.is_noise(StructureId::BASE), samples)
        }
        JudgedOutcome::Effects(_) => {
            format!("{}.", falls(base, RemainingError::measure(after, data)))
        }
        JudgedOutcome::Most(structure) => format!(
            "The mean square of the residuals is {}. The recordings look as if there was {}: with it {} would be left. \
             That is more than noise, and too much to name it.",
            base.words(),
            names(structure),
            RemainingError::of_tried(search, structure).words()
        ),
        JudgedOutcome::NearlyAll(structure) => {
            let mut words = format!("{}.", falls(base, RemainingError::measure(after, data)));
            if ExcessOutput::find(after, data, thresholds).is_some() {
                words += " That is more than noise, so that something smaller is missing as well.";
            }
            if let Some(rival) = search.without_one_of(structure).filter(|rival| !rival.is_base()) {
                let _ = write!(
                    words,
                    " The closest that lacks {}, {}, leaves {}.",
                    if structure.len() == 1 { "this effect" } else { "one of these effects" },
                    names(rival),
                    RemainingError::of_tried(search, rival).words(),
                );
            }
            words
        }
        JudgedOutcome::Unexplained => {
            let base = RemainingError::of_tried(search, StructureId::BASE);
            if let Some((doubted, why)) = search.doubts() {
                let words = format!("The mean square of the residuals is {}", base.words());
                return match doubted {
                    StructureId::BASE => format!(
                        "{words}. That is little, but {why}, and no effect can be named for it."
                    ),
                    doubted => format!(
                        "{words}. With {} it is {}, but {why}.",
                        names(doubted),
                        RemainingError::of_tried(search, doubted).words()
                    ),
                };
            }
            let ranked = search.ranked();
            let is_less = |one: &StructureId| {
                !one.is_base() && RemainingError::of_tried(search, *one).training < base.training
            };
            let tried = ranked.iter().filter(|one| !one.is_base()).count();
            let words = format!("The mean square of the residuals is {}", base.words());
            match ranked.iter().copied().find(is_less) {
                Some(best) => format!(
                    "{words}. The best of what was tried, {}, leaves {}{}.",
                    names(best),
                    RemainingError::of_tried(search, best).words(),
                    why_not(search, best, data)
                ),
                None if tried == 0 && search.candidates.is_empty() => {
                    format!("{words}, and the library has no effect to try.")
                }
                None if tried == 0 => format!("{words}, and no effect could be fitted."),
                None => format!("{words}, and nothing that was tried leaves less."),
            }
        }
    }
}

/// The reason why the best of the structures is not named.
fn why_not(search: &EffectSearch<'_>, best: StructureId, data: &SearchData<'_>) -> String {
    let Some(fitted) = search.fitted(best) else { return String::new() };
    if let Some(excess) = ExcessOutput::find(fitted, data, &search.thresholds) {
        let output = &fitted.structure.system.signature().outputs[excess.output].name;
        return format!(
            ", which is too much to name it: the residuals of `{output}` {}, and at most {} pass for noise",
            excess.words(),
            ratio(excess.limit)
        );
    }
    if !data.valid.is_empty() && RemainingError::of_tried(search, best).validation.is_none() {
        return ", but with it the validation data cannot be simulated".to_owned();
    }
    if let Some([a, b]) = search.cancelling(best) {
        let [a, b] = [a, b].map(|c| search.called(c));
        return format!(
            ", but `{b}` largely cancels `{a}`: together they describe something that comes and goes, and \
             the data cannot identify either"
        );
    }
    if !search.is_sound(best) {
        return format!(
            ", but {}: an effect is named only at a size that its file allows",
            search.note(best)
        );
    }
    ", but it is not clearly better than what else was tried".to_owned()
}

fn falls(from: RemainingError, to: RemainingError) -> String {
    let word = if to.training < from.training { "falls" } else { "goes" };
    let mut words = format!(
        "The mean square of the residuals {word} from {} to {} times the noise variance",
        ratio(from.training),
        ratio(to.training)
    );
    if let (Some(from), Some(to)) = (from.validation, to.validation) {
        let _ = write!(words, " (validation data: from {} to {})", ratio(from), ratio(to));
    }
    words
}

/// The sentence for a model that needs no effect, by whether its residuals are as small as noise and whether tests
/// distinguish them from it.
fn sufficient(left: RemainingError, is_small: bool, is_noise: bool, samples: usize) -> String {
    let words = left.words();
    match (is_noise, is_small) {
        (true, true) => {
            format!("The residuals cannot be told from sensor noise: their mean square is {words}.")
        }
        (true, false) => format!(
            "The mean square of the residuals is {words}, which {samples} samples cannot tell from noise."
        ),
        (false, true) => format!(
            "The mean square of the residuals is {words}. They are not quite white, but no effect is worth \
             its place."
        ),
        (false, false) => format!(
            "The mean square of the residuals is {words}. That is more than noise, but no effect is worth its \
             place."
        ),
    }
}

/// A ratio of squares, to three digits or two decimals.
fn ratio(value: f64) -> String {
    match value {
        _ if value.is_nan() => "an unknown number of".to_owned(),
        _ if value < 9.995 => format!("{value:.2}"),
        _ if value < 99.95 => format!("{value:.1}"),
        _ if value < 1e6 => format!("{value:.0}"),
        _ => short(value, 2),
    }
}

/// A number to three digits.
pub(crate) fn significant(value: f64) -> String {
    short(value, 3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn left(training: f64, validation: f64) -> RemainingError {
        RemainingError { training, validation: Some(validation) }
    }

    #[test]
    fn a_model_is_said_to_leave_noise_only_where_it_does() {
        let thresholds = Thresholds::default();
        let said = |left: RemainingError, is_noise| {
            sufficient(left, left.is_small(&thresholds), is_noise, 20)
        };
        let noise = "cannot be told from sensor noise";
        assert!(said(left(1.0, 1.02), true).contains(noise));
        for (left, is_noise) in
            [(left(2.66, 1.0), true), (left(1.0, 2.66), true), (left(1.0, 1.0), false)]
        {
            let words = said(left, is_noise);
            assert!(!words.contains(noise), "{words}");
            assert!(words.contains(&left.words()), "{words}");
        }
        assert!(said(left(2.66, 1.0), true).contains("20 samples cannot tell"));
        assert!(said(left(2.66, 1.0), false).contains("more than noise"));
    }

    #[test]
    fn a_change_has_its_own_numbers_and_direction() {
        assert_eq!(
            falls(left(23.8, 206.0), left(1.12, 48.0)),
            "The mean square of the residuals falls from 23.8 to 1.12 times the noise variance (validation data: \
             from 206 to 48.0)"
        );
        let alone = |training| RemainingError { training, validation: None };
        let words = falls(alone(1.0), alone(1.1));
        assert!(words.contains("goes from 1.00 to 1.10 times the noise variance"), "{words}");
    }

    #[test]
    fn numbers_are_short() {
        let shown = [935.4, 3.957, 0.0123, 94_123.0, 52.0, 0.0, 9.4e7, 2e-5].map(significant);
        assert_eq!(shown, ["935", "3.96", "0.0123", "94123", "52", "0", "9.4·10⁷", "2·10⁻⁵"]);
        assert_eq!([0.999, 9.996, 99.96, 206.4].map(ratio), ["1.00", "10.0", "100", "206"]);
    }
}
