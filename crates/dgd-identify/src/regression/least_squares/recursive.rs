//! Recursive least squares, optionally with forgetting.
//!
//! ```text
//!   discrete:    ε = z − φᵀθ,  P⁻¹ ← λ P⁻¹ + φφᵀ/m²,  θ ← θ + P φ ε/m²
//!   continuous:  ε = (z − φᵀθ)/m²,  θ̇ = P ε φ,  Ṗ = βP − P φφᵀ/m² P
//!   m² = 1 + n_s²;  while P would grow beyond ‖P‖ = R₀ it is constant
//! ```
//!
//! Both store R of P⁻¹ = RᵀR and rotate new rows into it: P stays positive definite whatever the rounding errors, and β
//! = 0 gives the batch least squares solution. In continuous time P⁻¹ and P⁻¹θ obey linear equations,
//!
//! ```text
//!   d(P⁻¹)/dt = −β P⁻¹ + φφᵀ/m²
//!   d(P⁻¹(θ − θ₀))/dt = −β P⁻¹(θ − θ₀) + φ (z − φᵀθ₀)/m²
//! ```
//!
//! whose integrals over a step are sums over Gauss nodes, each a row; θ₀ is θ at its start. While P is constant, θ
//! follows θ̇ = P (b̄ − Ā θ) with the means of φφᵀ/m² and φz/m² over the step, exactly, so that no gain is too large
//! for a step.
//!
//! Ioannou, Sun, Robust Adaptive Control (1996), table 4.4; Haukanes 2015, table 3.1. Square roots:
//! Bierman, Factorization Methods for Discrete Sequential Estimation (1977), ch. V.

use dgd_runtime::signature::choices;
use nalgebra::{DMatrix, DVector};

use crate::regression::least_squares::solve;
use crate::regression::least_squares::triangle::RowTriangle;

/// Gauss nodes on (0, 1) and their weights, exact for polynomials of degree 7: Abramowitz, Stegun, table 25.4.
const NODES: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

choices! {
    /// The value of n_s² in m² = 1 + n_s².
    pub enum Normalisation {
        /// Zero: m is 1.
        None = "none",
        /// φᵀφ.
        Regressors = "regressors",
        /// φᵀPφ.
        Covariance = "covariance",
    }
}

/// Weighting of the past.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forgetting {
    /// β, 1/s: the weight of a sample of age t is e^(−βt).
    pub rate: f64,
    /// R₀, the limit on ‖P‖ (spectral norm) up to which P may grow; infinity for no limit.
    pub limit: f64,
    /// The normalisation.
    pub normalisation: Normalisation,
}

impl Default for Forgetting {
    fn default() -> Self {
        Self { rate: 0.0, limit: f64::INFINITY, normalisation: Normalisation::None }
    }
}

/// A row: z = φᵀθ.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RegressorSample {
    /// φ.
    pub phi: Vec<f64>,
    /// z.
    pub z: f64,
}

/// θ and the square root of its information.
#[derive(Debug, Clone)]
struct InformationRoot {
    theta: DVector<f64>,
    triangle: RowTriangle,
}

/// A row with its weight √(…)/m.
struct WeightedRow {
    sample: RegressorSample,
    weight: f64,
}

impl InformationRoot {
    fn new(theta: &[f64], covariance: &DMatrix<f64>) -> Option<Self> {
        let n = theta.len();
        assert_eq!(covariance.shape(), (n, n), "size of P₀");
        // P₀ = L Lᵀ, P₀⁻¹ = L⁻ᵀ L⁻¹
        let lower = covariance.clone().cholesky()?.l();
        let root = lower.solve_lower_triangular(&DMatrix::identity(n, n))?;
        let mut triangle = RowTriangle::new(n);
        for row in root.row_iter() {
            let row: Vec<f64> = row.iter().copied().collect();
            triangle.push(&row, 0.0, 1.0);
        }
        triangle.reduce();
        Some(Self { theta: DVector::from_column_slice(theta), triangle })
    }

    fn covariance(&self) -> DMatrix<f64> {
        let n = self.theta.len();
        let r = self.triangle.r();
        match r.solve_upper_triangular(&DMatrix::identity(n, n)) {
            Some(inverse) => &inverse * inverse.transpose(),
            None => DMatrix::from_diagonal_element(n, n, f64::INFINITY),
        }
    }

    /// ‖P‖ = 1/σ_min(R)².
    fn norm(&self) -> f64 {
        self.triangle.r().singular_values().min().powi(-2)
    }

    /// n_s².
    fn normalising(&self, phi: &[f64], normalisation: Normalisation) -> f64 {
        match normalisation {
            Normalisation::None => 0.0,
            Normalisation::Regressors => phi.iter().map(|phi| phi * phi).sum(),
            Normalisation::Covariance => {
                let phi = DVector::from_column_slice(phi);
                let half = self.triangle.r().transpose().solve_lower_triangular(&phi);
                half.map_or(f64::INFINITY, |half| half.norm_squared())
            }
        }
    }

    /// Rotates rows in after scaling all previous ones by `decay`, and moves θ; returns false without changes if ‖P‖
    /// would exceed the limit.
    fn take(&mut self, rows: &[WeightedRow], decay: f64, limit: f64) -> bool {
        let mut next = self.clone();
        next.triangle.scale(decay);
        for WeightedRow { sample, weight } in rows {
            let phi = DVector::from_column_slice(&sample.phi);
            next.triangle.push(&sample.phi, sample.z - phi.dot(&self.theta), *weight);
        }
        next.triangle.reduce();
        if limit.is_finite() {
            let norm = next.norm();
            if norm > limit && norm > self.norm() {
                return false;
            }
        }
        next.theta += solve(&next.triangle.r(), &next.triangle.zeta());
        next.triangle.forget_target();
        *self = next;
        true
    }
}

/// Recursive least squares, one sample at a time.
///
/// | name | symbol | shape | unit |
/// |---|---|---|---|
/// | `theta` | θ | n | of z over that of the regressor |
/// | `covariance` | P | n × n, symmetric | product of the units of two parameters, over that of z² |
///
/// # Source
///
/// Ljung, *System Identification: Theory for the User*, 2nd ed. (1999), §11.2.
#[derive(Debug, Clone)]
pub struct RecursiveLeastSquares {
    root: InformationRoot,
    forgetting: Forgetting,
    last: Option<f64>,
}

impl RecursiveLeastSquares {
    /// Starts with θ₀ and P₀; `None` if P₀ is not positive definite.
    pub fn new(theta: &[f64], covariance: &DMatrix<f64>, forgetting: Forgetting) -> Option<Self> {
        Some(Self { root: InformationRoot::new(theta, covariance)?, forgetting, last: None })
    }

    /// θ.
    pub fn theta(&self) -> &[f64] {
        self.root.theta.as_slice()
    }

    /// P.
    pub fn covariance(&self) -> DMatrix<f64> {
        self.root.covariance()
    }

    /// Processes z = φᵀθ at time t, s; returns the innovation z − φᵀθ with the previous estimate.
    ///
    /// The past is weighted by λ = e^(−β Δt), with Δt since the previous sample.
    pub fn update(&mut self, t: f64, sample: &RegressorSample) -> f64 {
        let Forgetting { rate, limit, normalisation } = self.forgetting;
        let step = self.last.replace(t).map_or(0.0, |last| t - last);
        let phi = DVector::from_column_slice(&sample.phi);
        let innovation = sample.z - phi.dot(&self.root.theta);
        let m2 = 1.0 + self.root.normalising(&sample.phi, normalisation);
        let row = WeightedRow { sample: sample.clone(), weight: m2.sqrt().recip() };
        if !self.root.take(&[row], (-0.5 * rate * step).exp(), limit) {
            // P is constant, and serves as the prior covariance of the sample: K = Pφ / (m² + φᵀPφ).
            let p_phi = self.root.covariance() * &phi;
            self.root.theta += &p_phi * (innovation / (m2 + phi.dot(&p_phi)));
        }
        innovation
    }
}

/// Recursive least squares in continuous time.
///
/// The rows are functions of time between samples, which the caller defines
/// ([`LambdaFilter`](crate::regression::LambdaFilter)).
#[derive(Debug, Clone)]
pub struct ContinuousLeastSquares {
    root: InformationRoot,
    forgetting: Forgetting,
    frozen: f64,
}

impl ContinuousLeastSquares {
    /// Starts with θ₀ and P₀; `None` if P₀ is not positive definite.
    pub fn new(theta: &[f64], covariance: &DMatrix<f64>, forgetting: Forgetting) -> Option<Self> {
        Some(Self { root: InformationRoot::new(theta, covariance)?, forgetting, frozen: 0.0 })
    }

    /// θ.
    pub fn theta(&self) -> &[f64] {
        self.root.theta.as_slice()
    }

    /// P.
    pub fn covariance(&self) -> DMatrix<f64> {
        self.root.covariance()
    }

    /// Time during which P was kept from growing, s.
    pub fn frozen(&self) -> f64 {
        self.frozen
    }

    /// Advances by h seconds; `rows` returns the rows after a part of these.
    pub fn advance(&mut self, h: f64, rows: &mut dyn FnMut(f64) -> Vec<RegressorSample>) {
        let Forgetting { rate, limit, normalisation } = self.forgetting;
        let mut weighted = Vec::new();
        let n = self.root.theta.len();
        let (mut a, mut b) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for (node, weight) in NODES {
            for sample in rows(node * h) {
                let m2 = 1.0 + self.root.normalising(&sample.phi, normalisation);
                let phi = DVector::from_column_slice(&sample.phi);
                // ∫φφᵀ/m² dt and ∫φ(z − φᵀθ₀)/m² dt, without forgetting
                a.ger(weight * h / m2, &phi, &phi, 1.0);
                b.axpy(weight * h / m2 * (sample.z - phi.dot(&self.root.theta)), &phi, 1.0);
                let aged = weight * h * (-rate * (1.0 - node) * h).exp();
                weighted.push(WeightedRow { weight: (aged / m2).sqrt(), sample });
            }
        }
        if !self.root.take(&weighted, (-0.5 * rate * h).exp(), limit) {
            self.frozen += h;
            self.follow_frozen(&a, &b);
        }
    }

    /// θ̇ = P (b̄ − Āθ) over a step with P = L Lᵀ constant: θ += L φ₁(LᵀAL) Lᵀb, φ₁(s) = (1 − e⁻ˢ)/s.
    fn follow_frozen(&mut self, a: &DMatrix<f64>, b: &DVector<f64>) {
        let n = self.root.theta.len();
        let r = self.root.triangle.r();
        let Some(l) = r.solve_upper_triangular(&DMatrix::identity(n, n)) else { return };
        let eigen = (l.transpose() * a * &l).symmetric_eigen();
        let along = eigen.eigenvectors.transpose() * l.transpose() * b;
        let moved = along.zip_map(&eigen.eigenvalues, |along, s| {
            if s > 1e-8 { along * -(-s).exp_m1() / s } else { along * (1.0 - 0.5 * s) }
        });
        self.root.theta += l * eigen.eigenvectors * moved;
    }
}

#[cfg(test)]
mod tests;
