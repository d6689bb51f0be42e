//! Integration options for ranking structures.

use dgd_identify::Recording;
use dgd_runtime::for_identify::inputs_change_by_sample;
use dgd_runtime::{METHODS, Method, MethodKind, Options, Problem, Steps};

use super::data::Data;
use crate::library::{BaseModel, Refused, StructureId, Values};

/// A tolerance fine enough to rank structures: no sensor is accurate to 1e-4 of its reading.
const TOLERANCE: f64 = 1e-4;

/// These options, with a tolerance fine enough for ranking.
pub(crate) fn options_for_ranking(options: Options) -> Options {
    let options = stepping_alike(options);
    Options { rtol: options.rtol.max(TOLERANCE), atol: options.atol.max(TOLERANCE), ..options }
}

/// The same, with steps that are possible both with and without events.
pub(crate) fn stepping_alike(options: Options) -> Options {
    let steps = if options.steps == Steps::Automatic { Steps::Adaptive } else { options.steps };
    Options { steps, ..options }
}

/// The method for ranking. If inputs change in most sample intervals, they cut nearly every step short, so that of
/// methods of the same kind the one with the fewest evaluations is as good.
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
