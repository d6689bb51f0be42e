//! As many equations as unknowns, and no equation that determines nothing.

use super::matching::maximum_matching;
use super::transfer::Equation;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use crate::expr::{Graph, Symbol};
use crate::model::Model;
use crate::source::Span;

/// As many equations as unknowns, each with something to say about one of its own.
pub(super) fn verify_counts(
    model: &Model,
    graph: &Graph,
    all: &[Equation<'_>],
    (holding, context): (&[usize], &str),
    diagnostics: &mut Diagnostics,
) -> Result<(), Reported> {
    let equations: Vec<&Equation<'_>> = holding.iter().map(|e| &all[*e]).collect();
    let incidence: Vec<Vec<usize>> = equations
        .iter()
        .map(|equation| {
            let mut unknowns: Vec<usize> = graph
                .symbols(equation.rest)
                .into_iter()
                .filter_map(|symbol| match symbol {
                    Symbol::Unknown(i) | Symbol::Derivative(i) => Some(i as usize),
                    _ => None,
                })
                .collect();
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
                        Code::E405,
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
    let free_equations: Vec<usize> = matching.free_rows().collect();
    let free_unknowns: Vec<usize> = matching.free_columns().collect();
    let (n_equations, n_unknowns) = (equations.len(), model.unknowns.len());
    let equation_names = quoted(free_equations.iter().map(|e| equations[*e].label));
    let unknown_names =
        quoted(free_unknowns.iter().map(|u| model.unknowns[*u].declared.name.as_str()));
    let counts = format!(
        "{n_equations} {} for {n_unknowns} {}{context}",
        plural(n_equations, "equation"),
        plural(n_unknowns, "unknown")
    );
    if free_equations.is_empty() && free_unknowns.is_empty() {
        return Ok(());
    }
    if n_equations > n_unknowns {
        let first = &equations[free_equations[0]];
        let diagnostic = Diagnostic::new(
            Code::E401,
            first.span,
            format!("too many equations, {counts}: no unknown is left for {equation_names}"),
        )
        .help("leave out what has been said already, or declare the unknown that is missing");
        return Err(diagnostics.error(more_places(
            diagnostic,
            free_equations.iter().skip(1).map(|e| equations[*e].span),
            "this one too",
        )));
    }
    let first = &model.unknowns[free_unknowns[0]].declared;
    let others = free_unknowns.iter().skip(1).map(|u| model.unknowns[*u].declared.span);
    let diagnostic = if n_equations < n_unknowns {
        Diagnostic::new(
            Code::E402,
            first.span,
            format!("too few equations, {counts}: nothing determines {unknown_names}"),
        )
        .help("add an equation that determines it, or declare it as an input")
    } else {
        let spare = free_equations.iter().map(|e| equations[*e].span);
        let diagnostic = Diagnostic::new(
            Code::E403,
            first.span,
            format!(
                "nothing determines {unknown_names}, and no unknown is left for \
                 {equation_names}{context}"
            ),
        )
        .help("the counts match, but several equations determine the same unknowns");
        more_places(diagnostic, spare, "one too many for the unknowns in it")
    };
    Err(diagnostics.error(more_places(diagnostic, others, "nor this")))
}

/// At most this many places and names are shown of a long list.
const MOST_SHOWN: usize = 5;

pub(super) fn quoted<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    let mut shown: Vec<String> =
        names.iter().take(MOST_SHOWN).map(|name| format!("`{name}`")).collect();
    if names.len() > MOST_SHOWN {
        shown.push(format!("{} more", names.len() - MOST_SHOWN));
    }
    shown.join(", ")
}

pub(super) fn more_places(
    diagnostic: Diagnostic,
    spans: impl Iterator<Item = Span>,
    text: &str,
) -> Diagnostic {
    spans.take(MOST_SHOWN - 1).fold(diagnostic, |diagnostic, span| diagnostic.label(span, text))
}

fn plural(n: usize, noun: &str) -> String {
    if n == 1 { noun.to_owned() } else { format!("{noun}s") }
}
