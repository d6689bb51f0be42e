//! Instantiates a part of a model: prefixes its names, applies arguments, turns outputs into values.

use std::collections::{BTreeMap, BTreeSet};

use super::binding::PartInput;
use super::expanded::ExpandedModel;
use super::indices::free_indices;
use super::names::declared;
use super::several::PartIndices;
use super::written::WrittenPart;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported, suggestion};
use crate::syntax::ast::{
    ArrayKind, Expr, ExprKind, Item, ItemKind, Name, PartArgument, VariantChoice, WrittenUnit,
};
use crate::syntax::rename::Renaming;
use crate::syntax::visit::{self, Namespace};

/// A part's items, with the names of the enclosing model.
#[derive(Debug, Clone)]
pub(super) struct PartInstance {
    /// All items; bound inputs are removed once the bindings are known.
    pub(super) items: Vec<Item>,
    /// Its inputs, by name.
    pub(super) inputs: BTreeMap<String, PartInput>,
    /// All its names that can be read.
    pub(super) values: BTreeSet<String>,
}

/// Makes a part of a model, or with `axes` one for each index. Adds the constants and parameters that arguments set to
/// `set`; `taken` are the names declared by the whole.
pub(super) fn instance(
    written: &WrittenPart<'_>,
    inner: ExpandedModel,
    taken: &BTreeSet<String>,
    set: &mut BTreeSet<String>,
    diagnostics: &mut Diagnostics,
) -> Result<PartInstance, ErrorReported> {
    let WrittenPart { name: part, axes, model, arguments, .. } = *written;
    let ExpandedModel { mut items, set: inner_set, .. } = inner;
    free_indices(&mut items, taken);
    let mut names = Renaming::default();
    for (namespace, name) in declared(&mut items) {
        let new = format!("{}.{name}", part.text);
        names.insert(namespace, name, new);
    }
    for item in &mut items {
        names.rename_item(item);
    }
    set.extend(inner_set.iter().map(|name| format!("{}.{name}", part.text)));

    let mut inputs = inputs_of(part, &items);
    let mut values = BTreeSet::new();
    for (namespace, name) in declared(&mut items) {
        if namespace == Namespace::Value && !inputs.contains_key(&name) {
            values.insert(name);
        }
    }
    outputs_as_values(&mut items, &values);
    let several = PartIndices::new(part, axes, &mut items, taken);
    let mut differing = BTreeSet::new();
    let mut problems = Diagnostics::default();
    for (i, argument) in arguments.iter().enumerate() {
        let same = |other: &&PartArgument| other.name.text == argument.name.text;
        if let Some(first) = arguments[..i].iter().find(same) {
            let message = format!("`{}` is given twice", argument.name.text);
            problems.error(
                Diagnostic::new(Code::DuplicateName, argument.name.span, message)
                    .about(&argument.name.text)
                    .label(first.name.span, "first here"),
            );
        }
        let name = format!("{}.{}", part.text, argument.name.text);
        if inputs.contains_key(&name) {
            let message = format!("`{}` is an input of `{}`", argument.name.text, model.text);
            let help = format!("bind it in a line of its own: `{name} = …`");
            problems.error(
                Diagnostic::new(Code::MisusedName, argument.name.span, message)
                    .about(&argument.name.text)
                    .about(&model.text)
                    .help(help),
            );
        } else {
            let written = several.argument(argument);
            match give(&mut items, &name, &written, model, set) {
                Ok(()) if several.differs(&written.value, is_array(&items, &name)) => {
                    differing.insert(name);
                }
                Ok(()) => {}
                Err(diagnostic) => {
                    problems.error(*diagnostic);
                }
            }
        }
    }
    if !several.is_one() && problems.check().is_ok() {
        match several.spread(items, part, differing) {
            Ok(spread) => items = spread,
            Err(mistakes) => {
                items = Vec::new();
                for mistake in mistakes {
                    problems.error(mistake);
                }
            }
        }
        inputs = inputs_of(part, &items);
    }
    for diagnostic in problems.sorted() {
        diagnostics.error(diagnostic.clone());
    }
    problems.check()?;
    Ok(PartInstance { items, inputs, values })
}

/// The units of a part's inputs, without those of nested parts.
fn inputs_of(part: &Name, items: &[Item]) -> BTreeMap<String, PartInput> {
    let mut inputs = BTreeMap::new();
    visit::items(items, &mut |item| {
        let (name, unit, axes) = match &item.kind {
            ItemKind::Input { name, unit, .. } => (name, unit, Vec::new()),
            ItemKind::Array { declared: ArrayKind::Input, name, unit, axes, .. } => {
                (name, unit, axes.clone())
            }
            _ => return,
        };
        if !name.text[part.text.len() + 1..].contains('.') {
            let unit = unit.clone().unwrap_or_else(|| WrittenUnit::one(name.span));
            inputs.entry(name.text.clone()).or_insert(PartInput { unit, axes });
        }
    });
    inputs
}

/// Whether a name belongs to an array.
fn is_array(items: &[Item], name: &str) -> bool {
    let mut any = false;
    visit::items(items, &mut |item| {
        any |= matches!(&item.kind, ItemKind::Array { name: own, .. } if own.text == name);
    });
    any
}

impl PartInstance {
    /// Removes bound inputs from the items.
    pub(super) fn remove_inputs(&mut self, is_bound: &dyn Fn(&str) -> bool) {
        without_inputs(&mut self.items, is_bound);
    }
}

fn without_inputs(items: &mut Vec<Item>, is_bound: &dyn Fn(&str) -> bool) {
    items.retain_mut(|item| match &mut item.kind {
        ItemKind::Input { name, .. } | ItemKind::Array { declared: ArrayKind::Input, name, .. } => {
            !is_bound(&name.text)
        }
        ItemKind::Variant { choices, .. } => {
            for choice in choices {
                without_inputs(&mut choice.items, is_bound);
            }
            true
        }
        _ => true,
    });
}

/// Turns outputs into `let`s. An output with the name of an unknown is dropped: the name denotes the unknown.
fn outputs_as_values(items: &mut Vec<Item>, values: &BTreeSet<String>) {
    items.retain_mut(|item| match &mut item.kind {
        ItemKind::Output { name, unit, value: Some(value), .. } if !values.contains(&name.text) => {
            let unit = Some(unit.take().unwrap_or_else(|| WrittenUnit::one(name.span)));
            item.kind = ItemKind::Let { name: name.clone(), unit, value: value.clone() };
            true
        }
        ItemKind::Output { .. } => false,
        ItemKind::Variant { choices, .. } => {
            for choice in choices {
                outputs_as_values(&mut choice.items, values);
            }
            true
        }
        _ => true,
    });
}

/// Sets the value, start value or choice of a name.
fn give(
    items: &mut [Item],
    name: &str,
    argument: &PartArgument,
    model: &Name,
    set: &mut BTreeSet<String>,
) -> Result<(), Box<Diagnostic>> {
    let mut settable: Vec<String> = Vec::new();
    let mut other = None;
    let mut given_kind = None;
    visit::items_mut(items, &mut |item| match &mut item.kind {
        ItemKind::Constant { name: own, value, .. }
        | ItemKind::Parameter { name: own, value, .. }
        | ItemKind::Size { name: own, value } => {
            settable.push(own.text.clone());
            if own.text == name {
                *value = argument.value.clone();
                set.insert(name.to_owned());
                given_kind = Some(Ok(()));
            }
        }
        ItemKind::Unknown { name: own, start, .. } | ItemKind::Array { name: own, start, .. } => {
            settable.push(own.text.clone());
            if own.text == name {
                *start = Some(argument.value.clone());
                given_kind = Some(Ok(()));
            }
        }
        ItemKind::Variant { name: own, choices } => {
            settable.push(own.text.clone());
            // A value of that name takes precedence.
            if own.text == name && given_kind.is_none() {
                given_kind = Some(choose(choices, name, &argument.value));
            }
        }
        ItemKind::Let { name: own, .. }
        | ItemKind::Function { name: own, .. }
        | ItemKind::Table { name: own, .. } => {
            other = other.or((own.text == name).then_some(own.span));
        }
        ItemKind::Import { .. }
        | ItemKind::Input { .. }
        | ItemKind::Output { .. }
        | ItemKind::Equation { .. }
        | ItemKind::Modes { .. }
        | ItemKind::For { .. }
        | ItemKind::When(_)
        | ItemKind::Every { .. }
        | ItemKind::Unit { .. }
        | ItemKind::Start(_)
        | ItemKind::Saturate { .. }
        | ItemKind::Part { .. }
        | ItemKind::Binding { .. } => {}
    });
    if let Some(given_kind) = given_kind {
        return given_kind;
    }
    let argument_name = &argument.name;
    if let Some(place) = other {
        let message = format!("`{}` cannot be given a value", argument_name.text);
        return Err(Box::new(
            Diagnostic::new(Code::MisusedName, argument_name.span, message)
                .about(&argument_name.text)
                .label(place, "it is worked out here")
                .help("a constant, a parameter, the start value of a state or a variant can"),
        ));
    }
    let message = format!("model `{}` has no `{}`", model.text, argument_name.text);
    let prefix = name.len() - argument_name.text.len();
    let known = settable.iter().map(|name| &name[prefix..]);
    let near = suggestion(&argument_name.text, known).map(|near| format!("did you mean `{near}`?"));
    Err(Box::new(
        Diagnostic::new(Code::UnknownName, argument_name.span, message)
            .about(&model.text)
            .about(&argument_name.text)
            .maybe_help(near),
    ))
}

/// Makes a choice the first, and so the default.
fn choose(
    choices: &mut [VariantChoice],
    variant: &str,
    wanted: &Expr,
) -> Result<(), Box<Diagnostic>> {
    let name = match &wanted.kind {
        ExprKind::Name(name) => name.as_str(),
        _ => "",
    };
    if let Some(position) = choices.iter().position(|choice| choice.name.text == name) {
        choices[..=position].rotate_right(1);
        return Ok(());
    }
    let known: Vec<&str> = choices.iter().map(|choice| choice.name.text.as_str()).collect();
    let message = format!("variant `{variant}` has no such choice");
    let help = match suggestion(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there is `{}`", known.join("`, `")),
    };
    Err(Box::new(
        Diagnostic::new(Code::UnknownVariant, wanted.span, message).about(variant).help(help),
    ))
}
