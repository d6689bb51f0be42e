//! Errors of a regression.

use std::fmt;

use dgd_runtime::signature::number::short;

use dgd_runtime::InputError;

use crate::error::EstimateError;

/// The reason why a regression failed.
#[derive(Debug, Clone, PartialEq)]
pub enum RegressionError {
    /// No parameter is free.
    NothingFree,
    /// No used output has samples.
    NothingMeasured,
    /// A prior that cannot be written as a row.
    Prior {
        /// Its parameters, each in quotes.
        of: String,
        /// Its distribution.
        law: &'static str,
    },
    /// A parameter that no equation and no used output with measurements reads.
    NotRead {
        /// The parameter.
        parameter: String,
    },
    /// The equations and outputs with a parameter read an unknown that the measured outputs do not determine.
    NotReconstructed {
        /// The parameter.
        parameter: String,
        /// The equation or output.
        row: String,
        /// The unknown.
        unknown: String,
        /// Measured outputs that read the unknown, but also these parameters, which are estimated.
        taken: Vec<(String, String)>,
    },
    /// Fewer rows than parameters.
    TooFewRows {
        /// Rows.
        rows: usize,
        /// Free parameters.
        free: usize,
    },
    /// Parameters that do not enter linearly, each with such an equation or output.
    NotLinear {
        /// The parameter, and the equation or output.
        parameters: Vec<(String, String)>,
    },
    /// A model with modes reads a delayed unknown: modes are followed from sample to sample, without a history.
    ModesAndPast {
        /// The `modes` block, event or state.
        name: String,
        /// The unknown.
        unknown: String,
    },
    /// The modes at the samples keep changing with the estimates.
    ModesDoNotSettle {
        /// Number of samples with a change in the last round.
        samples: usize,
    },
    /// A delay contains a free parameter.
    FreeDelay {
        /// The parameter.
        parameter: String,
        /// The delay, in the notation of the model.
        delay: String,
    },
    /// An equation or output has no finite value.
    NotFinite {
        /// The equation or output.
        row: String,
        /// Recording, from 0.
        recording: usize,
        /// Time of the sample, s.
        t: f64,
    },
    /// The inputs are not functions of time.
    Inputs(InputError),
    /// The search has no valid start.
    Variables(EstimateError),
    /// The time constants of the filter are not positive.
    Filter,
    /// The initial variance of the estimates is not positive.
    StartVariance,
    /// The forgetting rate is negative, or the limit of the variance is not positive.
    Forgetting,
    /// A recursive regression needs samples over time.
    NotOverTime,
    /// A recursive regression needs samples at which all rows are known.
    NeverTogether {
        /// The equations and outputs.
        rows: Vec<String>,
    },
    /// No sample is steady.
    NothingSteady {
        /// The unknowns that should be.
        unknowns: Vec<UnsteadyUnknown>,
    },
}

/// An unknown whose rate is limited.
#[derive(Debug, Clone, PartialEq)]
pub struct UnsteadyUnknown {
    /// Its name.
    pub unknown: String,
    /// Its lowest rate, in its unit per second; infinity if no reading determines it.
    pub slowest: f64,
    /// The limit, in its unit per second.
    pub limit: f64,
    /// Its unit.
    pub unit: String,
}

impl fmt::Display for RegressionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NothingFree => write!(f, "nothing is free: there is no parameter to estimate"),
            Self::NothingMeasured => {
                write!(f, "nothing is measured: the recordings have no sample of an output in use")
            }
            Self::Prior { of, law } => write!(
                f,
                "the prior of {of} is `{law}`, and a row of a regression is normal: fits that simulate \
                 take it"
            ),
            Self::NotRead { parameter } => write!(
                f,
                "parameter `{parameter}` is in no equation and in no measured output in use"
            ),
            Self::NotReconstructed { parameter, row, unknown, taken } => {
                write!(
                    f,
                    "`{row}`, which has parameter `{parameter}`, reads `{unknown}`, and no measured \
                     output gives `{unknown}` at each sample"
                )?;
                for (output, parameter) in taken {
                    write!(
                        f,
                        "; `{output}` would if `{parameter}`, which it reads, were not estimated"
                    )?;
                }
                write!(f, "; the estimator `output-error` needs no such output")
            }
            Self::TooFewRows { rows, free } => {
                write!(f, "{rows} rows are too few for {free} free parameters")
            }
            Self::NotLinear { parameters } => {
                for (k, (parameter, row)) in parameters.iter().enumerate() {
                    let gap = if k == 0 { "" } else { ", " };
                    write!(f, "{gap}`{parameter}` does not enter `{row}` linearly")?;
                }
                write!(f, "; the estimator `separable` needs no such thing")
            }
            Self::ModesAndPast { name, unknown } => write!(
                f,
                "modes are followed from sample to sample, and beside `{name}` this model also reads \
                 what `{unknown}` was before; the estimator `output-error` simulates that"
            ),
            Self::ModesDoNotSettle { samples } => write!(
                f,
                "the modes change with the estimates, and the estimates with the modes, in \
                 {samples} samples without an end; the estimator `output-error` has no such rounds"
            ),
            Self::FreeDelay { parameter, delay } => write!(
                f,
                "parameter `{parameter}` is in the delay `{delay}` of an input or output, which no \
                 regression estimates; the estimator `output-error` does"
            ),
            Self::NotFinite { row, recording, t } => {
                write!(f, "`{row}` has no finite value at t = {t} s of recording {}", recording + 1)
            }
            Self::Inputs(error) => error.fmt(f),
            Self::Variables(error) => error.fmt(f),
            Self::Filter => write!(f, "the time constants of the filter must be positive"),
            Self::Forgetting => write!(
                f,
                "the forgetting rate must not be below zero, and the most variance must be positive"
            ),
            Self::StartVariance => {
                write!(f, "the variance that estimates start with must be positive")
            }
            Self::NotOverTime => {
                write!(f, "a recursive estimator follows samples over time, and these have no time")
            }
            Self::NeverTogether { rows } => {
                let rows: Vec<String> = rows.iter().map(|row| format!("`{row}`")).collect();
                write!(
                    f,
                    "a recursive estimator needs samples at which all of {} are known, and there is \
                     none; `least-squares` takes each by itself",
                    rows.join(", ")
                )
            }
            Self::NothingSteady { unknowns } => {
                write!(f, "no sample is steady")?;
                for (k, UnsteadyUnknown { unknown, slowest, limit, unit }) in
                    unknowns.iter().enumerate()
                {
                    let gap = if k == 0 { ": " } else { "; " };
                    if slowest.is_finite() {
                        write!(
                            f,
                            "{gap}`{unknown}` moves by {} {unit} per second at least, and {} are allowed",
                            short(*slowest, 3),
                            short(*limit, 3)
                        )?;
                    } else {
                        write!(f, "{gap}no measured output says how fast `{unknown}` moves")?;
                    }
                }
                Ok(())
            }
        }
    }
}

impl std::error::Error for RegressionError {}
