//! The operating condition that windows go together with.
//!
//! A discrepancy that comes and goes has a reason, and often one that the user knows: a flow that
//! falls, a level above a rim. Of every known quantity x, its level and its slope are compared with
//! the windows,
//!
//! ```text
//!   x > c   x < c        above, below
//!   ẋ > c   ẋ < −c       rising, falling      ẋ: least squares over the last T seconds
//!   |ẋ| > c              changing
//!   mode = m
//! ```
//!
//! and c is where the balanced accuracy (P(condition | window) + P(no condition | no window))/2 is
//! greatest: Youden's index, which does not depend on how much of the time windows take.
//!
//! Something always goes together best. So the same search is made with the windows of every recording
//! shifted in a circle by a random time, 499 times: that keeps the lengths and the order of the windows
//! and all that quantities have of trends and rhythms, and destroys what both have in common. The best of
//! *all* quantities counts there, so that the p-value pays for the search and for autocorrelation.
//!
//! A circle has no beginning. What sets in once and lasts, and what drifts or steps once, would look
//! like a coincidence in it that is none; so two windows at least have to begin and end within a
//! recording, and the condition has to come anew with each.
//!
//! Sources: Youden, Index for rating diagnostic tests, Cancer 3 (1950) 32–35; Harris, A shift test for
//! independence in generic time series (2020).

use dgd_runtime::Unit;
use dgd_screen::noise::median;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use super::known::{KnownKind, KnownQuantity};

/// A condition that holds in the windows and rarely beside them.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// The name of what it is about.
    pub quantity: String,
    /// How that is compared.
    pub kind: ConditionKind,
    /// With what, SI: a level, or the size of a slope per second; of a mode nothing.
    pub threshold: Option<f64>,
    /// Unit of the quantity.
    pub unit: Unit,
    /// The seconds before each moment that a slope is taken over.
    pub over: Option<f64>,
    /// Share of the time within windows in which it holds.
    pub share_inside: f64,
    /// Share of the rest of the time.
    pub share_outside: f64,
    /// Probability that windows which have nothing to do with any known quantity go together with one
    /// as well.
    pub p_value: f64,
    /// Shifts of the windows behind that.
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

/// Cells of time that recordings are cut into, together.
const CELLS: f64 = 2000.0;
/// Lengths of slopes, of the usual length of a window.
const SLOPE_LENGTHS: [f64; 3] = [0.2, 0.6, 1.8];
/// Cells that a slope needs to be one.
const SHORTEST_SLOPE: usize = 4;
/// Thresholds that are compared with every shift.
const THRESHOLDS: usize = 256;
/// A condition must tell windows from the rest at least this well.
const BALANCED_ACCURACY: f64 = 0.8;
/// Windows that begin and end within a recording, each with a new onset of the condition.
const EPISODES: usize = 2;
/// Shifts, and how often one may do as well as no shift: a slope over 200 s allows shifts of a minute, which
/// are one in a hundred of a recording of two hours.
const SHIFTS: usize = 499;
const SIGNIFICANT: f64 = 0.05;

/// What a condition costs in balanced accuracy that is about something else than the level of an input:
/// of conditions that are about equally good, the simplest is said.
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

/// The condition that coincides with the windows, if one does by more than chance.
///
/// | name | shape | unit |
/// |---|---|---|
/// | `times` | samples of each recording | s |
/// | `windows` | from, until for each window of each recording | s |
/// | `known` | each with a value for each sample of each recording | SI |
///
/// The same windows give the same condition: shifts are drawn with a fixed seed.
///
/// # Panics
///
/// When there are other numbers of recordings or samples than times.
pub fn condition(
    times: &[Vec<f64>],
    windows: &[Vec<[f64; 2]>],
    known: &[KnownQuantity],
) -> Option<Condition> {
    assert_eq!(times.len(), windows.len(), "windows of each recording");
    let grid = Grid::new(times)?;
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

    let all = comparisons(&grid, known, usual);
    let cells: Vec<usize> = (0..inside.len()).filter(|cell| inside[*cell]).collect();
    let mut best: Vec<(f64, usize, Split)> = all
        .iter()
        .enumerate()
        .filter_map(|(i, comparison)| {
            let split = comparison.best(&cells)?;
            Some((split.accuracy - comparison.handicap, i, split))
        })
        .collect();
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (score, comparison, split) = best.iter().find_map(|(score, i, split)| {
        let holds = all[*i].holds(split);
        let is_one =
            split.accuracy >= BALANCED_ACCURACY && grid.comes_anew(&holds, &episodes) >= EPISODES;
        is_one.then_some((*score, &all[*i], split))
    })?;
    let p_value = p_value(&grid, &cells, &all, score)?;

    let quantity = &known[comparison.quantity];
    let holds = comparison.holds(split);
    let share = |within: bool| {
        let those = holds.iter().zip(&inside).filter(|(_, inside)| **inside == within);
        let (all, held) =
            those.fold((0, 0), |(all, n), (holds, _)| (all + 1, n + usize::from(*holds)));
        f64::from(held as u32) / f64::from(all as u32)
    };
    Some(Condition {
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

/// How often the best of all comparisons does as well when windows are shifted; `None` where that is too
/// often.
fn p_value(grid: &Grid, cells: &[usize], all: &[Comparison], score: f64) -> Option<f64> {
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

/// Equal cells of time, those of one recording after those of the other.
struct Grid {
    /// Length of a cell, s.
    width: f64,
    /// Middle of each cell, s.
    middles: Vec<f64>,
    /// First cell of each recording; one more than recordings.
    begin: Vec<usize>,
    /// Cell of each sample of each recording.
    cell_of: Vec<Vec<usize>>,
}

/// Windows that are neighbouring cells.
struct Episode {
    from: usize,
    until: usize,
    /// Whether it begins and ends within its recording.
    is_closed: bool,
}

impl Grid {
    fn new(times: &[Vec<f64>]) -> Option<Grid> {
        let duration = |times: &Vec<f64>| Some(times.last()? - times.first()?);
        let all: f64 = times.iter().filter_map(duration).sum();
        let mut spacings: Vec<f64> = (times.iter().flat_map(|times| times.windows(2)))
            .map(|pair| pair[1] - pair[0])
            .filter(|h| *h > 0.0)
            .collect();
        let width = median(&mut spacings)?.max(all / CELLS);
        let (mut middles, mut begin, mut cell_of) = (Vec::new(), vec![0], Vec::new());
        for times in times {
            let first = *times.first()?;
            let start = middles.len();
            let cell = |t: &f64| start + ((t - first) / width).round() as usize;
            cell_of.push(times.iter().map(cell).collect::<Vec<_>>());
            let end = cell(times.last()?) + 1;
            middles.extend((0..end - start).map(|cell| first + cell as f64 * width));
            begin.push(end);
        }
        Some(Grid { width, middles, begin, cell_of })
    }

    fn recording(&self, cell: usize) -> usize {
        self.begin.partition_point(|begin| *begin <= cell) - 1
    }

    fn inside(&self, windows: &[Vec<[f64; 2]>]) -> Vec<bool> {
        let within = |(cell, t): (usize, &f64)| {
            let windows = &windows[self.recording(cell)];
            // A window shorter than a cell has its middle in one.
            let half = 0.5 * self.width;
            windows.iter().any(|[from, until]| (from - half..until + half).contains(t))
        };
        self.middles.iter().enumerate().map(within).collect()
    }

    fn episodes(&self, inside: &[bool]) -> Vec<Episode> {
        let of_recording = |ends: &[usize]| {
            let (first, end) = (ends[0], ends[1]);
            let mut all: Vec<Episode> = Vec::new();
            for cell in (first..end).filter(|cell| inside[*cell]) {
                let is_closed = |from: usize, until: usize| from > first && until < end;
                match all.last_mut() {
                    Some(last) if last.until == cell => {
                        last.until = cell + 1;
                        last.is_closed = is_closed(last.from, last.until);
                    }
                    _ => all.push(Episode {
                        from: cell,
                        until: cell + 1,
                        is_closed: is_closed(cell, cell + 1),
                    }),
                }
            }
            all
        };
        self.begin.windows(2).flat_map(of_recording).collect()
    }

    /// Closed episodes with which a condition comes anew: it begins after the episode before has ended, and
    /// holds in this one.
    fn comes_anew(&self, holds: &[bool], episodes: &[Episode]) -> usize {
        let mut since = 0;
        let mut number = 0;
        for episode in episodes {
            let first = self.begin[self.recording(episode.from)];
            let begins = |cell: usize| holds[cell] && !holds[cell - 1];
            let is_new = (since.max(first + 1)..episode.until).any(begins);
            let held = (episode.from..episode.until).any(|cell| holds[cell]);
            number += usize::from(episode.is_closed && is_new && held);
            since = episode.until;
        }
        number
    }

    /// Means of a quantity over each cell; of a mode the last one. What is missing is as before.
    fn gathered(&self, quantity: &KnownQuantity) -> Vec<f64> {
        let mut all = vec![(0.0, 0_u32); self.middles.len()];
        for (values, cells) in quantity.values.iter().zip(&self.cell_of) {
            assert_eq!(values.len(), cells.len(), "values of all samples");
            for (value, cell) in values.iter().zip(cells).filter(|(value, _)| value.is_finite()) {
                let (sum, n) = &mut all[*cell];
                (*sum, *n) = match quantity.kind {
                    KnownKind::Mode(_) => (*value, 1),
                    KnownKind::Input | KnownKind::Output | KnownKind::Unknown => {
                        (*sum + value, *n + 1)
                    }
                };
            }
        }
        let mut means = Vec::with_capacity(all.len());
        for (cell, (sum, n)) in all.iter().enumerate() {
            let is_first = self.begin.contains(&cell);
            let before = if is_first { f64::NAN } else { means[cell - 1] };
            means.push(if *n > 0 { sum / f64::from(*n) } else { before });
        }
        means
    }

    /// Slopes of least squares over the last so many cells, fewer at the beginning of a recording.
    fn slopes(&self, values: &[f64], length: usize) -> Vec<f64> {
        let slope = |cell: usize| {
            let first = self.begin[self.recording(cell)].max((cell + 1).saturating_sub(length + 1));
            let points = &values[first..=cell];
            if points.len() < SHORTEST_SLOPE {
                return f64::NAN;
            }
            let n = points.len() as f64;
            let (centre, mean) = (0.5 * (n - 1.0), points.iter().sum::<f64>() / n);
            let moments = points.iter().enumerate().fold((0.0, 0.0), |(xy, xx), (k, y)| {
                let x = k as f64 - centre;
                (xy + x * (y - mean), xx + x * x)
            });
            let slope = moments.0 / (moments.1 * self.width);
            // Rounding makes a constant look as if it had a slope.
            let size = points.iter().fold(0.0, |most: f64, y| most.max(y.abs()));
            if (slope * self.width).abs() <= 1e-12 * size { 0.0 } else { slope }
        };
        (0..values.len()).map(slope).collect()
    }
}

/// All comparisons that are made of known quantities.
fn comparisons(grid: &Grid, known: &[KnownQuantity], usual: f64) -> Vec<Comparison> {
    let shortest = grid.begin.windows(2).map(|ends| ends[1] - ends[0]).min().unwrap_or(0);
    let mut lengths: Vec<usize> = SLOPE_LENGTHS
        .iter()
        .map(|share| {
            ((share * usual).round() as usize).clamp(SHORTEST_SLOPE, shortest / 4 + SHORTEST_SLOPE)
        })
        .collect();
    lengths.dedup();
    let mut all = Vec::new();
    for (i, quantity) in known.iter().enumerate() {
        let values = grid.gathered(quantity);
        let mut add = |kind: ConditionKind, over: Option<usize>, values: &[f64]| {
            let handicap = handicap(&quantity.kind, &kind);
            all.extend(Comparison::new(i, kind, over, values, handicap));
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
    all
}

/// One quantity that is compared with thresholds in one way.
struct Comparison {
    /// Position of the quantity.
    quantity: usize,
    kind: ConditionKind,
    /// Cells that a slope is taken over.
    over: Option<usize>,
    handicap: f64,
    values: Vec<f64>,
    /// Whether it holds below a threshold.
    is_below: bool,
    /// Thresholds, ascending.
    thresholds: Vec<f64>,
    /// Number of thresholds below each value; behind the last where there is none.
    level: Vec<usize>,
    /// Cells between any two thresholds.
    count: Vec<u32>,
}

/// Where a comparison splits time best.
#[derive(Debug, Clone, Copy)]
struct Split {
    threshold: f64,
    /// Balanced accuracy.
    accuracy: f64,
}

impl Comparison {
    /// `None` where the values are all alike.
    fn new(
        quantity: usize,
        kind: ConditionKind,
        over: Option<usize>,
        values: &[f64],
        handicap: f64,
    ) -> Option<Comparison> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let is_below = matches!(kind, ConditionKind::Below | ConditionKind::Falling);
        let is_allowed = |threshold: f64| match kind {
            ConditionKind::Rising | ConditionKind::Changing => threshold >= 0.0,
            ConditionKind::Falling => threshold <= 0.0,
            ConditionKind::Above | ConditionKind::Below | ConditionKind::Mode(_) => true,
        };
        // Between neighbours that differ, at equal shares of the time.
        let mut thresholds: Vec<f64> = Vec::new();
        for k in 1..THRESHOLDS {
            let at = k * sorted.len() / THRESHOLDS;
            let Some(&x) = sorted.get(at) else { continue };
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
        Some(Comparison {
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

    /// The split that goes together best with windows of these cells.
    fn best(&self, cells: &[usize]) -> Option<Split> {
        let mut within = vec![0_u32; self.count.len()];
        for cell in cells {
            within[self.level[*cell]] += 1;
        }
        let all_inside = cells.len() as f64;
        let all_outside = self.level.len() as f64 - all_inside;
        // Cells below the threshold; those without a value are neither below nor above.
        let (mut inside, mut outside) = (0_u32, 0_u32);
        let known_inside = cells.len() as u32 - within[within.len() - 1];
        let known: u32 = self.count[..self.count.len() - 1].iter().sum();
        let known_outside = known - known_inside;
        let mut best: Option<Split> = None;
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
                best = Some(Split { threshold: *threshold, accuracy });
            }
        }
        best
    }

    /// Where it holds.
    fn holds(&self, split: &Split) -> Vec<bool> {
        let holds = |x: &f64| {
            if self.is_below { *x < split.threshold } else { *x > split.threshold }
        };
        self.values.iter().map(holds).collect()
    }
}
