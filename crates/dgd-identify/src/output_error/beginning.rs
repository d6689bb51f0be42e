//! The burn-in of a recording: start values are estimated from it, and its errors do not count.
//!
//! ```text
//!   60 h, at most L/5               h: usual distance of an output's readings, L: length of the recording
//!   × 2, 4, … up to L/2             until  tr(F⁻¹ Q F⁻¹ Mₒ)/nₒ ≤ 1/10  for every output o
//!   F = Σ_beginning jᵀj/σ²          j: derivatives of a reading to the free start values
//!   Q = Σ_beginning ρ(Δt) jᵀj'/σ²   over pairs of readings of one output, ρ: correlation of its noise
//!   Mₒ = Σ_rest jᵀj/σ²              over the nₒ readings of output o that count
//! ```
//!
//! 60 readings reduce white noise to an eighth. That suffices for states that readings show immediately. If the model's
//! time constants are long compared with 60 readings, or a state grows, start values that fit the burn-in may be far
//! off later, and likewise if noise is correlated: their covariance is then F⁻¹ Q F⁻¹ (F⁻¹ for white noise, where Q is
//! F), and tr(F⁻¹ Q F⁻¹ Mₒ)/nₒ is the contribution of their uncertainty to the mean square of the errors that count, in
//! units of the noise. The burn-in is doubled until that is at most a tenth.
//!
//! The rule uses only readings, lengths and ratios, and does not depend on units of time, names or the sizes of states.

use dgd_runtime::{Direction, Signature};
use nalgebra::{DMatrix, DVector};

use super::noise::NoiseSource;
use super::{OutputErrorProblem, fit_starts};
use crate::recording::{DerivativeUse, Recording, outputs_of};

/// Readings of each output for estimating start values.
const READINGS: f64 = 60.0;

/// Limit on the burn-in as a share of the recording, if that determines the start values …
const SHARE: f64 = 0.2;

/// … and otherwise.
const LARGEST_SHARE: f64 = 0.5;

/// Acceptable contribution of uncertain start values to the mean square of the errors that count, in units of the
/// noise.
const NEGLIGIBLE: f64 = 0.1;

/// Times this close, relative to the spacing, are equal up to rounding error.
const ROUNDING: f64 = 1e-6;

/// Autocorrelation of an output's noise: `share` e^(−Δt/`memory`) between two readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseCorrelation {
    /// The correlated part's share of the noise's variance.
    pub share: f64,
    /// Time after which its correlation is 1/e, s.
    pub memory: f64,
}

impl NoiseCorrelation {
    /// White noise.
    pub const NONE: NoiseCorrelation = NoiseCorrelation { share: 0.0, memory: 1.0 };
}

/// The time at which each recording of a problem begins to count, s: start values are estimated from the samples before
/// it ([`fit_starts`]).
///
/// The module documentation states the rule; `noise` has the autocorrelation of each output's noise. Minus infinity for
/// a model without states. Recordings that cannot be simulated begin to count after 60 readings.
///
/// # Panics
///
/// If `noise` does not have one element for each output.
pub fn counts_from(problem: &OutputErrorProblem<'_>, noise: &[NoiseCorrelation]) -> Vec<f64> {
    assert_eq!(noise.len(), problem.noise.len(), "a correlation for each output");
    let signature = problem.system.signature();
    if !moves(signature) {
        return vec![f64::NEG_INFINITY; problem.recordings.len()];
    }
    let recordings = problem.recordings.iter();
    recordings.map(|recording| of_recording(problem, recording, noise)).collect()
}

/// Whether the solution at one time depends on earlier times.
fn moves(signature: &Signature) -> bool {
    let mut mass = vec![0.0; signature.unknowns.len()];
    signature.write_mass(&mut mass);
    mass.iter().any(|mass| *mass != 0.0)
        || !signature.past().is_empty()
        || !signature.delayed_inputs.is_empty()
        || !signature.discrete.automata.is_empty()
}

fn of_recording(
    problem: &OutputErrorProblem<'_>,
    recording: &Recording,
    noise: &[NoiseCorrelation],
) -> f64 {
    let (Some(first), Some(last)) = (recording.times.first(), recording.times.last()) else {
        return f64::NEG_INFINITY;
    };
    let length = last - first;
    let measured = recording.measured.iter().zip(&problem.noise);
    let enough = measured.filter_map(|(samples, noise)| {
        enough_readings(&recording.times, noise.and(samples.as_deref())?)
    });
    let enough = enough.fold(f64::NEG_INFINITY, f64::max).min(first + SHARE * length);
    let enough = if enough.is_finite() { enough } else { first + SHARE * length };
    let least = sample_from(recording, enough);
    let doubled = (0..).map(|k| f64::from(k).exp2() * (least - first));
    let within = doubled.take_while(|part| *part > 0.0 && *part <= LARGEST_SHARE * length);
    let longer: Vec<f64> = within.map(|part| sample_from(recording, first + part)).collect();
    uncertainties(problem, recording, noise, &longer)
        .and_then(|added| {
            let known = longer.iter().zip(&added).find(|(_, added)| **added <= NEGLIGIBLE);
            let best = || longer.iter().zip(&added).min_by(|a, b| a.1.total_cmp(b.1));
            known.or_else(best).map(|(from, _)| *from)
        })
        .unwrap_or(least)
}

/// The time at which an output has enough readings; `None` if it has hardly any.
fn enough_readings(times: &[f64], samples: &[f64]) -> Option<f64> {
    let read = times.iter().zip(samples).filter(|(_, value)| value.is_finite());
    let read: Vec<f64> = read.map(|(t, _)| *t).collect();
    let mut spacings: Vec<f64> =
        read.windows(2).map(|pair| pair[1] - pair[0]).filter(|h| *h > 0.0).collect();
    if spacings.is_empty() {
        return None;
    }
    let middle = spacings.len() / 2;
    let usual = *spacings.select_nth_unstable_by(middle, f64::total_cmp).1;
    Some(read.first()? + (READINGS - ROUNDING) * usual)
}

/// Position of the first sample at or after a time.
fn sample_from(recording: &Recording, t: f64) -> f64 {
    let k = recording.times.partition_point(|sample| *sample < t);
    recording.times.get(k).or(recording.times.last()).copied().unwrap_or(t)
}

/// The contribution of uncertain start values to the mean square of later errors of any output, for each burn-in.
/// `None` if no start value is free or the recording cannot be simulated.
fn uncertainties(
    problem: &OutputErrorProblem<'_>,
    recording: &Recording,
    correlations: &[NoiseCorrelation],
    beginnings: &[f64],
) -> Option<Vec<f64>> {
    let OutputErrorProblem { system, options, .. } = problem;
    let directions = system.signature().directions.iter().zip(&problem.free).enumerate();
    let is_start = |(_, (of, free)): &(usize, (&Direction, &bool))| {
        **free && matches!(of, Direction::Start(_))
    };
    let columns: Vec<usize> = directions.filter(is_start).map(|(j, _)| j).collect();
    if columns.is_empty() || beginnings.is_empty() {
        return None;
    }
    let alone = std::slice::from_ref(recording);
    let single = OutputErrorProblem { recordings: alone, ..problem.clone() };
    let start = fit_starts(&single, &beginnings[..1]).ok()?.pop()?;
    let fitted =
        outputs_of(*system, recording, problem.p, &start, options, DerivativeUse::Yes).ok()?;
    let n = columns.len();
    let n_w = recording.measured.len();
    let mut parts = vec![vec![BurnInPart::nothing(n); n_w]; beginnings.len() + 1];
    let mut earlier =
        vec![EarlierReadings { sum: DVector::zeros(n), until: f64::NEG_INFINITY }; n_w];
    for (k, t) in recording.times.iter().enumerate() {
        let part = beginnings.partition_point(|from| *from <= *t);
        for (output, noise) in problem.noise.iter().enumerate() {
            let (Some(NoiseSource::Known(sigma)), Some(samples)) =
                (noise, &recording.measured[output])
            else {
                continue;
            };
            let derivatives = columns.iter().map(|j| fitted.dw(k)[j * n_w + output] / sigma);
            let row = DVector::from_iterator(n, derivatives);
            if !samples[k].is_finite() || !row.iter().all(|x| x.is_finite()) {
                continue;
            }
            let NoiseCorrelation { share, memory } = correlations[output];
            let with_earlier = earlier[output].take(*t, &row, memory) * share;
            parts[part][output].take(&row, &with_earlier);
        }
    }
    Some((1..=beginnings.len()).map(|split| added(&parts[..split], &parts[split..])).collect())
}

/// The readings of an output between two ends of burn-ins.
#[derive(Debug, Clone)]
struct BurnInPart {
    readings: usize,
    /// Σ jᵀj/σ².
    known: DMatrix<f64>,
    /// Σ ρ(Δt) jᵀj'/σ² over pairs of these readings with themselves and all earlier ones.
    correlated: DMatrix<f64>,
}

impl BurnInPart {
    fn nothing(n: usize) -> Self {
        Self { readings: 0, known: DMatrix::zeros(n, n), correlated: DMatrix::zeros(n, n) }
    }

    /// Adds a reading, and Σ ρ(Δt) j' of the earlier ones.
    fn take(&mut self, row: &DVector<f64>, earlier: &DVector<f64>) {
        self.readings += 1;
        self.known.ger(1.0, row, row, 1.0);
        self.correlated.ger(1.0, row, row, 1.0);
        self.correlated.ger(1.0, row, earlier, 1.0);
        self.correlated.ger(1.0, earlier, row, 1.0);
    }
}

/// Σ e^(−Δt/memory) j/σ over the readings of an output up to some time.
#[derive(Debug, Clone)]
struct EarlierReadings {
    sum: DVector<f64>,
    until: f64,
}

impl EarlierReadings {
    /// Adds a reading; returns the sum over the earlier ones at its time.
    fn take(&mut self, t: f64, row: &DVector<f64>, memory: f64) -> DVector<f64> {
        let before = &self.sum * ((self.until - t) / memory).exp();
        self.sum = &before + row;
        self.until = t;
        before
    }
}

/// tr(F⁻¹ Q F⁻¹ Mₒ)/nₒ of the output with the largest value.
fn added(beginning: &[Vec<BurnInPart>], rest: &[Vec<BurnInPart>]) -> f64 {
    let n = rest[0][0].known.nrows();
    let sum = |parts: &[Vec<BurnInPart>], of: fn(&BurnInPart) -> &DMatrix<f64>| {
        parts.iter().flatten().fold(DMatrix::zeros(n, n), |sum, part| sum + of(part))
    };
    let known = sum(beginning, |part| &part.known);
    let correlated = sum(beginning, |part| &part.correlated);
    let later = sum(rest, |part| &part.known);
    // In units in which all readings determine each start value equally well; start values without influence are
    // excluded.
    let scale: Vec<f64> = (0..n)
        .map(|i| {
            let total = known[(i, i)] + later[(i, i)];
            if total > 0.0 { 1.0 / total.sqrt() } else { 0.0 }
        })
        .collect();
    let scaled = |m: &DMatrix<f64>| DMatrix::from_fn(n, n, |i, j| m[(i, j)] * scale[i] * scale[j]);
    // A value that is only determined by rounding errors is not known.
    let rounding = DMatrix::identity(n, n) * 1e-12;
    let Some(known) = (scaled(&known) + &rounding).cholesky() else { return f64::INFINITY };
    let covariance = known.solve(&known.solve(&(scaled(&correlated) + rounding)).transpose());
    let outputs = (0..rest[0].len()).filter_map(|output| {
        let mut of_output = rest.iter().map(|part| &part[output]);
        let readings: usize = of_output.clone().map(|part| part.readings).sum();
        let sum = of_output.by_ref().fold(DMatrix::zeros(n, n), |sum, part| sum + &part.known);
        (readings > 0).then(|| (&covariance * scaled(&sum)).trace() / readings as f64)
    });
    outputs.fold(0.0, f64::max)
}
