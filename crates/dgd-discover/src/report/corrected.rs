//! Writes the text of the corrected model.

use std::collections::BTreeMap;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::effects::write;
use dgd_compiler::source::{SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::{ArrayKind, Ast, Attribute, AttributeKind, ItemKind};
use dgd_compiler::syntax::edit::{ElementText, NewValue, element_of, list_of, with_values};
use dgd_compiler::syntax::{layout, parse, visit};
use dgd_runtime::System;

use crate::fit::FittedStructure;
use crate::library::BaseModel;
use crate::plain::is_brought;
use crate::request::DiscoverError;

/// Digits of a parameter, far more than any data determines.
const DIGITS: usize = 9;

/// The base model's text with the effects of a fitted structure, and its parameters.
///
/// # Errors
///
/// [`DiscoverError::Corrected`] if that text cannot be read.
pub(crate) fn corrected(
    base: &BaseModel,
    sources: &SourceMap,
    fitted: &FittedStructure,
) -> Result<String, DiscoverError> {
    let structure = &fitted.structure;
    let text = if structure.id.is_base() {
        with_interpolations(
            &base.asts[0],
            &structure.asts[0],
            &sources.get(base.asts[0].source).text,
        )
    } else {
        write(&base.asts[0], &structure.asts[0], &structure.brought, sources)
    };
    let mut extended = sources.clone();
    let name = sources.get(base.asts[0].source).name.clone();
    let id = extended.add(SourceText { name, text: text.clone() });
    let mut diagnostics = Diagnostics::default();
    let ast = parse(id, &extended, &mut diagnostics).map_err(|_| {
        let messages = diagnostics.sorted().into_iter().map(|one| one.message.clone());
        DiscoverError::Corrected(messages.collect::<Vec<_>>().join("; "))
    })?;
    let mut declared: Vec<(String, Span)> = Vec::new();
    visit::items(&ast.items, &mut |item| {
        if let ItemKind::Parameter { name, .. }
        | ItemKind::Constant { name, .. }
        | ItemKind::Array { declared: ArrayKind::Parameter, name, .. } = &item.kind
        {
            declared.push((name.text.clone(), name.span));
        }
    });
    let parameters = structure.system.signature().parameters.iter();
    let estimated =
        |name: &str| fitted.estimates.iter().any(|e| e.recording.is_none() && e.name == name);
    let values: Vec<NewValue> = parameters
        .zip(&fitted.p)
        .filter(|(parameter, _)| estimated(&parameter.name) && !is_brought(&parameter.name))
        .flat_map(|(parameter, value)| {
            let unit = &parameter.unit;
            let text = number(unit.from_si(*value));
            let places = declared.iter().filter(|(name, _)| *name == *parameter.name);
            let places: Vec<Span> = places.map(|(_, span)| *span).collect();
            // Declarations of parts are not in this text.
            let places = if places.is_empty() { vec![Span::default()] } else { places };
            let called = parameter.name.to_string();
            places.into_iter().map(move |name| NewValue {
                name,
                called: called.clone(),
                text: text.clone(),
            })
        })
        .collect();
    let values: Vec<NewValue> = values.into_iter().chain(arrays(fitted, &declared)).collect();
    let valued = with_values(&ast, &text, &values, |_| None);
    // Numbers of different lengths shift columns.
    Ok(layout::like(id, &extended, valued))
}

/// The base model's text with the interpolations that another one declares for its inputs.
fn with_interpolations(base: &Ast, other: &Ast, text: &str) -> String {
    fn declared(ast: &Ast) -> Vec<&Attribute> {
        let mut interpolations = Vec::new();
        visit::items(&ast.items, &mut |item| {
            if let ItemKind::Input { name, attributes, .. } = &item.kind
                && !is_brought(&name.text)
            {
                interpolations.extend(
                    attributes.iter().filter(|one| {
                        matches!(one.kind, AttributeKind::Hold | AttributeKind::Linear)
                    }),
                );
            }
        });
        interpolations
    }
    let base_interpolations = declared(base);
    let mut text = text.to_owned();
    let changed = declared(other).into_iter().filter(|one| !base_interpolations.contains(one));
    // From the end, so that earlier positions stay valid.
    for one in changed.collect::<Vec<_>>().into_iter().rev() {
        let word = if one.kind == AttributeKind::Hold { "hold" } else { "linear" };
        let (start, end) = (one.span.start as usize, one.span.end as usize);
        let space = if start == end { " " } else { "" };
        text.replace_range(start..end, &format!("{space}{word}"));
    }
    text
}

/// All values of the arrays of parameters of which an element was estimated.
fn arrays(fitted: &FittedStructure, declared: &[(String, Span)]) -> Vec<NewValue> {
    let mut arrays: BTreeMap<&str, (bool, Vec<ElementText>)> = BTreeMap::new();
    for (parameter, value) in fitted.structure.system.signature().parameters.iter().zip(&fitted.p) {
        let Some((array, indices)) = element_of(&parameter.name) else { continue };
        let (estimated, values) = arrays.entry(array).or_default();
        *estimated |=
            fitted.estimates.iter().any(|e| e.recording.is_none() && e.name == *parameter.name);
        values.push((indices, number(parameter.unit.from_si(*value))));
    }
    let mut new_values = Vec::new();
    for (array, (_, values)) in arrays.into_iter().filter(|(_, (estimated, _))| *estimated) {
        let places = declared.iter().filter(|(name, _)| name == array).map(|(_, span)| *span);
        let mut places: Vec<Span> = places.collect();
        if places.is_empty() {
            places.push(Span::default());
        }
        let text = list_of(&values);
        new_values.extend(places.into_iter().map(|name| NewValue {
            name,
            called: array.to_owned(),
            text: text.clone(),
        }));
    }
    new_values
}

/// A number to `DIGITS` digits, in plain notation.
fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value);
    if rounded != 0.0 && !(1e-3..1e6).contains(&rounded.abs()) {
        format!("{rounded:e}")
    } else {
        format!("{rounded}")
    }
}
