//! Finds the start values that the start equations of a model determine.

use std::collections::BTreeSet;

use super::Dae;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::Symbol;
use crate::model::{Equation, Model};
use crate::source::Span;

/// Assigns each start equation a state, whose start value is then not estimated.
///
/// States are those with `guess`, and all elements of arrays with it; if these are too few, also those whose
/// derivatives start equations read.
pub(super) fn verify(
    mut dae: Dae,
    model: &Model,
    diagnostics: &mut Diagnostics,
) -> Result<Dae, ErrorReported> {
    let equations = &model.start_equations;
    let n_single = dae.unknowns.len();
    let of_arrays = model.arrays.iter().filter(|array| array.unknown.guess);
    let of_arrays = of_arrays.flat_map(|array| array.first..array.first + array.count);
    let mut determined: BTreeSet<usize> = (0..model.unknowns.len())
        .filter(|i| model.unknowns[*i].guess)
        .chain(of_arrays.map(|element| n_single + element as usize))
        .collect();
    if equations.is_empty() && determined.is_empty() {
        return Ok(dae);
    }
    if let (Some(span), Some(equation)) = (model.starts_at_rest, equations.first()) {
        let message =
            "`start steady` determines all start values, and leaves none to a start equation";
        return Err(diagnostics.error(
            Diagnostic::new(Code::UndeterminedStart, equation.span, message)
                .label(span, "all of the model is at rest"),
        ));
    }
    if determined.len() < equations.len() {
        let of_one = |equation| derivatives(model, equation, n_single);
        determined.extend(equations.iter().flat_map(of_one));
    }
    if determined.len() != equations.len() {
        return Err(diagnostics.error(miscounted(model, n_single, &determined)));
    }
    for &i in &determined {
        if !dae.is_differential(i) {
            let message = format!(
                "the equations determine `{0}` at every time, so no start equation can",
                dae.unknown_name(i)
            );
            diagnostics.error(
                Diagnostic::new(Code::UndeterminedStart, declared_at(model, n_single, i), message)
                    .help("take out a start equation, or put it into the choice of the variant where it holds"),
            );
        }
    }
    for (own, equation) in dae.start_equations.iter().zip(equations) {
        let is_late = |symbol: &Symbol| {
            matches!(symbol, Symbol::DelayedUnknown(_) | Symbol::Delayed(_) | Symbol::Past(..))
        };
        if dae.graph.symbols(own.rest).iter().any(is_late) {
            diagnostics.error(reads_delayed(equation));
        }
    }
    diagnostics.check()?;
    for (equation, i) in dae.start_equations.iter_mut().zip(determined) {
        equation.unknown = i;
        if let Some(unknown) = dae.unknowns.get_mut(i) {
            unknown.fixed = true;
        }
    }
    Ok(dae)
}

/// The error for a start equation that reads an unknown before the start.
pub(super) fn reads_delayed(equation: &Equation) -> Diagnostic {
    let message = format!(
        "start equation `{}` depends on what an unknown was before the start",
        equation.label
    );
    Diagnostic::new(Code::UndeterminedStart, equation.span, message)
        .help("give the start value in the declaration of the state instead")
}

/// Positions of the unknowns whose derivatives an equation reads.
fn derivatives<'a>(
    model: &'a Model,
    equation: &'a Equation,
    n_single: usize,
) -> impl Iterator<Item = usize> + 'a {
    let sides = [equation.left, equation.right].into_iter();
    sides.flat_map(|side| model.graph.symbols(side)).filter_map(move |symbol| match symbol {
        Symbol::Derivative(i) => Some(i as usize),
        Symbol::ElementRate(i) => Some(n_single + i as usize),
        _ => None,
    })
}

/// Where an unknown is declared.
fn declared_at(model: &Model, n_single: usize, i: usize) -> Span {
    match i.checked_sub(n_single) {
        Some(element) => {
            let element = u32::try_from(element).unwrap_or(u32::MAX);
            model.array_of(element).unknown.declared.span
        }
        None => model.unknowns[i].declared.span,
    }
}

/// The error for different numbers of start equations and states.
fn miscounted(model: &Model, n_single: usize, determined: &BTreeSet<usize>) -> Diagnostic {
    let counted = |n: usize, one: &str, many: &str| match n {
        0 => format!("no {many}"),
        1 => format!("1 {one}"),
        n => format!("{n} {many}"),
    };
    let equations = &model.start_equations;
    let of_equations = counted(equations.len(), "start equation", "start equations");
    let of_states = counted(determined.len(), "state", "states");
    // Elements of an array share one place.
    let places: BTreeSet<Span> =
        determined.iter().map(|i| declared_at(model, n_single, *i)).collect();
    let first = places.first().copied();
    let span = equations.first().map(|equation| equation.span).or(first).unwrap_or_default();
    let verb = if equations.len() == 1 { "is" } else { "are" };
    let message = format!("there {verb} {of_equations} for the start values of {of_states}");
    let mut diagnostic = Diagnostic::new(Code::UndeterminedStart, span, message).help(
        "mark each state whose start value follows from a start equation with `guess`, as in `state h [m] = 2  guess`",
    );
    for place in places {
        diagnostic = diagnostic.label(place, "to be determined");
    }
    diagnostic
}
