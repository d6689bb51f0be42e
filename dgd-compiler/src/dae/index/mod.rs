//! The systems of all combinations of modes, of index 1 at most, and the rows that they make together.
//!
//! | file | what it does |
//! |---|---|
//! | `linear_derivatives` | solves equations for derivatives |
//! | `pantelides` | differentiates equations until the index is 1 at most |
//! | `dummy_derivatives` | finds which states constraints can make algebraic |
//! | `state_selection` | chooses among them along a solution |
//! | `explicit` | makes a row of each equation |
//! | `variables` | declared unknowns, and those that these steps add |
//! | `identity`, `typical` | what expressions are worth, identically or at the start |
//! | `refusal` | says why an equation cannot be differentiated |

mod dummy_derivatives;
mod explicit;
mod identity;
mod linear_derivatives;
mod pantelides;
mod refusal;
mod state_selection;
mod typical;
mod variables;

use std::collections::BTreeSet;

use self::dummy_derivatives::blocks_of;
use self::explicit::{Row, rows_of};
use self::linear_derivatives::{Solved, solve_for_derivatives};
use self::pantelides::{Slopes, reduce};
use self::refusal::{no_choice, refuse, verify_bounds};
use self::typical::Typical;
use self::variables::Variables;
use crate::dae::matching::verify_counts;
use crate::dae::modes::{Combinations, in_modes};
use crate::dae::transfer::{Equation, Transferred};
use crate::dae::{Automaton, DelayedInput, DifferentiatedInput, Unknown};
use crate::diagnostics::{Diagnostics, Reported};
use crate::expr::{ExprId, Graph, Node, Symbol};
use crate::model::Model;

pub(super) use explicit::Explicit;
pub(super) use linear_derivatives::solve_for_derivative;
pub(super) use state_selection::Selections;

/// One system for each combination of the declared modes, over unknowns that all of them share.
pub(super) struct Systems {
    combinations: Combinations,
    /// In the order of the combinations.
    pub(super) explicit: Vec<Explicit>,
    variables: Variables,
    typical: Typical,
}

impl Systems {
    /// Counts the equations of every combination, solves them for derivatives and reduces the index.
    /// Equations that are `taken` determine elements of arrays.
    pub(super) fn reduced(
        model: &Model,
        graph: &mut Graph,
        transferred: &mut Transferred<'_>,
        delayed: &[DelayedInput],
        taken: &BTreeSet<usize>,
        combinations: Combinations,
        diagnostics: &mut Diagnostics,
    ) -> Result<Systems, Reported> {
        let histories = std::mem::take(&mut transferred.histories);
        let mut variables = Variables::declared(model, transferred.starts.clone(), histories);
        let typical = Typical::of(model, graph, &transferred.starts);
        let equations = &transferred.equations;
        let delayed = delayed.iter().map(|delayed| delayed.input).collect();
        let slopes = Slopes { inputs: &model.inputs, delayed };
        let reduction = Reduction { model, equations, slopes, typical: &typical };
        let mut explicit = Vec::new();
        for modes in combinations.iter() {
            let holding = transferred.holding(&modes).into_iter();
            let holding: Vec<usize> = holding.filter(|e| !taken.contains(e)).collect();
            let context = in_modes(model, &modes);
            let system = reduction.run(graph, &holding, &context, &mut variables, diagnostics)?;
            explicit.push(system);
        }
        Ok(Systems { combinations, explicit, variables, typical })
    }

    /// The inputs that equations have been differentiated through, each once.
    pub(super) fn differentiated_inputs(
        &self,
        equations: &[Equation<'_>],
    ) -> Vec<DifferentiatedInput> {
        let mut all: Vec<DifferentiatedInput> = Vec::new();
        let differentiated = self.explicit.iter().flat_map(|s| &s.reduced.differentiated);
        for (&input, &equation) in differentiated {
            if all.iter().all(|other| other.input != input) {
                let equation = equations[equation].label.to_owned().into();
                all.push(DifferentiatedInput { input, equation });
            }
        }
        all
    }

    /// The unknowns with their rows, which choose by the modes; `selecting` are the automata of the
    /// selections.
    pub(super) fn rows(
        &self,
        model: &Model,
        graph: &mut Graph,
        equations: &[Equation<'_>],
        selections: &Selections,
        selecting: &[Automaton],
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<Unknown>, Reported> {
        let combinations = self.combinations.and(selections.sizes(), model, diagnostics)?;
        let mut rows: Vec<Vec<Row>> = vec![Vec::new(); self.variables.len()];
        for modes in combinations.iter() {
            let (modes, choices) = modes.split_at(model.automata.len());
            let combination = self.combinations.position(modes);
            let chosen = selections.chosen(combination, choices);
            let system = &self.explicit[combination];
            let one = rows_of(graph, system, &chosen, &self.variables, equations);
            for (all, row) in rows.iter_mut().zip(one) {
                all.push(row);
            }
        }
        verify_bounds(model, graph, equations, &self.explicit, &rows, diagnostics);
        let selected = selecting.iter().map(|automaton| automaton.start);
        let modes: Vec<usize> =
            Combinations::start_modes(model).into_iter().chain(selected).collect();
        let start = combinations.position(&modes);
        let unknowns = self.variables.unknowns.iter().cloned().zip(rows);
        Ok(unknowns
            .map(|(unknown, rows)| complete(graph, equations, &combinations, start, unknown, &rows))
            .collect())
    }

    /// ẏ of each unknown, where it is given in all modes.
    pub(super) fn rates(&self, graph: &mut Graph) -> Vec<Option<ExprId>> {
        let mut rate_of = |i: u32| {
            let rates = self.explicit.iter().map(|s| s.reduced.rates.get(&i).map(|r| r.value));
            let rates = rates.collect::<Option<Vec<ExprId>>>()?;
            Some(self.combinations.merge(graph, rates))
        };
        let unknowns = 0..u32::try_from(self.variables.len()).unwrap_or(u32::MAX);
        unknowns.map(&mut rate_of).collect()
    }
}

/// What the reduction of every combination of modes reads.
struct Reduction<'a> {
    model: &'a Model,
    equations: &'a [Equation<'a>],
    slopes: Slopes<'a>,
    typical: &'a Typical,
}

impl Reduction<'_> {
    /// The system of the equations that hold in one combination, its states still to be chosen.
    /// `context` names the modes for messages.
    fn run(
        &self,
        graph: &mut Graph,
        holding: &[usize],
        context: &str,
        variables: &mut Variables,
        diagnostics: &mut Diagnostics,
    ) -> Result<Explicit, Reported> {
        let Reduction { model, equations, ref slopes, typical } = *self;
        verify_counts(model, graph, equations, holding, context, diagnostics)?;
        let solved = solve_for_derivatives(graph, equations, holding, variables);
        let in_use = in_use(graph, model.unknowns.len(), &solved);
        let reduced = reduce(graph, solved, &in_use, variables, equations, slopes);
        let reduced = reduced.map_err(|refusal| {
            refuse(model, equations, variables, context, &refusal, diagnostics)
        })?;
        let blocks = blocks_of(graph, &reduced, variables, &|symbol| typical.value(symbol));
        let blocks = blocks.map_err(|rows| {
            let rows = rows.into_iter().map(|row| &reduced.constraints[row]);
            no_choice(equations, rows, context, diagnostics)
        })?;
        Ok(Explicit { reduced, blocks })
    }
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
