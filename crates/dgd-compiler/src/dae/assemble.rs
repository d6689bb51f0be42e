//! Model → Dae: the list of the passes, and what each eliminates.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::families::{self, RowOrigins};
use super::hybrid::saturate::{n_automata, saturate};
use super::hybrid::switches;
use super::index::{ModeSystems, StateSelections};
use super::rates::{VaryingQuantities, take_slopes};
use super::readers::DerivativeReader;
use super::renumber::renumber;
use super::rest;
use super::start_equations;
use super::transfer::transfer;
use super::{Dae, Impulses, delays};
use crate::diagnostics::{Diagnostics, ErrorReported};
use crate::expr::{ExprGraph, ExprId};
use crate::model::Model;

/// Index reduction writes out at most this many elements of arrays.
const MOST_WRITTEN_OUT: usize = 2_000;

/// Brings a model to the form M ẏ = f.
///
/// Arrays that take part in index reduction are written out, element by element; all others stay arrays. Every
/// combination of modes is reduced separately; the rows then choose between them.
///
/// # Errors
///
/// [`ErrorReported`] if equations and unknowns do not match, or the index cannot be reduced to 1.
pub fn assemble(model: &Model, diagnostics: &mut Diagnostics) -> Result<Dae, ErrorReported> {
    let mut model = Cow::Borrowed(model);
    loop {
        // Arrays that index reduction would have to take apart.
        let mut tied = BTreeSet::new();
        let mut problems = Diagnostics::default();
        let attempt = assemble_as_it_is(&model, &mut tied, &mut problems);
        let elements = tied.iter().map(|array| model.arrays[*array].count as usize);
        if attempt.is_err() && !tied.is_empty() && elements.sum::<usize>() <= MOST_WRITTEN_OUT {
            model = Cow::Owned(families::written_out(&model, &tied));
            continue;
        }
        for diagnostic in problems.sorted() {
            diagnostics.error(diagnostic.clone());
        }
        return attempt;
    }
}

/// [`assemble`] without writing out arrays; those that prevent index reduction are added to `tied`.
fn assemble_as_it_is(
    model: &Model,
    tied: &mut BTreeSet<usize>,
    diagnostics: &mut Diagnostics,
) -> Result<Dae, ErrorReported> {
    let mut graph = ExprGraph::default();
    // After this: no delay that may jump by itself. It is an unknown whose equation has the events.
    let (model, lags) = delays::with_lags(model);
    let model = &*model;
    // After this: no named constants, and no equation with two sides: 0 = right − left.
    let mut transferred = transfer(model, &lags, &mut graph);
    // After this: no delays within expressions. Delayed values are symbols of their own.
    let delays = delays::resolve(model, &mut graph, &mut transferred, diagnostics)?;
    // After this: no conditions on time; they are discrete numbers. Delays come first, as a condition
    // on an earlier time switches at a time of its own.
    let (mut time_conditions, clocks) =
        transferred.take_time_conditions(&mut graph, n_automata(model));
    // After this: no element of an array without an equation that determines it.
    let mut plan = families::plan(model, &mut graph, &transferred, tied, diagnostics)?;
    let origins = RowOrigins::from_model(model, &transferred);
    // After this: no implicit derivatives and no index above 1, in any combination of modes.
    let mut systems = ModeSystems::reduced(
        model,
        &mut graph,
        &mut transferred,
        &delays.inputs,
        &plan.taken,
        tied,
        diagnostics,
    )?;
    let differentiated_inputs = systems.differentiated_inputs(&transferred.equations);
    // After this: no constraint without a selection of its states.
    let selections = StateSelections::from_systems(&systems.explicit);
    let conditions = &mut time_conditions;
    renumber(
        &mut graph,
        &mut systems.explicit,
        &mut transferred,
        &mut plan,
        conditions,
        &selections,
    );
    let equations = &transferred.equations;
    let selecting = selections.automata(model, &mut graph, equations, &systems);
    // After this: no unknown without its row.
    let mut unknowns =
        systems.rows(model, &mut graph, equations, &selections, &selecting, diagnostics);
    // After this: no mode without the jumps that entering it makes.
    let outside: Vec<ExprId> = plan.expressions().map(|rhs| *rhs).collect();
    let impulses = systems.impulses(model, &mut graph, &outside);
    // After this: no derivatives in outputs, event functions and resets.
    let rates = systems.rates(&mut graph);
    let mut reader = DerivativeReader { model, rates, graph: &mut graph, diagnostics };
    let outputs = reader.outputs(transferred.outputs, &delays);
    let start_equations = reader.start_equations(transferred.start_equations);
    let mut automata = reader.automata(transferred.transitions);
    automata.extend(selecting);
    diagnostics.check()?;
    // After this: no unknown beyond its bounds.
    let varying = VaryingQuantities { model, delayed: &delays.inputs };
    let mut families = families::families(&mut graph, &plan, &origins);
    let bounds = &transferred.bounds;
    saturate(&mut graph, varying, bounds, &mut unknowns, &mut families, &mut automata);
    let mut dae = Dae {
        graph,
        unknowns,
        families,
        delays: delays.delays,
        varying_delays: delays.varying,
        delayed_inputs: delays.inputs,
        delayed_unknowns: delays.unknowns,
        differentiated_inputs,
        outputs,
        start_equations,
        names: transferred.names,
        automata,
        impulses,
        time_conditions,
        clocks,
        ..declared(model)
    };
    switches::histories::verify(&mut dae, model, diagnostics)?;
    // After this: no switch in a row whose value or slope jumps without an event.
    switches::locate(&mut dae, model);
    // Sliding variables take part in no jump.
    dae.impulses.pad(&mut dae.graph, dae.unknowns.len());
    // After this: no slopes of inputs; they are inputs of their own.
    take_slopes(&mut dae);
    // After this: no elements of arrays; they are unknowns.
    let dae = families::place(dae, model, &origins, diagnostics)?;
    // After this: a model that starts at rest can be at rest, and its start values are not estimated.
    let dae = rest::verify(dae, model, diagnostics)?;
    // After this: as many start equations as states that they determine, and none of these is estimated.
    start_equations::verify(dae, model, diagnostics)
}

/// A system with the declarations of a model and no equations yet.
fn declared(model: &Model) -> Dae {
    Dae {
        name: model.name.clone(),
        doc: model.doc.clone(),
        graph: ExprGraph::default(),
        unknowns: Vec::new(),
        arrays: Vec::new(),
        families: Vec::new(),
        parameters: model.parameters.clone(),
        smoothness: model.smoothness.clone(),
        inputs: model.inputs.clone(),
        delays: Vec::new(),
        varying_delays: Vec::new(),
        delayed_inputs: Vec::new(),
        delayed_unknowns: Vec::new(),
        differentiated_inputs: Vec::new(),
        outputs: Vec::new(),
        densities: model.densities.clone(),
        starts_at_rest: model.starts_at_rest.is_some(),
        start_equations: Vec::new(),
        output_arrays: Vec::new(),
        names: BTreeMap::new(),
        variants: model.variants.clone(),
        automata: Vec::new(),
        impulses: Impulses::default(),
        unlocated: Vec::new(),
        time_conditions: Vec::new(),
        clocks: Vec::new(),
    }
}
