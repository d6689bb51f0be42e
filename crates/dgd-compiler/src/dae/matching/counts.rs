//! Checks that there are as many equations as unknowns, and that each equation determines an unknown.

use super::dulmage_mendelsohn::{MatchingBlock, overdetermined, underdetermined};
use super::{Matching, maximum_matching};
use crate::dae::transfer::TransferredEquation;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::ExprGraph;
use crate::model::Model;
use crate::source::Span;

/// Checks that the active equations can be matched to the unknowns one to one.
pub(in crate::dae) fn verify_counts(
    model: &Model,
    graph: &ExprGraph,
    all: &[TransferredEquation<'_>],
    holding: &[usize],
    context: &str,
    diagnostics: &mut Diagnostics,
) -> Result<(), ErrorReported> {
    let equations: Vec<&TransferredEquation<'_>> = holding.iter().map(|e| &all[*e]).collect();
    let incidence: Vec<Vec<usize>> = equations
        .iter()
        .map(|equation| {
            let read = equation.unknowns(graph, equation.rest).into_iter();
            let occurring = read.chain(equation.derivatives.iter().copied());
            let mut unknowns: Vec<usize> = occurring.map(|i| i as usize).collect();
            unknowns.sort_unstable();
            unknowns.dedup();
            unknowns
        })
        .collect();
    let mut empty = None;
    for (equation, unknowns) in equations.iter().zip(&incidence) {
        if unknowns.is_empty() {
            empty = Some(
                diagnostics.error(
                    Diagnostic::new(
                        Code::EquationWithoutUnknown,
                        equation.span,
                        format!("equation `{}` determines nothing", equation.label),
                    )
                    .here("no unknown is left in it")
                    .help("it holds always or never; leave it out, or let it read a state"),
                ),
            );
        }
    }
    empty.map_or(Ok(()), Err)?;

    let matching = maximum_matching(&incidence, model.unknowns.len());
    if matching.free_rows().next().is_none() && matching.free_columns().next().is_none() {
        return Ok(());
    }
    let mismatch = CountMismatch { model, equations: &equations, incidence: &incidence, matching };
    Err(diagnostics.error(mismatch.diagnostic(context)))
}

/// Equations and unknowns that cannot all be matched.
struct CountMismatch<'a> {
    model: &'a Model,
    equations: &'a [&'a TransferredEquation<'a>],
    incidence: &'a [Vec<usize>],
    matching: Matching,
}

impl CountMismatch<'_> {
    fn diagnostic(&self, context: &str) -> Diagnostic {
        let free_equations: Vec<usize> = self.matching.free_rows().collect();
        let free_unknowns: Vec<usize> = self.matching.free_columns().collect();
        let (n_equations, n_unknowns) = (self.equations.len(), self.model.unknowns.len());
        let equation_names = self.labels(&free_equations);
        let unknown_names = self.names(&free_unknowns);
        let counts = format!(
            "{n_equations} {} for {n_unknowns} {}{context}",
            plural(n_equations, "equation"),
            plural(n_unknowns, "unknown")
        );
        let spans = |equations: &[usize]| -> Vec<Span> {
            equations.iter().map(|e| self.equations[*e].span).collect()
        };
        if n_equations > n_unknowns {
            let spans = spans(&free_equations);
            let diagnostic = Diagnostic::new(
                Code::TooManyEquations,
                spans[0],
                format!("too many equations, {counts}: no unknown is left for {equation_names}"),
            )
            .help(format!(
                "{}leave out what has been said already, or declare the unknown that is missing",
                self.too_much()
            ));
            return more_places(diagnostic, spans.into_iter().skip(1), "this one too");
        }
        let first = &self.model.unknowns[free_unknowns[0]].declared;
        let others = free_unknowns.iter().skip(1).map(|u| self.model.unknowns[*u].declared.span);
        let diagnostic = if n_equations < n_unknowns {
            Diagnostic::new(
                Code::TooFewEquations,
                first.span,
                format!("too few equations, {counts}: nothing determines {unknown_names}"),
            )
            .help(format!(
                "{}add an equation that determines it, or declare it as an input",
                self.too_little()
            ))
        } else {
            let diagnostic = Diagnostic::new(
                Code::UndeterminedUnknowns,
                first.span,
                format!(
                    "nothing determines {unknown_names}, and no unknown is left for \
                     {equation_names}{context}"
                ),
            )
            .help(format!(
                "{}{}the counts match all the same",
                self.too_much(),
                self.too_little()
            ));
            let spare = spans(&free_equations).into_iter();
            more_places(diagnostic, spare, "one too many for the unknowns in it")
        };
        more_places(diagnostic, others, "nor this")
    }

    /// The equations with too few unknowns between them, if these are more than the unmatched ones.
    fn too_much(&self) -> String {
        let MatchingBlock { rows, columns } = overdetermined(self.incidence, &self.matching);
        if columns.is_empty() {
            return String::new();
        }
        let verb = if rows.len() == 1 { "has" } else { "have" };
        format!("{} {verb} only {} to determine; ", self.labels(&rows), self.names(&columns))
    }

    /// The unknowns with too few equations between them.
    fn too_little(&self) -> String {
        let MatchingBlock { rows, columns } = underdetermined(self.incidence, &self.matching);
        if rows.is_empty() {
            return format!("no equation reads {}; ", self.names(&columns));
        }
        format!("{} have only {} between them; ", self.names(&columns), self.labels(&rows))
    }

    fn labels(&self, equations: &[usize]) -> String {
        quoted(equations.iter().map(|e| self.equations[*e].label))
    }

    fn names(&self, unknowns: &[usize]) -> String {
        quoted(unknowns.iter().map(|u| self.model.unknowns[*u].declared.name.as_str()))
    }
}

/// At most this many items of a long list are shown.
const MOST_SHOWN: usize = 5;

pub(in crate::dae) fn quoted<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    let mut shown: Vec<String> =
        names.iter().take(MOST_SHOWN).map(|name| format!("`{name}`")).collect();
    if names.len() > MOST_SHOWN {
        shown.push(format!("{} more", names.len() - MOST_SHOWN));
    }
    shown.join(", ")
}

pub(in crate::dae) fn more_places(
    diagnostic: Diagnostic,
    spans: impl Iterator<Item = Span>,
    text: &str,
) -> Diagnostic {
    spans.take(MOST_SHOWN - 1).fold(diagnostic, |diagnostic, span| diagnostic.label(span, text))
}

fn plural(n: usize, noun: &str) -> String {
    if n == 1 { noun.to_owned() } else { format!("{noun}s") }
}
