//! Reduces the edges of an envelope to the visible outlines.
//!
//! A pixel column keeps its first and its last slice, both widened to the extreme edges between them: the drawn surface
//! covers the same pixels as the full one.

use crate::scene::ScenePoint;

/// An envelope at one x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct EnvelopeSlice {
    pub(crate) x: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// Closed outlines around the slices; a slice that is not finite ends one.
///
/// `columns` is the number of columns per pixel.
pub(crate) fn outlines(
    slices: impl Iterator<Item = EnvelopeSlice>,
    columns: f64,
) -> Vec<Vec<ScenePoint>> {
    let mut outlines = Vec::new();
    let mut kept: Vec<EnvelopeSlice> = Vec::new();
    // Start of the current column in `kept`, and its number.
    let mut column: Option<(usize, f64)> = None;
    for slice in slices {
        if !(slice.x.is_finite() && slice.low.is_finite() && slice.high.is_finite()) {
            outlines.extend(around(&kept));
            kept.clear();
            column = None;
            continue;
        }
        let place = (slice.x * columns).floor();
        match column {
            Some((first, same)) if same == place => widen(&mut kept, first, slice),
            _ => {
                column = Some((kept.len(), place));
                kept.push(slice);
            }
        }
    }
    outlines.extend(around(&kept));
    outlines
}

/// Merges a slice into the column that begins at `first` and has one or two slices.
fn widen(kept: &mut Vec<EnvelopeSlice>, first: usize, slice: EnvelopeSlice) {
    let so_far = kept[first];
    let (low, high) = (so_far.low.min(slice.low), so_far.high.max(slice.high));
    kept.truncate(first);
    kept.push(EnvelopeSlice { x: so_far.x, low, high });
    kept.push(EnvelopeSlice { x: slice.x, low, high });
}

/// Along one edge and back along the other; a single slice has no interior.
fn around(slices: &[EnvelopeSlice]) -> Option<Vec<ScenePoint>> {
    let there = slices.iter().map(|slice| (slice.x, slice.low));
    let back = slices.iter().rev().map(|slice| (slice.x, slice.high));
    (slices.len() > 1).then(|| there.chain(back).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slices(all: &[(f64, f64, f64)]) -> impl Iterator<Item = EnvelopeSlice> {
        all.iter().map(|&(x, low, high)| EnvelopeSlice { x, low, high })
    }

    #[test]
    fn an_outline_goes_there_and_back_and_ends_at_a_gap() {
        let all = [
            (0.0, 1.0, 2.0),
            (1.0, 1.5, 3.0),
            (2.0, f64::NAN, 1.0),
            (3.0, 0.0, 1.0),
            (4.0, 0.0, f64::INFINITY),
        ];
        let drawn = outlines(slices(&all), 1.0);
        assert_eq!(drawn, [vec![(0.0, 1.0), (1.0, 1.5), (1.0, 3.0), (0.0, 2.0)]]);
        assert!(outlines(slices(&[]), 1.0).is_empty());
    }

    #[test]
    fn a_column_is_as_wide_as_its_widest_slices() {
        let all = [(0.1, 1.0, 2.0), (0.2, 0.5, 1.0), (0.3, 2.0, 9.0), (0.4, 1.0, 2.0)];
        let drawn = outlines(slices(&all), 1.0);
        assert_eq!(drawn, [vec![(0.1, 0.5), (0.4, 0.5), (0.4, 9.0), (0.1, 9.0)]]);
    }

    #[test]
    fn a_million_slices_become_two_per_column() {
        let n = 1_000_000;
        let slice = |i: i32| {
            let y = f64::from(i % 17);
            EnvelopeSlice { x: 300.0 * f64::from(i) / f64::from(n), low: y - 1.0, high: y + 1.0 }
        };
        let drawn = outlines((0..n).map(slice), 2.0);
        assert_eq!(drawn.len(), 1);
        assert_eq!(drawn[0].len(), 4 * 600);
    }
}
