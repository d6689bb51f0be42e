//! One row after the other.
//!
//! Every row is taken in at once, as it would come from an instrument: the estimate is moved from the last
//! row to this one, with inputs that hold or go in a straight line as declared, and then corrected by what
//! was measured, with the inputs of this row. Of two rows with one time the second has the inputs after a
//! jump; a reading that both have is one reading.
//!
//! A row in which the model cannot be evaluated keeps the last states, less certain by what they stray;
//! many such rows on end are an error.

use nalgebra::{DMatrix, DVector};

use super::coordinates::Coordinates;
use super::drive::Drive;
use super::error::FilterError;
use super::interval::{Local, Model};
use super::problem::{
    Estimator, FilterProblem, Sample, Tuning, verify_first_inputs, verify_tuning,
};
use super::square_root::{beside, correct, integrated_noise, triangular};
use super::unscented::Spread;
use super::watch::{Alarm, Watch};
use crate::identify::error::TrialFailure;
use crate::initial::consistent_start;
use crate::problem::Problem;
use crate::signal::Inputs;
use crate::system::System;

/// Rows on end in which the model may fail.
const MOST_FAILURES: usize = 10;

/// An estimate and how certain it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tracked {
    /// Value, SI.
    pub value: f64,
    /// Standard deviation, SI; that of a parameter with a logarithm is to first order.
    pub std: f64,
}

/// A sample less what was predicted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Measured less predicted, SI.
    pub value: f64,
    /// Its standard deviation as the filter expects it, noise of the sensor included, SI.
    pub std: f64,
    /// Whether it was used; a sample beyond the gate is not.
    pub used: bool,
}

/// What is known after a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Time, s.
    pub t: f64,
    /// Differential unknowns, in the order of y.
    pub states: Vec<Tracked>,
    /// Free parameters, in the order of the directions.
    pub parameters: Vec<Tracked>,
    /// For each output, its innovation where it was measured and has a noise.
    pub innovations: Vec<Option<Innovation>>,
    /// εᵀ S⁻¹ ε over the samples that were used.
    pub normalised_square: f64,
    /// ln det S over them.
    pub log_det: f64,
    /// How many there were.
    pub samples: usize,
    /// Why the model could not be evaluated in this row.
    pub failure: Option<TrialFailure>,
    /// Whether what is to be thought of the innovations changes with this row.
    pub alarm: Option<Alarm>,
}

/// A filter under way.
pub struct Filter<'a, S> {
    model: Model<'a, S>,
    estimator: Estimator,
    gate: Option<f64>,
    coordinates: Coordinates,
    drive: Drive,
    watch: Watch,
    t: f64,
    /// Unknowns at t: guesses of the algebraic ones.
    y: Vec<f64>,
    /// States and parameters.
    variables: Vec<f64>,
    /// L of their covariance L Lᵀ; for [`Estimator::Recursive`] that of start values and parameters.
    root: DMatrix<f64>,
    /// ∂(x, θ)/∂(x(0), θ), for [`Estimator::Recursive`].
    carried: Option<DMatrix<f64>>,
    /// Largest eigenvalue that the parameters' covariance may have, for [`Estimator::Recursive`].
    most: f64,
    /// Spectral densities of the variables, and the variances that parameters began with.
    densities: Vec<f64>,
    first: Vec<f64>,
    noise: Vec<Option<f64>>,
    /// What the last row measured.
    last: Vec<f64>,
    failures: usize,
    /// The model close to the prediction, where that was needed for it.
    ahead: Option<Local>,
    /// The innovations that were used last.
    innovated: Innovated,
}

/// Innovations of a row.
#[derive(Debug, Clone, Default)]
pub(super) struct Innovated {
    /// Positions of the outputs.
    pub outputs: Vec<usize>,
    /// ε, SI.
    pub epsilon: Vec<f64>,
    /// S½, lower triangular.
    pub root: DMatrix<f64>,
}

impl<'a, S: System> Filter<'a, S> {
    /// A filter at its first row, and what is known there.
    ///
    /// # Errors
    ///
    /// [`FilterError`], all variants but `Stuck`.
    ///
    /// # Panics
    ///
    /// When lengths are not those of the model's signature.
    pub fn begin(
        problem: &FilterProblem<'a, S>,
        tuning: &Tuning,
        first: Sample<'_>,
    ) -> Result<(Self, Row), FilterError> {
        let signature = problem.system.signature();
        assert_eq!(problem.p.len(), signature.parameters.len(), "number of parameters");
        assert_eq!(problem.free.len(), signature.directions.len(), "number of directions");
        assert_eq!(first.u.len(), signature.inputs.len(), "number of inputs");
        assert_eq!(first.measured.len(), signature.outputs.len(), "number of outputs");
        assert_eq!(tuning.noise.len(), signature.outputs.len(), "number of outputs");
        assert_eq!(tuning.states.len(), problem.states().len(), "number of states");
        assert_eq!(tuning.parameters.len(), problem.parameters().len(), "number of parameters");
        let model = Model::new(problem)?;
        verify_tuning(problem, tuning)?;
        if tuning.noise.iter().all(Option::is_none) {
            return Err(FilterError::NothingMeasured);
        }
        verify_first_inputs(problem, first)?;
        let mut drive = Drive::default();
        drive.push(first.t, first.u, signature)?;
        let inputs = drive.inputs(signature)?;
        let mut filter = Self::new(problem, tuning, model, &inputs, first.t)?;
        filter.drive = drive;
        filter.last.copy_from_slice(first.measured);
        let row = filter.corrected(&inputs, first.measured, None)?;
        Ok((filter, row))
    }

    /// The same with inputs that are known as functions of time, for recordings.
    pub(super) fn begin_recorded(
        problem: &FilterProblem<'a, S>,
        tuning: &Tuning,
        inputs: &Inputs,
        (t, measured): (f64, &[f64]),
    ) -> Result<(Self, Row), FilterError> {
        let model = Model::new(problem)?;
        let mut filter = Self::new(problem, tuning, model, inputs, t)?;
        let row = filter.corrected(inputs, measured, None)?;
        Ok((filter, row))
    }

    /// A filter before its first row.
    fn new(
        problem: &FilterProblem<'a, S>,
        tuning: &Tuning,
        model: Model<'a, S>,
        inputs: &Inputs,
        t: f64,
    ) -> Result<Self, FilterError> {
        let started =
            Problem { system: problem.system, p: problem.p, inputs, start: &problem.start };
        let y = consistent_start(&started, t, &problem.options).map_err(FilterError::Start)?.y;
        let (coordinates, variables) = Coordinates::new(problem, &y)?;

        let walks = tuning.states.iter().chain(&tuning.parameters);
        let scaled = |(k, value): (usize, f64)| value / coordinates.slope(k, variables[k]).abs();
        let start: Vec<f64> =
            walks.clone().map(|walk| walk.start).enumerate().map(scaled).collect();
        let rates = walks.map(|walk| walk.rate).enumerate().map(scaled);
        let n = coordinates.len();
        let recursive = matches!(problem.estimator, Estimator::Recursive { .. });
        let densities = rates.map(|rate| if recursive { 0.0 } else { rate * rate }).collect();
        let of_parameters = start[coordinates.n_states()..].iter();
        let largest = of_parameters.fold(0.0, |most: f64, start| most.max(start * start));
        let most = match problem.estimator {
            Estimator::Recursive { most_covariance, .. } => most_covariance * largest,
            Estimator::ExtendedKalman | Estimator::Unscented(_) => f64::INFINITY,
        };
        let n_outputs = tuning.noise.len();
        Ok(Self {
            model,
            estimator: problem.estimator,
            gate: problem.gate,
            coordinates,
            drive: Drive::default(),
            watch: Watch::default(),
            t,
            y,
            variables,
            root: DMatrix::from_diagonal(&DVector::from_column_slice(&start)),
            carried: recursive.then(|| DMatrix::identity(n, n)),
            most,
            densities,
            first: start.iter().map(|start| start * start).collect(),
            noise: tuning.noise.clone(),
            last: vec![f64::NAN; n_outputs],
            failures: 0,
            ahead: None,
            innovated: Innovated::default(),
        })
    }

    /// Takes in a row. After an error about its inputs the filter is as before.
    ///
    /// # Errors
    ///
    /// [`FilterError::Inputs`] for a row whose time is before the last, or the third with one time;
    /// [`FilterError::Stuck`].
    ///
    /// # Panics
    ///
    /// When lengths are not those of the model's signature.
    pub fn step(&mut self, sample: Sample<'_>) -> Result<Row, FilterError> {
        let signature = self.model.system.signature();
        assert_eq!(sample.u.len(), signature.inputs.len(), "number of inputs");
        assert_eq!(sample.measured.len(), signature.outputs.len(), "number of outputs");
        self.drive.push(sample.t, sample.u, signature)?;
        let p = self.coordinates.p(self.model.p, &self.variables);
        self.drive.forget(self.model.reach(&p));
        let inputs = self.drive.inputs(signature)?;
        let mut measured = sample.measured.to_vec();
        if sample.t == self.t {
            for (measured, last) in measured.iter_mut().zip(&self.last) {
                if measured == last {
                    *measured = f64::NAN;
                }
            }
        }
        self.last.copy_from_slice(sample.measured);
        self.advance(&inputs, sample.t, &measured)
    }

    /// Moves the estimate to a time and corrects it.
    pub(super) fn advance(
        &mut self,
        inputs: &Inputs,
        until: f64,
        measured: &[f64],
    ) -> Result<Row, FilterError> {
        let from = self.t;
        self.ahead = None;
        let mut failure = None;
        if until > from {
            let moved = self.predict(inputs, from, until);
            self.t = until;
            if let Err(reason) = moved {
                self.ahead = None;
                self.stray(until - from);
                failure = Some(reason);
            }
        }
        // What was measured may bring the states back to where the model can be evaluated.
        self.corrected(inputs, measured, failure)
    }

    /// Corrects the estimate; `failure` is why it could not be moved before.
    fn corrected(
        &mut self,
        inputs: &Inputs,
        measured: &[f64],
        failure: Option<TrialFailure>,
    ) -> Result<Row, FilterError> {
        let (row, failure) = match self.correct(inputs, measured) {
            Ok(row) => (row, failure),
            Err(reason) => (self.row(vec![None; measured.len()]), failure.or(Some(reason))),
        };
        self.failures = if failure.is_some() { self.failures + 1 } else { 0 };
        match failure {
            Some(failure) if self.failures >= MOST_FAILURES => {
                Err(FilterError::Stuck { t: self.t, rows: self.failures, failure })
            }
            failure => Ok(Row { failure, ..row }),
        }
    }

    /// The innovations that the last row used.
    pub(super) fn innovated(&self) -> &Innovated {
        &self.innovated
    }

    /// How many values of each input were missing so far and taken to be the last ones.
    pub fn missing_inputs(&self) -> &[usize] {
        &self.drive.missing
    }

    /// Moves the estimate to the next row. After an error it is where it was.
    fn predict(&mut self, inputs: &Inputs, from: f64, until: f64) -> Result<(), TrialFailure> {
        match self.estimator {
            Estimator::Unscented(spread) => self.predict_points(spread, inputs, from, until),
            Estimator::ExtendedKalman | Estimator::Recursive { .. } => {
                let Self { model, coordinates, variables, y, .. } = &*self;
                let moved = model.move_with_sensitivities(
                    inputs,
                    (from, until),
                    y,
                    coordinates,
                    variables,
                )?;
                let mut phi = DMatrix::identity(coordinates.len(), coordinates.len());
                phi.view_mut((0, 0), moved.phi.shape()).copy_from(&moved.phi);
                let mut next = variables.clone();
                coordinates.read_states(&moved.y, &mut next);
                if let Some(carried) = &mut self.carried {
                    *carried = phi * &*carried;
                } else {
                    let (noise, ahead) = self.noise_over(inputs, (from, until), &moved.y, &next)?;
                    self.root = triangular(&beside(&(phi * &self.root), &noise));
                    self.ahead = ahead;
                }
                (self.y, self.variables) = (moved.y, next);
                Ok(())
            }
        }
    }

    /// The same by sigma points.
    fn predict_points(
        &mut self,
        spread: Spread,
        inputs: &Inputs,
        from: f64,
        until: f64,
    ) -> Result<(), TrialFailure> {
        let Self { model, coordinates, y, .. } = &*self;
        let mut points = spread.points(&self.variables, &self.root);
        let n = coordinates.len();
        let mut middle = None;
        for mut point in points.column_iter_mut() {
            let mut variables: Vec<f64> = point.iter().copied().collect();
            let moved = model.move_states(inputs, (from, until), y, coordinates, &variables)?;
            coordinates.read_states(&moved, &mut variables);
            point.copy_from_slice(&variables);
            middle.get_or_insert(moved);
        }
        let (mean, deviations) = spread.moments(&points, n);
        let next: Vec<f64> = mean.iter().copied().collect();
        let y = middle.unwrap_or_else(|| y.clone());
        let (noise, _) = self.noise_over(inputs, (from, until), &y, &next)?;
        self.root = triangular(&beside(&deviations, &noise));
        (self.y, self.variables) = (y, next);
        Ok(())
    }

    /// Root of what the walks add over an interval, with the model's Jacobian at its end.
    fn noise_over(
        &self,
        inputs: &Inputs,
        (from, until): (f64, f64),
        y: &[f64],
        variables: &[f64],
    ) -> Result<(DMatrix<f64>, Option<Local>), TrialFailure> {
        let n = self.coordinates.len();
        let densities = self.guarded(until - from);
        if densities.iter().all(|q| *q == 0.0) {
            return Ok((DMatrix::zeros(n, 0), None));
        }
        let local = self.model.local(inputs, until, y, &self.coordinates, variables)?;
        let Some(noise) = integrated_noise(&local.a, &densities, until - from) else {
            let equation = self.model.system.signature().name.to_string();
            return Err(TrialFailure::NoSensitivity { equation, t: until });
        };
        Ok((noise, Some(local)))
    }

    /// Densities of the walks; parameters that are as uncertain as at first do not walk.
    fn guarded(&self, dt: f64) -> Vec<f64> {
        let n_states = self.coordinates.n_states();
        let mut densities = self.densities.clone();
        for (k, density) in densities.iter_mut().enumerate().skip(n_states) {
            let variance = self.root.row(k).norm_squared();
            *density = density.min((self.first[k] - variance).max(0.0) / dt);
        }
        densities
    }

    /// States that could not be moved are less certain.
    fn stray(&mut self, dt: f64) {
        let densities = self.guarded(dt);
        let noise =
            DVector::from_iterator(densities.len(), densities.iter().map(|q| (q * dt).sqrt()));
        self.root = triangular(&beside(&self.root, &DMatrix::from_diagonal(&noise)));
    }

    /// Corrects the estimate by what was measured.
    fn correct(&mut self, inputs: &Inputs, measured: &[f64]) -> Result<Row, TrialFailure> {
        let seen: Vec<usize> = (0..measured.len())
            .filter(|i| measured[*i].is_finite() && self.noise[*i].is_some())
            .collect();
        self.innovated = Innovated::default();
        if seen.is_empty() {
            return Ok(self.row(vec![None; measured.len()]));
        }
        let looked = match self.estimator {
            Estimator::Unscented(spread) => self.look_by_points(spread, inputs),
            Estimator::ExtendedKalman | Estimator::Recursive { .. } => self.look(inputs),
        };
        let looked = looked.and_then(|looked| self.verify_outputs(looked, &seen))?;
        Ok(self.take(&looked, &seen, measured))
    }

    /// Outputs and roots of their covariance by derivatives.
    fn look(&mut self, inputs: &Inputs) -> Result<Look, TrialFailure> {
        let Local { y, w, c, .. } = match self.ahead.take() {
            Some(ahead) => ahead,
            None => {
                self.model.local(inputs, self.t, &self.y, &self.coordinates, &self.variables)?
            }
        };
        self.y = y;
        let of_outputs = match &self.carried {
            Some(carried) => c * carried * &self.root,
            None => c * &self.root,
        };
        Ok(Look { w, of_outputs, of_variables: self.root.clone() })
    }

    /// The same by sigma points.
    fn look_by_points(&mut self, spread: Spread, inputs: &Inputs) -> Result<Look, TrialFailure> {
        let points = spread.points(&self.variables, &self.root);
        let n = self.coordinates.len();
        let mut outputs = DMatrix::zeros(self.noise.len(), points.ncols());
        for (point, mut output) in points.column_iter().zip(outputs.column_iter_mut()) {
            let variables: Vec<f64> = point.iter().copied().collect();
            let w = self.model.outputs(inputs, self.t, &self.y, &self.coordinates, &variables)?;
            output.copy_from_slice(&w);
        }
        let (mean, of_outputs) = spread.moments(&outputs, n);
        let (_, of_variables) = spread.moments(&points, n);
        Ok(Look { w: mean.iter().copied().collect(), of_outputs, of_variables })
    }

    /// Outputs that were measured must be numbers.
    fn verify_outputs(&self, looked: Look, seen: &[usize]) -> Result<Look, TrialFailure> {
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

    /// Takes in the samples of a row.
    fn take(&mut self, looked: &Look, seen: &[usize], measured: &[f64]) -> Row {
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
        self.innovated = Innovated { outputs: used, epsilon, root: corrected.innovation_root };
        let step = match &self.carried {
            Some(carried) => carried * corrected.step,
            None => corrected.step,
        };
        for (variable, step) in self.variables.iter_mut().zip(step.iter()) {
            *variable += step;
        }
        self.coordinates.project(&mut self.variables);
        self.coordinates.write_states(&self.variables, &mut self.y);
        if let Estimator::Recursive { forgetting_factor, .. } = self.estimator {
            self.forget(forgetting_factor, &looked.of_variables);
        }

        let square = corrected.whitened.norm_squared();
        let alarm = self.watch.take(square + rejected, seen.len());
        let row = self.row(innovations);
        Row {
            normalised_square: square,
            log_det: corrected.log_det,
            samples: self.innovated.outputs.len(),
            alarm,
            ..row
        }
    }

    /// P ← P/λ for the parameters, unless it would wind up: then it stays what it was before the row.
    fn forget(&mut self, factor: f64, before: &DMatrix<f64>) {
        if factor >= 1.0 {
            return;
        }
        let n_states = self.coordinates.n_states();
        for mut row in self.root.row_iter_mut().skip(n_states) {
            row /= factor.sqrt();
        }
        let parameters = self.root.rows(n_states, self.coordinates.len() - n_states);
        let largest = parameters.clone_owned().svd(false, false).singular_values.max();
        if largest * largest > self.most {
            self.root.copy_from(before);
        }
    }

    /// The present estimates.
    fn row(&self, innovations: Vec<Option<Innovation>>) -> Row {
        let root = match &self.carried {
            Some(carried) => carried * &self.root,
            None => self.root.clone(),
        };
        let tracked = |k: usize| Tracked {
            value: self.coordinates.value(k, self.variables[k]),
            std: root.row(k).norm() * self.coordinates.slope(k, self.variables[k]).abs(),
        };
        let n_states = self.coordinates.n_states();
        Row {
            t: self.t,
            states: (0..n_states).map(tracked).collect(),
            parameters: (n_states..self.coordinates.len()).map(tracked).collect(),
            innovations,
            normalised_square: 0.0,
            log_det: 0.0,
            samples: 0,
            failure: None,
            alarm: None,
        }
    }
}

/// What is expected of the outputs.
struct Look {
    /// Outputs.
    w: Vec<f64>,
    /// Root of their covariance without the sensors' noise, and of that of the variables with the same
    /// columns.
    of_outputs: DMatrix<f64>,
    of_variables: DMatrix<f64>,
}
