//! The operating condition that coincides with windows.
//!
//! A discrepancy that comes and goes has a cause, often one that the user knows: a flow that falls, a level above a
//! rim. The level and the slope of every known quantity x are compared with the windows,
//!
//! ```text
//!   x > c   x < c        above, below
//!   ẋ > c   ẋ < −c       rising, falling      ẋ: least squares over the last T seconds
//!   |ẋ| > c              changing
//!   mode = m
//! ```
//!
//! and c maximises the balanced accuracy (P(condition | window) + P(no condition | no window))/2: Youden's index, which
//! does not depend on the share of time within windows.
//!
//! Some quantity always agrees best. So the search is repeated 499 times with the windows of every recording shifted
//! circularly by a random time: that preserves the lengths and order of the windows and all trends and rhythms of
//! quantities, but destroys their association. The best of *all* quantities counts, so that the p-value accounts for
//! the search and for autocorrelation.
//!
//! A circle has no beginning. A window that sets in once and lasts, and a quantity that drifts or steps once, would
//! seem to be associated; so at least two windows must begin and end within a recording, and the condition must set in
//! anew with each.
//!
//! Sources: Youden, Index for rating diagnostic tests, Cancer 3 (1950) 32–35; Harris, A shift test for
//! independence in generic time series (2020).

use dgd_runtime::Unit;
use dgd_screen::noise::median;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use super::comparison::{ComparisonSplit, QuantityComparison, comparisons};
use super::grid::CellGrid;
use super::known::{KnownKind, KnownQuantity};

/// A condition that holds in the windows and rarely outside them.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowCondition {
    /// Name of the quantity.
    pub quantity: String,
    /// How the quantity is compared.
    pub kind: ConditionKind,
    /// The threshold, SI: a level, or the magnitude of a slope per second; `None` for a mode.
    pub threshold: Option<f64>,
    /// Unit of the quantity.
    pub unit: Unit,
    /// Time span before each moment over which a slope is taken, s.
    pub over: Option<f64>,
    /// Fraction of the time within windows in which it holds.
    pub share_inside: f64,
    /// Fraction of the remaining time in which it holds.
    pub share_outside: f64,
    /// Probability that windows unrelated to all known quantities agree as well with one of them.
    pub p_value: f64,
    /// Number of shifts of the windows behind the p-value.
    pub shifts: usize,
}

/// How a quantity is compared with a threshold.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ConditionKind {
    /// Its level is above.
    Above,
    /// Its level is below.
    Below,
    /// It rises faster.
    Rising,
    /// It falls faster.
    Falling,
    /// It rises or falls faster.
    Changing,
    /// It is in the mode of this name.
    Mode(String),
}

/// Minimum balanced accuracy of a condition.
const BALANCED_ACCURACY: f64 = 0.8;
/// Minimum number of windows that begin and end within a recording, each with a new onset of the condition.
const EPISODES: usize = 2;
/// Number of shifts, and the largest share of them that may do as well as no shift: a slope over 200 s tolerates shifts
/// of a minute, which are one in a hundred in a recording of two hours.
const SHIFTS: usize = 499;
const SIGNIFICANT: f64 = 0.05;

/// The condition that coincides with the windows more closely than by chance, if any.
///
/// | name | shape | unit |
/// |---|---|---|
/// | `times` | samples of each recording | s |
/// | `windows` | from, until for each window of each recording | s |
/// | `known` | each with a value for each sample of each recording | SI |
///
/// Reproducible: shifts are drawn with a fixed seed.
///
/// # Panics
///
/// If the number of recordings or samples differs from that of the times.
pub fn condition(
    times: &[Vec<f64>],
    windows: &[Vec<[f64; 2]>],
    known: &[KnownQuantity],
) -> Option<WindowCondition> {
    assert_eq!(times.len(), windows.len(), "windows of each recording");
    let grid = CellGrid::new(times)?;
    let inside = grid.inside(windows);
    let n_inside = inside.iter().filter(|inside| **inside).count();
    if n_inside < EPISODES || inside.len() - n_inside < EPISODES {
        return None;
    }
    let episodes = grid.episodes(&inside);
    let closed = episodes.iter().filter(|episode| episode.is_closed).count();
    if closed < EPISODES {
        return None;
    }
    let mut lengths: Vec<f64> = episodes.iter().map(|e| (e.until - e.from) as f64).collect();
    let usual = median(&mut lengths)?;

    let comparisons = comparisons(&grid, known, usual);
    let cells: Vec<usize> = (0..inside.len()).filter(|cell| inside[*cell]).collect();
    let mut best: Vec<(f64, usize, ComparisonSplit)> = comparisons
        .iter()
        .enumerate()
        .filter_map(|(i, comparison)| {
            let split = comparison.best(&cells)?;
            Some((split.accuracy - comparison.handicap, i, split))
        })
        .collect();
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (score, comparison, split) = best.iter().find_map(|(score, i, split)| {
        let holds = comparisons[*i].holds(split);
        let is_one =
            split.accuracy >= BALANCED_ACCURACY && grid.comes_anew(&holds, &episodes) >= EPISODES;
        is_one.then_some((*score, &comparisons[*i], split))
    })?;
    let p_value = p_value(&grid, &cells, &comparisons, score)?;

    let quantity = &known[comparison.quantity];
    let holds = comparison.holds(split);
    let share = |within: bool| {
        let those = holds.iter().zip(&inside).filter(|(_, inside)| **inside == within);
        let (total, held) =
            those.fold((0, 0), |(total, n), (holds, _)| (total + 1, n + usize::from(*holds)));
        f64::from(held as u32) / f64::from(total as u32)
    };
    Some(WindowCondition {
        quantity: quantity.name.clone(),
        kind: comparison.kind.clone(),
        threshold: match comparison.kind {
            ConditionKind::Mode(_) => None,
            ConditionKind::Falling => Some(-split.threshold),
            _ => Some(split.threshold),
        },
        unit: quantity.unit.clone(),
        over: comparison.over.map(|cells| cells as f64 * grid.width),
        share_inside: share(true),
        share_outside: share(false),
        p_value,
        shifts: SHIFTS,
    })
}

/// Whether a condition on a quantity holds at each sample of each recording.
pub(super) fn holds(
    times: &[Vec<f64>],
    condition: &WindowCondition,
    known: &KnownQuantity,
) -> Option<Vec<Vec<bool>>> {
    let grid = CellGrid::new(times)?;
    let values = grid.gathered(known);
    let values = match condition.over {
        Some(over) => grid.slopes(&values, (over / grid.width).round() as usize),
        None => values,
    };
    let threshold = condition.threshold.unwrap_or(f64::NAN);
    let holds = |cell: &usize| {
        let x = values[*cell];
        match (&condition.kind, &known.kind) {
            (ConditionKind::Above | ConditionKind::Rising, _) => x > threshold,
            (ConditionKind::Below, _) => x < threshold,
            (ConditionKind::Falling, _) => x < -threshold,
            (ConditionKind::Changing, _) => x.abs() > threshold,
            (ConditionKind::Mode(name), KnownKind::Mode(modes)) => {
                modes.iter().position(|mode| mode == name).is_some_and(|m| x.round() == m as f64)
            }
            (ConditionKind::Mode(_), _) => false,
        }
    };
    Some(grid.cell_of.iter().map(|cells| cells.iter().map(holds).collect()).collect())
}

/// How often the best of all comparisons does as well with shifted windows; `None` if too often.
fn p_value(
    grid: &CellGrid,
    cells: &[usize],
    all: &[QuantityComparison],
    score: f64,
) -> Option<f64> {
    let mut random = Pcg64::new(1, 5);
    let mut as_good = 1;
    let mut shifted = vec![0; cells.len()];
    for _ in 0..SHIFTS {
        let shifts: Vec<usize> = (grid.begin.windows(2))
            .map(|ends| (random.next_u64() % (ends[1] - ends[0]) as u64) as usize)
            .collect();
        for (shifted, cell) in shifted.iter_mut().zip(cells) {
            let r = grid.recording(*cell);
            let (first, end) = (grid.begin[r], grid.begin[r + 1]);
            *shifted = first + (cell - first + shifts[r]) % (end - first);
        }
        let is_as_good = all.iter().any(|comparison| {
            let best = comparison.best(&shifted);
            best.is_some_and(|best| best.accuracy - comparison.handicap >= score)
        });
        as_good += usize::from(is_as_good);
        if as_good as f64 > SIGNIFICANT * (SHIFTS + 1) as f64 {
            return None;
        }
    }
    Some(as_good as f64 / (SHIFTS + 1) as f64)
}
