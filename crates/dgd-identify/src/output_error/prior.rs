//! Priors of parameters, as terms of −2 ln of the posterior density.
//!
//! A prior is the density of a linear combination q = Σ wᵢ pᵢ; that of one parameter has one weight, 1.
//!
//! | | D(q) = −2 ln of the density, without its factor | ½ D′ | replacement of ½ D″ |
//! |---|---|---|---|
//! | normal | r², r = (q − m)/s | r/s | 1/s² |
//! | log-normal | r² + 2 ln q, r = ln(q/m)/s | (r/s + 1)/q | 1/(s q)² |
//! | Laplace's | 2 \|q − m\|/b | ±1/b | 1/(b \|q − m\|) for a step, 1/b² for a covariance |
//! | gamma | 2 q/b − 2 (k − 1) ln q | 1/b − (k − 1)/q | (k − 1)/q² |
//!
//! With cᵢ = wᵢ ∂pᵢ/∂zᵢ for the variables zᵢ, the gradient is ½ D′ c and the curvature ½ D″ c cᵀ. Fixed parameters only
//! enter q.
//!
//! The estimate maximises the density of the parameters themselves, whatever scale they are searched on. A uniform
//! prior is given by bounds. At the kink of Laplace's density steps are those of reweighted squares: they end at it, or
//! leave it.

use dgd_runtime::signature::{PriorDensity, Signature};
use nalgebra::{DMatrix, DVector};

use crate::variables::FitVariables;

/// Within this fraction of the scale around its median, Laplace's density is at its kink.
const AT_KINK: f64 = 1e-9;

/// The prior of a linear combination of parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// Positions of its parameters, each once, and their weights.
    pub weights: Vec<(usize, f64)>,
    /// The density of the combination, SI.
    pub density: PriorDensity,
}

/// The contribution of a prior at a point, in terms of the variables of its parameters.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PriorTerm {
    /// Squared residuals.
    pub cost: f64,
    /// The other terms.
    pub logarithm: f64,
    /// Positions of the variables, and derivatives of the combination with respect to each; relative to the standard
    /// deviation for a normal prior.
    slopes: Vec<(usize, f64)>,
    /// Half the derivative of the sum of both.
    by_combination: f64,
    /// Curvature for steps.
    curvature: f64,
    /// Information about the combination.
    information: f64,
}

impl Prior {
    /// The prior of one parameter, SI.
    pub fn for_parameter(parameter: usize, density: PriorDensity) -> Self {
        Self { weights: vec![(parameter, 1.0)], density }
    }

    /// A normal prior of one parameter, SI.
    pub fn normal(parameter: usize, mean: f64, std: f64) -> Self {
        Self::for_parameter(parameter, PriorDensity::Normal { mean, std })
    }

    /// Mean and standard deviation of a normal prior.
    pub fn as_normal(&self) -> Option<(f64, f64)> {
        match self.density {
            PriorDensity::Normal { mean, std } => Some((mean, std)),
            _ => None,
        }
    }

    /// Its parameter, if it has only one.
    pub(crate) fn parameter(&self) -> Option<usize> {
        match self.weights[..] {
            [(parameter, 1.0)] => Some(parameter),
            _ => None,
        }
    }

    /// The value of the combination.
    pub fn value(&self, p: &[f64]) -> f64 {
        self.weights.iter().map(|(i, weight)| weight * p[*i]).sum()
    }

    /// The derivative of the combination with respect to a parameter.
    pub fn weight(&self, parameter: usize) -> f64 {
        let own_weights = self.weights.iter().filter(|(i, _)| *i == parameter);
        own_weights.map(|(_, weight)| *weight).sum()
    }

    /// Whether it contains a free parameter.
    pub fn concerns(&self, is_free: impl Fn(usize) -> bool) -> bool {
        self.weights.iter().any(|(i, _)| is_free(*i))
    }

    /// The names of its parameters in messages.
    pub fn names(&self, signature: &Signature) -> String {
        let name = |(i, _): &(usize, f64)| format!("`{}`", signature.parameters[*i].name);
        self.weights.iter().map(name).collect::<Vec<_>>().join(", ")
    }

    /// At the parameters p, whose variables have the values z; `None` if none of its parameters is free.
    pub(crate) fn term(&self, variables: &FitVariables, p: &[f64], z: &[f64]) -> Option<PriorTerm> {
        let slopes: Vec<(usize, f64)> = self
            .weights
            .iter()
            .filter_map(|(parameter, weight)| {
                let i = variables.parameter(*parameter)?;
                Some((i, weight * variables.all[i].slope(z[i])))
            })
            .collect();
        (!slopes.is_empty()).then(|| self.along(self.value(p), slopes))
    }

    /// The term at a value of the combination.
    fn along(&self, q: f64, mut slopes: Vec<(usize, f64)>) -> PriorTerm {
        let [cost, logarithm, by_combination, curvature, information] = match self.density {
            PriorDensity::Normal { mean, std } => {
                let r = (q - mean) / std;
                for (_, slope) in &mut slopes {
                    *slope /= std;
                }
                [r * r, 0.0, r, 1.0, 1.0]
            }
            PriorDensity::LogNormal { median, sigma } => {
                let r = (q / median).ln() / sigma;
                let known = (sigma * q).powi(-2);
                [r * r, 2.0 * q.ln(), (r / sigma + 1.0) / q, known, known]
            }
            PriorDensity::Uniform { .. } => [0.0; 5],
            PriorDensity::Laplace { median, scale } => {
                let off = q - median;
                let is_at_kink = off.abs() <= AT_KINK * scale;
                let by_q = if is_at_kink { 0.0 } else { off.signum() / scale };
                let curvature = 1.0 / (scale * off.abs().max(AT_KINK * scale));
                [0.0, 2.0 * off.abs() / scale, by_q, curvature, scale.powi(-2)]
            }
            PriorDensity::Gamma { shape, scale } => {
                let above = shape - 1.0;
                let known = above / (q * q);
                // At shape 1 the logarithm is absent, even at q = 0.
                let logarithm = if above == 0.0 { 0.0 } else { 2.0 * above * q.ln() };
                [0.0, 2.0 * q / scale - logarithm, 1.0 / scale - above / q, known, known]
            }
        };
        PriorTerm { cost, logarithm, slopes, by_combination, curvature, information }
    }
}

impl PriorTerm {
    /// Adds half the derivative.
    pub(crate) fn add_gradient(&self, gradient: &mut DVector<f64>) {
        for (i, slope) in &self.slopes {
            gradient[*i] += slope * self.by_combination;
        }
    }

    /// Adds the curvature for steps.
    pub(crate) fn add_curvature(&self, h: &mut DMatrix<f64>) {
        self.add(h, |squares| squares * self.curvature);
    }

    /// Adds the information about the variables.
    pub(crate) fn add_information(&self, h: &mut DMatrix<f64>) {
        self.add(h, |squares| squares * self.information);
    }

    /// Replaces the curvature for steps by the information.
    pub(crate) fn put_information(&self, h: &mut DMatrix<f64>) {
        if self.information != self.curvature {
            self.add(h, |squares| squares * self.information - squares * self.curvature);
        }
    }

    fn add(&self, h: &mut DMatrix<f64>, part: impl Fn(f64) -> f64) {
        for (i, of_row) in &self.slopes {
            for (j, of_column) in &self.slopes {
                h[(*i, *j)] += part(of_row * of_column);
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
            // q = 3 e^x + 1/2 y
            let prior = Prior { weights: vec![(0, 3.0), (1, 0.5)], density };
            let at = |x: f64, y: f64| {
                let slopes = vec![(0, 3.0 * x.exp()), (1, 0.5)];
                prior.along(prior.value(&[x.exp(), y]), slopes)
            };
            let deviance = |x: f64, y: f64| at(x, y).cost + at(x, y).logarithm;
            let (x, y, h) = (-0.8, 0.4, 1e-5);
            let mut gradient = DVector::zeros(2);
            at(x, y).add_gradient(&mut gradient);
            let by_x = (deviance(x + h, y) - deviance(x - h, y)) / (4.0 * h);
            let by_y = (deviance(x, y + h) - deviance(x, y - h)) / (4.0 * h);
            assert!((gradient[0] - by_x).abs() < 1e-8, "{density:?}: {by_x}");
            assert!((gradient[1] - by_y).abs() < 1e-8, "{density:?}: {by_y}");
        }
    }

    #[test]
    fn a_combination_is_known_along_itself_alone() {
        let prior = Prior {
            weights: vec![(0, 1.0), (2, -2.0)],
            density: PriorDensity::Normal { mean: 0.0, std: 0.5 },
        };
        let mut h = DMatrix::zeros(3, 3);
        prior.along(0.3, vec![(0, 1.0), (2, -2.0)]).add_curvature(&mut h);
        assert_eq!(
            h,
            DMatrix::from_row_slice(3, 3, &[4.0, 0.0, -8.0, 0.0, 0.0, 0.0, -8.0, 0.0, 16.0])
        );
    }
}
