//! A model in which some recordings have their own value of a number, offset of a sensor or rate of the clock.
//!
//! ```text
//!   k            becomes   k·(1 − s₂ − s₃) + k₂·s₂ + k₃·s₃       s_g: an input that is 1 in recordings of group g
//!   output y     becomes   y + o₂·s₂ + …
//!   der(x), time become    der(x)·c, time/c                      c: recorded seconds for each true one
//! ```
//!
//! The new names contain a space, so that no model has them.

use dgd_compiler::source::Span;
use dgd_compiler::syntax::ast::{
    Attribute, AttributeKind, Expr, ExprKind, FactorSide, Item, ItemKind, Name, Sign, WrittenUnit,
};
use dgd_compiler::syntax::visit::{self, ExprRole, ItemPart};

use super::groups::{DifferingValue, selector};
use super::model_number::ModelNumber;
use super::numbers::as_parameter;
use super::suspicion::{SuspectModel, Suspicion};
use crate::library::BaseModel;

/// The rate of the clock of all recordings: recorded seconds for each true one.
pub(crate) const RATE: &str = "rate of the clock";

/// Largest deviation of a clock's rate from one: a clock that is off by more counts in another unit.
const FURTHEST: f64 = 0.1;

/// Whether a parameter stands for the recordings of a group: no model has its name.
pub(crate) fn is_brought(name: &str) -> bool {
    name.contains(' ')
}

/// The model with a value for each group after the first, under these names; `None` if it cannot be written.
pub(super) fn with_own(
    base: &BaseModel,
    own: &DifferingValue,
    names: &[String],
) -> Option<BaseModel> {
    let groups: Vec<(String, String)> =
        names.iter().enumerate().map(|(k, name)| (selector(k + 1), name.clone())).collect();
    let mut base = match own {
        DifferingValue::Number(number, false) if number.is_constant => {
            held(as_parameter(base, number), number)
        }
        _ => base.clone(),
    };
    let items = &mut base.asts[0].items;
    let mut brought: Vec<ItemKind> = match own {
        DifferingValue::Number(number, _) => of_number(items, &number.name, &groups)?,
        DifferingValue::Offset(output, unit) => {
            offset(items, output, &groups)?;
            let unit = Some(WrittenUnit::new(Span::default(), unit.of_differences().symbol));
            let one = |(_, name): &(String, String)| parameter(name, unit.clone(), 0.0, Vec::new());
            groups.iter().map(one).collect()
        }
        DifferingValue::Clock => {
            let rate = mixed(number(1.0), &groups);
            clocked(items, &rate)?;
            groups.iter().map(|(_, name)| clock(name)).collect()
        }
    };
    brought.extend(groups.iter().map(|(selector, _)| ItemKind::Input {
        name: named(selector),
        unit: None,
        attributes: vec![attribute(AttributeKind::Linear)],
    }));
    items.extend(brought.into_iter().map(item));
    if !base.free.is_empty() {
        base.free.extend(names.iter().cloned());
    }
    Some(base)
}

/// The rate of the clock of all recordings as a suspect; `None` if the model cannot have one.
pub(super) fn rate(base: &BaseModel) -> Option<SuspectModel> {
    let mut base = base.clone();
    let items = &mut base.asts[0].items;
    clocked(items, &called(RATE))?;
    items.push(item(clock(RATE)));
    if !base.free.is_empty() {
        base.free.push(RATE.to_owned());
    }
    Some(SuspectModel { position: 0, suspicion: Suspicion::Rate, base: Some(base), changed: None })
}

/// The model with a parameter that is not estimated.
fn held(mut base: BaseModel, number: &ModelNumber) -> BaseModel {
    visit::items_mut(&mut base.asts[0].items, &mut |item| {
        if let ItemKind::Parameter { name, attributes, .. } = &mut item.kind
            && name.text == number.name
        {
            attributes.push(attribute(AttributeKind::Fixed));
        }
    });
    base
}

/// Replaces a parameter by its mixture over the groups, and returns the declarations that this requires.
fn of_number(
    items: &mut [Item],
    number: &str,
    groups: &[(String, String)],
) -> Option<Vec<ItemKind>> {
    let mut declared = None;
    visit::items(items, &mut |item| {
        if let ItemKind::Parameter { name, unit, value, attributes } = &item.kind
            && name.text == number
        {
            declared = Some((unit.clone(), value.clone(), attributes.clone()));
        }
    });
    let (unit, value, mut attributes) = declared?;
    let mixture = format!("{number} of the recording");
    for item in items.iter_mut() {
        visit::parts_mut(item, &mut |part| {
            let ItemPart::Expr(role, expr) = part else { return };
            let is_its_own = |locals: &[dgd_compiler::syntax::ast::FormalArgument]| {
                locals.iter().any(|local| local.name.text == number)
            };
            match role {
                ExprRole::Declaration => {}
                ExprRole::Body(_, locals) if is_its_own(locals) => {}
                _ => exchange(expr, &mut |one| {
                    matches!(&one.kind, ExprKind::Name(own) if own == number)
                        .then(|| called(&mixture))
                }),
            }
        });
    }
    attributes.retain(|one| one.kind != AttributeKind::Fixed);
    let parameters = groups.iter().map(|(_, name)| ItemKind::Parameter {
        name: named(name),
        unit: unit.clone(),
        value: value.clone(),
        attributes: attributes.clone(),
    });
    let value = mixed(called(number), groups);
    let mixture = ItemKind::Let { name: named(&mixture), unit: unit.clone(), value };
    Some(parameters.chain(std::iter::once(mixture)).collect())
}

/// Adds an offset of each group to an output; `None` if the model lacks the output.
fn offset(items: &mut [Item], output: &str, groups: &[(String, String)]) -> Option<()> {
    let mut is_found = false;
    visit::items_mut(items, &mut |item| {
        if let ItemKind::Output { name, value, .. } = &mut item.kind
            && name.text == output
        {
            let reading = value.take().unwrap_or_else(|| called(&name.text));
            let mut terms = vec![(Sign::Plus, group(reading))];
            terms.extend(groups.iter().map(|(selector, name)| {
                (Sign::Plus, product(vec![called(name), called(selector)]))
            }));
            *value = Some(plain(ExprKind::Sum(terms)));
            is_found = true;
        }
    });
    is_found.then_some(())
}

/// Scales the model's time by a rate; `None` if it has delays or periods, or no derivative.
fn clocked(items: &mut [Item], rate: &Expr) -> Option<()> {
    let (mut is_possible, mut has_derivative) = (true, false);
    for item in items.iter_mut() {
        visit::items(std::slice::from_ref(item), &mut |item| {
            is_possible &= !matches!(item.kind, ItemKind::Every { .. } | ItemKind::Part { .. });
        });
        visit::parts_mut(item, &mut |part| {
            let ItemPart::Expr(_, expr) = part else { return };
            exchange(expr, &mut |one| match &one.kind {
                ExprKind::Call { function, .. } if function.text == "delay" => {
                    is_possible = false;
                    None
                }
                ExprKind::Call { function, .. } if function.text == "der" => {
                    has_derivative = true;
                    Some(group(product(vec![one.clone(), group(rate.clone())])))
                }
                ExprKind::Name(name) if name == "time" => {
                    let over = (FactorSide::Over, group(rate.clone()));
                    let ratio = ExprKind::Product(vec![(FactorSide::Times, one.clone()), over]);
                    Some(group(plain(ratio)))
                }
                _ => None,
            });
        });
    }
    (is_possible && has_derivative).then_some(())
}

/// Replaces the outermost parts of an expression for which `other` returns a replacement.
fn exchange(expr: &mut Expr, other: &mut dyn FnMut(&Expr) -> Option<Expr>) {
    if let Some(other) = other(expr) {
        *expr = Expr { span: expr.span, ..other };
        return;
    }
    for operand in visit::operands_mut(expr) {
        exchange(operand, other);
    }
}

/// The value of the first group, or that of the group of the recording.
fn mixed(first: Expr, groups: &[(String, String)]) -> Expr {
    let mut rest = vec![(Sign::Plus, number(1.0))];
    rest.extend(groups.iter().map(|(selector, _)| (Sign::Minus, called(selector))));
    let rest = group(plain(ExprKind::Sum(rest)));
    let mut terms = vec![(Sign::Plus, product(vec![group(first), rest]))];
    terms.extend(
        groups
            .iter()
            .map(|(selector, name)| (Sign::Plus, product(vec![called(name), called(selector)]))),
    );
    plain(ExprKind::Sum(terms))
}

fn clock(name: &str) -> ItemKind {
    let bounds = AttributeKind::Bounds(Some(number(1.0 - FURTHEST)), Some(number(1.0 + FURTHEST)));
    parameter(name, None, 1.0, vec![attribute(bounds)])
}

fn parameter(
    name: &str,
    unit: Option<WrittenUnit>,
    value: f64,
    attributes: Vec<Attribute>,
) -> ItemKind {
    ItemKind::Parameter { name: named(name), unit, value: number(value), attributes }
}

fn item(kind: ItemKind) -> Item {
    Item { span: Span::default(), doc: Vec::new(), kind }
}

fn attribute(kind: AttributeKind) -> Attribute {
    Attribute { span: Span::default(), kind }
}

fn named(text: &str) -> Name {
    Name { text: text.to_owned(), span: Span::default() }
}

fn plain(kind: ExprKind) -> Expr {
    Expr { span: Span::default(), kind }
}

fn called(name: &str) -> Expr {
    plain(ExprKind::Name(name.to_owned()))
}

fn number(value: f64) -> Expr {
    plain(ExprKind::Number { value, text: value.to_string(), unit: None })
}

fn group(inner: Expr) -> Expr {
    plain(ExprKind::Group(Box::new(inner)))
}

fn product(factors: Vec<Expr>) -> Expr {
    plain(ExprKind::Product(factors.into_iter().map(|one| (FactorSide::Times, one)).collect()))
}
