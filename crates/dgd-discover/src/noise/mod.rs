//! Tests whether something is missing: residuals and sensor noise in, tests and windows out.
//!
//! [`noise_of`] estimates the noise of each output from recordings, [`coloured_noise`] its correlation, which a
//! [`NoiseWhitener`] removes. [`whiteness()`] tests whether there is more than noise, [`discrepancy_windows`] finds
//! when.

mod colour;
mod discrepancy;
mod lonely;
mod recorded;
mod whiteness;
mod windows;

pub(crate) use colour::{NoiseWhitener, coloured_noise};
pub use discrepancy::{averaging_lengths, discrepancy_windows};
pub(crate) use lonely::{without_lonely, without_spikes};
pub(crate) use recorded::{noise_of, readings};
pub use whiteness::{
    CheckKind, FEWEST, Whiteness, WhitenessCheck, effective_sample_size, whiteness,
};
pub(crate) use whiteness::{size, steadiness};
pub use windows::SignalWindow;
pub(crate) use windows::gather;
