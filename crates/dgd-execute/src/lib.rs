//! Runs a compiled model without rustc: turns a [`Program`](dgd_compiler::program::Program) into a
//! [`System`](dgd_runtime::System) at run time.
//!
//! [`Loaded`] uses native code where it is available and worthwhile, [`Interpreted`] executes the program's operations
//! one after another. Both equal generated Rust bit for bit.

mod ensemble;
mod fixed;
mod interpret;
mod loaded;
#[cfg(feature = "native")]
mod native;
mod system;
mod taylor;

pub use interpret::{Interpreted, Interpreter};
pub use loaded::{Engine, Loaded, NoNativeCode, OnDemand};
pub use system::{Executed, Perform};
