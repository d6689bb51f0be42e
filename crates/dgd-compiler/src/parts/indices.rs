//! Names of indices in the items of parts, which must be free in the whole.

use std::collections::BTreeSet;

use crate::source::Span;
use crate::syntax::ast::{ArrayAxis, Expr, ExprKind, Item, ItemKind, LoopCounter, Name, Reduction};
use crate::syntax::visit;

/// A counter for each axis.
pub(super) fn counters(
    axes: &[ArrayAxis],
    span: Span,
    mut taken: BTreeSet<String>,
) -> Vec<LoopCounter> {
    let one = |axis: &ArrayAxis| {
        let counter = counter(axis, span, &taken);
        taken.insert(counter.index.text.clone());
        counter
    };
    axes.iter().map(one).collect()
}

/// A counter for an axis, with the axis's name if that is free.
fn counter(axis: &ArrayAxis, span: Span, taken: &BTreeSet<String>) -> LoopCounter {
    let numbered = (1..).map(|k| format!("i_{k}"));
    let wanted = axis.index.iter().map(|index| index.text.clone());
    let mut names = wanted.chain(["i", "j", "k"].map(str::to_owned)).chain(numbered);
    let text = names.find(|name| !taken.contains(name)).unwrap_or_default();
    let span = axis.index.as_ref().map_or(span, |index| index.span);
    LoopCounter { index: Name { text, span }, range: axis.range.clone() }
}

/// Renames the indices of a part's model that clash with names of the whole.
pub(super) fn free_indices(items: &mut [Item], taken: &BTreeSet<String>) {
    let indices = indices_in(items);
    if indices.is_disjoint(taken) {
        return;
    }
    let mut names: BTreeSet<String> = taken | &indices;
    let mut free = |index: &mut Name| {
        let old = index.text.clone();
        if taken.contains(&old) {
            let mut numbered = (1..).map(|k| format!("{old}_{k}"));
            index.text = numbered.find(|name| !names.contains(name)).unwrap_or_default();
            names.insert(index.text.clone());
        }
        old
    };
    visit::items_mut(items, &mut |item| match &mut item.kind {
        ItemKind::For { counters, items } => {
            for counter in counters {
                let old = free(&mut counter.index);
                for item in &mut *items {
                    visit::parts_mut(item, &mut |part| {
                        if let visit::ItemPart::Expr(_, expr) = part {
                            rename_index(expr, &old, &counter.index.text);
                        }
                    });
                }
            }
        }
        ItemKind::Array { axes, start, attributes, .. } => {
            for index in axes.iter_mut().filter_map(|axis| axis.index.as_mut()) {
                let old = free(index);
                let read = attributes.iter_mut().flat_map(visit::attribute_expressions_mut);
                for expr in start.iter_mut().chain(read) {
                    rename_index(expr, &old, &index.text);
                }
            }
        }
        _ => {}
    });
    for item in items {
        visit::parts_mut(item, &mut |part| {
            if let visit::ItemPart::Expr(_, expr) = part {
                free_sums(expr, &mut free);
            }
        });
    }
}

fn free_sums(expr: &mut Expr, free: &mut dyn FnMut(&mut Name) -> String) {
    if let ExprKind::Reduce(reduction) = &mut expr.kind {
        let Reduction { body, counters, .. } = &mut **reduction;
        for counter in counters {
            let old = free(&mut counter.index);
            rename_index(body, &old, &counter.index.text);
        }
    }
    for operand in visit::operands_mut(expr) {
        free_sums(operand, free);
    }
}

/// Names of indices in a model.
pub(super) fn indices_in(items: &mut [Item]) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    visit::items(items, &mut |item| match &item.kind {
        ItemKind::For { counters, .. } => {
            names.extend(counters.iter().map(|counter| counter.index.text.clone()));
        }
        ItemKind::Array { axes, .. } => {
            let indices = axes.iter().filter_map(|axis| axis.index.as_ref());
            names.extend(indices.map(|index| index.text.clone()));
        }
        _ => {}
    });
    for item in items {
        visit::parts_mut(item, &mut |part| {
            if let visit::ItemPart::Expr(_, expr) = part {
                indices_of_sums(expr, &mut names);
            }
        });
    }
    names
}

fn indices_of_sums(expr: &Expr, all: &mut BTreeSet<String>) {
    if let ExprKind::Reduce(reduction) = &expr.kind {
        all.extend(reduction.counters.iter().map(|counter| counter.index.text.clone()));
    }
    for operand in visit::operands(expr) {
        indices_of_sums(operand, all);
    }
}

/// Renames an index in an expression.
pub(super) fn rename_index(expr: &mut Expr, old: &str, new: &str) {
    if let ExprKind::Name(name) = &mut expr.kind
        && name == old
    {
        new.clone_into(name);
    }
    for operand in visit::operands_mut(expr) {
        rename_index(operand, old, new);
    }
}
