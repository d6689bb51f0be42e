//! How the simulations of a fit step.
//!
//! With equal steps per sample, cost and gradient of every trial belong to the same steps. Their number
//! and the method are chosen once, where the fit starts, and kept for all trials. Where the fit has
//! ended, the errors are measured over all recordings; if they are above the tolerance, the fit goes on
//! from there with more steps.

use std::num::NonZeroU32;

use dgd_runtime::for_identify::inputs_change_by_sample;
use dgd_runtime::integrate::catalogue::DEFAULT;
use dgd_runtime::model::{ModelProblem, choose_per_sample, measure, per_sample_of_head};
use dgd_runtime::{IntegrateError, Options, PerSample, PerSampleChoice, Problem, Steps};

use crate::error::{EstimateError, TrialFailed, TrialFailure};
use crate::output_error::OutputErrorProblem;
use crate::recording::Recording;
use crate::variables::Variables;

/// More steps per sample than these are no better than adaptive steps.
const MOST: u32 = 8;

/// How the simulations of a fit step.
#[derive(Debug, Clone, Copy)]
pub enum Stepping {
    /// As long as the error of each allows.
    Adaptive,
    /// Not at all: linear models have their solution between samples.
    Exact,
    /// Equally, so many per sample and by this method, in all of them.
    PerSample(PerSampleChoice),
}

impl Stepping {
    /// The options with it.
    pub fn applied(self, options: Options) -> Options {
        match self {
            // A linear model's operating point may be that of a run.
            Self::Adaptive | Self::Exact => Options { steps: Steps::Adaptive, ..options },
            Self::PerSample(choice) => choice.applied(options),
        }
    }

    /// How to step in a fit that starts at z.
    pub(crate) fn first(
        problem: &OutputErrorProblem<'_>,
        variables: &Variables,
        z: &[f64],
    ) -> Result<Self, EstimateError> {
        let Options { method, steps, .. } = problem.options;
        let linear = |recording: &Recording| recording.linear.is_some();
        if problem.recordings.iter().any(linear) {
            let all = problem.recordings.iter().all(linear);
            return Ok(if all { Self::Exact } else { Self::Adaptive });
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

    /// Equal steps, where the recordings and the model allow them.
    fn suited(problem: &OutputErrorProblem<'_>, variables: &Variables, z: &[f64]) -> Option<Self> {
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
        let found = enough(problem, variables, z, choice).ok()?;
        found.is_short().then_some(found)
    }

    /// Whether steps per sample are few.
    fn is_short(self) -> bool {
        match self {
            Self::Adaptive | Self::Exact => true,
            Self::PerSample(choice) => choice.steps.get() <= MOST,
        }
    }

    /// How to go on from z, where a fit with this has ended, if its errors are too large.
    pub(crate) fn next(
        self,
        problem: &OutputErrorProblem<'_>,
        variables: &Variables,
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

/// As many steps per sample as the beginnings of all recordings need, no fewer than in `choice`.
fn enough(
    problem: &OutputErrorProblem<'_>,
    variables: &Variables,
    z: &[f64],
    choice: PerSampleChoice,
) -> Result<Stepping, EstimateError> {
    let options = Options { method: choice.method, ..problem.options };
    let wanted =
        most(problem, variables, z, |run, times| per_sample_of_head(run, times, &options))?;
    let steps = NonZeroU32::new(wanted).map_or(choice.steps, |wanted| wanted.max(choice.steps));
    Ok(Stepping::PerSample(PerSampleChoice { steps, ..choice }))
}

/// The largest number that the recordings give at z.
fn most(
    problem: &OutputErrorProblem<'_>,
    variables: &Variables,
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
