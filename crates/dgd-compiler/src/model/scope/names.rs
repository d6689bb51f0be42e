//! The names that an expression reads and calls.

use crate::syntax::ast::{Expr, ExprKind};

/// Every name read or called in an expression.
pub(in crate::model) fn names_in<'a>(expr: &'a Expr, names: &mut Vec<&'a str>) {
    match &expr.kind {
        ExprKind::Number { .. } => {}
        ExprKind::Name(name) => names.push(name),
        ExprKind::Call { function, arguments } => {
            names.push(&function.text);
            for argument in arguments {
                names_in(argument, names);
            }
        }
        ExprKind::List(values) => values.iter().for_each(|value| names_in(value, names)),
        ExprKind::Reduce(reduction) => {
            let mut names_in_body = Vec::new();
            names_in(&reduction.body, &mut names_in_body);
            names_in_body
                .retain(|n| reduction.counters.iter().all(|counter| counter.index.text != *n));
            names.extend(names_in_body);
            for range in reduction.counters.iter().map(|counter| &counter.range) {
                names_in(&range.lower, names);
                names_in(&range.upper, names);
            }
        }
        ExprKind::Group(a) | ExprKind::Negate(a) | ExprKind::Not(a) => names_in(a, names),
        ExprKind::Sum(terms) => terms.iter().for_each(|(_, term)| names_in(term, names)),
        ExprKind::Product(factors) => factors.iter().for_each(|(_, f)| names_in(f, names)),
        ExprKind::Element(a, b) | ExprKind::Power(a, b) | ExprKind::Compare(_, a, b) => {
            names_in(a, names);
            names_in(b, names);
        }
        ExprKind::If(a, b, c) => {
            for part in [a, b, c] {
                names_in(part, names);
            }
        }
        ExprKind::And(parts) | ExprKind::Or(parts) => {
            for part in parts {
                names_in(part, names);
            }
        }
    }
}
