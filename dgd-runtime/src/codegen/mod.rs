//! Helpers that generated models call, in addition to the solvers' own types.

pub mod math;
pub mod taylor;

/// A description that a model with arrays builds at first use.
pub type Lazy<T> = std::sync::LazyLock<T>;

/// Numbers of a model too large for the stack.
pub type HeapNumbers = Vec<f64>;

/// A slice of known length.
///
/// # Panics
///
/// If the length differs: callers of a [`crate::System`] must keep to its signature.
#[inline]
pub fn fixed<const N: usize>(numbers: &[f64]) -> &[f64; N] {
    match numbers.try_into() {
        Ok(array) => array,
        Err(_) => wrong_length(numbers.len(), N),
    }
}

/// The same, mutable.
///
/// # Panics
///
/// Like [`fixed`].
#[inline]
pub fn fixed_mut<const N: usize>(numbers: &mut [f64]) -> &mut [f64; N] {
    let len = numbers.len();
    match numbers.try_into() {
        Ok(array) => array,
        Err(_) => wrong_length(len, N),
    }
}

#[cold]
fn wrong_length(found: usize, expected: usize) -> ! {
    panic!("expected {expected} numbers, found {found}")
}
