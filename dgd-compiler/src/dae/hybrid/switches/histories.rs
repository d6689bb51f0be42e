//! Refuses histories that jump: what reads them late would jump, too, at times that nothing locates.

use super::surfaces::{SurfaceKind, surfaces};
use crate::dae::Dae;
use crate::dae::hybrid::smoothness::{Passage, Sizes, passage};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use crate::expr::{ExprId, Node, Symbol};
use crate::model::Model;

/// Verifies that each history is continuous. Tables of time are taken as such.
pub(in crate::dae) fn verify(
    dae: &mut Dae,
    model: &Model,
    diagnostics: &mut Diagnostics,
) -> Result<(), Reported> {
    let single = dae.unknowns.iter().map(|unknown| (&unknown.name, unknown.history));
    let arrays = dae.arrays.iter().map(|array| (&array.name, array.history));
    let all: Vec<(String, ExprId)> = (single.chain(arrays))
        .filter_map(|(name, history)| Some((name.clone(), history?)))
        .collect();
    if all.is_empty() {
        return Ok(());
    }
    let sizes = Sizes::of(dae, model);
    for (name, history) in all {
        if !jumps(dae, model, &sizes, history) {
            continue;
        }
        let declared = (model.unknowns.iter())
            .chain(model.arrays.iter().map(|array| &array.unknown))
            .find(|unknown| unknown.declared.name == name);
        let Some(unknown) = declared else { continue };
        let message = format!("the history of `{name}` jumps");
        let help = "a history may bend, but not jump; lead from one value to the other by a ramp";
        diagnostics.error(Diagnostic::new(Code::E503, unknown.declared.span, message).help(help));
    }
    diagnostics.check()
}

/// Whether a value steps, or a condition changes it, at some time.
fn jumps(dae: &mut Dae, model: &Model, sizes: &Sizes, history: ExprId) -> bool {
    let steps = dae.graph.listed([history]).into_iter().any(|(_, node)| {
        matches!(node, Node::Call1(function, x) if function.get().name == "floor"
            && dae.graph.symbols(x).contains(&Symbol::Time))
    });
    steps
        || surfaces(dae, model, &[history], SurfaceKind::Common).iter().any(|surface| {
            let mut trial = dae.graph.clone();
            passage(&mut trial, sizes, history, surface.e, &surface.signs) == Passage::Jump
        })
}
