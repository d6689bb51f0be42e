//! Another integration method for a fit whose values its own method cannot start from.

use dgd_identify::{EstimateError, MultiStart, PointEnd, Recording, Termination, TrialFailure};
use dgd_runtime::integrate::catalogue::{AUTOMATIC, METHODS, MethodKind};
use dgd_runtime::{Evaluation, IntegrateError, Options, Steps};

use crate::request::SolverOptions;
use crate::session::TaskContext;

/// Options for a second fit from the same points by a method that can start any run, if no method was named and the
/// first fit ended because derivatives at the start of a run were not finite.
pub(crate) fn options_of_refit(
    options: &Options,
    args: &SolverOptions,
    found: &MultiStart,
    recordings: &[Recording],
    session: TaskContext<'_>,
) -> Option<Options> {
    let MethodKind::Rosenbrock(_) = options.method.kind else { return None };
    if args.method != AUTOMATIC || matches!(args.steps, Steps::PerSample(_)) {
        return None;
    }
    let mut failures = found.ends.iter().filter_map(|end| match end {
        PointEnd::Fitted(fit) if fit.termination == Termination::Blocked => {
            fit.last_failure.as_ref()
        }
        PointEnd::Failed(EstimateError::Start(failed)) => Some(failed),
        PointEnd::Fitted(_) | PointEnd::Failed(_) | PointEnd::LeftOut => None,
    });
    let (equation, t) = failures.find_map(|failed| match &failed.reason {
        TrialFailure::Simulation(IntegrateError::NotFinite {
            t,
            equation,
            what: Evaluation::Derivative,
            ..
        }) if recordings[failed.recording].times.first() == Some(t) => Some((equation, *t)),
        _ => None,
    })?;
    let method = METHODS.iter().find(|method| matches!(method.kind, MethodKind::Bdf(_)))?;
    session.remark(format!(
        "note: the fit came to values with which `{}` cannot begin at t = {t} s, where a derivative of \
         equation `{equation}` is not finite; it is run again from its start with `{}`",
        options.method.name, method.name
    ));
    Some(Options { method, ..*options })
}
