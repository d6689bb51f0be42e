//! Delayed inputs and unknowns, and the layout of their values in u.

use std::ops::Range;

/// A delayed input, u(t − τ).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DelayedInput {
    /// Position of the input.
    pub input: usize,
    /// Position of the delay τ.
    pub delay: usize,
}

/// A delayed unknown, x(t − τ).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DelayedUnknown {
    /// Position of the unknown.
    pub unknown: usize,
    /// Position of the delay τ, among the variable delays if it varies.
    pub delay: usize,
    /// Whether its delay varies.
    pub varies: bool,
    /// Whether the model gives its history before the start; otherwise it has its start value then.
    pub has_history: bool,
}

/// Layout in u of the past of the n_v delayed unknowns, each x looked up at α = t − τ.
///
/// | numbers | |
/// |---|---|
/// | n_v | 1 if x is read at α, 0 if it is read at t regardless of the others |
/// | n_v | x(α) |
/// | n_v | ẋ(α) |
/// | n_v | ẍ(α) |
/// | n_v n_s | ∂x/∂θⱼ at α, by columns |
/// | n_v n_s | their slopes |
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PastLayout {
    /// Number of inputs before it.
    pub first: usize,
    /// Number of delayed unknowns n_v.
    pub n_v: usize,
    /// Number of directions n_s.
    pub n_s: usize,
}

impl PastLayout {
    /// Total length.
    pub fn len(self) -> usize {
        (4 + 2 * self.n_s) * self.n_v
    }

    /// Whether there are no delayed unknowns.
    pub fn is_empty(self) -> bool {
        self.n_v == 0
    }

    /// Range in u of the flags: 1 for each delayed unknown that is read at α, 0 for each that is read at t.
    pub fn held(self) -> Range<usize> {
        self.block(0, 1)
    }

    /// Range in u of x(α).
    pub fn values(self) -> Range<usize> {
        self.block(1, 1)
    }

    /// Range in u of ẋ(α).
    pub fn rates(self) -> Range<usize> {
        self.block(2, 1)
    }

    /// Range in u of ẍ(α).
    pub fn curvatures(self) -> Range<usize> {
        self.block(3, 1)
    }

    /// Range in u of ∂x/∂θ at α, n_v × n_s by columns.
    pub fn sensitivities(self) -> Range<usize> {
        self.block(4, self.n_s)
    }

    /// Range in u of the slopes of ∂x/∂θ at α.
    pub fn sensitivity_rates(self) -> Range<usize> {
        self.block(4 + self.n_s, self.n_s)
    }

    /// The range of `columns` columns of n_v numbers after `before` others.
    fn block(self, before: usize, columns: usize) -> Range<usize> {
        let start = self.first + before * self.n_v;
        start..start + columns * self.n_v
    }
}
