//! Statistics of samples that follow each other: their noise, means and regressions of correlated ones, and
//! whether residuals have anything left to say.

pub mod distribution;
pub(crate) mod estimate;
pub mod noise;
pub mod normality;
pub mod residuals;
