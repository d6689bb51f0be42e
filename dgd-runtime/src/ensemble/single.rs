//! Runs members one by one.

use super::{EnsembleQuantities, OwnedTrajectory};
use crate::error::Failure;
use crate::integrate::{simulate, simulate_with_sensitivities};
use crate::observe::observe;
use crate::problem::{Options, Problem};
use crate::solved::SolvableSystem;

/// Runs one member.
pub(super) fn run<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
    wanted: EnsembleQuantities,
) -> Result<OwnedTrajectory, Failure> {
    let solution = match wanted {
        EnsembleQuantities::Unknowns | EnsembleQuantities::Values => {
            simulate(problem, times, options)
        }
        EnsembleQuantities::Sensitivities => simulate_with_sensitivities(problem, times, options),
    }?;
    let by_quantity = |values: &[f64]| by_quantity(values, times.len());
    if wanted == EnsembleQuantities::Unknowns {
        return Ok(OwnedTrajectory::new(by_quantity(&solution.y), Vec::new(), solution.statistics));
    }
    let observed = observe(problem, &solution);
    let values = [&solution.y, &observed.w, &solution.s, &observed.dw];
    let values = values.map(|values| by_quantity(values));
    Ok(OwnedTrajectory { statistics: solution.statistics, values })
}

/// Reorders numbers from time by time to quantity by quantity.
fn by_quantity(values: &[f64], times: usize) -> Vec<f64> {
    let width = values.len() / times.max(1);
    (0..width).flat_map(|i| values.iter().skip(i).step_by(width).copied()).collect()
}
