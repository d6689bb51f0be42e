//! Integration options for ranking structures.

use dgd_identify::Recording;
use dgd_runtime::for_identify::{inputs_change_by_sample, stiffness};
use dgd_runtime::{METHODS, Method, MethodKind, Options, Problem, Steps};

use super::data::SearchData;
use crate::library::{BaseModel, CarriedValues, StructureError, StructureId};

/// A tolerance fine enough to rank structures: no sensor is accurate to 1e-4 of its reading.
const TOLERANCE: f64 = 1e-4;

/// Ratio of a sample interval to the limit of stability of an explicit method below which a model is far from stiff. A
/// step of the general method takes three times as long as an explicit one, so the latter is worthwhile even for
/// structures that are ten times stiffer.
const FAR_FROM_STIFF: f64 = 0.3;

/// The methods with which structures are integrated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StructureMethods {
    /// The method for all structures.
    pub general: &'static Method,
    /// The method for structures without algebraic unknowns, if another one is better there.
    pub explicit: Option<&'static Method>,
}

/// These options, with a tolerance fine enough for ranking.
pub(crate) fn options_for_ranking(options: Options) -> Options {
    let options = stepping_alike(options);
    Options { rtol: options.rtol.max(TOLERANCE), atol: options.atol.max(TOLERANCE), ..options }
}

/// These options, with steps that are possible both with and without events.
pub(crate) fn stepping_alike(options: Options) -> Options {
    let steps = if options.steps == Steps::Automatic { Steps::Adaptive } else { options.steps };
    Options { steps, ..options }
}

/// The methods for ranking. If inputs change in most sample intervals, they cut nearly every step short, so the method
/// of the same kind with the fewest evaluations is as good. An explicit method is better still, as long as the model is
/// far from stiff: structures may be stiffer than it is.
pub(crate) fn methods_for_ranking<'a>(
    base: &BaseModel,
    data: &SearchData<'a>,
) -> Result<StructureMethods, StructureError> {
    let requested = data.options.method;
    let as_it_is = StructureMethods { general: requested, explicit: None };
    let MethodKind::Rosenbrock(_) = requested.kind else { return Ok(as_it_is) };
    let system = &base.structure(&[], StructureId::BASE)?.system;
    let p = &CarriedValues::default().parameters(system);
    let problem_of =
        |one: &'a Recording| Problem { system, p, inputs: &one.inputs, start: &one.start };
    if !data.train.iter().all(|one| inputs_change_by_sample(&problem_of(one), &one.times)) {
        return Ok(as_it_is);
    }
    let evaluations = |method: &Method| match method.kind {
        MethodKind::Rosenbrock(tableau) => Some(tableau.evaluations()),
        _ => None,
    };
    let alike = METHODS.iter().filter(|method| evaluations(method).is_some());
    let general = alike.min_by_key(|method| evaluations(method)).unwrap_or(requested);
    let explicit = METHODS.iter().find(|method| matches!(method.kind, MethodKind::Explicit(_)));
    let is_far_from_stiff = |method: &&'static Method| {
        let options = Options { method, ..data.options };
        data.train.iter().all(|one| {
            let stiffness = stiffness(&problem_of(one), &one.times, &options);
            stiffness.is_some_and(|stiffness| stiffness < FAR_FROM_STIFF)
        })
    };
    Ok(StructureMethods { general, explicit: explicit.filter(is_far_from_stiff) })
}
