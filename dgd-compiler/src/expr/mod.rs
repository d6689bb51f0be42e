//! Expressions: a hash-consed graph, its simplification and its derivatives.

pub mod differentiate;
pub mod display;
pub mod graph;
pub mod intrinsics;
pub mod simplify;

pub use graph::{ExprId, Graph, Node, Past, Symbol};
