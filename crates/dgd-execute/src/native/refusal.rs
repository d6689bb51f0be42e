//! Reasons why a function has no native code.

use std::fmt;

/// Why there is no native code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum NativeRefusal {
    /// Cranelift does not support the machine.
    Machine(String),
    /// The operations do not form a valid program.
    Malformed,
    /// Its numbers are further apart than instructions can address.
    TooLarge,
    /// Cranelift failed, or memory for the code could not be allocated.
    Failed(String),
}

impl fmt::Display for NativeRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NativeRefusal::Machine(reason) => write!(f, "not for this machine: {reason}"),
            NativeRefusal::Malformed => write!(f, "the program is malformed"),
            NativeRefusal::TooLarge => write!(f, "the model is too large"),
            NativeRefusal::Failed(reason) => write!(f, "{reason}"),
        }
    }
}
