//! Templates scaled to the recordings.
//!
//! A template fits any model, so its constants cannot be in seconds or metres. Its text may contain
//!
//! | name | stands for |
//! |---|---|
//! | `interval` | the typical sample interval, s |
//! | `duration` | the length of the longest training recording, s |
//! | `period` | the strongest period in the residuals of the fitted base model, s |
//! | `size(x)` | the largest magnitude of x, in its unit |
//! | `size_of_swing(x)` | the same for quantities that take both signs, such as speeds |
//! | `least(x)`, `largest(x)` | the ends of the range of x |
//! | `middle(x)` | the middle of the range of x |
//! | `middle_of_store(x)` | the same for quantities that are never negative and have a unit, such as levels |
//! | `loss(x, e)` | zero if e is the balance of x, which a loss can only reduce; no bound otherwise |
//! | `own_loss(x, e)` | the same; the template applies to no other balance |
//! | `alike(x, u)` | zero if x and u have the same dimension; the template applies to no others |
//! | `reads(q, x)` | one if the `let` q reads x; the template applies to no others |
//!
//! in a value, a bound, a nominal or a null; numbers replace these names before it is tried. Ranges are those of the
//! fitted base model and of the recordings. A template that needs a value that does not exist is not tried.
//!
//! `replace x in all by …` stands for one such clause for each equation that reads x and is not exact: outputs still
//! read x itself.
//!
//! A term that a template adds to a balance flows into the store, whichever side of the equation the store is on.

use std::collections::BTreeMap;

use dgd_compiler::effects::{Effect, bind};
use dgd_compiler::expr::{ExprId, Symbol};
use dgd_compiler::model::{DeclarationHeader, Model};
use dgd_compiler::syntax::ast::{
    AttributeKind, ClauseKind, EffectClause, EffectTarget, Expr, ExprKind, FactorSide, ItemKind,
};
use dgd_compiler::units::Dimension;
use dgd_identify::Recording;
use dgd_screen::usual_spacing;

use super::balance::direction;
use super::fields::is_of_the_field;
use super::levels::QuantityRanges;
use super::number::signed;

/// A template with its arguments.
pub(crate) struct AdaptedTemplate {
    pub effect: Effect,
    pub arguments: Vec<String>,
}

/// The scales for templates.
pub(crate) struct TemplateScales {
    /// Ranges of the model's quantities and of the readings.
    pub ranges: QuantityRanges,
    /// The strongest period in the residuals of the base model, s.
    pub period: Option<f64>,
}

/// A quantity that never falls below minus this fraction of its maximum is a store.
const BELOW_ZERO: f64 = 0.01;

/// A quantity that extends by this fraction of its size to either side of zero swings.
const BOTH_SIDES: f64 = 0.02;

/// All ways to apply templates to a model, scaled to the recordings.
pub(crate) fn adapted(
    templates: &[Effect],
    model: &Model,
    recordings: &[Recording],
    measure: &TemplateScales,
) -> Vec<AdaptedTemplate> {
    let spacings = recordings.iter().filter_map(|recording| usual_spacing(&recording.times));
    let interval = spacings.fold(f64::INFINITY, f64::min);
    let length = |recording: &Recording| match recording.times.as_slice() {
        [first, .., last] => last - first,
        _ => 0.0,
    };
    let duration = recordings.iter().map(length).fold(0.0, f64::max);
    let times = BTreeMap::from([
        ("interval", if interval.is_finite() { interval } else { 1.0 }),
        ("duration", if duration > 0.0 { duration } else { 1.0 }),
    ]);
    let mut adapted = Vec::new();
    for template in templates {
        let is_own =
            |arguments: &Vec<String>| is_of_the_field(&template.name.text, arguments, model);
        for arguments in bind(template, model).into_iter().filter(is_own) {
            let quantity = |slot: &str| {
                let EffectTarget::Template(slots) = &template.target else { return None };
                let place = slots.iter().position(|known| known.name.text == slot)?;
                ArgumentRange::new(arguments.get(place)?, model, &measure.ranges)
            };
            let named = |slot: &str| {
                let EffectTarget::Template(slots) = &template.target else { return None };
                arguments.get(slots.iter().position(|known| known.name.text == slot)?)
            };
            let value = |name: &str, slots: &[&str]| match (name, slots) {
                ("alike", [one, other]) => {
                    Some(are_alike(model, named(one)?, named(other)?).then_some(0.0))
                }
                ("reads", [one, other]) => {
                    Some(reads(model, named(one)?, named(other)?).then_some(1.0))
                }
                ("period", []) => Some(measure.period),
                (_, []) => times.get(name).map(|time| Some(*time)),
                ("loss", [state, equation]) => {
                    Some(Some(least_loss(model, named(state)?, named(equation)?)))
                }
                ("own_loss", [state, equation]) => {
                    let least = least_loss(model, named(state)?, named(equation)?);
                    Some(least.is_finite().then_some(least))
                }
                (_, [slot]) => ArgumentRange::named(name).map(|of| of(&quantity(slot)?)),
                _ => None,
            };
            let mut effect = template.clone();
            turn(&mut effect, |slot| direction(model, named(slot)?, |_| true));
            let is_spread = spread(&mut effect, |slot| named(slot).cloned(), model);
            if is_spread && settle_all(&mut effect, &value).is_some() {
                adapted.push(AdaptedTemplate { effect, arguments });
            }
        }
    }
    adapted
}

/// Whether a state and an input have the same dimension.
fn are_alike(model: &Model, state: &str, input: &str) -> bool {
    let state = model.unknowns.iter().find(|own| own.declared.name == state);
    let input = model.inputs.iter().find(|own| own.declared.name == input);
    let both = state.zip(input);
    both.is_some_and(|(a, b)| a.declared.unit.dimension == b.declared.unit.dimension)
}

/// Whether a `let` reads an unknown.
fn reads(model: &Model, name: &str, unknown: &str) -> bool {
    let definition = model.lets.iter().find(|own| own.name == name);
    definition.is_some_and(|definition| is_read_in(model, definition.value, unknown))
}

/// Whether an unknown or a `let` is read in an expression, as it is or through others.
fn is_read_in(model: &Model, root: ExprId, name: &str) -> bool {
    if let Some(own) = model.lets.iter().find(|own| own.name == name) {
        return model.graph.reachable([root]).contains(&own.value);
    }
    let place = model.unknowns.iter().position(|own| own.declared.name == name);
    place.is_some_and(|i| model.graph.symbols(root).contains(&Symbol::Unknown(i as u32)))
}

/// The word for all equations that read the name that a clause replaces.
const ALL: &str = "all";

/// Expands a clause that replaces a name in all equations into one for each equation. Returns whether there are any.
fn spread(effect: &mut Effect, named: impl Fn(&str) -> Option<String>, model: &Model) -> bool {
    let mut are_there = true;
    if let Some(header) = &mut effect.ast.effect {
        let clauses = std::mem::take(&mut header.clauses);
        header.clauses = (clauses.into_iter())
            .flat_map(|clause| {
                let ClauseKind::Replace { name, equation: Some(label), .. } = &clause.kind else {
                    return vec![clause];
                };
                let Some(own) = named(&name.text).filter(|_| label.text == ALL) else {
                    return vec![clause];
                };
                let mut labels: Vec<&String> = Vec::new();
                for equation in model.all_equations().filter(|equation| !equation.is_exact) {
                    let sides = [equation.left, equation.right];
                    let is_new = !labels.contains(&&equation.label);
                    if is_new && sides.iter().any(|side| is_read_in(model, *side, &own)) {
                        labels.push(&equation.label);
                    }
                }
                are_there &= !labels.is_empty();
                labels.into_iter().map(|label| in_equation(&clause, label)).collect()
            })
            .collect();
    }
    are_there
}

/// A clause that replaces something in this equation.
fn in_equation(clause: &EffectClause, label: &str) -> EffectClause {
    let mut replaced = clause.clone();
    if let ClauseKind::Replace { equation: Some(equation), .. } = &mut replaced.kind {
        label.clone_into(&mut equation.text);
    }
    replaced
}

/// Lower bound of the coefficient of a loss of a state from a balance.
fn least_loss(model: &Model, state: &str, equation: &str) -> f64 {
    let is_state = |i: usize| model.unknowns[i].declared.name == state;
    direction(model, equation, is_state).map_or(f64::NEG_INFINITY, |_| 0.0)
}

/// Flips the sign of terms that a template adds to balances that have their store on the right-hand side.
fn turn(effect: &mut Effect, direction: impl Fn(&str) -> Option<f64>) {
    for clause in effect.ast.effect.iter_mut().flat_map(|header| &mut header.clauses) {
        if let ClauseKind::Add { value, equation } = &mut clause.kind
            && direction(&equation.text) == Some(-1.0)
        {
            let span = value.clone();
            let group = Expr { kind: ExprKind::Group(Box::new(value.clone())), ..span.clone() };
            *value = Expr { kind: ExprKind::Negate(Box::new(group)), ..span };
        }
    }
}

/// The range of a template's argument, in its unit.
struct ArgumentRange {
    least: f64,
    largest: f64,
    has_unit: bool,
}

impl ArgumentRange {
    fn new(name: &str, model: &Model, ranges: &QuantityRanges) -> Option<ArgumentRange> {
        let inputs = model.inputs.iter().map(|input| &input.declared);
        let unknowns = model.unknowns.iter().map(|unknown| &unknown.declared);
        let outputs = model.outputs.iter().map(|output| &output.declared);
        let mut quantities = inputs.chain(unknowns).chain(outputs);
        let declared: &DeclarationHeader = quantities.find(|declared| declared.name == name)?;
        let (_, _, a, b) = ranges.iter().find(|(known, ..)| known == name)?;
        let factor = declared.unit.factor.abs();
        let has_unit = declared.unit.dimension != Dimension::ONE;
        (a.is_finite() && b.is_finite()).then_some(ArgumentRange {
            least: a / factor,
            largest: b / factor,
            has_unit,
        })
    }

    /// The function that computes a name such as `size` from a quantity, if the name exists.
    fn named(name: &str) -> Option<fn(&ArgumentRange) -> Option<f64>> {
        Some(match name {
            // A quantity that stays at zero has the size of its unit.
            "size" => |of| {
                let size = of.least.abs().max(of.largest.abs());
                Some(if size > 0.0 { size } else { 1.0 })
            },
            "size_of_swing" => |of| {
                let size = of.least.abs().max(of.largest.abs());
                (of.least < -BOTH_SIDES * size && of.largest > BOTH_SIDES * size).then_some(size)
            },
            "least" => |of| (of.least < of.largest).then_some(of.least),
            "largest" => |of| (of.least < of.largest).then_some(of.largest),
            "middle" => |of| (of.least < of.largest).then_some(0.5 * (of.least + of.largest)),
            "middle_of_store" => |of| {
                let is_store = of.has_unit && of.least >= -BELOW_ZERO * of.largest;
                (is_store && of.least < of.largest).then_some(0.5 * (of.least + of.largest))
            },
            _ => return None,
        })
    }
}

/// Replaces names by numbers everywhere in a template; `None` if one has no number.
fn settle_all(effect: &mut Effect, meaning: &NameLookup<'_>) -> Option<()> {
    for item in &mut effect.ast.items {
        let ItemKind::Parameter { value, attributes, .. } = &mut item.kind else { continue };
        settle(value, meaning)?;
        for attribute in attributes.iter_mut() {
            match &mut attribute.kind {
                AttributeKind::Bounds(lower, upper) => {
                    for bound in [lower, upper] {
                        let Some(own) = bound else { continue };
                        if let ProductValue::Number(f64::NEG_INFINITY, true) =
                            value_of(own, meaning)
                        {
                            *bound = None;
                        } else {
                            settle(own, meaning)?;
                        }
                    }
                }
                AttributeKind::Nominal(size) => settle(size, meaning)?,
                _ => {}
            }
        }
        attributes.retain(|one| !matches!(one.kind, AttributeKind::Bounds(None, None)));
    }
    for clause in effect.ast.effect.iter_mut().flat_map(|header| &mut header.clauses) {
        if let ClauseKind::Null { value, .. } = &mut clause.kind {
            settle(value, meaning)?;
        }
    }
    Some(())
}

/// Looks up a name in a template, with the arguments if it is called: `None` if the name has no meaning here,
/// `Some(None)` if it has one but the recordings give no number for it.
type NameLookup<'a> = dyn Fn(&str, &[&str]) -> Option<Option<f64>> + 'a;

/// Replaces an expression that contains such names by a number; `None` if one of them has no number.
fn settle(expr: &mut Expr, meaning: &NameLookup<'_>) -> Option<()> {
    match value_of(expr, meaning) {
        ProductValue::Number(value, true) => {
            *expr = signed(value, expr, |size| format!("{size}"));
            Some(())
        }
        ProductValue::Number(_, false) | ProductValue::Other => Some(()),
        ProductValue::Missing => None,
    }
}

/// The value of a product of numbers and such names.
#[derive(Clone, Copy)]
enum ProductValue {
    /// A number, and whether it contains a name.
    Number(f64, bool),
    /// A name in it has no number.
    Missing,
    /// Anything else.
    Other,
}

fn value_of(expr: &Expr, meaning: &NameLookup<'_>) -> ProductValue {
    let named = |found: Option<Option<f64>>| match found {
        Some(Some(value)) => ProductValue::Number(value, true),
        Some(None) => ProductValue::Missing,
        None => ProductValue::Other,
    };
    match &expr.kind {
        ExprKind::Number { value, unit: None, .. } => ProductValue::Number(*value, false),
        ExprKind::Name(name) => named(meaning(name, &[])),
        ExprKind::Group(inner) => value_of(inner, meaning),
        ExprKind::Call { function, arguments } => {
            let names = arguments.iter().map(|argument| match &argument.kind {
                ExprKind::Name(name) => Some(name.as_str()),
                _ => None,
            });
            let names: Option<Vec<&str>> = names.collect();
            names.map_or(ProductValue::Other, |names| named(meaning(&function.text, &names)))
        }
        ExprKind::Product(factors) => {
            let times = |all: ProductValue, (how, factor): &(FactorSide, Expr)| match (
                all,
                value_of(factor, meaning),
            ) {
                (ProductValue::Missing, _) | (_, ProductValue::Missing) => ProductValue::Missing,
                (ProductValue::Number(a, of_a), ProductValue::Number(b, of_b)) => {
                    let product = match how {
                        FactorSide::Times => a * b,
                        FactorSide::Over => a / b,
                    };
                    ProductValue::Number(product, of_a || of_b)
                }
                _ => ProductValue::Other,
            };
            factors.iter().fold(ProductValue::Number(1.0, false), times)
        }
        _ => ProductValue::Other,
    }
}
