//! Coefficients of Rosenbrock methods.

/// The most stages a method may have; work space is laid out for so many.
pub const MAX_STAGES: usize = 8;

/// Coefficients of a stiffly accurate Rosenbrock method for M ẏ = f(t, y), transformed so that no
/// product with the Jacobian is needed.
///
/// ```text
///   (M/(h γ) − J) Uᵢ = f(t + αᵢ h, Yᵢ) + (M/h) Σⱼ cᵢⱼ Uⱼ + h γᵢ ∂f/∂t
///   Yᵢ = y + Σⱼ aᵢⱼ Uⱼ
///   y⁺ = Y_s + U_s,   local error ≈ U_s
///   y(t + θh) ≈ (1−θ) y + θ (y⁺ + (1−θ) (k₁ + θ k₂ + θ² k₃)),   kₗ = Σⱼ dₗⱼ Uⱼ
/// ```
///
/// J and ∂f/∂t are taken at (t, y). That the last stage closes the step and is its own error
/// estimate is what makes the method stiffly accurate and its error estimate good on algebraic
/// unknowns; methods without it do not fit here.
#[derive(Debug)]
pub struct RosenbrockTableau {
    /// γ, the same in all stages.
    pub gamma: f64,
    /// aᵢⱼ: row i has i entries.
    pub a: &'static [&'static [f64]],
    /// cᵢⱼ: row i has i entries.
    pub c: &'static [&'static [f64]],
    /// αᵢ, where in the step a stage stands.
    pub alpha: &'static [f64],
    /// γᵢ, weights of ∂f/∂t.
    pub gamma_sums: &'static [f64],
    /// dₗⱼ of the dense output.
    pub dense: [&'static [f64]; 3],
    /// Order of y⁺.
    pub order: u32,
    /// Order of the solution that the error estimate belongs to.
    pub estimate_order: u32,
}

impl RosenbrockTableau {
    /// Number of stages s.
    pub const fn stages(&self) -> usize {
        self.alpha.len()
    }
}
