//! The rows of one combination of modes: some equations are solved for derivatives, the others are matched to algebraic
//! unknowns.

use std::collections::BTreeMap;

use super::dummy_derivatives::ConstraintBlock;
use super::linear_derivatives::RemainingResidual;
use super::pantelides::ReducedSystem;
use super::variables::{AuxiliaryKind, UnknownList, sum};
use crate::dae::matching::maximum_matching;
use crate::dae::transfer::TransferredEquation;
use crate::expr::{ExprGraph, ExprId, Symbol};

/// The equations of a combination of modes, and their rows.
pub(in crate::dae) struct ExplicitSystem {
    pub(super) reduced: ReducedSystem,
    pub(super) blocks: Vec<ConstraintBlock>,
}

/// A row: ẏ = rhs or 0 = rhs.
#[derive(Clone)]
pub(super) struct ExplicitRow {
    pub(super) rhs: ExprId,
    pub(super) differential: bool,
    pub(super) equation: usize,
    /// How many times the equation has been differentiated.
    pub(super) order: u32,
}

impl ExplicitSystem {
    /// All expressions in it.
    pub(in crate::dae) fn expressions(&mut self) -> impl Iterator<Item = &mut ExprId> {
        let ReducedSystem { rates, algebraic, constraints, .. } = &mut self.reduced;
        let residuals = algebraic.iter_mut().chain(constraints).map(|residual| &mut residual.rest);
        let choices = self.blocks.iter_mut().flat_map(|block| &mut block.choices);
        let pivots = choices.map(|choice| &mut choice.pivot);
        rates.values_mut().map(|rate| &mut rate.value).chain(residuals).chain(pivots)
    }
}

/// The row of an unknown in one combination of modes.
#[derive(Clone)]
pub(super) enum RowAssignment {
    /// Independent of the choice of states.
    Fixed(ExplicitRow),
    /// One for each choice of a block.
    Chosen(usize, Vec<ExplicitRow>),
}

impl RowAssignment {
    /// All rows.
    pub(super) fn rows(&self) -> &[ExplicitRow] {
        match self {
            RowAssignment::Fixed(row) => std::slice::from_ref(row),
            RowAssignment::Chosen(_, rows) => rows,
        }
    }
}

/// The rows of one combination of modes of a part, whose unknowns are `own`, in their order.
///
/// The choice of a block affects only its own unknowns: its constraints determine those that are not states, and the
/// equations without derivatives determine the algebraic unknowns, whatever the choice.
pub(super) fn rows_of(
    graph: &mut ExprGraph,
    system: &ExplicitSystem,
    variables: &UnknownList,
    equations: &[TransferredEquation<'_>],
    own: &[u32],
) -> Vec<(u32, RowAssignment)> {
    let reduced = &system.reduced;
    let mut places: Vec<Option<RowAssignment>> = vec![None; variables.len()];
    for (&i, rate) in &reduced.rates {
        let row =
            ExplicitRow { rhs: rate.value, differential: true, equation: rate.equation, order: 0 };
        places[i as usize] = Some(RowAssignment::Fixed(row));
    }
    for (position, block) in system.blocks.iter().enumerate() {
        let choices = block.choices.iter().map(|choice| {
            let constraints = block.rows.iter().map(|row| &reduced.constraints[*row]);
            matched(graph, equations, &constraints.collect::<Vec<_>>(), &choice.dummies)
        });
        let choices: Vec<BTreeMap<u32, ExplicitRow>> = choices.collect();
        for i in &block.candidates {
            let Some(RowAssignment::Fixed(rate)) = &places[*i as usize] else {
                unreachable!("constraints tie unknowns that have a derivative")
            };
            let row = |choice: &BTreeMap<u32, ExplicitRow>| choice.get(i).unwrap_or(rate).clone();
            let rows: Vec<ExplicitRow> = choices.iter().map(row).collect();
            places[*i as usize] = Some(RowAssignment::Chosen(position, rows));
        }
    }
    let algebraic: Vec<&RemainingResidual> = reduced.algebraic.iter().collect();
    let mut unknowns = reduced.unknowns.clone();
    unknowns.sort_unstable();
    for (i, row) in matched(graph, equations, &algebraic, &unknowns) {
        places[i as usize] = Some(RowAssignment::Fixed(row));
    }
    let rows = own.iter().map(|&i| {
        let place = places[i as usize].take();
        let unused = || RowAssignment::Fixed(unused_row(graph, reduced, variables, i));
        (i, place.unwrap_or_else(unused))
    });
    rows.collect()
}

/// The row of an unknown that only other modes need: 0 = ẋ − z, or 0 = −z if x is algebraic; 0 = Σ c x − w.
fn unused_row(
    graph: &mut ExprGraph,
    reduced: &ReducedSystem,
    variables: &UnknownList,
    i: u32,
) -> ExplicitRow {
    let Some(addition) = variables.addition(i) else {
        unreachable!("what is declared is in use in all modes")
    };
    let value = match &addition.what {
        AuxiliaryKind::RateOf(x) => match reduced.rates.get(x) {
            Some(rate) => rate.value,
            None => graph.constant(0.0),
        },
        AuxiliaryKind::Combination(terms) => {
            sum(graph, terms, |graph, x| graph.symbol(Symbol::Unknown(x)))
        }
    };
    let symbol = graph.symbol(Symbol::Unknown(i));
    let rhs = graph.subtract(value, symbol);
    ExplicitRow { rhs, differential: false, equation: addition.equation, order: 0 }
}

/// Matches unknowns to the equations that determine them.
fn matched(
    graph: &ExprGraph,
    equations: &[TransferredEquation<'_>],
    residuals: &[&RemainingResidual],
    unknowns: &[u32],
) -> BTreeMap<u32, ExplicitRow> {
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
            let RemainingResidual { rest, equation, order } = **residual;
            (unknown, ExplicitRow { rhs: rest, differential: false, equation, order })
        })
        .collect()
}
