//! Discontinuities of delayed unknowns: a delay reaches a point at which its unknown was not smooth.
//!
//! A jump of x at s, with ds/dθ, is one of x(t − τ) at s + τ, which moves by ds/dθ + ∂τ/∂θ. It is treated like a moving
//! jump of an input ([`super::moving_jump`]), and becomes a new mark of the history ([`super::history`]), one level
//! smoother.

use crate::error::IntegrateError;
use crate::integrate::drive::Drive;
use crate::integrate::late::history::Discontinuity;
use crate::integrate::late::moving_jump::NO_JUMP;
use crate::integrate::simulation::Simulation;
use crate::problem::Problem;
use crate::signal::Segment;
use crate::solution::{Solution, UndefinedCause, UndefinedSensitivity};
use crate::solved::Solved;
use crate::system::{Point, Storage};

/// Marks from this level on do not change the slope of the delayed unknown.
const SMOOTH: u32 = 2;

/// The point at which a mark is reached is located to this fraction of the step.
const NARROW: f64 = 1e-13;

/// Work space at discontinuities.
pub(in crate::integrate) struct Discontinuities<S: Solved> {
    pub(in crate::integrate) before: S::Vector,
    after: S::Vector,
    /// Sensitivities of steps that read themselves; `None` without sensitivities.
    pub(in crate::integrate) s: Option<S::Sensitivity>,
}

impl<S: Solved> Discontinuities<S> {
    pub(in crate::integrate) fn new(n: usize, s: Option<S::Sensitivity>) -> Self {
        Self { before: S::Vector::zeros(n), after: S::Vector::zeros(n), s }
    }
}

impl<S: Solved> Simulation<'_, S> {
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
        let pass = |drive: &mut Drive<'_, S>| {
            if let Some(history) = &mut drive.history {
                history.pass(at);
            }
        };
        if at.level >= SMOOTH {
            pass(&mut self.drive);
            self.mark(at.level + 1, &at.dt);
            return Ok(());
        }
        self.rates(&mut work.before);
        let mut dt = at.dt.clone();
        if let Some(delay) = at.varying {
            self.move_with_delay(delay, &work.before, &mut dt, solution);
        }
        self.begin_moving_jump(&dt, solution);
        self.change_inputs(solution, pass)?;
        self.rates(&mut work.after);
        self.move_sensitivities(&work.before, &work.after, &dt, solution)?;
        self.settle(solution)?;
        self.mark(at.level + 1, &dt);
        Ok(())
    }

    /// Converts the derivatives of the time of a mark to those of the time at which a variable delay reaches it, with α
    /// = t − τ and ẏ = f:
    ///
    /// ```text
    ///   α(t_b, y(t_b)) = s:   dt_b/dθ = (ds/dθ + dτ/dθ) / (1 − τ̇),   τ̇ = ∂τ/∂y ẏ + ∂τ/∂t + ∂τ/∂u u̇
    /// ```
    fn move_with_delay(
        &mut self,
        delay: usize,
        f: &S::Vector,
        dt: &mut [f64],
        solution: &mut Solution,
    ) {
        let Problem { system, p, .. } = *self.problem;
        let Some(d) = &self.directions else { return };
        let signature = system.signature();
        let (n, n_tau) = (signature.unknowns.len(), signature.varying_delays.len());
        let (mut dtau, mut by_y) = (vec![0.0; n_tau * dt.len()], vec![0.0; n_tau * n]);
        let mut by_t = vec![0.0; n_tau];
        let (u, udot) = self.drive.with_slope(self.t, self.y.as_ref());
        let at = Point { t: self.t, y: self.y.as_ref(), u, p, z: self.discrete.z() };
        let s = d.s.as_ref();
        system.varying_delay_sensitivities(at, udot, s, &mut dtau, &mut by_y, &mut by_t);
        let along_y = f.as_ref().iter().enumerate().map(|(i, f)| by_y[i * n_tau + delay] * f);
        let rate = 1.0 - by_t[delay] - along_y.sum::<f64>();
        if rate == 0.0 || !rate.is_finite() {
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
        let Some((mut lag, mut back)) = self.drive.passed_mark(t_new, self.stepper.y_new.as_ref())
        else {
            return false;
        };
        self.stepper.prepare_dense(self.y.as_ref(), None);
        let (mut low, mut high) = (0.0, 1.0);
        let h = t_new - self.t;
        while high - low > NARROW {
            let middle = 0.5 * (low + high);
            self.stepper.interpolate(middle, self.y.as_ref(), self.row.as_mut());
            let t = self.t + middle * h;
            if let Some(passed) = self.drive.passed_mark(t, self.row.as_ref()) {
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
    }

    /// Level of the mark at the start of a segment: a kink if an input jumps, smoother if one only kinks.
    #[inline]
    pub(in crate::integrate) fn level_of(&mut self, segment: Segment<'_>) -> u32 {
        if !S::FEATURES.past || self.drive.history.is_none() {
            return 0;
        }
        let n = self.problem.system.signature().past().first;
        let before = &self.drive.at(self.t, self.y.as_ref())[..n];
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
    }
}
