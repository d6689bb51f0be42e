//! Finds the next switch of a model if a run does not reach its threshold.
//!
//! A threshold that a run does not reach has no influence: no derivative shows that the recording has a switch there.
//! So the time of the switch is searched instead. For each of some times since the last switch, the parameters that
//! affect the threshold are moved until the run reaches it there,
//!
//! ```text
//!   e(y(t), p + δ) = 0,   δ = −e S² ∂e/∂p / (∂e/∂pᵀ S² ∂e/∂p),   S = diag |p|
//! ```
//!
//! with y unchanged, and the next fit starts at the best time.

use dgd_runtime::model::Model;
use dgd_runtime::signature::{Automaton, AutomatonKind, Crossing};
use dgd_runtime::system::EvaluationPoint;
use dgd_runtime::{Direction, Problem, Solution, side, simulate};

use crate::noise::NoiseSource;
use crate::output_error::fit::Fit;
use crate::output_error::{OutputErrorProblem, evaluate};
use crate::recording::Recording;

/// Number of times since the last switch to try.
const MOMENTS: usize = 8;

/// Number of Newton steps to a threshold; most are linear in their parameters.
const STEPS: usize = 3;

/// Parameters with an additional switch that improves the fit by more than this fraction, and the number of simulations
/// for the search.
pub(super) fn next_switch(
    problem: &OutputErrorProblem<'_>,
    found: &Fit,
    part: f64,
) -> (Option<Vec<f64>>, usize) {
    let noise = found.noise.iter().map(|sigma| sigma.map(NoiseSource::Known)).collect();
    let known = OutputErrorProblem { noise, ..problem.clone() };
    let cost = |p: &[f64]| evaluate(&known, p, &found.starts).map_or(f64::INFINITY, |e| e.cost);
    let points = points(problem, found);
    if points.is_empty() {
        return (None, 0);
    }
    let limit = (1.0 - part) * cost(&found.p);
    let simulations = points.len() + 2;
    let costs = points.into_iter().map(|p| (cost(&p), p));
    let best = costs.min_by(|(a, _), (b, _)| a.total_cmp(b));
    (best.filter(|(cost, _)| *cost < limit).map(|(_, p)| p), simulations)
}

/// Parameters with which a run reaches a threshold of its last mode at some time since the last switch.
fn points(problem: &OutputErrorProblem<'_>, found: &Fit) -> Vec<Vec<f64>> {
    let signature = problem.system.signature();
    // Delayed values are not available here.
    if !signature.delayed_inputs.is_empty() || !signature.delayed_unknowns.is_empty() {
        return Vec::new();
    }
    let mut points = Vec::new();
    for (recording, start) in problem.recordings.iter().zip(&found.starts) {
        let run =
            Problem { system: &problem.system, p: &found.p, inputs: &recording.inputs, start };
        let Ok(solution) = simulate(&run, &recording.times, &problem.options) else { continue };
        let run = SwitchRun { system: problem.system, recording, solution: &solution };
        let mut first = 0;
        for (a, automaton) in signature.discrete.automata.iter().enumerate() {
            let transitions = first..first + automaton.transitions.len();
            first = transitions.end;
            if !is_declared(automaton) {
                continue;
            }
            let Some((mode, rows)) = run.last_stretch(a) else { continue };
            for (e, transition) in transitions.zip(automaton.transitions.iter()) {
                if transition.from != mode {
                    continue;
                }
                let moved = rows.iter().filter_map(|&k| {
                    run.reaching(e, transition.crossing, k, &found.p, &problem.free)
                });
                points.extend(moved);
            }
        }
    }
    points
}

/// Whether its thresholds were declared by the model's author.
fn is_declared(automaton: &Automaton) -> bool {
    matches!(automaton.kind, AutomatonKind::Modes | AutomatonKind::When)
}

/// A simulated recording.
struct SwitchRun<'a> {
    system: &'a dyn Model,
    recording: &'a Recording,
    solution: &'a Solution,
}

impl SwitchRun<'_> {
    /// The last mode of an automaton, and some rows since it was entered.
    fn last_stretch(&self, automaton: usize) -> Option<(usize, Vec<usize>)> {
        let last = self.solution.len().checked_sub(1)?;
        let mode = |k: usize| self.solution.z(k)[automaton];
        let since = (0..last).rev().find(|&k| mode(k) != mode(last)).map_or(0, |k| k + 1);
        let rows = last - since;
        let mut moments: Vec<usize> =
            (1..=MOMENTS).map(|m| since + (m * rows).div_ceil(MOMENTS)).collect();
        moments.dedup();
        moments.retain(|k| *k > since);
        Some((mode(last) as usize, moments))
    }

    /// The parameters with which event function e is zero at a row; `None` if it passes zero before, or does not depend
    /// enough on free parameters.
    fn reaching(
        &self,
        e: usize,
        crossing: Crossing,
        k: usize,
        p: &[f64],
        free: &[bool],
    ) -> Option<Vec<f64>> {
        let signature = self.system.signature();
        let mut p = p.to_vec();
        let before = self.event(e, k, &p).0;
        let is_before = |e: f64| match crossing {
            Crossing::Rises => e < 0.0,
            Crossing::Falls => e > 0.0,
        };
        if !is_before(before) {
            return None;
        }
        for _ in 0..STEPS {
            let (value, slopes) = self.event(e, k, &p);
            let moves: Vec<(usize, f64, f64)> = (signature.directions.iter().zip(&slopes))
                .zip(free)
                .filter(|(_, free)| **free)
                .filter_map(|((direction, slope), _)| match direction {
                    Direction::Parameter(i) if *slope != 0.0 => Some((*i, *slope, p[*i].abs())),
                    _ => None,
                })
                .collect();
            let curvature: f64 = moves.iter().map(|(_, slope, size)| (slope * size).powi(2)).sum();
            if curvature == 0.0 {
                return None;
            }
            for (i, slope, size) in moves {
                let parameter = &signature.parameters[i];
                let moved = p[i] - value * slope * size * size / curvature;
                p[i] = moved.clamp(parameter.lower, parameter.upper);
            }
        }
        (self.event(e, k, &p).0.abs() < 0.01 * before.abs()).then_some(p)
    }

    /// Event function e at a row, and its derivatives with respect to the directions with the unknowns fixed.
    fn event(&self, e: usize, k: usize, p: &[f64]) -> (f64, Vec<f64>) {
        let signature = self.system.signature();
        let (t, y, z) = (self.recording.times[k], self.solution.y(k), self.solution.z(k));
        let mut u = vec![0.0; signature.inputs.len()];
        self.recording.inputs.value(t, side(&self.recording.times, k), &mut u);
        let point = EvaluationPoint { t, y, u: &u, p, z };
        let discrete = &signature.discrete;
        let n_e = discrete.automata.iter().map(|automaton| automaton.transitions.len()).sum();
        let udot = vec![0.0; u.len()];
        let mut by_theta = vec![0.0; discrete.event_directions.len()];
        let mut by_y = vec![0.0; discrete.event_jacobian.len()];
        let (mut values, mut by_t) = (vec![0.0; n_e], vec![0.0; n_e]);
        self.system.event_functions(point, &mut values);
        self.system.event_derivatives(point, &udot, &mut by_theta, &mut by_y, &mut by_t);
        let mut slopes = vec![0.0; signature.directions.len()];
        for ((row, j), slope) in discrete.event_directions.positions().zip(&by_theta) {
            if row == e {
                slopes[j] = *slope;
            }
        }
        (values[e], slopes)
    }
}
