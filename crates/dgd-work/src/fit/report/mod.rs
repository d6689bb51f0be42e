//! The report of a fit: its estimates and residuals, how far they can be trusted, and its missing parts.

pub(crate) mod bad_fit;
pub(crate) mod excess;
pub(crate) mod few_samples;
pub(crate) mod information;
pub(crate) mod intervals;
pub(crate) mod left_out;
pub(crate) mod left_over;
pub(crate) mod linearised;
pub(crate) mod outcome;
pub(crate) mod quality;
pub(crate) mod regression;
mod runaway;
pub(crate) mod standard;
