//! Step-size control.

/// How a family's steps are controlled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ControlLaw {
    /// Predictive control, for methods with which changing the step size costs little.
    Predictive,
    /// Proportional and integral control: smoother steps at the limit of stability.
    ///
    /// ```text
    ///   accepted:  h ← h · clamp(0.9 e^(0.75 β − 1/k) e₋₁^β, 0.2, 6)
    /// ```
    ProportionalIntegral {
        /// β.
        beta: f64,
    },
    /// Equal steps, whose size the family itself changes.
    Piecewise,
}

/// Step-size controller. With [`ControlLaw::Predictive`]:
///
/// ```text
///   accepted:  h ← h · clamp(0.9 e^(−1/k) min(1, (h/h₋₁) (e₋₁/e)^(1/k)), 0.2, 6)
///   rejected:  h ← h · clamp(0.9 e^(−1/k), 0.1, 0.9), and no growth in the step after
/// ```
///
/// e is the error in units of the tolerance, h₋₁ and e₋₁ are those of the previous accepted step, k = 1 + order of the
/// error estimate. Errors that rise from step to step are expected to keep rising.
///
/// The natural step size carries over between segments of smooth inputs: a step that a segment's end made much shorter
/// does not change it, unless its error shows that it was too large.
///
/// # Source
///
/// Gustafsson, Control-theoretic techniques for stepsize selection in implicit Runge–Kutta methods,
/// ACM Transactions on Mathematical Software 20 (1994) 496–517; as in Hairer and Wanner, Solving
/// Ordinary Differential Equations II, 2nd ed. (1996), §IV.8.
#[derive(Debug, Clone)]
pub(crate) struct Controller {
    law: ControlLaw,
    /// The natural step size.
    pub(crate) h: f64,
    /// 1/k.
    exponent: f64,
    /// The previous accepted step; `None` before the first one and after a step that was cut.
    previous: Option<AcceptedStep>,
    rejected: bool,
    /// Of the last step that was cut: its fraction of the natural step, and the square of the error up to which the
    /// natural step is still good.
    cut: (f64, f64),
}

/// An accepted step.
#[derive(Debug, Clone, Copy)]
struct AcceptedStep {
    h: f64,
    /// e², and e^(−1/k).
    error: f64,
    root: f64,
}

pub(crate) const SAFETY: f64 = 0.9;
pub(crate) const MOST_GROWTH: f64 = 6.0;
pub(crate) const LEAST_AFTER_ACCEPTANCE: f64 = 0.2;
pub(crate) const LEAST_AFTER_REJECTION: f64 = 0.1;
/// The same if slopes agree.
const LEAST_BY_SLOPE: f64 = 1e-3;
/// Errors below this (squared) let the step grow by the maximum.
pub(crate) const NEGLIGIBLE: f64 = 1e-12;
/// Lower bound on the previous error (squared) in proportional and integral control.
pub(crate) const REMEMBERED: f64 = 1e-8;
/// A step this much shorter than the natural one was cut by a segment's end.
pub(crate) const CUT: f64 = 0.5;

impl Controller {
    pub(crate) fn new(h: f64, estimate_order: u32, law: ControlLaw) -> Self {
        let exponent = 1.0 / f64::from(estimate_order + 1);
        Self { law, h, exponent, previous: None, rejected: false, cut: (0.0, 0.0) }
    }

    /// Changes the order of the error estimate.
    pub(crate) fn set_order(&mut self, estimate_order: usize) {
        self.exponent = 1.0 / (estimate_order + 1) as f64;
        self.cut = (0.0, 0.0);
    }

    /// The next step if `remaining` is left of the segment: equal steps up to its end.
    #[inline]
    pub(crate) fn propose(&self, remaining: f64) -> f64 {
        let ratio = remaining / self.h;
        // One step that exceeds the natural step by 1 % is better than two halves.
        if ratio <= 1.01 {
            remaining
        } else if self.law == ControlLaw::Piecewise && ratio > 2.0 {
            self.h
        } else {
            remaining / ratio.ceil()
        }
    }

    /// Updates the controller after an accepted step; `error` is the square of e.
    #[inline]
    pub(crate) fn accept(&mut self, tried: f64, error: f64) {
        if tried < CUT * self.h {
            // e ~ h^k: the natural step is still good if 0.9 h₀ e^(−1/k) ≥ h. Samples of a recording are equidistant,
            // so the power is cached.
            let part = tried / self.h;
            if part != self.cut.0 {
                self.cut = (part, (SAFETY * part).powf(2.0 / self.exponent));
            }
            if error > self.cut.1 {
                self.h = tried * (SAFETY * error.powf(-0.5 * self.exponent)).max(1.0);
            }
            self.rejected = false;
            self.previous = None;
            return;
        }
        let error = error.max(NEGLIGIBLE);
        let root = error.powf(-0.5 * self.exponent);
        let mut factor = SAFETY * root;
        match (self.law, self.previous) {
            (ControlLaw::Predictive, Some(previous)) if error > previous.error => {
                factor *= (tried / previous.h * (root / previous.root)).min(1.0);
            }
            (ControlLaw::ProportionalIntegral { beta }, Some(previous)) => {
                let remembered = previous.error.max(REMEMBERED);
                factor *= error.powf(0.375 * beta) * remembered.powf(0.5 * beta);
            }
            _ => {}
        }
        let factor = factor.clamp(LEAST_AFTER_ACCEPTANCE, MOST_GROWTH);
        let factor = if self.rejected { factor.min(1.0) } else { factor };
        self.h = if factor >= 1.0 { self.h.max(tried * factor) } else { tried * factor };
        self.previous = Some(AcceptedStep { h: tried, error, root });
        self.rejected = false;
    }

    /// Updates the controller after a step whose error was too large; `error` is the square of e.
    pub(crate) fn reject(&mut self, tried: f64, error: f64) {
        let factor = SAFETY * error.powf(-0.5 * self.exponent);
        self.h = tried * factor.clamp(LEAST_AFTER_REJECTION, SAFETY);
        self.rejected = true;
    }

    /// After a rejection, limits the step to `most`, but does not shrink it to zero.
    pub(crate) fn limit(&mut self, tried: f64, most: f64) {
        self.h = self.h.min(SAFETY * most.max(LEAST_BY_SLOPE * tried));
    }

    /// Updates the controller after a step that could not be evaluated.
    pub(crate) fn abandon(&mut self, tried: f64) {
        self.h = 0.25 * tried;
        self.rejected = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_step_leaves_the_natural_one_alone() {
        let mut controller = Controller::new(8.0, 4, ControlLaw::Predictive);
        controller.accept(1.0, 1e-12);
        assert_eq!(controller.h, 8.0);
        // e = 1 at h = 1 shows that h = 8 is much too large.
        controller.accept(1.0, 1.0);
        assert_eq!(controller.h, 1.0);
    }

    #[test]
    fn segments_of_equal_length_keep_the_natural_step_while_errors_allow_it() {
        // e ~ h⁵ with e = 1 at h = 16, so that steps of 9 are good.
        let mut controller = Controller::new(9.0, 4, ControlLaw::Predictive);
        for _ in 0..100 {
            assert_eq!(controller.propose(1.0), 1.0);
            controller.accept(1.0, (1.0_f64 / 16.0).powi(10));
        }
        assert_eq!(controller.h, 9.0);
        // A shorter segment in between is judged by its own fraction of the natural step.
        controller.accept(0.5, (0.5_f64 / 16.0).powi(10));
        assert_eq!(controller.h, 9.0);
        controller.accept(1.0, 1.0);
        assert_eq!(controller.h, 1.0);
    }

    #[test]
    fn slopes_shorten_a_rejected_step_further_but_not_to_nothing() {
        let mut controller = Controller::new(100.0, 4, ControlLaw::Predictive);
        controller.reject(100.0, 1e8);
        let by_error = controller.h;
        controller.limit(100.0, f64::INFINITY);
        assert_eq!(controller.h, by_error);
        controller.limit(100.0, 1.0);
        assert_eq!(controller.h, SAFETY);
        controller.limit(100.0, 0.0);
        assert_eq!(controller.h, SAFETY * LEAST_BY_SLOPE * 100.0);
    }

    #[test]
    fn what_remains_is_split_equally() {
        let controller = Controller::new(1.0, 4, ControlLaw::Predictive);
        assert_eq!(controller.propose(1.0), 1.0);
        assert_eq!(controller.propose(0.3), 0.3);
        assert_eq!(controller.propose(2.5), 2.5 / 3.0);
    }

    #[test]
    fn nothing_grows_after_a_rejection() {
        let mut controller = Controller::new(1.0, 4, ControlLaw::Predictive);
        controller.reject(1.0, 16.0);
        let tried = controller.h;
        assert!(tried < 0.9);
        controller.accept(tried, 1e-20);
        assert_eq!(controller.h, tried);
        controller.accept(tried, 1e-20);
        assert_eq!(controller.h, 6.0 * tried);
    }
}
