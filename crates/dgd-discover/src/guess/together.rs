//! Finds quantities that correlate with a trace: names of the model and time, tested on recordings not used for
//! learning.
//!
//! The trace is averaged over blocks, as for formulas. A curve over one quantity consists of the means in a few ranks
//! of the quantity, joined by straight lines; a monotone curve pools neighbours that violate the order (Barlow,
//! Bartholomew, Bremner & Brunk, Statistical Inference under Order Restrictions, 1972). Both are learnt from training
//! recordings and predict the validation ones; without any, each recording is predicted from the others, and tenths of
//! a single one from the rest.
//!
//! Slow quantities correlate by chance, so this only suggests where to look.

use super::formula::{FormulaFactor, FormulaShape};
use super::moments::{FOLDS, InputTrace, blocks};
use super::regression::DECENT;

/// A quantity that correlates with a trace.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrelatedQuantity {
    /// A name of the model, or `time`.
    pub quantity: String,
    /// How the trace changes as the quantity grows.
    pub course: TraceCourse,
    /// 1 − Σ w (d − curve)²/Σ w (d − mean)² on data from which the curve was not learnt.
    pub r2: f64,
    /// Whether R² is from other recordings rather than from parts of one.
    pub is_of_recordings: bool,
}

/// How a trace changes as a quantity grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TraceCourse {
    /// It grows.
    Rises,
    /// It shrinks.
    Falls,
    /// It does both.
    Turns,
}

/// Number of quantities reported.
const TOLD: usize = 3;
/// Maximum number of ranks of a quantity, and minimum number of blocks in each.
const RANKS: usize = 12;
const IN_A_RANK: usize = 4;
/// Relative increase of the residual up to which a monotone curve is preferred.
const NEARLY_AS_GOOD: f64 = 0.1;

/// A block or a point of a curve: its weight, the quantity and the missing term.
#[derive(Debug, Clone, Copy)]
struct CurvePoint {
    weight: f64,
    x: f64,
    d: f64,
}

/// The blocks from which a curve is learnt, and those that it predicts.
struct BlockSplit {
    learnt: Vec<CurvePoint>,
    predicted: Vec<CurvePoint>,
}

/// Blocks of a recording: all names and the missing term.
struct RecordingBlocks {
    /// Number of columns before the names.
    skipped: usize,
    rows: Vec<(f64, Vec<f64>)>,
}

/// Quantities that correlate with a trace, the closest first.
pub(crate) fn together(
    train: &[InputTrace],
    held_out: &[InputTrace],
    names: &[FormulaFactor],
) -> Vec<CorrelatedQuantity> {
    let shapes: Vec<FormulaShape> =
        (0..names.len()).map(|i| FormulaShape::new(vec![(i, 0)])).collect();
    let of_trace = |trace: &InputTrace| {
        // The equation's parameters and a constant come first.
        RecordingBlocks { skipped: trace.parameters.len() + 1, rows: blocks(trace, &shapes) }
    };
    let train: Vec<RecordingBlocks> = train.iter().map(of_trace).collect();
    let held_out: Vec<RecordingBlocks> = held_out.iter().map(of_trace).collect();
    let is_of_recordings = !held_out.is_empty() || train.len() > 1;
    let mut candidates: Vec<CorrelatedQuantity> = (names.iter().enumerate())
        .filter_map(|(i, factor)| {
            let points = |all: &[RecordingBlocks]| {
                all.iter().map(|blocks| blocks.curve_over(i)).collect::<Vec<_>>()
            };
            let (course, r2) = course(&splits(points(&train), &points(&held_out)))?;
            let quantity = factor.name.clone();
            (r2 >= DECENT).then_some(CorrelatedQuantity { quantity, course, r2, is_of_recordings })
        })
        .collect();
    candidates.sort_by(|a, b| b.r2.total_cmp(&a.r2));
    candidates.truncate(TOLD);
    candidates
}

impl RecordingBlocks {
    /// The missing term against one of the names.
    fn curve_over(&self, name: usize) -> Vec<CurvePoint> {
        let point = |(weight, row): &(f64, Vec<f64>)| CurvePoint {
            weight: *weight,
            x: row[self.skipped + name],
            d: row[row.len() - 1],
        };
        self.rows.iter().map(point).collect()
    }
}

/// Recordings, or parts of one, that predict each other.
fn splits(train: Vec<Vec<CurvePoint>>, held_out: &[Vec<CurvePoint>]) -> Vec<BlockSplit> {
    if !held_out.is_empty() {
        return vec![BlockSplit { learnt: train.concat(), predicted: held_out.concat() }];
    }
    let parts = match <[Vec<CurvePoint>; 1]>::try_from(train) {
        Ok([one]) => {
            one.chunks(one.len().div_ceil(FOLDS).max(1)).map(<[CurvePoint]>::to_vec).collect()
        }
        Err(several) => several,
    };
    let others = |k: usize| {
        let rest = parts.iter().enumerate().filter(|(other, _)| *other != k);
        rest.flat_map(|(_, part)| part.iter().copied()).collect()
    };
    (0..parts.len())
        .map(|k| BlockSplit { learnt: others(k), predicted: parts[k].clone() })
        .collect()
}

/// The course of the missing term over a quantity, and its R²; `None` if there is too little data.
fn course(splits: &[BlockSplit]) -> Option<(TraceCourse, f64)> {
    let (mut around_mean, mut left) = (0.0, [0.0; 3]);
    for BlockSplit { learnt, predicted } in splits {
        let means = means(learnt)?;
        let mean = learnt.iter().copied().reduce(pooled)?.d;
        let curves = [monotone(&means, 1.0), monotone(&means, -1.0), means];
        for CurvePoint { weight, x, d } in predicted {
            around_mean += weight * (d - mean).powi(2);
            for (left, curve) in left.iter_mut().zip(&curves) {
                *left += weight * (d - interpolated(curve, *x)).powi(2);
            }
        }
    }
    if !(around_mean > 0.0 && left.iter().all(|left| left.is_finite())) {
        return None;
    }
    let [rising, falling, any] = left.map(|left| left / around_mean);
    let (course, left) = if rising <= falling {
        (TraceCourse::Rises, rising)
    } else {
        (TraceCourse::Falls, falling)
    };
    let is_monotone = left <= (1.0 + NEARLY_AS_GOOD) * any;
    let (course, left) = if is_monotone { (course, left) } else { (TraceCourse::Turns, any) };
    Some((course, 1.0 - left))
}

/// Weighted means of blocks in ranks of the quantity, in ascending order.
fn means(blocks: &[CurvePoint]) -> Option<Vec<CurvePoint>> {
    let mut sorted = blocks.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x));
    let (low, high) = (sorted.first()?.x, sorted.last()?.x);
    let ranks = (sorted.len() / IN_A_RANK).min(RANKS);
    if ranks < 2 || low >= high {
        return None;
    }
    let of_rank = |k: usize| {
        let members = &sorted[k * sorted.len() / ranks..(k + 1) * sorted.len() / ranks];
        members.iter().copied().reduce(pooled)
    };
    let mut points: Vec<CurvePoint> = (0..ranks).filter_map(of_rank).collect();
    // A constant quantity fills several ranks with one value.
    points.dedup_by(|next, before| {
        let is_same = next.x <= before.x;
        if is_same {
            *before = pooled(*before, *next);
        }
        is_same
    });
    (points.len() > 1).then_some(points)
}

fn pooled(a: CurvePoint, b: CurvePoint) -> CurvePoint {
    let weight = a.weight + b.weight;
    let mean = |x: f64, y: f64| (a.weight * x + b.weight * y) / weight;
    CurvePoint { weight, x: mean(a.x, b.x), d: mean(a.d, b.d) }
}

/// The rising curve closest to some means or, with a sign of −1, the falling one.
fn monotone(means: &[CurvePoint], sign: f64) -> Vec<CurvePoint> {
    let mut levels: Vec<(CurvePoint, usize)> = Vec::new();
    for mean in means {
        let mut level = (*mean, 1);
        while let Some((before, n)) =
            levels.pop_if(|(before, _)| sign * before.d > sign * level.0.d)
        {
            level = (pooled(before, level.0), n + level.1);
        }
        levels.push(level);
    }
    let values = levels.iter().flat_map(|(level, n)| std::iter::repeat_n(level.d, *n));
    means.iter().zip(values).map(|(mean, d)| CurvePoint { d, ..*mean }).collect()
}

/// The value of a curve: linear between its points, constant beyond its ends.
fn interpolated(curve: &[CurvePoint], x: f64) -> f64 {
    let after = curve.partition_point(|point| point.x <= x);
    match (after.checked_sub(1).map(|k| curve[k]), curve.get(after)) {
        (Some(a), Some(b)) => a.d + (b.d - a.d) * (x - a.x) / (b.x - a.x),
        (Some(end), None) => end.d,
        (None, Some(end)) => end.d,
        (None, None) => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use dgd_compiler::units::parse_unit;

    use super::{TraceCourse, together};
    use crate::guess::formula::FormulaFactor;
    use crate::guess::moments::InputTrace;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::Rng;

    const SAMPLES: usize = 400;

    /// The missing term as a function of a quantity.
    type Missing = fn(f64) -> f64;

    /// A trace that is a function of `x`, and an unrelated quantity `y`.
    fn trace(seed: u64, scale: f64, d: Missing) -> InputTrace {
        let mut random = Pcg64::new(u128::from(seed), 5);
        let mut steps = |length: usize| {
            let mut level = 0.0;
            let mut next = |k: usize| {
                if k.is_multiple_of(length) {
                    let unit = (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
                    level = 2.0 * unit - 1.0;
                }
                level
            };
            (0..SAMPLES).map(&mut next).collect::<Vec<f64>>()
        };
        let names = [steps(3), steps(5)];
        let errors = steps(1);
        let value = names[0].iter().zip(&errors).map(|(x, e)| d(*x) + 0.1 * e).collect();
        let scaled = names.iter().map(|all| all.iter().map(|x| scale * x).collect()).collect();
        InputTrace {
            times: (0..SAMPLES).map(|k| k as f64).collect(),
            value,
            std: vec![0.1; SAMPLES],
            resolved: 1.0,
            names: scaled,
            parameters: vec![vec![1.0; SAMPLES]],
        }
    }

    fn names() -> Vec<FormulaFactor> {
        let factor = |name: &str| FormulaFactor {
            name: name.to_owned(),
            unit: parse_unit("m").expect("a unit"),
            difference: None,
        };
        vec![factor("x"), factor("y")]
    }

    #[test]
    fn the_quantity_and_the_course_are_found_in_any_unit() {
        let courses: [(Missing, TraceCourse); 4] = [
            (|x| x, TraceCourse::Rises),
            (|x| -x.powi(3), TraceCourse::Falls),
            (|x| (4.0 * x).tanh(), TraceCourse::Rises),
            (|x| x * x, TraceCourse::Turns),
        ];
        for (d, course) in courses {
            for scale in [1.0, 1e-4] {
                for held_out in [vec![trace(2, scale, d)], Vec::new()] {
                    let found = together(&[trace(1, scale, d)], &held_out, &names());
                    assert_eq!(found.len(), 1, "{found:?}");
                    assert_eq!((&*found[0].quantity, found[0].course), ("x", course));
                    assert!(found[0].r2 > 0.8, "{found:?}");
                    assert_eq!(found[0].is_of_recordings, !held_out.is_empty());
                }
            }
        }
    }

    #[test]
    fn noise_goes_together_with_nothing() {
        for seed in 0..20 {
            let found = together(
                &[trace(seed, 1.0, |_| 0.0)],
                &[trace(seed + 100, 1.0, |_| 0.0)],
                &names(),
            );
            assert!(found.is_empty(), "{found:?}");
        }
    }

    #[test]
    fn another_recording_decides() {
        // The second recording contradicts the first.
        let found = together(
            &[trace(1, 1.0, |x| x), trace(2, 1.0, |x| -x)],
            &[trace(3, 1.0, |x| x)],
            &names(),
        );
        assert!(found.is_empty(), "{found:?}");
        let found = together(&[trace(1, 1.0, |x| x), trace(2, 1.0, |x| -x)], &[], &names());
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn a_quantity_that_rests_goes_together_with_nothing() {
        let resting = |seed| {
            let mut trace = trace(seed, 1.0, |x| x);
            trace.names[0].fill(1.0);
            trace
        };
        let found = together(&[resting(1)], &[resting(2)], &names());
        assert!(found.is_empty(), "{found:?}");
    }
}
