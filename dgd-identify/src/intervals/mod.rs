//! How far estimates can be believed: what happens next to where a fit has ended, and how estimates scatter.
//!
//! [`around`] poses the problem of a fit again; [`profile`] and [`bootstrap`] solve it there, [`along`] walks from
//! a minimum to the ends of an interval, and [`information`] says which samples determine which estimate. [`spread`] says
//! how far parts of the recordings are apart, which [`cells`] are put together to.

pub(crate) mod along;
pub(crate) mod around;
pub(crate) mod bootstrap;
pub(crate) mod cells;
pub(crate) mod information;
pub(crate) mod profile;
pub(crate) mod spread;
