//! Initial values that the equations override, and states that jump.

use std::collections::BTreeSet;

use dgd_compiler::expr::{Node, Symbol};
use dgd_compiler::model::Model;
use dgd_runtime::{ConsistentStart, JumpCause, Signature, Solution, Unit};

use crate::output::quantity::{short, with_unit};
use crate::session::TaskContext;

/// Digits of values in notes.
const DIGITS: i32 = 6;

/// Names of the model's states whose initial values apply; arrays without an index. A state without a derivative in the
/// equations, as in the static form of a model, is algebraic, and its initial value is a guess.
pub(super) fn declared_states(model: &Model) -> BTreeSet<String> {
    let sides = model.equations_and_loops().flat_map(|equation| [equation.left, equation.right]);
    let rates = model.graph.listed(sides).into_iter().filter_map(|(_, node)| match node {
        Node::Symbol(Symbol::Derivative(i)) => Some(&model.unknowns[i as usize]),
        Node::Symbol(Symbol::ElementRate(i) | Symbol::SweptRate(i)) => {
            Some(&model.array_of(i).unknown)
        }
        _ => None,
    });
    rates.filter(|x| x.state && !x.guess).map(|x| x.declared.name.clone()).collect()
}

/// Whether an unknown is one of these states, or an element of one.
fn is_declared(states: &BTreeSet<String>, name: &str) -> bool {
    states.contains(name)
        || name.rsplit_once('[').is_some_and(|(array, _)| is_declared(states, array))
}

/// Whether equations may override the initial value of one of these states.
pub(super) fn may_be_dropped(signature: &Signature, states: &BTreeSet<String>) -> bool {
    let unknowns = &signature.unknowns;
    !signature.starts_at_rest
        && (0..unknowns.single.len())
            .any(|i| !unknowns.is_differential(i) && is_declared(states, &unknowns.name(i)))
}

/// Reports the declared initial values that the equations override; those of `replaced` come from elsewhere.
pub(super) fn tell_what_is_dropped(
    signature: &Signature,
    states: &BTreeSet<String>,
    replaced: &[(usize, f64)],
    start: &ConsistentStart,
    session: TaskContext<'_>,
) {
    for &(i, declared) in &start.dropped {
        if !is_declared(states, &signature.unknowns.name(i))
            || replaced.iter().any(|(other, _)| *other == i)
        {
            continue;
        }
        let (name, unit) = (signature.unknowns.name(i), signature.unknowns.unit(i));
        let [declared, found] = [declared, start.y[i]].map(|value| shown(value, unit));
        session.remark(format!(
            "note: `{name}` starts at {found}, and its declared start value of {declared} is dropped: the equations \
             determine it from the other start values"
        ));
    }
}

/// Reports the states that have jumped without a conserved sum.
pub(crate) fn tell_jumps(signature: &Signature, solution: &Solution, session: TaskContext<'_>) {
    for jump in &solution.jumps {
        let (name, unit) =
            (signature.unknowns.name(jump.unknown), signature.unknowns.unit(jump.unknown));
        let [from, to] = [jump.from, jump.to].map(|value| shown(value, unit));
        let t = short(jump.t, DIGITS);
        let again = match jump.times {
            1 => String::new(),
            2 => ", and once more later".to_owned(),
            times => format!(", and {} times later", times - 1),
        };
        session.remark(match jump.cause {
            JumpCause::Forced => format!(
                "note: at t = {t} s `{name}` jumps from {from} to {to} where modes change{again}: the new equations force \
                 it, and conserve no sum, as of charge or momentum, that it takes part in"
            ),
            JumpCause::Lost => format!(
                "note: at t = {t} s `{name}` keeps its value, {from}, where modes change{again}, although its derivative \
                 has an impulse: the equations do not give the size of that"
            ),
        });
    }
}

/// An SI number in a declared unit.
fn shown(value: f64, unit: &Unit) -> String {
    with_unit(short(unit.from_si(value), DIGITS), &unit.symbol)
}
