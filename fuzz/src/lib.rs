//! Random valid models, and oracles that detect wrong results of dgd for them.

// Comparisons are negated because NaN compares false; rows and columns of several tables share an index.
#![allow(clippy::neg_cmp_op_on_partial_ord, clippy::needless_range_loop)]

pub mod case;
pub mod facts;
pub mod generated;
pub mod grammar;
pub mod oracle;
mod prepared;
mod random;
pub mod shrink;
mod truth;
