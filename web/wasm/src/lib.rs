//! Simulations and discoveries on the interpreter, without native code, faer and threads, as on WebAssembly.
//! `compare.mjs` compares their results there with those on this machine.
//!
//! Each case gives lines of three fields, separated by tabs:
//!
//! ```text
//!   text   name  a sentence, a word            equal everywhere
//!   1e-12  name  numbers, separated by spaces  largest difference, relative to the largest of them
//! ```

mod cases;
mod discovery;
pub mod exports;
mod lines;
mod simulation;
mod table;
mod texts;

pub use cases::{CASES, Case};
