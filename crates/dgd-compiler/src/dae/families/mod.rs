//! Equations of loops and elements of arrays: which equation determines which elements.
//!
//! A loop's equation is one row expression for all its indices, a family. It is solved, matched and stored as a whole,
//! so nothing here grows with the length of an array.

mod elementwise;
mod intervals;
mod place;
mod planned;
mod wholesale;
mod written_out;

use std::collections::{BTreeMap, BTreeSet};

use self::elementwise::UnmatchedItems;
use self::intervals::ColumnIntervals;
use super::index::solve_for_derivative;
use super::modes::ModeCombinations;
use super::transfer::{TransferredEquation, TransferredModel};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{ExprGraph, Symbol};
use crate::model::Model;

pub(crate) use place::row_of;
pub(super) use place::{RowOrigins, families, isolate, place};
pub(super) use planned::FamilyPlan;
use planned::{ColumnCandidates, ColumnNumbering, PlannedRows, elements_name};
pub(super) use written_out::written_out;

/// Finds an equation for each element. Single equations that match no single unknown are left to index reduction;
/// arrays that would have to take part in it are added to `tied`, and the failure is reported.
///
/// Equations of modes determine only single unknowns, so the rows of arrays are the same in all modes. The equations of
/// the initial modes represent the others.
pub(super) fn plan(
    model: &Model,
    graph: &mut ExprGraph,
    transferred: &TransferredModel<'_>,
    tied: &mut BTreeSet<usize>,
    diagnostics: &mut Diagnostics,
) -> Result<FamilyPlan, ErrorReported> {
    if model.arrays.is_empty() && model.families.is_empty() {
        return Ok(FamilyPlan::default());
    }
    let equations = &transferred.equations;
    let families = equations.len() - model.families.len();
    let count = |e: usize| e.checked_sub(families).map_or(1, |f| model.families[f].count);
    let holding = transferred.holding(&ModeCombinations::start_modes(model));
    let positions: Vec<usize> = holding.into_iter().chain(families..equations.len()).collect();
    let n_elements = model.arrays.iter().map(|array| array.count as usize).sum();
    let columns = ColumnNumbering { n_single: model.unknowns.len(), n_elements };

    let mut rows = Vec::new();
    for (e, equation) in equations.iter().enumerate() {
        let count = count(e);
        rows.extend(solved(model, graph, e, equation, count, diagnostics)?);
    }
    verify_once(model, equations, &mut rows, diagnostics)?;
    let mut taken: BTreeSet<usize> = rows.iter().map(|row| row.equation).collect();

    let mut free = ColumnIntervals::new(0, columns.len());
    for row in &rows {
        free.remove(columns.element(row.first), row.count as usize);
    }
    let mut users: BTreeMap<u32, usize> = BTreeMap::new();
    for derivative in equations.iter().flat_map(|equation| &equation.derivatives) {
        *users.entry(*derivative).or_default() += 1;
    }
    let left: Vec<ColumnCandidates> = positions
        .iter()
        .filter(|e| !taken.contains(e))
        .map(|&e| candidate(graph, e, &equations[e], count(e), &users, columns))
        .collect();
    for candidate in left.iter().filter(|candidate| candidate.columns.is_empty()) {
        verify_unknowns(graph, &equations[candidate.equation], diagnostics);
    }
    diagnostics.check()?;
    let nothing_left = free.len() == columns.n_single && left.iter().all(|row| row.count == 1);
    // Single equations and unknowns are counted and matched with all others of their kind.
    if !nothing_left {
        let assignment = match wholesale::assign(&left, free, columns.n_single) {
            Some(found) => found,
            None => elementwise::assign(
                model,
                graph,
                transferred,
                &UnmatchedItems { all: &positions, left: &left, columns, solved: &rows },
                tied,
                diagnostics,
            )?,
        };
        for assigned in assignment {
            let equation = &equations[assigned.equation];
            let Some(first) = assigned.column.checked_sub(columns.n_single) else { continue };
            let first = u32::try_from(first).unwrap_or(u32::MAX);
            if (transferred.common..families).contains(&assigned.equation) {
                let message = format!(
                    "equation `{}` of a mode would determine `{}`, an element of an array",
                    equation.label,
                    model.element_name(first)
                );
                return Err(diagnostics
                    .error(Diagnostic::new(Code::ElementInMode, equation.span, message).help(
                    "let the mode determine an `unknown`, and an equation of all modes the element",
                )));
            }
            taken.insert(assigned.equation);
            rows.push(PlannedRows {
                first,
                count: assigned.count,
                equation: assigned.equation,
                from: assigned.from,
                rhs: equation.rest,
                differential: false,
            });
        }
    }
    rows.sort_unstable_by_key(|row| row.first);
    Ok(FamilyPlan { taken, rows })
}

/// The rows ẏ = f of an equation that has derivatives of elements.
fn solved(
    model: &Model,
    graph: &mut ExprGraph,
    position: usize,
    equation: &TransferredEquation<'_>,
    count: u32,
    diagnostics: &mut Diagnostics,
) -> Result<Option<PlannedRows>, ErrorReported> {
    let symbols = graph.symbols(equation.rest);
    let rates: Vec<Symbol> = symbols.iter().copied().filter(|symbol| is_rate(*symbol)).collect();
    let of_elements =
        |symbol: &Symbol| matches!(symbol, Symbol::ElementRate(_) | Symbol::SweptRate(_));
    let Some(&of_element) = rates.iter().find(|symbol| of_elements(symbol)) else {
        return Ok(None);
    };
    let name = rate_name(model, of_element, count);
    let (first, sweeps) = match of_element {
        Symbol::SweptRate(first) => (first, true),
        Symbol::ElementRate(first) => (first, false),
        _ => unreachable!("asked above"),
    };
    let refuse = |diagnostics: &mut Diagnostics, why: &str| {
        let message = format!("equation `{}` cannot be solved for {name}: {why}", equation.label);
        Err(diagnostics
            .error(Diagnostic::new(Code::UnsolvableElement, equation.span, message).help(
            "each derivative of an element stands in one equation, alone and linearly; give what \
             else needs it an `unknown`",
        )))
    };
    if rates.len() > 1 {
        return refuse(diagnostics, "it holds other derivatives, too");
    }
    if !sweeps && count > 1 {
        return refuse(diagnostics, "it holds for several indices");
    }
    let Some(rhs) = solve_for_derivative(graph, equation.rest, of_element) else {
        return refuse(diagnostics, "the derivative is not linear in it");
    };
    Ok(Some(PlannedRows { first, count, equation: position, from: 0, rhs, differential: true }))
}

fn is_rate(symbol: Symbol) -> bool {
    matches!(symbol, Symbol::Derivative(_) | Symbol::ElementRate(_) | Symbol::SweptRate(_))
}

fn rate_name(model: &Model, rate: Symbol, count: u32) -> String {
    match rate {
        Symbol::SweptRate(first) => format!("`der({})`", elements_name(model, first, count)),
        Symbol::ElementRate(first) => format!("`der({})`", model.element_name(first)),
        _ => unreachable!("a derivative of an element"),
    }
}

/// Checks that no derivative is determined twice.
fn verify_once(
    model: &Model,
    equations: &[TransferredEquation<'_>],
    rows: &mut [PlannedRows],
    diagnostics: &mut Diagnostics,
) -> Result<(), ErrorReported> {
    rows.sort_unstable_by_key(|row| row.first);
    for pair in rows.windows(2) {
        let [a, b] = pair else { unreachable!("windows of two") };
        if b.first < a.first + a.count {
            let end = (a.first + a.count).min(b.first + b.count);
            let elements = elements_name(model, b.first, end - b.first);
            let [a, b] = [&equations[a.equation], &equations[b.equation]];
            let message = format!(
                "equations `{}` and `{}` both determine `der({elements})`",
                a.label, b.label
            );
            return Err(diagnostics.error(
                Diagnostic::new(Code::TooManyEquations, b.span, message)
                    .label(a.span, "the other one")
                    .help("leave out what has been said already, or let the loops not overlap"),
            ));
        }
    }
    Ok(())
}

/// Checks that an equation that can determine nothing at least reads an unknown.
fn verify_unknowns(
    graph: &ExprGraph,
    equation: &TransferredEquation<'_>,
    diagnostics: &mut Diagnostics,
) {
    let is_unknown = |symbol: &Symbol| {
        matches!(
            symbol,
            Symbol::Unknown(_) | Symbol::Derivative(_) | Symbol::Element(_) | Symbol::Swept(_)
        )
    };
    if !graph.symbols(equation.rest).iter().any(is_unknown) {
        let message = format!("equation `{}` determines nothing", equation.label);
        diagnostics.error(
            Diagnostic::new(Code::EquationWithoutUnknown, equation.span, message)
                .here("no unknown is left in it")
                .help("it holds always or never; leave it out, or let it read a state"),
        );
    }
}

/// The columns that an equation without derivatives of elements could determine.
fn candidate(
    graph: &ExprGraph,
    position: usize,
    equation: &TransferredEquation<'_>,
    count: u32,
    users: &BTreeMap<u32, usize>,
    columns: ColumnNumbering,
) -> ColumnCandidates {
    let column = match equation.derivatives[..] {
        // It gives this derivative.
        [i] if users.get(&i) == Some(&1) => vec![i as usize],
        _ => graph
            .symbols(equation.rest)
            .into_iter()
            .filter_map(|symbol| match symbol {
                Symbol::Unknown(i) | Symbol::Derivative(i) if count == 1 => Some(i as usize),
                Symbol::Element(i) if count == 1 && equation.derivatives.is_empty() => {
                    Some(columns.element(i))
                }
                Symbol::Swept(i) => Some(columns.element(i)),
                _ => None,
            })
            .collect(),
    };
    let mut candidate = ColumnCandidates { equation: position, count, columns: column };
    candidate.columns.sort_unstable();
    candidate.columns.dedup();
    candidate
}
