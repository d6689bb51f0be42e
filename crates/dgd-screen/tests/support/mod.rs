//! Shared by the tests: reproducible noise, and readings as in files.

#![allow(dead_code, reason = "no test binary uses all of it")]

#[path = "../../../../tests/support/normal.rs"]
mod normal;

pub(crate) use normal::Normal;

/// 0, 1, …, n − 1 seconds.
pub(crate) fn seconds(n: usize) -> Vec<f64> {
    (0..n).map(|k| k as f64).collect()
}
