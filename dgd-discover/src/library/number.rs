//! Plain numbers as expressions, which have no sign of their own.

use dgd_compiler::syntax::ast::{Expr, ExprKind};

/// A number with its sign in the place of an expression; `text` writes its size.
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
