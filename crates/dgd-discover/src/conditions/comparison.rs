//! Compares known quantities with thresholds, and finds the threshold that best separates some cells from the rest.

use super::condition::ConditionKind;
use super::grid::{CellGrid, SHORTEST_SLOPE};
use super::known::{KnownKind, KnownQuantity};

/// Time spans of slopes, as fractions of the typical length of a window.
const SLOPE_LENGTHS: [f64; 3] = [0.2, 0.6, 1.8];
/// Number of thresholds compared for every shift.
const THRESHOLDS: usize = 256;

/// Penalty in balanced accuracy of a condition on anything other than the level of an input: of conditions that are
/// about equally good, the simplest is reported.
fn handicap(of: &KnownKind, kind: &ConditionKind) -> f64 {
    let quantity = match of {
        KnownKind::Input => 0.0,
        KnownKind::Output | KnownKind::Mode(_) => 0.02,
        KnownKind::Unknown => 0.04,
    };
    let comparison = match kind {
        ConditionKind::Above | ConditionKind::Below | ConditionKind::Mode(_) => 0.0,
        ConditionKind::Rising | ConditionKind::Falling => 0.01,
        ConditionKind::Changing => 0.02,
    };
    quantity + comparison
}

/// All comparisons of known quantities.
pub(super) fn comparisons(
    grid: &CellGrid,
    known: &[KnownQuantity],
    usual: f64,
) -> Vec<QuantityComparison> {
    let shortest = grid.begin.windows(2).map(|ends| ends[1] - ends[0]).min().unwrap_or(0);
    let mut lengths: Vec<usize> = SLOPE_LENGTHS
        .iter()
        .map(|share| {
            ((share * usual).round() as usize).clamp(SHORTEST_SLOPE, shortest / 4 + SHORTEST_SLOPE)
        })
        .collect();
    lengths.dedup();
    let mut comparisons = Vec::new();
    for (i, quantity) in known.iter().enumerate() {
        let values = grid.gathered(quantity);
        let mut add = |kind: ConditionKind, over: Option<usize>, values: &[f64]| {
            let handicap = handicap(&quantity.kind, &kind);
            comparisons.extend(QuantityComparison::new(i, kind, over, values, handicap));
        };
        if let KnownKind::Mode(modes) = &quantity.kind {
            for (m, mode) in modes.iter().enumerate() {
                let is_in = |value: &f64| f64::from(u8::from(value.round() == m as f64));
                let is_in: Vec<f64> = values.iter().map(is_in).collect();
                add(ConditionKind::Mode(mode.clone()), None, &is_in);
            }
            continue;
        }
        add(ConditionKind::Above, None, &values);
        add(ConditionKind::Below, None, &values);
        for &length in &lengths {
            let slopes = grid.slopes(&values, length);
            add(ConditionKind::Rising, Some(length), &slopes);
            add(ConditionKind::Falling, Some(length), &slopes);
            let sizes: Vec<f64> = slopes.iter().map(|slope| slope.abs()).collect();
            add(ConditionKind::Changing, Some(length), &sizes);
        }
    }
    comparisons
}

/// A comparison of one quantity with thresholds.
pub(super) struct QuantityComparison {
    /// Position of the quantity.
    pub(super) quantity: usize,
    pub(super) kind: ConditionKind,
    /// Number of cells over which a slope is taken.
    pub(super) over: Option<usize>,
    pub(super) handicap: f64,
    pub(super) values: Vec<f64>,
    /// Whether it holds below a threshold.
    pub(super) is_below: bool,
    /// Thresholds, ascending.
    pub(super) thresholds: Vec<f64>,
    /// Number of thresholds below each value; one more than the last if there is no value.
    pub(super) level: Vec<usize>,
    /// Number of cells between consecutive thresholds.
    pub(super) count: Vec<u32>,
}

/// The best split of time by a comparison.
#[derive(Debug, Clone, Copy)]
pub(super) struct ComparisonSplit {
    pub(super) threshold: f64,
    /// Balanced accuracy.
    pub(super) accuracy: f64,
}

impl QuantityComparison {
    /// `None` if all values are equal.
    pub(super) fn new(
        quantity: usize,
        kind: ConditionKind,
        over: Option<usize>,
        values: &[f64],
        handicap: f64,
    ) -> Option<QuantityComparison> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let is_below = matches!(kind, ConditionKind::Below | ConditionKind::Falling);
        let is_allowed = |threshold: f64| match kind {
            ConditionKind::Rising | ConditionKind::Changing => threshold >= 0.0,
            ConditionKind::Falling => threshold <= 0.0,
            ConditionKind::Above | ConditionKind::Below | ConditionKind::Mode(_) => true,
        };
        // Thresholds lie between neighbouring values that differ, at equal shares of time.
        let mut thresholds: Vec<f64> = Vec::new();
        for k in 1..THRESHOLDS {
            let rank = k * sorted.len() / THRESHOLDS;
            let Some(&x) = sorted.get(rank) else { continue };
            let below = sorted.partition_point(|other| *other < x);
            if below > 0 {
                let threshold = f64::midpoint(sorted[below - 1], x);
                if is_allowed(threshold) && thresholds.last() != Some(&threshold) {
                    thresholds.push(threshold);
                }
            }
        }
        if thresholds.is_empty() {
            return None;
        }
        let below = |x: &f64| thresholds.partition_point(|threshold| threshold < x);
        let level = |x: &f64| if x.is_finite() { below(x) } else { thresholds.len() + 1 };
        let level: Vec<usize> = values.iter().map(level).collect();
        let mut count = vec![0; thresholds.len() + 2];
        for level in &level {
            count[*level] += 1;
        }
        let values = values.to_vec();
        Some(QuantityComparison {
            quantity,
            kind,
            over,
            handicap,
            values,
            is_below,
            thresholds,
            level,
            count,
        })
    }

    /// The split that agrees best with windows of these cells.
    pub(super) fn best(&self, cells: &[usize]) -> Option<ComparisonSplit> {
        let mut within = vec![0_u32; self.count.len()];
        for cell in cells {
            within[self.level[*cell]] += 1;
        }
        let all_inside = cells.len() as f64;
        let all_outside = self.level.len() as f64 - all_inside;
        // Cells below the threshold; cells without a value are neither below nor above.
        let (mut inside, mut outside) = (0_u32, 0_u32);
        let known_inside = cells.len() as u32 - within[within.len() - 1];
        let known: u32 = self.count[..self.count.len() - 1].iter().sum();
        let known_outside = known - known_inside;
        let mut best: Option<ComparisonSplit> = None;
        for (i, threshold) in self.thresholds.iter().enumerate() {
            inside += within[i];
            outside += self.count[i] - within[i];
            let (held_inside, held_outside) = if self.is_below {
                (inside, outside)
            } else {
                (known_inside - inside, known_outside - outside)
            };
            let sensitivity = f64::from(held_inside) / all_inside;
            let specificity = 1.0 - f64::from(held_outside) / all_outside;
            let accuracy = 0.5 * (sensitivity + specificity);
            if best.is_none_or(|best| accuracy > best.accuracy) {
                best = Some(ComparisonSplit { threshold: *threshold, accuracy });
            }
        }
        best
    }

    /// The cells in which it holds.
    pub(super) fn holds(&self, split: &ComparisonSplit) -> Vec<bool> {
        let holds = |x: &f64| {
            if self.is_below { *x < split.threshold } else { *x > split.threshold }
        };
        self.values.iter().map(holds).collect()
    }
}
