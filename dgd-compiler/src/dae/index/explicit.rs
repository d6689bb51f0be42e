//! The rows of one combination of modes: derivatives are solved for, the other equations find their
//! algebraic unknowns.

use std::collections::BTreeSet;

use super::dummy_derivatives::Block;
use super::linear_derivatives::Residual;
use super::pantelides::Reduced;
use super::variables::{Added, Variables, sum};
use crate::dae::matching::maximum_matching;
use crate::dae::transfer::Equation;
use crate::expr::{ExprId, Graph, Symbol};

/// The equations that hold in a combination of modes, and what became of them.
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
    /// How often the equation has been differentiated.
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

/// The rows of one combination of modes, in the order of the unknowns; `chosen` has the choice of
/// each block.
pub(super) fn rows_of(
    graph: &mut Graph,
    system: &Explicit,
    chosen: &[usize],
    variables: &Variables,
    equations: &[Equation<'_>],
) -> Vec<Row> {
    let reduced = &system.reduced;
    let dummies: BTreeSet<u32> = system
        .blocks
        .iter()
        .zip(chosen)
        .flat_map(|(block, choice)| &block.choices[*choice].dummies)
        .copied()
        .collect();
    let mut rows: Vec<Option<Row>> = vec![None; variables.len()];
    for (&i, rate) in reduced.rates.iter().filter(|(i, _)| !dummies.contains(i)) {
        let row = Row { rhs: rate.value, differential: true, equation: rate.equation, order: 0 };
        rows[i as usize] = Some(row);
    }
    let solved_for: BTreeSet<u32> = reduced.unknowns.iter().copied().chain(dummies).collect();
    for (i, row) in rows.iter_mut().enumerate() {
        let i = u32::try_from(i).unwrap_or(u32::MAX);
        if row.is_none() && !solved_for.contains(&i) {
            *row = Some(unused_row(graph, reduced, variables, i));
        }
    }
    match_algebraic(graph, reduced, equations, &mut rows);
    let row = |row: Option<Row>| {
        row.unwrap_or_else(|| unreachable!("as many equations as unknowns are left to be matched"))
    };
    rows.into_iter().map(row).collect()
}

/// The row of an unknown that other modes need: 0 = ẋ − z, and 0 = −z where x is algebraic;
/// 0 = Σ c x − w.
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
    let own = graph.symbol(Symbol::Unknown(i));
    let rhs = graph.subtract(value, own);
    Row { rhs, differential: false, equation: addition.equation, order: 0 }
}

/// Gives the algebraic unknowns the equations that determine them.
fn match_algebraic(
    graph: &Graph,
    reduced: &Reduced,
    equations: &[Equation<'_>],
    rows: &mut [Option<Row>],
) {
    let residuals: Vec<&Residual> = reduced.constraints.iter().chain(&reduced.algebraic).collect();
    let columns: Vec<usize> = (0..rows.len()).filter(|i| rows[*i].is_none()).collect();
    let mut position = vec![None; rows.len()];
    for (column, unknown) in columns.iter().enumerate() {
        position[*unknown] = Some(column);
    }
    let incidence: Vec<Vec<usize>> = residuals
        .iter()
        .map(|residual| {
            let unknowns = equations[residual.equation].unknowns(graph, residual.rest);
            unknowns.into_iter().filter_map(|i| position[i as usize]).collect()
        })
        .collect();
    let matching = maximum_matching(&incidence, columns.len());
    for (residual, column) in residuals.iter().zip(&matching.of_row) {
        // Index reduction has matched the one half, and pivots that are not zero the other.
        let unknown = columns[column.unwrap_or_else(|| unreachable!("no row is free"))];
        let Residual { rest, equation, order } = **residual;
        rows[unknown] = Some(Row { rhs: rest, differential: false, equation, order });
    }
}
