//! Simulates a recording by a linear model near an operating point, instead of the model itself.
//!
//! ```text
//!   δẋ = r + A δx + B δu,    w = w₀ + C δx + D δu       δx = x − x₀(θ),  δu = u − u₀
//!   x(0) is that of the model: start values are not linearised
//! ```
//!
//! Between samples inputs are linear, so the solution is exact ([`Responses`]); so are the derivatives with respect to
//! θ, including those of A, B, C, D and of the point ([`ParametricModel`]). An input with a free delay jumps at a time
//! that moves: at a jump Δv of u(t − τ) the derivative of x jumps by −B Δv dτ/dθ.

use dgd_runtime::for_identify::{
    DelayedOutputTimes, LinearMatrices, ParametricModel, Responses, delay_sensitivities,
    verify_inputs, verify_request,
};
use dgd_runtime::linearize::{LinearAt, NotLinearised, OperatingPoint};
use dgd_runtime::model::ModelProblem;
use dgd_runtime::parallel::in_parallel_by_model;
use dgd_runtime::{
    DelayedOutputValues, EvaluationPoint, Inputs, IntegrateError, LimitSide, Observations, Options,
    Problem, Segment, Solution, Text, consistent_start, simulate,
};
use nalgebra::DVector;

use crate::error::{TrialFailed, TrialFailure};
use crate::output_error::{OutputErrorEvaluation, OutputErrorProblem, Starts, evaluate};
use crate::recording::{DerivativeUse, Recording};

/// Relative rounding error of times, and so of the lengths of steps between them.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Outputs at the sample times of a recording, by the linear model at `at`.
pub(crate) fn outputs_of(
    problem: &ModelProblem<'_>,
    recording: &Recording,
    at: &LinearAt,
    options: &Options,
    derivatives: DerivativeUse,
) -> Result<Observations, NotLinearised> {
    let times: &[f64] = &recording.times;
    let signature = problem.system.signature();
    let with_slopes = derivatives == DerivativeUse::Yes;
    let n_s = if with_slopes { signature.directions.len() } else { 0 };
    let n_w = signature.outputs.len();
    let mut observations = Observations { n_w, n_s, w: Vec::new(), dw: Vec::new() };
    let Some(&from) = times.first() else { return Ok(observations) };
    verify_request(times, options)
        .map_err(IntegrateError::BadRequest)
        .and_then(|()| verify_inputs(problem, times).map_err(IntegrateError::Inputs))
        .map_err(NotLinearised::Run)?;
    let of_point = Problem { start: guess(recording, at, problem.start), ..*problem };
    let model = ParametricModel::new(&of_point, at, times, options, with_slopes)?;
    let start = LinearStart::new(problem, &model, from, options, n_s)?;
    let delayed = DelayedOutputTimes::new(problem, times).map_err(NotLinearised::Run)?;
    let inputs = problem.inputs_read().map_err(IntegrateError::Inputs);
    let inputs = inputs.map_err(NotLinearised::Run)?;
    let wanted = delayed.as_ref().map_or(times, |delayed| &delayed.all);
    let mut run = LinearRun::new(problem, &model, &inputs, start);
    let mut solution = run.run_to(wanted, Solution::empty(signature, n_s));
    if let Some(delayed) = &delayed {
        solution = delayed.split(times, solution);
    }
    run.observe(&solution, &mut observations);
    Ok(observations)
}

/// The initial state of a run.
struct LinearStart {
    x: DVector<f64>,
    /// ∂x/∂θ, by direction.
    s: Vec<DVector<f64>>,
}

impl LinearStart {
    fn new(
        problem: &ModelProblem<'_>,
        model: &ParametricModel,
        t: f64,
        options: &Options,
        n_s: usize,
    ) -> Result<Self, NotLinearised> {
        let system = problem.system;
        let signature = system.signature();
        let n = signature.unknowns.len();
        let start = consistent_start(problem, t, options).map_err(NotLinearised::Run)?;
        let inputs = problem.inputs_read().map_err(IntegrateError::Inputs);
        let inputs = inputs.map_err(NotLinearised::Run)?;
        let mut u = vec![0.0; inputs.len()];
        inputs.value(t, LimitSide::Right, &mut u);
        let point = EvaluationPoint { t, y: &[], u: &u, p: problem.p, z: &start.z };
        let mut mass = vec![0.0; n];
        system.mass(point, &mut mass);
        let other = (0..n).find(|i| (mass[*i] != 0.0) != model.states.contains(i));
        if let Some(i) = other {
            let unknown = signature.unknowns.name(i).to_string();
            return Err(NotLinearised::OtherStates { unknown });
        }
        let of_states = |values: &[f64]| {
            DVector::from_iterator(model.states.len(), model.states.iter().map(|i| values[*i]))
        };
        let mut s = vec![0.0; n * n_s];
        if n_s > 0 {
            problem.start_sensitivities(point, &mut s);
        }
        let s = (0..n_s).map(|j| of_states(&s[j * n..(j + 1) * n])).collect();
        Ok(Self { x: of_states(&start.y), s })
    }
}

/// A linear simulation in progress: δx, and dδx/dθ by direction.
struct LinearRun<'a> {
    problem: &'a ModelProblem<'a>,
    model: &'a LinearMatrices,
    /// Derivatives of the matrices, by direction.
    slopes: &'a [Option<LinearMatrices>],
    responses: Responses<'a>,
    inputs: &'a Inputs,
    /// ∂τ/∂θ of each delayed input, by direction and then by delayed input.
    dtau: Vec<Vec<f64>>,
    x: DVector<f64>,
    s: Vec<DVector<f64>>,
}

impl<'a> LinearRun<'a> {
    fn new(
        problem: &'a ModelProblem<'a>,
        model: &'a ParametricModel,
        inputs: &'a Inputs,
        start: LinearStart,
    ) -> Self {
        let signature = problem.system.signature();
        let directions = model.slopes.iter().flatten().map(|slopes| &slopes.a).collect();
        let delayed = &signature.delayed_inputs;
        let dtau = if delayed.is_empty() || model.slopes.is_empty() {
            vec![Vec::new(); model.slopes.len()]
        } else {
            let dtau = delay_sensitivities(problem);
            let columns = dtau.chunks_exact(signature.delays.len());
            columns
                .map(|dtau| delayed.iter().map(|delayed| dtau[delayed.delay]).collect())
                .collect()
        };
        let moves = start.s.into_iter().zip(&model.slopes).map(|(s, slopes)| match slopes {
            Some(slopes) => s - &slopes.x,
            None => s,
        });
        Self {
            problem,
            x: start.x - &model.model.x,
            s: moves.collect(),
            model: &model.model,
            slopes: &model.slopes,
            responses: Responses::new(&model.model.a, directions, &model.sizes),
            inputs,
            dtau,
        }
    }

    /// δx and its derivatives at these times, instead of a solution's unknowns.
    fn run_to(&mut self, times: &[f64], mut solution: Solution) -> Solution {
        solution.n = self.x.len();
        solution.n_z = 0;
        let Some(&first) = times.first() else { return solution };
        let mut t = first;
        let mut segment = self.inputs.segment_at(t, LimitSide::Right);
        for (k, &next) in times.iter().enumerate() {
            let last = self.inputs.segment_at(next, dgd_runtime::side(times, k));
            while segment < last {
                let end = self.inputs.segment(segment).t1;
                self.advance(segment, t, end);
                t = end;
                segment += 1;
                self.jump(segment, t);
            }
            self.advance(segment, t, next);
            t = next;
            solution.times.push(t);
            solution.y.extend_from_slice(self.x.as_slice());
            solution.s.extend(self.s.iter().flat_map(DVector::as_slice));
        }
        solution
    }

    /// Advances to `until` along one segment of the inputs.
    fn advance(&mut self, segment: usize, t: f64, until: f64) {
        if until <= t {
            return;
        }
        let segment = self.inputs.segment(segment);
        let driven = self.driven(segment, t);
        let udot = DVector::from_column_slice(segment.udot);
        let rounding = ROUNDING * t.abs().max(until.abs());
        // δẋ = A δx + b₀ + b₁ (t − t₀)
        let b_0 = &self.model.rates + &self.model.b * &driven.u;
        let b_1 = &self.model.b * &udot;
        let response = self.responses.response(until - t, rounding);
        let of_slopes = &mut response.slopes.iter();
        let value = &response.value;
        for ((s, slopes), moved) in self.s.iter_mut().zip(self.slopes).zip(&driven.moved) {
            let mut next = &value.phi * &*s;
            // The part of b₀ that is due to the inputs alone.
            let mut db_0 = &self.model.b * moved;
            if let Some(slopes) = slopes {
                db_0 += &slopes.rates + &slopes.b * &driven.u;
                next += &value.gamma_1 * (&slopes.b * &udot);
                if let Some(response) = of_slopes.next() {
                    next += &response.phi * &self.x;
                    next += &response.gamma_0 * &b_0;
                    next += &response.gamma_1 * &b_1;
                }
            }
            next += &value.gamma_0 * db_0;
            *s = next;
        }
        self.x = &value.phi * &self.x + &value.gamma_0 * b_0 + &value.gamma_1 * b_1;
    }

    /// Enters a segment, whose start moves with the delays of inputs that jump there.
    fn jump(&mut self, segment: usize, t: f64) {
        let signature = self.problem.system.signature();
        let (n_in, n_delayed) = (signature.inputs.len(), signature.delayed_inputs.len());
        if n_delayed == 0 || self.s.is_empty() {
            return;
        }
        let mut before = vec![0.0; self.inputs.len()];
        self.inputs.segment(segment - 1).value(t, &mut before);
        let after = self.inputs.segment(segment).u;
        for (s, dtau) in self.s.iter_mut().zip(&self.dtau) {
            for (k, dtau) in dtau.iter().enumerate().filter(|(_, dtau)| **dtau != 0.0) {
                for column in [n_in + k, n_in + n_delayed + k] {
                    let jump = after[column] - before[column];
                    s.axpy(-jump * dtau, &self.model.b.column(column), 1.0);
                }
            }
        }
    }

    /// δu, and its derivatives with respect to θ.
    fn driven(&self, segment: Segment<'_>, t: f64) -> InputDeviation {
        let signature = self.problem.system.signature();
        let (n_in, n_delayed) = (signature.inputs.len(), signature.delayed_inputs.len());
        let mut u = vec![0.0; self.inputs.len()];
        segment.value(t, &mut u);
        let moved = self.slopes.iter().zip(&self.dtau).map(|(slopes, dtau)| {
            let mut moved = match slopes {
                Some(slopes) => -slopes.u.clone(),
                None => DVector::zeros(u.len()),
            };
            for (k, dtau) in dtau.iter().enumerate() {
                moved[n_in + k] -= u[n_in + n_delayed + k] * dtau;
            }
            moved
        });
        let moved = moved.collect();
        InputDeviation { u: DVector::from_vec(u) - &self.model.u, moved }
    }

    /// Outputs of a solution, including delayed ones.
    fn observe(&self, solution: &Solution, observations: &mut Observations) {
        for (k, &t) in solution.times.iter().enumerate() {
            let segment = self.inputs.segment_at(t, solution.side(k));
            let driven = self.driven(self.inputs.segment(segment), t);
            let (x, s) = (solution.y(k), solution.s(k));
            let (w, dw) = self.outputs(x, s, &driven);
            observations.w.extend_from_slice(w.as_slice());
            observations.dw.extend(dw.iter().flat_map(DVector::as_slice));
        }
        for delayed in &solution.delayed_outputs {
            self.read_delayed(solution, delayed, observations);
        }
    }

    /// w, and dw/dθ by direction.
    fn outputs(
        &self,
        x: &[f64],
        s: &[f64],
        driven: &InputDeviation,
    ) -> (DVector<f64>, Vec<DVector<f64>>) {
        let LinearMatrices { c, d, w, .. } = self.model;
        let x = DVector::from_column_slice(x);
        let value = w + c * &x + d * &driven.u;
        let columns = self.slopes.iter().zip(&driven.moved).enumerate();
        let dw = columns.map(|(j, (slopes, moved))| {
            let s = DVector::from_column_slice(&s[j * x.len()..(j + 1) * x.len()]);
            let slope = c * s + d * moved;
            match slopes {
                Some(slopes) => slope + &slopes.w + &slopes.c * &x + &slopes.d * &driven.u,
                None => slope,
            }
        });
        (value, dw.collect())
    }

    /// Replaces outputs with one delay by their values at t − τ.
    fn read_delayed(
        &self,
        solution: &Solution,
        delayed: &DelayedOutputValues,
        observations: &mut Observations,
    ) {
        let signature = self.problem.system.signature();
        let (n, n_w, n_s) = (solution.n, observations.n_w, observations.n_s);
        let dtau = if n_s == 0 { Vec::new() } else { delay_sensitivities(self.problem) };
        let dtau: Vec<f64> =
            dtau.chunks_exact(signature.delays.len()).map(|dtau| dtau[delayed.delay]).collect();
        let LinearMatrices { a, b, c, d, rates, .. } = self.model;
        for (k, &read) in delayed.times.iter().enumerate() {
            let begun = read > solution.times[0];
            let side = if begun { solution.side(k) } else { LimitSide::Right };
            let segment = self.inputs.segment(self.inputs.segment_at(read, side));
            let driven = self.driven(segment, read);
            let x = &delayed.y[k * n..(k + 1) * n];
            let (w, dw) = self.outputs(x, &delayed.s[k * n * n_s..(k + 1) * n * n_s], &driven);
            // Outside of the run, values are constant.
            let inside = read == solution.times[k] - delayed.tau;
            let wdot = inside.then(|| {
                let xdot = rates + a * DVector::from_column_slice(x) + b * &driven.u;
                c * xdot + d * DVector::from_column_slice(segment.udot)
            });
            for (i, _) in
                signature.outputs.iter().enumerate().filter(|(_, w)| w.delay == Some(delayed.delay))
            {
                observations.w[k * n_w + i] = w[i];
                for (j, dw) in dw.iter().enumerate() {
                    let moved = wdot.as_ref().map_or(0.0, |wdot| wdot[i] * dtau[j]);
                    observations.dw[(k * n_s + j) * n_w + i] = dw[i] - moved;
                }
            }
        }
    }
}

/// δu at a time, and d(δu)/dθ by direction.
struct InputDeviation {
    u: DVector<f64>,
    moved: Vec<DVector<f64>>,
}

/// The nonlinear model with the estimates of its linearisation.
#[derive(Debug, Clone)]
pub struct NonlinearModel {
    /// Its outputs and errors.
    pub evaluation: OutputErrorEvaluation,
    /// The operating point of each recording.
    pub points: Vec<Option<OperatingPoint>>,
    /// For each recording, the first time at which its run is in another mode than its operating point.
    pub departures: Vec<Option<ModeDeparture>>,
}

/// A departure of a run from the mode of its operating point.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeDeparture {
    /// When, s.
    pub t: f64,
    /// The automaton, or the model's condition on time.
    pub automaton: Text,
    /// Its mode at the operating point.
    pub at_point: Text,
    /// Its mode in the run.
    pub in_run: Text,
}

/// The operating points of recordings; `None` for a recording without samples, or simulated by the model itself.
///
/// # Errors
///
/// [`TrialFailed`]: the first recording without an operating point.
pub fn operating_points(
    problem: &OutputErrorProblem<'_>,
    p: &[f64],
    starts: &[Starts],
) -> Result<Vec<Option<OperatingPoint>>, TrialFailed> {
    let recordings = problem.recordings.iter().zip(starts).enumerate();
    let points = recordings.map(|(r, (recording, start))| {
        let (Some(at), Some(&from)) = (&recording.linear, recording.times.first()) else {
            return Ok(None);
        };
        let start = guess(recording, at, start);
        let run = Problem { system: &problem.system, p, inputs: &recording.inputs, start };
        let failed = |error| TrialFailed {
            recording: r,
            reason: TrialFailure::NotLinearised(Box::new(error)),
        };
        at.point(&run, from, &problem.options).map(Some).map_err(failed)
    });
    points.collect()
}

/// Simulates recordings by the nonlinear model, with the estimates of its linearisation.
///
/// # Errors
///
/// [`TrialFailed`]: the first recording that cannot be simulated, or has no operating point.
pub fn nonlinear(
    problem: &OutputErrorProblem<'_>,
    p: &[f64],
    starts: &[Starts],
) -> Result<NonlinearModel, TrialFailed> {
    let points = operating_points(problem, p, starts)?;
    let of_model = |recording: &Recording| Recording { linear: None, ..recording.clone() };
    let recordings: Vec<Recording> = problem.recordings.iter().map(of_model).collect();
    let itself = OutputErrorProblem { recordings: &recordings, ..problem.clone() };
    let evaluation = evaluate(&itself, p, starts)?;
    let has_modes = !problem.system.signature().discrete.is_empty();
    let options = &problem.options;
    let departures =
        in_parallel_by_model(problem.system, recordings.len(), problem.threads, |system, r| {
            let Some(point) = points[r].as_ref().filter(|_| has_modes) else { return Ok(None) };
            let Recording { inputs, times, .. } = &recordings[r];
            let run = Problem { system: &system, p, inputs, start: &starts[r] };
            departure(&run, times, point, options)
        });
    let departures = departures.into_iter().enumerate().map(|(recording, found)| {
        let failed = |error| TrialFailed { recording, reason: TrialFailure::Simulation(error) };
        found.map_err(failed)
    });
    Ok(NonlinearModel { evaluation, points, departures: departures.collect::<Result<_, _>>()? })
}

/// The first departure of a run from the modes of the point; a `when` that acts counts as one.
fn departure(
    problem: &ModelProblem<'_>,
    times: &[f64],
    point: &OperatingPoint,
    options: &Options,
) -> Result<Option<ModeDeparture>, IntegrateError> {
    let discrete = &problem.system.signature().discrete;
    let solution = simulate(problem, times, options).map_err(|failure| failure.error)?;
    let event = solution.events.iter().find(|event| {
        let mut automata = discrete.automata.iter();
        automata
            .any(|automaton| !automaton.kind.keeps_slopes() && automaton.name == event.automaton)
    });
    let by_event = event.map(|event| ModeDeparture {
        t: event.t,
        automaton: event.automaton.clone(),
        at_point: event.from.clone(),
        in_run: event.to.clone(),
    });
    let differs = |k: usize| {
        let z = solution.z(k).iter().zip(&point.z).enumerate();
        let mut differing = z.filter(|(i, (z, at))| {
            z != at
                && discrete.automata.get(*i).is_none_or(|automaton| !automaton.kind.keeps_slopes())
        });
        differing.next().map(|(i, (z, at))| {
            let automaton = discrete.automata.get(i);
            let mode = |z: f64| {
                let modes = automaton.and_then(|automaton| automaton.modes.get(z as usize));
                modes
                    .cloned()
                    .unwrap_or_else(|| if z == 0.0 { "before".into() } else { "after".into() })
            };
            ModeDeparture {
                t: solution.times[k],
                automaton: automaton.map_or("a condition on time".into(), |a| a.name.clone()),
                at_point: mode(*at),
                in_run: mode(*z),
            }
        })
    };
    let by_sample = (0..solution.len()).find_map(differs);
    // An event before the first differing sample gives the time more exactly.
    Ok(match (by_event, by_sample) {
        (Some(event), Some(sample)) if sample.t < event.t => Some(sample),
        (Some(event), _) => Some(event),
        (None, sample) => sample,
    })
}

/// Start values for the search of a point. The search of a steady state uses the same ones in all trials, so that it
/// always finds the same one of several.
fn guess<'a>(
    recording: &'a Recording,
    at: &LinearAt,
    start: &'a [(usize, f64)],
) -> &'a [(usize, f64)] {
    match at {
        LinearAt::Rest(_) => &recording.start,
        LinearAt::Reached(_) => start,
    }
}
