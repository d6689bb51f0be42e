//! Simulations and discoveries on the interpreter, without machine code, faer and threads, as they are on
//! WebAssembly. `compare.mjs` compares what they give there and on this machine.
//!
//! Each case gives lines of three fields with tabs between them:
//!
//! ```text
//!   text   what  a sentence, a word           equal everywhere
//!   1e-12  what  numbers, spaces between them  off by so much of the largest of them at most
//! ```

mod cases;
mod discovery;
pub mod exports;
mod lines;
mod simulation;
mod table;
mod texts;

pub use cases::{CASES, Case};
