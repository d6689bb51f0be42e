//! Functions that the standard library lacks. Compiler and runtime call the same code, so that folded constants and
//! computed numbers have the same bits.

/// The error function, (2/√π) ∫₀ˣ exp(−t²) dt.
#[must_use]
pub fn erf(x: f64) -> f64 {
    libm::erf(x)
}

/// 1 − erf(x), without cancellation.
#[must_use]
pub fn erfc(x: f64) -> f64 {
    libm::erfc(x)
}

/// ln Γ(x) for x > 0; NaN elsewhere.
#[must_use]
pub fn lgamma(x: f64) -> f64 {
    if x > 0.0 { libm::lgamma(x) } else { f64::NAN }
}

/// Argument from which on the asymptotic series is accurate to all digits.
const FAR: f64 = 20.0;

/// Bernoulli numbers B₂, B₄, … B₁₆.
const BERNOULLI: [f64; 8] = [
    1.0 / 6.0,
    -1.0 / 30.0,
    1.0 / 42.0,
    -1.0 / 30.0,
    5.0 / 66.0,
    -691.0 / 2730.0,
    7.0 / 6.0,
    -3617.0 / 510.0,
];

/// ψ⁽ⁿ⁾(x), the derivative of order n + 1 of ln Γ(x), for x > 0 and n = 0, 1, 2, …; NaN elsewhere.
///
/// Uses the recurrence up to large x, and there the asymptotic series:
///
/// ```text
///   ψ⁽ⁿ⁾(x) = ψ⁽ⁿ⁾(x + 1) − (−1)ⁿ n! x⁻ⁿ⁻¹
///   ψ(x)    ~ ln x − 1/(2x) − Σ B₂ₖ/(2k x²ᵏ)
///   ψ⁽ⁿ⁾(x) ~ −(−1)ⁿ ((n − 1)!/xⁿ + n!/(2 xⁿ⁺¹) + Σ B₂ₖ (2k + n − 1)!/((2k)! x²ᵏ⁺ⁿ))
/// ```
///
/// # Source
///
/// Abramowitz and Stegun, Handbook of Mathematical Functions (1964), 6.3.18, 6.4.6 and 6.4.11.
#[must_use]
#[inline(never)]
pub fn polygamma(n: f64, x: f64) -> f64 {
    let is_order = n >= 0.0 && n.fract() == 0.0 && n <= 100.0;
    if !is_order || x.is_nan() || x <= 0.0 {
        return f64::NAN;
    }
    let factorial = (1..=n as u32).fold(1.0, |product, k| product * f64::from(k));
    let sign = if n % 2.0 == 0.0 { 1.0 } else { -1.0 };
    let (mut x, mut recurrence) = (x, 0.0);
    while x < FAR + n {
        recurrence -= sign * factorial / power(x, n as u32 + 1);
        x += 1.0;
    }
    let square = x * x;
    if n == 0.0 {
        let (mut power, mut sum) = (1.0, 0.0);
        for (k, b) in (1..).zip(BERNOULLI) {
            power *= square;
            sum += b / (2.0 * f64::from(k) * power);
        }
        return recurrence + x.ln() - 0.5 / x - sum;
    }
    // (2k + n − 1)!/(2k)! x⁻²ᵏ⁻ⁿ, from k = 0, where it is (n − 1)! x⁻ⁿ, on.
    let mut term = factorial / n / power(x, n as u32);
    let mut sum = term + 0.5 * term * n / x;
    for (k, b) in (1_u32..).zip(BERNOULLI) {
        let two_k = f64::from(2 * k);
        term *= (two_k + n - 1.0) * (two_k + n - 2.0) / (two_k * (two_k - 1.0) * square);
        sum += b * term;
    }
    recurrence - sign * sum
}

/// xⁿ by multiplication, so that results do not depend on the optimiser.
fn power(x: f64, n: u32) -> f64 {
    (0..n).fold(1.0, |product, _| product * x)
}

#[cfg(test)]
mod tests {
    // Kept as printed.
    #![allow(clippy::unreadable_literal)]

    use super::*;

    /// SciPy 1.17.1: `scipy.special.erf`, `erfc`, `gammaln` and `polygamma`.
    #[test]
    fn values_are_those_of_scipy() {
        let close = |found: f64, expected: f64| {
            let error = (found / expected - 1.0).abs();
            assert!(error <= 4e-15, "{found:e} {expected:e} {error:e}");
        };
        close(erf(0.1), 0.1124629160182849);
        close(erf(0.7), 0.6778011938374183);
        close(erf(-1.3), -0.9340079449406524);
        close(erf(2.5), 0.999593047982555);
        close(erfc(0.1), 0.8875370839817152);
        close(erfc(0.7), 0.3221988061625817);
        close(erfc(-1.3), 1.9340079449406524);
        close(erfc(2.5), 0.00040695201744495886);
        close(erfc(10.0), 2.0884875837625446e-45);
        close(lgamma(0.01), 4.599479878042022);
        close(lgamma(0.3), 1.0957979948180756);
        close(lgamma(0.5), 0.5723649429247);
        close(lgamma(3.7), 1.428072326665388);
        close(lgamma(20.5), 40.8315009745308);
        close(lgamma(1000.0), 5905.220423209181);
        close(polygamma(0.0, 0.01), -100.56088545786868);
        close(polygamma(0.0, 0.3), -3.502524222200133);
        close(polygamma(0.0, 3.7), 1.1671535393615113);
        close(polygamma(0.0, 20.5), 2.9958363947076467);
        close(polygamma(0.0, 1000.0), 6.907255195648812);
        close(polygamma(1.0, 0.01), 10001.621213528311);
        close(polygamma(1.0, 0.3), 12.245364546107734);
        close(polygamma(1.0, 3.7), 0.31003785767003833);
        close(polygamma(1.0, 20.5), 0.04998959242996098);
        close(polygamma(1.0, 1000.0), 0.001000500166666633);
        close(polygamma(2.0, 0.01), -2000002.3403986772);
        close(polygamma(2.0, 0.3), -75.27253658872601);
        close(polygamma(2.0, 3.7), -0.09539530872855405);
        close(polygamma(2.0, 20.5), -0.002498439772367734);
        close(polygamma(2.0, 1000.0), -1.0010004999998335e-06);
        close(polygamma(3.0, 0.01), 600000006.2510617);
        close(polygamma(3.0, 0.3), 743.1417646550497);
        close(polygamma(3.0, 3.7), 0.05827921795656364);
        close(polygamma(3.0, 20.5), 0.000249688181085377);
        close(polygamma(3.0, 1000.0), 2.003001999999e-09);
    }

    #[test]
    fn what_is_not_defined_is_not_a_number() {
        for x in [0.0, -1.5, f64::NAN] {
            assert!(lgamma(x).is_nan() && polygamma(0.0, x).is_nan());
        }
        assert!(polygamma(0.5, 1.0).is_nan() && polygamma(-1.0, 1.0).is_nan());
    }
}
