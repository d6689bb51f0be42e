//! Functions of the language that the standard library lacks, or that an optimiser would replace.

/// x^y.
///
/// Not inlined: where an argument is a known number, compilers replace the power by another
/// function (10^x by exp10, say), whose last bit may differ from that of the interpreter.
#[inline(never)]
pub fn power(x: f64, y: f64) -> f64 {
    x.powf(y)
}

/// −1, 0 or 1; NaN stays NaN.
#[inline]
pub fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        x
    }
}
