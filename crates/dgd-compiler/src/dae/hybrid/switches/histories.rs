//! Refuses discontinuous histories: delayed values would jump, too, at times that no event locates.

use super::surfaces::{SurfaceKind, surfaces};
use crate::dae::Dae;
use crate::dae::hybrid::smoothness::{Continuity, SymbolSizes, passage};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{ExprId, Symbol};
use crate::model::Model;

/// Verifies that each history is continuous.
pub(in crate::dae) fn verify(
    dae: &mut Dae,
    model: &Model,
    diagnostics: &mut Diagnostics,
) -> Result<(), ErrorReported> {
    let histories: Vec<(String, ExprId)> =
        dae.histories().map(|(name, history)| (name.to_owned(), history)).collect();
    if histories.is_empty() {
        return Ok(());
    }
    let sizes = SymbolSizes::estimate(dae, model);
    for (name, history) in histories {
        if !jumps(dae, model, &sizes, history) {
            continue;
        }
        let declared = (model.unknowns.iter())
            .chain(model.arrays.iter().map(|array| &array.unknown))
            .find(|unknown| unknown.declared.name == name);
        let Some(unknown) = declared else { continue };
        let message = format!("the history of `{name}` jumps");
        let help = "a history may bend, but not jump; lead from one value to the other by a ramp";
        diagnostics.error(
            Diagnostic::new(Code::StartReadsUnknown, unknown.declared.span, message).help(help),
        );
    }
    diagnostics.check()
}

/// Whether a value steps, or a condition changes it, at some time.
fn jumps(dae: &mut Dae, model: &Model, sizes: &SymbolSizes, history: ExprId) -> bool {
    let moves = |x: ExprId| dae.graph.symbols(x).contains(&Symbol::Time);
    let mut nodes = dae.graph.listed([history]).into_iter();
    let steps = nodes.any(|(_, node)| node.steps() && node.operands().any(moves));
    steps
        || surfaces(dae, model, &[history], SurfaceKind::Common).iter().any(|surface| {
            let mut trial = dae.graph.clone();
            passage(&mut trial, sizes, history, surface.e, &surface.signs) == Continuity::Jump
        })
}
