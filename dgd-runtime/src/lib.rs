//! The trait that compiled models implement, and their solvers.
//!
//! ```text
//!   System + parameters + Inputs + start values = Problem
//!   simulate(problem, times, options)                    → Solution: y
//!   simulate_chosen(problem, chosen, times, options)     → Solution: a few of y
//!   simulate_observed(problem, chosen, times, options)   → Solution: the same with outputs
//!   simulate_with_sensitivities(problem, times, options) → Solution: y and S = ∂y/∂θ
//!   observe(problem, solution)                           → Observations: w and ∂w/∂θ
//!   linearize::linearize(problem, point)               → StateSpace: A, B, C, D close to a point
//!   ensemble::simulate(members, times, options, threads) → w and y of each of many
//! ```

// Test problems refer to the crate by its public name.
#[cfg(test)]
extern crate self as dgd_runtime;

mod algebraic;
pub mod codegen;
mod discrete;
pub mod ensemble;
mod error;
pub mod integrate;
pub mod linalg;
pub mod linearize;
pub mod model;
mod observe;
mod problem;
mod signal;
mod solution;
pub mod solved;
pub mod system;

pub use algebraic::domain::DomainEnd;
pub use algebraic::readings::ReadValue;
pub use codegen::{math, taylor};
pub use dgd_signature as signature;
pub use dgd_signature::special;
pub use discrete::discrete_numbers;
pub use ensemble::parallel;
pub use error::{BadRequest, Evaluation, Failure, InitialError, IntegrateError};
pub use integrate::begin::{OtherMethod, method_to_begin};
pub use integrate::catalogue::{
    METHODS, Method, MethodKind, UnknownMethod, automatic as automatic_method, find as find_method,
};
#[doc(hidden)]
pub use integrate::enclosure::encloses;
pub use integrate::fixed_step::{
    PerSample, PerSampleChoice, PerSampleError, Steps, choose_per_sample,
};
pub use integrate::start::consistent::{ConsistentStart, consistent_start};
pub use integrate::start::dependent::{DependentEquations, dependent_equations};
pub use integrate::start::measured::{MeasuredStartError, start_from_outputs};
pub use integrate::watched::RunMonitor;
pub use integrate::{simulate, simulate_chosen, simulate_observed, simulate_with_sensitivities};
#[doc(hidden)]
pub use model::for_identify;
pub use observe::{Observations, observe};
pub use problem::{Options, PriorState, Problem, WantedResults};
pub use signal::{Delayed, InputColumn, InputError, Inputs, LimitSide, Segment};
pub use solution::{
    DelayedOutputValues, Event, Fold, Jump, JumpCause, OneSided, Solution, Statistics,
    UndefinedCause, UndefinedSensitivity, side,
};
pub use solved::SolvableSystem;
pub use system::{
    Automaton, AutomatonKind, Clock, Crossing, DelayedInput, Direction, Discrete, EvaluationPoint,
    Features, Input, Interpolation, List, Output, Parameter, Pattern, Signature, Storage, System,
    Text, Transition, Unit, Unknown,
};
