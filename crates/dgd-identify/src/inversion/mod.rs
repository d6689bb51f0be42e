//! Reconstructs the missing term of an equation from measured values.
//!
//! An equation i of the compiled model, with an unknown input d in its right-hand side, is
//!
//! ```text
//!   m ẏ_i = g(t, y, u, p) + c(t, y, u, p) d          m is 1 for a differential equation, 0 for an algebraic one
//! ```
//!
//! Readings give y at each sample (`signals`), and so d, except for ẏ_i, the slope of a noisy signal. So d is estimated
//! as a weighted mean over a window, without differentiation (`window`).
//!
//! Haukanes (2015, eq. 3.10) does this for the level of a riser.

mod bandwidth;
mod samples;
mod signals;
mod window;

use dgd_runtime::model::Model;

use crate::recording::Recording;
use crate::regression::RegressionError;

pub use signals::{InvertedSignal, SignalSource};
pub use window::SignalTrace;

/// A model with an unknown input, and a recording.
#[derive(Clone, Copy)]
pub struct InversionProblem<'a> {
    /// The model; one of its inputs is the missing term.
    pub system: &'a dyn Model,
    /// All parameters, SI.
    pub p: &'a [f64],
    /// The recording; the unknown input is zero in it.
    pub recording: &'a Recording,
    /// Position of the unknown input.
    pub input: usize,
    /// For each output the standard deviation of its sensor's noise, SI; `None` if it is not used.
    pub noise: &'a [Option<f64>],
    /// Half the width of the window, s; `None` for the maximum likelihood width.
    pub bandwidth: Option<f64>,
}

/// The missing term of an equation.
#[derive(Debug, Clone, PartialEq)]
pub struct InvertedTerm {
    /// Times of the samples, s.
    pub times: Vec<f64>,
    /// d, SI: its mean over the window around each sample; NaN if unknown.
    pub missing: SignalTrace,
    /// ∫ d dt from the first sample on, not smoothed; `None` for an algebraic equation, which has no integral.
    pub integral: Option<SignalTrace>,
    /// Half the width of the window, s.
    pub bandwidth: f64,
    /// Whether it was estimated from the readings.
    pub is_chosen: bool,
    /// Time within the recording without an integral, s: readings are missing there, or unknowns jump.
    pub left_out: f64,
    /// Position of the compiled equation.
    pub equation: usize,
    /// The unknowns that it reads, with their sources.
    pub signals: Vec<InvertedSignal>,
}

/// The reason why an equation cannot be inverted.
#[derive(Debug)]
pub enum InversionError {
    /// No compiled equation reads the unknown input.
    Unread,
    /// Unknowns of the equation do not follow from measured values.
    NotMeasured {
        /// Their names.
        unknowns: Vec<String>,
    },
    /// The equation reads a delayed unknown.
    Late {
        /// The unknown.
        unknown: String,
    },
    /// No sample has all readings.
    NoSamples,
    /// The window has too few samples everywhere.
    Narrow {
        /// Half its width, s.
        bandwidth: f64,
        /// The usual time between samples, s.
        spacing: f64,
    },
    /// The unknowns cannot be determined.
    Known(RegressionError),
}

impl std::fmt::Display for InversionError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unread => {
                f.write_str("what is missing there has no influence on the compiled model")
            }
            Self::NotMeasured { unknowns } => {
                let names: Vec<String> = unknowns.iter().map(|name| format!("`{name}`")).collect();
                write!(
                    f,
                    "it reads {}, which {} not measured and {} not follow from what is",
                    names.join(", "),
                    if names.len() == 1 { "is" } else { "are" },
                    if names.len() == 1 { "does" } else { "do" }
                )
            }
            Self::Late { unknown } => {
                write!(f, "it reads `{unknown}` late, which an inversion does not follow")
            }
            Self::NoSamples => f.write_str("no row of the data has everything that it reads"),
            Self::Narrow { bandwidth, spacing } => write!(
                f,
                "a window of ± {bandwidth} s has too few samples, which are usually {spacing} s apart"
            ),
            Self::Known(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for InversionError {}

/// Reconstructs the missing term of an equation.
///
/// # Errors
///
/// [`InversionError`].
pub fn invert(problem: &InversionProblem<'_>) -> Result<InvertedTerm, InversionError> {
    let chosen = signals::choose(problem)?;
    let samples = samples::EquationSamples::new(problem, &chosen)?;
    let usual = samples.spacing();
    let bandwidth = match problem.bandwidth {
        Some(bandwidth) => bandwidth,
        None => bandwidth::most_likely(&samples),
    };
    let missing = window::means(&samples, bandwidth);
    if !missing.value.iter().any(|value| value.is_finite()) {
        return Err(InversionError::Narrow { bandwidth, spacing: usual });
    }
    let (integral, left_out) = window::integral(&samples);
    Ok(InvertedTerm {
        times: samples.times.clone(),
        missing,
        integral: samples.sums_up().then_some(integral),
        bandwidth,
        is_chosen: problem.bandwidth.is_none(),
        left_out,
        equation: chosen.equation,
        signals: chosen.signals,
    })
}
