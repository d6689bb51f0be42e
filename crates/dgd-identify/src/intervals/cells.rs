//! Contributions of short stretches of the recordings to the normal equations, and parts composed of these.
//!
//! One simulation with sensitivities fills the cells. Only then is it known how to divide recordings into parts with
//! equal information about the parameters,
//!
//! ```text
//!   h_c = Σ_i (C H_c C)ᵢᵢ/Cᵢᵢ        i: parameters;  H_c: information of cell c;  C = (Σ H_c)⁻¹
//! ```
//!
//! so that a recording at rest before and after a transient is divided within the transient.

use dgd_runtime::for_identify::can_stream;
use dgd_runtime::model::{Model, SampleReceiver, stream};
use dgd_runtime::{Options, Problem};

use crate::error::TrialFailure;
use crate::noise::loss::Loss;
use crate::recording::{DerivativeUse, DirectionColumn, Recording, outputs_of, write_slopes};

/// Number of parts that recordings are divided into. A standard deviation of ten numbers is accurate to a quarter; more
/// parts would each determine the parameters less well, and tell no more about model errors.
pub(crate) const PARTS: usize = 10;

/// Limit on the cells of all recordings: enough for even parts …
const MOST_CELLS: usize = 240;
const LEAST_CELLS: usize = 4 * PARTS;
/// … with no more numbers than this.
const MOST_NUMBERS: usize = 1 << 22;

/// Consecutive samples of one recording.
#[derive(Debug, Clone)]
pub(crate) struct SampleCell {
    pub recording: usize,
    /// Time of the first sample and of the last, s.
    pub from: f64,
    pub until: f64,
    /// Σ w (∂e/∂z) e/σ² over the recording's own variables.
    pub gradient: Vec<f64>,
    /// Σ w (∂e/∂z)(∂e/∂z)ᵀ/σ², the lower triangle, by rows.
    pub information: Vec<f64>,
}

impl SampleCell {
    /// Adds a sample: its error e and ∂e/∂z.
    fn add(&mut self, e: f64, slopes: &[f64], weight: f64) {
        let mut place = self.information.iter_mut();
        for (i, (a, gradient)) in slopes.iter().zip(&mut self.gradient).enumerate() {
            *gradient += weight * a * e;
            for (sum, b) in place.by_ref().take(i + 1).zip(slopes) {
                *sum += weight * a * b;
            }
        }
    }

    /// vᵀH_c v over the recording's own variables.
    pub(crate) fn square(&self, v: &[f64]) -> f64 {
        let (mut place, mut sum) = (self.information.iter(), 0.0);
        for (i, a) in v.iter().enumerate() {
            let row: f64 = place.by_ref().take(i).zip(v).map(|(term, b)| term * b).sum();
            sum += a * (2.0 * row + place.next().map_or(0.0, |own| own * a));
        }
        sum.max(0.0)
    }
}

/// Contributions of a recording: by consecutive samples, and by outputs.
#[derive(Debug, Clone)]
pub(crate) struct CellSums {
    pub cells: Vec<SampleCell>,
    pub outputs: Vec<SampleCell>,
}

/// Number of cells of each recording, given its number of variables.
pub(crate) fn cells_of(recordings: &[Recording], own: usize) -> Vec<usize> {
    let rows: usize = recordings.iter().map(|recording| recording.times.len()).sum();
    let most = (MOST_NUMBERS / (own * own).max(1)).clamp(LEAST_CELLS, MOST_CELLS);
    let of_recording = |recording: &Recording| {
        let share = recording.times.len() as f64 / rows.max(1) as f64;
        let cells = (share * most as f64).round() as usize;
        cells.clamp(1, recording.times.len().max(1))
    };
    recordings.iter().map(of_recording).collect()
}

/// Weights of samples.
#[derive(Clone, Copy)]
pub(crate) struct SampleWeights<'a> {
    /// σ of each output, SI; `None` if it is not fitted.
    pub sigma: &'a [Option<f64>],
    pub loss: Loss,
}

/// The point at which a recording is simulated.
#[derive(Clone, Copy)]
pub(crate) struct SimulatedAt<'a> {
    pub p: &'a [f64],
    pub start: &'a [(usize, f64)],
    pub options: &'a Options,
}

/// The contributions of a recording, in `n` cells.
pub(crate) fn cells(
    system: &dyn Model,
    (r, recording): (usize, &Recording),
    at: SimulatedAt<'_>,
    columns: &[DirectionColumn],
    weights: SampleWeights<'_>,
    n: usize,
) -> Result<CellSums, TrialFailure> {
    let SimulatedAt { p, start, options } = at;
    let mut filling = CellAccumulator::new((r, recording), columns, weights, n);
    let problem = Problem { system: &system, p, inputs: &recording.inputs, start };
    if recording.linear.is_none() && can_stream(&problem, options) {
        stream(&problem, &recording.times, options, &mut filling)
            .map_err(TrialFailure::Simulation)?;
        return Ok(filling.divided);
    }
    let simulated = outputs_of(system, recording, p, start, options, DerivativeUse::Yes)?;
    for k in 0..recording.times.len() {
        if filling.wants(k) {
            filling.take(k, simulated.w(k), simulated.dw(k));
        }
    }
    Ok(filling.divided)
}

/// Adds samples to their cells.
struct CellAccumulator<'a> {
    recording: &'a Recording,
    /// Samples before this one do not count.
    first: usize,
    columns: &'a [DirectionColumn],
    weights: SampleWeights<'a>,
    slopes: Vec<f64>,
    divided: CellSums,
}

impl<'a> CellAccumulator<'a> {
    fn new(
        (r, recording): (usize, &'a Recording),
        columns: &'a [DirectionColumn],
        weights: SampleWeights<'a>,
        n: usize,
    ) -> Self {
        let (times, own) = (&recording.times, columns.len());
        let cell = |from: usize, until: usize| SampleCell {
            recording: r,
            from: times.get(from).copied().unwrap_or(f64::NAN),
            until: times.get(until.wrapping_sub(1)).copied().unwrap_or(f64::NAN),
            gradient: vec![0.0; own],
            information: vec![0.0; own * (own + 1) / 2],
        };
        let rows = times.len();
        let part = |c: usize| cell((c * rows).div_ceil(n), ((c + 1) * rows).div_ceil(n));
        let divided = CellSums {
            cells: (0..if rows > 0 { n } else { 0 }).map(part).collect(),
            outputs: vec![cell(0, rows); weights.sigma.len()],
        };
        let first = times.partition_point(|t| *t < recording.counts_from);
        Self { recording, first, columns, weights, slopes: vec![0.0; own], divided }
    }
}

/// A sample, if there is one.
fn measured(recording: &Recording, output: usize, k: usize) -> Option<f64> {
    let samples = recording.measured[output].as_deref()?;
    samples.get(k).copied().filter(|value| value.is_finite())
}

impl SampleReceiver for CellAccumulator<'_> {
    fn wants(&mut self, k: usize) -> bool {
        let outputs = 0..self.weights.sigma.len();
        k >= self.first
            && outputs.into_iter().any(|output| measured(self.recording, output, k).is_some())
    }

    fn take(&mut self, k: usize, w: &[f64], dw: &[f64]) {
        let CellSums { cells, outputs } = &mut self.divided;
        let cell = k * cells.len() / self.recording.times.len();
        for (output, sigma) in self.weights.sigma.iter().enumerate() {
            let measured = measured(self.recording, output, k);
            let (Some(sigma), Some(measured)) = (*sigma, measured) else { continue };
            write_slopes(dw, w.len(), output, self.columns, &mut self.slopes);
            let e = w[output] - measured;
            if !e.is_finite() || self.slopes.iter().any(|slope| !slope.is_finite()) {
                continue;
            }
            let weight = self.weights.loss.evaluate(e / sigma).weight / (sigma * sigma);
            cells[cell].add(e, &self.slopes, weight);
            outputs[output].add(e, &self.slopes, weight);
        }
    }
}

/// Parts: runs of consecutive cells with similar information; `shares` are the cells' shares of the whole. A few
/// recordings are divided separately; many are grouped.
pub(crate) fn parts(recordings: &[usize], shares: &[f64]) -> Vec<std::ops::Range<usize>> {
    let whole: f64 = shares.iter().sum();
    let mut ends = recordings.chunk_by(|a, b| a == b).scan(0, |end, chunk| {
        let from = std::mem::replace(end, *end + chunk.len());
        Some(from..*end)
    });
    let of_recordings: Vec<std::ops::Range<usize>> = ends.by_ref().collect();
    let share = |cells: &std::ops::Range<usize>| shares[cells.clone()].iter().sum::<f64>() / whole;
    if of_recordings.len() > PARTS {
        let of_each: Vec<f64> = of_recordings.iter().map(share).collect();
        let groups = divided(&of_each, PARTS).into_iter();
        let cells = |group: std::ops::Range<usize>| {
            of_recordings[group.start].start..of_recordings[group.end - 1].end
        };
        return groups.map(cells).collect();
    }
    let divide = |cells: &std::ops::Range<usize>| {
        let n = (share(cells) * PARTS as f64).round().max(1.0) as usize;
        let from = cells.start;
        let parts = divided(&shares[cells.clone()], n).into_iter();
        parts.map(move |part| from + part.start..from + part.end).collect::<Vec<_>>()
    };
    of_recordings.iter().flat_map(divide).collect()
}

/// At most `n` runs of consecutive numbers, with sums as even as possible without dividing a number.
fn divided(numbers: &[f64], n: usize) -> Vec<std::ops::Range<usize>> {
    let whole: f64 = numbers.iter().sum();
    let (mut runs, mut from, mut sum) = (Vec::new(), 0, 0.0);
    for (k, number) in numbers.iter().enumerate() {
        let aim = whole * (runs.len() + 1) as f64 / n as f64;
        // A run ends before a number that would exceed the target by more than the run falls short of it now.
        if k > from && runs.len() + 1 < n && sum + number - aim > aim - sum {
            runs.push(from..k);
            from = k;
        }
        sum += number;
    }
    if from < numbers.len() {
        runs.push(from..numbers.len());
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_know_as_much_each_and_stay_within_recordings() {
        // A transient in the middle of a recording at rest.
        let mut shares = vec![1e-3; 100];
        shares[40..60].fill(1.0);
        let found = parts(&[0; 100], &shares);
        assert_eq!(found.len(), PARTS);
        assert_eq!((found[0].clone(), found[9].clone()), (0..42, 58..100));
        assert!(found[1..9].iter().all(|part| part.len() == 2), "{found:?}");

        // Two recordings, one of which has three times as much information.
        let recordings: Vec<usize> = (0..80).map(|c| usize::from(c >= 40)).collect();
        let shares: Vec<f64> = recordings.iter().map(|r| if *r == 0 { 3.0 } else { 1.0 }).collect();
        let found = parts(&recordings, &shares);
        assert_eq!(found.len(), 11, "7.5 and 2.5, rounded");
        assert!(found.iter().all(|part| part.start >= 40 || part.end <= 40), "{found:?}");

        // Many recordings are grouped, and one cell with all information is a part.
        let recordings: Vec<usize> = (0..30).collect();
        assert_eq!(
            parts(&recordings, &[1.0; 30]),
            (0..10).map(|k| 3 * k..3 * k + 3).collect::<Vec<_>>()
        );
        assert_eq!(parts(&[0; 3], &[0.0, 1.0, 0.0]), [0..1, 1..2, 2..3]);
    }
}
