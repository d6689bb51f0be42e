//! The uncertainty of estimates: the neighbourhood of a fit's minimum, and the scatter of the estimates.
//!
//! [`around`] solves the problem of a fit again near its minimum, for [`profile`] and [`bootstrap`]; [`along`] goes
//! from a minimum to the ends of an interval, and [`information`] finds the samples that determine an estimate.
//! [`spread`] compares parts of the recordings, which are composed of [`cells`].

pub(crate) mod along;
pub(crate) mod around;
pub(crate) mod bootstrap;
pub(crate) mod cells;
pub(crate) mod information;
pub(crate) mod profile;
pub(crate) mod spread;
