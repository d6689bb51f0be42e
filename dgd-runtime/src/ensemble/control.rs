//! Step-size control of each lane.
//!
//! The same rules as the integrator's controller, with selections instead of branches.

#![allow(clippy::inline_always)]

use super::lanes::Lanes;
use super::power::power;
use crate::integrate::controller::{self, ControlLaw};

/// A remainder of up to this many natural steps is taken in one step.
const WHOLE: f64 = 1.01;
/// Factor by which a step that could not be evaluated is shortened.
const ABANDONED: f64 = 0.25;

/// Control of the step sizes.
#[derive(Debug, Clone)]
pub(super) struct StepControl {
    /// The natural step sizes.
    pub(super) h: Lanes,
    /// 1/k.
    exponent: f64,
    /// k.
    order: u32,
    /// β of proportional and integral control; 0 for predictive control.
    beta: f64,
    /// h₋₁; infinity before the first step and after one that was cut.
    previous_h: Lanes,
    /// e₋₁ squared; infinity then.
    previous_error: Lanes,
    /// 1 if the previous step was rejected.
    rejected: Lanes,
}

impl StepControl {
    pub(super) fn new(estimate_order: u32, law: ControlLaw) -> Self {
        let beta = match law {
            ControlLaw::ProportionalIntegral { beta } => beta,
            ControlLaw::Predictive | ControlLaw::Piecewise => 0.0,
        };
        Self {
            h: Lanes::ZERO,
            exponent: 1.0 / f64::from(estimate_order + 1),
            order: estimate_order + 1,
            beta,
            previous_h: Lanes::splat(f64::INFINITY),
            previous_error: Lanes::splat(f64::INFINITY),
            rejected: Lanes::ZERO,
        }
    }

    /// Begins lane l with a step of size h.
    pub(super) fn begin(&mut self, l: usize, h: f64) {
        self.h.0[l] = h;
        self.previous_h.0[l] = f64::INFINITY;
        self.previous_error.0[l] = f64::INFINITY;
        self.rejected.0[l] = 0.0;
    }

    /// The next steps if `remaining` is left of the segment: equal steps up to its end.
    #[inline(always)]
    pub(super) fn propose(&self, remaining: Lanes) -> Lanes {
        remaining.combine(self.h, |remaining, h| {
            let ratio = remaining / h;
            if ratio <= WHOLE { remaining } else { remaining / ratio.ceil() }
        })
    }

    /// Updates the controller with the errors (squares of e) of the tried steps, which are accepted if these are at
    /// most 1.
    #[inline(always)]
    pub(super) fn judge(&mut self, tried: Lanes, errors: Lanes) {
        use controller::{
            CUT, LEAST_AFTER_ACCEPTANCE, LEAST_AFTER_REJECTION, MOST_GROWTH, NEGLIGIBLE,
            REMEMBERED, SAFETY,
        };
        let (h, before) = (self.h, self.previous_error);
        // Values that are not finite are not used.
        let finite = errors.map(|e| if e <= f64::MAX { e } else { f64::MAX });
        let errors_used = finite.map(|e| if e > NEGLIGIBLE { e } else { NEGLIGIBLE });
        let root = SAFETY * power(errors_used, -0.5 * self.exponent);
        let factor = if self.beta > 0.0 {
            let remembered = before.map(|e| if e > REMEMBERED { e } else { REMEMBERED });
            let correction =
                power(errors_used, 0.375 * self.beta) * power(remembered, 0.5 * self.beta);
            let known = before.combine(correction, |e, c| if e < f64::INFINITY { c } else { 1.0 });
            root * known
        } else {
            // h/h₋₁ (e₋₁/e)^(1/k), if errors rise and it is below 1.
            let rise = (before / errors_used).map(|rise| if rise < 1.0 { rise } else { 1.0 });
            let prediction = tried / self.previous_h * power(rise, 0.5 * self.exponent);
            let least = prediction.map(|p| if p < 1.0 { p } else { 1.0 });
            root * rise.combine(least, |rise, least| if rise < 1.0 { least } else { 1.0 })
        };

        // Accepted.
        let factor = factor.map(|f| f.clamp(LEAST_AFTER_ACCEPTANCE, MOST_GROWTH));
        let factor = factor.combine(self.rejected, |factor, rejected| {
            if rejected > 0.0 && factor > 1.0 { 1.0 } else { factor }
        });
        let changed = tried * factor;
        let longest = h.combine(changed, |h, changed| if h > changed { h } else { changed });
        let is_growth = factor.lanes_where(factor, |factor, _| factor >= 1.0);
        let mut next = changed.choose(longest, is_growth);

        // Accepted, and cut by the end of a segment: e ~ h^k, the natural step is still good if
        // 0.9 h₀ e^(−1/k) ≥ h.
        let is_cut = tried.lanes_where(h, |tried, h| tried < CUT * h);
        if is_cut.contains(&true) {
            let ratio = SAFETY * tried / h;
            let mut bound = Lanes::splat(1.0);
            for _ in 0..2 * self.order {
                bound = bound * ratio;
            }
            let grown = tried * root.map(|root| if root > 1.0 { root } else { 1.0 });
            let is_large = errors.lanes_where(bound, |e, bound| e > bound);
            next = next.choose(h.choose(grown, is_large), is_cut);
        }

        // Rejected, or not evaluated.
        let shrink = root.map(|root| root.clamp(LEAST_AFTER_REJECTION, SAFETY));
        let factor =
            errors.combine(shrink, |e, shrink| if e <= f64::MAX { shrink } else { ABANDONED });
        let accepted = errors.lanes_where(errors, |e, _| e <= 1.0);
        self.h = (tried * factor).choose(next, accepted);

        let none = Lanes::splat(f64::INFINITY);
        self.previous_h = self.previous_h.choose(tried.choose(none, is_cut), accepted);
        self.previous_error = before.choose(errors_used.choose(none, is_cut), accepted);
        self.rejected = Lanes::splat(1.0).choose(Lanes::ZERO, accepted);
    }
}
