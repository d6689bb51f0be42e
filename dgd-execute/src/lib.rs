//! Runs a compiled model without rustc: a [`Program`](dgd_compiler::program::Program) becomes a
//! [`System`](dgd_runtime::System) here and now.
//!
//! [`Loaded`] is machine code made at run time where that can be had and pays, [`Interpreted`] performs
//! the program's operations one after another. Both give the bits of generated Rust.

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
