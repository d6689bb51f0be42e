//! Features that models of a type may have: a solver does not look for those that they lack.

use crate::Signature;

/// Features that models of a type may have. A solver does not look for those that they lack.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Features {
    /// Discrete numbers: modes, or conditions on time.
    pub events: bool,
    /// Inputs or unknowns that equations read late.
    pub past: bool,
    /// Algebraic unknowns, in some mode.
    pub algebraic: bool,
}

impl Features {
    /// Whatever a model can have.
    pub const ANY: Self = Self { events: true, past: true, algebraic: true };

    /// Whether a model like this keeps to them.
    pub fn cover(self, signature: &Signature) -> bool {
        let delayed = signature.delayed_inputs.len() + signature.delayed_unknowns.len();
        let algebraic = signature.unknowns.iter().any(|unknown| !unknown.differential);
        (self.events || signature.discrete.is_empty())
            && (self.past || delayed == 0)
            && (self.algebraic || !algebraic)
    }
}
