//! A function of the program as data, for solvers that compute bounds of it.

use dgd_signature::{Formulas, Operation as Data};

use super::{FunctionArgument, ProgramFunction, ProgramOperation, ValueId};
use crate::expr::graph::Comparison;

/// The first result of a function, number by number.
///
/// # Panics
///
/// If it contains loops, which event functions never do.
pub(super) fn formulas(function: &ProgramFunction) -> Formulas {
    assert!(function.loops.is_empty(), "event functions are written out");
    let (values, places) = (&function.results[0], &function.places[0]);
    let mut results = vec![0; values.len()];
    for (k, value) in values.iter().enumerate() {
        results[places.as_ref().map_or(k, |places| places[k])] = value.0;
    }
    let operations = function.body.iter().map(|operation| data(*operation));
    Formulas { operations: operations.collect(), results: results.into() }
}

fn data(operation: ProgramOperation) -> Data {
    let position = |value: ValueId| value.0;
    match operation {
        ProgramOperation::Constant(value) => Data::Constant(value),
        ProgramOperation::Time => Data::Time,
        ProgramOperation::Load(FunctionArgument::Y, i) => Data::Unknown(i),
        ProgramOperation::Load(FunctionArgument::U, i) => Data::Input(i),
        ProgramOperation::Load(FunctionArgument::P, i) => Data::Parameter(i),
        ProgramOperation::Load(FunctionArgument::Z, i) => Data::Discrete(i),
        ProgramOperation::Negate(a) => Data::Negate(position(a)),
        ProgramOperation::Add(a, b) => Data::Add(position(a), position(b)),
        ProgramOperation::Subtract(a, b) => Data::Subtract(position(a), position(b)),
        ProgramOperation::Multiply(a, b) => Data::Multiply(position(a), position(b)),
        ProgramOperation::Divide(a, b) => Data::Divide(position(a), position(b)),
        ProgramOperation::Call1(f, a) => Data::Call(f.get().name, position(a)),
        ProgramOperation::Call2(f, a, b) => Data::Call2(f.get().name, position(a), position(b)),
        ProgramOperation::Curve(curve, a) => Data::Curve(&curve.get().curve, position(a)),
        ProgramOperation::Compare(Comparison::Greater, a, b) => {
            Data::Above(position(a), position(b))
        }
        ProgramOperation::Compare(Comparison::GreaterEqual, a, b) => {
            Data::NotBelow(position(a), position(b))
        }
        ProgramOperation::Compare(Comparison::Less, a, b) => Data::Above(position(b), position(a)),
        ProgramOperation::Compare(Comparison::LessEqual, a, b) => {
            Data::NotBelow(position(b), position(a))
        }
        ProgramOperation::And(a, b) => Data::And(position(a), position(b)),
        ProgramOperation::Or(a, b) => Data::Or(position(a), position(b)),
        ProgramOperation::Not(a) => Data::Not(position(a)),
        ProgramOperation::Select(c, a, b) => Data::Select(position(c), position(a), position(b)),
        ProgramOperation::Load(FunctionArgument::Udot | FunctionArgument::S, _)
        | ProgramOperation::LoadSwept(..)
        | ProgramOperation::LoadRound(..)
        | ProgramOperation::Counter
        | ProgramOperation::Round => {
            unreachable!("event functions are written out, and read no slopes")
        }
    }
}
