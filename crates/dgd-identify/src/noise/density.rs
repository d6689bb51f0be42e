//! The likelihood of readings with a computed distribution: σ by a formula, log-normal, Student's.
//!
//! ```text
//!   D = Σ −2 ln of the density of a reading y where the model has w and σ
//!
//!   normal       r = (w − y)/σ          r² + ln 2πσ²
//!   log-normal   r = (ln w − ln y)/σ    r² + ln 2πσ² + 2 ln y
//!   Student's    r = (w − y)/σ          (ν + 1) ln(1 + r²/ν) + 2 ln σ + 2 ln [√(νπ) Γ(ν/2)/Γ((ν + 1)/2)]
//! ```
//!
//! The normal equations get its exact gradient, and instead of JᵀJ the expected information, which has no terms that
//! mix w and σ:
//!
//! | | ½ ∂D/∂w | ½ ∂D/∂σ | of w | of σ |
//! |---|---|---|---|---|
//! | normal | r/σ | (1 − r²)/σ | 1/σ² | 2/σ² |
//! | log-normal | r/(σ w) | (1 − r²)/σ | 1/(σ w)² | 2/σ² |
//! | Student's | c r/σ, c = (ν + 1)/(ν + r²) | (1 − c r²)/σ | (ν + 1)/(ν + 3)/σ² | 2ν/(ν + 3)/σ² |
//!
//! Lange, Little, Taylor, Robust statistical modeling using the t distribution, J. Am. Stat. Assoc. 84 (1989)
//! 881, appendix B, has the last row.

use std::f64::consts::{PI, TAU};

use dgd_runtime::signature::{Density, Distribution};
use dgd_runtime::special::lgamma;

use crate::error::TrialFailure;
use crate::keep_by_fields;
use crate::noise::loss::ScaledLoss;
use crate::noise::shape::NoiseShape;

/// How samples of an output contribute to the cost.
#[derive(Debug, Clone, Copy)]
pub(crate) enum SampleWeighting<'a> {
    /// By their squares, independently of σ.
    Squares,
    /// By a loss other than squares.
    Robust(ScaledLoss),
    /// By their likelihood; σ is computed by the output at a position of the density.
    Density(Density),
    /// By their likelihood, with a σ for each sample time.
    Rows(&'a [f64], Distribution),
    /// By their likelihood in the scale in which σ is uniform.
    Stabilised(Density, NoiseShape),
}

impl SampleWeighting<'_> {
    /// The distribution of samples that contribute by their likelihood.
    pub(crate) fn distribution(self) -> Option<Distribution> {
        match self {
            Self::Squares | Self::Robust(_) => None,
            Self::Density(Density { distribution, .. })
            | Self::Rows(_, distribution)
            | Self::Stabilised(Density { distribution, .. }, _) => Some(distribution),
        }
    }

    /// σ of sample k, given the outputs `w`.
    pub(crate) fn deviation(self, k: usize, w: &[f64]) -> f64 {
        match self {
            Self::Squares | Self::Robust(_) => f64::NAN,
            Self::Density(density) | Self::Stabilised(density, _) => w[density.deviation],
            Self::Rows(deviations, _) => deviations[k],
        }
    }

    /// The scale in which σ is uniform, if samples contribute in that scale.
    pub(crate) fn shape(self) -> Option<NoiseShape> {
        match self {
            Self::Stabilised(_, shape) => Some(shape),
            Self::Squares | Self::Robust(_) | Self::Density(_) | Self::Rows(..) => None,
        }
    }

    /// The output that computes σ.
    pub(crate) fn computed_by(self) -> Option<usize> {
        match self {
            Self::Density(density) | Self::Stabilised(density, _) => Some(density.deviation),
            Self::Squares | Self::Robust(_) | Self::Rows(..) => None,
        }
    }
}

/// Defect of a simulated sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SampleDefect {
    /// It is not finite.
    NotFinite,
    /// Its standard deviation is not a positive number.
    Deviation(f64),
    /// Its logarithm is needed, but it is not positive.
    Logarithm(f64),
}

impl SampleDefect {
    /// The corresponding failure of a trial.
    pub(crate) fn failure(self, output: String, t: f64) -> TrialFailure {
        match self {
            Self::NotFinite => TrialFailure::OutputNotFinite { output, t },
            Self::Deviation(sigma) => TrialFailure::Deviation { output, t, sigma },
            Self::Logarithm(value) => TrialFailure::Logarithm { output, t, value },
        }
    }
}

/// A reading and its prediction by the model.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PredictedReading {
    pub measured: f64,
    pub simulated: f64,
    pub sigma: f64,
}

/// −2 ln of the density of a reading, and its derivatives, defined as in the module documentation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DensityTerm {
    /// The terms that depend on the residual.
    pub cost: f64,
    /// The other terms.
    pub logarithm: f64,
    by_output: f64,
    by_deviation: f64,
    of_output: f64,
    of_deviation: f64,
}

impl PredictedReading {
    /// Its defect, if any.
    pub(crate) fn spoilt(self, distribution: Distribution) -> Option<SampleDefect> {
        let Self { simulated, sigma, .. } = self;
        if !simulated.is_finite() {
            return Some(SampleDefect::NotFinite);
        }
        if !(sigma > 0.0 && sigma.is_finite()) {
            return Some(SampleDefect::Deviation(sigma));
        }
        let wants_logarithm = distribution == Distribution::LogNormal;
        (wants_logarithm && simulated <= 0.0).then_some(SampleDefect::Logarithm(simulated))
    }

    /// Simulated less measured over σ; logarithms for log-normal noise.
    pub(crate) fn residual(self, distribution: Distribution) -> f64 {
        let Self { measured, simulated, sigma } = self;
        match distribution {
            Distribution::Normal | Distribution::Student { .. } => (simulated - measured) / sigma,
            Distribution::LogNormal => (simulated.ln() - measured.ln()) / sigma,
        }
    }

    /// Its contribution.
    pub(crate) fn term(self, distribution: Distribution) -> DensityTerm {
        let Self { measured, simulated, sigma } = self;
        let r = self.residual(distribution);
        match distribution {
            Distribution::Normal | Distribution::Student { .. } => {
                DensityTerm::from_residual(r, 1.0 / sigma, sigma, distribution)
            }
            Distribution::LogNormal => {
                let term =
                    DensityTerm::from_residual(r, 1.0 / (sigma * simulated), sigma, distribution);
                DensityTerm { logarithm: term.logarithm + 2.0 * measured.ln(), ..term }
            }
        }
    }
}

impl DensityTerm {
    /// The term of a residual r with a normal or Student's distribution: `slope` is ∂r/∂w, and r is proportional to
    /// 1/σ.
    pub(super) fn from_residual(
        r: f64,
        slope: f64,
        sigma: f64,
        distribution: Distribution,
    ) -> Self {
        let Distribution::Student { freedom } = distribution else {
            return DensityTerm {
                cost: r * r,
                logarithm: (TAU * sigma * sigma).ln(),
                by_output: r * slope,
                by_deviation: (1.0 - r * r) / sigma,
                of_output: slope * slope,
                of_deviation: 2.0 / (sigma * sigma),
            };
        };
        let weight = (freedom + 1.0) / (freedom + r * r);
        let rest =
            0.5 * (freedom * PI).ln() + lgamma(0.5 * freedom) - lgamma(0.5 * (freedom + 1.0));
        let variance = sigma * sigma;
        DensityTerm {
            cost: (freedom + 1.0) * (r * r / freedom).ln_1p(),
            logarithm: 2.0 * (sigma.ln() + rest),
            by_output: weight * r * slope,
            by_deviation: (1.0 - weight * r * r) / sigma,
            of_output: (freedom + 1.0) / (freedom + 3.0) * slope * slope,
            of_deviation: 2.0 * freedom / (freedom + 3.0) / variance,
        }
    }

    /// The term for readings with the standard deviation `other`, whose residual was scaled by `sigma`.
    pub(super) fn with_spread(self, other: f64, sigma: f64) -> Self {
        DensityTerm { logarithm: self.logarithm + 2.0 * (other / sigma).ln(), ..self }
    }
}

impl DensityTerm {
    /// Adds the derivatives: `slopes` are those of the output, `of_sigma` those of σ.
    pub(crate) fn add(
        self,
        slopes: &[f64],
        of_sigma: &[f64],
        gradient: &mut [f64],
        information: &mut [f64],
    ) {
        let n = slopes.len();
        for (i, (a, b)) in slopes.iter().zip(of_sigma).enumerate() {
            gradient[i] += self.by_output * a + self.by_deviation * b;
            let (a, b) = (self.of_output * a, self.of_deviation * b);
            let row = information[i * n..=i * n + i].iter_mut();
            for (sum, (c, d)) in row.zip(slopes.iter().zip(of_sigma)) {
                *sum += a * c + b * d;
            }
        }
    }
}

/// Contributions of the samples of an output by their likelihood.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct LikelihoodSums {
    /// The terms of −2 ln of the likelihood that depend on residuals.
    pub cost: f64,
    /// The other terms.
    pub logarithms: f64,
    /// Sum of the variances of readings; (σ w)² for log-normal ones.
    pub variances: f64,
}

keep_by_fields!(LikelihoodSums { cost, logarithms, variances });

impl LikelihoodSums {
    /// Adds a sample.
    pub(crate) fn add(
        &mut self,
        seen: PredictedReading,
        term: DensityTerm,
        distribution: Distribution,
    ) {
        self.cost += term.cost;
        self.logarithms += term.logarithm;
        let scale = match distribution {
            Distribution::Normal | Distribution::Student { .. } => seen.sigma,
            Distribution::LogNormal => seen.sigma * seen.simulated,
        };
        self.variances += scale * scale;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Distribution; 3] =
        [Distribution::Normal, Distribution::LogNormal, Distribution::Student { freedom: 4.0 }];

    fn deviance(seen: PredictedReading, distribution: Distribution) -> f64 {
        let term = seen.term(distribution);
        term.cost + term.logarithm
    }

    /// ∫ exp(−D/2) dy = 1, by the midpoint rule in a variable with thin tails.
    #[test]
    fn densities_integrate_to_one() {
        for distribution in ALL {
            let (n, width) = (40_000, 12.0);
            let h = 2.0 * width / f64::from(n);
            let sum: f64 = (0..n)
                .map(|k| {
                    // y = 2 + sinh x, or exp x if it must be positive.
                    let x = -width + (f64::from(k) + 0.5) * h;
                    let (measured, slope) = match distribution {
                        Distribution::LogNormal => (x.exp(), x.exp()),
                        _ => (2.0 + x.sinh(), x.cosh()),
                    };
                    let seen = PredictedReading { measured, simulated: 2.0, sigma: 0.3 };
                    (-0.5 * deviance(seen, distribution)).exp() * slope * h
                })
                .sum();
            assert!((sum - 1.0).abs() < 1e-8, "{distribution:?}: {sum}");
        }
    }

    #[test]
    fn gradients_are_those_of_differences() {
        let seen = PredictedReading { measured: 2.3, simulated: 1.9, sigma: 0.25 };
        for distribution in ALL {
            let (mut gradient, mut information) = ([0.0; 2], [0.0; 4]);
            let term = seen.term(distribution);
            term.add(&[1.0, 0.0], &[0.0, 1.0], &mut gradient, &mut information);
            let h = 1e-5;
            let by = |of: &dyn Fn(f64) -> PredictedReading| {
                let [after, before] = [h, -h].map(|h| deviance(of(h), distribution));
                0.5 * (after - before) / (2.0 * h)
            };
            let by_output = by(&|h| PredictedReading { simulated: seen.simulated + h, ..seen });
            let by_deviation = by(&|h| PredictedReading { sigma: seen.sigma + h, ..seen });
            assert!((gradient[0] - by_output).abs() < 1e-7, "{distribution:?}");
            assert!((gradient[1] - by_deviation).abs() < 1e-7, "{distribution:?}");
            assert_eq!(information[2], 0.0);
        }
    }

    /// The information is the expectation of the squared gradient, by the integration rule above.
    #[test]
    fn the_information_is_what_gradients_scatter_by() {
        for distribution in ALL {
            let (n, width) = (40_000, 12.0);
            let h = 2.0 * width / f64::from(n);
            let (mut found, mut wanted) = ([0.0; 2], [0.0; 2]);
            for k in 0..n {
                let x = -width + (f64::from(k) + 0.5) * h;
                let (measured, slope) = match distribution {
                    Distribution::LogNormal => (x.exp(), x.exp()),
                    _ => (2.0 + x.sinh(), x.cosh()),
                };
                let seen = PredictedReading { measured, simulated: 2.0, sigma: 0.3 };
                let term = seen.term(distribution);
                let weight = (-0.5 * (term.cost + term.logarithm)).exp() * slope * h;
                found[0] += weight * term.by_output.powi(2);
                found[1] += weight * term.by_deviation.powi(2);
                wanted = [term.of_output, term.of_deviation];
            }
            for (found, wanted) in found.into_iter().zip(wanted) {
                assert!((found / wanted - 1.0).abs() < 1e-8, "{distribution:?}: {found} {wanted}");
            }
        }
    }
}
