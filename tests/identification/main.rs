//! Estimates from recordings, by every estimator.

#[path = "../support/examined.rs"]
mod examined;
#[path = "../support/recorded.rs"]
mod recorded;
#[path = "../support/mod.rs"]
mod support;

mod criteria;
mod filtering;
mod filters;
mod filters_with_a_past;
mod nist;
mod output_error;
mod process_noise;
mod regression;
mod relative_noise;
mod smoothness;
mod uncertainty;

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

/// A normal deviate by Box and Muller.
fn normal(random: &mut Pcg64) -> f64 {
    let mut uniform = || ((random.next_u64() >> 11) + 1) as f64 / (1u64 << 53) as f64;
    (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
}
