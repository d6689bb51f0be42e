//! Delayed outputs, evaluated from remembered values.
//!
//! ```text
//!   w(t) = E(s),  s = t − τ:   ∂w/∂δ_j = ∂E/∂y hat_j(s),   ∂w/∂θ = ∂E/∂θ − ẇ ∂τ/∂θ
//! ```
//!
//! with ẇ along the past. Before the first row all values are those of the first row.

use std::borrow::Cow;

use dgd_runtime::for_identify::{delay_sensitivities, delays};
use dgd_runtime::model::{Model, ModelProblem};
use dgd_runtime::{Direction, EvaluationPoint, Inputs, IntegrateError, LimitSide, Problem};
use nalgebra::DMatrix;

use super::coordinates::FilterCoordinates;
use super::error::FilterError;
use super::remembered::EstimateHistory;
use crate::error::TrialFailure;

/// Delayed outputs, with the unknowns that they read.
pub(super) struct DelayedOutputModel {
    outputs: Vec<DelayedOutput>,
}

struct DelayedOutput {
    /// Positions of the output and of its delay.
    output: usize,
    delay: usize,
    unknowns: Vec<usize>,
}

/// The values of the delayed outputs at one time.
pub(super) struct DelayedReadings<'a> {
    problem: &'a ModelProblem<'a>,
    here: EvaluationPoint<'a>,
    past: &'a EstimateHistory,
    all: Vec<(&'a DelayedOutput, DelayedReading)>,
}

/// The value of one of them.
struct DelayedReading {
    t: f64,
    y: Vec<f64>,
    ydot: Vec<f64>,
    u: Vec<f64>,
    udot: Vec<f64>,
}

impl DelayedOutputModel {
    /// # Errors
    ///
    /// [`FilterError::NotFollowed`] for outputs that read future values.
    pub(super) fn new(system: &dyn Model, p: &[f64]) -> Result<Self, FilterError> {
        let signature = system.signature();
        let inputs = Inputs::none();
        let tau = delays(&Problem { system: &system, p, inputs: &inputs, start: &[] });
        let [by_y, _, _] = &signature.output_jacobians;
        let mut outputs = Vec::new();
        for (i, output) in signature.outputs.iter().enumerate() {
            let Some(delay) = output.delay else { continue };
            if tau[delay] < 0.0 {
                let what = format!("what output `{}` will be", output.name);
                return Err(FilterError::NotFollowed { what });
            }
            let columns = by_y.positions().filter(|(row, _)| *row == i);
            let unknowns = columns.map(|(_, column)| column).collect();
            outputs.push(DelayedOutput { output: i, delay, unknowns });
        }
        Ok(Self { outputs })
    }

    /// Positions of the unknowns that they read.
    pub(super) fn unknowns(&self) -> impl Iterator<Item = usize> {
        self.outputs.iter().flat_map(|delayed| delayed.unknowns.iter().copied())
    }

    /// Their values; the inputs of the point `here` are not used.
    pub(super) fn read<'a>(
        &'a self,
        problem: &'a ModelProblem<'a>,
        here: EvaluationPoint<'a>,
        past: &'a EstimateHistory,
    ) -> Result<DelayedReadings<'a>, TrialFailure> {
        let mut unknowns = Vec::new();
        if !self.outputs.is_empty() {
            let (tau, inputs) = (delays(problem), inputs_read(problem)?);
            let read = |delayed: &'a DelayedOutput| {
                (delayed, reading(&inputs, here, tau[delayed.delay], past))
            };
            unknowns.extend(self.outputs.iter().map(read));
        }
        Ok(DelayedReadings { problem, here, past, all: unknowns })
    }
}

impl DelayedReadings<'_> {
    /// Replaces current outputs by their delayed values.
    pub(super) fn write(&self, w: &mut [f64]) {
        let mut values = vec![0.0; w.len()];
        for (delayed, was) in &self.all {
            self.problem.system.outputs(was.to_point(self.here), &mut values);
            w[delayed.output] = values[delayed.output];
        }
    }

    /// Replaces their rows of C, outputs × all variables.
    pub(super) fn differentiate(
        &self,
        coordinates: &FilterCoordinates,
        variables: &[f64],
        c: &mut DMatrix<f64>,
    ) {
        let Self { problem, here, past, all } = self;
        if all.is_empty() {
            return;
        }
        let signature = problem.system.signature();
        let dtau = delay_sensitivities(problem);
        let [by_y, by_u, by_p] = &signature.output_jacobians;
        let zeros = |len: usize| vec![0.0; len];
        let (mut dwdy, mut dwdu, mut dwdp) =
            (zeros(by_y.len()), zeros(by_u.len()), zeros(by_p.len()));
        let mut dwdt = zeros(signature.outputs.len());
        for (delayed, was) in all {
            let (row, at) = (delayed.output, was.to_point(*here));
            problem.system.output_jacobians(at, &mut dwdy, &mut dwdu, &mut dwdp, &mut dwdt);
            c.row_mut(row).fill(0.0);
            let mut rate = dwdt[row];
            for ((_, column), slope) in by_y.positions().zip(&dwdy).filter(|(at, _)| at.0 == row) {
                rate += slope * was.ydot[column];
                let unknown = past.watched().iter().position(|i| *i == column);
                for (variable, weight) in unknown.into_iter().flat_map(|k| past.weights(k, was.t)) {
                    c[(row, coordinates.len() + variable)] += slope * weight;
                }
            }
            for ((_, column), slope) in by_u.positions().zip(&dwdu).filter(|(at, _)| at.0 == row) {
                rate += slope * was.udot[column];
            }
            for (column, direction) in coordinates.directions.iter().enumerate() {
                let Direction::Parameter(i) = signature.directions[*direction] else { continue };
                let entry = by_p.positions().zip(&dwdp).find(|(at, _)| *at == (row, i));
                let by_theta = entry.map_or(0.0, |(_, slope)| *slope);
                let moved = rate * dtau[direction * signature.delays.len() + delayed.delay];
                c[(row, column)] =
                    (by_theta - moved) * coordinates.slope(column, variables[column]);
            }
        }
    }
}

impl DelayedReading {
    fn to_point<'a>(&'a self, here: EvaluationPoint<'a>) -> EvaluationPoint<'a> {
        EvaluationPoint { t: self.t, y: &self.y, u: &self.u, ..here }
    }
}

fn inputs_read<'p>(problem: &'p ModelProblem<'_>) -> Result<Cow<'p, Inputs>, TrialFailure> {
    problem.inputs_read().map_err(|error| TrialFailure::Simulation(IntegrateError::Inputs(error)))
}

/// The values a time `tau` before a point; unknowns that are not remembered have their current values.
fn reading(
    inputs: &Inputs,
    here: EvaluationPoint<'_>,
    tau: f64,
    past: &EstimateHistory,
) -> DelayedReading {
    let t = here.t - tau.max(0.0);
    let (mut y, mut ydot) = (here.y.to_vec(), vec![0.0; here.y.len()]);
    for (k, i) in past.watched().iter().enumerate() {
        (y[*i], ydot[*i]) = past.value(k, t);
    }
    let mut u = vec![0.0; inputs.len()];
    let known = t.max(past.since());
    let segment = inputs.segment(inputs.segment_at(known, LimitSide::Right));
    segment.value(known, &mut u);
    DelayedReading { t, y, ydot, u, udot: segment.udot.to_vec() }
}
