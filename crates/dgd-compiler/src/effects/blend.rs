//! Blends expressions by a weight λ.

use crate::source::Span;
use crate::syntax::ast::{Expr, ExprKind, FactorSide, Sign};

/// λ e
pub(super) fn times(blend: &str, value: Expr) -> Expr {
    let span = value.span;
    let blend = Expr { span, kind: ExprKind::Name(blend.to_owned()) };
    let factors = vec![(FactorSide::Times, blend), (FactorSide::Times, value)];
    Expr { span, kind: ExprKind::Product(factors) }
}

/// old + λ (new − old)
pub(super) fn blended(old: Expr, new: Expr, blend: &str, span: Span) -> Expr {
    let difference = ExprKind::Sum(vec![(Sign::Plus, new), (Sign::Minus, old.clone())]);
    let change = times(blend, Expr { span, kind: difference });
    Expr { span, kind: ExprKind::Sum(vec![(Sign::Plus, old), (Sign::Plus, change)]) }
}
