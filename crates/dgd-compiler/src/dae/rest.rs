//! Checks that a model that starts at rest can be at rest.

use super::{AutomatonKind, Dae};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::Symbol;
use crate::model::Model;

/// Refuses dependence on time, by name, and modes; start values are then not estimated.
pub(super) fn verify(
    mut dae: Dae,
    model: &Model,
    diagnostics: &mut Diagnostics,
) -> Result<Dae, ErrorReported> {
    let Some(span) = model.starts_at_rest else { return Ok(dae) };
    let reads_time = |id| dae.graph.symbols(id).contains(&Symbol::Time);
    let single = dae.unknowns.iter().map(|x| (x.rhs, x.mass, &x.equation, x.span));
    let families = dae.families.iter().map(|f| (f.rhs, f.mass, &f.equation, f.span));
    let moving =
        single.chain(families).find(|(rhs, mass, ..)| reads_time(*rhs) || reads_time(*mass));
    let modes = dae.automata.iter().find(|automaton| automaton.kind == AutomatonKind::Modes);
    let with_history = dae.histories().next();
    let (message, place) = if let Some((.., equation, place)) = moving {
        (
            format!(
                "equation `{equation}` depends on time, so the model has no steady state to start from"
            ),
            Some(place),
        )
    } else if !dae.time_conditions.is_empty() {
        (
            "the model has a condition on time or an `every`, so it has no steady state to start from"
                .to_owned(),
            None,
        )
    } else if let Some(automaton) = modes {
        let name = &automaton.name;
        (format!("`start steady` cannot tell in which mode of `{name}` the model is"), None)
    } else if let Some((name, _)) = with_history {
        (
            format!("`{name}` has a `history`, but in a steady state it has always been constant"),
            None,
        )
    } else {
        for unknown in &mut dae.unknowns {
            unknown.fixed = true;
        }
        return Ok(dae);
    };
    let mut diagnostic = Diagnostic::new(Code::StartNotSteady, span, message)
        .help("leave out `start steady`, or let an input say what changes with time");
    if let Some(place) = place {
        diagnostic = diagnostic.label(place, "this equation");
    }
    Err(diagnostics.error(diagnostic))
}
