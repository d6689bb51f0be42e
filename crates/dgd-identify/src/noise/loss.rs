//! Loss functions: the contribution of an error to the sum that a fit minimises.
//!
//! ```text
//!   r = e/σ,   Σ ρ(r) → min,   ψ = ½ ρ′,   w = ψ/r
//! ```
//!
//! | loss | ρ(r) | w(r) | c |
//! |---|---|---|---|
//! | squares | r² | 1 | |
//! | Huber | r² up to c, 2c\|r\| − c² beyond | 1 up to c, c/\|r\| beyond | 1.345 |
//! | Cauchy | c² ln(1 + r²/c²) | 1/(1 + r²/c²) | 2.3849 |
//! | Tukey | c²/3 (1 − (1 − r²/c²)³) up to c, c²/3 beyond | (1 − r²/c²)² up to c, 0 beyond | 4.6851 |
//!
//! With these c the variance of an estimate from normal noise is 1/0.95 of that with squares. Steps are those of
//! weighted least squares, Σ w s sᵀ; the covariance is Huber's,
//!
//! ```text
//!   H = Σ_outputs mean ψ′/κ Σ s sᵀ/σ²,   G = Σ_outputs mean ψ² Σ s sᵀ/σ² · N/(N − n),   H⁻¹ G H⁻¹
//!   κ = 1 + n/N var ψ′/(mean ψ′)²
//! ```
//!
//! with s = ∂e/∂z over all N samples and n variables; an estimated σ is the median of |e| over that of a normal
//! deviate. With Cauchy's and Tukey's loss, which ignore remote outliers, a fit starts at the result with Huber's loss,
//! and keeps its σ.
//!
//! Sources: Huber, Robust Statistics (1981) §7; Yohai, High breakdown-point and high efficiency robust
//! estimates for regression, Ann. Stat. 15 (1987) 642; constants: Holland, Welsch, Robust regression
//! using iteratively reweighted least-squares, Commun. Stat. A 6 (1977) 813.

use dgd_runtime::signature::choices;

use crate::keep_by_fields;

/// The median of |r| of a normal deviate.
const NORMAL_MEDIAN: f64 = 0.674_489_750_196_081_7;

/// A sample with less weight than this counts as downweighted.
const LIGHT: f64 = 0.5;

choices! {
    /// The contribution of an error to the sum that a fit minimises, as a function of r = e/σ, the residual in standard
    /// deviations.
    pub enum Loss {
        /// Squared residual: the most precise with Gaussian noise.
        Squares = "squares",
        /// Squared up to 1.345 standard deviations, linear beyond: limits the pull of outliers.
        Huber = "huber",
        /// Logarithmic: the further away an outlier, the less it pulls.
        Cauchy = "cauchy",
        /// Constant beyond 4.685 standard deviations: residuals further away have no influence.
        Tukey = "tukey",
    }
}

/// ρ and its derivatives at a residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LossAt {
    /// ρ(r).
    pub value: f64,
    /// w = ρ′/2r.
    pub weight: f64,
    /// ψ′ = ½ ρ″.
    pub curvature: f64,
}

impl Loss {
    /// Its tuning constant, in σ; `None` for squares.
    pub fn tuning(self) -> Option<f64> {
        match self {
            Self::Squares => None,
            Self::Huber => Some(1.345),
            Self::Cauchy => Some(2.3849),
            Self::Tukey => Some(4.6851),
        }
    }

    /// The share of normal noise with a weight below one half: 2 (1 − Φ(r)) with w(r) = ½.
    pub fn light_share(self) -> f64 {
        match self {
            Self::Squares => 0.0,
            Self::Huber => 0.007_145,
            Self::Cauchy => 0.017_084,
            Self::Tukey => 0.011_227,
        }
    }

    /// Whether the influence of errors eventually decreases, so that there are several minima and none can be found
    /// from far away.
    pub(crate) fn is_redescending(self) -> bool {
        matches!(self, Self::Cauchy | Self::Tukey)
    }

    /// Its value and derivatives at r.
    pub fn evaluate(self, r: f64) -> LossAt {
        let Some(c) = self.tuning() else {
            return LossAt { value: r * r, weight: 1.0, curvature: 1.0 };
        };
        let (size, u) = (r.abs(), (r / c).powi(2));
        match self {
            Self::Squares => unreachable!("squares have no tuning"),
            Self::Huber if size <= c => LossAt { value: r * r, weight: 1.0, curvature: 1.0 },
            Self::Huber => LossAt { value: c * (2.0 * size - c), weight: c / size, curvature: 0.0 },
            Self::Cauchy => LossAt {
                value: c * c * u.ln_1p(),
                weight: 1.0 / (1.0 + u),
                curvature: (1.0 - u) / (1.0 + u).powi(2),
            },
            Self::Tukey if u <= 1.0 => LossAt {
                value: c * c / 3.0 * (1.0 - (1.0 - u).powi(3)),
                weight: (1.0 - u).powi(2),
                curvature: (1.0 - u) * (1.0 - 5.0 * u),
            },
            Self::Tukey => LossAt { value: c * c / 3.0, weight: 0.0, curvature: 0.0 },
        }
    }

    /// With an output's σ; `None` for squares, whose sums do not depend on σ.
    pub(crate) fn scaled(self, sigma: Option<f64>) -> Option<ScaledLoss> {
        (self != Self::Squares).then_some(ScaledLoss { loss: self, sigma: sigma? })
    }
}

/// A loss other than squares, for the errors of an output with this σ.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ScaledLoss {
    loss: Loss,
    sigma: f64,
}

/// Contributions of samples for a loss other than squares, scaled to squares of the output's SI unit like the sums of
/// squares.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct RobustWeighting {
    /// Σ σ² ρ(e/σ).
    pub loss: f64,
    /// Σ ψ′(e/σ).
    pub curvature: f64,
    /// Σ ψ′²(e/σ).
    pub curvature_squares: f64,
    /// Σ ψ²(e/σ).
    pub influence: f64,
    /// Downweighted samples.
    pub light: usize,
    /// Σ s sᵀ, without weights.
    pub information: Vec<f64>,
}

keep_by_fields!(RobustWeighting {
    loss,
    curvature,
    curvature_squares,
    influence,
    light,
    information
});

impl RobustWeighting {
    pub(crate) fn zeros(n: usize) -> Self {
        Self { information: vec![0.0; n * n], ..Self::default() }
    }

    /// Adds an error and its slopes, and returns the weight of its sample.
    pub(crate) fn add(&mut self, e: f64, slopes: &[f64], scaled: ScaledLoss) -> f64 {
        let r = e / scaled.sigma;
        let LossAt { value, weight, curvature } = scaled.loss.evaluate(r);
        self.loss += value * scaled.sigma.powi(2);
        self.curvature += curvature;
        self.curvature_squares += curvature * curvature;
        self.influence += (weight * r).powi(2);
        self.light += usize::from(weight < LIGHT);
        if slopes.iter().all(|slope| slope.is_finite()) {
            let n = slopes.len();
            for (i, a) in slopes.iter().enumerate() {
                let row = &mut self.information[i * n..];
                for (sum, b) in row.iter_mut().zip(&slopes[..=i]) {
                    *sum += a * b;
                }
            }
        }
        weight
    }
}

/// σ for which the median absolute error is that of a normal deviate; `None` without errors.
pub(crate) fn scale(mut sizes: Vec<f64>) -> Option<f64> {
    if sizes.is_empty() {
        return None;
    }
    let middle = sizes.len() / 2;
    let (below, upper, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    let upper = *upper;
    // For an even number, the mean of the two middle ones.
    let lower = below.iter().copied().fold(0.0, f64::max);
    let median = if sizes.len().is_multiple_of(2) { 0.5 * (lower + upper) } else { upper };
    Some(median / NORMAL_MEDIAN)
}
