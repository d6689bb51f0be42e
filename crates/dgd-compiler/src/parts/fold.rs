//! Folds a changed tree back to its source form, where its parts are unchanged.

use std::collections::BTreeSet;

use super::flat_model::FlatModel;
use crate::syntax::ast::{Ast, Expr, ExprKind, Item, ItemKind};

/// The items of a model in source form, with the changes of `after`, which is derived from the items of `expanded`. A
/// changed part stays expanded.
///
/// `None` if libraries that only parts see would have to be written out.
pub(crate) fn fold(written: &[Ast], expanded: &FlatModel<'_>, after: &[Item]) -> Option<Vec<Item>> {
    let before = &expanded.asts[0].items;
    let mut changed = BTreeSet::new();
    let mut folding = PartFolding { lengths: expanded.lengths.iter(), changed: &BTreeSet::new() };
    folding.changes(&written[0].items, before, after, &mut changed);
    let is_own = |library: &Ast| written.iter().any(|ast| ast == library);
    if !changed.is_empty() && !expanded.asts[1..].iter().all(is_own) {
        return None;
    }
    let mut folding = PartFolding { lengths: expanded.lengths.iter(), changed: &changed };
    Some(folding.fold(&written[0].items, after))
}

struct PartFolding<'a> {
    /// Number of items of each part, in the order written.
    lengths: std::slice::Iter<'a, usize>,
    /// Parts that are not folded.
    changed: &'a BTreeSet<String>,
}

impl PartFolding<'_> {
    /// Finds the parts whose items have changed.
    fn changes(
        &mut self,
        written: &[Item],
        mut before: &[Item],
        mut after: &[Item],
        changed: &mut BTreeSet<String>,
    ) {
        for item in written {
            let n = self.length(item);
            let (old, new) = (split(&mut before, n), split(&mut after, n));
            match &item.kind {
                ItemKind::Part { name, .. } if old != new => {
                    changed.insert(name.text.clone());
                }
                ItemKind::Variant { choices, .. } => {
                    let triples = choices.iter().zip(choices_of(old)).zip(choices_of(new));
                    for ((choice, old), new) in triples {
                        self.changes(&choice.items, old, new, changed);
                    }
                }
                _ => {}
            }
        }
    }

    /// The items in source form; the additions of effects that follow them are unchanged.
    fn fold(&mut self, written: &[Item], mut after: &[Item]) -> Vec<Item> {
        let mut folded = Vec::with_capacity(written.len());
        for item in written {
            let n = self.length(item);
            let new = split(&mut after, n);
            match (&item.kind, new) {
                (ItemKind::Part { name, .. }, _) if !self.changed.contains(&name.text) => {
                    folded.push(item.clone());
                }
                (ItemKind::Binding { .. }, [new]) => folded.push(self.binding(item, new)),
                (
                    ItemKind::For { items: written, .. },
                    [new @ Item { kind: ItemKind::For { counters, items }, .. }],
                ) if written.len() == items.len() => {
                    let items =
                        written.iter().zip(items).map(|(item, new)| self.binding(item, new));
                    let kind = ItemKind::For { counters: counters.clone(), items: items.collect() };
                    folded.push(Item { kind, ..new.clone() });
                }
                (
                    ItemKind::Variant { choices: written, .. },
                    [Item { kind: ItemKind::Variant { name, choices }, .. }],
                ) => {
                    let mut choices = choices.clone();
                    for (choice, written) in choices.iter_mut().zip(written) {
                        choice.items = self.fold(&written.items, &choice.items);
                    }
                    let kind = ItemKind::Variant { name: name.clone(), choices };
                    folded.push(Item { kind, ..item.clone() });
                }
                _ => folded.extend(new.iter().cloned()),
            }
        }
        folded.extend(after.iter().cloned());
        folded
    }

    /// Number of expanded items for one item.
    fn length(&mut self, item: &Item) -> usize {
        match item.kind {
            ItemKind::Part { .. } => self.lengths.next().copied().unwrap_or(0),
            _ => 1,
        }
    }

    /// A binding in source form with its new value; anything else, and a binding of a part that is not folded, as it is
    /// in the changed tree.
    fn binding(&self, written: &Item, new: &Item) -> Item {
        let ItemKind::Binding { input, indices, value: own } = &written.kind else {
            return new.clone();
        };
        let value = match &new.kind {
            ItemKind::Let { value, .. } | ItemKind::Equation { right: value, .. } => value,
            // One for all elements.
            ItemKind::For { items, .. } => match items.as_slice() {
                [Item { kind: ItemKind::Let { value, .. }, .. }] => value,
                _ => return new.clone(),
            },
            _ => return new.clone(),
        };
        if self.is_of_changed(&input.text) {
            return new.clone();
        }
        let value = if is_the_number(own, value) { own } else { value };
        let (input, indices, value) = (input.clone(), indices.clone(), value.clone());
        Item { kind: ItemKind::Binding { input, indices, value }, ..written.clone() }
    }

    fn is_of_changed(&self, input: &str) -> bool {
        input.split_once('.').is_some_and(|(part, _)| self.changed.contains(part))
    }
}

/// Whether the only change of a plain number is its unit.
fn is_the_number(own: &Expr, now: &Expr) -> bool {
    match (&own.kind, &now.kind) {
        (ExprKind::Number { text: own, .. }, ExprKind::Number { text: now, .. }) => own == now,
        (ExprKind::Negate(own), ExprKind::Negate(now))
        | (ExprKind::Group(own), ExprKind::Group(now)) => is_the_number(own, now),
        _ => false,
    }
}

/// Takes items from the front.
fn split<'i>(items: &mut &'i [Item], n: usize) -> &'i [Item] {
    let (front, rest) = items.split_at(n.min(items.len()));
    *items = rest;
    front
}

/// The items of each choice of a variant that is alone.
fn choices_of(items: &[Item]) -> impl Iterator<Item = &[Item]> {
    let choices = match items {
        [Item { kind: ItemKind::Variant { choices, .. }, .. }] => choices.as_slice(),
        _ => &[],
    };
    choices.iter().map(|choice| choice.items.as_slice())
}
