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
    let of = |value: ValueId| value.0;
    match operation {
        Operation::Constant(value) => Data::Constant(value),
        Operation::Time => Data::Time,
        Operation::Load(Argument::Y, i) => Data::Unknown(i),
        Operation::Load(Argument::U, i) => Data::Input(i),
        Operation::Load(Argument::P, i) => Data::Parameter(i),
        Operation::Load(Argument::Z, i) => Data::Discrete(i),
        Operation::Negate(a) => Data::Negate(of(a)),
        Operation::Add(a, b) => Data::Add(of(a), of(b)),
        Operation::Subtract(a, b) => Data::Subtract(of(a), of(b)),
        Operation::Multiply(a, b) => Data::Multiply(of(a), of(b)),
        Operation::Divide(a, b) => Data::Divide(of(a), of(b)),
        Operation::Call1(f, a) => Data::Call(f.get().name, of(a)),
        Operation::Call2(f, a, b) => Data::Call2(f.get().name, of(a), of(b)),
        Operation::Curve(curve, a) => Data::Curve(&curve.get().curve, of(a)),
        Operation::Compare(Comparison::Greater, a, b) => Data::Above(of(a), of(b)),
        Operation::Compare(Comparison::GreaterEqual, a, b) => Data::NotBelow(of(a), of(b)),
        Operation::Compare(Comparison::Less, a, b) => Data::Above(of(b), of(a)),
        Operation::Compare(Comparison::LessEqual, a, b) => Data::NotBelow(of(b), of(a)),
        Operation::And(a, b) => Data::And(of(a), of(b)),
        Operation::Or(a, b) => Data::Or(of(a), of(b)),
        Operation::Not(a) => Data::Not(of(a)),
        Operation::Select(c, a, b) => Data::Select(of(c), of(a), of(b)),
        Operation::Load(Argument::Udot | Argument::S, _)
        | Operation::LoadSwept(..)
        | Operation::LoadRound(..)
        | Operation::Counter
        | Operation::Round => unreachable!("event functions are written out, and read no slopes"),
    }
}
