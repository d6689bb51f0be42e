//! Computations that failed.

use std::fmt;
use std::path::PathBuf;

use dgd_compiler::argument::Argument;
use dgd_compiler::sentence;
use dgd_compiler::sentence::Sentence;
use dgd_discover::DiscoverError;
use dgd_execute::NoNativeCode;
use dgd_identify::filter::FilterError;
use dgd_identify::inversion::InversionError;
use dgd_identify::regression::RegressionError;
use dgd_identify::{EstimateError, TrialFailure};
use dgd_runtime::linearize::{LinearizeError, NotLinearised, SteadyStateError};
use dgd_runtime::{BadRequest, InputError, IntegrateError, MeasuredStartError};

use crate::request::Estimator;

/// The reason why a computation has no result.
#[derive(Debug)]
#[non_exhaustive]
pub enum ComputationError {
    /// The integration stopped before the first row, or could not begin.
    Integration(IntegrateError),
    /// A recording cannot be simulated.
    Recording {
        /// Its name.
        name: String,
        /// The cause.
        reason: TrialFailure,
    },
    /// A fit cannot begin.
    Start {
        /// The recording, by file or number.
        name: String,
        /// The cause.
        reason: TrialFailure,
    },
    /// Sensitivities that cannot be verified.
    Verification {
        /// The parameter or initial value.
        name: String,
        /// Its other value, SI.
        value: f64,
        /// Why the model cannot be simulated with it.
        error: IntegrateError,
    },
    /// Initial values that measurements do not determine.
    MeasuredStart(MeasuredStartError),
    /// Inputs that cannot be used.
    Inputs(InputError),
    /// Options that cannot be used.
    Options(BadRequest),
    /// The model cannot be compiled to native code.
    NativeCode(NoNativeCode),
    /// There is no steady state.
    SteadyState(SteadyStateError),
    /// The model cannot be linearised.
    Linearisation(LinearizeError),
    /// An equation to which no term can be added.
    NotOpened {
        /// Its label.
        label: String,
        /// The cause, as the compiler gives it.
        reason: String,
    },
    /// An equation that cannot be inverted.
    Inversion {
        /// Its label.
        label: String,
        /// The cause.
        error: InversionError,
    },
    /// A row of a regression is not finite.
    RowNotFinite {
        /// The recording.
        path: Option<PathBuf>,
        /// The row.
        row: String,
        /// The time, s.
        t: f64,
    },
    /// A fit failed.
    Estimate(EstimateError),
    /// A regression failed.
    Regression(RegressionError),
    /// A filter failed.
    Filter(FilterError),
    /// A discovery failed.
    Discovery(DiscoverError),
    /// Work that needs more memory than is free.
    Memory {
        /// The work.
        what: String,
        /// The memory it needs, bytes.
        needed: f64,
        /// The memory that is free, bytes.
        available: f64,
        /// The largest need, and how to reduce it.
        reason: Sentence,
    },
}

impl ComputationError {
    /// The error in words.
    pub fn sentence(&self) -> Sentence {
        match self {
            Self::Integration(error) => {
                let mut sentence = Sentence::from(error.to_string());
                if let IntegrateError::PerSample(error) = error
                    && error.is_of_equal_steps()
                {
                    sentence.push("; for adaptive steps give ");
                    sentence.push(Argument::Steps.with("adaptive"));
                }
                sentence
            }
            Self::Recording { name, reason } => format!("{name}: {reason}").into(),
            Self::Start { name, reason } => match reason {
                TrialFailure::NotLinearised(cause) => {
                    let mut sentence =
                        sentence![format!("the model cannot be linearised: {name}: {reason}; ")];
                    if let NotLinearised::NoSteadyState(_) | NotLinearised::Unstable { .. } =
                        **cause
                    {
                        sentence.push(Argument::At.taking("T"));
                        sentence.push(" takes a point of its run, and ");
                    }
                    sentence.push(Argument::Estimator.with(Estimator::OutputError.name()));
                    sentence.push(" simulates the model itself");
                    sentence
                }
                TrialFailure::Simulation(_)
                | TrialFailure::OutputNotFinite { .. }
                | TrialFailure::Deviation { .. }
                | TrialFailure::Logarithm { .. }
                | TrialFailure::NoSensitivity { .. } => {
                    format!("the model cannot be simulated: {name}: {reason}").into()
                }
            },
            Self::Verification { name, value, error } => format!(
                "the sensitivities to `{name}` cannot be verified, for with `{name}` = {value} (SI) the run fails: \
                 {error}"
            )
            .into(),
            Self::MeasuredStart(error) => error.to_string().into(),
            Self::Inputs(error) => error.to_string().into(),
            Self::Options(error) => error.to_string().into(),
            Self::NativeCode(error) => error.to_string().into(),
            Self::SteadyState(error) => {
                let instead = match error {
                    SteadyStateError::Drifts { .. } => {
                        ": change the inputs, or linearise at a time of a run"
                    }
                    _ => "",
                };
                format!("{error}{instead}").into()
            }
            Self::Linearisation(error) => error.to_string().into(),
            Self::NotOpened { label, reason } => {
                format!("`{label}` cannot be inverted: {reason}").into()
            }
            Self::Inversion { label, error } => {
                let mut sentence = sentence![format!("`{label}` cannot be inverted: {error}")];
                match error {
                    InversionError::NotMeasured { .. } => sentence.push(
                        ": give the data a column for each, or another output that reads it alone",
                    ),
                    InversionError::Narrow { .. } => {
                        sentence.push(sentence![": give a wider one with ", Argument::Bandwidth]);
                    }
                    _ => {}
                }
                sentence
            }
            Self::RowNotFinite { path, row, t } => {
                let path = path.as_ref().map(|path| path.display().to_string());
                format!("{}: `{row}` has no finite value at t = {t} s", path.unwrap_or_default())
                    .into()
            }
            Self::Estimate(error) => error.to_string().into(),
            Self::Regression(error) => error.to_string().into(),
            Self::Filter(error) => error.to_string().into(),
            Self::Discovery(error) => error.to_string().into(),
            Self::Memory { what, needed, available, reason } => sentence![
                format!(
                    "{what} needs about {} of memory, and {} is free: ",
                    size(*needed),
                    size(*available)
                ),
                reason
            ],
        }
    }
}

/// A number of bytes in a readable unit.
fn size(bytes: f64) -> String {
    let units = ["kB", "MB", "GB", "TB", "PB", "EB"];
    let mut value = bytes / 1e3;
    let mut unit = 0;
    while value >= 999.5 && unit + 1 < units.len() {
        value /= 1e3;
        unit += 1;
    }
    let digits = usize::from(value < 10.0);
    format!("{value:.digits$} {}", units[unit])
}

/// With the arguments as a library names them.
impl fmt::Display for ComputationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.sentence().fmt(f)
    }
}

impl std::error::Error for ComputationError {}

impl From<IntegrateError> for ComputationError {
    fn from(error: IntegrateError) -> Self {
        ComputationError::Integration(error)
    }
}

impl From<SteadyStateError> for ComputationError {
    fn from(error: SteadyStateError) -> Self {
        ComputationError::SteadyState(error)
    }
}

impl From<LinearizeError> for ComputationError {
    fn from(error: LinearizeError) -> Self {
        ComputationError::Linearisation(error)
    }
}

impl From<InputError> for ComputationError {
    fn from(error: InputError) -> Self {
        ComputationError::Inputs(error)
    }
}
