//! Why there is no linear model.

use std::fmt;

use crate::error::IntegrateError;

/// Why a model is not linearised at a point.
#[derive(Debug, Clone, PartialEq)]
pub enum LinearizeError {
    /// A derivative of an equation or output is not a finite number.
    NotFinite {
        /// The time, s.
        t: f64,
        /// The equation or the output.
        equation: String,
    },
    /// The algebraic equations do not determine the algebraic unknowns.
    Undetermined {
        /// The time, s.
        t: f64,
        /// The equation that depends on others most.
        equation: String,
        /// The unknown that is left open.
        unknown: String,
    },
    /// The equations read the slope that an unknown had.
    LateSlope {
        /// The unknown.
        unknown: String,
    },
    /// The matrices, which are dense, would be too large.
    TooLarge {
        /// Number of unknowns.
        n: usize,
        /// The most there may be.
        most: usize,
    },
    /// The iteration for the poles does not converge.
    NoEigenvalues,
}

/// Why there is no steady state.
#[derive(Debug, Clone, PartialEq)]
pub enum SteadyStateError {
    /// The model cannot be started.
    Start(IntegrateError),
    /// The equations at rest leave an unknown open, or contradict each other.
    Undetermined {
        /// The time, s.
        t: f64,
        /// The equation that depends on others most.
        equation: String,
        /// What is left of it where the search ended, in its own SI unit: nothing where there are many
        /// steady states.
        residual: f64,
        /// The unknown that is left open.
        unknown: String,
    },
    /// Newton's method finds none, and a run with the inputs held does not come to rest.
    NotAtRest {
        /// The time, s.
        t: f64,
        /// How long the run was, s.
        ran: f64,
        /// The equation that is furthest from rest.
        equation: String,
        /// The unknown that moves most for its size.
        unknown: String,
        /// How fast it still moves, in its unit per s.
        rate: f64,
        /// That unit.
        unit: String,
    },
}

impl fmt::Display for LinearizeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite { t, equation } => {
                write!(f, "a derivative of `{equation}` is not finite at t = {t} s")
            }
            Self::Undetermined { t, equation, unknown } => write!(
                f,
                "the algebraic unknowns are not determined at t = {t} s: equation `{equation}` depends \
                 on others there, and leaves `{unknown}` open"
            ),
            Self::LateSlope { unknown } => {
                write!(
                    f,
                    "equations read the slope that `{unknown}` had, which has no linear model"
                )
            }
            Self::TooLarge { n, most } => write!(
                f,
                "a linear model of {n} unknowns would be too large: its matrices are dense, and {most} \
                 unknowns are the most"
            ),
            Self::NoEigenvalues => f.write_str("the iteration for the poles does not converge"),
        }
    }
}

impl std::error::Error for LinearizeError {}

impl fmt::Display for SteadyStateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start(error) => error.fmt(f),
            Self::Undetermined { t, equation, residual: 0.0, unknown } => write!(
                f,
                "the steady state at t = {t} s is one of many: equation `{equation}` depends on the \
                 others, and leaves `{unknown}` open"
            ),
            Self::Undetermined { t, equation, residual, unknown } => write!(
                f,
                "no steady state was found at t = {t} s: equation `{equation}` depends on the others, with \
                 {residual:.2e} left of it, and leaves `{unknown}` open"
            ),
            Self::NotAtRest { t, ran, equation, unknown, rate, unit } => write!(
                f,
                "no steady state was found at t = {t} s: with the inputs held, equation `{equation}` \
                 still moves `{unknown}` by {rate:.2e} {unit}/s after {ran} s"
            ),
        }
    }
}

impl std::error::Error for SteadyStateError {}
