//! One model many times.

use dgd_runtime::ensemble::{Ensemble, Member, Wanted, reduce};
use dgd_runtime::{Observations, Options, System};

use crate::{Error, Problem, Solution};

/// Runs all problems of one model, by all cores, and gives their solutions in their order; the failure of one
/// is its own. Results do not depend on the number of cores.
pub fn ensemble<M: System + Clone + Send>(
    problems: &[Problem<'_, M>],
    times: &[f64],
    options: &Options,
) -> Vec<Result<Solution, Error>> {
    let Some(first) = problems.first() else { return Vec::new() };
    let signature = first.model.signature();
    let checked: Vec<Result<(), Error>> =
        problems.iter().map(|problem| problem.as_run().map(|_| ())).collect();
    let fitting = problems.iter().zip(&checked).filter(|(_, checked)| checked.is_ok());
    let members: Vec<Member<'_>> = fitting
        .map(|(problem, _)| Member {
            p: &problem.parameters,
            inputs: problem.inputs,
            start: &problem.start,
        })
        .collect();
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let ensemble = Ensemble { system: first.model, members: &members };
    let ran = reduce(&ensemble, times, options, Wanted::Values, threads, |_, outcome| {
        let trajectory = outcome.map_err(|failure| Error::Run {
            error: failure.error,
            reached: Box::new(Solution::empty()),
        })?;
        let by_time = |count: usize, quantity: &dyn Fn(usize) -> Vec<f64>| -> Vec<f64> {
            let all: Vec<Vec<f64>> = (0..count).map(quantity).collect();
            (0..times.len()).flat_map(|k| all.iter().map(move |one| one[k])).collect()
        };
        let (n, n_w) = (signature.unknowns.len(), signature.outputs.len());
        let mut run = dgd_runtime::Solution::empty(signature, 0);
        run.times = times.to_vec();
        run.statistics = trajectory.statistics;
        run.y = by_time(n, &|i| trajectory.unknown(i).to_vec());
        let w = by_time(n_w, &|i| trajectory.output(i).to_vec());
        Ok(Solution::new(signature, run, &Observations { n_w, n_s: 0, w, dw: Vec::new() }))
    });
    let mut ran = ran.into_iter();
    let outcome = |checked: Result<(), Error>| {
        checked.and_then(|()| ran.next().expect("each member that fits has run"))
    };
    checked.into_iter().map(outcome).collect()
}
