//! Taylor series of a program's solutions, as recurrences.

use std::collections::BTreeSet;

use super::operation::{ProgramOperation, ValueId};

/// Taylor series of a model's solutions.
#[derive(Debug, Clone)]
pub struct TaylorSeries {
    /// f.
    pub unknowns: SharedSeries,
    /// f, ∂f/∂y and ∂f/∂θ.
    pub sensitivities: SharedSeries,
}

/// The reason why a model has no Taylor series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoTaylor {
    /// Unknowns are algebraic, always or in some modes.
    Algebraic,
    /// Unknowns are delayed.
    Delays,
    /// There are arrays of unknowns.
    Arrays,
    /// The derivatives of a function in it never close.
    Functions,
}

/// Series of expressions with common operations.
#[derive(Debug, Clone)]
pub struct SharedSeries {
    /// Operations in order for the coefficients of order 0.
    pub body: Vec<ProgramOperation>,
    /// The model's names of values, in ascending order of the value.
    pub names: Vec<(ValueId, String)>,
    /// For each value its coefficients of higher orders, operands first; `None` for constants.
    pub recurrences: Vec<Option<Recurrence>>,
    /// Terms of sums.
    pub terms: Vec<ScaledOperand>,
    /// For each value the number under which its coefficients are stored, if recurrences read them at earlier orders.
    pub kept: Vec<Option<usize>>,
    /// Whether a condition or a sign may change along a solution.
    pub has_branches: bool,
    /// Right-hand sides.
    pub f: Vec<ValueId>,
    /// Non-zeros of ∂f/∂y.
    pub jacobian: Vec<MatrixEntry>,
    /// Non-zeros of ∂f/∂θ at fixed unknowns; columns are directions.
    pub directions: Vec<MatrixEntry>,
}

/// A non-zero of a matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MatrixEntry {
    /// Its row.
    pub row: usize,
    /// Its column.
    pub column: usize,
    /// Its value.
    pub value: ValueId,
}

/// The coefficient of order k ≥ 1 of a value v, from those of its operands, which vary unless stated otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Recurrence {
    /// t: h at order 1.
    Time,
    /// A linear input: h u̇ at order 1.
    Input(u32),
    /// An unknown: yₖ.
    Unknown(u32),
    /// Σ c aₖ over `count` of the series' [`SharedSeries::terms`], from this one on.
    Linear {
        /// Position of the first.
        first: usize,
        /// Number of terms.
        count: usize,
    },
    /// Σⱼ aⱼ b₍ₖ₋ⱼ₎
    Multiply(ValueId, ValueId),
    /// The product with a = b.
    Square(ValueId),
    /// The product with a linear a: a₀ bₖ + a₁ b₍ₖ₋₁₎.
    MultiplyLine(ValueId, ValueId),
    /// (aₖ − Σⱼ bⱼ v₍ₖ₋ⱼ₎)/b₀, j = 1 … k; `None` is a constant numerator. The last is 1/b₀.
    Divide(Option<ValueId>, ValueId, ValueId),
    /// Σⱼ j xⱼ d₍ₖ₋ⱼ₎/k, j = 1 … k, for v̇ = d ẋ.
    Chain(ValueId, ValueId),
    /// (aₖ − Σⱼ vⱼ v₍ₖ₋ⱼ₎)/(2 v₀), j = 1 … k − 1. The last is 1/(2 v₀).
    Root(ValueId, ValueId),
    /// (aₖ − Σⱼ j vⱼ a₍ₖ₋ⱼ₎/k)/a₀, j = 1 … k − 1. The last is 1/a₀.
    Log(ValueId, ValueId),
    /// Σⱼ (j (r + 1) − k) aⱼ v₍ₖ₋ⱼ₎/(k a₀), j = 1 … k; the exponent r, second, is constant. The last is 1/a₀.
    Power(ValueId, ValueId, ValueId),
    /// aₖ with the sign of the first nonzero coefficient.
    Magnitude(ValueId),
    /// One or the other by a condition; `None` is a constant.
    Select(ValueId, Option<ValueId>, Option<ValueId>),
}

/// A constant factor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConstantFactor {
    /// 1
    One,
    /// −1
    MinusOne,
    /// A value.
    Of(ValueId),
}

/// A factor and its operand.
pub type ScaledOperand = (ConstantFactor, ValueId);

impl Recurrence {
    /// The varying operands, except for the terms of a sum.
    pub(super) fn operands(self) -> impl Iterator<Item = ValueId> {
        let [a, b] = match self {
            Recurrence::Time
            | Recurrence::Input(_)
            | Recurrence::Unknown(_)
            | Recurrence::Linear { .. } => [None; 2],
            Recurrence::Multiply(a, b)
            | Recurrence::MultiplyLine(a, b)
            | Recurrence::Chain(a, b) => [Some(a), Some(b)],
            Recurrence::Square(a)
            | Recurrence::Root(a, _)
            | Recurrence::Log(a, _)
            | Recurrence::Power(a, ..)
            | Recurrence::Magnitude(a) => [Some(a), None],
            Recurrence::Divide(a, b, _) => [a, Some(b)],
            Recurrence::Select(_, a, b) => [a, b],
        };
        [a, b].into_iter().flatten()
    }

    /// The constant operands read at every order, except for the factors of a sum.
    pub fn constants(self) -> impl Iterator<Item = ValueId> {
        let [a, b] = match self {
            Recurrence::Divide(_, _, a)
            | Recurrence::Root(_, a)
            | Recurrence::Log(_, a)
            | Recurrence::Select(a, ..) => [Some(a), None],
            Recurrence::Power(_, a, b) => [Some(a), Some(b)],
            Recurrence::Time
            | Recurrence::Input(_)
            | Recurrence::Unknown(_)
            | Recurrence::Linear { .. }
            | Recurrence::Multiply(..)
            | Recurrence::Square(_)
            | Recurrence::MultiplyLine(..)
            | Recurrence::Chain(..)
            | Recurrence::Magnitude(_) => [None; 2],
        };
        [a, b].into_iter().flatten()
    }
}

impl SharedSeries {
    /// Constant values read at every order.
    pub fn constants(&self) -> BTreeSet<ValueId> {
        let of_recurrences = self.recurrences.iter().flatten().flat_map(|r| r.constants());
        let of_terms = self.terms.iter().filter_map(|(factor, _)| match factor {
            ConstantFactor::Of(value) => Some(*value),
            ConstantFactor::One | ConstantFactor::MinusOne => None,
        });
        let of_matrix = self.jacobian.iter().map(|entry| entry.value).filter(|v| !self.moves(*v));
        of_recurrences.chain(of_terms).chain(of_matrix).collect()
    }

    /// Whether a value has coefficients beyond that of order 0.
    pub fn moves(&self, value: ValueId) -> bool {
        self.recurrences[value.index()].is_some()
    }

    /// Number of values with stored coefficients.
    pub fn n_kept(&self) -> usize {
        self.kept.iter().flatten().count()
    }
}
