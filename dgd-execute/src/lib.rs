//! Runs a compiled model without rustc: a [`Program`](dgd_compiler::program::Program) becomes a
//! [`System`](dgd_runtime::System) here and now.

mod describe;
mod interpret;
mod taylor;

pub use interpret::Interpreted;
