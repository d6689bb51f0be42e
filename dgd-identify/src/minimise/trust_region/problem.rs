//! What is minimised, where, when the search stops, and what it gives.

use nalgebra::{DMatrix, DVector};

/// A sum of squares at a point, and what is known of it nearby.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalEquations {
    /// Σ r², or −2 ln of a likelihood.
    pub cost: f64,
    /// What is in `cost` besides squares: where that is −2 ln of a likelihood, its logarithms of σ.
    pub logarithms: f64,
    /// Jᵀr.
    pub gradient: DVector<f64>,
    /// JᵀJ.
    pub information: DMatrix<f64>,
    /// Whether gradient and information know of all residuals: those without derivatives add to the cost only.
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

    /// Σ r² alone: what changes of the cost are compared with.
    pub(super) fn squares(&self) -> f64 {
        self.cost - self.logarithms
    }

    /// The reduction of Σ r² that the quadratic model with the curvature H promises of a step: −(2 gᵀδ + δᵀH δ).
    pub(super) fn promised(&self, step: &DVector<f64>, h: &DMatrix<f64>) -> f64 {
        -(2.0 * self.gradient.dot(step) + step.dot(&(h * step)))
    }
}

impl AsRef<NormalEquations> for NormalEquations {
    fn as_ref(&self) -> &NormalEquations {
        self
    }
}

/// When to stop. Each is enough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StoppingRule {
    /// No free variable's column of J makes a larger cosine with r: |Jᵀr|ᵢ ≤ tol ‖Jᵢ‖ ‖r‖.
    pub gradient: f64,
    /// The full step within bounds would reduce Σ r² by no more than this part of it.
    pub reduction: f64,
    /// The full step within bounds moves no variable by more than this, or this part of its value.
    pub step: f64,
    /// Most evaluations.
    pub evaluations: usize,
    /// Most evaluations where none of the first [`Self::evaluations`] made the sum smaller.
    pub until_a_step: usize,
    /// Σ r² is known to this part of itself, or matters no further: where no step makes it smaller, and the full one
    /// promises no more than that, the minimum is found.
    pub accuracy: f64,
    /// A variable that changes Σ r² by its own by no more than this part of it, when it is moved by 1, has no
    /// influence: ‖Jᵢ‖² ≤ flat ‖r‖². None is looked for at 0.
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

/// Where variables may be.
#[derive(Debug, Clone, Copy)]
pub struct Region<'a> {
    /// Bounds of each.
    pub bounds: &'a [(f64, f64)],
    /// How far a step goes at most in each.
    pub reach: &'a [f64],
    /// So many, the first ones, must have influence somewhere for a minimum; start values, which only move a
    /// solution, come behind them.
    pub leading: usize,
}

/// Why the iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Termination {
    /// The residuals are orthogonal to every free column of J.
    Gradient,
    /// The full step promises nothing any more.
    Reduction,
    /// The full step goes nowhere any more.
    Step,
    /// The slope says that steps help, and none, however small, does: the sum is not evaluated exactly enough to
    /// go on, or has kinks.
    Stalled,
    /// Every step that promises something leads where nothing can be evaluated.
    Blocked,
    /// On a plain, where nothing that is estimated has influence but perhaps at bounds: whether there is a
    /// minimum elsewhere cannot be told.
    Flat,
    /// The allowed evaluations were not enough.
    EvaluationLimit,
    /// Who watched it asked to stop ([`Watch`](crate::Watch)); the best so far was kept.
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

    /// One word for it.
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
    /// What was evaluated there.
    pub at: T,
    /// Accepted steps.
    pub iterations: usize,
    /// Evaluations, failed ones included, without that at the start.
    pub evaluations: usize,
    /// Trials that could not be evaluated.
    pub failures: usize,
    /// Why the last of them could not.
    pub last_failure: Option<E>,
    /// Why it ended.
    pub termination: Termination,
}
