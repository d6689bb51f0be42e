//! Dimensions of all expressions of a document: those that the compiler records, and those derived from them.

use std::collections::BTreeMap;

use dgd_compiler::source::Span;
use dgd_compiler::syntax::ast::{Ast, ClauseKind, Expr, ExprKind, FactorSide};
use dgd_compiler::syntax::visit::{ItemPart, operands, parts_mut};
use dgd_compiler::units::Dimension;

use crate::analysis::Analysis;

/// The dimension of a second.
const SECOND: Dimension = Dimension::from_exponents([0, 0, 1, 0, 0, 0, 0]);

/// Calls `visit` with every top-level expression of a file.
pub(crate) fn expressions(ast: &Ast, visit: &mut dyn FnMut(&Expr)) {
    for item in &ast.items {
        parts_mut(&mut item.clone(), &mut |part| {
            if let ItemPart::Expr(_, expr) = part {
                visit(expr);
            }
        });
    }
    for clause in ast.effect.iter().flat_map(|effect| &effect.clauses) {
        match &clause.kind {
            ClauseKind::Null { value: expr, .. }
            | ClauseKind::Replace { by: expr, .. }
            | ClauseKind::ReplaceOutput { by: expr, .. }
            | ClauseKind::Add { value: expr, .. } => visit(expr),
            ClauseKind::Kind(_) | ClauseKind::Form(_) => {}
        }
    }
}

/// Dimensions of the document's expressions, by span.
pub(crate) fn all(analysis: &Analysis) -> BTreeMap<Span, Dimension> {
    let mut known = analysis.dimensions.clone();
    let model = analysis.model.iter();
    let sizes: Vec<&str> = model.flat_map(|m| &m.sizes).map(|(name, _)| &*name.text).collect();
    expressions(&analysis.asts[0], &mut |expr| infer(expr, &sizes, &mut known));
    known
}

/// Records dimensions that follow from known ones. The compiler records none for the expressions of an effect, which
/// become part of others when it is applied, nor for the argument of `der` and indices.
fn infer(expr: &Expr, sizes: &[&str], known: &mut BTreeMap<Span, Dimension>) {
    for operand in operands(expr) {
        infer(operand, sizes, known);
    }
    if matches!(&expr.kind, ExprKind::Name(name) if sizes.contains(&name.as_str())) {
        known.entry(expr.span).or_insert(Dimension::ONE);
    }
    if let Some(own) = of_operands(expr, known) {
        known.entry(expr.span).or_insert(own);
    }
    let Some(own) = known.get(&expr.span).copied() else { return };
    let derived = match &expr.kind {
        ExprKind::Group(inner) | ExprKind::Negate(inner) => Some((inner.as_ref(), own)),
        ExprKind::Call { function, arguments } if function.text == "der" => {
            arguments.first().zip(own.times(SECOND))
        }
        _ => None,
    };
    if let Some((operand, dimension)) = derived
        && !known.contains_key(&operand.span)
    {
        known.insert(operand.span, dimension);
        infer(operand, sizes, known);
    }
}

/// The dimension of an expression from its operands.
fn of_operands(expr: &Expr, known: &BTreeMap<Span, Dimension>) -> Option<Dimension> {
    let dimension = |expr: &Expr| match &expr.kind {
        // The ends of ranges are not lowered.
        ExprKind::Number { unit: None, .. } => {
            known.get(&expr.span).copied().or(Some(Dimension::ONE))
        }
        _ => known.get(&expr.span).copied(),
    };
    match &expr.kind {
        ExprKind::Group(inner) | ExprKind::Negate(inner) => dimension(inner),
        ExprKind::Sum(terms) => terms.iter().find_map(|(_, term)| dimension(term)),
        ExprKind::Product(factors) => {
            factors.iter().try_fold(Dimension::ONE, |product, (how, factor)| match how {
                FactorSide::Times => product.times(dimension(factor)?),
                FactorSide::Over => product.divide(dimension(factor)?),
            })
        }
        _ => None,
    }
}
