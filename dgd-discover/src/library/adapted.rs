//! Templates in the measure of the recordings.
//!
//! A template fits any model, so that its constants cannot be seconds or metres. Where its text has
//!
//! | name | stands for |
//! |---|---|
//! | `interval` | the usual distance of samples, s |
//! | `duration` | the length of the longest training recording, s |
//! | `size(x)` | the largest size of the state x in the fitted base model, in its unit |
//!
//! in a value, a bound or a nominal, numbers take their place before it is tried.

use dgd_compiler::effects::{Effect, bind};
use dgd_compiler::model::Model;
use dgd_compiler::syntax::ast::{AttributeKind, Expr, ExprKind, Factor, ItemKind, Target};
use dgd_identify::Recording;
use dgd_screen::usual_spacing;

use super::levels::Ranges;

/// A template with what it is applied to.
pub(crate) struct Adapted {
    pub effect: Effect,
    pub arguments: Vec<String>,
}

/// All ways to apply templates to a model, in the measure of what was recorded.
pub(crate) fn adapted(
    templates: &[Effect],
    model: &Model,
    recordings: &[Recording],
    ranges: &Ranges,
) -> Vec<Adapted> {
    let spacings = recordings.iter().filter_map(|recording| usual_spacing(&recording.times));
    let interval = spacings.fold(f64::INFINITY, f64::min);
    let length = |recording: &Recording| match recording.times.as_slice() {
        [first, .., last] => last - first,
        _ => 0.0,
    };
    let duration = recordings.iter().map(length).fold(0.0, f64::max);
    let mut all = Vec::new();
    for template in templates {
        for arguments in bind(template, model) {
            let size = |slot: &str| {
                let Target::Template(slots) = &template.target else { return None };
                let place = slots.iter().position(|known| known.name.text == slot)?;
                let name = arguments.get(place)?;
                let unknown = model.unknowns.iter().find(|u| u.declared.name == *name)?;
                let largest = ranges.iter().find(|(known, ..)| known == name);
                let (_, _, a, b) = largest?;
                let size = a.abs().max(b.abs()) / unknown.declared.unit.factor.abs();
                (size > 0.0 && size.is_finite()).then_some(size)
            };
            let value = |name: &str, argument: Option<&str>| match (name, argument) {
                ("interval", None) if interval.is_finite() => Some(interval),
                ("duration", None) if duration > 0.0 => Some(duration),
                // A state that rests at nothing has the size of its unit.
                ("size", Some(slot)) => Some(size(slot).unwrap_or(1.0)),
                ("interval" | "duration", None) => Some(1.0),
                _ => None,
            };
            let mut effect = template.clone();
            for item in &mut effect.ast.items {
                let ItemKind::Parameter { value: own, attributes, .. } = &mut item.kind else {
                    continue;
                };
                settle(own, &value);
                for attribute in attributes {
                    match &mut attribute.kind {
                        AttributeKind::Bounds(lower, upper) => {
                            lower.iter_mut().chain(upper).for_each(|bound| settle(bound, &value));
                        }
                        AttributeKind::Nominal(size) => settle(size, &value),
                        _ => {}
                    }
                }
            }
            all.push(Adapted { effect, arguments });
        }
    }
    all
}

/// What names in a template stand for, by the name and the argument of a call.
type Meaning<'a> = dyn Fn(&str, Option<&str>) -> Option<f64> + 'a;

/// Puts a number in the place of an expression that has such names.
fn settle(expr: &mut Expr, meaning: &Meaning<'_>) {
    if let Some((value, true)) = value_of(expr, meaning) {
        let text = format!("{value}");
        expr.kind = ExprKind::Number { value, text, unit: None };
    }
}

/// The value of a product of numbers and such names, and whether there is a name among them.
fn value_of(expr: &Expr, meaning: &Meaning<'_>) -> Option<(f64, bool)> {
    match &expr.kind {
        ExprKind::Number { value, unit: None, .. } => Some((*value, false)),
        ExprKind::Name(name) => Some((meaning(name, None)?, true)),
        ExprKind::Call { function, arguments } => match arguments.as_slice() {
            [Expr { kind: ExprKind::Name(argument), .. }] => {
                Some((meaning(&function.text, Some(argument))?, true))
            }
            _ => None,
        },
        ExprKind::Product(factors) => {
            factors.iter().try_fold((1.0, false), |(product, named), (how, factor)| {
                let (value, is_named) = value_of(factor, meaning)?;
                let product = match how {
                    Factor::Times => product * value,
                    Factor::Over => product / value,
                };
                Some((product, named || is_named))
            })
        }
        _ => None,
    }
}
