//! Units after the value that belong after the name, and derivatives that look like quotients.

use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported, Fix, FixEdit};
use crate::model::define::{ModelScope, NameDefinition};
use crate::model::expression::unit_of;
use crate::source::Span;
use crate::syntax::ast::{Expr, ExprKind, FactorSide, Name, WrittenUnit};
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

/// `dx/dt` or `d(x)/dt` of an unknown, in the middle of a product, if neither `dx` nor `dt` is defined.
pub(in crate::model) fn quotient_for_derivative(
    factors: &[(FactorSide, Expr)],
    scope: &ModelScope<'_>,
    is_known: &dyn Fn(&str) -> bool,
) -> Option<Diagnostic> {
    factors.array_windows().find_map(|[(factor, above), (over, below)]| {
        let is_quotient = *factor == FactorSide::Times && *over == FactorSide::Over;
        if !is_quotient || below.kind != ExprKind::Name("dt".to_owned()) || is_known("dt") {
            return None;
        }
        let numerator = match &above.kind {
            ExprKind::Name(name) if !is_known(name) => name.strip_prefix('d')?,
            ExprKind::Call { function, arguments } if function.text == "d" && !is_known("d") => {
                match arguments.as_slice() {
                    [Expr { kind: ExprKind::Name(name), .. }] => name,
                    _ => return None,
                }
            }
            _ => return None,
        };
        let is_unknown = scope
            .names
            .get(numerator)
            .is_some_and(|entry| matches!(entry.definition, NameDefinition::Unknown { .. }));
        let span = above.span.join(below.span);
        is_unknown.then(|| {
            let message = format!("a derivative is written `der({numerator})`");
            let fix = Fix::safe(vec![FixEdit::replace(span, format!("der({numerator})"))]);
            Diagnostic::new(Code::UnknownName, span, message).fix(fix)
        })
    })
}
