//! Units as written, between brackets.

use crate::diagnostics::{Diagnostics, ErrorReported};
use crate::syntax::ast::WrittenUnit;
use crate::units::Unit;

/// The unit between brackets; a plain number without one.
pub(in crate::model) fn unit_of(
    written: Option<&WrittenUnit>,
    diagnostics: &mut Diagnostics,
) -> Result<Unit, ErrorReported> {
    let Some(written) = written else {
        return Ok(Unit::one());
    };
    written.read().map_err(|error| diagnostics.error(error.locate(&written.text, written.span)))
}
