//! P4: the mean level over all parameter sets and outputs, on one core.

use dgd::ensemble::{Ensemble, Member, Wanted, reduce};
use dgd::{Options, System};
use peers_problems::request::{Answer, Failure, Request};
use peers_problems::two_state::{SETS, ensemble};

/// Parameters of the model are M, c0, c1, c2, F, as those of the problem.
pub(crate) fn solve<S: System + Clone + Send>(
    request: &Request,
    system: &S,
    options: Options,
) -> Result<(), Failure> {
    let (inputs, times) = crate::stretches()?;
    request.measure(
        || {
            let sets: Vec<[f64; 5]> = ensemble(SETS).collect();
            let members: Vec<Member<'_>> =
                sets.iter().map(|p| Member { p, inputs: &inputs, start: &[] }).collect();
            let ensemble = Ensemble { system, members: &members };
            let levels = reduce(&ensemble, &times, &options, Wanted::Values, 1, |_, outcome| {
                outcome.map(|run| (sum(run.unknown(0)), run.statistics.steps))
            });
            let (mut sum, mut steps) = (0.0, 0);
            for level in levels {
                let (level, taken) = level?;
                sum += level;
                steps += taken;
            }
            Ok((sum / (SETS * times.len()) as f64, steps))
        },
        |(mean, steps)| Answer { values: vec![mean], steps },
    )
}

/// In eight parts, which do not wait for each other.
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
