//! How much of a discrepancy a place explains, and whether the change that this requires is plausible.
//!
//! A free input at one place follows nearly any readings, so a likelihood alone ranks a sensor whose error exceeds all
//! of its readings among the best.

use dgd_compiler::model::Model;
use dgd_runtime::{LimitSide, Problem, Solution, observe, simulate};

use super::estimated::EstimatedPlace;
use super::found_place::{PlaceObjection, PlaceTrace};
use super::missing_terms::{MissingPlace, PlaceKind};
use super::place_search::PlaceSearch;
use super::thinned::ThinnedRecording;

/// Standard deviations by which a value has to be beyond a limit.
const BEYOND: f64 = 2.0;

impl PlaceSearch<'_> {
    /// Mean square of the residuals relative to the noise in simulations of the training recordings with the estimates
    /// at a place, and the unknowns along the first of them. An output counts at most as much as its readings about
    /// their mean.
    pub(super) fn left_with(&self, found: &EstimatedPlace, p: &[f64]) -> (f64, Option<Solution>) {
        let (mut sum, mut count, mut first) = (0.0, 0, None);
        for (thinned, estimated) in self.train.iter().zip(&found.train) {
            let simulated = self.inputs(thinned, found.place, &estimated.piece.d).and_then(|u| {
                let start = &estimated.piece.start;
                let problem = Problem { system: self.system(), p, inputs: &u, start };
                let solution = simulate(&problem, &thinned.times, &self.data.options).ok()?;
                Some((thinned.residuals(&observe(&problem, &solution)), solution))
            });
            let (residuals, solution) = simulated.unzip();
            if first.is_none() {
                first = Some(solution);
            }
            let readings = thinned.readings();
            let n_w = self.data.noise.len();
            for (output, noise) in self.data.noise.iter().enumerate() {
                let Some(noise) = noise.as_ref().filter(|noise| noise.total() > 0.0) else {
                    continue;
                };
                let of_output = |all: &[f64]| -> Vec<f64> {
                    let values = all.iter().skip(output).step_by(n_w).copied();
                    values.filter(|x| x.is_finite()).collect()
                };
                let read = of_output(&readings);
                let at_most = spread(&read).powi(2) * read.len() as f64;
                let left = residuals.as_ref().map_or(f64::INFINITY, |residuals| {
                    of_output(residuals).iter().map(|x| x * x).sum::<f64>()
                });
                sum += left.min(at_most) / noise.total().powi(2);
                count += read.len();
            }
        }
        (sum / count.max(1) as f64, first.flatten())
    }
}

/// Why a place with these traces is implausible. `base` is the value of a parameter in the base model.
pub(super) fn objection(
    place: &MissingPlace,
    model: &Model,
    recordings: &[ThinnedRecording<'_>],
    base: f64,
    traces: &[PlaceTrace],
) -> Option<PlaceObjection> {
    let changes = || traces.iter().flat_map(|trace| trace.d.iter().zip(&trace.std));
    match place.kind {
        PlaceKind::Equation => None,
        PlaceKind::Parameter => {
            let parameter = model.parameters.iter().find(|p| p.declared.name == place.name)?;
            let mut values = changes().map(|(d, std)| (base + d, BEYOND * std));
            if values
                .clone()
                .any(|(x, beyond)| x < parameter.lower - beyond || x > parameter.upper + beyond)
            {
                return Some(PlaceObjection::Bounds);
            }
            values
                .any(|(x, beyond)| x * base < 0.0 && x.abs() > beyond)
                .then_some(PlaceObjection::Sign)
        }
        PlaceKind::Input => {
            let position = model.inputs.iter().position(|i| i.declared.name == place.name)?;
            let values = recordings.iter().flat_map(|thinned| {
                let inputs = &thinned.recording.inputs;
                let mut u = vec![0.0; inputs.len()];
                thinned.times.iter().map(move |t| {
                    inputs.value(*t, LimitSide::Right, &mut u);
                    u.get(position).copied().unwrap_or(f64::NAN)
                })
            });
            is_beyond(changes().map(|(d, _)| *d), &values.collect::<Vec<f64>>())
        }
        PlaceKind::Output => {
            let position = model.outputs.iter().position(|o| o.declared.name == place.name)?;
            let read = recordings.iter().flat_map(|thinned| {
                let readings = thinned.readings();
                readings.into_iter().skip(position).step_by(model.outputs.len())
            });
            is_beyond(changes().map(|(d, _)| *d), &read.collect::<Vec<f64>>())
        }
    }
}

/// Whether errors vary more than the recorded values, each about their mean. Values that never move are not compared.
fn is_beyond(errors: impl Iterator<Item = f64>, recorded: &[f64]) -> Option<PlaceObjection> {
    let finite = |all: &mut dyn Iterator<Item = f64>| -> Vec<f64> {
        all.filter(|x| x.is_finite()).collect()
    };
    let [errors, recorded] =
        [finite(&mut { errors }), finite(&mut recorded.iter().copied())].map(|all| spread(&all));
    (recorded > 0.0 && errors > recorded).then_some(PlaceObjection::Size)
}

/// Standard deviation about the mean.
fn spread(all: &[f64]) -> f64 {
    let n = all.len().max(1) as f64;
    let mean = all.iter().sum::<f64>() / n;
    (all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offset_is_plausible_and_an_error_that_varies_more_than_the_readings_is_not() {
        let read = [1.0, 2.0, 1.0, 2.0];
        assert_eq!(is_beyond([60.0; 4].into_iter(), &read), None);
        let errors = [60.0, -60.0, 60.0, -60.0];
        assert_eq!(is_beyond(errors.into_iter(), &read), Some(PlaceObjection::Size));
        // What never moved shows nothing.
        assert_eq!(is_beyond(errors.into_iter(), &[1.0; 4]), None);
    }
}
