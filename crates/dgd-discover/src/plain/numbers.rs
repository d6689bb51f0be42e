//! Numbers of a model's text that may be wrong: constants, and parameters that are not estimated.

use std::collections::BTreeSet;

use dgd_compiler::model::Model;
use dgd_compiler::syntax::ast::{Attribute, AttributeKind, Expr, ExprKind, Item, ItemKind, Name};
use dgd_compiler::syntax::visit;

use super::model_number::ModelNumber;
use super::suspicion::{SuspectModel, Suspicion};
use crate::fit::FittedStructure;
use crate::library::BaseModel;

/// All numbers that may be wrong, in the order of the text.
pub(super) fn suspects(
    base: &BaseModel,
    model: &Model,
    fitted: &FittedStructure,
) -> Vec<SuspectModel> {
    let numbers = all(base, model).into_iter();
    let unestimated = numbers.filter(|number| !number.is_estimated(fitted));
    unestimated
        .map(|number| SuspectModel {
            position: 0,
            base: Some(estimating(base, &number)),
            suspicion: Suspicion::Number(number),
            changed: None,
        })
        .collect()
}

/// Constants that are plain numbers, and parameters, in the order of the text.
pub(super) fn all(base: &BaseModel, model: &Model) -> Vec<ModelNumber> {
    let mut numbers = Vec::new();
    visit::items(&base.asts[0].items, &mut |item| {
        numbers.extend(match &item.kind {
            ItemKind::Constant { name, value, .. } if is_number(value) => of_constant(model, name),
            ItemKind::Parameter { name, value, .. } if is_number(value) => {
                of_parameter(base, model, name)
            }
            _ => None,
        });
    });
    numbers
}

fn of_constant(model: &Model, name: &Name) -> Option<ModelNumber> {
    let constant = model.constants.iter().find(|own| own.declared.name == name.text)?;
    let (name, unit, declared) =
        (name.text.clone(), constant.declared.unit.clone(), constant.value);
    Some(ModelNumber { name, is_constant: true, declared, unit })
}

/// A parameter, unless the user fixed it.
fn of_parameter(base: &BaseModel, model: &Model, name: &Name) -> Option<ModelNumber> {
    let parameter = model.parameters.iter().find(|own| own.declared.name == name.text)?;
    if base.fix.contains(&name.text) {
        return None;
    }
    let (name, unit, declared) =
        (name.text.clone(), parameter.declared.unit.clone(), parameter.value);
    Some(ModelNumber { name, is_constant: false, declared, unit })
}

/// The model with a number estimated.
fn estimating(base: &BaseModel, number: &ModelNumber) -> BaseModel {
    let mut base = as_parameter(base, number);
    visit::items_mut(&mut base.asts[0].items, &mut |item| {
        if let ItemKind::Parameter { name, attributes, .. } = &mut item.kind
            && name.text == number.name
        {
            attributes.retain(|attribute| attribute.kind != AttributeKind::Fixed);
        }
    });
    if !base.free.is_empty() {
        base.free.push(number.name.clone());
    }
    base
}

/// The model with a constant as a parameter.
pub(super) fn as_parameter(base: &BaseModel, number: &ModelNumber) -> BaseModel {
    let mut base = base.clone();
    if !number.is_constant {
        return base;
    }
    let items = &mut base.asts[0].items;
    let others = dependants(items, &number.name);
    visit::items_mut(items, &mut |item| {
        if let ItemKind::Constant { name, unit, value } = &item.kind {
            let (name, unit, value) = (name.clone(), unit.clone(), value.clone());
            if name.text == number.name {
                // Its sign is not in doubt.
                let log = AttributeKind::Log;
                let log = Attribute { span: value.span, kind: log };
                let attributes = if number.declared > 0.0 { vec![log] } else { Vec::new() };
                item.kind = ItemKind::Parameter { name, unit, value, attributes };
            } else if others.contains(&name.text) {
                item.kind = ItemKind::Let { name, unit, value };
            }
        }
    });
    base
}

/// Constants that are computed from another one.
fn dependants(items: &[Item], name: &str) -> BTreeSet<String> {
    let mut dependants = BTreeSet::from([name.to_owned()]);
    loop {
        let before = dependants.len();
        visit::items(items, &mut |item| {
            if let ItemKind::Constant { name, value, .. } = &item.kind
                && dependants.iter().any(|known| reads(value, known))
            {
                dependants.insert(name.text.clone());
            }
        });
        if dependants.len() == before {
            dependants.remove(name);
            return dependants;
        }
    }
}

fn reads(expr: &Expr, name: &str) -> bool {
    matches!(&expr.kind, ExprKind::Name(own) if own == name)
        || visit::operands(expr).into_iter().any(|operand| reads(operand, name))
}

/// Whether a value is a plain number.
fn is_number(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Number { .. } => true,
        ExprKind::Negate(inner) | ExprKind::Group(inner) => is_number(inner),
        _ => false,
    }
}
