//! The growth of an output's noise with its size, and the scale in which the noise is uniform.
//!
//! ```text
//!   σ(w) = c g(w),   g² = a² + b² w²,   T(w) = ∫ dw/g(w) = asinh(b w/a)/b
//!   y: T(y) normal about T(w) with the standard deviation c
//!   D = r² + ln 2π(c g(y))²,   r = (T(w) − T(y))/c
//!   ∂r/∂w = 1/σ(w) where c is held;   d ln c = dσ/σ − (g′/g) dw
//! ```
//! If σ grows with w, the likelihood of normal readings has a plateau: an output that is far too large explains any
//! reading by its own large noise, and slopes there point outwards. D has no plateau: σ is small, and T(w) far from
//! T(y), for any w, and proportional noise (a = 0) gives logarithms. For small c the two have nearly the same minimum,
//! so a search starts with D. c is σ(w)/g(w) of each sample, for any parameters; a and b are fixed during a run.
//!
//! Source of T: Bartlett, The use of transformations, Biometrics 3 (1947) 39–52.

use dgd_runtime::signature::Distribution;

use crate::noise::density::{DensityTerm, PredictedReading, SampleDefect};

/// Below this fraction of σ² the constant part counts as zero.
const NOTHING: f64 = 1e-6;

/// The growth of σ with an output, up to a factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseShape {
    /// a.
    pub(crate) floor: f64,
    /// b.
    pub(crate) slope: f64,
}

impl NoiseShape {
    /// The shape fitted to pairs of a simulated output and its σ, with readings `measured`: minimises relative errors
    /// of σ². `None` if σ does not grow over the range of these outputs and readings.
    pub fn fit(pairs: &[(f64, f64)], measured: &[f64]) -> Option<Self> {
        let (floor, slope) = grown(pairs)?;
        let size = |all: &mut dyn Iterator<Item = f64>| all.fold(0.0, f64::max);
        let largest = size(&mut measured.iter().map(|y| y.abs()));
        let largest = largest.max(size(&mut pairs.iter().map(|(w, _)| w.abs())));
        if slope * largest <= 0.1 * floor {
            return None;
        }
        let signs = || pairs.iter().map(|(w, _)| *w).chain(measured.iter().copied());
        if signs().all(|w| w > 0.0) || signs().all(|w| w < 0.0) {
            return Some(Self { floor, slope });
        }
        // Where an output passes zero, values below the size of readings are not resolved.
        let squares: f64 = measured.iter().map(|y| y * y).sum();
        let usual = (squares / measured.len().max(1) as f64).sqrt();
        let floor = floor.max(slope * usual);
        (floor > 0.0).then_some(Self { floor, slope })
    }

    /// The output from which on σ is proportional to it: a/b; 0 if it always is.
    pub fn bend(self) -> f64 {
        self.floor / self.slope
    }

    /// g.
    pub(crate) fn evaluate(self, w: f64) -> f64 {
        self.floor.hypot(self.slope * w)
    }

    /// T(w) − T(y).
    fn between(self, w: f64, y: f64) -> f64 {
        let Self { floor, slope } = self;
        if floor > 0.0 {
            return ((slope * w / floor).asinh() - (slope * y / floor).asinh()) / slope;
        }
        (w.abs().ln() - y.abs().ln()) * y.signum() / slope
    }

    /// d ln σ/dw with c fixed: g′/g.
    pub(crate) fn growth(self, w: f64) -> f64 {
        let g = self.evaluate(w);
        self.slope * self.slope * w / (g * g)
    }

    /// Defects of a sample in this scale, in addition to those of [`PredictedReading::spoilt`].
    pub(crate) fn spoilt(self, seen: PredictedReading) -> Option<SampleDefect> {
        let is_apart = self.floor == 0.0 && seen.simulated * seen.measured.signum() <= 0.0;
        is_apart.then_some(SampleDefect::Logarithm(seen.simulated))
    }

    /// The contribution of a sample to D; its derivatives are those with respect to w with c fixed, and with respect to
    /// σ without its dependence on w.
    pub(crate) fn term(self, seen: PredictedReading, distribution: Distribution) -> DensityTerm {
        let PredictedReading { measured, simulated, sigma } = seen;
        let c = sigma / self.evaluate(simulated);
        let r = self.between(simulated, measured) / c;
        DensityTerm::from_residual(r, 1.0 / sigma, sigma, distribution)
            .with_spread(c * self.evaluate(measured), sigma)
    }
}

/// a and b of σ² = a² + b² w².
fn grown(pairs: &[(f64, f64)]) -> Option<(f64, f64)> {
    let usable = |(w, sigma): &&(f64, f64)| w.is_finite() && sigma.is_finite() && *sigma != 0.0;
    let pairs: Vec<(f64, f64)> = pairs.iter().filter(usable).copied().collect();
    let size = pairs.iter().map(|(w, _)| w.abs()).fold(0.0, f64::max);
    // All w are finite.
    if size == 0.0 {
        return None;
    }
    // 1 = α x + β z with x = σ₀²/σ² and z = w²/σ² over its largest: neither is lost if they span decades.
    let smallest = pairs.iter().map(|(_, sigma)| sigma.abs()).fold(f64::INFINITY, f64::min);
    let steepest = pairs.iter().map(|(w, sigma)| (w / sigma).abs()).fold(0.0, f64::max);
    if !(steepest > 0.0 && steepest.is_finite()) {
        return None;
    }
    let rows = || {
        pairs.iter().map(|(w, sigma)| ((smallest / sigma).powi(2), (w / sigma / steepest).powi(2)))
    };
    let [mut xx, mut xz, mut zz, mut x1, mut z1] = [0.0; 5];
    for (x, z) in rows() {
        (xx, xz, zz) = (xx + x * x, xz + x * z, zz + z * z);
        (x1, z1) = (x1 + x, z1 + z);
    }
    let determinant = xx * zz - xz * xz;
    // If all outputs are of one size, the growth of σ is unknown.
    if determinant <= NOTHING * xx * zz {
        return None;
    }
    let (mut alpha, mut beta) =
        ((x1 * zz - z1 * xz) / determinant, (z1 * xx - x1 * xz) / determinant);
    if beta <= 0.0 {
        return None;
    }
    // α is the fraction of a² in the smallest σ².
    if alpha <= NOTHING {
        (alpha, beta) = (0.0, z1 / zz);
    }
    Some((alpha.sqrt() * smallest, beta.sqrt() / steepest))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NORMAL: Distribution = Distribution::Normal;

    fn shape(sigma: impl Fn(f64) -> f64, outputs: &[f64], readings: &[f64]) -> Option<NoiseShape> {
        let pairs: Vec<(f64, f64)> = outputs.iter().map(|w| (*w, sigma(*w))).collect();
        NoiseShape::fit(&pairs, readings)
    }

    #[test]
    fn shapes_are_found_over_decades_and_a_constant_has_none() {
        let outputs = [5.0, 0.3, 2e-4, 7e-9, 4e-20, 1e-43];
        let found = shape(|w| 0.3 * w, &outputs, &outputs).expect("it grows");
        assert!(found.floor == 0.0 && (found.slope - 0.3).abs() < 1e-9, "{found:?}");
        let found = shape(|w| f64::hypot(0.1, 0.2 * w), &[0.01, 1.0, 30.0], &[2.0]).expect("grows");
        assert!((found.floor - 0.1).abs() < 1e-6 && (found.slope - 0.2).abs() < 1e-9, "{found:?}");
        assert_eq!(shape(|_| 0.1, &outputs, &outputs), None);
        assert_eq!(shape(|w| 0.1 * w, &[2.0; 9], &[2.0]), None);
        assert_eq!(shape(|w| f64::hypot(1.0, 1e-4 * w), &[0.1, 1.0, 3.0], &[2.0]), None);
        let found = shape(|w| 0.1 * w.abs(), &[-3.0, 1.0, 2.0], &[3.0, -4.0]).expect("it grows");
        assert!((found.floor - 0.1 * 12.5_f64.sqrt()).abs() < 1e-9, "{found:?}");
    }

    /// For proportional noise it is the log-normal likelihood; for all shapes its slopes agree with differences, and
    /// the scatter of these is the information.
    #[test]
    fn noise_in_proportion_is_log_normal_and_slopes_are_those_of_differences() {
        let shape = NoiseShape { floor: 0.0, slope: 0.25 };
        for sign in [1.0, -1.0] {
            let seen =
                PredictedReading { measured: 2.3 * sign, simulated: 1.9 * sign, sigma: 0.2 * 1.9 };
            let term = shape.term(seen, NORMAL);
            let log = PredictedReading { measured: 2.3, simulated: 1.9, sigma: 0.2 };
            let wanted = log.term(Distribution::LogNormal);
            assert!((term.cost - wanted.cost).abs() < 1e-12, "{sign}");
            assert!((term.logarithm - wanted.logarithm).abs() < 1e-12, "{sign}");
        }
        for shape in [shape, NoiseShape { floor: 0.4, slope: 0.25 }] {
            for distribution in [NORMAL, Distribution::Student { freedom: 4.0 }] {
                // σ = c (a + b w)-like: both depend on z.
                let at = |z: f64| {
                    let simulated = 1.9 + z;
                    PredictedReading {
                        measured: 2.3,
                        simulated,
                        sigma: 0.3 * (0.2 + simulated.powi(2)),
                    }
                };
                let deviance = |z: f64| {
                    let term = shape.term(at(z), distribution);
                    term.cost + term.logarithm
                };
                let h = 1e-5;
                let wanted = 0.5 * (deviance(h) - deviance(-h)) / (2.0 * h);
                let seen = at(0.0);
                let of_sigma = 0.3 * 2.0 * 1.9 - seen.sigma * shape.growth(seen.simulated);
                let (mut gradient, mut information) = ([0.0], [0.0]);
                let term = shape.term(seen, distribution);
                term.add(&[1.0], &[of_sigma], &mut gradient, &mut information);
                assert!((gradient[0] - wanted).abs() < 1e-7, "{shape:?} {distribution:?}");
                assert!(information[0] > 0.0);
            }
        }
    }
}
