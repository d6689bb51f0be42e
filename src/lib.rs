//! A model in a small equation language, compiled to residuals, Jacobians and sensitivities.
//!
//! [`model!`] turns a `.dgd` file into a Rust module at compile time. A [`Problem`] is the model with parameters and
//! inputs; [`simulate`] and [`sensitivities`] run it, and their [`Solution`] is read by name. [`fit`] estimates
//! parameters from recordings, [`linearize`] gives A, B, C, D at a point, [`ensemble`] runs many problems in parallel.
//! All numbers are in SI units.
//!
//! Fig 3.1 of Haukanes (2015): the level of a riser after a step of 10 % in the speed of a subsea pump, and its
//! sensitivities to the coefficients of the pump and the return line.
//!
//! ```
//! dgd::model!("models/pump_speed_step.dgd");
//! use pump_speed_step::{Model, Parameters};
//!
//! fn main() -> Result<(), dgd::Error> {
//!     let step = dgd::inputs(
//!         &Model,
//!         &[0.0, 50.0],
//!         &[("omega", &[10.0 / 1.1, 10.0]), ("q_in", &[0.02, 0.02])],
//!     )?;
//!     let p = Parameters::default();
//!     let problem = dgd::Problem::new(&Model, &p, &step);
//!     let options = dgd::Options::default().rtol(1e-8);
//!     let run = dgd::sensitivities(&problem, &[0.0, 1000.0], &options)?;
//!
//!     let at_the_end = |values: &[f64]| format!("{:.3e}", values[1]);
//!     assert_eq!(at_the_end(run.get("h")?), "1.460e1");
//!     assert_eq!(at_the_end(run.sensitivity("h", "c0")?), "8.170e1");
//!     assert_eq!(at_the_end(run.sensitivity("h", "c1")?), "-1.710e-1");
//!     assert_eq!(at_the_end(run.sensitivity("h", "c2")?), "-3.582e-4");
//!     assert_eq!(at_the_end(run.sensitivity("h", "F")?), "-3.260e-8");
//!     Ok(())
//! }
//! ```
//!
//! Other parameters are set with `Parameters { c0: 0.4, ..Parameters::default() }`, an initial value with
//! `problem.start("h", 12.0)?`, and the method with `options.method(dgd::method("bdf")?)`.

mod ensemble;
mod error;
mod fit;
mod linear;
mod problem;
mod solution;

pub use dgd_identify::{EstimateError, Termination};
pub use dgd_macros::model;
pub use dgd_runtime::linearize::{LinearizeError, SteadyStateError};
pub use dgd_runtime::model::Model as AnyModel;
pub use dgd_runtime::{
    Event, InputColumn, InputError, Inputs, IntegrateError, Interpolation, METHODS, Method,
    OneSided, Options, PerSample, SolvableSystem, Statistics, Steps, System, UndefinedCause,
    UndefinedSensitivity, UnknownMethod, find_method as method,
};
pub use ensemble::ensemble;
pub use error::Error;
pub use fit::{EstimatedParameter, Fit, Recording, fit};
pub use linear::{LinearModel, LinearizationPoint, MatrixRows, linearize};
pub use problem::{Problem, inputs, sensitivities, simulate};
pub use solution::Solution;

/// Used by generated code.
#[doc(hidden)]
pub use dgd_runtime as __runtime;
