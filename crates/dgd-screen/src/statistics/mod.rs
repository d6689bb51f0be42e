//! Statistics of time series: noise, means and regressions of correlated samples, and tests of residuals.

pub mod distribution;
pub(crate) mod estimate;
pub mod noise;
pub mod normality;
pub mod residuals;
