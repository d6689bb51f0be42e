//! Many runs of one model.

use dgd_runtime::ensemble::{Ensemble, EnsembleQuantities, Member, reduce};
use dgd_runtime::{Options, SolvableSystem};

use crate::{Error, Problem, Solution, simulate};

/// Runs all problems on all cores, and returns their solutions in order, each with its own error. Results do not depend
/// on the number of cores. All problems should have the same model; one that differs from the first is run by itself.
pub fn ensemble<M: SolvableSystem + Clone + Send>(
    problems: &[Problem<'_, M>],
    times: &[f64],
    options: &Options,
) -> Vec<Result<Solution, Error>> {
    let Some(first) = problems.first() else { return Vec::new() };
    let is_member = |problem: &Problem<'_, M>| {
        let has_same_model = size_of::<M>() == 0 || std::ptr::eq(problem.model, first.model);
        has_same_model && problem.as_run().is_ok()
    };
    let members: Vec<Member<'_>> = (problems.iter().filter(|problem| is_member(problem)))
        .map(|problem| Member {
            p: &problem.parameters,
            inputs: problem.inputs,
            start: &problem.start,
        })
        .collect();
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let ensemble = Ensemble { system: first.model, members: &members };
    let signature = first.model.signature();
    let solutions =
        reduce(&ensemble, times, options, EnsembleQuantities::Values, threads, |_, outcome| {
            outcome.map(|member| Solution::of_member(signature, &member)).map_err(|failure| {
                Error::Run { error: failure.error, reached: Box::new(Solution::default()) }
            })
        });
    let mut solutions = solutions.into_iter();
    let solution = |problem: &Problem<'_, M>| {
        let member = is_member(problem).then(|| solutions.next()).flatten();
        member.unwrap_or_else(|| simulate(problem, times, options))
    };
    problems.iter().map(solution).collect()
}
