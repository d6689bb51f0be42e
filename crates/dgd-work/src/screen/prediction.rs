//! Prediction of an output of a model in steady state from the other outputs.
//!
//! A prediction is made only if it depends neither on parameters to be estimated nor on initial values: both are moved
//! by a tenth, and the change due to parameters adds to the uncertainty.

use dgd_runtime::{EvaluationPoint, Inputs, Parameter, Problem, System, start_from_outputs};
use dgd_screen::{Estimate, SteadyPeriod, mean};

use super::ScreenedRecording;
use super::against_model::{ModelColumns, ScreenModel};

/// Parameters are moved by this share to test the dependence on them.
const MOVED: f64 = 0.1;
/// A predicted output moves with initial values by less than this share of its noise.
const UNDETERMINED: f64 = 0.01;
/// Steady intervals that are tried.
const TRIED: usize = 8;

/// The predicted value of an output, and its uncertainty.
pub(super) struct PredictedOutput {
    pub(super) value: f64,
    pub(super) doubt: f64,
}

impl ScreenModel<'_> {
    /// The least uncertain prediction of an output, with the means that `means` computes from the same samples.
    pub(super) fn best_prediction<'s>(
        &self,
        one: &'s ScreenedRecording,
        columns: &ModelColumns,
        output: usize,
        means: impl Fn((usize, usize)) -> Option<Vec<Estimate>>,
    ) -> Option<(PredictedOutput, Vec<Estimate>, &'s SteadyPeriod)> {
        let mut stretches: Vec<&SteadyPeriod> = one.screening.motion.steady.iter().collect();
        let length = |s: &SteadyPeriod| s.stretch.until - s.stretch.from;
        stretches.sort_by(|a, b| length(b).total_cmp(&length(a)));
        let mut best: Option<(PredictedOutput, Vec<Estimate>, &SteadyPeriod)> = None;
        for steady in stretches.into_iter().take(TRIED) {
            let (Some(means), Some(predicted)) =
                (means(steady.samples), self.predicted(columns, steady.samples, output))
            else {
                continue;
            };
            if best.as_ref().is_none_or(|(other, ..)| predicted.doubt < other.doubt) {
                best = Some((predicted, means, steady));
            }
        }
        best
    }

    /// The prediction of an output in a steady interval from the other outputs, SI.
    fn predicted(
        &self,
        columns: &ModelColumns,
        samples: (usize, usize),
        output: usize,
    ) -> Option<PredictedOutput> {
        let (first, last) = samples;
        let known = self.known_outputs();
        let u: Vec<f64> = columns
            .inputs
            .iter()
            .map(|values| mean_of(&values.as_ref()?[first..=last]))
            .collect::<Option<_>>()?;
        let estimates: Vec<Option<Estimate>> = columns
            .outputs
            .iter()
            .enumerate()
            .map(|(i, values)| {
                let values = values.as_ref().filter(|_| i != output && known[i])?;
                mean(&values[first..=last])
            })
            .collect();
        let measured: Vec<Option<f64>> =
            estimates.iter().map(|estimate| estimate.map(|e| e.value)).collect();
        let p = self.p();
        let value = self.output_at(&u, &p, &measured, None, output)?;
        // The effects of the noise of the other outputs, of free parameters and of initial values add up.
        let mut squares = 0.0;
        for (i, estimate) in estimates.iter().enumerate() {
            let Some(estimate) = estimate.filter(|estimate| estimate.std_error > 0.0) else {
                continue;
            };
            let mut moved = measured.clone();
            moved[i] = Some(estimate.value + estimate.std_error);
            squares += (self.output_at(&u, &p, &moved, None, output)? - value).powi(2);
        }
        let mut doubt = squares.sqrt();
        for i in self.free() {
            let mut moved = p.clone();
            moved[i] += MOVED * size(&self.signature().parameters[i]);
            doubt += (self.output_at(&u, &moved, &measured, None, output)? - value).abs();
        }
        // A value that depends on the initial guess is not determined by the other outputs.
        let moved = self.output_at(&u, &p, &measured, Some(MOVED), output)?;
        ((moved - value).abs() <= UNDETERMINED * self.noise()[output])
            .then_some(PredictedOutput { value, doubt })
    }

    /// An output where the model's outputs equal the measured ones; initial values are first moved by a share of
    /// themselves.
    fn output_at(
        &self,
        u: &[f64],
        p: &[f64],
        measured: &[Option<f64>],
        moved: Option<f64>,
        output: usize,
    ) -> Option<f64> {
        let y = self.state_at(u, p, measured, &[], moved)?;
        let mut w = vec![0.0; self.signature().outputs.len()];
        self.system.outputs(EvaluationPoint { t: 0.0, y: &y, u, p, z: &[] }, &mut w);
        Some(w[output]).filter(|w| w.is_finite())
    }

    /// Unknowns where the model's outputs equal the measured ones, SI; `start` is the initial guess.
    pub(super) fn state_at(
        &self,
        u: &[f64],
        p: &[f64],
        measured: &[Option<f64>],
        start: &[(usize, f64)],
        moved: Option<f64>,
    ) -> Option<Vec<f64>> {
        let signature = self.signature();
        // For models with memory or switches, unknowns alone do not define a steady state.
        if !signature.discrete.is_empty() || signature.n_u() != signature.inputs.len() {
            return None;
        }
        let inputs = Inputs::constant(u);
        let problem = Problem { system: self.system, p, inputs: &inputs, start };
        let first = match moved {
            None => start.to_vec(),
            Some(share) => {
                let mut y = vec![0.0; signature.unknowns.len()];
                self.system.start(EvaluationPoint { t: 0.0, y: &[], u, p, z: &[] }, &mut y);
                let differential = signature.unknowns.differential();
                let nominal =
                    |i: usize| signature.unknowns.nominal(i).unwrap_or(y[i].abs().max(1e-3));
                differential.map(|i| (i, y[i] + share * nominal(i))).collect()
            }
        };
        let problem = Problem { start: &first, ..problem };
        let start = if measured.iter().any(Option::is_some) {
            start_from_outputs(&problem, 0.0, measured, &self.noise(), &self.options).ok()?
        } else {
            first.clone()
        };
        let problem = Problem { start: &start, ..problem };
        dgd_runtime::consistent_start(&problem, 0.0, &self.options).ok().map(|found| found.y)
    }
}

/// Magnitude of a parameter, for its change.
fn size(parameter: &Parameter) -> f64 {
    let declared = if parameter.value == 0.0 { parameter.unit.factor } else { parameter.value };
    parameter.nominal.unwrap_or(declared.abs())
}

fn mean_of(values: &[f64]) -> Option<f64> {
    let valid = values.iter().filter(|value| value.is_finite());
    let (sum, count) = valid.fold((0.0, 0), |(sum, n), value| (sum + value, n + 1));
    (count > 0).then(|| sum / f64::from(count))
}
