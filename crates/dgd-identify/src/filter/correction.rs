//! Corrects the estimate by the samples of a row.

use dgd_runtime::Inputs;
use nalgebra::DMatrix;

use super::estimator::{Innovation, RowInnovations, RunningFilter, TrackedRow};
use super::interval::LocalModel;
use super::problem::FilterAlgorithm;
use super::square_root::correct;
use super::unscented::SigmaSpread;
use crate::error::TrialFailure;

/// Predicted outputs.
struct PredictedOutputs {
    /// Outputs.
    w: Vec<f64>,
    /// Root of their covariance without sensor noise, and root of the covariance of the variables with the same
    /// columns.
    of_outputs: DMatrix<f64>,
    of_variables: DMatrix<f64>,
}

impl RunningFilter<'_> {
    /// Corrects the estimate by the measured values.
    pub(super) fn correct(
        &mut self,
        inputs: &Inputs,
        measured: &[f64],
    ) -> Result<TrackedRow, TrialFailure> {
        let used: Vec<usize> = (0..measured.len())
            .filter(|i| measured[*i].is_finite() && self.noise[*i].is_some())
            .collect();
        self.innovated = RowInnovations::default();
        if used.is_empty() {
            return Ok(self.row(vec![None; measured.len()]));
        }
        let looked = match self.estimator {
            FilterAlgorithm::Unscented(spread) => self.look_by_points(spread, inputs),
            FilterAlgorithm::ExtendedKalman | FilterAlgorithm::Recursive { .. } => {
                self.look(inputs)
            }
        };
        let looked = looked.and_then(|looked| self.verify_outputs(looked, &used))?;
        Ok(self.take(&looked, &used, measured))
    }

    /// Outputs and roots of their covariance, from derivatives.
    fn look(&mut self, inputs: &Inputs) -> Result<PredictedOutputs, TrialFailure> {
        let LocalModel { y, w, c, .. } = match self.ahead.take() {
            Some(ahead) => ahead,
            None => {
                self.model.local(inputs, self.t, &self.place, &self.coordinates, &self.variables)?
            }
        };
        self.place.y = y;
        let of_outputs = match &self.carried {
            Some(carried) => c * carried * &self.root,
            None => c * &self.root,
        };
        Ok(PredictedOutputs { w, of_outputs, of_variables: self.root.clone() })
    }

    /// Outputs and roots of their covariance, from sigma points.
    fn look_by_points(
        &mut self,
        spread: SigmaSpread,
        inputs: &Inputs,
    ) -> Result<PredictedOutputs, TrialFailure> {
        let points = spread.points(&self.variables, &self.root);
        let n = self.variables.len();
        let mut outputs = DMatrix::zeros(self.noise.len(), points.ncols());
        for (point, mut output) in points.column_iter().zip(outputs.column_iter_mut()) {
            let variables: Vec<f64> = point.iter().copied().collect();
            let place = self.place.moved_by(&variables[self.coordinates.len()..]);
            let w = self.model.outputs(inputs, self.t, &place, &self.coordinates, &variables)?;
            output.copy_from_slice(&w);
        }
        let (mean, of_outputs) = spread.moments(&outputs, n);
        let (_, of_variables) = spread.moments(&points, n);
        Ok(PredictedOutputs { w: mean.iter().copied().collect(), of_outputs, of_variables })
    }

    /// Checks that measured outputs are finite.
    fn verify_outputs(
        &self,
        looked: PredictedOutputs,
        seen: &[usize],
    ) -> Result<PredictedOutputs, TrialFailure> {
        let spoilt = seen.iter().find(|i| {
            let finite = |value: &f64| value.is_finite();
            !(looked.w[**i].is_finite() && looked.of_outputs.row(**i).iter().all(finite))
        });
        match spoilt {
            None => Ok(looked),
            Some(i) => {
                let output = self.model.system.signature().outputs[*i].name.to_string();
                Err(TrialFailure::OutputNotFinite { output, t: self.t })
            }
        }
    }

    /// Processes the samples of a row.
    fn take(&mut self, looked: &PredictedOutputs, seen: &[usize], measured: &[f64]) -> TrackedRow {
        let mut innovations = vec![None; measured.len()];
        let (mut used, mut rejected) = (Vec::with_capacity(seen.len()), 0.0);
        for &i in seen {
            let sigma = self.noise[i].unwrap_or(f64::INFINITY);
            let value = measured[i] - looked.w[i];
            let std = (sigma * sigma + looked.of_outputs.row(i).norm_squared()).sqrt();
            let within = self.gate.is_none_or(|gate| value.abs() <= gate * std);
            innovations[i] = Some(Innovation { value, std, used: within });
            if within {
                used.push(i);
            } else {
                rejected += (value / std).powi(2);
            }
        }
        let sigma: Vec<f64> = used.iter().filter_map(|i| self.noise[*i]).collect();
        let epsilon: Vec<f64> = used.iter().map(|i| measured[*i] - looked.w[*i]).collect();
        let of_outputs = looked.of_outputs.select_rows(&used);
        let corrected = correct(&sigma, &of_outputs, &looked.of_variables, &epsilon);
        self.root = corrected.root;
        self.innovated = RowInnovations { outputs: used, epsilon, root: corrected.innovation_root };
        let step = match &self.carried {
            Some(carried) => carried * corrected.step,
            None => corrected.step,
        };
        for (variable, step) in self.variables.iter_mut().zip(step.iter()) {
            *variable += step;
        }
        self.coordinates.project(&mut self.variables);
        self.coordinates.write_states(&self.variables, &mut self.place.y);
        if let Some(past) = &mut self.place.past {
            let steps = &mut self.variables[self.coordinates.len()..];
            past.correct(steps);
            steps.fill(0.0);
        }
        if let FilterAlgorithm::Recursive { forgetting_factor, .. } = self.estimator {
            self.forget(forgetting_factor, &looked.of_variables);
        }

        let square = corrected.whitened.norm_squared();
        let alarm = self.watch.take(square + rejected, seen.len());
        let row = self.row(innovations);
        TrackedRow {
            normalised_square: square,
            log_det: corrected.log_det,
            samples: self.innovated.outputs.len(),
            alarm,
            ..row
        }
    }

    /// P ← P/λ for the parameters, unless it would wind up: then it stays as before the row.
    fn forget(&mut self, factor: f64, before: &DMatrix<f64>) {
        let n_states = self.coordinates.n_states();
        if factor >= 1.0 || n_states == self.coordinates.len() {
            return;
        }
        for mut row in self.root.row_iter_mut().skip(n_states) {
            row /= factor.sqrt();
        }
        let parameters = self.root.rows(n_states, self.coordinates.len() - n_states);
        let largest = parameters.clone_owned().svd(false, false).singular_values.max();
        if largest * largest > self.most {
            self.root.copy_from(before);
        }
    }
}
