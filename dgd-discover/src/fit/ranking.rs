//! How structures are integrated where they are ranked.

use dgd_identify::Recording;
use dgd_runtime::for_identify::inputs_change_by_sample;
use dgd_runtime::{METHODS, Method, MethodKind, Options, Problem, Steps};

use super::data::Data;
use crate::library::{BaseModel, Refused, StructureId, Values};

/// A tolerance that is fine enough to rank structures: no sensor is good to 1e-4 of what it reads.
const TOLERANCE: f64 = 1e-4;

/// These options, at a tolerance that is fine enough.
pub(crate) fn options_for_ranking(options: Options) -> Options {
    let options = stepping_alike(options);
    Options { rtol: options.rtol.max(TOLERANCE), atol: options.atol.max(TOLERANCE), ..options }
}

/// The same, with steps that structures with events and without can both have.
pub(crate) fn stepping_alike(options: Options) -> Options {
    let steps = if options.steps == Steps::Automatic { Steps::Adaptive } else { options.steps };
    Options { steps, ..options }
}

/// The method for ranking. Where inputs change in most sample intervals, they end nearly every step, however long
/// it might have been: of methods of the same kind the one with the fewest evaluations is as good then.
pub(crate) fn method_for_ranking(
    base: &BaseModel,
    data: &Data<'_>,
) -> Result<&'static Method, Refused> {
    let own = data.options.method;
    let system = &base.structure(&[], StructureId::BASE)?.system;
    let p = &Values::default().parameters(system);
    let changes = |recording: &Recording| {
        let problem = Problem { system, p, inputs: &recording.inputs, start: &recording.start };
        inputs_change_by_sample(&problem, &recording.times)
    };
    if !data.train.iter().all(changes) {
        return Ok(own);
    }
    let evaluations = |method: &Method| match method.kind {
        MethodKind::Rosenbrock(tableau) => Some(tableau.evaluations()),
        _ => None,
    };
    let alike = METHODS.iter().filter(|method| evaluations(method).is_some());
    let cheapest = alike.min_by_key(|method| evaluations(method));
    Ok(cheapest.filter(|_| evaluations(own).is_some()).unwrap_or(own))
}
