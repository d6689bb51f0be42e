//! Tail probabilities of the normal, the χ² and Student's distribution.
//!
//! ```text
//!   Q(a, x) = Γ(a, x)/Γ(a);   P(χ²_ν > c) = Q(ν/2, c/2);   P(|z| > c) = Q(1/2, c²/2)
//!   P(|t_ν| > c) = I_x(ν/2, 1/2),   x = ν/(ν + c²)
//! ```
//!
//! The series of DLMF 8.7.1 below x = a + 1, the continued fraction of DLMF 8.9.2 by Lentz's method
//! above, as in Press et al., Numerical Recipes, 3rd ed. (2007), §6.2; the continued fraction of DLMF 8.17.22 for the
//! incomplete beta function I, as there in §6.4.

/// P(χ² > `value`) with `dof` degrees of freedom; 0 if it underflows.
pub fn chi_square_tail(value: f64, dof: f64) -> f64 {
    if value <= 0.0 { 1.0 } else { upper_gamma(0.5 * dof, 0.5 * value) }
}

/// P(|z| > `value`) for a standard normal z.
pub fn normal_two_sided(value: f64) -> f64 {
    chi_square_tail(value * value, 1.0)
}

/// The value that a standard normal |z| exceeds with this probability.
pub fn normal_threshold(probability: f64) -> f64 {
    // Beyond 38 standard deviations the probability underflows.
    let (mut low, mut high) = (0.0, 38.0);
    while high - low > 1e-9 {
        let middle = f64::midpoint(low, high);
        if normal_two_sided(middle) > probability { low = middle } else { high = middle }
    }
    high
}

/// P(|t| > `value`) for a t of Student's distribution with `freedom` degrees of freedom.
pub fn student_two_sided(value: f64, freedom: f64) -> f64 {
    let square = value * value;
    let (a, b) = (0.5 * freedom, 0.5);
    // Each of the two from the end that it is near.
    let (x, rest) = (freedom / (freedom + square), square / (freedom + square));
    if rest == 0.0 {
        1.0
    } else if x < (a + 1.0) / (a + b + 2.0) {
        beta_fraction(a, b, x, rest)
    } else {
        1.0 - beta_fraction(b, a, rest, x)
    }
}

/// The standard normal deviate that is exceeded with the probability with which a t of Student's distribution exceeds
/// `value`.
pub fn normal_of_student(value: f64, freedom: f64) -> f64 {
    if !value.is_finite() {
        return value;
    }
    normal_threshold(student_two_sided(value, freedom)).copysign(value)
}

/// I_x(a, b) for x < (a + 1)/(a + b + 2), where `rest` is 1 − x.
fn beta_fraction(a: f64, b: f64, x: f64, rest: f64) -> f64 {
    let logarithm = a * x.ln() + b * rest.ln() + ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b);
    let away = |value: f64| if value.abs() < TINY { TINY } else { value };
    let mut c = 1.0;
    let mut d = 1.0 / away(1.0 - (a + b) * x / (a + 1.0));
    let mut fraction = d;
    // Converges within some √max(a, b) terms.
    for m in 1..200 + (20.0 * a.max(b).sqrt()) as usize {
        let m = m as f64;
        let before = fraction;
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        for numerator in [even, odd] {
            d = 1.0 / away(1.0 + numerator * d);
            c = away(1.0 + numerator / c);
            fraction *= c * d;
        }
        if (fraction / before - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    (logarithm.exp() * fraction / a).clamp(0.0, 1.0)
}

/// Replacement for zero in a continued fraction's denominators.
const TINY: f64 = 1e-300;

/// Q(a, x) for a > 0, x > 0.
fn upper_gamma(a: f64, x: f64) -> f64 {
    // Both expansions converge within a few √a terms if x is near a, sooner elsewhere.
    let most_terms = 200 + (20.0 * a.sqrt()) as usize;
    let scale = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let mut term = 1.0 / a;
        let mut sum = term;
        for k in 1..most_terms {
            term *= x / (a + k as f64);
            sum += term;
            if term < sum * f64::EPSILON {
                break;
            }
        }
        return (1.0 - scale * sum).clamp(0.0, 1.0);
    }
    let mut b = x + 1.0 - a;
    let mut c = 1.0 / TINY;
    let mut d = 1.0 / b;
    let mut fraction = d;
    for k in 1..most_terms {
        let k = k as f64;
        let numerator = -k * (k - a);
        b += 2.0;
        d = numerator * d + b;
        d = 1.0 / if d.abs() < TINY { TINY } else { d };
        c = b + numerator / c;
        c = if c.abs() < TINY { TINY } else { c };
        fraction *= c * d;
        if (c * d - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    (scale * fraction).clamp(0.0, 1.0)
}

/// ln Γ(x) for x > 0: Stirling's series (DLMF 5.11.1) after moving x above 10, where its first
/// omitted term is 2e-14.
fn ln_gamma(x: f64) -> f64 {
    let mut x = x;
    let mut shift = 0.0;
    while x < 10.0 {
        shift += x.ln();
        x += 1.0;
    }
    let inverse = 1.0 / (x * x);
    let series = [1.0 / 1188.0, -1.0 / 1680.0, 1.0 / 1260.0, -1.0 / 360.0, 1.0 / 12.0]
        .iter()
        .fold(0.0, |sum, coefficient| sum * inverse + coefficient)
        / x;
    (x - 0.5) * x.ln() - x + 0.5 * (2.0 * std::f64::consts::PI).ln() + series - shift
}

#[cfg(test)]
mod tests {
    use super::{
        chi_square_tail, normal_of_student, normal_threshold, normal_two_sided, student_two_sided,
    };

    #[test]
    fn student_s_tails_agree_with_closed_forms_and_tables() {
        for c in [1e-3_f64, 0.1, 0.9, 1.0, 3.0, 50.0, 1e6] {
            // P(|t_1| > c) = 2/π atan(1/c), P(|t_2| > c) = 1 − c/√(2 + c²).
            let cauchy = 2.0 / std::f64::consts::PI * (1.0 / c).atan();
            assert!((student_two_sided(c, 1.0) / cauchy - 1.0).abs() < 1e-12, "{c}");
            let root = (2.0 + c * c).sqrt();
            let two = 2.0 / (root * (root + c));
            assert!((student_two_sided(c, 2.0) / two - 1.0).abs() < 1e-12, "{c}");
        }
        // Abramowitz & Stegun, table 26.10.
        for (freedom, c) in [(4.0, 2.776_445), (10.0, 2.228_139), (120.0, 1.979_930)] {
            assert!((student_two_sided(c, freedom) - 0.05).abs() < 1e-7, "{freedom}");
            assert!((normal_of_student(-c, freedom) + 1.959_963_985).abs() < 1e-6);
        }
        assert!((normal_of_student(1.3, 1e7) - 1.3).abs() < 1e-6);
        assert!(normal_of_student(0.0, 4.0).abs() < 1e-8);
    }

    #[test]
    fn tails_agree_with_closed_forms_and_tables() {
        // P(χ²_2 > c) = exp(−c/2), P(χ²_4 > c) = (1 + c/2) exp(−c/2).
        for c in [0.01, 1.0, 3.0, 10.0, 100.0, 1000.0] {
            let half: f64 = 0.5 * c;
            let expected = (-half).exp();
            assert!((chi_square_tail(c, 2.0) / expected - 1.0).abs() < 1e-12, "{c}");
            assert!((chi_square_tail(c, 4.0) / ((1.0 + half) * expected) - 1.0).abs() < 1e-12);
        }
        // Abramowitz & Stegun, table 26.2 and p. 966: two-sided 1.959964 → 0.05, 5 → 5.733031e-7.
        assert!((normal_two_sided(1.959_963_985) - 0.05).abs() < 1e-9);
        assert!((normal_two_sided(5.0) / 5.733_031_4e-7 - 1.0).abs() < 1e-7);
        assert!((normal_threshold(0.05) - 1.959_963_985).abs() < 1e-8);
        // χ² with many degrees of freedom: the median is ν (1 − 2/(9ν))³ up to O(1/ν).
        let dof = 6000.0;
        let median = dof * (1.0f64 - 2.0 / (9.0 * dof)).powi(3);
        assert!((chi_square_tail(median, dof) - 0.5).abs() < 1e-5);
    }

    #[test]
    fn far_tails_vanish_and_the_near_end_is_certain() {
        assert_eq!(chi_square_tail(1e6, 3.0), 0.0);
        assert_eq!(chi_square_tail(0.0, 3.0), 1.0);
        assert_eq!(chi_square_tail(-1.0, 3.0), 1.0);
    }
}
