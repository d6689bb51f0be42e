//! Chooses order and size of the steps of backward differentiation.
//!
//! After k + 1 equal steps, the differences give the errors that orders k − 1, k and k + 1 would have made,
//!
//! ```text
//!   e_q = ∇^(q+1) y/(q + 1),   h_q = (b e_q)^(−1/(q+1)) h
//! ```
//!
//! and the order with the largest h_q is taken; b is a safety factor for errors that rise, larger for higher orders,
//! which are less stable. Steps grow slowly except at the beginning, since large ones may skip fast changes. A solution
//! begins with order 1 and a step for which h² ÿ/2 is half the tolerance.
//!
//! # Source
//!
//! The biases b are those of CVODE: Hindmarsh et al., ACM Transactions on Mathematical Software 31 (2005)
//! 363–396.

use crate::integrate::controller::Controller;
use crate::integrate::methods::family::{ErrorScale, JudgedStep};
use crate::integrate::methods::multistep::bdf::{BdfHistory, MAX_ORDER, error_constant};
use crate::integrate::methods::stepper::Stepper;
use crate::solved::SolvableSystem;

/// b, and that of a higher order.
const BIAS: f64 = 6.0;
const BIAS_HIGHER: f64 = 10.0;
const MOST_GROWTH: f64 = 2.0;
/// The same for the first steps, which are much shorter than those that follow.
const MOST_GROWTH_AT_FIRST: f64 = 10.0;
const FIRST_STEPS: usize = 10;
/// Number of rejections in a row after which the remembered values no longer fit the solution.
const MOST_REJECTIONS: usize = 3;
/// Steps shrink at most by this factor, and at least by the following ones at the first and later rejections.
const MOST_SHRINKING: f64 = 0.1;
const LEAST_SHRINKING: f64 = 0.9;
const SHRINKING_AGAIN: f64 = 0.2;

/// (b e)^(−1/(q+1)) for an error whose square is given.
fn growth(order: usize, bias: f64, error: f64) -> f64 {
    (bias * bias * error).max(f64::MIN_POSITIVE).powf(-0.5 / (order + 1) as f64)
}
/// Steps grow by at least this factor or not at all, since a change requires new differences.
const WORTH_GROWING: f64 = 1.2;
const WORTH_SHRINKING: f64 = 0.7;

impl<S: SolvableSystem> Stepper<S> {
    /// Chooses order and size of the next steps after an accepted one, with orders up to `most`.
    pub(super) fn choose_order(
        &mut self,
        JudgedStep { h, error }: JudgedStep,
        scale: &ErrorScale<'_, S>,
        most: usize,
        controller: &mut Controller,
    ) {
        let order = self.history.order;
        // The step was cut by an event or an end ahead: the natural step is different.
        if self.history.equal_steps <= order || h < 0.5 * controller.h {
            return;
        }
        let mut best = (order, growth(order, BIAS, error));
        if order > 1 {
            let lower = growth(order - 1, BIAS, self.error_of_order(order - 1, scale));
            if lower > best.1 {
                best = (order - 1, lower);
            }
        }
        if order < most.min(MAX_ORDER) {
            let higher = growth(order + 1, BIAS_HIGHER, self.error_of_order(order + 1, scale));
            if higher > best.1 {
                best = (order + 1, higher);
            }
        }
        let (chosen, factor) = best;
        if (WORTH_SHRINKING..WORTH_GROWING).contains(&factor) {
            return;
        }
        let BdfHistory { steps, is_resumed, .. } = self.history;
        let is_first = steps <= FIRST_STEPS && !is_resumed;
        let most_growth = if is_first { MOST_GROWTH_AT_FIRST } else { MOST_GROWTH };
        self.history.change_order(chosen);
        controller.set_order(chosen);
        controller.h = h * factor.min(most_growth);
    }

    /// Reacts to a rejected step.
    ///
    /// If the solution has changed its character, the polynomial through its values is meaningless: after a step that
    /// could not be evaluated, or several rejections, the remembered values are discarded.
    pub(super) fn shrink_or_forget(
        &mut self,
        JudgedStep { h, error }: JudgedStep,
        controller: &mut Controller,
    ) {
        let history = &mut self.history;
        history.rejections += 1;
        let most = if history.rejections == 1 { LEAST_SHRINKING } else { SHRINKING_AGAIN };
        let factor = if error.is_finite() { growth(history.order, BIAS, error) } else { 0.0 };
        controller.h = h * factor.clamp(MOST_SHRINKING, most);
        let has_memory = !history.is_at_beginning();
        if has_memory && (!error.is_finite() || history.rejections >= MOST_REJECTIONS) {
            self.restart();
            self.history.is_resumed = true;
        }
    }

    /// Square of the error that a step of this order would have made.
    fn error_of_order(&self, order: usize, scale: &ErrorScale<'_, S>) -> f64 {
        let square = error_constant(order) * error_constant(order);
        square * scale.square(self.k[order + 1].as_ref(), |d| d.v[order + 1].as_ref())
    }
}
