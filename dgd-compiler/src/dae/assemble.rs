//! Model → Dae: constants become numbers, derivatives are solved for, rows find their unknowns.

use super::counts::verify_counts;
use super::delays::{self, Resolved};
use super::dummy_derivatives::blocks_of;
use super::explicit::{Explicit, Row, rows_of};
use super::families;
use super::index_reduction::{Reduced, Slopes, reduce};
use super::linear_derivatives::{Solved, solve_for_derivatives};
use super::modes::{Combinations, in_modes};
use super::rates::{Varying, take_slopes};
use super::readers::{DerivativeReader, automaton_of};
use super::refusal::{no_choice, refuse, verify_bounds};
use super::saturate::{self, saturate};
use super::state_selection::Selections;
use super::symbols::{Typical, settle};
use super::transfer::{Equation, Transferred, transfer};
use super::variables::Variables;
use super::{Automaton, Dae, Delay, DifferentiatedInput, Output, Unknown, switches};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use crate::expr::{ExprId, Graph, Node, Symbol};
use crate::model::Model;

/// Brings a model to the form M ẏ = f.
///
/// Every combination of modes is brought there by itself; the rows then choose between them.
///
/// # Errors
///
/// [`Reported`] where equations and unknowns do not match, or the index cannot be reduced to 1.
pub fn assemble(model: &Model, diagnostics: &mut Diagnostics) -> Result<Dae, Reported> {
    let declared = Combinations::of(model, diagnostics)?;
    let mut graph = Graph::default();
    let mut transferred = transfer(model, &mut graph);
    // First delays, as a condition on a time that is past switches at a time of its own.
    let delays = delays::resolve(model, &mut graph, &mut transferred, diagnostics)?;
    let first = saturate::n_automata(model);
    let time_conditions = transferred.take_time_conditions(&mut graph, first);
    let start_modes = Combinations::start_modes(model);
    let holding = transferred.holding(&start_modes);
    let mut plan = families::plan(model, &mut graph, &transferred, &holding, diagnostics)?;
    let origins = families::Origins::of(model, &transferred);

    let histories = std::mem::take(&mut transferred.histories);
    let mut variables = Variables::declared(model, transferred.starts.clone(), histories);
    let typical = Typical::of(model, &graph, &transferred.starts);
    let mut systems = Vec::new();
    for modes in declared.iter() {
        let holding = transferred.holding(&modes).into_iter();
        let holding: Vec<usize> = holding.filter(|e| !plan.taken.contains(e)).collect();
        let context = (&delays, &typical, (&modes[..], &holding[..]));
        systems.push(system_of(
            model,
            &mut graph,
            &transferred,
            context,
            &mut variables,
            diagnostics,
        )?);
    }
    let differentiated_inputs = differentiated(&transferred.equations, &systems);
    let selections = Selections::of(&systems);
    settle(&mut graph, &mut systems, (&mut transferred, &mut plan), &selections);

    let equations = &transferred.equations;
    let selecting = selections.automata(
        &mut graph,
        equations,
        &systems,
        &declared,
        (declared.position(&start_modes), &|symbol| typical.value(symbol)),
        &variables,
    );
    let combinations = declared.and(selections.sizes(), model, diagnostics)?;
    let mut rows: Vec<Vec<Row>> = vec![Vec::new(); variables.len()];
    for modes in combinations.iter() {
        let (modes, choices) = modes.split_at(model.automata.len());
        let combination = declared.position(modes);
        let system = &systems[combination];
        let chosen = selections.chosen(combination, choices);
        let one = rows_of(&mut graph, system, &chosen, &variables);
        for (all, row) in rows.iter_mut().zip(one) {
            all.push(row);
        }
    }
    verify_bounds(model, &graph, equations, &systems, &rows, diagnostics);
    let modes: Vec<usize> =
        start_modes.into_iter().chain(selecting.iter().map(|automaton| automaton.start)).collect();
    let start = combinations.position(&modes);
    let unknowns = variables.unknowns.into_iter().zip(rows);
    let mut unknowns: Vec<Unknown> = unknowns
        .map(|(unknown, rows)| {
            complete(&mut graph, equations, &combinations, start, unknown, &rows)
        })
        .collect();

    let rates: Vec<Option<ExprId>> = (0..unknowns.len())
        .map(|i| rate_of(&mut graph, &declared, &systems, u32::try_from(i).unwrap_or(u32::MAX)))
        .collect();
    let rate = |symbol| match symbol {
        Symbol::Derivative(i) => rates[i as usize],
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
    let automata = model.automata.iter().zip(transferred.transitions);
    let mut automata: Vec<Automaton> = automata
        .map(|(automaton, transitions)| automaton_of(automaton, transitions, &mut reader))
        .chain(selecting)
        .collect();
    verify_varying_delays(model, &graph, &delays.varying, &unknowns, diagnostics);
    diagnostics.check()?;
    let varying = Varying { model, delayed: &delays.inputs };
    saturate(&mut graph, varying, &transferred.bounds, &mut unknowns, &mut automata);
    let families = families::families(&mut graph, &plan, &origins);
    let mut dae = Dae {
        name: model.name.clone(),
        doc: model.doc.clone(),
        graph,
        unknowns,
        arrays: Vec::new(),
        families,
        parameters: model.parameters.clone(),
        inputs: model.inputs.clone(),
        delays: delays.delays,
        varying_delays: delays.varying,
        delayed_inputs: delays.inputs,
        delayed_unknowns: delays.unknowns,
        differentiated_inputs,
        outputs,
        output_arrays: Vec::new(),
        names: transferred.names,
        variants: model.variants.clone(),
        automata,
        time_conditions,
    };
    switches::locate(&mut dae, model);
    take_slopes(&mut dae);
    families::place(dae, model, &origins, diagnostics)
}

/// The system of one combination of modes: counted, solved for derivatives, its index reduced, its
/// states to be chosen.
fn system_of(
    model: &Model,
    graph: &mut Graph,
    transferred: &Transferred<'_>,
    (delays, typical, (modes, holding)): (&Resolved, &Typical, (&[usize], &[usize])),
    variables: &mut Variables,
    diagnostics: &mut Diagnostics,
) -> Result<Explicit, Reported> {
    let context = in_modes(model, modes);
    let equations = &transferred.equations;
    verify_counts(model, graph, equations, (holding, &context), diagnostics)?;
    let solved = solve_for_derivatives(graph, equations, holding, variables);
    let in_use = in_use(graph, model.unknowns.len(), &solved);
    let delayed = delays.inputs.iter().map(|delayed| delayed.input).collect();
    let slopes = Slopes { inputs: &model.inputs, delayed };
    let reduced: Reduced = reduce(graph, solved, &in_use, variables, &slopes)
        .map_err(|refusal| refuse(model, equations, variables, &context, &refusal, diagnostics))?;
    let blocks = blocks_of(graph, &reduced, variables, &|symbol| typical.value(symbol));
    let blocks = blocks.map_err(|rows| {
        let rows = rows.into_iter().map(|row| &reduced.constraints[row]);
        no_choice(equations, rows, &context, diagnostics)
    })?;
    Ok(Explicit { reduced, blocks })
}

/// The unknowns of a combination of modes: those that are declared, and those that its equations
/// have needed.
fn in_use(graph: &Graph, declared: usize, solved: &Solved) -> Vec<u32> {
    let rests = solved.algebraic.iter().map(|residual| residual.rest);
    let read = graph.reachable(rests.chain(solved.rates.values().map(|rate| rate.value)));
    let added = read.into_iter().filter_map(|id| match graph.node(id) {
        Node::Symbol(Symbol::Unknown(i)) => Some(i),
        _ => None,
    });
    let declared = 0..u32::try_from(declared).unwrap_or(u32::MAX);
    let mut all: Vec<u32> = declared.chain(added).chain(solved.rates.keys().copied()).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// The unknown with its rows in all combinations; `start` is the one that it starts in.
fn complete(
    graph: &mut Graph,
    equations: &[Equation<'_>],
    combinations: &Combinations,
    start: usize,
    unknown: Unknown,
    rows: &[Row],
) -> Unknown {
    let rhs = combinations.merge(graph, rows.iter().map(|row| row.rhs).collect());
    let masses = rows.iter().map(|row| f64::from(u8::from(row.differential)));
    let masses = masses.map(|mass| graph.constant(mass)).collect();
    Unknown {
        mass: combinations.merge(graph, masses),
        differential: rows[start].differential,
        rhs,
        equation: labels(equations, rows),
        span: equations[rows[start].equation].span,
        ..unknown
    }
}

/// The inputs that equations have been differentiated through, each once.
fn differentiated(equations: &[Equation<'_>], systems: &[Explicit]) -> Vec<DifferentiatedInput> {
    let mut all: Vec<DifferentiatedInput> = Vec::new();
    for (&input, &equation) in systems.iter().flat_map(|system| &system.reduced.differentiated) {
        if all.iter().all(|other| other.input != input) {
            all.push(DifferentiatedInput {
                input,
                equation: equations[equation].label.to_owned().into(),
            });
        }
    }
    all
}

/// ẋ, where it is given in all modes.
fn rate_of(
    graph: &mut Graph,
    declared: &Combinations,
    systems: &[Explicit],
    i: u32,
) -> Option<ExprId> {
    let rates = systems.iter().map(|system| system.reduced.rates.get(&i).map(|rate| rate.value));
    let rates = rates.collect::<Option<Vec<ExprId>>>()?;
    Some(declared.merge(graph, rates))
}

/// Delays vary with what is known before equations are solved.
fn verify_varying_delays(
    model: &Model,
    graph: &Graph,
    delays: &[Delay],
    unknowns: &[Unknown],
    diagnostics: &mut Diagnostics,
) {
    for delay in delays {
        let solved_for = graph.symbols(delay.tau).into_iter().find_map(|symbol| match symbol {
            Symbol::Unknown(i) if graph.value(unknowns[i as usize].mass) != Some(1.0) => Some(i),
            _ => None,
        });
        if let Some(i) = solved_for {
            let declared = &model.unknowns[i as usize].declared;
            let message = format!(
                "the delay `{}` depends on `{}`, which is algebraic",
                delay.text, declared.name
            );
            diagnostics.error(
                Diagnostic::new(Code::E215, declared.span, message)
                    .help("use states that have a derivative, inputs, time and parameters"),
            );
        }
    }
}

/// Labels of the equations of an unknown's rows, each once and in an order that does not depend on
/// that of the file.
fn labels(equations: &[Equation<'_>], rows: &[Row]) -> String {
    let mut labels: Vec<String> = Vec::new();
    for row in rows {
        let mut label = equations[row.equation].label.to_owned();
        for _ in 0..row.order {
            label = format!("der({label})");
        }
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    labels.sort_unstable();
    labels.join(" / ")
}
