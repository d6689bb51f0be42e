//! P4: many parameter sets of P1a.

use std::num::NonZero;
use std::thread;

use dgd::{Inputs, Options, Problem, System, simulate};
use peers_problems::request::{Answer, Failure, Request};
use peers_problems::two_state::{SETS, ensemble};

use crate::{jump_of_speed, options};

/// Sum of the levels over all outputs, and steps.
type Sum = (f64, usize);

/// The mean level over all sets and outputs: of `p4` on one core, of `p4-threads` on all.
pub(crate) fn solve(
    request: &Request,
    system: &(impl System + Clone + Send + Sync),
) -> Result<(), Failure> {
    let sets: Vec<[f64; 5]> = ensemble(request.size().unwrap_or(SETS)).collect();
    let threads = if request.case == "p4-threads" {
        thread::available_parallelism().map_or(1, NonZero::get)
    } else {
        1
    };
    let (inputs, times) = jump_of_speed()?;
    let options = options(request)?;
    request.measure(
        || {
            let run = |sets: &[[f64; 5]]| levels(system, sets, &inputs, &times, &options);
            let parts: Vec<Result<Sum, String>> = thread::scope(|scope| {
                let chunks = sets.chunks(sets.len().div_ceil(threads));
                let running: Vec<_> = chunks.map(|sets| scope.spawn(move || run(sets))).collect();
                let lost = |_| Err("a thread panicked".to_owned());
                running.into_iter().map(|thread| thread.join().unwrap_or_else(lost)).collect()
            });
            let mut total = (0.0, 0);
            for part in parts {
                let (sum, steps) = part?;
                total = (total.0 + sum, total.1 + steps);
            }
            Ok(total)
        },
        |(sum, steps)| Answer::new(vec![sum / (sets.len() * times.len()) as f64], steps),
    )
}

fn levels(
    system: &impl System,
    sets: &[[f64; 5]],
    inputs: &Inputs,
    times: &[f64],
    options: &Options,
) -> Result<Sum, String> {
    let (mut sum, mut steps) = (0.0, 0);
    for p in sets {
        let problem = Problem { system, p, inputs, start: &[] };
        let solution = simulate(&problem, times, options).map_err(|error| error.to_string())?;
        sum += (0..times.len()).map(|k| solution.y(k)[0]).sum::<f64>();
        steps += solution.statistics.steps;
    }
    Ok((sum, steps))
}
