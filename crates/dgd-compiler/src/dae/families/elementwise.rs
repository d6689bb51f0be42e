//! Matches elements one by one if families cannot be matched as wholes, and reports the unmatched ones.

use std::collections::BTreeSet;

use super::planned::{
    ColumnCandidates, ColumnNumbering, FamilyAssignment, PlannedRows, elements_name,
};
use crate::dae::matching::{maximum_matching, more_places, quoted};
use crate::dae::transfer::TransferredModel;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{ExprGraph, Symbol};
use crate::model::Model;

/// At most this many rows are matched one by one.
const MOST_ROWS: usize = 200_000;

/// Equations and elements to be matched one by one.
pub(super) struct UnmatchedItems<'a> {
    /// Positions of all equations.
    pub(super) all: &'a [usize],
    /// Those without elements so far.
    pub(super) left: &'a [ColumnCandidates],
    pub(super) columns: ColumnNumbering,
    /// Rows of elements whose derivatives are given by equations.
    pub(super) solved: &'a [PlannedRows],
}

/// Unmatched items, and the total number.
struct UnmatchedGroup<'a, T> {
    items: &'a [T],
    total: usize,
}

/// Matches each passage of each equation separately; consecutive passages are joined again.
pub(super) fn assign(
    model: &Model,
    graph: &ExprGraph,
    transferred: &TransferredModel<'_>,
    unmatched: &UnmatchedItems<'_>,
    tied: &mut BTreeSet<usize>,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<FamilyAssignment>, ErrorReported> {
    let UnmatchedItems { all, left, columns, solved } = *unmatched;
    let names = MatchingNames { model, transferred };
    let n_rows: usize = left.iter().map(|row| row.count as usize).sum();
    let determined: usize = solved.iter().map(|row| row.count as usize).sum();
    if n_rows.max(columns.len() - determined) > MOST_ROWS {
        return Err(names.too_many(left, diagnostics));
    }
    let mut is_solved = vec![false; columns.len()];
    for row in solved {
        let first = columns.element(row.first);
        is_solved[first..first + row.count as usize].fill(true);
    }
    let passages: Vec<(usize, u32)> = left
        .iter()
        .enumerate()
        .flat_map(|(row, candidate)| (0..candidate.count).map(move |passage| (row, passage)))
        .collect();
    let incidence: Vec<Vec<usize>> = passages
        .iter()
        .map(|&(row, passage)| {
            let candidate = &left[row];
            let moved = candidate.columns.iter().map(|c| c + passage as usize);
            moved.filter(|column| !is_solved[*column]).collect()
        })
        .collect();
    let matching = maximum_matching(&incidence, columns.len());
    let free_rows: Vec<(usize, u32)> = matching.free_rows().map(|row| passages[row]).collect();
    let free_columns: Vec<usize> =
        matching.free_columns().filter(|column| !is_solved[*column]).collect();
    // Unmatched single equations and unknowns may be a matter of the index.
    let is_single = |(row, _): &(usize, u32)| left[*row].count == 1;
    let only_single = free_columns.iter().all(|column| *column < columns.n_single)
        && free_rows.iter().all(is_single)
        && free_rows.len() == free_columns.len();
    if only_single {
        let pairs = passages.iter().zip(&matching.of_row);
        let assigned = pairs.filter_map(|(&(row, passage), column)| {
            let equation = left[row].equation;
            column.map(|column| FamilyAssignment { equation, from: passage, count: 1, column })
        });
        return Ok(joined(assigned).into_iter().filter(|a| a.column >= columns.n_single).collect());
    }
    let rows: Vec<(usize, u32)> =
        free_rows.iter().map(|(row, passage)| (left[*row].equation, *passage)).collect();
    let ties_states = free_rows.len() == free_columns.len()
        && could_be_matched(model, graph, transferred, all, columns);
    if ties_states {
        let of_columns =
            free_columns.iter().filter_map(|column| column.checked_sub(columns.n_single));
        let read = rows.iter().flat_map(|(e, _)| graph.symbols(transferred.equations[*e].rest));
        let read = read.filter_map(|symbol| match symbol {
            Symbol::Element(i) | Symbol::Swept(i) => Some(i as usize),
            _ => None,
        });
        tied.extend(of_columns.chain(read).map(|element| array_of(model, element)));
    }
    Err(names.report(
        &UnmatchedGroup { items: &rows, total: n_rows },
        &UnmatchedGroup { items: &free_columns, total: columns.len() - determined },
        ties_states,
        diagnostics,
    ))
}

/// The position of the array that holds an element.
fn array_of(model: &Model, element: usize) -> usize {
    model.arrays.partition_point(|array| array.first as usize <= element).saturating_sub(1)
}

/// Joins consecutive passages that determine consecutive columns.
fn joined(all: impl Iterator<Item = FamilyAssignment>) -> Vec<FamilyAssignment> {
    let mut joined: Vec<FamilyAssignment> = Vec::new();
    for next in all {
        match joined.last_mut() {
            Some(last)
                if last.equation == next.equation
                    && last.from + last.count == next.from
                    && last.column + last.count as usize == next.column =>
            {
                last.count += 1;
            }
            _ => joined.push(next),
        }
    }
    joined
}

/// Whether all equations could be matched if derivatives counted as their unknowns: then the fault is the index, not
/// the number of equations.
fn could_be_matched(
    model: &Model,
    graph: &ExprGraph,
    transferred: &TransferredModel<'_>,
    all: &[usize],
    columns: ColumnNumbering,
) -> bool {
    let families = transferred.equations.len() - model.families.len();
    let mut incidence = Vec::new();
    for &e in all {
        let count = e.checked_sub(families).map_or(1, |f| model.families[f].count);
        if incidence.len() + count as usize > MOST_ROWS {
            return false;
        }
        let symbols = graph.symbols(transferred.equations[e].rest);
        for passage in 0..count {
            let column = |symbol: &Symbol| match *symbol {
                Symbol::Unknown(i) | Symbol::Derivative(i) => Some(i as usize),
                Symbol::Element(i) | Symbol::ElementRate(i) => Some(columns.element(i)),
                Symbol::Swept(i) | Symbol::SweptRate(i) => Some(columns.element(i + passage)),
                _ => None,
            };
            let mut row: Vec<usize> = symbols.iter().filter_map(column).collect();
            row.sort_unstable();
            row.dedup();
            incidence.push(row);
        }
    }
    let matching = maximum_matching(&incidence, columns.len());
    matching.free_rows().next().is_none() && matching.free_columns().next().is_none()
}

/// Names of unmatched equations and unknowns in messages.
struct MatchingNames<'a> {
    model: &'a Model,
    transferred: &'a TransferredModel<'a>,
}

impl MatchingNames<'_> {
    /// Single unknowns by name, elements as ranges.
    fn columns(&self, columns: &[usize]) -> String {
        let n_single = self.model.unknowns.len();
        let mut names = Vec::new();
        let mut run: Option<(u32, u32)> = None;
        let flush = |run: &mut Option<(u32, u32)>, names: &mut Vec<String>| {
            names.extend(run.take().map(|(first, count)| elements_name(self.model, first, count)));
        };
        for &column in columns {
            let Some(position) = column.checked_sub(n_single) else {
                names.push(self.model.unknowns[column].declared.name.clone());
                continue;
            };
            let position = u32::try_from(position).unwrap_or(u32::MAX);
            let begins_array = self.model.arrays.iter().any(|array| array.first == position);
            run = match run {
                Some((first, count)) if first + count == position && !begins_array => {
                    Some((first, count + 1))
                }
                _ => {
                    flush(&mut run, &mut names);
                    Some((position, 1))
                }
            };
        }
        flush(&mut run, &mut names);
        quoted(names.iter().map(String::as_str))
    }

    /// Equations by label, passages of loops as ranges.
    fn rows(&self, rows: &[(usize, u32)]) -> String {
        let families = self.transferred.equations.len() - self.model.families.len();
        let mut names: Vec<String> = Vec::new();
        let mut rest = rows;
        while let Some(&(e, from)) = rest.first() {
            let runs = rest.iter().zip(from..).take_while(|(row, passage)| **row == (e, *passage));
            let length = runs.count();
            let end = rest[length - 1].1;
            rest = &rest[length..];
            let label = self.transferred.equations[e].label;
            names.push(match e.checked_sub(families).map(|f| &self.model.families[f]) {
                None => label.to_owned(),
                Some(family) => {
                    let first = family.lower + i64::from(from);
                    let last = family.lower + i64::from(end);
                    if length == 1 {
                        format!("{label}[{first}]")
                    } else {
                        format!("{label}[{first}..{last}]")
                    }
                }
            });
        }
        quoted(names.iter().map(String::as_str))
    }

    fn report(
        &self,
        rows: &UnmatchedGroup<'_, (usize, u32)>,
        columns: &UnmatchedGroup<'_, usize>,
        ties_states: bool,
        diagnostics: &mut Diagnostics,
    ) -> ErrorReported {
        let (n_rows, n_columns) = (rows.total, columns.total);
        let (rows, columns) = (rows.items, columns.items);
        let n_single = self.model.unknowns.len();
        let of_column = |column: usize| match column.checked_sub(n_single) {
            None => self.model.unknowns[column].declared.span,
            Some(position) => {
                let is_it = |first: u32| first as usize <= position;
                let after = self.model.arrays.partition_point(|array| is_it(array.first));
                self.model.arrays[after - 1].unknown.declared.span
            }
        };
        let (row_names, column_names) = (self.rows(rows), self.columns(columns));
        let row_spans: Vec<_> = {
            let mut equations: Vec<usize> = rows.iter().map(|(e, _)| *e).collect();
            equations.dedup();
            equations.iter().map(|e| self.transferred.equations[*e].span).collect()
        };
        let others = row_spans.iter().skip(1).copied();
        let diagnostic = if ties_states {
            let message = format!(
                "the index is above 1: {row_names} only ties states together, and {column_names} \
                 follows from no equation without differentiating it"
            );
            let diagnostic = Diagnostic::new(Code::IrreducibleIndex, row_spans[0], message)
                .help("replace the equation by its derivative with respect to time");
            more_places(diagnostic, others, "this one too")
        } else if n_rows > n_columns {
            let message = format!("too many equations: no unknown is left for {row_names}");
            let diagnostic = Diagnostic::new(Code::TooManyEquations, row_spans[0], message).help(
                "leave out what has been said already, or declare the unknown that is missing",
            );
            more_places(diagnostic, others, "this one too")
        } else if n_rows < n_columns {
            let message = format!("too few equations: nothing determines {column_names}");
            Diagnostic::new(Code::TooFewEquations, of_column(columns[0]), message).help(
                "add an equation that determines it, or let a loop begin earlier or end later",
            )
        } else {
            let message = format!(
                "nothing determines {column_names}, and no unknown is left for {row_names}"
            );
            let diagnostic =
                Diagnostic::new(Code::UndeterminedUnknowns, of_column(columns[0]), message)
                    .help("the counts match, but several equations determine the same unknowns");
            let spare = row_spans.iter().copied();
            more_places(diagnostic, spare, "one too many for the unknowns in it")
        };
        diagnostics.error(diagnostic)
    }

    /// The error for too many rows to be matched one by one.
    fn too_many(&self, left: &[ColumnCandidates], diagnostics: &mut Diagnostics) -> ErrorReported {
        let longest = left.iter().max_by_key(|row| row.count);
        let equation = longest.map(|row| &self.transferred.equations[row.equation]);
        let array = self.model.arrays.first().map(|array| array.unknown.declared.span);
        let span = equation.map(|equation| equation.span).or(array).unwrap_or_default();
        let message = "equations and elements of arrays cannot be matched as wholes, and there are too \
             many to match them one by one";
        diagnostics.error(
            Diagnostic::new(Code::UnsolvableElement, span, message)
                .help("with a smaller size the message names what is left over"),
        )
    }
}
