//! Expressions: a hash-consed graph, its simplification and its derivatives.

pub mod curve;
pub mod differentiate;
pub mod display;
pub mod graph;
pub mod hash;
pub mod intrinsics;
pub mod simplify;
pub mod tape;

pub use graph::{DelayedValue, ExprGraph, ExprId, Node, Symbol};
pub use tape::Tape;
