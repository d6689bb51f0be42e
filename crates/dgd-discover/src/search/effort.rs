//! How many structures and simulations a search spends.

/// Number of structures from which the search continues.
pub(crate) const BEAM: usize = 3;

/// Maximum number of simulations in the final fits of a structure.
pub(crate) const EVALUATIONS: usize = 40;
