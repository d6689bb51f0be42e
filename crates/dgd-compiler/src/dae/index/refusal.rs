//! Messages about equations that cannot be differentiated.

use super::explicit::{ExplicitSystem, RowAssignment};
use super::linear_derivatives::RemainingResidual;
use super::pantelides::{Obstacle, ReductionRefusal};
use super::variables::UnknownList;
use crate::dae::matching::{more_places, quoted};
use crate::dae::transfer::TransferredEquation;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{ExprGraph, Symbol};
use crate::model::Model;

/// Reports an equation that index reduction cannot differentiate.
pub(super) fn refuse(
    model: &Model,
    equations: &[TransferredEquation<'_>],
    variables: &UnknownList,
    context: &str,
    refusal: &ReductionRefusal,
    diagnostics: &mut Diagnostics,
) -> ErrorReported {
    let ReductionRefusal { equation, obstacle, wanting, .. } = refusal;
    let TransferredEquation { label, span, .. } = &equations[*equation];
    let loose = quoted(wanting.iter().map(|i| variables.unknowns[*i as usize].name.as_str()));
    let input = |i: &usize| &model.inputs[*i].declared;
    let why = match obstacle {
        Obstacle::Held(i) => {
            format!("it reads the input `{}`, which is held and jumps", input(i).name)
        }
        Obstacle::Slope(i) => {
            format!(
                "it reads the slope of the input `{}`, which jumps at every sample",
                input(i).name
            )
        }
        Obstacle::Jump(function) => format!("`{function}` in it jumps"),
        Obstacle::Element => "it reads an element of an array".to_owned(),
        Obstacle::Foreign(_) => "it reads an unknown of another part".to_owned(),
        Obstacle::Delayed => "it reads an unknown late".to_owned(),
        Obstacle::NoUnknown => "its derivatives only repeat other equations".to_owned(),
    };
    let determines =
        if wanting.is_empty() { String::new() } else { format!(" to determine {loose}") };
    let message = format!(
        "the index is above 1{context}: `{label}` would have to be differentiated{determines}, but {why}"
    );
    let diagnostic = Diagnostic::new(Code::IrreducibleIndex, *span, message);
    let (help, places) = match obstacle {
        Obstacle::Held(i) => (
            "declare the input as `linear`, or let it act through a lag",
            Some((input(i).span, "declared here")),
        ),
        Obstacle::Slope(i) => (
            "let the input act through a lag, so that its derivatives exist",
            Some((input(i).span, "declared here")),
        ),
        Obstacle::Jump(_) => ("write the constraint as an expression that is smooth", None),
        Obstacle::Element => ("give the element an unknown of its own in the constraint", None),
        Obstacle::Foreign(_) => ("describe it by fewer modes", None),
        Obstacle::Delayed => ("let what arrives late act through a lag", None),
        Obstacle::NoUnknown => {
            ("leave out the equation that repeats others, or let it read another unknown", None)
        }
    };
    let unknowns = wanting.iter().map(|i| variables.unknowns[*i as usize].span);
    let diagnostic = more_places(diagnostic.help(help), unknowns, "not determined");
    let places = places.into_iter();
    diagnostics
        .error(places.fold(diagnostic, |diagnostic, (span, text)| diagnostic.label(span, text)))
}

/// Reports constraints that no choice of states satisfies.
pub(super) fn no_choice<'a>(
    equations: &[TransferredEquation<'_>],
    constraints: impl Iterator<Item = &'a RemainingResidual>,
    context: &str,
    diagnostics: &mut Diagnostics,
) -> ErrorReported {
    let mut positions: Vec<usize> = constraints.map(|constraint| constraint.equation).collect();
    positions.sort_unstable();
    positions.dedup();
    let names = quoted(positions.iter().map(|e| equations[*e].label));
    let message = format!(
        "the index is above 1{context}: {names} and what follows by differentiation tie the same \
         states more than once"
    );
    let mut spans = positions.iter().map(|e| equations[*e].span);
    let first = spans.next().unwrap_or_default();
    let diagnostic = Diagnostic::new(Code::IrreducibleIndex, first, message)
        .help("leave out a constraint that others imply");
    diagnostics.error(more_places(diagnostic, spans, "this one too"))
}

/// Reports bounds of unknowns that are determined by constraints between states: at a bound such an unknown would leave
/// its row, and with it the constraint and its consequences.
pub(super) fn verify_bounds(
    model: &Model,
    graph: &ExprGraph,
    equations: &[TransferredEquation<'_>],
    systems: &[ExplicitSystem],
    places: &[Vec<RowAssignment>],
    diagnostics: &mut Diagnostics,
) {
    for saturation in &model.saturations {
        let unknown = saturation.unknown;
        let mut constraints = systems.iter().flat_map(|system| &system.reduced.constraints);
        let tied = constraints
            .find(|constraint| graph.symbols(constraint.rest).contains(&unknown))
            .map(|constraint| constraint.equation);
        let forced = || {
            let Symbol::Unknown(i) = unknown else { return None };
            let mut rows = places[i as usize].iter().flat_map(RowAssignment::rows);
            rows.find(|row| row.order > 0).map(|row| row.equation)
        };
        let Some(TransferredEquation { label, span, .. }) =
            tied.or_else(forced).map(|e| &equations[e])
        else {
            continue;
        };
        let name = model.unknown_name(unknown);
        let message =
            format!("`{name}` cannot have a bound, as `{label}` has to be differentiated");
        diagnostics.error(
            Diagnostic::new(Code::BoundOfConstrainedUnknown, saturation.span, message)
                .label(*span, format!("this determines `{name}` at all times"))
                .help("describe what happens at the bound by `modes`, with equations for each"),
        );
    }
}
