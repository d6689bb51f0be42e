//! Over what levels the quantities of a model go, for the grids of constants that are such levels.

use super::candidates::Candidate;

/// The least and the largest value of each unknown and of each output, with its unit.
pub(crate) type Ranges = Vec<(String, String, f64, f64)>;

/// The range of what a template is applied to, where a constant of it without bounds is in its unit:
/// there it is a level of that.
pub(crate) fn range_of(
    candidate: &Candidate<'_>,
    unit: &str,
    ranges: &Ranges,
) -> Option<(f64, f64)> {
    let arguments = &candidate.application.arguments;
    let found = ranges.iter().find(|(name, symbol, a, b)| {
        symbol == unit && a < b && arguments.iter().any(|argument| argument.text == *name)
    });
    found.map(|(_, _, a, b)| (*a, *b))
}
