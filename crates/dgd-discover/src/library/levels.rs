//! Ranges of a model's quantities, for grids of constants that are levels of them.

/// Name, unit, minimum and maximum of each unknown and each output.
pub(crate) type QuantityRanges = Vec<(String, String, f64, f64)>;
