//! Why a fit, or one of its trials, failed.

use std::fmt;

use dgd_runtime::IntegrateError;
use dgd_runtime::linearize::NotLinearised;

use crate::filter::FilterError;

/// A point at which the residuals could not be evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialFailed {
    /// Position of the recording, from 0.
    pub recording: usize,
    /// What happened.
    pub reason: TrialFailure,
}

/// Why a recording could not be simulated.
#[derive(Debug, Clone, PartialEq)]
pub enum TrialFailure {
    /// The simulation stopped.
    Simulation(IntegrateError),
    /// The linear model that was asked for cannot be had.
    NotLinearised(Box<NotLinearised>),
    /// A simulated output is not a finite number where it was measured.
    OutputNotFinite {
        /// The output.
        output: String,
        /// The time, s.
        t: f64,
    },
    /// Derivatives are not defined.
    NoSensitivity {
        /// The equation to blame, or the model.
        equation: String,
        /// The time, s.
        t: f64,
    },
}

/// Why there is no fit.
#[derive(Debug, Clone, PartialEq)]
pub enum EstimateError {
    /// No parameter and no start value is free.
    NothingFree,
    /// No sample of an output in use counts.
    NothingMeasured,
    /// Fewer samples than unknowns.
    TooFewSamples {
        /// Samples that count, of all outputs in use.
        samples: usize,
        /// Free parameters and start values.
        free: usize,
    },
    /// The standard deviation of an output's noise is not a positive number.
    Noise {
        /// The output.
        output: String,
        /// Its standard deviation, SI.
        sigma: f64,
    },
    /// The logarithm of a parameter is to be estimated, and its value has none.
    NotPositive {
        /// The parameter.
        parameter: String,
        /// Its value, SI.
        value: f64,
    },
    /// The model cannot be simulated at the parameters that the fit starts from.
    Start(TrialFailed),
    /// The model cannot be filtered, which innovations need.
    NotFiltered(Box<FilterError>),
    /// It was stopped before there was anything to give.
    Stopped,
}

impl fmt::Display for TrialFailed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "recording {}: {}", self.recording + 1, self.reason)
    }
}

impl std::error::Error for TrialFailed {}

impl fmt::Display for TrialFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Simulation(error) => error.fmt(f),
            Self::NotLinearised(error) => error.fmt(f),
            Self::OutputNotFinite { output, t } => {
                write!(f, "output `{output}` is not finite at t = {t} s")
            }
            Self::NoSensitivity { equation, t } => {
                write!(f, "the derivatives of `{equation}` are not defined at t = {t} s")
            }
        }
    }
}

impl fmt::Display for EstimateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NothingFree => {
                write!(f, "nothing is free: there is no parameter and no start value to estimate")
            }
            Self::NothingMeasured => {
                write!(f, "nothing is measured: the recordings have no sample of an output in use")
            }
            Self::TooFewSamples { samples, free } => write!(
                f,
                "{samples} samples are too few for {free} free parameters and start values"
            ),
            Self::Noise { output, sigma } => write!(
                f,
                "the noise of output `{output}` is {sigma:e} in SI units and must be a positive \
                 number"
            ),
            Self::NotPositive { parameter, value } => write!(
                f,
                "the logarithm of parameter `{parameter}` is to be estimated, and its value \
                 {value:e} has none"
            ),
            Self::Start(failed) => {
                write!(f, "the model cannot be simulated where the fit starts: {failed}")
            }
            Self::NotFiltered(error) => error.fmt(f),
            Self::Stopped => write!(f, "it was stopped before there was a result"),
        }
    }
}

impl std::error::Error for EstimateError {}
