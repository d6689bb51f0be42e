//! A grid of equal time cells: cells within windows, and means and slopes of quantities over cells.

use dgd_screen::noise::median;

use super::known::{KnownKind, KnownQuantity};

/// Total number of time cells of all recordings.
const CELLS: f64 = 2000.0;
/// Minimum number of cells of a slope.
pub(super) const SHORTEST_SLOPE: usize = 4;

/// Equal time cells of all recordings, one recording after the other.
pub(super) struct CellGrid {
    /// Length of a cell, s.
    pub(super) width: f64,
    /// Middle of each cell, s.
    pub(super) middles: Vec<f64>,
    /// First cell of each recording, and the end of the last.
    pub(super) begin: Vec<usize>,
    /// Cell of each sample of each recording.
    pub(super) cell_of: Vec<Vec<usize>>,
}

/// A run of neighbouring cells within windows.
pub(super) struct CellEpisode {
    pub(super) from: usize,
    pub(super) until: usize,
    /// Whether it begins and ends within its recording.
    pub(super) is_closed: bool,
}

impl CellGrid {
    pub(super) fn new(times: &[Vec<f64>]) -> Option<CellGrid> {
        let duration = |times: &Vec<f64>| Some(times.last()? - times.first()?);
        let total: f64 = times.iter().filter_map(duration).sum();
        let mut spacings: Vec<f64> = (times.iter().flat_map(|times| times.windows(2)))
            .map(|pair| pair[1] - pair[0])
            .filter(|h| *h > 0.0)
            .collect();
        let width = median(&mut spacings)?.max(total / CELLS);
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
        Some(CellGrid { width, middles, begin, cell_of })
    }

    pub(super) fn recording(&self, cell: usize) -> usize {
        self.begin.partition_point(|begin| *begin <= cell) - 1
    }

    pub(super) fn inside(&self, windows: &[Vec<[f64; 2]>]) -> Vec<bool> {
        let within = |(cell, t): (usize, &f64)| {
            let windows = &windows[self.recording(cell)];
            // A window shorter than a cell still has its middle in one.
            let half = 0.5 * self.width;
            windows.iter().any(|[from, until]| (from - half..until + half).contains(t))
        };
        self.middles.iter().enumerate().map(within).collect()
    }

    pub(super) fn episodes(&self, inside: &[bool]) -> Vec<CellEpisode> {
        let of_recording = |ends: &[usize]| {
            let (first, end) = (ends[0], ends[1]);
            let mut episodes: Vec<CellEpisode> = Vec::new();
            for cell in (first..end).filter(|cell| inside[*cell]) {
                let is_closed = |from: usize, until: usize| from > first && until < end;
                match episodes.last_mut() {
                    Some(last) if last.until == cell => {
                        last.until = cell + 1;
                        last.is_closed = is_closed(last.from, last.until);
                    }
                    _ => episodes.push(CellEpisode {
                        from: cell,
                        until: cell + 1,
                        is_closed: is_closed(cell, cell + 1),
                    }),
                }
            }
            episodes
        };
        self.begin.windows(2).flat_map(of_recording).collect()
    }

    /// Number of closed episodes in which a condition sets in anew: it begins after the previous episode has ended, and
    /// holds in this one.
    pub(super) fn comes_anew(&self, holds: &[bool], episodes: &[CellEpisode]) -> usize {
        let mut since = 0;
        let mut number = 0;
        for episode in episodes {
            let first = self.begin[self.recording(episode.from)];
            let begins = |cell: usize| holds[cell] && !holds[cell - 1];
            let is_new = (since.max(first + 1)..episode.until).any(begins);
            let is_met = (episode.from..episode.until).any(|cell| holds[cell]);
            number += usize::from(episode.is_closed && is_new && is_met);
            since = episode.until;
        }
        number
    }

    /// Means of a quantity over each cell; the last value for a mode. Cells without values repeat the previous one.
    pub(super) fn gathered(&self, quantity: &KnownQuantity) -> Vec<f64> {
        let mut sums = vec![(0.0, 0_u32); self.middles.len()];
        for (values, cells) in quantity.values.iter().zip(&self.cell_of) {
            assert_eq!(values.len(), cells.len(), "values of all samples");
            for (value, cell) in values.iter().zip(cells).filter(|(value, _)| value.is_finite()) {
                let (sum, n) = &mut sums[*cell];
                (*sum, *n) = match quantity.kind {
                    KnownKind::Mode(_) => (*value, 1),
                    KnownKind::Input | KnownKind::Output | KnownKind::Unknown => {
                        (*sum + value, *n + 1)
                    }
                };
            }
        }
        let mut means = Vec::with_capacity(sums.len());
        for (cell, (sum, n)) in sums.iter().enumerate() {
            let is_first = self.begin.contains(&cell);
            let before = if is_first { f64::NAN } else { means[cell - 1] };
            means.push(if *n > 0 { sum / f64::from(*n) } else { before });
        }
        means
    }

    /// Least-squares slopes over the last `length` cells, fewer at the beginning of a recording.
    pub(super) fn slopes(&self, values: &[f64], length: usize) -> Vec<f64> {
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
            // Rounding can give a constant a spurious slope.
            let size = points.iter().fold(0.0, |most: f64, y| most.max(y.abs()));
            if (slope * self.width).abs() <= 1e-12 * size { 0.0 } else { slope }
        };
        (0..values.len()).map(slope).collect()
    }
}
