//! Profile likelihood: how far an estimate can go while the others make up for it.
//!
//! ```text
//!   d(θᵢ) = min over the other estimates of Σ (e/σ)²  −  Σ (e/σ)² of the fit
//!   interval:  { θᵢ : d(θᵢ) ≤ χ²₁(0.95) = 1.959964² }
//! ```
//!
//! From the estimate outwards on each side, the others start where they were last, moved on as they
//! moved before. Steps are such that √d, a straight line where the model is linear, grows by a fifth
//! of its threshold each; the crossing is then closed in on by the false position of √d. A side that
//! never gets there is open: the data does not bound the estimate on that side, whatever its standard
//! deviation says. σ is that of the fit all along.
//!
//! Sources: Venzon, Moolgavkar, A method for computing profile-likelihood-based confidence
//! intervals, Appl. Statist. 37 (1988) 87; Raue et al., Structural and practical identifiability
//! analysis of partially observed dynamical models by exploiting the profile likelihood,
//! Bioinformatics 25 (2009) 1923.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::identify::around::Around;
use crate::identify::error::EstimateError;
use crate::identify::fit::Fit;
use crate::identify::output_error::OutputErrorProblem;
use crate::identify::parallel::in_parallel;
use crate::identify::progress::{Of, Progress};
use crate::identify::uncertainty::Term;
use crate::identify::variables::Scale;
use crate::journal::Kept;
use crate::keep_by_fields;
use crate::system::System;

/// χ²₁(0.95), what the deviance of an interval of 95 % rises by.
pub const THRESHOLD: f64 = 3.841_458_820_694_124;

/// √d grows by this part of its threshold in a step.
const STEP: f64 = 0.2;

/// A step is repeated with half its length where √d has grown by more than this part of the threshold.
const TOO_FAR: f64 = 0.6;

/// A crossing is known where √d is this close to that of the threshold, relative to it.
const CLOSE: f64 = 1e-3;

/// Most points of a side.
const MOST_POINTS: usize = 60;

/// Most simulations of a point.
const MOST_EVALUATIONS: usize = 60;

/// A side ends here where it is open, in sizes of the estimate, or of 1 where that is larger.
const FAR: f64 = 1e3;

/// The same of a logarithm: a factor of a million.
const FAR_LOGARITHM: f64 = 13.8;

/// What changes by less than this part of the largest relative change has no part in making up.
const TAKES_PART: f64 = 0.1;

/// What changes by less than this part of its value stays.
const STAYS: f64 = 1e-3;

/// Where one side of a profile ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum End {
    /// The deviance reaches its threshold at this value, SI: an end of the interval.
    Interval(f64),
    /// It does not before the parameter's bound, this value.
    Bound(f64),
    /// It does not as far as this value, far away: the data leaves this side open.
    Open(f64),
    /// It does not as far as this value, beyond which the model cannot be simulated.
    Unsimulated(f64),
}

impl End {
    /// The value, whatever it means.
    pub fn value(self) -> f64 {
        match self {
            Self::Interval(value)
            | Self::Bound(value)
            | Self::Open(value)
            | Self::Unsimulated(value) => value,
        }
    }
}

impl Kept for End {
    fn write(&self, bytes: &mut Vec<u8>) {
        let kind: usize = match self {
            Self::Interval(_) => 0,
            Self::Bound(_) => 1,
            Self::Open(_) => 2,
            Self::Unsimulated(_) => 3,
        };
        (kind, self.value()).write(bytes);
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        let (kind, value) = <(usize, f64)>::read(bytes)?;
        let kinds = [Self::Interval, Self::Bound, Self::Open, Self::Unsimulated];
        Some(kinds.get(kind)?(value))
    }
}

/// Deviance along an estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Position among the estimates.
    pub estimate: usize,
    /// Values of the estimate, SI, ascending; that of the fit among them.
    pub values: Vec<f64>,
    /// d of each. A negative one means that the fit has not found the least.
    pub deviance: Vec<f64>,
    /// Where it ends below.
    pub lower: End,
    /// Where it ends above.
    pub upper: End,
    /// The other estimates at the lower end, SI.
    pub others_below: Vec<f64>,
    /// The other estimates at the upper end, SI.
    pub others_above: Vec<f64>,
    /// Simulations of all recordings.
    pub evaluations: usize,
}

keep_by_fields!(Profile {
    estimate,
    values,
    deviance,
    lower,
    upper,
    others_below,
    others_above,
    evaluations
});

impl Profile {
    /// The interval of 95 %, SI; `None` for a side that the data leaves open. A bound closes one.
    pub fn interval(&self) -> (Option<f64>, Option<f64>) {
        let end = |end: End| match end {
            End::Interval(value) | End::Bound(value) => Some(value),
            End::Open(_) | End::Unsimulated(_) => None,
        };
        (end(self.lower), end(self.upper))
    }

    /// The other estimates that make up for this one at an end, with their changes in parts of their
    /// sizes. Empty where they stay.
    pub fn followers(&self, fit: &Fit, others: &[f64]) -> Vec<Term> {
        // An estimate may be zero, its size is not.
        let change = |i: usize| (others[i] - fit.estimates[i].value) / fit.size(i);
        let all = (0..others.len()).filter(|i| *i != self.estimate);
        let terms: Vec<Term> = all.map(|i| Term { estimate: i, change: change(i) }).collect();
        let largest = terms.iter().map(|term| term.change.abs()).fold(0.0, f64::max);
        let counts = |term: &Term| term.change.abs() > (TAKES_PART * largest).max(STAYS);
        terms.into_iter().filter(counts).collect()
    }
}

/// The profiles of some estimates of a fit to this problem, in the order of `estimates`, by the threads
/// of the problem. Where its watch stops it, those that are complete are given ([`Profile::estimate`] says
/// which they are).
///
/// # Errors
///
/// As [`fit`](crate::identify::fit); or the problem cannot be simulated where the fit ended.
///
/// # Panics
///
/// When the fit is not one of the problem, or an estimate is not one of the fit.
pub fn profiles<S: System + Clone + Send>(
    problem: &OutputErrorProblem<'_, S>,
    fit: &Fit,
    estimates: &[usize],
) -> Result<Vec<Profile>, EstimateError> {
    let around = Around::new(problem, fit, MOST_EVALUATIONS)?;
    let first = around
        .evaluated(&around.problem(problem.system), &around.z)
        .map_err(EstimateError::Start)?;
    let least = first.as_ref().cost;
    let done = AtomicUsize::new(0);
    let found = in_parallel(problem.system, estimates.len(), problem.threads, |system, k| {
        let problem = around.problem(system);
        let along = Along { around: &around, problem: &problem, i: estimates[k], least };
        let profile = around.kept(
            |digest| digest.of(&("profile", estimates[k])),
            || {
                let profile = along.profile(fit);
                // What is found after this was said may lack something.
                if around.watch.is_stopped() { Err(EstimateError::Stopped) } else { Ok(profile) }
            },
        );
        let profile = profile.ok()?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        let of = Of::Exactly(estimates.len());
        around.watch.advanced(Progress { what: "profiles", done, of });
        Some(profile)
    });
    Ok(found.into_iter().flatten().collect())
}

/// The profile of one estimate: [`profiles`].
///
/// # Errors
///
/// As [`profiles`], and [`EstimateError::Stopped`].
///
/// # Panics
///
/// As [`profiles`].
pub fn profile<S: System + Clone + Send>(
    problem: &OutputErrorProblem<'_, S>,
    fit: &Fit,
    estimate: usize,
) -> Result<Profile, EstimateError> {
    profiles(problem, fit, &[estimate])?.pop().ok_or(EstimateError::Stopped)
}

/// One estimate, along which the others are fitted.
struct Along<'a, S> {
    around: &'a Around<'a>,
    problem: &'a OutputErrorProblem<'a, S>,
    i: usize,
    /// Σ (e/σ)² of the fit.
    least: f64,
}

/// A point of a profile.
#[derive(Debug, Clone)]
struct Place {
    z: Vec<f64>,
    deviance: f64,
}

impl Place {
    /// √d.
    fn root(&self) -> f64 {
        self.deviance.max(0.0).sqrt()
    }
}

/// One side of a profile.
struct Arm {
    /// From the fit outwards, without it.
    places: Vec<Place>,
    end: fn(f64) -> End,
    at: Place,
}

impl<S: System + Clone + Send> Along<'_, S> {
    fn profile(&self, fit: &Fit) -> Profile {
        let mut evaluations = 0;
        let below = self.arm(-1.0, fit, &mut evaluations);
        let above = self.arm(1.0, fit, &mut evaluations);
        let centre = Place { z: self.around.z.clone(), deviance: 0.0 };
        let variables = &self.around.variables.all;
        let value = |place: &Place| variables[self.i].value(place.z[self.i]);
        let all = |place: &Place| -> Vec<f64> {
            variables.iter().zip(&place.z).map(|(variable, z)| variable.value(*z)).collect()
        };
        let mut places: Vec<&Place> =
            below.places.iter().chain([&centre]).chain(&above.places).collect();
        places.sort_by(|a, b| a.z[self.i].total_cmp(&b.z[self.i]));
        Profile {
            estimate: self.i,
            values: places.iter().map(|place| value(place)).collect(),
            deviance: places.iter().map(|place| place.deviance).collect(),
            lower: (below.end)(value(&below.at)),
            upper: (above.end)(value(&above.at)),
            others_below: all(&below.at),
            others_above: all(&above.at),
            evaluations,
        }
    }

    /// The side of the smaller or the larger values.
    fn arm(&self, sign: f64, fit: &Fit, evaluations: &mut usize) -> Arm {
        let start = self.around.z[self.i];
        let (low, high) = self.around.bounds[self.i];
        let variable = &self.around.variables.all[self.i];
        let reach = match variable.scale {
            Scale::Linear(_) => FAR * start.abs().max(1.0),
            Scale::Logarithm => FAR_LOGARITHM,
        };
        let (bound, bounded) = if sign < 0.0 { (low, low) } else { (high, high) };
        let far = if sign < 0.0 { bound.max(start - reach) } else { bound.min(start + reach) };
        let at_far: fn(f64) -> End = if far == bounded { End::Bound } else { End::Open };

        let threshold = THRESHOLD.sqrt();
        let usual = fit.estimates[self.i].std.map(|std| std / variable.slope(start).abs());
        let mut h = match usual {
            Some(std) if std > 0.0 => (STEP * threshold * std).min(0.1 * reach),
            _ => 1e-2 * start.abs().max(1e-2),
        };
        let mut arm = Arm {
            places: Vec::new(),
            end: at_far,
            at: Place { z: self.around.z.clone(), deviance: 0.0 },
        };
        let mut before: Option<Place> = None;
        let least_step = 1e-9 * start.abs().max(1.0);
        let is_stopped = || self.around.watch.is_stopped();
        while arm.places.len() < MOST_POINTS && arm.at.z[self.i] != far && !is_stopped() {
            let now = arm.at.z[self.i];
            let next = now + sign * h;
            let next = if (next - far) * sign >= 0.0 { far } else { next };
            let Some(place) = self.place(next, &arm.at, before.as_ref(), evaluations) else {
                h *= 0.25;
                if h < least_step {
                    arm.end = End::Unsimulated;
                    return arm;
                }
                continue;
            };
            let growth = (place.root() - arm.at.root()) / threshold;
            if growth > TOO_FAR && h > least_step {
                h *= (STEP / growth).max(0.1);
                continue;
            }
            if place.deviance >= THRESHOLD {
                return self.crossing(arm, place, evaluations);
            }
            h *= if growth > 0.0 { (STEP / growth).clamp(0.5, 3.0) } else { 3.0 };
            before = Some(std::mem::replace(&mut arm.at, place.clone()));
            arm.places.push(place);
        }
        if arm.at.z[self.i] != far {
            arm.end = End::Open;
        }
        arm
    }

    /// Closes in on the threshold between where an arm is and a place beyond it.
    fn crossing(&self, mut arm: Arm, beyond: Place, evaluations: &mut usize) -> Arm {
        let threshold = THRESHOLD.sqrt();
        let (mut inside, mut outside) = (arm.at.clone(), beyond.clone());
        let (mut f_inside, mut f_outside) = (inside.root() - threshold, outside.root() - threshold);
        for _ in 0..12 {
            if self.around.watch.is_stopped() || outside.root() - threshold <= CLOSE * threshold {
                break;
            }
            let (a, b) = (inside.z[self.i], outside.z[self.i]);
            let z = a + (b - a) * f_inside / (f_inside - f_outside);
            let Some(place) = self.place(z, &inside, Some(&outside), evaluations) else { break };
            let f = place.root() - threshold;
            if f.abs() <= CLOSE * threshold {
                outside = place;
                break;
            }
            // Illinois: the end that stays counts half.
            if f < 0.0 {
                (inside, f_inside) = (place, f);
                f_outside *= 0.5;
            } else {
                (outside, f_outside) = (place, f);
                f_inside *= 0.5;
            }
        }
        arm.places.push(outside.clone());
        if beyond.z[self.i] != outside.z[self.i] {
            arm.places.push(beyond);
        }
        arm.end = End::Interval;
        arm.at = outside;
        arm
    }

    /// The least sum of squares with the estimate held at a value; `None` where no minimum is found.
    fn place(
        &self,
        held: f64,
        from: &Place,
        other: Option<&Place>,
        evaluations: &mut usize,
    ) -> Option<Place> {
        let mut bounds = self.around.bounds.clone();
        bounds[self.i] = (held, held);
        let moved_on = other.map(|other| self.moved_on(held, from, other));
        let mut stayed = from.z.clone();
        stayed[self.i] = held;
        for z in moved_on.into_iter().chain([stayed]) {
            *evaluations += 1;
            let Ok(minimum) = self.around.minimum(self.problem, z, &bounds) else { continue };
            *evaluations += minimum.evaluations;
            if minimum.termination.is_converged() {
                let deviance = minimum.at.as_ref().cost - self.least;
                return Some(Place { z: minimum.x, deviance });
            }
        }
        None
    }

    /// The others on the line through two places.
    fn moved_on(&self, held: f64, from: &Place, other: &Place) -> Vec<f64> {
        let i = self.i;
        let part = (held - from.z[i]) / (from.z[i] - other.z[i]);
        let moved = from.z.iter().zip(&other.z).zip(&self.around.bounds);
        let mut z: Vec<f64> = moved
            .map(|((from, other), (low, high))| (from + part * (from - other)).clamp(*low, *high))
            .collect();
        z[i] = held;
        z
    }
}
