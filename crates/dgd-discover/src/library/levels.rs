//! Ranges of a model's quantities, for grids of constants that are levels of them.

use super::candidates::EffectCandidate;

/// Name, unit, minimum and maximum of each unknown and each output.
pub(crate) type QuantityRanges = Vec<(String, String, f64, f64)>;

/// The range of a template's argument, if a constant of the template has no bounds and the same unit, and so is a level
/// of it.
pub(crate) fn range_of(
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
