//! Tail probabilities of Fisher's F distribution.
//!
//! ```text
//!   P(F > f) = I_x(b/2, a/2),   x = b/(b + a f)     with a and b degrees of freedom
//! ```
//!
//! I is the regularised incomplete beta function, by the continued fraction of DLMF 8.17.22 with Lentz's method, as in
//! Press et al., Numerical Recipes, 3rd ed. (2007), §6.4.

/// P(F > `value`) with `a` and `b` degrees of freedom.
pub(super) fn f_tail(value: f64, a: f64, b: f64) -> f64 {
    if value <= 0.0 { 1.0 } else { beta(0.5 * b, 0.5 * a, b / (b + a * value)) }
}

/// I_x(a, b).
fn beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    let scale = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * (-x).ln_1p()).exp();
    // The fraction converges quickly on this side of the mean.
    if x < (a + 1.0) / (a + b + 2.0) {
        scale * fraction(a, b, x) / a
    } else {
        1.0 - scale * fraction(b, a, 1.0 - x) / b
    }
}

/// Replaces zero in the denominators of a continued fraction.
const TINY: f64 = 1e-300;

fn fraction(a: f64, b: f64, x: f64) -> f64 {
    let nonzero = |value: f64| if value.abs() < TINY { TINY } else { value };
    let mut c = 1.0;
    let mut d = 1.0 / nonzero(1.0 - (a + b) * x / (a + 1.0));
    let mut value = d;
    // It takes O(√max(a, b)) terms.
    let most = 200 + (20.0 * a.max(b).sqrt()) as usize;
    for m in 1..most {
        let m = m as f64;
        let terms = [
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        ];
        let before = value;
        for term in terms {
            d = 1.0 / nonzero(1.0 + term * d);
            c = nonzero(1.0 + term / c);
            value *= c * d;
        }
        if (value - before).abs() <= f64::EPSILON * value.abs() {
            break;
        }
    }
    value
}

/// log Γ(x) for x > 0, by the series of Lanczos with nine terms.
///
/// # Source
///
/// C. Lanczos, SIAM J. Numer. Anal. 1 (1964) 86; coefficients for g = 7 of P. Godfrey.
fn ln_gamma(x: f64) -> f64 {
    const G: f64 = 7.0;
    const TERMS: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    if x < 0.5 {
        let sine = (std::f64::consts::PI * x).sin();
        return (std::f64::consts::PI / sine).ln() - ln_gamma(1.0 - x);
    }
    let x = x - 1.0;
    let series = TERMS.iter().enumerate().skip(1);
    let sum = series.fold(TERMS[0], |sum, (k, term)| sum + term / (x + k as f64));
    let t = x + G + 0.5;
    0.5 * (2.0 * std::f64::consts::PI).ln() + (x + 0.5) * t.ln() - t + sum.ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_tables() {
        // Upper points of F: NIST/SEMATECH e-Handbook of Statistical Methods, 1.3.6.7.3.
        for (value, a, b, tail) in [
            (4.965, 1.0, 10.0, 0.05),
            (3.708, 3.0, 10.0, 0.05),
            (2.348, 10.0, 20.0, 0.05),
            (10.044, 1.0, 10.0, 0.01),
            (4.431, 4.0, 20.0, 0.01),
        ] {
            let computed = f_tail(value, a, b);
            assert!((computed - tail).abs() < 2e-5, "{value} {a} {b}: {computed}");
        }
        // With two degrees of freedom above, a closed form: (1 + 2f/b)^(−b/2).
        for (f, b) in [(0.3_f64, 5.0_f64), (2.0, 8.0), (40.0, 30.0), (60.0, 400.0)] {
            let exact = (1.0 + 2.0 * f / b).powf(-0.5 * b);
            assert!((f_tail(f, 2.0, b) / exact - 1.0).abs() < 1e-10, "{f} {b}");
        }
        // With many degrees of freedom below, the tail approaches that of χ².
        let limit = dgd_screen::distribution::chi_square_tail(12.0, 4.0);
        assert!((f_tail(3.0, 4.0, 1e7) / limit - 1.0).abs() < 1e-5);
    }
}
