//! A trajectory that follows the readings when the model's own simulation does not.
//!
//! If a simulation explains an output worse than its mean does, as in a closed loop or with diverging integrations, a
//! linearisation around it does not describe the real plant. An extended Kalman filter then follows the readings
//! instead: the model predicts from one sample to the next, and its error is process noise on all states alike,
//!
//! ```text
//!   x⁻(k+1) = φ(x(k)),   P⁻ = Φ P Φᵀ + (10^j sizes)² h/T,   x = x⁻ + K (measured − w(x⁻))
//! ```
//!
//! with the j that maximises the likelihood of the readings, each predicted from those before it. The trajectory is
//! x(k), its shifts are φ(x(k)) − x(k+1), and everything else is as around a simulation: the likelihood of a place does
//! not include the filter's noise.
//!
//! Source: Jazwinski, Stochastic Processes and Filtering Theory (1970), §8.3, with the linearisation along the
//! estimate.

use dgd_execute::LoadedSystem;
use dgd_runtime::for_identify::unknown_sizes;
use dgd_runtime::{
    Inputs, Observations, Options, Problem, Solution, System, consistent_start, observe, simulate,
};
use dgd_screen::noise::SensorNoise;
use nalgebra::{DMatrix, DVector};

use super::deviations::Deviations;
use super::missing_terms::MissingTerms;

/// Trial values of log₁₀ of the process noise over a recording, relative to the states' sizes.
const DECADES: [i32; 7] = [-4, -3, -2, -1, 0, 1, 2];

/// A recording to follow.
pub(super) struct FilterRecording<'a> {
    pub(super) terms: &'a MissingTerms,
    /// All parameters, SI.
    pub(super) p: &'a [f64],
    /// Inputs of the model and of all places, with d at one of these.
    pub(super) inputs: &'a Inputs,
    pub(super) place: usize,
    pub(super) d: &'a [f64],
    /// Start values, SI.
    pub(super) start: &'a [(usize, f64)],
    /// Times of the samples, s.
    pub(super) times: &'a [f64],
    /// Readings, n_w per sample; not finite where nothing was read.
    pub(super) measured: &'a [f64],
    pub(super) noise: &'a [Option<SensorNoise>],
    pub(super) options: &'a Options,
}

/// A filtered trajectory, and the deviations from it.
pub(super) struct FilteredTrajectory {
    pub(super) deviations: Deviations,
    /// Readings minus the outputs of the trajectory without d.
    pub(super) residuals: Vec<f64>,
    pub(super) trajectory: Solution,
}

/// The path of a filter along a recording.
struct FilterPath {
    /// Unknowns and discrete numbers, as in a solution.
    y: Vec<f64>,
    z: Vec<f64>,
    shifts: Vec<DVector<f64>>,
    log_likelihood: f64,
}

/// The model over one interval.
struct PieceModel {
    trajectory: Solution,
    deviations: Deviations,
    simulated: Observations,
}

/// States, and their covariance.
struct StateEstimate {
    x: DVector<f64>,
    p: DMatrix<f64>,
    log_likelihood: f64,
}

impl FilterRecording<'_> {
    /// The trajectory of the filter with the highest likelihood of the readings; `None` if the model has declared
    /// modes, several rows have the same time, or there is no solution or derivative on the way.
    pub(super) fn filtered(&self) -> Option<FilteredTrajectory> {
        let signature = self.terms.system().signature();
        let has_modes =
            signature.discrete.automata.iter().any(|automaton| automaton.kind.is_declared());
        if has_modes || self.times.len() < 2 || self.times.windows(2).any(|t| t[0] >= t[1]) {
            return None;
        }
        let mut best: Option<FilterPath> = None;
        for decade in DECADES {
            let Some(way) = self.way(10f64.powi(decade)) else { continue };
            if best.as_ref().is_some_and(|best| best.log_likelihood >= way.log_likelihood) {
                break;
            }
            best = Some(way);
        }
        let FilterPath { y, z, shifts, .. } = best?;
        let first = self.simulated(0, self.start)?;
        let trajectory = Solution { times: self.times.to_vec(), y, z, ..first };
        let mut deviations =
            Deviations::linearize(self.terms, self.p, self.inputs, &trajectory).ok()?;
        let simulated = observe(&self.problem(self.start), &trajectory);
        let mut residuals: Vec<f64> =
            self.measured.iter().zip(&simulated.w).map(|(m, w)| m - w).collect();
        // Deviations are due to all of d, not to its difference from the value here.
        deviations.shifts = shifts;
        for ((shift, response), d) in
            deviations.shifts.iter_mut().zip(&deviations.responses).zip(self.d)
        {
            *shift -= response.column(self.place) * *d;
        }
        let n_w = deviations.n_outputs;
        for (k, (seen, d)) in deviations.seen.iter().zip(self.d).enumerate() {
            let Some(seen) = seen else { continue };
            for (output, residual) in residuals[k * n_w..(k + 1) * n_w].iter_mut().enumerate() {
                *residual += seen.inputs[(output, self.place)] * d;
            }
        }
        Some(FilteredTrajectory { deviations, residuals, trajectory })
    }

    fn problem<'b>(&'b self, start: &'b [(usize, f64)]) -> Problem<'b, LoadedSystem> {
        Problem { system: self.terms.system(), p: self.p, inputs: self.inputs, start }
    }

    fn simulated(&self, k: usize, start: &[(usize, f64)]) -> Option<Solution> {
        simulate(&self.problem(start), &self.times[k..k + 2], self.options).ok()
    }

    /// The model from the k-th sample to the next.
    fn piece(&self, k: usize, start: &[(usize, f64)]) -> Option<PieceModel> {
        let trajectory = self.simulated(k, start)?;
        let deviations =
            Deviations::linearize(self.terms, self.p, self.inputs, &trajectory).ok()?;
        let simulated = observe(&self.problem(start), &trajectory);
        Some(PieceModel { trajectory, deviations, simulated })
    }

    /// Runs the filter with process noise of `strays` times the states' sizes over the recording.
    fn way(&self, strays: f64) -> Option<FilterPath> {
        let unknowns = &self.terms.system().signature().unknowns;
        let n = unknowns.len();
        let states: Vec<usize> = unknowns.differential().collect();
        let states_of =
            |y: &[f64]| DVector::from_iterator(states.len(), states.iter().map(|i| y[*i]));
        let from = |x: &DVector<f64>| -> Vec<(usize, f64)> {
            states.iter().copied().zip(x.iter().copied()).collect()
        };
        let last = self.times.len() - 1;
        let duration = self.times[last] - self.times[0];

        let first = self.piece(0, self.start)?;
        let mut sizes = vec![0.0; n];
        unknown_sizes(self.terms.system(), first.trajectory.y(0), &mut sizes);
        let variances = states_of(&sizes).map(|size| size * size);
        let (x, p) = (states_of(first.trajectory.y(0)), DMatrix::from_diagonal(&variances));
        let mut estimate = StateEstimate { x, p, log_likelihood: 0.0 };
        self.correct(&mut estimate, 0, &first, 0);

        let (mut y, mut z, mut shifts) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..last {
            let piece = self.piece(k, &from(&estimate.x))?;
            y.extend_from_slice(piece.trajectory.y(0));
            z.extend_from_slice(piece.trajectory.z(0));
            let transition = &piece.deviations.transitions[0];
            estimate.p = transition * &estimate.p * transition.transpose();
            let interval = (self.times[k + 1] - self.times[k]) / duration;
            for (i, variance) in variances.iter().enumerate() {
                estimate.p[(i, i)] += strays * strays * variance * interval;
            }
            let ahead = states_of(piece.trajectory.y(1));
            estimate.x.clone_from(&ahead);
            self.correct(&mut estimate, k + 1, &piece, 1);
            shifts.push(ahead - &estimate.x);
            if k + 1 == last {
                z.extend_from_slice(piece.trajectory.z(1));
            }
        }
        let end =
            consistent_start(&self.problem(&from(&estimate.x)), self.times[last], self.options);
        y.extend_from_slice(&end.ok()?.y);
        let log_likelihood = estimate.log_likelihood;
        log_likelihood.is_finite().then_some(FilterPath { y, z, shifts, log_likelihood })
    }

    /// Updates with the readings at a sample, one at a time; the model there is at one end of a piece.
    fn correct(&self, at: &mut StateEstimate, sample: usize, piece: &PieceModel, end: usize) {
        let n_w = piece.deviations.n_outputs;
        let Some(seen) = &piece.deviations.seen[end] else { return };
        let predicted = at.x.clone();
        for (output, noise) in self.noise.iter().enumerate() {
            let value = self.measured[sample * n_w + output];
            let Some(SensorNoise { std, .. }) = noise else { continue };
            if !(value.is_finite() && *std > 0.0) {
                continue;
            }
            let c = seen.states.row(output).transpose();
            let column = &at.p * &c;
            let variance = c.dot(&column) + std * std;
            let moved = c.dot(&(&at.x - &predicted));
            let innovation = value - piece.simulated.w(end)[output] - moved;
            at.x += &column * (innovation / variance);
            at.p -= &column * column.transpose() / variance;
            at.log_likelihood -= 0.5 * (variance.ln() + innovation * innovation / variance);
        }
        at.p = (&at.p + at.p.transpose()) * 0.5;
    }
}
