//! Features that models of a type may have, so that solvers can skip code for those that they lack.

use crate::Signature;

/// Features that models of a type may have. Solvers skip code for those that they lack.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(clippy::struct_excessive_bools)] // Features are independent of each other.
pub struct Features {
    /// Discrete numbers: modes, or conditions on time.
    pub events: bool,
    /// Delayed inputs or unknowns.
    pub past: bool,
    /// Algebraic unknowns, in some mode.
    pub algebraic: bool,
    /// Sums that the equations conserve.
    pub conserved: bool,
}

impl Features {
    /// All features.
    pub const ANY: Self = Self { events: true, past: true, algebraic: true, conserved: true };

    /// Whether a model has no other features.
    pub fn cover(self, signature: &Signature) -> bool {
        let delayed = signature.delayed_inputs.len() + signature.delayed_unknowns.len();
        let algebraic = signature.unknowns.iter().any(|unknown| !unknown.differential);
        (self.events || signature.discrete.is_empty())
            && (self.past || delayed == 0)
            && (self.algebraic || !algebraic)
            && (self.conserved || signature.conserved.is_empty())
    }
}
