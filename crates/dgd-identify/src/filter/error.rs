//! Errors at the start of a filter and in its course.

use std::fmt;

use dgd_runtime::signature::number::short;

use dgd_runtime::{InputError, IntegrateError};

use crate::error::{EstimateError, TrialFailure, WrongLength};

/// The reason why a filter did not start, or ended.
#[derive(Debug, Clone, PartialEq)]
pub enum FilterError {
    /// Something has a wrong length.
    Length(WrongLength),
    /// The model has no unknown with a derivative and no parameter is free.
    NothingTracked,
    /// The model or an output reads a value that is not supported: with a varying delay, or ahead of time.
    NotFollowed {
        /// The value, in the model's names.
        what: String,
    },
    /// The model was compiled without derivatives with respect to the start value of this unknown.
    NoDirection {
        /// The unknown.
        unknown: String,
    },
    /// An option is out of range.
    Option(OptionOutOfRange),
    /// No used output has noise.
    NothingMeasured,
    /// A free parameter has no logarithm, or there is another error in the free parameters.
    Free(EstimateError),
    /// There are no consistent initial values.
    Start(IntegrateError),
    /// The rows are not valid inputs.
    Inputs(InputError),
    /// An input has no value in the first row.
    FirstInput {
        /// The input.
        input: String,
    },
    /// The model could not be evaluated in too many consecutive rows.
    Stuck {
        /// The time of the last of them, s.
        t: f64,
        /// Number of these rows.
        rows: usize,
        /// The cause in the last row.
        failure: TrialFailure,
    },
}

/// An option outside of its range.
#[derive(Debug, Clone, PartialEq)]
pub struct OptionOutOfRange {
    /// The quantity it belongs to, such as `the noise of output p_r`.
    pub of: String,
    /// Its value, SI.
    pub value: f64,
    /// The expected range.
    pub expected: &'static str,
}

impl fmt::Display for FilterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length(wrong) => wrong.fmt(f),
            Self::NothingTracked => write!(
                f,
                "there is nothing to track: the model has no state and no parameter is free"
            ),
            Self::NotFollowed { what } => write!(
                f,
                "a filter does not follow {what}, which this model needs; the estimator `output-error` of \
                 `dgd fit` simulates that"
            ),
            Self::NoDirection { unknown } => write!(
                f,
                "the model was compiled without derivatives to the start value of `{unknown}`"
            ),
            Self::Option(OptionOutOfRange { of, value, expected }) => {
                write!(f, "{of} is {} in SI units and must be {expected}", short(*value, 6))
            }
            Self::NothingMeasured => {
                write!(f, "no output has a noise: a filter weighs its samples by it")
            }
            Self::Free(error) => error.fmt(f),
            Self::Start(error) => error.fmt(f),
            Self::Inputs(error) => error.fmt(f),
            Self::FirstInput { input } => {
                write!(f, "input `{input}` has no value in the first row")
            }
            Self::Stuck { t, rows, failure } => write!(
                f,
                "the model could not be evaluated in {rows} rows on end, the last at t = {t} s: \
                 {failure}"
            ),
        }
    }
}

impl std::error::Error for FilterError {}
