//! Finds the arguments that a template can have in a model.

use super::Effect;
use crate::expr::Symbol;
use crate::model::Model;
use crate::syntax::ast::{EffectTarget, SlotKind, TemplateSlot};
use crate::units::{Dimension, parse_unit};

/// All lists of arguments that an effect can have in a model, in the order of the model's items.
///
/// An effect `on` this model has one list, which is empty; one `on` another model has none. The slots of a template get
/// different arguments. If a template has several states, each followed by an equation, these are balances of the
/// states: they contain their derivatives. The states are then in the order of the model because a flow from one to the
/// other is the negative of the reverse flow.
pub fn bind(effect: &Effect, model: &Model) -> Vec<Vec<String>> {
    let slots = match &effect.target {
        EffectTarget::Model(name) if name.text == model.name => return vec![Vec::new()],
        EffectTarget::Model(_) => return Vec::new(),
        EffectTarget::Template(slots) => slots,
    };
    let mut lists: Vec<Vec<String>> = vec![Vec::new()];
    for slot in slots {
        let names = candidates(slot, model);
        let longer = |list: &Vec<String>| {
            let unused = names.iter().filter(|name| !list.iter().any(|used| used == *name));
            let longer: Vec<Vec<String>> =
                unused.map(|name| [list.as_slice(), &[(*name).to_owned()]].concat()).collect();
            longer
        };
        lists = lists.iter().flat_map(longer).collect();
    }
    lists.retain(|list| are_balances_in_order(slots, list, model));
    lists
}

/// Whether each equation that follows a state contains its derivative, and several states are in order.
fn are_balances_in_order(slots: &[TemplateSlot], list: &[String], model: &Model) -> bool {
    let kinds: Vec<SlotKind> = slots.iter().map(|slot| slot.kind).collect();
    let pairs: Vec<usize> = (0..kinds.len().saturating_sub(1))
        .filter(|&k| kinds[k..k + 2] == [SlotKind::State, SlotKind::Equation])
        .collect();
    if pairs.len() < 2 {
        return true;
    }
    let position =
        |state: &str| model.unknowns.iter().position(|unknown| unknown.declared.name == state);
    let is_balance = |state: usize, label: &str| {
        let rate = Symbol::Derivative(state as u32);
        let labelled = model.all_equations().filter(|equation| equation.label == label);
        let mut sides = labelled.flat_map(|equation| [equation.left, equation.right]);
        sides.any(|side| model.graph.symbols(side).contains(&rate))
    };
    let states: Option<Vec<usize>> = pairs.iter().map(|&k| position(&list[k])).collect();
    states.is_some_and(|states| {
        states.is_sorted() && pairs.iter().zip(&states).all(|(&k, &x)| is_balance(x, &list[k + 1]))
    })
}

/// The names of a model with the kind and the dimension of a slot, except those of exact equations, which lack no term.
fn candidates<'a>(slot: &TemplateSlot, model: &'a Model) -> Vec<&'a str> {
    let named: Vec<(&str, Dimension)> = match slot.kind {
        SlotKind::Input => {
            let inputs = model.inputs.iter().map(|input| &input.declared);
            inputs.map(|declared| (declared.name.as_str(), declared.unit.dimension)).collect()
        }
        SlotKind::Output => {
            let outputs = model.outputs.iter().map(|output| &output.declared);
            outputs.map(|declared| (declared.name.as_str(), declared.unit.dimension)).collect()
        }
        SlotKind::State => {
            let states = model.unknowns.iter().filter(|unknown| unknown.state);
            states.map(|u| (u.declared.name.as_str(), u.declared.unit.dimension)).collect()
        }
        SlotKind::Quantity => {
            let inputs = model.inputs.iter().map(|input| &input.declared);
            let quantities = inputs.chain(model.unknowns.iter().map(|unknown| &unknown.declared));
            quantities.map(|declared| (declared.name.as_str(), declared.unit.dimension)).collect()
        }
        SlotKind::Let => model.lets.iter().map(|own| (own.name.as_str(), own.dimension)).collect(),
        SlotKind::Parameter => {
            let parameters = model.parameters.iter().map(|parameter| &parameter.declared);
            parameters.map(|declared| (declared.name.as_str(), declared.unit.dimension)).collect()
        }
        SlotKind::Equation => {
            let mut labels: Vec<(&str, Dimension)> = Vec::new();
            for equation in model.all_equations().filter(|equation| !equation.is_exact) {
                // A change of an equation affects all equations of its label, in all modes.
                if labels.iter().all(|(label, _)| *label != equation.label) {
                    labels.push((&equation.label, equation.dimension));
                }
            }
            labels
        }
    };
    // The unit was checked when the effect was read.
    let wanted = slot.unit.as_ref().and_then(|unit| parse_unit(&unit.text).ok());
    let fits = |dimension: Dimension| wanted.as_ref().is_none_or(|u| u.dimension == dimension);
    named.into_iter().filter(|(_, dimension)| fits(*dimension)).map(|(name, _)| name).collect()
}
