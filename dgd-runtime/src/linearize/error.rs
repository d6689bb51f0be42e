//! Errors of linearisation and of the search for a steady state.

use std::fmt;

use dgd_signature::number::short;

use crate::error::IntegrateError;

/// Why a model cannot be linearised at a point.
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
        /// The equation that depends most strongly on others.
        equation: String,
        /// An unknown that it leaves undetermined.
        unknown: String,
    },
    /// The equations read the slope of a delayed unknown.
    LateSlope {
        /// The unknown.
        unknown: String,
    },
    /// The dense matrices would be too large.
    TooLarge {
        /// Number of unknowns.
        n: usize,
        /// Maximum number of unknowns.
        most: usize,
    },
    /// The eigenvalue iteration for the poles does not converge.
    NoEigenvalues,
}

/// Why there is no steady state.
#[derive(Debug, Clone, PartialEq)]
pub enum SteadyStateError {
    /// The model cannot be started.
    Start(IntegrateError),
    /// The equations at rest do not determine an unknown, or contradict each other.
    Undetermined {
        /// The time, s.
        t: f64,
        /// The equation that depends most strongly on others.
        equation: String,
        /// Its residual where the search ended, in its own SI unit; zero if there are many steady states.
        residual: f64,
        /// The unknown that is not determined.
        unknown: String,
    },
    /// A combination of states changes at a rate that does not depend on the states.
    Drifts {
        /// The time, s.
        t: f64,
        /// The equation of the unknown.
        equation: String,
        /// The unknown that changes, or that names the changing combination.
        unknown: String,
        /// The other unknowns of the combination.
        with: Vec<String>,
        /// How fast it changes, in the unknown's unit per s.
        rate: f64,
        /// The unknown's unit.
        unit: String,
    },
    /// Newton's method does not converge, and a run with the inputs held does not come to rest.
    NotAtRest {
        /// The time, s.
        t: f64,
        /// How long the run was, s.
        ran: f64,
        /// The equation furthest from rest.
        equation: String,
        /// The unknown that moves fastest relative to its size.
        unknown: String,
        /// How fast it still moves, in its unit per s.
        rate: f64,
        /// The unknown's unit.
        unit: String,
    },
}

/// Why a recording cannot be simulated with a linear model.
#[derive(Debug, Clone, PartialEq)]
pub enum NotLinearised {
    /// There is no steady state to linearise at.
    NoSteadyState(SteadyStateError),
    /// The steady state is unstable.
    Unstable {
        /// The time, s.
        t: f64,
        /// Real part of the pole furthest to the right, 1/s.
        re: f64,
    },
    /// The run does not reach the point, or does not start.
    Run(IntegrateError),
    /// There is no linear model at the point.
    NoModel(LinearizeError),
    /// The model has a delayed unknown.
    LateUnknown {
        /// The unknown.
        unknown: String,
    },
    /// The equations or outputs depend on time.
    ReadsTime {
        /// The equation or the output.
        equation: String,
    },
    /// The states at the point are not those at the start.
    OtherStates {
        /// One of them.
        unknown: String,
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
                 {} left of it, and leaves `{unknown}` open",
                short(*residual, 3)
            ),
            Self::Drifts { t, equation, unknown, with, rate, unit } => {
                write!(
                    f,
                    "no steady state exists at t = {t} s: whatever the states are, `{unknown}` "
                )?;
                for (k, other) in with.iter().enumerate() {
                    f.write_str(if k == 0 { "together with " } else { ", " })?;
                    write!(f, "`{other}`")?;
                }
                let space = if with.is_empty() { "" } else { " " };
                write!(
                    f,
                    "{space}changes by {} {unit}/s with these inputs, by equation `{equation}`",
                    short(*rate, 4)
                )
            }
            Self::NotAtRest { t, ran, equation, unknown, rate, unit } => write!(
                f,
                "no steady state was found at t = {t} s: with the inputs held, equation `{equation}` \
                 still moves `{unknown}` by {} {unit}/s after {ran} s",
                short(*rate, 3)
            ),
        }
    }
}

impl std::error::Error for SteadyStateError {}

impl fmt::Display for NotLinearised {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSteadyState(error) => error.fmt(f),
            Self::Unstable { t, re } => write!(
                f,
                "the steady state at t = {t} s is unstable, with a pole at {} 1/s: what is \
                 measured does not stay close to it",
                short(*re, 4)
            ),
            Self::Run(error) => error.fmt(f),
            Self::NoModel(error) => error.fmt(f),
            Self::LateUnknown { unknown } => write!(
                f,
                "equations read `{unknown}` late, which a linear model of the states alone does not know"
            ),
            Self::ReadsTime { equation } => write!(
                f,
                "`{equation}` reads the time, which stands still in a linear model: give it as an input"
            ),
            Self::OtherStates { unknown } => write!(
                f,
                "`{unknown}` has a derivative either at the start or at the operating point, and not at \
                 both: the linear model is that of one mode"
            ),
        }
    }
}

impl std::error::Error for NotLinearised {}
