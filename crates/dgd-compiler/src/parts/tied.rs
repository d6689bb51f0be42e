//! Values of a part that are tied to quantities that are not constant.
//!
//! An argument of numbers and constants is a value like any other: it can be set and fitted. One that reads a parameter
//! or anything else that is not constant ties the two: the constant or parameter that it sets becomes a `let`, and so
//! do constants computed from it.

use std::collections::{BTreeMap, BTreeSet};

use super::expanded::ExpandedModel;
use super::names::names_in;
use crate::syntax::ast::{Item, ItemKind, Name, WrittenUnit};
use crate::syntax::visit;

/// A name with a value in the text, and the names that this value reads.
struct TiedValue {
    kind: TiedKind,
    reads: BTreeSet<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TiedKind {
    Constant,
    Parameter,
    /// A `let`, a function or a table.
    Definition,
}

/// Turns constants and parameters whose arguments are not constant into `let`s.
pub(super) fn tie(whole: &mut ExpandedModel) {
    if whole.set.is_empty() {
        return;
    }
    let mut values: BTreeMap<String, TiedValue> = BTreeMap::new();
    let mut varying: Vec<String> = vec!["time".to_owned()];
    visit::items(&whole.items, &mut |item| {
        let (name, kind, values_read, hidden) = match &item.kind {
            ItemKind::Constant { name, value, .. } | ItemKind::Size { name, value } => {
                (name, TiedKind::Constant, vec![value], Vec::new())
            }
            ItemKind::Parameter { name, value, .. } => {
                varying.push(name.text.clone());
                (name, TiedKind::Parameter, vec![value], Vec::new())
            }
            ItemKind::Let { name, value, .. } => {
                (name, TiedKind::Definition, vec![value], Vec::new())
            }
            ItemKind::Function { name, arguments, lets, body } => {
                let of_lets = lets.iter().map(|local| &local.value);
                let expressions = of_lets.chain([body]).collect();
                (name, TiedKind::Definition, expressions, visit::locals(arguments, lets))
            }
            ItemKind::Table { name, points, .. } => {
                (name, TiedKind::Definition, points.expressions(), Vec::new())
            }
            ItemKind::Input { name, .. }
            | ItemKind::Unknown { name, .. }
            | ItemKind::Array { name, .. } => {
                varying.push(name.text.clone());
                return;
            }
            ItemKind::Import { .. }
            | ItemKind::Output { .. }
            | ItemKind::Equation { .. }
            | ItemKind::Variant { .. }
            | ItemKind::Modes { .. }
            | ItemKind::For { .. }
            | ItemKind::When(_)
            | ItemKind::Every { .. }
            | ItemKind::Unit { .. }
            | ItemKind::Start(_)
            | ItemKind::Saturate { .. }
            | ItemKind::Part { .. }
            | ItemKind::Binding { .. } => return,
        };
        let mut reads = BTreeSet::new();
        for value in values_read {
            names_in(value, &mut reads);
        }
        for argument in hidden {
            reads.remove(&argument.name.text);
        }
        // All declarations in a variant's choices count.
        let entry = values.entry(name.text.clone());
        entry.or_insert(TiedValue { kind, reads: BTreeSet::new() }).reads.extend(reads);
    });

    let varying = reached(&values, varying, |_, value| value.kind == TiedKind::Definition);
    let is_tied = |name: &String| {
        values.get(name).is_some_and(|value| value.reads.iter().any(|n| varying.contains(n)))
    };
    let first: Vec<String> = whole.set.iter().filter(|name| is_tied(name)).cloned().collect();
    let tied = reached(&values, first, |name, value| match value.kind {
        TiedKind::Definition => true,
        TiedKind::Constant => name.contains('.'),
        TiedKind::Parameter => whole.set.contains(name),
    });
    visit::items_mut(&mut whole.items, &mut |item| make_let(item, &tied));
}

/// All values that read one of these names, directly or through values accepted by `passes`.
fn reached(
    values: &BTreeMap<String, TiedValue>,
    mut pending: Vec<String>,
    passes: impl Fn(&str, &TiedValue) -> bool,
) -> BTreeSet<String> {
    let mut users: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (name, value) in values.iter().filter(|(name, value)| passes(name, value)) {
        for read in &value.reads {
            users.entry(read).or_default().push(name);
        }
    }
    let mut names = BTreeSet::new();
    while let Some(name) = pending.pop() {
        pending.extend(users.get(name.as_str()).into_iter().flatten().map(|&u| u.to_owned()));
        users.remove(name.as_str());
        names.insert(name);
    }
    names
}

fn make_let(item: &mut Item, tied: &BTreeSet<String>) {
    let (ItemKind::Constant { name, unit, value } | ItemKind::Parameter { name, unit, value, .. }) =
        &mut item.kind
    else {
        return;
    };
    if !tied.contains(&name.text) {
        return;
    }
    let unit = Some(unit.take().unwrap_or_else(|| WrittenUnit::one(name.span)));
    let name: Name = name.clone();
    item.kind = ItemKind::Let { name, unit, value: value.clone() };
}
