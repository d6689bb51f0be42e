//! Plain numbers as expressions, in which the sign is a separate operator.

use dgd_compiler::syntax::ast::{Expr, ExprKind};

/// A signed number in place of an expression; `text` formats its magnitude.
pub(crate) fn signed(value: f64, place: &Expr, text: impl FnOnce(f64) -> String) -> Expr {
    let size = value.abs();
    let kind = ExprKind::Number { value: size, text: text(size), unit: None };
    let number = Expr { kind, ..place.clone() };
    if value < 0.0 {
        Expr { kind: ExprKind::Negate(Box::new(number)), ..place.clone() }
    } else {
        number
    }
}

/// The value of a plain number.
pub(crate) fn plain(expr: &Expr) -> Option<f64> {
    match &expr.kind {
        ExprKind::Number { value, unit: None, .. } => Some(*value),
        ExprKind::Negate(inner) => Some(-plain(inner)?),
        ExprKind::Group(inner) => plain(inner),
        _ => None,
    }
}
