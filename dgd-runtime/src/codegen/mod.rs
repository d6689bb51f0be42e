//! What generated models call, besides the solvers' own types.

pub mod math;
pub mod taylor;

/// What a model with arrays makes of its description at first use.
pub type Lazy<T> = std::sync::LazyLock<T>;

/// Numbers of a model too large for the stack.
pub type HeapNumbers = Vec<f64>;

/// A slice of known length.
///
/// # Panics
///
/// If it has another length: whoever calls a [`crate::System`] keeps to its signature.
#[inline]
pub fn fixed<const N: usize>(numbers: &[f64]) -> &[f64; N] {
    match numbers.try_into() {
        Ok(array) => array,
        Err(_) => wrong_length(numbers.len(), N),
    }
}

/// The same to write to.
///
/// # Panics
///
/// As [`fixed`].
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
