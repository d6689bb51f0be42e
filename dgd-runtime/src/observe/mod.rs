//! Outputs along a solution.

pub(crate) mod delay;

use std::borrow::Cow;

use crate::algebraic::UnknownRates;
use crate::discrete::discrete_numbers;
use crate::observe::delay::delay_sensitivities;
use crate::problem::Problem;
use crate::signal::{Inputs, LimitSide};
use crate::solution::{DelayedOutputValues, Solution};
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// Outputs, and their sensitivities where the solution has them.
#[derive(Debug, Clone, PartialEq)]
pub struct Observations {
    /// Number of outputs n_w.
    pub n_w: usize,
    /// Number of directions n_s; 0 without sensitivities.
    pub n_s: usize,
    /// Outputs, n_w numbers per time.
    pub w: Vec<f64>,
    /// ∂w/∂θ, n_w · n_s numbers per time, direction by direction; NaN where undefined.
    pub dw: Vec<f64>,
}

impl Observations {
    /// Outputs at the k-th time.
    pub fn w(&self, k: usize) -> &[f64] {
        &self.w[k * self.n_w..(k + 1) * self.n_w]
    }

    /// Sensitivities at the k-th time: `dw(k)[j * n_w + i]` is ∂wᵢ/∂θⱼ.
    pub fn dw(&self, k: usize) -> &[f64] {
        let len = self.n_w * self.n_s;
        &self.dw[k * len..(k + 1) * len]
    }
}

/// Evaluates the outputs at the times of a solution of `problem`.
///
/// Outputs that the run evaluated itself are returned unchanged. Where inputs jump, they are taken on the same side as
/// the solution's values. An output with a delay is read at t − τ, and
///
/// ```text
///   ∂w/∂θ = (∂w/∂y S + ∂w/∂θ|_y)(t − τ) − ẇ(t − τ) ∂τ/∂θ,   ẇ = ∂w/∂y ẏ + ∂w/∂u u̇ + ∂w/∂t
/// ```
///
/// with ẏ and u̇ on that side: where w itself jumps, the jump is not differentiated. Before the start and beyond the
/// end of the run, ẏ and u̇ are zero.
///
/// # Panics
///
/// If the solution belongs to another problem.
pub fn observe<S: SolvableSystem>(problem: &Problem<'_, S>, solution: &Solution) -> Observations {
    let system = problem.system;
    let n_w = system.signature().outputs.len();
    let n_s = solution.n_s;
    let len = n_w * n_s;
    if !solution.w.is_empty() {
        return Observations { n_w, n_s: 0, w: solution.w.clone(), dw: Vec::new() };
    }
    let mut observations = Observations {
        n_w,
        n_s,
        w: vec![0.0; n_w * solution.len()],
        dw: vec![0.0; len * solution.len()],
    };
    let inputs = problem.inputs_read();
    let inputs = inputs.unwrap_or_else(|error| panic!("the inputs were read before: {error}"));
    let mut u = S::Inputs::zeros(inputs.len());
    for (k, &t) in solution.times.iter().enumerate() {
        inputs.value(t, solution.side(k), u.as_mut());
        u.as_mut()[inputs.len() - solution.n_past..].copy_from_slice(solution.past(k));
        let (y, z) = (solution.y(k), solution.z(k));
        let point = EvaluationPoint { t, y, u: u.as_ref(), p: problem.p, z };
        let w = &mut observations.w[k * n_w..(k + 1) * n_w];
        if n_s == 0 {
            system.outputs(point, w);
        } else {
            let dw = &mut observations.dw[k * len..(k + 1) * len];
            system.output_sensitivities(point, solution.s(k), w, dw);
        }
    }
    for delayed in &solution.delayed_outputs {
        DelayedOutputs::new(problem, &inputs, solution, delayed).read(&mut observations);
    }
    observations
}

/// Outputs with one delay.
struct DelayedOutputs<'a, S: SolvableSystem> {
    problem: &'a Problem<'a, S>,
    inputs: &'a Inputs,
    solution: &'a Solution,
    values: &'a DelayedOutputValues,
    /// The outputs read with this delay.
    outputs: Vec<usize>,
    /// ∂τ/∂θ, n_s.
    dtau: Vec<f64>,
    u: S::Inputs,
    udot: S::Inputs,
    rates: UnknownRates<S>,
    /// Non-zeros of ∂w/∂y, ∂w/∂u, ∂w/∂p, and ∂w/∂t.
    jacobians: [Vec<f64>; 4],
}

impl<'a, S: SolvableSystem> DelayedOutputs<'a, S> {
    fn new(
        problem: &'a Problem<'a, S>,
        inputs: &'a Inputs,
        solution: &'a Solution,
        delayed: &'a DelayedOutputValues,
    ) -> Self {
        let signature = problem.system.signature();
        let outputs = signature.outputs.iter().enumerate();
        let n_tau = signature.delays.len();
        let dtau = if solution.n_s == 0 { Vec::new() } else { delay_sensitivities(problem) };
        // The sizes of unknowns are those at the start.
        let first = delayed.y.get(..solution.n).unwrap_or(&[]);
        let [by_y, by_u, by_p] = &signature.output_jacobians;
        let lengths = [by_y.len(), by_u.len(), by_p.len(), signature.outputs.len()];
        DelayedOutputs {
            problem,
            inputs,
            solution,
            values: delayed,
            outputs: outputs
                .filter(|(_, w)| w.delay == Some(delayed.delay))
                .map(|(i, _)| i)
                .collect(),
            dtau: dtau.chunks_exact(n_tau).map(|column| column[delayed.delay]).collect(),
            u: S::Inputs::zeros(inputs.len()),
            udot: S::Inputs::zeros(inputs.len()),
            rates: UnknownRates::new(problem.system, first),
            jacobians: lengths.map(|len| vec![0.0; len]),
        }
    }

    /// Replaces the outputs at t by those at t − τ.
    fn read(&mut self, observations: &mut Observations) {
        let Problem { system, p, .. } = *self.problem;
        let (n_w, n_s) = (observations.n_w, observations.n_s);
        let (n, n_z) = (self.solution.n, self.solution.n_z);
        let (mut w, mut dw) = (vec![0.0; n_w], vec![0.0; n_w * n_s]);
        let mut wdot = vec![0.0; n_w];
        let n_conditions = system.signature().discrete.n_time_conditions;
        let moves = self.dtau.iter().any(|dtau| *dtau != 0.0);
        for (k, &s) in self.values.times.iter().enumerate() {
            // Time itself is not clamped to the run.
            let t = self.solution.times[k] - self.values.tau;
            let y = &self.values.y[k * n..(k + 1) * n];
            let mut z = Cow::Borrowed(&self.values.z[k * n_z..(k + 1) * n_z]);
            if t != s && n_conditions > 0 {
                let conditions = n_z - n_conditions..;
                let there = discrete_numbers(system, p, t);
                z.to_mut()[conditions.clone()].copy_from_slice(&there[conditions]);
            }
            let z = z.as_ref();
            let segment = self.inputs.segment(self.inputs.segment_at(s, self.side(k)));
            segment.value(s, self.u.as_mut());
            let n_past = self.solution.n_past;
            let first = self.inputs.len() - n_past;
            self.u.as_mut()[first..]
                .copy_from_slice(&self.values.past[k * n_past..(k + 1) * n_past]);
            let point = EvaluationPoint { t, y, u: self.u.as_ref(), p, z };
            if n_s == 0 {
                system.outputs(point, &mut w);
            } else {
                let sensitivities = &self.values.s[k * n * n_s..(k + 1) * n * n_s];
                system.output_sensitivities(point, sensitivities, &mut w, &mut dw);
            }
            if moves {
                let inside = t == s;
                let udot = self.udot.as_mut();
                if inside {
                    udot.copy_from_slice(segment.udot);
                } else {
                    udot.fill(0.0);
                }
                self.output_rates(t, y, z, inside, &mut wdot);
            }
            for &i in &self.outputs {
                observations.w[k * n_w + i] = w[i];
                for (j, &dtau) in self.dtau.iter().enumerate() {
                    let dw = dw[j * n_w + i];
                    observations.dw[(k * n_s + j) * n_w + i] =
                        if dtau == 0.0 { dw } else { dw - wdot[i] * dtau };
                }
            }
        }
    }

    fn side(&self, k: usize) -> LimitSide {
        if self.values.times[k] > self.solution.times[0] {
            self.solution.side(k)
        } else {
            LimitSide::Right
        }
    }

    /// ẇ along the solution; y and u are constant outside of the run, if `inside` is false.
    fn output_rates(&mut self, t: f64, y: &[f64], z: &[f64], inside: bool, wdot: &mut [f64]) {
        let Problem { system, p, .. } = *self.problem;
        let point = EvaluationPoint { t, y, u: self.u.as_ref(), p, z };
        let [dwdy, dwdu, dwdp, dwdt] = &mut self.jacobians;
        system.output_jacobians(point, dwdy, dwdu, dwdp, dwdt);
        wdot.copy_from_slice(dwdt);
        if !inside {
            return;
        }
        let udot = self.udot.as_ref();
        let ydot = self.rates.evaluate(system, point, udot);
        let [by_y, by_u, _] = &system.signature().output_jacobians;
        for ((row, column), slope) in by_y.positions().zip(&*dwdy) {
            wdot[row] += slope * ydot.map_or(f64::NAN, |ydot| ydot[column]);
        }
        for ((row, column), slope) in by_u.positions().zip(&*dwdu) {
            wdot[row] += slope * udot[column];
        }
    }
}
