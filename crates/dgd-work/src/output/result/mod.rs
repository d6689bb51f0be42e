//! Results of the commands: what `result.json`, pages, comparisons, reports of fleets and Python read.
//!
//! A type here is written and read by serde, and `docs/results.schema.json` follows from it (a test compares them). A key
//! is left out where an estimator or a request has nothing of its kind, and null where its value is unknown.

pub mod compare;
pub mod discover;
pub mod fit;
pub mod linearize;
#[cfg(test)]
mod schema;
pub mod simulate;

/// Entries by name, in the order of the model: a JSON object.
pub type ByName<T> = indexmap::IndexMap<String, T>;
