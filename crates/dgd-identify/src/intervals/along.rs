//! From a minimum outwards along one variable, to the threshold of the deviance.
//!
//! Steps are chosen so that √d, which is linear for a linear model, grows by a fifth of its threshold each; the
//! crossing is then located by false position on √d.

use crate::intervals::profile::{Profile, ProfileEnd, THRESHOLD};
use crate::progress::{Monitor, Progress, Total};

/// √d grows by this fraction of its threshold in a step.
const STEP: f64 = 0.2;

/// A step is repeated with half its length if √d has grown by more than this fraction of the threshold.
const TOO_FAR: f64 = 0.6;

/// Relative accuracy of √d at the threshold.
const CLOSE: f64 = 1e-3;

/// Limit on the points of a side.
const MOST_POINTS: usize = 60;

/// A minimum with the variable fixed.
#[derive(Debug, Clone)]
pub(crate) struct HeldMinimum {
    /// All variables.
    pub z: Vec<f64>,
    /// d.
    pub deviance: f64,
}

impl HeldMinimum {
    /// √d.
    fn root(&self) -> f64 {
        self.deviance.max(0.0).sqrt()
    }

    /// All variables on the line from `other` through this point, at a given value of the i-th.
    pub(crate) fn moved_on(&self, i: usize, held: f64, other: &HeldMinimum) -> Vec<f64> {
        let part = (held - self.z[i]) / (self.z[i] - other.z[i]);
        let moved = self.z.iter().zip(&other.z);
        let mut z: Vec<f64> = moved.map(|(z, other)| z + part * (z - other)).collect();
        z[i] = held;
        z
    }
}

/// The minimum with the variable fixed at a value, searched from a point and one before or after it; `None` if none is
/// found.
pub(crate) type ConstrainedMinimum<'a> =
    dyn Fn(f64, &HeldMinimum, Option<&HeldMinimum>) -> Option<HeldMinimum> + 'a;

/// The path of a profile: a variable of the order of 1, or a logarithm.
pub(crate) struct ProfilePath<'a> {
    /// Position of the variable.
    pub i: usize,
    /// The minimum.
    pub centre: Vec<f64>,
    /// Bounds of the variable.
    pub bounds: (f64, f64),
    /// An unbounded side ends at this distance.
    pub reach: f64,
    /// Standard deviation of the variable, if known.
    pub std: Option<f64>,
    /// Finds the minimum with the variable fixed.
    pub place: &'a ConstrainedMinimum<'a>,
    /// Whether to stop with the partial result.
    pub is_stopped: &'a dyn Fn() -> bool,
}

/// The profiles of some estimates, one by one; if cancelled, those that are complete.
pub(crate) fn one_by_one(
    estimates: &[usize],
    watch: &dyn Monitor,
    profile: impl Fn(usize) -> Profile,
) -> Vec<Profile> {
    let mut profiles = Vec::with_capacity(estimates.len());
    for j in estimates {
        let profile = profile(*j);
        // A result that was found before this check may be incomplete.
        if watch.is_stopped() {
            break;
        }
        profiles.push(profile);
        let total = Total::Exactly(estimates.len());
        watch.advanced(Progress { what: "profiles", done: profiles.len(), of: total });
    }
    profiles
}

/// One side of a profile.
pub(crate) struct ProfileArm {
    /// From the minimum outwards, without the minimum.
    pub places: Vec<HeldMinimum>,
    /// Meaning of its end.
    pub end: fn(f64) -> ProfileEnd,
    /// Its end.
    pub at: HeldMinimum,
}

impl ProfilePath<'_> {
    /// The side of the smaller (`sign` −1) or the larger values (1).
    pub(crate) fn arm(&self, sign: f64) -> ProfileArm {
        let start = self.centre[self.i];
        let (low, high) = self.bounds;
        let bound = if sign < 0.0 { low } else { high };
        let far =
            if sign < 0.0 { bound.max(start - self.reach) } else { bound.min(start + self.reach) };
        let at_far: fn(f64) -> ProfileEnd =
            if far == bound { ProfileEnd::Bound } else { ProfileEnd::Open };

        let threshold = THRESHOLD.sqrt();
        let mut h = match self.std {
            Some(std) if std > 0.0 => (STEP * threshold * std).min(0.1 * self.reach),
            _ => 1e-2 * start.abs().max(1e-2),
        };
        let mut arm = ProfileArm {
            places: Vec::new(),
            end: at_far,
            at: HeldMinimum { z: self.centre.clone(), deviance: 0.0 },
        };
        let mut before: Option<HeldMinimum> = None;
        let least_step = 1e-9 * start.abs().max(1.0);
        while arm.places.len() < MOST_POINTS && arm.at.z[self.i] != far && !(self.is_stopped)() {
            let now = arm.at.z[self.i];
            let next = now + sign * h;
            let next = if (next - far) * sign >= 0.0 { far } else { next };
            let Some(place) = (self.place)(next, &arm.at, before.as_ref()) else {
                h *= 0.25;
                if h < least_step {
                    arm.end = ProfileEnd::Unsimulated;
                    return arm;
                }
                continue;
            };
            let growth = (place.root() - arm.at.root()) / threshold;
            if growth > TOO_FAR && h > least_step {
                h *= (STEP / growth).max(0.1);
                continue;
            }
            // Five steps of a linear model end at the threshold, up to rounding.
            if place.root() >= (1.0 - CLOSE) * threshold {
                return self.crossing(arm, place);
            }
            h *= if growth > 0.0 { (STEP / growth).clamp(0.5, 3.0) } else { 3.0 };
            before = Some(std::mem::replace(&mut arm.at, place.clone()));
            arm.places.push(place);
        }
        if arm.at.z[self.i] != far {
            arm.end = ProfileEnd::Open;
        }
        arm
    }

    /// Locates the threshold between the end of an arm and a point beyond it.
    fn crossing(&self, mut arm: ProfileArm, beyond: HeldMinimum) -> ProfileArm {
        let threshold = THRESHOLD.sqrt();
        let (mut inside, mut outside) = (arm.at.clone(), beyond.clone());
        let (mut f_inside, mut f_outside) = (inside.root() - threshold, outside.root() - threshold);
        for _ in 0..12 {
            if (self.is_stopped)() || outside.root() - threshold <= CLOSE * threshold {
                break;
            }
            let (a, b) = (inside.z[self.i], outside.z[self.i]);
            let z = a + (b - a) * f_inside / (f_inside - f_outside);
            let Some(place) = (self.place)(z, &inside, Some(&outside)) else { break };
            let f = place.root() - threshold;
            if f.abs() <= CLOSE * threshold {
                outside = place;
                break;
            }
            // Illinois: the weight of the end that stays is halved.
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
        arm.end = ProfileEnd::Interval;
        arm.at = outside;
        arm
    }
}
