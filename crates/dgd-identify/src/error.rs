//! Errors of a fit and of its trials.

use std::fmt;

use dgd_runtime::signature::number::short;

use dgd_runtime::linearize::NotLinearised;
use dgd_runtime::{IntegrateError, Signature};

use crate::filter::FilterError;
use crate::recording::Recording;
use crate::regression::RegressionError;

/// A point at which the residuals could not be evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialFailed {
    /// Position of the recording, from 0.
    pub recording: usize,
    /// The cause.
    pub reason: TrialFailure,
}

/// The reason why a recording could not be simulated.
#[derive(Debug, Clone, PartialEq)]
pub enum TrialFailure {
    /// The simulation stopped.
    Simulation(IntegrateError),
    /// The requested linear model does not exist.
    NotLinearised(Box<NotLinearised>),
    /// A simulated output is not finite at a reading.
    OutputNotFinite {
        /// The output.
        output: String,
        /// The time, s.
        t: f64,
    },
    /// The standard deviation of an output is not a positive number at a reading.
    Deviation {
        /// The output.
        output: String,
        /// The time, s.
        t: f64,
        /// Its value, SI.
        sigma: f64,
    },
    /// An output whose logarithm is compared is not positive at a reading.
    Logarithm {
        /// The output.
        output: String,
        /// The time, s.
        t: f64,
        /// Its value, SI.
        value: f64,
    },
    /// Derivatives are undefined.
    NoSensitivity {
        /// The first such equation, or the model.
        equation: String,
        /// The time, s.
        t: f64,
    },
}

/// A wrong number of values, compared with the model, the recordings or the problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WrongLength {
    /// Kind of the values, such as `values of parameters`.
    pub what: &'static str,
    /// Number of values given.
    pub given: usize,
    /// Number of values needed.
    pub expected: usize,
}

impl WrongLength {
    /// Checks that the number of values given is the number needed.
    pub(crate) fn verify(what: &'static str, given: usize, expected: usize) -> Result<(), Self> {
        if given == expected { Ok(()) } else { Err(WrongLength { what, given, expected }) }
    }
}

impl fmt::Display for WrongLength {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let WrongLength { what, given, expected } = self;
        write!(f, "{given} {what} are given, and {expected} are needed")
    }
}

impl From<WrongLength> for EstimateError {
    fn from(wrong: WrongLength) -> Self {
        EstimateError::Length(wrong)
    }
}

impl From<WrongLength> for FilterError {
    fn from(wrong: WrongLength) -> Self {
        FilterError::Length(wrong)
    }
}

impl From<WrongLength> for RegressionError {
    fn from(wrong: WrongLength) -> Self {
        RegressionError::Variables(wrong.into())
    }
}

/// Checks the lengths of the arguments that all estimators have in common.
pub(crate) fn verify_lengths(
    signature: &Signature,
    p: &[f64],
    free: &[bool],
    recordings: &[Recording],
    noise: usize,
) -> Result<(), WrongLength> {
    WrongLength::verify("values of parameters", p.len(), signature.parameters.len())?;
    WrongLength::verify("marks of what is free", free.len(), signature.directions.len())?;
    WrongLength::verify("noises of outputs", noise, signature.outputs.len())?;
    for recording in recordings {
        let outputs = recording.measured.len();
        WrongLength::verify("measured outputs", outputs, signature.outputs.len())?;
        for samples in recording.measured.iter().flatten() {
            WrongLength::verify("samples of an output", samples.len(), recording.times.len())?;
        }
    }
    Ok(())
}

/// The reason why a reading contradicts the noise of its output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WrongReading {
    /// It is log-normal but not positive, with this value, SI.
    NotPositive(f64),
    /// Its own standard deviation is not a positive number but this, SI.
    Deviation(f64),
}

/// The reason why a fit failed.
#[derive(Debug, Clone, PartialEq)]
pub enum EstimateError {
    /// Something has a wrong length.
    Length(WrongLength),
    /// No parameter and no start value is free.
    NothingFree,
    /// No used output has a reading that counts.
    NothingMeasured,
    /// Fewer samples than unknowns.
    TooFewSamples {
        /// Samples that count, of all used outputs.
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
    /// A loss other than squares is requested, but an output declares the distribution of its readings.
    LossOfDensity {
        /// The output.
        output: String,
    },
    /// A reading contradicts the noise of its output.
    Reading {
        /// The output.
        output: String,
        /// Position of the recording, from 0.
        recording: usize,
        /// Time of the reading, s.
        t: f64,
        /// The contradiction.
        wrong: WrongReading,
    },
    /// The logarithm of a parameter is to be estimated, but its value is not positive.
    NotPositive {
        /// The parameter.
        parameter: String,
        /// Its value, SI.
        value: f64,
    },
    /// The model cannot be simulated at the starting point of the fit.
    Start(TrialFailed),
    /// The model cannot be filtered, as innovations require.
    NotFiltered(Box<FilterError>),
    /// It was stopped before it had a result.
    Stopped,
}

impl EstimateError {
    /// Whether it was stopped before it had a result.
    pub fn is_stopped(&self) -> bool {
        match self {
            Self::Stopped => true,
            Self::Start(TrialFailed { reason, .. }) => {
                matches!(reason, TrialFailure::Simulation(IntegrateError::Stopped { .. }))
            }
            _ => false,
        }
    }
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
            Self::Deviation { output, t, sigma } => {
                let sigma = short(*sigma, 6);
                write!(
                    f,
                    "the standard deviation of output `{output}` is {sigma} in SI units at t = {t} s: it must be a \
                     positive number"
                )
            }
            Self::Logarithm { output, t, value } => {
                let value = short(*value, 6);
                write!(
                    f,
                    "output `{output}` is {value} in SI units at t = {t} s, and has no logarithm, which its log-normal \
                     noise compares"
                )
            }
            Self::NoSensitivity { equation, t } => {
                write!(f, "the derivatives of `{equation}` are not defined at t = {t} s")
            }
        }
    }
}

impl fmt::Display for WrongReading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotPositive(value) => write!(
                f,
                "a reading with log-normal noise is above zero, and this is {} in SI units",
                short(*value, 6)
            ),
            Self::Deviation(sigma) => write!(
                f,
                "the standard deviation of this reading is {} in SI units and must be a positive number",
                short(*sigma, 6)
            ),
        }
    }
}

impl fmt::Display for EstimateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length(wrong) => wrong.fmt(f),
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
                "the noise of output `{output}` is {} in SI units and must be a positive \
                 number",
                short(*sigma, 6)
            ),
            Self::LossOfDensity { output } => write!(
                f,
                "the loss of output `{output}` is that of its noise: leave out the other one, or write \
                 `noise student(4, …)`, which is robust against outliers"
            ),
            Self::Reading { output, recording, t, wrong } => {
                write!(f, "recording {}: output `{output}` at t = {t} s: {wrong}", recording + 1)
            }
            Self::NotPositive { parameter, value } => write!(
                f,
                "the logarithm of parameter `{parameter}` is to be estimated, and its value \
                 {} has none",
                short(*value, 6)
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
