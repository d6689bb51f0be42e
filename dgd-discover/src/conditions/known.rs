//! What the user of a model knows over time, and may recognise a condition in.

use dgd_runtime::Unit;

/// A quantity over time.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownQuantity {
    /// Its name in the model.
    pub name: String,
    /// Where its values come from.
    pub kind: KnownKind,
    /// The unit it was declared in.
    pub unit: Unit,
    /// Its values at the samples of each recording, SI; NaN where there is none. Of a mode its position.
    pub values: Vec<Vec<f64>>,
}

/// Where a [`KnownQuantity`] comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum KnownKind {
    /// An input, as recorded.
    Input,
    /// An output, as measured.
    Output,
    /// An unknown, as the base model has it.
    Unknown,
    /// A `modes` block, as the base model has it: the names of its modes.
    Mode(Vec<String>),
}
