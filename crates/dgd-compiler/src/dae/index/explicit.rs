//! The rows of one combination of modes: some equations are solved for derivatives, the others are matched to algebraic
//! unknowns.

use std::collections::BTreeMap;

use super::dummy_derivatives::Block;
use super::linear_derivatives::Residual;
use super::pantelides::Reduced;
use super::variables::{Added, Variables, sum};
use crate::dae::matching::maximum_matching;
use crate::dae::transfer::Equation;
use crate::expr::{ExprId, Graph, Symbol};

/// The equations of a combination of modes, and their rows.
pub(in crate::dae) struct Explicit {
    pub(super) reduced: Reduced,
    pub(super) blocks: Vec<Block>,
}

/// A row: ẏ = rhs or 0 = rhs.
#[derive(Clone)]
pub(super) struct Row {
    pub(super) rhs: ExprId,
    pub(super) differential: bool,
    pub(super) equation: usize,
    /// How many times the equation has been differentiated.
    pub(super) order: u32,
}

impl Explicit {
    /// All expressions in it.
    pub(in crate::dae) fn expressions(&mut self) -> impl Iterator<Item = &mut ExprId> {
        let Reduced { rates, algebraic, constraints, .. } = &mut self.reduced;
        let residuals = algebraic.iter_mut().chain(constraints).map(|residual| &mut residual.rest);
        let choices = self.blocks.iter_mut().flat_map(|block| &mut block.choices);
        let pivots = choices.map(|choice| &mut choice.pivot);
        rates.values_mut().map(|rate| &mut rate.value).chain(residuals).chain(pivots)
    }
}

/// The row of an unknown in one combination of modes.
#[derive(Clone)]
pub(super) enum Place {
    /// Independent of the choice of states.
    Fixed(Row),
    /// One for each choice of a block.
    Chosen(usize, Vec<Row>),
}

impl Place {
    /// All rows.
    pub(super) fn rows(&self) -> &[Row] {
        match self {
            Place::Fixed(row) => std::slice::from_ref(row),
            Place::Chosen(_, rows) => rows,
        }
    }
}

/// The rows of one combination of modes of a part, whose unknowns are `own`, in their order.
///
/// The choice of a block affects only its own unknowns: its constraints determine those that are not states, and the
/// equations without derivatives determine the algebraic unknowns, whatever the choice.
pub(super) fn rows_of(
    graph: &mut Graph,
    system: &Explicit,
    variables: &Variables,
    equations: &[Equation<'_>],
    own: &[u32],
) -> Vec<(u32, Place)> {
    let reduced = &system.reduced;
    let mut places: Vec<Option<Place>> = vec![None; variables.len()];
    for (&i, rate) in &reduced.rates {
        let row = Row { rhs: rate.value, differential: true, equation: rate.equation, order: 0 };
        places[i as usize] = Some(Place::Fixed(row));
    }
    for (position, block) in system.blocks.iter().enumerate() {
        let choices = block.choices.iter().map(|choice| {
            let constraints = block.rows.iter().map(|row| &reduced.constraints[*row]);
            matched(graph, equations, &constraints.collect::<Vec<_>>(), &choice.dummies)
        });
        let choices: Vec<BTreeMap<u32, Row>> = choices.collect();
        for i in &block.candidates {
            let Some(Place::Fixed(rate)) = &places[*i as usize] else {
                unreachable!("constraints tie unknowns that have a derivative")
            };
            let row = |choice: &BTreeMap<u32, Row>| choice.get(i).unwrap_or(rate).clone();
            let rows: Vec<Row> = choices.iter().map(row).collect();
            places[*i as usize] = Some(Place::Chosen(position, rows));
        }
    }
    let algebraic: Vec<&Residual> = reduced.algebraic.iter().collect();
    let mut unknowns = reduced.unknowns.clone();
    unknowns.sort_unstable();
    for (i, row) in matched(graph, equations, &algebraic, &unknowns) {
        places[i as usize] = Some(Place::Fixed(row));
    }
    let rows = own.iter().map(|&i| {
        let place = places[i as usize].take();
        let unused = || Place::Fixed(unused_row(graph, reduced, variables, i));
        (i, place.unwrap_or_else(unused))
    });
    rows.collect()
}

/// The row of an unknown that only other modes need: 0 = ẋ − z, or 0 = −z if x is algebraic; 0 = Σ c x − w.
fn unused_row(graph: &mut Graph, reduced: &Reduced, variables: &Variables, i: u32) -> Row {
    let Some(addition) = variables.addition(i) else {
        unreachable!("what is declared is in use in all modes")
    };
    let value = match &addition.what {
        Added::RateOf(x) => match reduced.rates.get(x) {
            Some(rate) => rate.value,
            None => graph.constant(0.0),
        },
        Added::Combination(terms) => sum(graph, terms, |graph, x| graph.symbol(Symbol::Unknown(x))),
    };
    let symbol = graph.symbol(Symbol::Unknown(i));
    let rhs = graph.subtract(value, symbol);
    Row { rhs, differential: false, equation: addition.equation, order: 0 }
}

/// Matches unknowns to the equations that determine them.
fn matched(
    graph: &Graph,
    equations: &[Equation<'_>],
    residuals: &[&Residual],
    unknowns: &[u32],
) -> BTreeMap<u32, Row> {
    let column: BTreeMap<u32, usize> =
        unknowns.iter().enumerate().map(|(column, i)| (*i, column)).collect();
    let incidence: Vec<Vec<usize>> = residuals
        .iter()
        .map(|residual| {
            let read = equations[residual.equation].unknowns(graph, residual.rest);
            read.into_iter().filter_map(|i| column.get(&i).copied()).collect()
        })
        .collect();
    let matching = maximum_matching(&incidence, unknowns.len());
    let pairs = residuals.iter().zip(&matching.of_row);
    pairs
        .map(|(residual, column)| {
            // Index reduction has matched algebraic equations; constraints have nonzero pivots.
            let unknown = unknowns[column.unwrap_or_else(|| unreachable!("no row is free"))];
            let Residual { rest, equation, order } = **residual;
            (unknown, Row { rhs: rest, differential: false, equation, order })
        })
        .collect()
}
