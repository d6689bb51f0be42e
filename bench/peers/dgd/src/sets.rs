//! P4: the mean level over all parameter sets and outputs.

use std::num::NonZero;
use std::thread;

use dgd_runtime::SolvableSystem;
use dgd_runtime::ensemble::{Ensemble, EnsembleQuantities, Member, reduce};
use peers_problems::request::{Answer, Failure, Request};
use peers_problems::two_state::{SETS, ensemble};

use crate::{jump_of_speed, options};

/// The mean level over all sets and outputs, on one core for `p4` and on all for `p4-threads`. The model's parameters
/// are M, c0, c1, c2, F, as in the problem.
pub(crate) fn solve(
    request: &Request,
    system: &(impl SolvableSystem + Clone + Send + Sync),
) -> Result<(), Failure> {
    let n = request.size().unwrap_or(SETS);
    let threads = if request.case == "p4-threads" {
        thread::available_parallelism().map_or(1, NonZero::get)
    } else {
        1
    };
    let (inputs, times) = jump_of_speed()?;
    let options = options(request)?;
    request.measure(
        || {
            let sets: Vec<[f64; 5]> = ensemble(n).collect();
            let members: Vec<Member<'_>> =
                sets.iter().map(|p| Member { p, inputs: &inputs, start: &[] }).collect();
            let ensemble = Ensemble { system, members: &members };
            let levels = reduce(
                &ensemble,
                &times,
                &options,
                EnsembleQuantities::Unknowns,
                threads,
                |_, outcome| outcome.map(|run| (sum(run.unknown(0)), run.statistics.steps)),
            );
            let (mut total, mut steps) = (0.0, 0);
            for level in levels {
                let (level, taken) = level?;
                total += level;
                steps += taken;
            }
            Ok((total, steps))
        },
        |(total, steps)| Answer::new(vec![total / (n * times.len()) as f64], steps),
    )
}

/// The sum in eight independent parts.
fn sum(values: &[f64]) -> f64 {
    let (eights, rest) = values.as_chunks::<8>();
    let mut parts = [0.0; 8];
    for eight in eights {
        for (part, value) in parts.iter_mut().zip(eight) {
            *part += value;
        }
    }
    parts.iter().sum::<f64>() + rest.iter().sum::<f64>()
}
