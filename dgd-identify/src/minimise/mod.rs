//! Searches for a minimum: of a sum of squares by its derivatives, of any function without.

pub(crate) mod box_quadratic;
pub(crate) mod nelder_mead;
pub(crate) mod trust_region;
