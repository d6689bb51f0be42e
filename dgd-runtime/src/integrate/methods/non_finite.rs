//! Evaluations that are not finite.

/// The function of the model that is not finite, with the position of its equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NonFinite {
    Equation(usize),
    Derivative(usize),
}
