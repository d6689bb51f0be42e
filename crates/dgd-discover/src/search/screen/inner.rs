//! Inner constants of an effect, which have no influence at its null, and the grids on which they are tried.

use dgd_compiler::effects::AddedItems;
use dgd_execute::LoadedSystem;
use dgd_identify::Recording;
use dgd_runtime::System;

use crate::library::{EffectCandidate, QuantityRanges};

/// Points of the grid of an onset: a fit converges from within a tenth of the recording.
pub(super) const ONSETS: usize = 12;

/// Points of the grid of other inner constants, with which effects change slowly.
const CONSTANTS: usize = 6;

/// An inner constant of an effect, and its grid.
pub(super) struct InnerConstant {
    pub(super) name: String,
    pub(super) lower: f64,
    pub(super) upper: f64,
    pub(super) log: bool,
    /// Points of its grid.
    pub(super) points: usize,
    pub(super) is_onset: bool,
    /// Its position among the candidate's inner constants.
    pub(super) place: usize,
}

impl InnerConstant {
    /// Its value at a point of the grid. The constants of one candidate traverse their grids in different orders, so
    /// that they do not move together.
    pub(super) fn value(&self, g: usize) -> f64 {
        // Strides coprime to 6 and 12.
        let stride = [1, 5, 7, 11][self.place % 4];
        let share = ((g * stride % self.points) as f64 + 0.5) / self.points as f64;
        if self.log {
            (self.lower.ln() + share * (self.upper / self.lower).ln()).exp()
        } else {
            self.lower + share * (self.upper - self.lower)
        }
    }

    /// A value at an offset, in fractions of the range, clamped to the range.
    pub(super) fn near(&self, value: f64, offset: f64) -> f64 {
        (value + offset * (self.upper - self.lower)).clamp(self.lower, self.upper)
    }
}

/// The inner constants of a candidate.
pub(super) fn inner_constants(
    system: &LoadedSystem,
    candidate: &EffectCandidate<'_>,
    brought: &AddedItems,
    recordings: &[Recording],
    ranges: &QuantityRanges,
) -> Vec<InnerConstant> {
    let names = brought.parameters.iter().filter(|name| !brought.null.contains(name));
    let parameters = names.filter_map(|name| {
        let parameter = system.signature().parameters.iter().find(|p| *p.name == **name)?;
        (!parameter.fixed).then_some((name, parameter))
    });
    let inner = parameters.enumerate().map(|(place, (name, parameter))| {
        let name_in_effect = brought.names.iter().find(|(_, new)| new == name).map(|(own, _)| own);
        let is_onset =
            name_in_effect.is_some_and(|name_in_effect| candidate.onsets.contains(name_in_effect));
        let size = if parameter.value == 0.0 { parameter.unit.factor } else { parameter.value };
        let (lower, upper) = if is_onset {
            let (first, last) = span(recordings);
            (first.max(parameter.lower), last.min(parameter.upper))
        } else if let (false, Some(range)) =
            (parameter.upper.is_finite(), range_of(candidate, &parameter.unit.symbol, ranges))
        {
            range
        } else {
            // Without a bound, a factor of five from the effect's declared value.
            let open = |bound: f64, other: f64| if bound.is_finite() { bound } else { other };
            (open(parameter.lower, size / 5.0), open(parameter.upper, size * 5.0))
        };
        let log = parameter.log && lower > 0.0 && !is_onset;
        let points = if is_onset { ONSETS } else { CONSTANTS };
        InnerConstant { name: name.clone(), lower, upper, log, points, is_onset, place }
    });
    inner.collect()
}

/// First and last time of the recordings.
fn span(recordings: &[Recording]) -> (f64, f64) {
    let times = recordings.iter().flat_map(|recording| &recording.times);
    times.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(*t), b.max(*t)))
}

/// The range of a template's argument, if a constant of the template has no bounds and the same unit, and so is a level
/// of it.
fn range_of(
    candidate: &EffectCandidate<'_>,
    unit: &str,
    ranges: &QuantityRanges,
) -> Option<(f64, f64)> {
    let arguments = &candidate.application.arguments;
    let range = ranges.iter().find(|(name, symbol, a, b)| {
        symbol == unit && a < b && arguments.iter().any(|argument| argument.text == *name)
    });
    range.map(|(_, _, a, b)| (*a, *b))
}
