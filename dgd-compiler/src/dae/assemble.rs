//! Model → Dae: constants become numbers, derivatives are solved for, rows find their unknowns.

use std::collections::BTreeMap;

use super::counts::verify_counts;
use super::delays;
use super::explicit::{Explicit, Rate, Row, rows_of, solve_for_derivatives};
use super::modes::{Combinations, in_modes};
use super::rates::{Varying, take_slopes};
use super::readers::{DerivativeReader, automaton_of};
use super::saturate::{self, saturate};
use super::transfer::{Equation, transfer};
use super::{Automaton, Dae, Output, Unknown, switches};
use crate::diagnostics::{Diagnostics, Reported};
use crate::expr::{ExprId, Graph, Symbol};
use crate::model::Model;
use crate::units::Unit;

/// Brings a model to the form M ẏ = f.
///
/// Every combination of modes is brought there by itself; the rows then choose between them.
///
/// # Errors
///
/// [`Reported`] where equations and unknowns do not match, or the index is above 1.
pub fn assemble(model: &Model, diagnostics: &mut Diagnostics) -> Result<Dae, Reported> {
    let combinations = Combinations::of(model, diagnostics)?;
    let mut graph = Graph::default();
    let mut transferred = transfer(model, &mut graph);
    // First delays, as a condition on a time that is past switches at a time of its own.
    let delays = delays::resolve(model, &mut graph, &mut transferred, diagnostics)?;
    let time_conditions = transferred.take_time_conditions(&mut graph, saturate::n_automata(model));
    let equations = &transferred.equations;

    let mut systems: Vec<Explicit> = Vec::new();
    for modes in combinations.iter() {
        let system = Explicit {
            context: in_modes(model, &modes),
            equations: transferred.holding(&modes),
            solved: BTreeMap::new(),
            implicit: BTreeMap::new(),
        };
        verify_counts(model, &graph, equations, &system, diagnostics)?;
        systems.push(solve_for_derivatives(&mut graph, equations, system));
    }

    // A derivative that no equation gives alone becomes an algebraic unknown z with ẋ = z.
    let mut unknowns = declared_unknowns(model, transferred.starts);
    let mut rates: BTreeMap<u32, Rate> = BTreeMap::new();
    for (&i, &equation) in systems.iter().flat_map(|system| &system.implicit) {
        rates.entry(i).or_insert(Rate { index: 0, equation });
    }
    for (i, rate) in &mut rates {
        rate.index = unknowns.len();
        unknowns.push(rate_of(&unknowns[*i as usize], &mut graph));
    }

    let mut rows: Vec<Vec<Row>> = vec![Vec::new(); unknowns.len()];
    for system in &systems {
        let one = rows_of(&mut graph, equations, system, &rates, &unknowns, diagnostics)?;
        for (all, row) in rows.iter_mut().zip(one) {
            all.push(row);
        }
    }

    let start = combinations.start(model);
    let mut slopes: Vec<Option<ExprId>> = Vec::new();
    let mut complete = Vec::new();
    for (unknown, rows) in unknowns.into_iter().zip(rows) {
        let values = rows.iter().map(|row| row.rhs).collect();
        let rhs = combinations.merge(&mut graph, values);
        let masses = rows.iter().map(|row| f64::from(u8::from(row.differential)));
        let masses = masses.map(|mass| graph.constant(mass)).collect();
        slopes.push(rows.iter().all(|row| row.differential).then_some(rhs));
        complete.push(Unknown {
            mass: combinations.merge(&mut graph, masses),
            differential: rows[start].differential,
            rhs,
            equation: labels(equations, &rows),
            span: equations[rows[start].equation].span,
            ..unknown
        });
    }

    let rate = |symbol| match symbol {
        Symbol::Derivative(i) => slopes[i as usize],
        _ => None,
    };
    let mut reader = DerivativeReader { model, rate, graph: &mut graph, diagnostics };
    let mut outputs = Vec::with_capacity(model.outputs.len());
    let late = transferred.outputs.into_iter().zip(delays.of_outputs);
    for (output, (value, delay)) in model.outputs.iter().zip(late) {
        let declared = output.declared.clone();
        let what = || format!("output `{}`", declared.name);
        let value = reader.open(value, declared.span, &what);
        outputs.push(Output { declared, value, noise: output.noise, delay });
    }
    let mut automata: Vec<Automaton> = model
        .automata
        .iter()
        .zip(transferred.transitions)
        .map(|(automaton, transitions)| automaton_of(automaton, transitions, &mut reader))
        .collect();
    diagnostics.check()?;
    let varying = Varying { model, delayed: &delays.inputs };
    saturate(&mut graph, varying, &transferred.bounds, &mut complete, &mut automata);
    let mut dae = Dae {
        name: model.name.clone(),
        doc: model.doc.clone(),
        graph,
        unknowns: complete,
        parameters: model.parameters.clone(),
        inputs: model.inputs.clone(),
        delays: delays.delays,
        delayed_inputs: delays.inputs,
        outputs,
        names: transferred.names,
        variants: model.variants.clone(),
        automata,
        time_conditions,
    };
    switches::locate(&mut dae, model);
    take_slopes(&mut dae);
    Ok(dae)
}

/// Labels of the equations of an unknown's rows, each once.
fn labels(equations: &[Equation<'_>], rows: &[Row]) -> String {
    let mut labels: Vec<&str> = Vec::new();
    for row in rows {
        let label = equations[row.equation].label;
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    labels.join(" / ")
}

/// The unknowns as declared, their rows still open.
fn declared_unknowns(model: &Model, starts: Vec<ExprId>) -> Vec<Unknown> {
    let unknowns = model.unknowns.iter().zip(starts);
    unknowns
        .map(|(unknown, start)| Unknown {
            name: unknown.declared.name.clone(),
            unit: unknown.declared.unit.clone(),
            doc: unknown.declared.doc.clone(),
            nominal: unknown.nominal,
            differential: false,
            mass: start,
            rhs: start,
            start,
            fixed: unknown.fixed,
            equation: String::new(),
            span: unknown.declared.span,
        })
        .collect()
}

/// The unknown `der(x)` of an unknown x, its row still open.
fn rate_of(of: &Unknown, graph: &mut Graph) -> Unknown {
    let zero = graph.constant(0.0);
    Unknown {
        name: format!("der({})", of.name),
        unit: Unit {
            symbol: format!("{}/s", of.unit.symbol),
            dimension: of.unit.dimension,
            offset: 0.0,
            datum: None,
            ..of.unit
        },
        doc: Vec::new(),
        nominal: None,
        differential: false,
        mass: zero,
        rhs: zero,
        start: zero,
        fixed: false,
        equation: String::new(),
        span: of.span,
    }
}
