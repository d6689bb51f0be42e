//! Inputs that the chosen variants do not read: of parts, where no one binds them, and of the model,
//! where other choices read them. They are left out, and with them the values that only they would
//! need. What is read and not bound is a mistake.

use std::collections::{BTreeMap, BTreeSet};

use super::InnerModel;
use super::tied::names_in;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use crate::source::Span;
use crate::syntax::ast::{ArrayKind, Ast, Item, ItemKind, Name};
use crate::syntax::visit::{self, Part, Role};

/// Whether a model has inputs of parts that no one binds, in any of its variants.
pub(crate) fn has_unbound(main: &Ast) -> bool {
    let mut any = false;
    visit::items(&main.items, &mut |item| any |= is_of_part(item, main));
    any
}

/// An input that stands in another file than the model is one of a part.
fn is_of_part(item: &Item, main: &Ast) -> bool {
    input_name(item).is_some_and(|name| name.span.source != main.source)
}

/// The name of an input, or of an array of inputs.
fn input_name(item: &Item) -> Option<&Name> {
    match &item.kind {
        ItemKind::Input { name, .. } | ItemKind::Array { declared: ArrayKind::Input, name, .. } => {
            Some(name)
        }
        _ => None,
    }
}

/// Leaves out of the chosen items of a model the inputs of its parts, and what nothing reads and
/// could not be worked out without them.
///
/// # Errors
///
/// [`Reported`] where one that is not bound is read (E220).
pub(crate) fn leave_out_unbound(
    items: &mut Vec<&Item>,
    main: &Ast,
    parts: &[InnerModel],
    diagnostics: &mut Diagnostics,
) -> Result<(), Reported> {
    let of_part = |item: &&&Item| is_of_part(item, main);
    if !items.iter().any(|item| of_part(&item)) {
        return Ok(());
    }
    let bound: BTreeSet<&str> = items.iter().flat_map(|item| values_of(item)).collect();
    let inputs = items.iter().filter(of_part).filter_map(|item| input_name(item));
    let inputs = inputs.filter(|name| !bound.contains(name.text.as_str()));
    let unbound: BTreeMap<&str, &Name> = inputs.map(|name| (name.text.as_str(), name)).collect();
    // The whole's own lines are sound whether anything reads them or not.
    let reads = Dependencies::of(items, |name| name.contains('.'));
    let read: Vec<&Name> =
        unbound.values().copied().filter(|name| reads.needed.contains(&name.text)).collect();
    let mut result = Ok(());
    for names in by_part(&read) {
        result = Err(diagnostics.error(not_bound(&names, &main.items, parts)));
    }
    result?;
    items.retain(|item| !of_part(&item));
    reads.leave_out(unbound.keys().map(|name| (*name).to_owned()).collect(), items);
    Ok(())
}

/// Leaves out of the chosen items the inputs that other choices of variants read and these do not: no
/// data need to have them. Where it is known which columns there are, those that these do not read and
/// that have none.
pub(crate) fn leave_out_unread_inputs(
    items: &mut Vec<&Item>,
    main: &Ast,
    columns: Option<&[String]>,
) {
    let has_choices = |item: &Item| matches!(item.kind, ItemKind::Variant { .. });
    if columns.is_none() && !main.items.iter().any(has_choices) {
        return;
    }
    let reads = Dependencies::of(items, |_| true);
    let mut unread: BTreeSet<String> = BTreeSet::new();
    for item in items.iter() {
        if let Some(name) = input_name(item)
            && !reads.needed.contains(&name.text)
        {
            unread.insert(name.text.clone());
        }
    }
    if unread.is_empty() {
        return;
    }
    if let Some(columns) = columns {
        let is_of = |column: &String, name: &str| {
            column.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('['))
        };
        unread.retain(|name| !columns.iter().any(|column| is_of(column, name)));
        return reads.leave_out(unread, items);
    }
    let mut all: Vec<&Item> = Vec::new();
    visit::items(&main.items, &mut |item| {
        if !has_choices(item) {
            all.push(item);
        }
    });
    // One that nothing reads anywhere is there to be shown.
    let anywhere = Dependencies::of(&all, |_| true).needed;
    unread.retain(|name| anywhere.contains(name));
    reads.leave_out(unread, items);
}

/// What an item that binds an input calls it.
fn values_of(item: &Item) -> Vec<&str> {
    match &item.kind {
        ItemKind::Let { name, .. } | ItemKind::Array { declared: ArrayKind::Unknown, name, .. } => {
            vec![&name.text]
        }
        ItemKind::For { items, .. } => items.iter().flat_map(values_of).collect(),
        _ => Vec::new(),
    }
}

/// Which names read which.
struct Dependencies {
    /// Of `let`s and functions: the names in their text.
    values: BTreeMap<String, BTreeSet<String>>,
    /// The names that all else reads, directly or through these.
    needed: BTreeSet<String>,
}

impl Dependencies {
    /// `is_value` says of which `let`s and functions it matters whether something reads them.
    fn of(items: &[&Item], is_value: impl Fn(&str) -> bool) -> Dependencies {
        let mut values: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        let mut others = BTreeSet::new();
        for item in items {
            let is_loop = matches!(item.kind, ItemKind::For { .. });
            visit::parts_mut(&mut (*item).clone(), &mut |part| {
                let Part::Expr(place, expr) = part else { return };
                let mut names = BTreeSet::new();
                names_in(expr, &mut names);
                match place {
                    Role::Let(name) if is_value(&name.text) && !is_loop => {
                        values.entry(name.text.clone()).or_default().extend(names);
                    }
                    Role::Body(name, arguments) if is_value(&name.text) => {
                        for argument in arguments {
                            names.remove(&argument.name.text);
                        }
                        values.entry(name.text.clone()).or_default().extend(names);
                    }
                    _ => others.extend(names),
                }
            });
        }
        let mut needed = BTreeSet::new();
        let mut pending: Vec<String> = others.into_iter().collect();
        while let Some(name) = pending.pop() {
            if needed.insert(name.clone()) {
                pending.extend(values.get(&name).into_iter().flatten().cloned());
            }
        }
        Dependencies { values, needed }
    }

    /// Leaves out these inputs and the values that need one of them.
    fn leave_out(&self, inputs: BTreeSet<String>, items: &mut Vec<&Item>) {
        let lost = self.users(inputs);
        items.retain(|item| match &item.kind {
            ItemKind::Input { name, .. }
            | ItemKind::Array { declared: ArrayKind::Input, name, .. }
            | ItemKind::Let { name, .. }
            | ItemKind::Function { name, .. }
            | ItemKind::Table { name, .. } => !lost.contains(&name.text),
            _ => true,
        });
    }

    /// These names and all values that need one of them.
    fn users(&self, mut names: BTreeSet<String>) -> BTreeSet<String> {
        loop {
            let users = self.values.iter().filter(|(_, reads)| !reads.is_disjoint(&names));
            let found: Vec<String> = users
                .map(|(name, _)| name)
                .filter(|name| !names.contains(*name))
                .cloned()
                .collect();
            if found.is_empty() {
                return names;
            }
            names.extend(found);
        }
    }
}

/// Inputs of one part together, in the order of their names.
fn by_part<'a>(names: &[&'a Name]) -> Vec<Vec<&'a Name>> {
    let mut parts: BTreeMap<&str, Vec<&Name>> = BTreeMap::new();
    for name in names {
        parts.entry(part_of(name)).or_default().push(name);
    }
    parts.into_values().collect()
}

fn part_of(input: &Name) -> &str {
    input.text.rsplit_once('.').map_or("", |(part, _)| part)
}

/// Inputs of one part that are read and not bound.
fn not_bound(inputs: &[&Name], items: &[Item], parts: &[InnerModel]) -> Diagnostic {
    let first = inputs[0];
    let names: Vec<&str> = inputs.iter().map(|name| name.text.as_str()).collect();
    let message = match names.as_slice() {
        [one] => format!("input `{one}` is not bound"),
        all => format!("inputs `{}` are not bound", all.join("`, `")),
    };
    let part = part_of(first);
    let place: Option<Span> = parts.iter().find(|p| p.name == part).map(|part| part.span);
    let what = match choice_with(items, &first.text) {
        Some((variant, choice)) => {
            format!("an input of the part's model with `{variant} = {choice}`")
        }
        None => "an input of the part's model".to_owned(),
    };
    // As the file with the part would have to say it.
    let around = part.rsplit_once('.').map_or(0, |(around, _)| around.len() + 1);
    Diagnostic::new(Code::E220, place.unwrap_or(first.span), message)
        .label(first.span, what)
        .help(format!("say what it is: `{} = …`", &first.text[around..]))
}

/// The variant and the choice within which an input stands.
fn choice_with<'a>(items: &'a [Item], input: &str) -> Option<(&'a str, &'a str)> {
    items.iter().find_map(|item| {
        let ItemKind::Variant { name, choices } = &item.kind else { return None };
        choices.iter().find_map(|choice| {
            let is_there = choice.items.iter().any(
                |item| matches!(&item.kind, ItemKind::Input { name, .. } if name.text == input),
            );
            let own = is_there.then_some((name.text.as_str(), choice.name.text.as_str()));
            own.or_else(|| choice_with(&choice.items, input))
        })
    })
}
