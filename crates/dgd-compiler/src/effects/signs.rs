//! Signs of terms added by effects, in the usual form: `a - k*x` for `a + -k*x`.

use crate::source::SourceId;
use crate::syntax::ast::{Expr, ExprKind, Sign};
use crate::syntax::visit;

/// Moves the minus of a term added by an effect into the sum that contains it; `model` are the files whose own text
/// stays as it is. Values stay bit-identical.
pub(super) fn tidy(expr: &mut Expr, model: &[SourceId]) {
    for operand in visit::operands_mut(expr) {
        tidy(operand, model);
    }
    if let ExprKind::Sum(terms) = &mut expr.kind {
        for (sign, term) in terms.iter_mut().skip(1) {
            while let Some(inner) = without_minus(term, model) {
                *term = inner;
                *sign = match sign {
                    Sign::Plus => Sign::Minus,
                    Sign::Minus => Sign::Plus,
                };
            }
        }
    }
}

/// The operand of a minus added by an effect.
fn without_minus(term: &Expr, model: &[SourceId]) -> Option<Expr> {
    match &term.kind {
        ExprKind::Negate(inner) if !model.contains(&term.span.source) => Some((**inner).clone()),
        ExprKind::Product(factors) => {
            let (_, first) = factors.first()?;
            let first = without_minus(first, model)?;
            let mut factors = factors.clone();
            factors[0].1 = first;
            Some(Expr { span: term.span, kind: ExprKind::Product(factors) })
        }
        _ => None,
    }
}
