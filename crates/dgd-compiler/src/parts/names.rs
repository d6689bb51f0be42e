//! Names that items declare and expressions read.

use std::collections::{BTreeMap, BTreeSet};

use crate::source::Span;
use crate::syntax::ast::{Expr, ExprKind, Item, ItemKind};
use crate::syntax::visit::{self, ItemPart, Namespace};

/// Names that items declare.
pub(super) fn declared(items: &mut [Item]) -> Vec<(Namespace, String)> {
    let mut names = Vec::new();
    for item in items {
        visit::parts_mut(item, &mut |part| {
            if let ItemPart::Declares(namespace, name) = part {
                names.push((namespace, name.text.clone()));
            }
        });
    }
    names
}

/// Names that can be read, with their places.
pub(super) fn values(items: &[Item]) -> BTreeMap<String, Span> {
    let mut names = BTreeMap::new();
    visit::items(items, &mut |item| {
        if let Some(name) = item.kind.value_name() {
            names.entry(name.text.clone()).or_insert(name.span);
        }
    });
    names
}

/// Names of the parts of a file.
pub(super) fn part_names(items: &[Item]) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    visit::items(items, &mut |item| {
        if let ItemKind::Part { name, .. } = &item.kind {
            names.insert(name.text.clone());
        }
    });
    names
}

/// Every name read or called in an expression.
pub(super) fn names_in(expr: &Expr, names: &mut BTreeSet<String>) {
    match &expr.kind {
        ExprKind::Name(name) => {
            names.insert(name.clone());
        }
        ExprKind::Call { function, .. } => {
            names.insert(function.text.clone());
        }
        _ => {}
    }
    for operand in visit::operands(expr) {
        names_in(operand, names);
    }
}
