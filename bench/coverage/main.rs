//! How often intervals of 95 % hold the truth.
//!
//! ```text
//! cargo run --release --package dgd-bench --bin coverage -- [--sets N] [--seed S] [--threads N]
//! ```
//!
//! Of each problem N data sets are drawn from a solution in closed form, 500 unless it is said, and fitted from one point.
//! Counted is in how many of them the profile-likelihood interval of a parameter or start value holds the true one. An
//! interval that is open on a side holds all that lies there. It ends with failure where one of them holds it in less than 92 or
//! more than 98 %, or all together in less than 94 or more than 96 %.
//!
//! | problem | model | estimator |
//! |---|---|---|
//! | substrate | a nonlinear equation | output error |
//! | siphon | modes, whose level to change is estimated | output error |
//! | room | a state that strays, with estimated noise of both kinds | prediction error |

mod data;
mod fitting;

use std::error::Error;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use data::Problem;
use fitting::Held;

/// Bounds of the share of data sets, for one estimate and for all.
const OF_ONE: [f64; 2] = [0.92, 0.98];
const OF_ALL: [f64; 2] = [0.94, 0.96];

struct Arguments {
    sets: usize,
    seed: u64,
    threads: usize,
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments = parse(std::env::args().skip(1))?;
    println!("problem    estimate  held  of  share  open  not converged");
    let (mut held, mut of, mut is_good) = (0, 0, true);
    for problem in Problem::ALL {
        let sets = each(problem, &arguments);
        let failures = sets.iter().filter(|set| set.is_none()).count();
        for (i, name) in problem.estimates().iter().enumerate() {
            let those: Vec<Held> = sets.iter().flatten().map(|set| set[i]).collect();
            let holds = those.iter().filter(|one| one.holds).count();
            let open = those.iter().filter(|one| one.is_open).count();
            let share = holds as f64 / those.len() as f64;
            println!(
                "{:<9}  {name:<8}  {holds:>4}  {:>3}  {share:.3}  {open:>4}  {failures:>4}",
                problem.name(),
                those.len()
            );
            is_good &= within(share, OF_ONE);
            held += holds;
            of += those.len();
        }
    }
    let share = held as f64 / of as f64;
    println!("all        {held} of {of}: {share:.4}");
    let is_good = is_good && within(share, OF_ALL);
    Ok(if is_good { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn within(share: f64, [low, high]: [f64; 2]) -> bool {
    (low..=high).contains(&share)
}

/// What the intervals of each data set hold; nothing of one whose fit does not converge.
fn each(problem: Problem, arguments: &Arguments) -> Vec<Option<Vec<Held>>> {
    let all = Mutex::new(vec![None; arguments.sets]);
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..arguments.threads {
            scope.spawn(|| {
                let system = fitting::system(problem);
                loop {
                    let set = next.fetch_add(1, Ordering::Relaxed);
                    if set >= arguments.sets {
                        return;
                    }
                    let recording = problem.drawn(arguments.seed, set as u64);
                    let held = fitting::held(problem, &system, recording);
                    all.lock().unwrap_or_else(PoisonError::into_inner)[set] = held;
                }
            });
        }
    });
    all.into_inner().unwrap_or_else(PoisonError::into_inner)
}

fn parse(mut words: impl Iterator<Item = String>) -> Result<Arguments, Box<dyn Error>> {
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let mut arguments = Arguments { sets: 500, seed: 1, threads };
    while let Some(word) = words.next() {
        let value = words.next().ok_or_else(|| format!("`{word}` needs a value"))?;
        match word.as_str() {
            "--sets" => arguments.sets = value.parse()?,
            "--seed" => arguments.seed = value.parse()?,
            "--threads" => arguments.threads = value.parse()?,
            _ => return Err(format!("there is no option `{word}`").into()),
        }
    }
    Ok(arguments)
}
