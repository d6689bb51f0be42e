//! Minimisation: of a sum of squares with derivatives, or of any function without.

pub(crate) mod box_quadratic;
pub(crate) mod nelder_mead;
pub(crate) mod trust_region;
