//! Discontinuities of delayed unknowns: a delay reaches a point at which its unknown was not smooth.
//!
//! A jump of x at s, with ds/dθ, is one of x(t − τ) at s + τ, which moves by ds/dθ + ∂τ/∂θ. It is treated like a moving
//! jump of an input ([`super::moving_jump`]), and becomes a new mark of the history ([`super::history`]), one level
//! smoother.

use crate::error::IntegrateError;
use crate::integrate::delay::history::Discontinuity;
use crate::integrate::delay::moving_jump::NO_JUMP;
use crate::integrate::simulation::Simulation;
use crate::problem::Problem;
use crate::signal::Segment;
use crate::solution::{Solution, UndefinedCause, UndefinedSensitivity};
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// Marks from this level on do not change the slope of the delayed unknown.
const SMOOTH: u32 = 2;

/// The point at which a mark is reached is located to this fraction of the step.
const NARROW: f64 = 1e-13;

/// Fractions of a step, in addition to its end, at which variable delays are looked up.
const LOOKS: [f64; 3] = [0.25, 0.5, 0.75];

/// Work space at discontinuities.
pub(in crate::integrate) struct Discontinuities<S: SolvableSystem> {
    pub(in crate::integrate) before: S::Vector,
    after: S::Vector,
    /// Sensitivities of steps that read themselves; `None` without sensitivities.
    pub(in crate::integrate) s: Option<S::Sensitivity>,
}

impl<S: SolvableSystem> Discontinuities<S> {
    pub(in crate::integrate) fn new(n: usize, s: Option<S::Sensitivity>) -> Self {
        Self { before: S::Vector::zeros(n), after: S::Vector::zeros(n), s }
    }
}

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Delayed values are known from now on.
    pub(in crate::integrate) fn begin_history(&mut self) {
        if S::FEATURES.past && self.discontinuities.is_some() {
            let s = self.directions.as_ref().map(|d| d.s.as_ref());
            self.drive.begin_history(self.t, self.y.as_ref(), s, self.sizes.as_ref());
            self.make_sensitivities_consistent_with_history();
            self.linearized = false;
        }
    }

    /// The longest step that needs only known delayed values.
    #[inline]
    pub(in crate::integrate) fn reach(&self) -> f64 {
        if !S::FEATURES.past {
            return f64::INFINITY;
        }
        self.drive.history.as_ref().map_or(f64::INFINITY, |history| history.reach())
    }

    /// Time of the next discontinuity.
    #[inline]
    pub(in crate::integrate) fn next_discontinuity(&self) -> f64 {
        if !S::FEATURES.past {
            return f64::INFINITY;
        }
        self.drive.history.as_ref().map_or(f64::INFINITY, |history| history.next_discontinuity())
    }

    /// Passes the current discontinuities, one after another.
    #[inline]
    pub(in crate::integrate) fn pass_discontinuities(
        &mut self,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        if !S::FEATURES.past {
            return Ok(());
        }
        while let Some(at) = self.drive.history.as_ref().and_then(|h| h.discontinuity_at(self.t)) {
            let Some(mut work) = self.discontinuities.take() else { return Ok(()) };
            let passed = self.pass(&at, &mut work, solution);
            self.discontinuities = Some(work);
            passed?;
        }
        Ok(())
    }

    fn pass(
        &mut self,
        at: &Discontinuity,
        work: &mut Discontinuities<S>,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        self.linearized = false;
        if at.level >= SMOOTH {
            self.drive.pass(at, self.t, self.y.as_ref());
            self.mark(at.level + 1, &at.dt);
            return Ok(());
        }
        self.rates(&mut work.before);
        let mut dt = at.dt.clone();
        if let Some(delay) = at.varying {
            self.move_with_delay(delay, &mut work.after, &mut dt, solution);
        }
        self.begin_moving_jump(&dt, solution);
        self.change_inputs(solution, |drive, t, y| drive.pass(at, t, y))?;
        self.rates(&mut work.after);
        self.move_sensitivities(&work.before, &work.after, &dt, solution)?;
        self.settle(solution)?;
        self.mark(at.level + 1, &dt);
        Ok(())
    }

    /// Converts the derivatives of the time of a mark to those of the time at which a variable delay reaches it, with
    /// α = t − τ:
    ///
    /// ```text
    ///   α(t_b, y(t_b)) = s:   dt_b/dθ = (ds/dθ + dτ/dθ) / (1 − τ̇),   τ̇ = ∂τ/∂y ẏ + ∂τ/∂t + ∂τ/∂u u̇
    /// ```
    ///
    /// `ydot` is work space.
    fn move_with_delay(
        &mut self,
        delay: usize,
        ydot: &mut S::Vector,
        dt: &mut [f64],
        solution: &mut Solution,
    ) {
        let Problem { system, p, .. } = *self.problem;
        if self.directions.is_none() {
            return;
        }
        let has_rates = self.take_rates(ydot, solution);
        let Some(d) = &self.directions else { return };
        let signature = system.signature();
        let (n, n_tau) = (signature.unknowns.len(), signature.varying_delays.len());
        let (mut dtau, mut by_y) = (vec![0.0; n_tau * dt.len()], vec![0.0; n_tau * n]);
        let mut by_t = vec![0.0; n_tau];
        let (u, udot) = self.drive.with_slope(self.t, self.y.as_ref());
        let point = EvaluationPoint { t: self.t, y: self.y.as_ref(), u, p, z: self.discrete.z() };
        let s = d.s.as_ref();
        system.varying_delay_sensitivities(point, udot, s, &mut dtau, &mut by_y, &mut by_t);
        let along_y = ydot.as_ref().iter().enumerate().map(|(i, f)| by_y[i * n_tau + delay] * f);
        let rate = 1.0 - by_t[delay] - along_y.sum::<f64>();
        if !has_rates || rate == 0.0 || !rate.is_finite() {
            // The delay only touches the mark: a perturbed solution may not reach it.
            let (from, until) = (self.t, self.t);
            let equation = format!("delay by {}", signature.varying_delays[delay]);
            let cause = UndefinedCause::Grazing;
            solution.undefined.push(UndefinedSensitivity { from, until, equation, cause });
            self.directions = None;
            return;
        }
        for (dt, column) in dt.iter_mut().zip(dtau.chunks_exact(n_tau)) {
            *dt = (*dt + column[delay]) / rate;
        }
    }

    /// ẏ of all unknowns, from 0 = ∂f_a/∂y ẏ + df_a/dt for the algebraic ones. Returns whether these have one.
    fn take_rates(&mut self, ydot: &mut S::Vector, solution: &mut Solution) -> bool {
        self.linearize_values();
        ydot.as_mut().copy_from_slice(self.stepper.f.as_ref());
        let pattern = &self.problem.system.signature().jacobian;
        let (jacobian, dfdt) = (self.stepper.jacobian.as_ref(), self.stepper.dfdt.as_ref());
        solution.statistics.factorisations += usize::from(!self.algebraic.is_empty());
        let sizes = self.sizes.as_ref();
        self.algebraic.rates(pattern, jacobian, ydot.as_mut(), dfdt, sizes).is_ok()
    }

    /// Locates where a variable delay reaches a mark before the end of the last tried step, to `t_new`, so that the
    /// next step ends there. Returns whether one does.
    #[inline]
    pub(in crate::integrate) fn reaches_mark(&mut self, t_new: f64) -> bool {
        if !S::FEATURES.past {
            return false;
        }
        if self.drive.history.as_ref().is_none_or(|history| history.stops_by(t_new)) {
            return false;
        }
        if !self.drive.has_varying_delays() {
            return false;
        }
        self.stepper.prepare_dense(self.y.as_ref(), None);
        let h = t_new - self.t;
        // A delay may pass a mark and come back.
        let within = LOOKS.into_iter().find_map(|part| Some((part, self.passed_within(part, h)?)));
        let first = within.or_else(|| {
            let passed = self.drive.passed_mark(t_new, self.stepper.y_new.as_ref());
            passed.map(|passed| (1.0, passed))
        });
        let Some((mut high, (mut lag, mut back))) = first else { return false };
        let mut low = 0.0;
        while high - low > NARROW {
            let middle = 0.5 * (low + high);
            if let Some(passed) = self.passed_within(middle, h) {
                high = middle;
                (lag, back) = passed;
            } else {
                low = middle;
            }
        }
        if let Some(history) = &mut self.drive.history {
            history.stop_at((self.t + high * h).min(t_new), lag, back);
        }
        true
    }

    /// The variable delay that has passed a mark at this fraction of the last tried step, of size h.
    fn passed_within(&mut self, part: f64, h: f64) -> Option<(usize, bool)> {
        self.stepper.interpolate(part, self.y.as_ref(), self.row.as_mut());
        self.drive.passed_mark(self.t + part * h, self.row.as_ref())
    }

    /// Marks the current time as a point at which a derivative of the solution jumps.
    #[inline]
    pub(in crate::integrate) fn mark(&mut self, level: u32, dt: &[f64]) {
        if !S::FEATURES.past {
            return;
        }
        let s = self.directions.as_ref().map(|d| d.s.as_ref());
        if let Some(history) = &mut self.drive.history {
            history.mark(self.t, level, dt, self.y.as_ref(), s);
        }
        self.drive.locate_delays(self.t, self.y.as_ref());
    }

    /// Level of the mark at the start of a segment: a kink if an input jumps, smoother if one only kinks.
    #[inline]
    pub(in crate::integrate) fn level_of(&mut self, segment: Segment<'_>) -> u32 {
        if !S::FEATURES.past || self.drive.history.is_none() {
            return 0;
        }
        let n = self.problem.system.signature().past().first;
        let before = &self.drive.evaluate(self.t, self.y.as_ref())[..n];
        let jumps = before
            .iter()
            .zip(segment.u)
            .any(|(left, right)| (right - left).abs() > NO_JUMP * left.abs().max(right.abs()));
        if jumps { 1 } else { 2 }
    }

    /// Marks the instant of a change of mode or of a condition on time.
    pub(in crate::integrate) fn mark_instant(&mut self) {
        if !S::FEATURES.past {
            return;
        }
        let s = self.directions.as_ref().map(|d| d.s.as_ref());
        if let Some(history) = &mut self.drive.history {
            history.mark(self.t, 1, &self.discrete.saltation.tau, self.y.as_ref(), s);
        }
        self.drive.locate_delays(self.t, self.y.as_ref());
    }
}
