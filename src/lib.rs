//! A model in a small equation language, compiled to residuals, Jacobians and sensitivities.
//!
//! [`model!`] turns a `.dgd` file into a Rust module at compile time; what it generates implements
//! [`System`], which the solvers re-exported here run.

pub use dgd_identify as identify;
pub use dgd_macros::model;
pub use dgd_runtime::*;

/// What generated code names.
#[doc(hidden)]
pub use dgd_runtime as __runtime;
