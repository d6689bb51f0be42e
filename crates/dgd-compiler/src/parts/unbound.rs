//! Removes inputs that the chosen variants do not read: unbound ones of parts, and those of the model that only other
//! choices read. Values that need them are removed, too. Reading an unbound input is an error.

use std::collections::{BTreeMap, BTreeSet};

use super::flat_model::InnerModel;
use super::names::names_in;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::source::Span;
use crate::syntax::ast::{ArrayKind, Ast, Item, ItemKind, Name};
use crate::syntax::visit::{self, ExprRole, ItemPart};

/// Whether a model has unbound inputs of parts in any of its variants.
pub(crate) fn has_unbound(main: &Ast) -> bool {
    let mut any = false;
    visit::items(&main.items, &mut |item| any |= is_of_part(item, main));
    any
}

/// Whether an item is an input of a part: its file differs from that of the model.
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

/// Removes from the chosen items of a model the unbound inputs of its parts, and unread values that depend on them.
///
/// # Errors
///
/// [`ErrorReported`] if an unbound input is read (E220).
pub(crate) fn leave_out_unbound(
    items: &mut Vec<&Item>,
    main: &Ast,
    parts: &[InnerModel],
    diagnostics: &mut Diagnostics,
) -> Result<(), ErrorReported> {
    let of_part = |item: &&&Item| is_of_part(item, main);
    if !items.iter().any(|item| of_part(&item)) {
        return Ok(());
    }
    let bound: BTreeSet<&str> = items.iter().flat_map(|item| values_of(item)).collect();
    let inputs = items.iter().filter(of_part).filter_map(|item| input_name(item));
    let inputs = inputs.filter(|name| !bound.contains(name.text.as_str()));
    let unbound: BTreeMap<&str, &Name> = inputs.map(|name| (name.text.as_str(), name)).collect();
    // The whole's own lines must be valid whether or not they are read.
    let reads = NameDependencies::collect(items, |name| name.contains('.'));
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

/// Removes from the chosen items the inputs that only other choices of variants read, which need no data. If the data
/// columns are known, removes the unread inputs without a column.
pub(crate) fn leave_out_unread_inputs(
    items: &mut Vec<&Item>,
    main: &Ast,
    columns: Option<&[String]>,
) {
    let has_choices = |item: &Item| matches!(item.kind, ItemKind::Variant { .. });
    if columns.is_none() && !main.items.iter().any(has_choices) {
        return;
    }
    let reads = NameDependencies::collect(items, |_| true);
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
    let mut chosen: Vec<&Item> = Vec::new();
    visit::items(&main.items, &mut |item| {
        if !has_choices(item) {
            chosen.push(item);
        }
    });
    // An input that no choice reads is kept for display.
    let anywhere = NameDependencies::collect(&chosen, |_| true).needed;
    unread.retain(|name| anywhere.contains(name));
    reads.leave_out(unread, items);
}

/// The value that binds an input.
fn values_of(item: &Item) -> Vec<&str> {
    match &item.kind {
        ItemKind::Let { name, .. } | ItemKind::Array { declared: ArrayKind::Unknown, name, .. } => {
            vec![&name.text]
        }
        ItemKind::For { items, .. } => items.iter().flat_map(values_of).collect(),
        _ => Vec::new(),
    }
}

/// Dependencies between names.
struct NameDependencies {
    /// For `let`s and functions: the names in their text.
    values: BTreeMap<String, BTreeSet<String>>,
    /// The names read by other items, directly or through these.
    needed: BTreeSet<String>,
}

impl NameDependencies {
    /// `is_value` selects the `let`s and functions that only count if they are read.
    fn collect(items: &[&Item], is_value: impl Fn(&str) -> bool) -> NameDependencies {
        let mut values: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        let mut others = BTreeSet::new();
        for item in items {
            let is_loop = matches!(item.kind, ItemKind::For { .. });
            visit::parts_mut(&mut (*item).clone(), &mut |part| {
                let ItemPart::Expr(place, expr) = part else { return };
                let mut names = BTreeSet::new();
                names_in(expr, &mut names);
                match place {
                    ExprRole::Let(name) if is_value(&name.text) && !is_loop => {
                        values.entry(name.text.clone()).or_default().extend(names);
                    }
                    ExprRole::Body(name, arguments) if is_value(&name.text) => {
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
        NameDependencies { values, needed }
    }

    /// Removes these inputs and the values that depend on them.
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

    /// These names and all values that depend on them.
    fn users(&self, mut names: BTreeSet<String>) -> BTreeSet<String> {
        loop {
            let users = self.values.iter().filter(|(_, reads)| !reads.is_disjoint(&names));
            let added: Vec<String> = users
                .map(|(name, _)| name)
                .filter(|name| !names.contains(*name))
                .cloned()
                .collect();
            if added.is_empty() {
                return names;
            }
            names.extend(added);
        }
    }
}

/// Inputs grouped by part, ordered by name.
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

/// The error for unbound inputs of one part that are read.
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
    // The name in the file that contains the part.
    let around = part.rsplit_once('.').map_or(0, |(around, _)| around.len() + 1);
    let diagnostic = Diagnostic::new(Code::UnboundInput, place.unwrap_or(first.span), message);
    let diagnostic = names.iter().fold(diagnostic, Diagnostic::about);
    diagnostic
        .label(first.span, what)
        .help(format!("say what it is: `{} = …`", &first.text[around..]))
}

/// The variant and the choice that contain an input.
fn choice_with<'a>(items: &'a [Item], input: &str) -> Option<(&'a str, &'a str)> {
    items.iter().find_map(|item| {
        let ItemKind::Variant { name, choices } = &item.kind else { return None };
        choices.iter().find_map(|choice| {
            let is_there = choice.items.iter().any(
                |item| matches!(&item.kind, ItemKind::Input { name, .. } if name.text == input),
            );
            let pair = is_there.then_some((name.text.as_str(), choice.name.text.as_str()));
            pair.or_else(|| choice_with(&choice.items, input))
        })
    })
}
