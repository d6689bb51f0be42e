//! Known quantities over time, in which conditions are expressed.

use dgd_runtime::Unit;

/// A quantity over time.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownQuantity {
    /// Its name in the model.
    pub name: String,
    /// Origin of its values.
    pub kind: KnownKind,
    /// The unit it was declared in.
    pub unit: Unit,
    /// Its values at the samples of each recording, SI; NaN where there is none. For a mode, its position.
    pub values: Vec<Vec<f64>>,
}

/// Origin of a [`KnownQuantity`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum KnownKind {
    /// An input, as recorded.
    Input,
    /// An output, as measured.
    Output,
    /// An unknown, from the base model.
    Unknown,
    /// A `modes` block, from the base model, with the names of its modes.
    Mode(Vec<String>),
}
