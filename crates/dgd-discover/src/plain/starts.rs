//! Start values that the model holds although recordings may begin elsewhere.

use dgd_compiler::model::Model;
use dgd_compiler::units::Unit;
use dgd_runtime::{Direction, System};

use super::{SuspectModel, Suspicion};
use crate::fit::FittedStructure;
use crate::library::BaseModel;

/// A start value that is held.
#[derive(Debug, Clone)]
pub(crate) struct HeldStart {
    pub(crate) state: String,
    pub(crate) unit: Unit,
}

impl HeldStart {
    /// The start of each training recording in a fit that estimates it, with its standard deviation, SI.
    pub(crate) fn values(&self, fitted: &FittedStructure) -> Vec<(usize, f64, Option<f64>)> {
        let name = format!("{}(0)", self.state);
        let estimates = fitted.estimates.iter().filter(|estimate| estimate.name == name);
        estimates.filter_map(|one| Some((one.recording?, one.value, one.std))).collect()
    }
}

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
