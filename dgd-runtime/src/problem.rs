//! A problem and its options.

use std::borrow::Cow;
use std::fmt;

use crate::discrete::state_selection::share_sizes;
use crate::error::BadRequest;
use crate::integrate::catalogue::{self, Method};
use crate::integrate::fixed_step::Steps;
use crate::integrate::watched::RunMonitor;
use crate::integrate::{PastSolution, RunMemory};
use crate::linalg::Factorisation;
use crate::observe::delay::delays;
use crate::signal::{Delayed, InputError, Inputs};
use crate::solved::SolvableSystem;
use crate::system::{Direction, EvaluationPoint, System};

/// A model with its parameters, inputs and start values.
#[derive(Debug)]
pub struct Problem<'a, S> {
    /// The model.
    pub system: &'a S,
    /// All parameters, SI.
    pub p: &'a [f64],
    /// Inputs, in the order of the signature.
    pub inputs: &'a Inputs,
    /// Start values that replace the model's, by position of the unknown, SI; for an algebraic unknown it is an initial
    /// guess. A replaced start value does not depend on parameters.
    pub start: &'a [(usize, f64)],
}

impl<S> Clone for Problem<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S> Copy for Problem<'_, S> {}

impl<S: System> Problem<'_, S> {
    /// Checks that the numbers of parameters and inputs match the model, and that unknowns with start values exist.
    ///
    /// # Errors
    ///
    /// [`BadRequest::ParameterCount`], [`BadRequest::InputCount`], [`BadRequest::StartOfNoUnknown`].
    pub fn verify(&self) -> Result<(), BadRequest> {
        let signature = self.system.signature();
        let model = || signature.name.to_string();
        let (expected, given) = (signature.parameters.len(), self.p.len());
        if given != expected {
            return Err(BadRequest::ParameterCount { model: model(), expected, given });
        }
        let (expected, given) = (signature.inputs.len(), self.inputs.len());
        if given != expected {
            return Err(BadRequest::InputCount { model: model(), expected, given });
        }
        let unknowns = signature.unknowns.len();
        match self.start.iter().find(|(position, _)| *position >= unknowns) {
            None => Ok(()),
            Some(&(position, _)) => {
                Err(BadRequest::StartOfNoUnknown { model: model(), unknowns, position })
            }
        }
    }

    /// dy₀/dθ, n × n_s by columns, before anything is solved for: as the model's start values depend on parameters. One
    /// that is itself a direction depends on that as well, and one that [`start`](Self::start) replaces on nothing else.
    pub fn start_sensitivities(&self, at: EvaluationPoint<'_>, s: &mut [f64]) {
        self.system.start_sensitivities(at, s);
        let signature = self.system.signature();
        let n = signature.unknowns.len().max(1);
        for (column, direction) in s.chunks_exact_mut(n).zip(signature.directions.iter()) {
            for &(i, _) in self.start {
                column[i] = 0.0;
            }
            if let Direction::Start(i) = *direction {
                column[i] = 1.0;
            }
        }
    }

    /// Inputs as the model reads them: u of [`EvaluationPoint`](crate::EvaluationPoint), delayed inputs included. The
    /// past of delayed unknowns is zero, so that they are read without delay.
    ///
    /// # Errors
    ///
    /// [`InputError::Delay`] if an input's delay is negative or not finite.
    pub fn inputs_read(&self) -> Result<Cow<'_, Inputs>, InputError> {
        let signature = self.system.signature();
        let past = signature.past().len();
        // A search for the start has the inputs of the run, which have been read.
        if self.inputs.len() == signature.n_u() {
            return Ok(Cow::Borrowed(self.inputs));
        }
        if signature.delayed_inputs.is_empty() {
            return Ok(match past {
                0 => Cow::Borrowed(self.inputs),
                past => Cow::Owned(self.inputs.widened(past)),
            });
        }
        let tau = delays(self);
        let mut delayed = Vec::with_capacity(signature.delayed_inputs.len());
        for entry in signature.delayed_inputs.iter() {
            let value = tau[entry.delay];
            if !(value.is_finite() && value >= 0.0) {
                return Err(InputError::Delay {
                    input: signature.inputs[entry.input].name.to_string(),
                    delay: signature.delays[entry.delay].to_string(),
                    value,
                });
            }
            delayed.push(Delayed { input: entry.input, tau: value });
        }
        let inputs = self.inputs.with_delayed(&delayed);
        Ok(Cow::Owned(if past == 0 { inputs } else { inputs.widened(past) }))
    }

    /// Checks that no input jumps through which an equation was differentiated.
    pub(crate) fn verify_smooth(&self, from: f64, until: f64) -> Result<(), InputError> {
        let signature = self.system.signature();
        if signature.differentiated_inputs.is_empty() {
            return Ok(());
        }
        let earliest = from - delays(self).into_iter().fold(0.0, f64::max);
        for differentiated in signature.differentiated_inputs.iter() {
            let input = differentiated.input;
            if let Some(at) = self.inputs.first_jump(input, earliest, until) {
                return Err(InputError::Jump {
                    input: signature.inputs[input].name.to_string(),
                    at,
                    equation: differentiated.equation.to_string(),
                });
            }
        }
        Ok(())
    }
}

impl<S: SolvableSystem> Problem<'_, S> {
    /// Checks that this build has the factorisation for the model's Jacobian.
    ///
    /// # Errors
    ///
    /// [`BadRequest::NeedsSparse`].
    pub(crate) fn verify_factorisation(&self) -> Result<(), BadRequest> {
        let signature = self.system.signature();
        let unknowns = signature.unknowns.len();
        if S::Factorisation::is_built(unknowns, &signature.jacobian) {
            return Ok(());
        }
        let (model, non_zeros) = (signature.name.to_string(), signature.jacobian.len());
        Err(BadRequest::NeedsSparse { model, unknowns, non_zeros })
    }
}

/// The results requested from a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WantedResults<'a> {
    /// Only the unknowns.
    Unknowns,
    /// The unknowns, and the past of delayed ones ([`Solution::past`](crate::Solution::past)) even if no output reads
    /// it.
    UnknownsAndPast,
    /// Only the unknowns at these positions, in this order.
    Chosen(&'a [usize]),
    /// The unknowns at these positions, and all outputs; requires that no output has a delay and that steps are adaptive.
    Observed(&'a [usize]),
    /// The unknowns and their sensitivities to the model's directions.
    Sensitivities,
    /// The unknowns of a run that can be continued ([`Solution::memory`](crate::Solution::memory)) and may itself
    /// continue another: the problem then has start values for all unknowns, and the run begins where the other one
    /// ended. No output has a delay.
    Resumed(PriorState<'a>),
    /// [`WantedResults::Resumed`] with sensitivities.
    ResumedSensitivities(PriorState<'a>),
}

/// The state that a run continues from, except for its unknowns.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PriorState<'a> {
    /// The memory of the previous run; `None` for the first one.
    pub memory: Option<&'a RunMemory>,
    /// The past of delayed unknowns.
    pub past: Option<&'a PastSolution>,
}

impl<'a> WantedResults<'a> {
    /// The unknowns to keep, if not all.
    pub(crate) fn chosen(self) -> Option<&'a [usize]> {
        match self {
            WantedResults::Chosen(chosen) | WantedResults::Observed(chosen) => Some(chosen),
            _ => None,
        }
    }

    pub(crate) fn with_sensitivities(self) -> bool {
        matches!(self, WantedResults::Sensitivities | WantedResults::ResumedSensitivities(_))
    }

    /// The state that the run continues from.
    pub(crate) fn resumed(self) -> PriorState<'a> {
        match self {
            WantedResults::Resumed(before) | WantedResults::ResumedSensitivities(before) => before,
            _ => PriorState::default(),
        }
    }

    /// Whether another run is to continue this one.
    pub(crate) fn is_remembered(self) -> bool {
        matches!(self, WantedResults::Resumed(_) | WantedResults::ResumedSensitivities(_))
    }
}

/// How to integrate.
#[derive(Clone, Copy)]
pub struct Options {
    /// Tolerance relative to each unknown's value.
    pub rtol: f64,
    /// Tolerance relative to each unknown's nominal size; for a sensitivity, to the unknown's
    /// nominal size over the parameter's.
    pub atol: f64,
    /// Integration method.
    pub method: &'static Method,
    /// How step sizes are chosen.
    pub steps: Steps,
    /// Maximum number of steps tried.
    pub max_steps: usize,
    /// Initial step size, s; `None` chooses it from the equations.
    pub initial_step: Option<f64>,
    /// Receives progress, and may stop the run.
    pub watched: Option<&'static RunMonitor>,
}

/// Leaves out `watched`: digests of options identify results, which do not depend on it.
impl fmt::Debug for Options {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rtol, atol, method, steps, max_steps, initial_step, watched: _ } = self;
        f.debug_struct("Options")
            .field("rtol", rtol)
            .field("atol", atol)
            .field("method", method)
            .field("steps", steps)
            .field("max_steps", max_steps)
            .field("initial_step", initial_step)
            .finish()
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            rtol: 1e-6,
            atol: 1e-6,
            method: catalogue::DEFAULT,
            steps: Steps::Automatic,
            max_steps: 1_000_000,
            initial_step: None,
            watched: None,
        }
    }
}

impl Options {
    /// These options with another tolerance relative to each unknown's value.
    #[must_use]
    pub fn rtol(self, rtol: f64) -> Self {
        Self { rtol, ..self }
    }

    /// These options with another tolerance relative to each unknown's nominal size.
    #[must_use]
    pub fn atol(self, atol: f64) -> Self {
        Self { atol, ..self }
    }

    /// These options with another method.
    #[must_use]
    pub fn method(self, method: &'static Method) -> Self {
        Self { method, ..self }
    }

    /// These options with another limit on the number of steps.
    #[must_use]
    pub fn max_steps(self, max_steps: usize) -> Self {
        Self { max_steps, ..self }
    }

    /// Checks that tolerances and the initial step are positive numbers.
    ///
    /// # Errors
    ///
    /// [`BadRequest::Tolerance`], [`BadRequest::InitialStep`].
    pub fn verify(&self) -> Result<(), BadRequest> {
        for (name, value) in [("rtol", self.rtol), ("atol", self.atol)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(BadRequest::Tolerance { name, value });
            }
        }
        match self.initial_step {
            Some(value) if !(value > 0.0 && value.is_finite()) => {
                Err(BadRequest::InitialStep { value })
            }
            Some(_) | None => Ok(()),
        }
    }
}

/// Sizes of the unknowns, SI: the declared size, else the magnitude of the start value, else one unit.
pub fn unknown_sizes<S: System>(system: &S, start: &[f64], sizes: &mut [f64]) {
    let mut first = 0;
    for (count, nominal, unit) in system.signature().unknowns.groups() {
        let members = first..first + count;
        first = members.end;
        for (size, start) in sizes[members.clone()].iter_mut().zip(&start[members]) {
            *size = size_of(nominal.unwrap_or(*start), unit.factor);
        }
    }
    share_sizes(system, sizes);
}

/// Size of the parameter at `position`, SI: the declared size, else the magnitude of its declared value, else one unit.
pub fn parameter_size<S: System>(system: &S, position: usize) -> f64 {
    let parameter = &system.signature().parameters[position];
    size_of(parameter.nominal.unwrap_or(parameter.value), parameter.unit.factor)
}

fn size_of(value: f64, unit: f64) -> f64 {
    if value == 0.0 { unit.abs() } else { value.abs() }
}
