//! What is known of a parameter beforehand, as a part of −2 ln of the posterior density.
//!
//! | | D(p) = −2 ln of the density, without its factor | ½ D′ | in the place of ½ D″ |
//! |---|---|---|---|
//! | normal | r², r = (p − m)/s | r/s | 1/s² |
//! | log-normal | r² + 2 ln p, r = ln(p/m)/s | (r/s + 1)/p | 1/(s p)² |
//! | Laplace's | 2 \|p − m\|/b | ±1/b | 1/(b \|p − m\|) for a step, 1/b² for a covariance |
//! | gamma | 2 p/b − 2 (k − 1) ln p | 1/b − (k − 1)/p | (k − 1)/p² |
//!
//! The estimate is where the density of the parameters themselves is largest, whatever scale they are searched on. A
//! uniform prior is bounds. At the kink of Laplace's density steps are those of reweighted squares: they end
//! at it, or leave it.

use dgd_runtime::signature::PriorDensity;

/// Nearer to its median than this part of the scale, Laplace's density is at its kink.
const AT_KINK: f64 = 1e-9;

/// What is known of a parameter beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Position of the parameter.
    pub parameter: usize,
    /// Its density, SI.
    pub density: PriorDensity,
}

/// What it adds at a point, by the variable of the parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PriorTerm {
    /// Squares.
    pub cost: f64,
    /// All the rest.
    pub logarithm: f64,
    /// Half the derivative of both.
    pub gradient: f64,
    /// What makes steps.
    pub curvature: f64,
    /// What is known of the variable.
    pub information: f64,
}

impl Prior {
    /// A normal one, SI.
    pub fn normal(parameter: usize, mean: f64, std: f64) -> Self {
        Self { parameter, density: PriorDensity::Normal { mean, std } }
    }

    /// Mean and standard deviation of a normal one.
    pub fn as_normal(self) -> Option<(f64, f64)> {
        match self.density {
            PriorDensity::Normal { mean, std } => Some((mean, std)),
            _ => None,
        }
    }

    /// At a value, which changes with the variable by `slope`.
    pub(crate) fn term(self, p: f64, slope: f64) -> PriorTerm {
        let of = |cost, logarithm, by_p: f64, curvature: f64, information: f64| PriorTerm {
            cost,
            logarithm,
            gradient: slope * by_p,
            curvature: slope * slope * curvature,
            information: slope * slope * information,
        };
        match self.density {
            PriorDensity::Normal { mean, std } => {
                let (r, slope) = ((p - mean) / std, slope / std);
                let curvature = slope * slope;
                PriorTerm {
                    cost: r * r,
                    logarithm: 0.0,
                    gradient: slope * r,
                    curvature,
                    information: curvature,
                }
            }
            PriorDensity::LogNormal { median, sigma } => {
                let r = (p / median).ln() / sigma;
                let known = (sigma * p).powi(-2);
                of(r * r, 2.0 * p.ln(), (r / sigma + 1.0) / p, known, known)
            }
            PriorDensity::Uniform { .. } => of(0.0, 0.0, 0.0, 0.0, 0.0),
            PriorDensity::Laplace { median, scale } => {
                let off = p - median;
                let is_at_kink = off.abs() <= AT_KINK * scale;
                let by_p = if is_at_kink { 0.0 } else { off.signum() / scale };
                let curvature = 1.0 / (scale * off.abs().max(AT_KINK * scale));
                of(0.0, 2.0 * off.abs() / scale, by_p, curvature, scale.powi(-2))
            }
            PriorDensity::Gamma { shape, scale } => {
                let above = shape - 1.0;
                let known = above / (p * p);
                // At shape 1 the logarithm has no part, at p = 0 neither.
                let logarithm = if above == 0.0 { 0.0 } else { 2.0 * above * p.ln() };
                of(0.0, 2.0 * p / scale - logarithm, 1.0 / scale - above / p, known, known)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_are_those_of_differences() {
        for density in [
            PriorDensity::Normal { mean: 2.0, std: 0.4 },
            PriorDensity::LogNormal { median: 2.0, sigma: 0.4 },
            PriorDensity::Uniform { lower: 0.0, upper: 2.0 },
            PriorDensity::Laplace { median: 2.0, scale: 0.4 },
            PriorDensity::Gamma { shape: 3.0, scale: 0.4 },
            PriorDensity::Gamma { shape: 1.0, scale: 0.4 },
        ] {
            let prior = Prior { parameter: 0, density };
            // By ln p.
            let at = |x: f64| prior.term(x.exp(), x.exp());
            let deviance = |x: f64| at(x).cost + at(x).logarithm;
            let (x, h) = (0.3, 1e-5);
            let slope = (deviance(x + h) - deviance(x - h)) / (4.0 * h);
            assert!((at(x).gradient - slope).abs() < 1e-8, "{density:?}: {slope}");
        }
    }
}
