//! Which start values the start equations of a model determine.

use std::collections::BTreeSet;

use super::Dae;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use crate::expr::Symbol;
use crate::model::{Equation, Model};

/// Gives each start equation a state, and has nobody estimate the start values of these.
///
/// States are those with `guess`; where there are too few, also those whose derivatives start equations read.
pub(super) fn verify(
    mut dae: Dae,
    model: &Model,
    diagnostics: &mut Diagnostics,
) -> Result<Dae, Reported> {
    let equations = &model.start_equations;
    let mut determined: BTreeSet<usize> =
        (0..model.unknowns.len()).filter(|i| model.unknowns[*i].guess).collect();
    if equations.is_empty() && determined.is_empty() {
        return Ok(dae);
    }
    if let (Some(span), Some(equation)) = (model.starts_at_rest, equations.first()) {
        let message =
            "`start steady` determines all start values, and leaves none to a start equation";
        return Err(diagnostics.error(
            Diagnostic::new(Code::E509, equation.span, message)
                .label(span, "all of the model is at rest"),
        ));
    }
    if determined.len() < equations.len() {
        determined.extend(equations.iter().flat_map(|equation| derivatives(model, equation)));
    }
    if determined.len() != equations.len() {
        return Err(diagnostics.error(miscounted(model, &determined)));
    }
    for &i in &determined {
        let declared = &model.unknowns[i].declared;
        if !dae.unknowns[i].differential {
            let message = format!(
                "the equations determine `{0}` at every time, so no start equation can",
                declared.name
            );
            diagnostics.error(
                Diagnostic::new(Code::E509, declared.span, message)
                    .help("take out a start equation, or put it into the choice of the variant where it holds"),
            );
        }
    }
    for (own, equation) in dae.start_equations.iter().zip(equations) {
        let is_late = |symbol: &Symbol| {
            matches!(symbol, Symbol::DelayedUnknown(_) | Symbol::Late(_) | Symbol::Past(..))
        };
        if dae.graph.symbols(own.rest).iter().any(is_late) {
            diagnostics.error(reads_late(equation));
        }
    }
    diagnostics.check()?;
    for (equation, i) in dae.start_equations.iter_mut().zip(determined) {
        equation.unknown = i;
        dae.unknowns[i].fixed = true;
    }
    Ok(dae)
}

/// Refuses a start equation that reads an unknown as it was before the start.
pub(super) fn reads_late(equation: &Equation) -> Diagnostic {
    let message = format!(
        "start equation `{}` depends on what an unknown was before the start",
        equation.label
    );
    Diagnostic::new(Code::E509, equation.span, message)
        .help("give the start value in the declaration of the state instead")
}

/// Positions of the unknowns whose derivatives an equation reads.
fn derivatives<'a>(model: &'a Model, equation: &'a Equation) -> impl Iterator<Item = usize> + 'a {
    let sides = [equation.left, equation.right].into_iter();
    sides.flat_map(|side| model.graph.symbols(side)).filter_map(|symbol| match symbol {
        Symbol::Derivative(i) => Some(i as usize),
        _ => None,
    })
}

/// The report on start equations and states of different number.
fn miscounted(model: &Model, determined: &BTreeSet<usize>) -> Diagnostic {
    let counted = |n: usize, one: &str, many: &str| match n {
        0 => format!("no {one}"),
        1 => format!("1 {one}"),
        n => format!("{n} {many}"),
    };
    let equations = &model.start_equations;
    let of_equations = counted(equations.len(), "start equation", "start equations");
    let of_states = counted(determined.len(), "state", "states");
    let first = determined.iter().next().map(|i| model.unknowns[*i].declared.span);
    let span = equations.first().map(|equation| equation.span).or(first).unwrap_or_default();
    let verb = if equations.len() == 1 { "is" } else { "are" };
    let message = format!("there {verb} {of_equations} for the start values of {of_states}");
    let mut diagnostic = Diagnostic::new(Code::E509, span, message).help(
        "mark each state whose start value follows from a start equation with `guess`, as in `state h [m] = 2  guess`",
    );
    for &i in determined {
        diagnostic = diagnostic.label(model.unknowns[i].declared.span, "to be determined");
    }
    diagnostic
}
