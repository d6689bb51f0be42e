//! Why a simulation stopped.

use std::fmt;

use dgd_signature::FULL_BUILD;
use dgd_signature::number::short;

use crate::algebraic::domain::DomainEnd;
use crate::algebraic::readings::{ReadValue, WithReadings};
use crate::codegen::taylor::NoTaylorSeries;
use crate::integrate::fixed_step::PerSampleError;
use crate::signal::InputError;
use crate::solution::Solution;

/// Error of a simulation that stopped early.
#[derive(Clone, PartialEq)]
pub struct Failure {
    /// Why.
    pub error: IntegrateError,
    /// The solution at the requested times that were reached.
    pub partial: Box<Solution>,
}

/// Shows only the last time reached: the whole solution would flood the message of an `unwrap`.
impl fmt::Debug for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Failure")
            .field("error", &self.error)
            .field("reached", &self.partial.times.last())
            .finish_non_exhaustive()
    }
}

/// Why an integration stopped.
#[derive(Debug, Clone, PartialEq)]
pub enum IntegrateError {
    /// The options or the requested times are invalid.
    BadRequest(BadRequest),
    /// The inputs do not cover the requested times.
    Inputs(InputError),
    /// There are no consistent values of the algebraic unknowns, at the start or after a jump of
    /// the inputs.
    Initial(InitialError),
    /// The local error stays above the tolerance however small the step.
    StepSizeTooSmall {
        /// Time reached, s.
        t: f64,
        /// The step size at which the run gave up, s.
        h: f64,
        /// The unknown with the largest error.
        unknown: String,
        /// The parameter, where the error is that of the unknown's sensitivity to it.
        parameter: Option<String>,
        /// Its local error, in units of the tolerance.
        error: f64,
        /// The switch that the step passes, if it does.
        switch: Option<String>,
    },
    /// An equation or its derivative is not finite, however small the step.
    NotFinite {
        /// Time of the evaluation, s.
        t: f64,
        /// The equation.
        equation: String,
        /// The unknown that it determines.
        unknown: String,
        /// The evaluation that is not finite.
        what: Evaluation,
        /// Its operands, with the values at the end of the last accepted step.
        values: Vec<ReadValue>,
        /// Where its values end nearby.
        end: Option<Box<DomainEnd>>,
    },
    /// Modes change without end at one time, or ever faster towards one (Zeno behaviour).
    EndlessEvents {
        /// The time, s.
        t: f64,
        /// The automaton that changed last.
        automaton: String,
        /// Number of transitions at this time or leading up to it.
        transitions: usize,
    },
    /// A condition that stays at its threshold for a whole interval, or changes infinitely often.
    UnresolvedCondition {
        /// Where the interval begins, s.
        t: f64,
        /// The automaton whose condition it is.
        automaton: String,
    },
    /// Algebraic equations have no solution just beyond a point at which one of them changes its piece.
    NoSolutionBeyond {
        /// The time, s.
        t: f64,
        /// The switch that is passed.
        automaton: String,
        /// The error beyond.
        error: Box<InitialError>,
    },
    /// A variable delay becomes negative: the model would read the future.
    DelayBelowZero {
        /// The time, s.
        t: f64,
        /// The delay, as the model writes it.
        delay: String,
        /// Its value, s.
        value: f64,
    },
    /// The argument of a table leaves its range, and the table is declared to refuse that.
    TableLeft {
        /// The time, s.
        t: f64,
        /// Which argument has left which table.
        what: String,
    },
    /// The caller asked it to stop ([`RunMonitor::stop`](crate::RunMonitor::stop)).
    Stopped {
        /// Time reached, s.
        t: f64,
    },
    /// The limit on the number of steps was reached.
    TooManySteps {
        /// Time reached, s.
        t: f64,
        /// Number of steps tried.
        steps: usize,
    },
    /// The limit on the number of steps was reached, because the model is stiff and the method explicit.
    TooStiff {
        /// Time reached, s.
        t: f64,
        /// Number of steps tried.
        steps: usize,
        /// The method.
        method: &'static str,
    },
    /// The method cannot solve algebraic unknowns, and the model has some.
    UnsuitedMethod {
        /// Time reached, s.
        t: f64,
        /// The method.
        method: &'static str,
        /// The equation that determines one.
        equation: String,
        /// Whether it keeps a solution that slides along a threshold there.
        slides: bool,
    },
    /// The method needs Taylor series, and the model has none.
    NoTaylorSeries {
        /// The method.
        method: &'static str,
        /// Why.
        why: NoTaylorSeries,
    },
    /// The method uses Taylor series, which rely on an input being held between samples as the model declares; the
    /// given input is not held.
    HeldInputMoves {
        /// The method.
        method: &'static str,
        /// The input.
        input: String,
    },
    /// Equal steps per sample are not possible, or not accurate enough.
    PerSample(PerSampleError),
    /// Newton's method does not find the values at the end of a step, however small that is.
    NewtonDiverged {
        /// Time reached, s.
        t: f64,
        /// The step size at which the run gave up, s.
        h: f64,
        /// The unknown with the largest correction relative to its size.
        unknown: String,
    },
    /// The matrix of the stages is singular, however small the step.
    SingularIteration {
        /// Time reached, s.
        t: f64,
        /// The step size at which the run gave up, s.
        h: f64,
        /// The equation whose row vanishes or depends linearly on others.
        equation: String,
    },
}

/// The evaluated function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evaluation {
    /// The equation itself.
    Equation,
    /// A derivative of the equation.
    Derivative,
}

/// Invalid options or requested times.
#[derive(Debug, Clone, PartialEq)]
pub enum BadRequest {
    /// The number of parameter values differs from the number of parameters.
    ParameterCount {
        /// The model.
        model: String,
        /// Number of its parameters.
        expected: usize,
        /// Number of values given.
        given: usize,
    },
    /// The number of inputs differs from that of the model.
    InputCount {
        /// The model.
        model: String,
        /// Number of its inputs.
        expected: usize,
        /// Number of inputs given.
        given: usize,
    },
    /// A start value is given for an unknown that does not exist.
    StartOfNoUnknown {
        /// The model.
        model: String,
        /// Number of its unknowns.
        unknowns: usize,
        /// The position of the start value, from 0.
        position: usize,
    },
    /// A chosen unknown does not exist.
    ChosenNoUnknown {
        /// The model.
        model: String,
        /// Number of its unknowns.
        unknowns: usize,
        /// The chosen position, from 0.
        position: usize,
    },
    /// The model needs a sparse factorisation, which this build does not have.
    NeedsSparse {
        /// The model.
        model: String,
        /// Number of its unknowns.
        unknowns: usize,
        /// Non-zeros of its Jacobian.
        non_zeros: usize,
    },
    /// A tolerance is not a positive number.
    Tolerance {
        /// `rtol` or `atol`.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// The initial step is not a positive number.
    InitialStep {
        /// Its value, s.
        value: f64,
    },
    /// A requested time is not a finite number.
    TimeNotFinite {
        /// Its position, from 0.
        index: usize,
    },
    /// A requested time is before its predecessor.
    TimeBackwards {
        /// The time, s.
        at: f64,
        /// Its predecessor, s.
        previous: f64,
    },
    /// The delay of an unknown is negative or not finite.
    UnknownDelay {
        /// The unknown.
        unknown: String,
        /// Its delay, as the model writes it.
        delay: String,
        /// Value of the delay, s.
        value: f64,
    },
    /// The derivative with respect to a delay of zero is requested, and no equation gives the slope of the delayed
    /// unknown.
    DerivativeToNoDelay {
        /// The unknown.
        unknown: String,
        /// Its delay, as the model writes it.
        delay: String,
    },
    /// The delay of an output is not a finite number.
    Delay {
        /// The delay, as the model writes it.
        delay: String,
        /// Its value, s.
        value: f64,
    },
}

/// Why there are no consistent start values.
#[derive(Debug, Clone, PartialEq)]
pub enum InitialError {
    /// A start value is not a finite number.
    StartNotFinite {
        /// The unknown.
        unknown: String,
        /// The time, s.
        t: f64,
    },
    /// The model starts at rest, and no rest is found.
    NoRest {
        /// The time, s.
        t: f64,
        /// Why.
        reason: String,
    },
    /// The model has start equations, and no start values that satisfy them are found.
    NoStart {
        /// The time, s.
        t: f64,
        /// Why.
        reason: String,
    },
    /// An equation or its derivative is not finite at the start values.
    NotFinite {
        /// The equation.
        equation: String,
        /// The time, s.
        t: f64,
        /// Its operands; only the culprits, if they are known.
        at: Vec<ReadValue>,
    },
    /// The algebraic equations do not determine the algebraic unknowns.
    Singular {
        /// An equation that vanishes or depends linearly on others.
        equation: String,
        /// The time, s.
        t: f64,
        /// The equation's residual, in its own SI unit.
        residual: f64,
        /// Equations that must be solved together with it.
        together: Vec<String>,
        /// Its operands.
        at: Vec<ReadValue>,
    },
    /// Newton's method does not converge.
    NotConverged {
        /// The time, s.
        t: f64,
        /// Iterations done.
        iterations: usize,
        /// The equation with the largest residual.
        equation: String,
        /// That residual, in the equation's SI unit.
        residual: f64,
        /// The unknown with the largest last correction relative to its size.
        unknown: String,
        /// Its last correction, SI.
        correction: f64,
        /// The operands of the equation.
        at: Vec<ReadValue>,
    },
}

/// A count and its noun.
struct CountedNoun(usize, &'static str);

impl fmt::Display for CountedNoun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(count, thing) = self;
        write!(f, "{count} {thing}{}", if *count == 1 { "" } else { "s" })
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.error.fmt(f)
    }
}

impl std::error::Error for Failure {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        Some(&self.error)
    }
}

impl fmt::Display for IntegrateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BadRequest(error) => error.fmt(f),
            Self::Inputs(error) => error.fmt(f),
            Self::PerSample(error) => error.fmt(f),
            Self::Initial(error) => error.fmt(f),
            Self::StepSizeTooSmall { t, h, unknown, parameter, error, switch } => {
                let what = match parameter {
                    None => format!("`{unknown}`"),
                    Some(parameter) => format!("the sensitivity of `{unknown}` to `{parameter}`"),
                };
                let (h, error) = (short(*h, 2), short(*error, 3));
                write!(
                    f,
                    "the step size fell to {h} s at t = {t} s, where the local error of {what} is still {error} times the \
                     tolerance; "
                )?;
                match switch {
                    Some(switch) => write!(
                        f,
                        "the step passes `{switch}`, and no shorter one leads beyond it: check what the equations of \
                         `{unknown}` are on its other side"
                    ),
                    None => write!(
                        f,
                        "the solution ends there, if `{unknown}` or its rate grows beyond all bounds; otherwise the \
                         `nominal` of `{unknown}` is far smaller than what matters of it"
                    ),
                }
            }
            Self::NotFinite { t, equation, unknown, what, values, end } => {
                match what {
                    Evaluation::Equation => write!(f, "equation `{equation}`")?,
                    Evaluation::Derivative => write!(f, "a derivative of equation `{equation}`")?,
                }
                write!(f, " is not finite at t = {t} s; it determines `{unknown}`")?;
                write!(f, "{}", WithReadings(values))?;
                end.iter().try_for_each(|end| write!(f, "; {end}"))
            }
            Self::EndlessEvents { t, automaton, transitions } => write!(
                f,
                "`{automaton}` acts again and again without end at t = {t} s, {transitions} times so far: a model that \
                 comes to rest like this, as a bouncing ball does, needs a mode in which it is at rest"
            ),
            Self::UnresolvedCondition { t, automaton } => write!(
                f,
                "`{automaton}` may change infinitely often right after t = {t} s: rounding decides which side of the \
                 threshold its condition is on, or it oscillates ever faster; a margin between the two sides keeps them \
                 apart"
            ),
            Self::NoSolutionBeyond { t, automaton, error } => write!(
                f,
                "the equations have no solution where `{automaton}` is passed at t = {t} s: {error}"
            ),
            Self::DelayBelowZero { t, delay, value } => write!(
                f,
                "the delay `{delay}` falls below zero, to {} s at t = {t} s; what will be is \
                 not known before",
                short(*value, 2)
            ),
            Self::TableLeft { t, what } => write!(f, "{what}, at t = {t} s"),
            Self::Stopped { t } => write!(f, "it was stopped at t = {t} s"),
            Self::TooManySteps { t, steps } => {
                write!(f, "{steps} steps were not enough, the solution stopped at t = {t} s")
            }
            Self::TooStiff { t, steps, method } => write!(
                f,
                "{steps} steps of `{method}` were not enough, the solution stopped at t = {t} s: the \
                 model is stiff, and stability keeps the steps of an explicit method short; take an \
                 implicit one, such as `rodas5p`"
            ),
            Self::UnsuitedMethod { method, equation, slides: true, .. } => write!(
                f,
                "`{method}` solves no equations, as a solution that may slide along `{equation}` \
                 needs; take an implicit method, such as `rodas5p`"
            ),
            Self::UnsuitedMethod { t, method, equation, .. } => write!(
                f,
                "`{method}` cannot solve `{equation}`, which has no derivative at t = {t} s; take an \
                 implicit method, such as `rodas5p`"
            ),
            Self::NoTaylorSeries { method, why } => write!(
                f,
                "`{method}` goes along Taylor series, of which the model has none: {why}; take \
                 another method, such as `rodas5p`"
            ),
            Self::HeldInputMoves { method, input } => write!(
                f,
                "`{method}` holds the input `{input}` between samples, as the model declares it, and \
                 it is given with lines between them; declare it `linear`, or take another method, \
                 such as `rodas5p`"
            ),
            Self::NewtonDiverged { t, h, unknown } => write!(
                f,
                "Newton's method does not converge at t = {t} s, with steps down to {} s; \
                 `{unknown}` moves most",
                short(*h, 2)
            ),
            Self::SingularIteration { t, h, equation } => write!(
                f,
                "equation `{equation}` leaves the unknowns undetermined at t = {t} s, with steps \
                 down to {} s",
                short(*h, 2)
            ),
        }
    }
}

impl std::error::Error for IntegrateError {}

impl fmt::Display for BadRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ParameterCount { model, expected, given } => {
                let has = CountedNoun(*expected, "parameter");
                write!(f, "`{model}` has {has}, and the problem gives {given}")
            }
            Self::InputCount { model, expected, given } => {
                let has = CountedNoun(*expected, "input");
                write!(f, "`{model}` has {has}, and the problem gives {given}")
            }
            Self::StartOfNoUnknown { model, unknowns, position } => write!(
                f,
                "`{model}` has {}, and a start value is given for number {}",
                CountedNoun(*unknowns, "unknown"),
                position + 1
            ),
            Self::ChosenNoUnknown { model, unknowns, position } => write!(
                f,
                "`{model}` has {}, and number {} is to be kept",
                CountedNoun(*unknowns, "unknown"),
                position + 1
            ),
            Self::NeedsSparse { model, unknowns, non_zeros } => write!(
                f,
                "the {} of `{model}` need a sparse factorisation ({} in no band), which this build does not have; \
                 the feature `sparse` adds it, and `{FULL_BUILD}` the whole program",
                CountedNoun(*unknowns, "unknown"),
                CountedNoun(*non_zeros, "derivative"),
            ),
            Self::Tolerance { name, value } => {
                write!(f, "`{name}` is {value} and must be a positive number")
            }
            Self::InitialStep { value } => {
                write!(f, "the initial step is {value} s and must be a positive number")
            }
            Self::TimeNotFinite { index } => {
                write!(f, "asked time number {} is not a finite number", index + 1)
            }
            Self::TimeBackwards { at, previous } => {
                write!(f, "asked times go back, from t = {previous} s to t = {at} s")
            }
            Self::UnknownDelay { unknown, delay, value } => write!(
                f,
                "`delay({unknown}, {delay})` would be {value} s late; the delay of an unknown in an \
                 equation is a finite time and not below zero"
            ),
            Self::DerivativeToNoDelay { unknown, delay } => write!(
                f,
                "`delay({unknown}, {delay})` is 0 s late, where its derivative to the delay is not \
                 known: `{unknown}` is not differential at all times; begin above zero"
            ),
            Self::Delay { delay, value } => {
                write!(f, "an output would be read `{delay}` = {value} s late")
            }
        }
    }
}

impl fmt::Display for InitialError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoRest { reason, .. } => {
                write!(
                    f,
                    "the model cannot start at rest: {reason}; where only some states rest, a \
                     `start equation` for each of them takes the place of `start steady`"
                )
            }
            Self::NoStart { t, reason } => {
                write!(f, "no start values at t = {t} s satisfy the start equations: {reason}")
            }
            Self::StartNotFinite { unknown, t } => {
                write!(f, "the start value of `{unknown}` at t = {t} s is not finite")
            }
            Self::NotFinite { equation, t, at } => write!(
                f,
                "equation `{equation}` or its derivative is not finite at the start values, \
                 t = {t} s{}",
                WithReadings(at)
            ),
            Self::Singular { equation, t, residual, together, at } => {
                write!(
                    f,
                    "no consistent values at t = {t} s: equation `{equation}` (residual {})",
                    short(*residual, 3)
                )?;
                for (k, other) in together.iter().enumerate() {
                    write!(f, "{} `{other}`", if k == 0 { " together with" } else { "," })?;
                }
                let verb = if together.is_empty() { "leaves" } else { "leave" };
                write!(f, " {verb} the algebraic unknowns undetermined{}", WithReadings(at))
            }
            Self::NotConverged { t, iterations, equation, residual, unknown, correction, at } => {
                write!(
                    f,
                    "no consistent values at t = {t} s after {iterations} iterations: equation \
                     `{equation}` has residual {}, and `{unknown}` still moves by {}{}",
                    short(*residual, 3),
                    short(*correction, 3),
                    WithReadings(at)
                )
            }
        }
    }
}

impl std::error::Error for InitialError {}
