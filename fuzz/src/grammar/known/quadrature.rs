//! Integrals of smooth functions.

/// Abscissae and weights of five-point Gauss–Legendre quadrature on −1 … 1.
const GAUSS: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

/// The integral of a smooth function between two points, in this many pieces.
pub(super) fn integral(f: &dyn Fn(f64) -> f64, a: f64, b: f64, pieces: usize) -> f64 {
    let h = (b - a) / pieces.max(1) as f64;
    let piece = |k: usize| -> f64 {
        let middle = a + (k as f64 + 0.5) * h;
        GAUSS.iter().map(|(x, w)| 0.5 * h * w * f(middle + 0.5 * h * x)).sum()
    };
    (0..pieces.max(1)).map(piece).sum()
}

/// A root between two points with different signs of the function.
pub(super) fn root(f: &dyn Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    let rises = f(b) > 0.0;
    for _ in 0..100 {
        let middle = 0.5 * (a + b);
        if (f(middle) > 0.0) == rises {
            b = middle;
        } else {
            a = middle;
        }
    }
    0.5 * (a + b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrals_and_roots_are_right() {
        let value = integral(&|x: f64| x.exp(), 0.0, 3.0, 10);
        assert!((value - 3.0_f64.exp_m1()).abs() < 1e-11, "{value}");
        assert!((root(&|x: f64| x.cos(), 1.0, 2.0) - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    }
}
