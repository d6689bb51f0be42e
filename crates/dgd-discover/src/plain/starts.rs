//! Start values that the model holds although recordings may begin elsewhere.

use dgd_compiler::model::Model;
use dgd_runtime::{Direction, System};

use super::suspicion::{HeldStart, SuspectModel, Suspicion};
use crate::fit::FittedStructure;
use crate::library::BaseModel;

/// Each state whose start value is held, as a suspect.
pub(super) fn suspects(
    base: &BaseModel,
    model: &Model,
    fitted: &FittedStructure,
) -> Vec<SuspectModel> {
    let signature = fitted.structure.system.signature();
    let is_free = |state: usize| signature.directions.contains(&Direction::Start(state));
    let states = signature.unknowns.differential().filter(|state| !is_free(*state));
    let held_starts = states.filter_map(|state| {
        let name = signature.unknowns.name(state).to_string();
        let unknown = model.unknowns.iter().find(|own| own.declared.name == name)?;
        (!base.fix.contains(&name)).then(|| (name, unknown.declared.unit.clone()))
    });
    held_starts
        .map(|(state, unit)| {
            let mut base = base.clone();
            base.free.push(state.clone());
            let suspicion = Suspicion::Start(HeldStart { state, unit });
            SuspectModel { position: 0, suspicion, base: Some(base), changed: None }
        })
        .collect()
}
