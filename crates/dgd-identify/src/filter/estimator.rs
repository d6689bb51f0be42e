//! The filter, row by row.
//!
//! Every row is processed immediately, as it would arrive from an instrument: the estimate is moved from the last row
//! to this one, with inputs held or linear as declared, and then corrected by the measured values, with the inputs of
//! this row. Of two rows with the same time the second has the inputs after a jump; a reading that both have counts
//! once.
//!
//! A row in which the model cannot be evaluated keeps the last states, with larger uncertainty due to process noise;
//! many consecutive rows of this kind are an error.

use dgd_runtime::for_identify::unknown_sizes;
use dgd_runtime::{Inputs, Problem, Signature, consistent_start};
use nalgebra::{DMatrix, DVector};

use super::coordinates::FilterCoordinates;
use super::drive::InputHistory;
use super::error::FilterError;
use super::interval::{IntervalModel, LocalModel, RunState, TimeInterval};
use super::prediction::consistent;
use super::problem::{
    FilterAlgorithm, FilterProblem, FilterSample, FilterTuning, verify_first_inputs, verify_tuning,
};
use super::remembered::EstimateHistory;
use super::square_root::triangular;
use super::watch::{InnovationAlarm, InnovationMonitor};
use crate::error::{TrialFailure, WrongLength, verify_lengths};

/// Number of consecutive rows in which the model may fail.
const MOST_FAILURES: usize = 10;

/// An estimate and its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackedEstimate {
    /// Value, SI.
    pub value: f64,
    /// Standard deviation, SI; to first order for a parameter with a logarithm.
    pub std: f64,
}

/// The difference between a sample and its prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Measured minus predicted, SI.
    pub value: f64,
    /// Its predicted standard deviation, including the sensor's noise, SI.
    pub std: f64,
    /// Whether it was used; samples outside the gate are not.
    pub used: bool,
}

/// The estimates after a row.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedRow {
    /// Time, s.
    pub t: f64,
    /// Unknowns that are differential in some mode, in the order of y.
    pub states: Vec<TrackedEstimate>,
    /// Free parameters, in the order of the directions.
    pub parameters: Vec<TrackedEstimate>,
    /// For each output, its innovation if it was measured and has noise.
    pub innovations: Vec<Option<Innovation>>,
    /// εᵀ S⁻¹ ε over the samples used.
    pub normalised_square: f64,
    /// ln det S over these samples.
    pub log_det: f64,
    /// Number of these samples.
    pub samples: usize,
    /// The reason why the model could not be evaluated in this row.
    pub failure: Option<TrialFailure>,
    /// A change in the consistency of the innovations with this row.
    pub alarm: Option<InnovationAlarm>,
}

/// A running filter.
pub struct RunningFilter<'a> {
    pub(super) model: IntervalModel<'a>,
    pub(super) estimator: FilterAlgorithm,
    pub(super) gate: Option<f64>,
    pub(super) coordinates: FilterCoordinates,
    pub(super) drive: InputHistory,
    pub(super) watch: InnovationMonitor,
    pub(super) t: f64,
    /// Unknowns and modes at t.
    pub(super) place: RunState,
    /// States and parameters, then remembered values, as perturbations of the past: zeros between rows.
    pub(super) variables: Vec<f64>,
    /// L of their covariance L Lᵀ; for [`FilterAlgorithm::Recursive`] that of start values and parameters.
    pub(super) root: DMatrix<f64>,
    /// ∂(x, θ)/∂(x(0), θ), for [`FilterAlgorithm::Recursive`].
    pub(super) carried: Option<DMatrix<f64>>,
    /// Limit on the largest eigenvalue of the parameters' covariance, for [`FilterAlgorithm::Recursive`].
    pub(super) most: f64,
    /// Spectral densities of the variables, and the initial variances of the parameters.
    pub(super) densities: Vec<f64>,
    pub(super) first: Vec<f64>,
    pub(super) noise: Vec<Option<f64>>,
    /// Measured values of the last row.
    pub(super) last: Vec<f64>,
    pub(super) failures: usize,
    /// The model near the prediction, if the prediction needed it.
    pub(super) ahead: Option<LocalModel>,
    /// The innovations that were used last.
    pub(super) innovated: RowInnovations,
}

/// Innovations of a row.
#[derive(Debug, Clone, Default)]
pub(super) struct RowInnovations {
    /// Positions of the outputs.
    pub outputs: Vec<usize>,
    /// ε, SI.
    pub epsilon: Vec<f64>,
    /// S½, lower triangular.
    pub root: DMatrix<f64>,
}

fn verify_sample(signature: &Signature, sample: FilterSample<'_>) -> Result<(), WrongLength> {
    WrongLength::verify("inputs", sample.u.len(), signature.inputs.len())?;
    WrongLength::verify("measured outputs", sample.measured.len(), signature.outputs.len())
}

impl<'a> RunningFilter<'a> {
    /// A filter at its first row, and the estimates there.
    ///
    /// # Errors
    ///
    /// [`FilterError`], all variants except `Stuck`.
    pub fn begin(
        problem: &FilterProblem<'a>,
        tuning: &FilterTuning,
        first: FilterSample<'_>,
    ) -> Result<(Self, TrackedRow), FilterError> {
        let signature = problem.system.signature();
        verify_lengths(signature, problem.p, &problem.free, &[], tuning.noise.len())?;
        verify_sample(signature, first)?;
        WrongLength::verify("walks of states", tuning.states.len(), problem.states().len())?;
        let parameters = problem.parameters().len();
        WrongLength::verify("walks of parameters", tuning.parameters.len(), parameters)?;
        let model = IntervalModel::new(problem)?;
        verify_tuning(problem, tuning)?;
        if tuning.noise.iter().all(Option::is_none) {
            return Err(FilterError::NothingMeasured);
        }
        verify_first_inputs(problem, first)?;
        let mut drive = InputHistory::default();
        drive.push(first.t, first.u, signature)?;
        let inputs = drive.inputs(signature)?;
        let mut filter = Self::new(problem, tuning, model, &inputs, first.t)?;
        filter.drive = drive;
        filter.last.copy_from_slice(first.measured);
        let row = filter.corrected(&inputs, first.measured, None)?;
        Ok((filter, row))
    }

    /// [`RunningFilter::begin`] for recordings, with inputs that are known as functions of time.
    pub(super) fn begin_recorded(
        problem: &FilterProblem<'a>,
        tuning: &FilterTuning,
        inputs: &Inputs,
        t: f64,
        measured: &[f64],
    ) -> Result<(Self, TrackedRow), FilterError> {
        let model = IntervalModel::new(problem)?;
        let mut filter = Self::new(problem, tuning, model, inputs, t)?;
        let row = filter.corrected(inputs, measured, None)?;
        Ok((filter, row))
    }

    /// A filter before its first row.
    fn new(
        problem: &FilterProblem<'a>,
        tuning: &FilterTuning,
        model: IntervalModel<'a>,
        inputs: &Inputs,
        t: f64,
    ) -> Result<Self, FilterError> {
        let started =
            Problem { system: &problem.system, p: problem.p, inputs, start: &problem.start };
        let y = consistent_start(&started, t, &problem.options).map_err(FilterError::Start)?.y;
        let (coordinates, variables) = FilterCoordinates::new(problem, &y)?;

        let walks = tuning.states.iter().chain(&tuning.parameters);
        let scaled = |(k, value): (usize, f64)| value / coordinates.slope(k, variables[k]).abs();
        let start: Vec<f64> =
            walks.clone().map(|walk| walk.start).enumerate().map(scaled).collect();
        let rates = walks.map(|walk| walk.rate).enumerate().map(scaled);
        let n = coordinates.len();
        let recursive = matches!(problem.estimator, FilterAlgorithm::Recursive { .. });
        let densities = rates.map(|rate| if recursive { 0.0 } else { rate * rate }).collect();
        let of_parameters = start[coordinates.n_states()..].iter();
        let largest = of_parameters.fold(0.0, |most: f64, start| most.max(start * start));
        let most = match problem.estimator {
            FilterAlgorithm::Recursive { most_covariance, .. } => most_covariance * largest,
            FilterAlgorithm::ExtendedKalman | FilterAlgorithm::Unscented(_) => f64::INFINITY,
        };
        let n_outputs = tuning.noise.len();
        let mut filter = Self {
            model,
            estimator: problem.estimator,
            gate: problem.gate,
            coordinates,
            drive: InputHistory::default(),
            watch: InnovationMonitor::default(),
            t,
            place: RunState { y, memory: None, past: None },
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
            innovated: RowInnovations::default(),
        };
        filter.make_consistent(inputs);
        filter.begin_past(inputs);
        Ok(filter)
    }

    /// Starts to store delayed unknowns.
    fn begin_past(&mut self, inputs: &Inputs) {
        let Self { model, t, place, coordinates, variables, .. } = &mut *self;
        let watched = model.watched();
        if watched.is_empty() {
            return;
        }
        let n = coordinates.len();
        // A failure here recurs at the first row, which reports the reason.
        let local = model.local(inputs, *t, place, coordinates, variables);
        let dependence =
            local.map_or_else(|_| DMatrix::zeros(watched.len(), n), |local| local.watched);
        let mut sizes = vec![0.0; place.y.len()];
        unknown_sizes(&model.system, &place.y, &mut sizes);
        place.past = Some(EstimateHistory::new(watched, &sizes, *t, &place.y));
        variables.resize(n + watched.len(), 0.0);
        self.remember(dependence);
    }

    /// Adds variables of a new node, given the dependence of its unknowns on the existing variables.
    pub(super) fn remember(&mut self, mut from_others: DMatrix<f64>) {
        let sizes = self.place.past.as_ref().map_or(&[][..], EstimateHistory::sizes);
        for (mut row, size) in from_others.row_iter_mut().zip(sizes) {
            row /= *size;
        }
        let below = |of: &DMatrix<f64>| {
            let new_rows = &from_others * of;
            let mut extended = of.clone().resize_vertically(of.nrows() + new_rows.nrows(), 0.0);
            extended.rows_mut(of.nrows(), new_rows.nrows()).copy_from(&new_rows);
            extended
        };
        // Recursive estimates have a root of start values and parameters only.
        match &mut self.carried {
            Some(carried) => *carried = below(carried),
            None => self.root = triangular(&below(&self.root)),
        }
    }

    /// States that are algebraic in the initial modes follow the others, and so does their uncertainty.
    fn make_consistent(&mut self, inputs: &Inputs) {
        let signature = self.model.system.signature();
        let states = &self.coordinates.states;
        if states.iter().all(|i| signature.unknowns.is_differential(*i))
            && signature.discrete.automata.is_empty()
        {
            return;
        }
        // A failure here recurs at the first row, which reports the reason.
        let Self { model, t, place, coordinates, variables, .. } = &*self;
        let Ok(local) = model.local(inputs, *t, place, coordinates, variables) else { return };
        self.coordinates.read_states(&local.y, &mut self.variables);
        let n = self.coordinates.len();
        match &mut self.carried {
            Some(carried) => *carried = consistent(&local.phi, DMatrix::identity(n, n)),
            None => self.root = consistent(&local.phi, std::mem::take(&mut self.root)),
        }
    }

    /// Processes a row. After an error in its inputs the filter is unchanged.
    ///
    /// # Errors
    ///
    /// [`FilterError::Length`]; [`FilterError::Inputs`] for a row whose time is before the last, or the third with the
    /// same time; [`FilterError::Stuck`].
    pub fn step(&mut self, sample: FilterSample<'_>) -> Result<TrackedRow, FilterError> {
        let signature = self.model.system.signature();
        verify_sample(signature, sample)?;
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
    ) -> Result<TrackedRow, FilterError> {
        let over = TimeInterval { from: self.t, until };
        self.ahead = None;
        let mut failure = None;
        if over.length() > 0.0 {
            let moved = self.predict(inputs, over);
            self.t = until;
            if let Err(reason) = moved {
                self.ahead = None;
                self.stray(until, over.length());
                failure = Some(reason);
            }
        }
        // The measured values may bring the states back to a region where the model can be evaluated.
        self.corrected(inputs, measured, failure)
    }

    /// Corrects the estimate; `failure` is the reason why it could not be moved.
    fn corrected(
        &mut self,
        inputs: &Inputs,
        measured: &[f64],
        failure: Option<TrialFailure>,
    ) -> Result<TrackedRow, FilterError> {
        let (row, failure) = match self.correct(inputs, measured) {
            Ok(row) => (row, failure),
            Err(reason) => (self.row(vec![None; measured.len()]), failure.or(Some(reason))),
        };
        self.failures = if failure.is_some() { self.failures + 1 } else { 0 };
        match failure {
            Some(failure) if self.failures >= MOST_FAILURES => {
                Err(FilterError::Stuck { t: self.t, rows: self.failures, failure })
            }
            failure => Ok(TrackedRow { failure, ..row }),
        }
    }

    /// Takes the innovations used by the last row.
    pub(super) fn take_innovated(&mut self) -> RowInnovations {
        std::mem::take(&mut self.innovated)
    }

    /// Number of values of each input so far that were missing and replaced by the last ones.
    pub fn missing_inputs(&self) -> &[usize] {
        &self.drive.missing
    }

    /// The current estimates.
    pub(super) fn row(&self, innovations: Vec<Option<Innovation>>) -> TrackedRow {
        let root = match &self.carried {
            Some(carried) => carried * &self.root,
            None => self.root.clone(),
        };
        let tracked = |k: usize| TrackedEstimate {
            value: self.coordinates.value(k, self.variables[k]),
            std: root.row(k).norm() * self.coordinates.slope(k, self.variables[k]).abs(),
        };
        let n_states = self.coordinates.n_states();
        TrackedRow {
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
