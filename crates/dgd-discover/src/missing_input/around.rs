//! Fits a place again around the trajectory that includes its missing term.
//!
//! The linearisation around the base model's simulation holds only near it. So the model is simulated with the
//! estimates of d, parameters and start values, and the place is fitted again around that trajectory: a Gauss–Newton
//! iteration whose step is halved until the simulation comes closer to the readings.
//!
//! Source: Bell, The iterated Kalman smoother as a Gauss–Newton method, SIAM J. Optim. 4 (1994) 626–636.

use dgd_identify::Starts;
use dgd_runtime::{Problem, System, observe, simulate};
use dgd_screen::noise::SensorNoise;

use super::missing::{Estimated, Found, Places};
use super::place_fit::{Columns, PlaceFit, Sight, Sights};
use super::thinned::Thinned;

/// Maximum number of times that a place is fitted again …
const ROUNDS: usize = 8;
/// … taking the first of these fractions of the step that brings the simulation closer to the readings …
const SHARES: [f64; 5] = [1.0, 0.5, 0.25, 0.125, 0.0625];
/// … until a full step leaves more than this fraction of Σ (measured − simulated)²/σ² …
const SETTLED: f64 = 0.9;
/// … or this many full steps were taken: the linear model then holds.
const AFTER_WHOLE: usize = 1;

/// A trajectory to linearise around: parameters, and the missing term at a place in each recording.
pub(super) struct Reference {
    p: Vec<f64>,
    train: Vec<Piece>,
    valid: Vec<Piece>,
}

/// Its part for one recording.
#[derive(Clone)]
pub(super) struct Piece {
    /// Start values, SI.
    pub(super) start: Starts,
    pub(super) d: Vec<f64>,
}

impl Reference {
    /// The reference at a fraction `share` of the way to another.
    fn towards(&self, aim: &Reference, share: f64) -> Reference {
        let along = |from: f64, to: f64| from + share * (to - from);
        let pieces = |from: &[Piece], to: &[Piece]| -> Vec<Piece> {
            let both = from.iter().zip(to);
            both.map(|(from, to)| Piece {
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
        Reference {
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

impl Places<'_> {
    /// Fits a place again around the trajectory that includes its missing term. Far from the previous trajectory the
    /// linear model misleads, so only a fraction of the step is taken that brings the simulation closer to the
    /// readings. `None` if no fraction does.
    pub(super) fn again(&self, first: &Found, free: &[(usize, f64)]) -> Option<Found> {
        let mut last: Option<Found> = None;
        let mut reference = self.reference();
        let mut misfit = self.misfit(first.place, &reference);
        for round in 0..ROUNDS {
            let current = last.as_ref().unwrap_or(first);
            let aim = self.aim(current, &reference);
            let nearer = SHARES.iter().find_map(|share| {
                let between = reference.towards(&aim, *share);
                let between = Reference { p: self.within_bounds(between.p), ..between };
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
    fn fitted_around(&self, place: usize, at: &Reference, free: &[(usize, f64)]) -> Option<Found> {
        let around = |all: &[Thinned<'_>], pieces: &[Piece]| -> Option<Vec<Sight>> {
            let around = |(thinned, Piece { start, d }): (&Thinned<'_>, &Piece)| {
                if self.follows {
                    self.sight_filtered(thinned, place, d, &at.p)
                } else {
                    self.sight_around(thinned, start, place, d, &at.p)
                }
            };
            all.iter().zip(pieces).map(around).collect()
        };
        let (train, valid) = (around(&self.train, &at.train)?, around(&self.valid, &at.valid)?);
        let sights = Sights { train: &train, valid: &valid, noise: &self.data.noise, free };
        let columns = Columns { train: sights.columns(&train), valid: sights.columns(&valid) };
        let fit = sights.fit(place, &columns)?;
        let fitted = Found::new(place, fit, &sights, &columns);
        Some(Found { p: Some(at.p.clone()), ..fitted })
    }

    /// The trajectory with nothing missing.
    fn reference(&self) -> Reference {
        let plain = |all: &[Thinned<'_>]| -> Vec<Piece> {
            let piece = |thinned: &Thinned<'_>| Piece {
                start: thinned.start.clone(),
                d: vec![0.0; thinned.times.len()],
            };
            all.iter().map(piece).collect()
        };
        Reference { p: self.p.clone(), train: plain(&self.train), valid: plain(&self.valid) }
    }

    /// The trajectory given by the estimates around another one.
    fn aim(&self, found: &Found, at: &Reference) -> Reference {
        let pieces = |estimates: &[Estimated]| -> Vec<Piece> {
            estimates.iter().map(|estimated| estimated.piece.clone()).collect()
        };
        Reference {
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
    fn misfit(&self, place: usize, at: &Reference) -> f64 {
        let squares_of = |(thinned, Piece { start, d }): (&Thinned<'_>, &Piece)| -> Option<f64> {
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
