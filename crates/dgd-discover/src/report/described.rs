//! Effects that resemble the recordings if no effect passes.

use std::fmt::Write as _;

use dgd_compiler::syntax::ast::{AttributeKind, Expr, ExprKind, ItemKind};
use dgd_compiler::syntax::print::print;
use dgd_runtime::System;

use super::discovery::ResemblingEffect;
use super::found::parameters;
use super::model_spread::ModelSpread;
use crate::fit::FittedStructure;
use crate::library::{StructureId, signed};
use crate::search::EffectSearch;

/// The effects of a structure that describes the recordings.
pub(crate) fn described(
    search: &EffectSearch<'_>,
    structure: StructureId,
) -> Vec<ResemblingEffect> {
    let Some(fitted) = search.fitted(structure) else { return Vec::new() };
    let model_spread = ModelSpread::from_structure(search, structure, fitted, &search.data);
    let left =
        (search.training_square(structure).unwrap_or(f64::NAN), search.held_out_square(structure));
    let one = |candidate: usize| {
        let described = &search.candidates[candidate];
        let brought = fitted.structure.brought_by(candidate);
        let names = brought.map(|brought| brought.parameters.clone()).unwrap_or_default();
        ResemblingEffect {
            name: described.application.name(),
            kind: described.kind(),
            form: described.form(),
            target: described.target(),
            parameters: parameters(fitted, &model_spread, &names),
            left,
            file: text(search, fitted, candidate),
            arguments: described
                .application
                .arguments
                .iter()
                .map(|name| name.text.clone())
                .collect(),
        }
    };
    structure.effects().map(one).collect()
}

/// An effect's text with the fitted values of its parameters.
fn text(search: &EffectSearch<'_>, fitted: &FittedStructure, candidate: usize) -> String {
    let described = &search.candidates[candidate];
    let mut ast = described.application.effect.ast.clone();
    let signature = fitted.structure.system.signature();
    let brought = fitted.structure.brought_by(candidate);
    let value = |own: &str| {
        let (_, name) = brought?.names.iter().find(|(known, _)| known == own)?;
        let parameter = signature.parameters.iter().find(|p| *p.name == **name)?;
        let value = fitted.values.p.get(name).copied()?;
        Some(value / parameter.unit.factor)
    };
    for item in &mut ast.items {
        let ItemKind::Parameter { name, value: own, attributes, .. } = &mut item.kind else {
            continue;
        };
        let Some(value) = value(&name.text) else { continue };
        *own = signed(value, own, written);
        // A value at a bound may, after rounding, lie outside it.
        for attribute in attributes {
            if let AttributeKind::Bounds(lower, upper) = &mut attribute.kind {
                let beyond = |bound: &Expr, side: f64| {
                    matches!(
                        bound.kind, ExprKind::Number { value: limit, .. } if side * (limit - value) > 0.0
                    )
                };
                if lower.as_ref().is_some_and(|bound| beyond(bound, 1.0)) {
                    *lower = None;
                }
                if upper.as_ref().is_some_and(|bound| beyond(bound, -1.0)) {
                    *upper = None;
                }
            }
        }
    }
    let mut text = print(&ast);
    if !text.ends_with('\n') {
        let _ = writeln!(text);
    }
    text
}

/// A magnitude in plain notation, to the last digit.
fn written(size: f64) -> String {
    if (1e-3..1e6).contains(&size) || size == 0.0 { format!("{size}") } else { format!("{size:e}") }
}
