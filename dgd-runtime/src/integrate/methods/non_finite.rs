//! Evaluations that are not finite.

/// What of the model is not finite, by the position of its equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NonFinite {
    Equation(usize),
    Derivative(usize),
}
