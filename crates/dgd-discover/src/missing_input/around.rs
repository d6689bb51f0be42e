//! Fits a place again around the trajectory that includes its missing term.
//!
//! The linearisation around the base model's simulation holds only near it. So the model is simulated with the
//! estimates of d, parameters and start values, and the place is fitted again around that trajectory: a Gauss–Newton
//! iteration whose step is halved until the simulation comes closer to the readings.
//!
//! Source: Bell, The iterated Kalman smoother as a Gauss–Newton method, SIAM J. Optim. 4 (1994) 626–636.

use dgd_runtime::{Problem, System, observe, simulate};
use dgd_screen::noise::SensorNoise;

use super::estimated::{EstimatedPlace, RecordedInput, ReferencePart};
use super::place_fit::{LinearisedRecording, LinearisedRecordings, ParameterColumns, PlaceFit};
use super::place_search::PlaceSearch;
use super::thinned::ThinnedRecording;

/// Maximum number of times that a place is fitted again …
const ROUNDS: usize = 8;
/// … taking the first of these fractions of the step that brings the simulation closer to the readings …
const SHARES: [f64; 5] = [1.0, 0.5, 0.25, 0.125, 0.0625];
/// … until a full step leaves more than this fraction of Σ (measured − simulated)²/σ² …
const SETTLED: f64 = 0.9;
/// … or this many full steps were taken: the linear model then holds.
const AFTER_WHOLE: usize = 1;

/// A trajectory to linearise around: parameters, and the missing term at a place in each recording.
pub(super) struct ReferenceTrajectory {
    p: Vec<f64>,
    train: Vec<ReferencePart>,
    valid: Vec<ReferencePart>,
}

impl ReferenceTrajectory {
    /// The reference at a fraction `share` of the way to another.
    fn towards(&self, aim: &ReferenceTrajectory, share: f64) -> ReferenceTrajectory {
        let along = |from: f64, to: f64| from + share * (to - from);
        let pieces = |from: &[ReferencePart], to: &[ReferencePart]| -> Vec<ReferencePart> {
            let both = from.iter().zip(to);
            both.map(|(from, to)| ReferencePart {
                start: (to.start.iter())
                    .map(|(state, to)| {
                        let previous = from.start.iter().find(|(own, _)| own == state);
                        (*state, previous.map_or(*to, |(_, from)| along(*from, *to)))
                    })
                    .collect(),
                d: from.d.iter().zip(&to.d).map(|(from, to)| along(*from, *to)).collect(),
            })
            .collect()
        };
        ReferenceTrajectory {
            p: self.p.iter().zip(&aim.p).map(|(from, to)| along(*from, *to)).collect(),
            train: pieces(&self.train, &aim.train),
            valid: pieces(&self.valid, &aim.valid),
        }
    }
}

/// Parameters with the changes fitted together with a place, ignoring bounds.
fn moved(p: &[f64], free: &[(usize, f64, usize)], fit: &PlaceFit) -> Vec<f64> {
    let mut p = p.to_vec();
    for ((_, size, position), change) in free.iter().zip(&fit.changes) {
        p[*position] += size * change;
    }
    p
}

impl PlaceSearch<'_> {
    /// Fits a place again around the trajectory that includes its missing term. Far from the previous trajectory the
    /// linear model misleads, so only a fraction of the step is taken that brings the simulation closer to the
    /// readings. `None` if no fraction does.
    pub(super) fn again(
        &self,
        first: &EstimatedPlace,
        free: &[(usize, f64)],
    ) -> Option<EstimatedPlace> {
        let mut last: Option<EstimatedPlace> = None;
        let mut reference = self.reference();
        let mut misfit = self.misfit(first.place, &reference);
        for round in 0..ROUNDS {
            let current = last.as_ref().unwrap_or(first);
            let aim = self.aim(current, &reference);
            let nearer = SHARES.iter().find_map(|share| {
                let between = reference.towards(&aim, *share);
                let between = ReferenceTrajectory { p: self.within_bounds(between.p), ..between };
                let left = self.misfit(current.place, &between);
                (self.follows || left < misfit).then_some((between, left, *share))
            });
            let Some((next, left, share)) = nearer else { break };
            let Some(again) = self.fitted_around(current.place, &next, free) else { break };
            if self.follows && again.fit.likelihood.train <= current.fit.likelihood.train {
                break;
            }
            let has_settled = share == 1.0 && (left > SETTLED * misfit || round >= AFTER_WHOLE);
            last = Some(again);
            (reference, misfit) = (next, left);
            if has_settled {
                break;
            }
        }
        last
    }

    /// Fits a place around a trajectory.
    fn fitted_around(
        &self,
        place: usize,
        at: &ReferenceTrajectory,
        free: &[(usize, f64)],
    ) -> Option<EstimatedPlace> {
        let around = |all: &[ThinnedRecording<'_>],
                      pieces: &[ReferencePart]|
         -> Option<Vec<LinearisedRecording>> {
            let around =
                |(thinned, ReferencePart { start, d }): (&ThinnedRecording<'_>, &ReferencePart)| {
                    if self.follows {
                        self.sight_filtered(thinned, place, d, &at.p)
                    } else {
                        self.sight_around(thinned, start, place, d, &at.p)
                    }
                };
            all.iter().zip(pieces).map(around).collect()
        };
        let (train, valid) = (around(&self.train, &at.train)?, around(&self.valid, &at.valid)?);
        let sights =
            LinearisedRecordings { train: &train, valid: &valid, noise: &self.data.noise, free };
        let columns =
            ParameterColumns { train: sights.columns(&train), valid: sights.columns(&valid) };
        let fit = sights.fit(place, &columns)?;
        let fitted = EstimatedPlace::new(place, fit, &sights, &columns);
        Some(EstimatedPlace { p: Some(at.p.clone()), ..fitted })
    }

    /// The trajectory with nothing missing.
    fn reference(&self) -> ReferenceTrajectory {
        let plain = |all: &[ThinnedRecording<'_>]| -> Vec<ReferencePart> {
            let piece = |thinned: &ThinnedRecording<'_>| ReferencePart {
                start: thinned.start.clone(),
                d: vec![0.0; thinned.times.len()],
            };
            all.iter().map(piece).collect()
        };
        ReferenceTrajectory {
            p: self.p.clone(),
            train: plain(&self.train),
            valid: plain(&self.valid),
        }
    }

    /// The trajectory given by the estimates around another one.
    fn aim(&self, found: &EstimatedPlace, at: &ReferenceTrajectory) -> ReferenceTrajectory {
        let pieces = |estimates: &[RecordedInput]| -> Vec<ReferencePart> {
            estimates.iter().map(|estimated| estimated.piece.clone()).collect()
        };
        ReferenceTrajectory {
            p: moved(&at.p, &self.free, &found.fit),
            train: pieces(&found.train),
            valid: pieces(&found.valid),
        }
    }

    /// Parameters with the changes fitted together with a place, within their bounds.
    pub(super) fn changed(&self, p: &[f64], fit: &PlaceFit) -> Vec<f64> {
        self.within_bounds(moved(p, &self.free, fit))
    }

    fn within_bounds(&self, mut p: Vec<f64>) -> Vec<f64> {
        for (_, _, position) in &self.free {
            let parameter = &self.system().signature().parameters[*position];
            p[*position] = p[*position].clamp(parameter.lower, parameter.upper);
        }
        p
    }

    /// Σ (measured − simulated)²/σ² of the training recordings; infinite if one cannot be simulated.
    fn misfit(&self, place: usize, at: &ReferenceTrajectory) -> f64 {
        let squares_of = |(thinned, ReferencePart { start, d }): (
            &ThinnedRecording<'_>,
            &ReferencePart,
        )|
         -> Option<f64> {
            let inputs = self.inputs(thinned, place, d)?;
            let problem = Problem { system: self.system(), p: &at.p, inputs: &inputs, start };
            let solution = simulate(&problem, &thinned.times, &self.data.options).ok()?;
            let residuals = thinned.residuals(&observe(&problem, &solution));
            let n_w = self.data.noise.len();
            let squares = residuals.iter().enumerate().filter_map(|(i, residual)| {
                let SensorNoise { std, .. } = self.data.noise[i % n_w].as_ref()?;
                let error = residual / std;
                (*std > 0.0 && !residual.is_nan()).then_some(error * error)
            });
            Some(squares.sum())
        };
        let total: Option<f64> = self.train.iter().zip(&at.train).map(squares_of).sum();
        total.filter(|sum| sum.is_finite()).unwrap_or(f64::INFINITY)
    }
}
