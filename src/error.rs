//! Errors of the public interface: unknown names, wrong lengths, runs that end early.

use std::fmt;

use dgd_identify::EstimateError;
use dgd_runtime::linearize::{LinearizeError, SteadyStateError};
use dgd_runtime::{InputError, IntegrateError, UnknownMethod};

use crate::Solution;

/// The reason why there is no result.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Error {
    /// The model has nothing of this kind under this name.
    NoSuchName {
        /// The kind: `"parameter"`, `"input"`, `"state or output"` …
        kind: &'static str,
        /// The requested name.
        name: String,
        /// All existing names.
        names: Vec<String>,
    },
    /// A run has no derivatives with respect to this name.
    NoSensitivity {
        /// The requested name.
        to: String,
        /// Names of the parameters and initial values with derivatives.
        names: Vec<String>,
    },
    /// An input has no samples.
    MissingInput {
        /// The input.
        name: String,
    },
    /// Two lengths differ that must be equal.
    Length {
        /// Name of the list.
        of: String,
        /// Its length.
        found: usize,
        /// The required length.
        expected: usize,
    },
    /// There is no method with this name.
    UnknownMethod(UnknownMethod),
    /// Samples of inputs do not define a function of time.
    Inputs(InputError),
    /// A run ended early.
    Run {
        /// The reason.
        error: IntegrateError,
        /// The solution up to there.
        reached: Box<Solution>,
    },
    /// The fit failed.
    Fit(EstimateError),
    /// There is no steady state, or it was not found.
    SteadyState(SteadyStateError),
    /// There is no linear model.
    Linearize(LinearizeError),
}

impl Error {
    pub(crate) fn no_such_name(
        kind: &'static str,
        name: &str,
        names: impl IntoIterator<Item = impl AsRef<str>>,
    ) -> Self {
        let names = names.into_iter().map(|name| name.as_ref().to_owned()).collect();
        Self::NoSuchName { kind, name: name.to_owned(), names }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSuchName { kind, name, names } if names.is_empty() => {
                write!(f, "the model has no {kind} `{name}`: it has none at all")
            }
            Self::NoSuchName { kind, name, names } => {
                write!(f, "the model has no {kind} `{name}`; it has `{}`", names.join("`, `"))
            }
            Self::NoSensitivity { to, names } if names.is_empty() => {
                write!(
                    f,
                    "the run has no sensitivity to `{to}`: `dgd::sensitivities` computes them"
                )
            }
            Self::NoSensitivity { to, names } => {
                write!(
                    f,
                    "the run has no sensitivity to `{to}`; it has those to `{}`",
                    names.join("`, `")
                )
            }
            Self::MissingInput { name } => write!(f, "the input `{name}` has no samples"),
            Self::Length { of, found, expected } => {
                write!(f, "{of}: {found} numbers where {expected} are expected")
            }
            Self::UnknownMethod(error) => error.fmt(f),
            Self::Inputs(error) => error.fmt(f),
            Self::Run { error, .. } => error.fmt(f),
            Self::Fit(error) => error.fmt(f),
            Self::SteadyState(error) => error.fmt(f),
            Self::Linearize(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::UnknownMethod(error) => Some(error),
            Self::Inputs(error) => Some(error),
            Self::Run { error, .. } => Some(error),
            Self::Fit(error) => Some(error),
            Self::SteadyState(error) => Some(error),
            Self::Linearize(error) => Some(error),
            Self::NoSuchName { .. }
            | Self::NoSensitivity { .. }
            | Self::MissingInput { .. }
            | Self::Length { .. } => None,
        }
    }
}

impl From<InputError> for Error {
    fn from(error: InputError) -> Self {
        Self::Inputs(error)
    }
}

impl From<UnknownMethod> for Error {
    fn from(error: UnknownMethod) -> Self {
        Self::UnknownMethod(error)
    }
}
