//! Derivatives that are written like quotients.

use crate::diagnostics::{Code, Diagnostic, Fix, FixEdit};
use crate::model::scope::{ModelScope, NameDefinition};
use crate::syntax::ast::{Expr, ExprKind, FactorSide};

/// `dx/dt` or `d(x)/dt` of an unknown, in the middle of a product, if neither `dx` nor `dt` is defined.
pub(super) fn quotient_for_derivative(
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
