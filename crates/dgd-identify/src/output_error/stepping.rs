//! The step sizes of a fit's simulations.
//!
//! With equal steps per sample, cost and gradient of all trials are consistent. The number of steps and the method are
//! chosen once, at the starting point, and kept for all trials. At the end of the fit, the errors are measured over all
//! recordings; if they exceed the tolerance, the fit continues from there with more steps. If no step of a search helps
//! although the slope predicts a reduction, it continues with tighter tolerances: costs that are compared always have
//! the same accuracy.

use std::num::NonZeroU32;

use dgd_runtime::for_identify::inputs_change_by_sample;
use dgd_runtime::integrate::catalogue::DEFAULT;
use dgd_runtime::model::{ModelProblem, choose_per_sample, measure, per_sample_of_head};
use dgd_runtime::{IntegrateError, Options, PerSample, PerSampleChoice, Problem, Steps};

use crate::error::{EstimateError, TrialFailed, TrialFailure};
use crate::minimise::trust_region::Termination;
use crate::output_error::OutputErrorProblem;
use crate::recording::Recording;
use crate::variables::FitVariables;

/// With more steps per sample than this, adaptive steps are better.
const MOST: u32 = 8;

/// Factor by which tolerances are tightened if a search stalls.
const TIGHTER: f64 = 0.01;

/// Limit on the number of times.
const MOST_TIGHTENED: u32 = 2;

/// Lower limit of relative tolerances, which is not far from rounding errors.
const LEAST_RTOL: f64 = 1e-12;

/// Steps and accuracy of a fit's simulations: the same for all costs that are compared.
#[derive(Clone, Copy)]
pub(crate) struct SteppingAccuracy {
    pub stepping: FitStepping,
    options: Options,
    tightened: u32,
}

impl SteppingAccuracy {
    /// The accuracy with which a fit begins at z.
    pub(crate) fn first(
        problem: &OutputErrorProblem<'_>,
        variables: &FitVariables,
        z: &[f64],
    ) -> Result<Self, EstimateError> {
        let stepping = FitStepping::first(problem, variables, z)?;
        Ok(Self { stepping, options: problem.options, tightened: 0 })
    }

    /// The options of its simulations.
    pub(crate) fn applied(&self) -> Options {
        self.stepping.applied(self.options)
    }

    /// The accuracy to continue with from z after a search: with more steps if their errors are too large, with tighter
    /// tolerances if it stalled.
    pub(crate) fn next(
        &self,
        problem: &OutputErrorProblem<'_>,
        variables: &FitVariables,
        z: &[f64],
        ended: Option<Termination>,
    ) -> Result<Option<Self>, EstimateError> {
        // On a plateau smaller steps do not help.
        if matches!(ended, Some(Termination::Stopped | Termination::Flat)) {
            return Ok(None);
        }
        let with = |options| OutputErrorProblem { options, ..problem.clone() };
        if let Some(stepping) = self.stepping.next(&with(self.options), variables, z)? {
            return Ok(Some(Self { stepping, ..*self }));
        }
        let Options { rtol, atol, .. } = self.options;
        let options = Options { rtol: TIGHTER * rtol, atol: TIGHTER * atol, ..self.options };
        let is_last = self.tightened >= MOST_TIGHTENED || options.rtol < LEAST_RTOL;
        if ended != Some(Termination::Stalled) || is_last {
            return Ok(None);
        }
        let stepping = match self.stepping {
            FitStepping::Adaptive => Some(FitStepping::Adaptive),
            FitStepping::Exact => None,
            FitStepping::PerSample(_) => self.stepping.next(&with(options), variables, z)?,
        };
        let tightened = self.tightened + 1;
        Ok(stepping.map(|stepping| Self { stepping, options, tightened }))
    }
}

/// The steps of a fit's simulations.
#[derive(Debug, Clone, Copy)]
pub enum FitStepping {
    /// Adaptive, by error control.
    Adaptive,
    /// None: linear models have exact solutions between samples.
    Exact,
    /// A constant number per sample with a fixed method.
    PerSample(PerSampleChoice),
}

impl FitStepping {
    /// The options with this stepping.
    pub fn applied(self, options: Options) -> Options {
        match self {
            // The operating point of a linear model may come from a run.
            Self::Adaptive | Self::Exact => Options { steps: Steps::Adaptive, ..options },
            Self::PerSample(choice) => choice.applied(options),
        }
    }

    /// The steps for a fit that starts at z.
    pub(crate) fn first(
        problem: &OutputErrorProblem<'_>,
        variables: &FitVariables,
        z: &[f64],
    ) -> Result<Self, EstimateError> {
        let Options { method, steps, .. } = problem.options;
        let linear = |recording: &Recording| recording.linear.is_some();
        if problem.recordings.iter().any(linear) {
            let all_linear = problem.recordings.iter().all(linear);
            return Ok(if all_linear { Self::Exact } else { Self::Adaptive });
        }
        match steps {
            Steps::Adaptive => Ok(Self::Adaptive),
            Steps::PerSample(PerSample::Exactly(steps)) => {
                Ok(Self::PerSample(PerSampleChoice { method, steps }))
            }
            Steps::PerSample(PerSample::Automatic) => {
                let first = NonZeroU32::MIN;
                enough(problem, variables, z, PerSampleChoice { method, steps: first })
            }
            Steps::Automatic => Ok(Self::suited(problem, variables, z).unwrap_or(Self::Adaptive)),
        }
    }

    /// Constant steps, if the recordings and the model are suitable.
    fn suited(
        problem: &OutputErrorProblem<'_>,
        variables: &FitVariables,
        z: &[f64],
    ) -> Option<Self> {
        let p = variables.parameters(problem.p, z);
        let mut choice = PerSampleChoice { method: problem.options.method, steps: NonZeroU32::MIN };
        for (r, recording) in problem.recordings.iter().enumerate() {
            let start = variables.starts(r, &recording.start, z);
            let run = Problem {
                system: &problem.system,
                p: &p,
                inputs: &recording.inputs,
                start: &start,
            };
            if !inputs_change_by_sample(&run, &recording.times) {
                return None;
            }
            if r == 0 && std::ptr::eq(choice.method, DEFAULT) {
                choice = choose_per_sample(&run, &recording.times, &problem.options).ok()?;
            }
        }
        let choice_found = enough(problem, variables, z, choice).ok()?;
        choice_found.is_short().then_some(choice_found)
    }

    /// Whether there are few steps per sample.
    fn is_short(self) -> bool {
        match self {
            Self::Adaptive | Self::Exact => true,
            Self::PerSample(choice) => choice.steps.get() <= MOST,
        }
    }

    /// The steps to continue with from z after a fit, if the errors are too large.
    pub(crate) fn next(
        self,
        problem: &OutputErrorProblem<'_>,
        variables: &FitVariables,
        z: &[f64],
    ) -> Result<Option<Self>, EstimateError> {
        let Self::PerSample(choice) = self else { return Ok(None) };
        if matches!(problem.options.steps, Steps::PerSample(PerSample::Exactly(_))) {
            return Ok(None);
        }
        let exponent = choice.method.kind.estimate_order(problem.options.rtol) + 1;
        let wanted = most(problem, variables, z, |run, times| {
            let measured =
                measure(run, times, choice.steps.get(), &choice.applied(problem.options))?;
            Ok(measured.wants_more_than(choice.steps.get(), exponent).unwrap_or(0))
        })?;
        let next = NonZeroU32::new(wanted).filter(|wanted| *wanted > choice.steps);
        let next = next.map(|steps| Self::PerSample(PerSampleChoice { steps, ..choice }));
        Ok(match (next, problem.options.steps) {
            (Some(next), Steps::Automatic) if !next.is_short() => Some(Self::Adaptive),
            (next, _) => next,
        })
    }
}

/// As many steps per sample as the beginnings of all recordings require, at least those of `choice`.
fn enough(
    problem: &OutputErrorProblem<'_>,
    variables: &FitVariables,
    z: &[f64],
    choice: PerSampleChoice,
) -> Result<FitStepping, EstimateError> {
    let options = Options { method: choice.method, ..problem.options };
    let wanted =
        most(problem, variables, z, |run, times| per_sample_of_head(run, times, &options))?;
    let steps = NonZeroU32::new(wanted).map_or(choice.steps, |wanted| wanted.max(choice.steps));
    Ok(FitStepping::PerSample(PerSampleChoice { steps, ..choice }))
}

/// The largest number required by the recordings at z.
fn most(
    problem: &OutputErrorProblem<'_>,
    variables: &FitVariables,
    z: &[f64],
    number: impl Fn(&ModelProblem<'_>, &[f64]) -> Result<u32, IntegrateError>,
) -> Result<u32, EstimateError> {
    let p = variables.parameters(problem.p, z);
    let mut most = 0;
    for (r, recording) in problem.recordings.iter().enumerate() {
        let start = variables.starts(r, &recording.start, z);
        let run =
            Problem { system: &problem.system, p: &p, inputs: &recording.inputs, start: &start };
        let number = number(&run, &recording.times).map_err(|error| {
            let reason = TrialFailure::Simulation(error);
            EstimateError::Start(TrialFailed { recording: r, reason })
        })?;
        most = most.max(number);
    }
    Ok(most)
}
