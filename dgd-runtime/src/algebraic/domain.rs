//! Where an equation ends to have values: below zero for a root or a logarithm, beyond ±1 for an arc sine.

use std::fmt;

use dgd_signature::number::{short, with_unit};

use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// The end is looked for within this part of an unknown's size, from the nearest distance on, which is doubled each time.
const FARTHEST: f64 = 1e-2;
const NEAREST: f64 = 1e-15;
/// Halvings that find any end to rounding.
const HALVINGS: usize = 80;
/// An end that is nearer to zero than this part of the size is at zero.
const ZERO: f64 = 1e-9;

/// The end of the values that an unknown may have in an equation.
#[derive(Debug, Clone, PartialEq)]
pub struct DomainEnd {
    /// The unknown.
    pub name: String,
    /// The end, in its declared unit.
    pub value: f64,
    /// Its declared unit.
    pub unit: String,
    /// Whether there are no values below the end, rather than above.
    pub is_lower: bool,
}

impl fmt::Display for DomainEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, value, unit, is_lower } = self;
        let (side, function) = if *is_lower { ("below", "max") } else { ("above", "min") };
        let number = short(*value, 6);
        let unit_of = |unit: &str| {
            if matches!(unit, "" | "1") { String::new() } else { format!(" [{unit}]") }
        };
        // Zero needs no unit.
        let bound =
            if *value == 0.0 { number.clone() } else { format!("{number}{}", unit_of(unit)) };
        let end = with_unit(number, unit);
        write!(
            f,
            "it has no value for `{name}` {side} {end}: write `{function}({name}, {bound})` in it"
        )
    }
}

/// The nearest end of the values of row `row` of f along one of its unknowns, given the `sizes` of these.
pub(crate) fn domain_end<S: SolvableSystem>(
    system: &S,
    at: EvaluationPoint<'_>,
    row: usize,
    sizes: &[f64],
) -> Option<DomainEnd> {
    let signature = system.signature();
    let (mut y, mut f) = (at.y.to_vec(), S::Vector::zeros(at.y.len()));
    let mut has_value = |i: usize, value: f64| {
        let original = std::mem::replace(&mut y[i], value);
        system.rhs(EvaluationPoint { y: &y, ..at }, f.as_mut());
        y[i] = original;
        f.as_ref()[row].is_finite()
    };
    let mut nearest: Option<(f64, usize, f64)> = None;
    let columns = signature.jacobian.positions().filter(|(r, _)| *r == row).map(|(_, i)| i);
    for i in columns {
        let (own, size) = (at.y[i], sizes[i].max(at.y[i].abs()));
        let is_inside = has_value(i, own);
        let mut part = NEAREST;
        while part <= FARTHEST && nearest.is_none_or(|(other, ..)| part < other) {
            let side = [-1.0, 1.0]
                .into_iter()
                .find(|side| has_value(i, own + side * part * size) != is_inside);
            if let Some(side) = side {
                nearest = Some((part, i, side));
                break;
            }
            part *= 2.0;
        }
    }
    let (part, i, side) = nearest?;
    let size = sizes[i].max(at.y[i].abs());
    let (own, other) = (at.y[i], at.y[i] + side * part * size);
    let (mut inside, mut outside) = if has_value(i, own) { (own, other) } else { (other, own) };
    let is_lower = outside < inside;
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(inside, outside);
        if has_value(i, middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    let end = if inside.abs() <= ZERO * size { 0.0 } else { inside };
    let unknown = signature.unknowns.get(i);
    Some(DomainEnd {
        name: unknown.name.to_string(),
        value: unknown.unit.from_si(end),
        unit: unknown.unit.symbol.to_string(),
        is_lower,
    })
}
