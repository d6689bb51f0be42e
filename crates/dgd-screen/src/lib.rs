//! Checks recordings for faults before anything is fitted to them.
//!
//! ```text
//!   Record ─┬─ each channel:  empty, constant, missing, frozen, saturated, spikes, coarse; its noise
//!           ├─ pairs:         offset, gain, drift, noise, clock of sensors of one quantity
//!           ├─ all together:  gaps and spacing, steady stretches, transients, operating points
//!           └─ with balances: drift of a model's imbalances, delays, gains
//!                    └─► Screening: findings with time, size and significance
//! ```
//!
//! Samples in, findings out, in the units of the samples; nothing here reads files, prints, or knows models. All tests
//! are linear in the number of samples, except for sorting. A fault is reported if it occurs by chance in one record of
//! a million; harmless deviations are not reported.

pub mod balance;
mod cleaned;
mod clock;
mod finding;
mod frozen;
mod operating_points;
mod pairs;
mod record;
pub mod redundant;
mod sampling;
mod screen;
mod spikes;
mod statistics;
mod steady;

pub use clock::shift;
pub use finding::{ChannelFault, Finding, Severity};
pub use frozen::{FrozenRun, SaturatedReadings, frozen, saturated};
pub use operating_points::{SteadyPoint, operating_points};
pub use pairs::SimilarChannels;
pub use record::{Channel, ScreenedRecord, TimeStretch, usual_spacing};
pub use sampling::{SampleSpacing, sampling};
pub use screen::{ChannelSummary, RARE, ScreenOptions, Screening, kin, screen, slope_window};
pub use spikes::{Spike, spikes};
pub use statistics::estimate::{Estimate, Regression, mean, regression};
pub use statistics::{distribution, noise, normality, residuals};
pub use steady::{Motion, RestCriterion, SteadyPeriod, TransientPeriod, motion};
