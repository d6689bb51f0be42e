//! Late values: which there are, and where u has what is known of them.

use std::ops::Range;

/// An input read late, u(t − τ).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DelayedInput {
    /// Position of the input.
    pub input: usize,
    /// Position of the delay τ.
    pub delay: usize,
}

/// An unknown read late, x(t − τ).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DelayedUnknown {
    /// Position of the unknown.
    pub unknown: usize,
    /// Position of the delay τ, or among those that vary.
    pub delay: usize,
    /// Whether its delay varies.
    pub varies: bool,
    /// Whether the model says what it was before the start; otherwise that is
    /// what it starts with.
    pub has_history: bool,
}

/// Where u has what is known of the n_v delayed unknowns, each x looked up at α = t − τ.
///
/// | numbers | |
/// |---|---|
/// | n_v | 1 where x is read at α, 0 where it is read at t, whatever the others say |
/// | n_v | x(α) |
/// | n_v | ẋ(α) |
/// | n_v | ẍ(α) |
/// | n_v n_s | ∂x/∂θⱼ at α, by columns |
/// | n_v n_s | their slopes |
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PastLayout {
    /// Inputs before it.
    pub first: usize,
    /// Delayed unknowns n_v.
    pub n_v: usize,
    /// Directions n_s.
    pub n_s: usize,
}

impl PastLayout {
    /// Number of all of them.
    pub fn len(self) -> usize {
        (4 + 2 * self.n_s) * self.n_v
    }

    /// Whether nothing is read late.
    pub fn is_empty(self) -> bool {
        self.n_v == 0
    }

    /// Where u has 1 for each delayed unknown that is read at α, and 0 for each that is read at t.
    pub fn held(self) -> Range<usize> {
        self.block(0, 1)
    }

    /// Where u has x(α).
    pub fn values(self) -> Range<usize> {
        self.block(1, 1)
    }

    /// Where u has ẋ(α).
    pub fn rates(self) -> Range<usize> {
        self.block(2, 1)
    }

    /// Where u has ẍ(α).
    pub fn curvatures(self) -> Range<usize> {
        self.block(3, 1)
    }

    /// Where u has ∂x/∂θ at α, n_v × n_s by columns.
    pub fn sensitivities(self) -> Range<usize> {
        self.block(4, self.n_s)
    }

    /// Where u has the slopes of ∂x/∂θ at α.
    pub fn sensitivity_rates(self) -> Range<usize> {
        self.block(4 + self.n_s, self.n_s)
    }

    /// `columns` columns of n_v numbers, with so many before them.
    fn block(self, before: usize, columns: usize) -> Range<usize> {
        let start = self.first + before * self.n_v;
        start..start + columns * self.n_v
    }
}
