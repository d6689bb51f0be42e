//! Applies choices and settings: inserts variants' items, and checks settings.

use std::collections::BTreeMap;

use super::Variant;
use super::options::{ModelOptions, Setting};
use super::scope::{ModelScope, NameDefinition};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, suggestion};
use crate::parts;
use crate::source::Span;
use crate::syntax::ast::{ArrayKind, Ast, Expr, Item, ItemKind, Name, VariantChoice};
use crate::syntax::edit::element_of;

/// Inserts the items of the chosen variants.
pub(super) fn choose<'a>(
    items: &'a [Item],
    options: &ModelOptions,
    chosen_items: &mut Vec<&'a Item>,
    variants: &mut Vec<Variant>,
    diagnostics: &mut Diagnostics,
) {
    for item in items {
        let ItemKind::Variant { name, choices } = &item.kind else {
            chosen_items.push(item);
            continue;
        };
        if variants.iter().any(|v| v.name == name.text) {
            diagnostics.error(
                Diagnostic::new(
                    Code::DuplicateName,
                    name.span,
                    format!("two variants are called `{}`", name.text),
                )
                .about(&name.text),
            );
            continue;
        }
        for (i, choice) in choices.iter().enumerate() {
            let name = &choice.name;
            if let Some(first) = choices[..i].iter().find(|first| first.name.text == name.text) {
                let message = format!("two choices are called `{}`", name.text);
                diagnostics.error(
                    Diagnostic::new(Code::DuplicateName, name.span, message)
                        .about(&name.text)
                        .label(first.name.span, "first here"),
                );
            }
        }
        let chosen = chosen_of(name, choices, options, diagnostics);
        variants.push(Variant {
            name: name.text.clone(),
            choices: choices.iter().map(|choice| choice.name.text.clone()).collect(),
            chosen,
        });
        if let Some(choice) = choices.get(chosen) {
            choose(&choice.items, options, chosen_items, variants, diagnostics);
        }
    }
}

/// Removes choices that were not made and are impossible with the other choices: they read an unbound input of a part.
pub(super) fn leave_out_impossible(
    variants: &mut [Variant],
    main: &Ast,
    libraries: &[Ast],
    options: &ModelOptions,
) {
    if !parts::has_unbound(main) {
        return;
    }
    let is_possible = |variant: &str, choice: &str| {
        let name = |text: &str| Name { text: text.to_owned(), span: Span::default() };
        let mut other = options.clone();
        other.variants.push((name(variant), name(choice)));
        let mut items: Vec<&Item> = libraries.iter().flat_map(|library| &library.items).collect();
        let mut problems = Diagnostics::default();
        choose(&main.items, &other, &mut items, &mut Vec::new(), &mut problems);
        parts::leave_out_unbound(&mut items, main, &[], &mut problems).is_ok()
    };
    for Variant { name, choices, chosen } in variants {
        let mut kept = Vec::with_capacity(choices.len());
        let mut position = 0;
        for (i, choice) in choices.drain(..).enumerate() {
            if i == *chosen {
                position = kept.len();
            } else if !is_possible(name, &choice) {
                continue;
            }
            kept.push(choice);
        }
        (*choices, *chosen) = (kept, position);
    }
}

fn chosen_of(
    variant: &Name,
    choices: &[VariantChoice],
    options: &ModelOptions,
    diagnostics: &mut Diagnostics,
) -> usize {
    let Some((_, wanted)) = options.variants.iter().rev().find(|(v, _)| v.text == variant.text)
    else {
        return 0;
    };
    choices.iter().position(|choice| choice.name.text == wanted.text).unwrap_or_else(|| {
        let unknown = unknown_choice(
            wanted,
            &format!("variant `{}` has no choice `{}`", variant.text, wanted.text),
            choices.iter().map(|choice| choice.name.text.as_str()),
        );
        diagnostics.error(unknown.about(&variant.text));
        0
    })
}

pub(super) fn unknown_choice<'a>(
    at: &Name,
    message: &str,
    known: impl Iterator<Item = &'a str>,
) -> Diagnostic {
    let known: Vec<&str> = known.collect();
    let diagnostic = Diagnostic::new(Code::UnknownVariant, at.span, message).about(&at.text);
    if known.is_empty() {
        return diagnostic.help("this model has no variants");
    }
    diagnostic.help(match suggestion(&at.text, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there is `{}`", known.join("`, `")),
    })
}

/// Settings by name; checks that each name can be set.
pub(super) fn check_settings<'a>(
    settings: &'a [Setting],
    scope: &ModelScope<'a>,
    diagnostics: &mut Diagnostics,
) -> BTreeMap<&'a str, &'a Expr> {
    let mut checked = BTreeMap::new();
    for Setting { name, value } in settings {
        let element = element_of(&name.text);
        let array = element.as_ref().map_or(name.text.as_str(), |(of, _)| of);
        let entry = scope.names.get(array).map(|entry| entry.definition);
        match entry {
            Some(NameDefinition::Vector(vector))
                if scope.vectors[vector].kind != ArrayKind::Input =>
            {
                checked.insert(name.text.as_str(), value);
            }
            Some(NameDefinition::Array { .. }) if element.is_some() => {
                let message = format!("`{}` is an element of an array of unknowns", name.text);
                diagnostics.error(
                    Diagnostic::new(Code::MisusedName, name.span, message).about(&name.text).help(
                        format!(
                            "set them all: `{array}=…`, or `{array}=(…, …)` with a value for each"
                        ),
                    ),
                );
            }
            Some(definition)
                if element.is_some() && !matches!(definition, NameDefinition::Vector(_)) =>
            {
                let message = format!("`{array}` is {}, not an array", definition.noun());
                diagnostics
                    .error(Diagnostic::new(Code::ArrayAsNumber, name.span, message).about(array));
            }
            Some(
                NameDefinition::Constant(_)
                | NameDefinition::Parameter(_)
                | NameDefinition::Unknown { .. }
                | NameDefinition::Size
                | NameDefinition::Array { .. },
            ) => {
                checked.insert(name.text.as_str(), value);
            }
            Some(other) => {
                diagnostics.error(cannot_be_set(name, other.noun()));
            }
            None if scope.outputs.contains_key(name.text.as_str()) => {
                diagnostics.error(cannot_be_set(name, "an output"));
            }
            None => {
                let mut diagnostic = Diagnostic::new(
                    Code::UnknownName,
                    name.span,
                    format!("nothing is called `{}`", name.text),
                )
                .about(&name.text);
                if let Some(near) = suggestion(&name.text, scope.names.keys().copied()) {
                    diagnostic.help = Some(format!("did you mean `{near}`?").into());
                }
                diagnostics.error(diagnostic);
            }
        }
    }
    checked
}

fn cannot_be_set(name: &Name, noun: &str) -> Diagnostic {
    let message = format!("`{}` is {noun}, which cannot be set", name.text);
    Diagnostic::new(Code::MisusedName, name.span, message)
        .about(&name.text)
        .help("set a constant, a parameter or the start value of a state")
}
