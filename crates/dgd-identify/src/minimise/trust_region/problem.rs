//! The function to minimise, its region, the stopping rule and the result.

use nalgebra::{DMatrix, DVector};

/// A sum of squares at a point, with its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalEquations {
    /// Σ r², or −2 ln of a likelihood.
    pub cost: f64,
    /// Terms of `cost` other than squares: the logarithms of σ, if it is −2 ln of a likelihood.
    pub logarithms: f64,
    /// Jᵀr.
    pub gradient: DVector<f64>,
    /// JᵀJ.
    pub information: DMatrix<f64>,
    /// Whether gradient and information include all residuals: those without derivatives only add to the cost.
    pub is_whole: bool,
}

impl NormalEquations {
    /// A sum over nothing, in n variables.
    pub fn zeros(n: usize) -> Self {
        Self {
            cost: 0.0,
            logarithms: 0.0,
            gradient: DVector::zeros(n),
            information: DMatrix::zeros(n, n),
            is_whole: true,
        }
    }

    /// Σ r² alone: the reference for changes of the cost.
    pub(super) fn squares(&self) -> f64 {
        self.cost - self.logarithms
    }

    /// The reduction of Σ r² that the quadratic model with the curvature H predicts for a step: −(2 gᵀδ + δᵀH δ).
    pub(super) fn promised(&self, step: &DVector<f64>, h: &DMatrix<f64>) -> f64 {
        -(2.0 * self.gradient.dot(step) + step.dot(&(h * step)))
    }
}

impl AsRef<NormalEquations> for NormalEquations {
    fn as_ref(&self) -> &NormalEquations {
        self
    }
}

/// The stopping rule: each criterion suffices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StoppingRule {
    /// No free variable's column of J has a larger cosine with r: |Jᵀr|ᵢ ≤ tol ‖Jᵢ‖ ‖r‖.
    pub gradient: f64,
    /// The full step within bounds would reduce Σ r² by no more than this fraction of it.
    pub reduction: f64,
    /// The full step within bounds moves no variable by more than this, or this fraction of its value.
    pub step: f64,
    /// Limit on evaluations.
    pub evaluations: usize,
    /// Limit on evaluations if none of the first [`Self::evaluations`] reduced the sum.
    pub until_a_step: usize,
    /// Relative accuracy of Σ r², or the relative change that matters: if no step reduces it, and the full one predicts
    /// no more than that, the minimum is found.
    pub accuracy: f64,
    /// A variable has no influence if moving it by 1 changes Σ r² on its own by no more than this fraction of it: ‖Jᵢ‖²
    /// ≤ flat ‖r‖². 0 disables the test.
    pub flat: f64,
}

impl Default for StoppingRule {
    fn default() -> Self {
        Self {
            gradient: 1e-10,
            reduction: 1e-12,
            step: 1e-10,
            evaluations: 200,
            until_a_step: 0,
            accuracy: 1e-13,
            flat: 1e-13,
        }
    }
}

/// The region of the variables.
#[derive(Debug, Clone, Copy)]
pub struct VariableRegion<'a> {
    /// Bounds of each.
    pub bounds: &'a [(f64, f64)],
    /// Limit on a step in each.
    pub reach: &'a [f64],
    /// The number of leading variables that must have influence somewhere for a minimum; start values, which only move
    /// a solution, come after them.
    pub leading: usize,
}

/// Why the iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Termination {
    /// The residuals are orthogonal to every free column of J.
    Gradient,
    /// The full step predicts no further reduction.
    Reduction,
    /// The full step does not move.
    Step,
    /// The slope predicts a reduction, but no step, however small, achieves it: the sum is not evaluated accurately
    /// enough, or has kinks.
    Stalled,
    /// Every step with a predicted reduction leads to points that cannot be evaluated.
    Blocked,
    /// On a plateau, where no estimate has influence except perhaps at bounds: there may or may not be a minimum
    /// elsewhere.
    Flat,
    /// The allowed evaluations were not enough.
    EvaluationLimit,
    /// It was cancelled ([`Monitor`](crate::Monitor)); the result is the best so far.
    Stopped,
}

impl Termination {
    /// Whether a minimum was found.
    pub fn is_converged(self) -> bool {
        match self {
            Self::Gradient | Self::Reduction | Self::Step => true,
            Self::Stalled | Self::Blocked | Self::Flat | Self::EvaluationLimit | Self::Stopped => {
                false
            }
        }
    }

    /// A one-word name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gradient => "gradient",
            Self::Reduction => "reduction",
            Self::Step => "step",
            Self::Stalled => "stalled",
            Self::Blocked => "blocked",
            Self::Flat => "flat",
            Self::EvaluationLimit => "evaluation limit",
            Self::Stopped => "stopped",
        }
    }
}

/// Where the iteration ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum<T, E> {
    /// The variables.
    pub x: Vec<f64>,
    /// The values there.
    pub at: T,
    /// Accepted steps.
    pub iterations: usize,
    /// Evaluations, including failed ones but not the initial one.
    pub evaluations: usize,
    /// Trials that could not be evaluated.
    pub failures: usize,
    /// The reason why the last of them failed.
    pub last_failure: Option<E>,
    /// Why it ended.
    pub termination: Termination,
}
