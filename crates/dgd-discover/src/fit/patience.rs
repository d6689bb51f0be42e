//! Limits the number of steps of a simulation in a search.
//!
//! A fit that strays to absurd values, such as thousands of turns or a runaway exponential, would spend the time of the
//! whole search there.

use dgd_identify::{EstimateError, Fit, TrialFailed, TrialFailure};
use dgd_runtime::{IntegrateError, Problem, simulate_with_sensitivities};

use super::data::SearchData;
use crate::library::{BaseModel, CarriedValues, StructureError, StructureId};

/// Limit on the steps of a simulation, in multiples of the steps of the model with its own values or of its samples,
/// whichever are more. A visible period has at least two samples, and so forty steps.
const TIMES: f64 = 20.0;

/// Maximum number of steps of a simulation of a recording. It is based on the model as written: a fit may have absorbed
/// effects that the model lacks.
pub(crate) fn most_steps(base: &BaseModel, data: &SearchData<'_>) -> Result<usize, StructureError> {
    let system = &base.structure(&[], StructureId::BASE)?.system;
    let p = &CarriedValues::default().parameters(system);
    let mut per_sample = 1.0_f64;
    for recording in data.train {
        let problem = Problem { system, p, inputs: &recording.inputs, start: &recording.start };
        let run =
            simulate_with_sensitivities(&problem, &recording.times, &data.options_for(system));
        // A failed run has taken steps as well.
        let solution = run.unwrap_or_else(|failure| *failure.partial);
        let tried = solution.statistics.steps + solution.statistics.rejected;
        per_sample = per_sample.max(tried as f64 / recording.times.len().max(1) as f64);
    }
    let samples = data.train.iter().chain(data.valid).map(|recording| recording.times.len());
    let most = TIMES * per_sample * samples.max().unwrap_or(0) as f64;
    Ok(data.options.max_steps.min(most.ceil() as usize))
}

/// Reason for abandoning a fit whose simulations take too many steps.
pub(crate) fn too_many_steps() -> String {
    format!("a simulation takes more than {TIMES} times the steps of the model with its own values")
}

/// Whether a fit failed because its first simulation takes too many steps.
pub(crate) fn cannot_begin(error: &EstimateError) -> bool {
    matches!(error, EstimateError::Start(failed) if is_too_long(failed))
}

/// Whether a fit ended before converging because a later simulation takes too many steps.
pub(crate) fn is_cut_short(fit: &Fit) -> bool {
    !fit.termination.is_converged() && fit.last_failure.as_ref().is_some_and(is_too_long)
}

fn is_too_long(failed: &TrialFailed) -> bool {
    matches!(
        failed.reason,
        TrialFailure::Simulation(
            IntegrateError::TooManySteps { .. } | IntegrateError::TooStiff { .. }
        )
    )
}
