//! Units after the value that belong after the name.

use super::written::unit_of;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported, Fix, FixEdit};
use crate::source::Span;
use crate::syntax::ast::{Expr, ExprKind, Name, WrittenUnit};
use crate::units::Unit;

/// The unit of a declaration.
///
/// A value written in a unit of another dimension is reported here, once: `R = 1.2 [ohm]` is then treated as `R [ohm] =
/// 1.2`, but `x [m] = 3 [s]` is ambiguous.
///
/// # Errors
///
/// If the unit is unknown or cannot be read.
pub(in crate::model) fn unit_of_declaration(
    name: &Name,
    unit: Option<&WrittenUnit>,
    value: Option<&Expr>,
    diagnostics: &mut Diagnostics,
) -> Result<Unit, ErrorReported> {
    let declared = unit_of(unit, diagnostics)?;
    let Some((value, behind)) = value.and_then(in_unit) else { return Ok(declared) };
    // An invalid unit is reported with the value.
    let Ok(own) = unit_of(Some(behind), &mut Diagnostics::default()) else { return Ok(declared) };
    if own.dimension == declared.dimension {
        return Ok(declared);
    }
    let Some(unit) = unit else {
        let message = format!("the unit of `{}` belongs behind its name", name.text);
        let moved = FixEdit::insert_after(name.span, format!(" [{}]", behind.text));
        let gone = FixEdit::replace(Span { start: value, ..behind.span }, "");
        diagnostics.error(
            Diagnostic::new(Code::UnitsOfSides, behind.span, message)
                .about(&name.text)
                .fix(Fix::safe(vec![moved, gone])),
        );
        return Ok(own);
    };
    let message = format!(
        "`{}` is declared in `{}`, but its value is in `{}`",
        name.text, declared.symbol, own.symbol
    );
    let mistake = Diagnostic::new(Code::UnitsOfSides, behind.span, message).about(&name.text);
    Err(diagnostics.error(mistake.label(unit.span, "declared so")))
}

/// The end of the number in a value with a unit, and that unit.
fn in_unit(value: &Expr) -> Option<(u32, &WrittenUnit)> {
    match &value.kind {
        ExprKind::Negate(inner) => in_unit(inner),
        ExprKind::Number { text, unit: Some(unit), .. } => {
            Some((value.span.start + u32::try_from(text.len()).ok()?, unit))
        }
        _ => None,
    }
}
