//! `dgd schema`: the JSON schema of results.

use crate::console::Console;
use crate::failure::CommandError;

/// The schema, against which the tests check all results.
const SCHEMA: &str = include_str!("../../../../../docs/results.schema.json");

pub(crate) fn run(console: Console<'_>) -> Result<(), CommandError> {
    console.result(SCHEMA)
}
