//! `dgd schema`: what results for programs look like.

use crate::console::Console;
use crate::failure::CommandError;

/// The schema, which the tests check all results against.
const SCHEMA: &str = include_str!("../../../../docs/results.schema.json");

pub(crate) fn run(console: Console<'_>) -> Result<(), CommandError> {
    console.result(SCHEMA)
}
