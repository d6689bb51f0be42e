//! A function of the program as data, for solvers that compute bounds of it.

use dgd_signature::{Formulas, Operation as Data};

use super::{Argument, Function, Operation, ValueId};
use crate::expr::graph::Comparison;

/// The first result of a function, number by number.
///
/// # Panics
///
/// If it contains loops, which event functions never do.
pub(super) fn formulas(function: &Function) -> Formulas {
    assert!(function.loops.is_empty(), "event functions are written out");
    let (values, places) = (&function.results[0], &function.places[0]);
    let mut results = vec![0; values.len()];
    for (k, value) in values.iter().enumerate() {
        results[places.as_ref().map_or(k, |places| places[k])] = value.0;
    }
    let operations = function.body.iter().map(|operation| data(*operation));
    Formulas { operations: operations.collect(), results: results.into() }
}

fn data(operation: Operation) -> Data {
    let position = |value: ValueId| value.0;
    match operation {
        Operation::Constant(value) => Data::Constant(value),
        Operation::Time => Data::Time,
        Operation::Load(Argument::Y, i) => Data::Unknown(i),
        Operation::Load(Argument::U, i) => Data::Input(i),
        Operation::Load(Argument::P, i) => Data::Parameter(i),
        Operation::Load(Argument::Z, i) => Data::Discrete(i),
        Operation::Negate(a) => Data::Negate(position(a)),
        Operation::Add(a, b) => Data::Add(position(a), position(b)),
        Operation::Subtract(a, b) => Data::Subtract(position(a), position(b)),
        Operation::Multiply(a, b) => Data::Multiply(position(a), position(b)),
        Operation::Divide(a, b) => Data::Divide(position(a), position(b)),
        Operation::Call1(f, a) => Data::Call(f.get().name, position(a)),
        Operation::Call2(f, a, b) => Data::Call2(f.get().name, position(a), position(b)),
        Operation::Curve(curve, a) => Data::Curve(&curve.get().curve, position(a)),
        Operation::Compare(Comparison::Greater, a, b) => Data::Above(position(a), position(b)),
        Operation::Compare(Comparison::GreaterEqual, a, b) => {
            Data::NotBelow(position(a), position(b))
        }
        Operation::Compare(Comparison::Less, a, b) => Data::Above(position(b), position(a)),
        Operation::Compare(Comparison::LessEqual, a, b) => Data::NotBelow(position(b), position(a)),
        Operation::And(a, b) => Data::And(position(a), position(b)),
        Operation::Or(a, b) => Data::Or(position(a), position(b)),
        Operation::Not(a) => Data::Not(position(a)),
        Operation::Select(c, a, b) => Data::Select(position(c), position(a), position(b)),
        Operation::Load(Argument::Udot | Argument::S, _)
        | Operation::LoadSwept(..)
        | Operation::LoadRound(..)
        | Operation::Counter
        | Operation::Round => unreachable!("event functions are written out, and read no slopes"),
    }
}
