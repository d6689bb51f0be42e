//! Substitutes the `let`s of a function in its value.

use super::ast::{Expr, ExprKind, FactorSide, LocalLet};
use super::visit;

/// The body with the names of the `let`s replaced by their values.
pub(crate) fn without_lets(lets: &[LocalLet], body: &Expr) -> Expr {
    let mut values: Vec<(&str, Expr)> = Vec::with_capacity(lets.len());
    for local in lets {
        let mut value = local.value.clone();
        replace(&mut value, &values);
        values.push((&local.name.text, in_unit(local, value)));
    }
    let mut body = body.clone();
    replace(&mut body, &values);
    body
}

fn replace(expr: &mut Expr, values: &[(&str, Expr)]) {
    if let ExprKind::Name(name) = &expr.kind
        && let Some((_, value)) = values.iter().rev().find(|(own, _)| own == name)
    {
        *expr = grouped(value.clone());
        return;
    }
    for operand in visit::operands_mut(expr) {
        replace(operand, values);
    }
}

fn grouped(expr: Expr) -> Expr {
    match expr.kind {
        ExprKind::Number { .. }
        | ExprKind::Name(_)
        | ExprKind::Call { .. }
        | ExprKind::Group(_) => expr,
        _ => Expr { span: expr.span, kind: ExprKind::Group(Box::new(expr)) },
    }
}

/// Gives a value of plain numbers the unit of its `let`.
fn in_unit(local: &LocalLet, value: Expr) -> Expr {
    let Some(unit) = local.unit.as_ref().filter(|_| is_plain(&value)) else { return value };
    let span = value.span;
    if let ExprKind::Number { value, text, unit: None } = value.kind {
        return Expr { span, kind: ExprKind::Number { value, text, unit: Some(unit.clone()) } };
    }
    let one = ExprKind::Number { value: 1.0, text: "1".to_owned(), unit: Some(unit.clone()) };
    let factors =
        vec![(FactorSide::Times, grouped(value)), (FactorSide::Times, Expr { span, kind: one })];
    Expr { span, kind: ExprKind::Product(factors) }
}

fn is_plain(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Number { unit, .. } => unit.is_none(),
        ExprKind::Name(name) => name == "pi",
        _ => visit::operands(expr).into_iter().all(is_plain),
    }
}
