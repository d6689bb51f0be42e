//! Runs a compiled model without rustc: turns a [`Program`](dgd_compiler::program::Program) into a
//! [`System`](dgd_runtime::System) at run time.
//!
//! [`LoadedSystem`] uses native code where it is available and worthwhile, [`InterpretedSystem`] executes the program's
//! operations one after another. Both equal generated Rust bit for bit.

mod ensemble;
mod fixed;
mod interpret;
mod interpreted;
mod loaded;
#[cfg(feature = "native")]
mod native;
mod on_demand;
mod system;
mod taylor;

pub use interpret::Interpreter;
pub use interpreted::InterpretedSystem;
pub use loaded::{Engine, LoadedSystem, NoNativeCode};
pub use on_demand::OnDemand;
pub use system::{FunctionExecutor, ProgramSystem};
