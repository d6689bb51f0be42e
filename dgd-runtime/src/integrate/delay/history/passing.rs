//! Finds when delays reach marks: the discontinuities of delayed unknowns.
//!
//! For a constant delay the time is known beforehand. A variable delay is watched: if it has passed a mark at the end
//! of a step, the step must end at the mark.

use super::{Breakpoint, DelayHistory, DelayReads, DelayTime, Discontinuity, ONE_TIME};
use crate::problem::Problem;
use crate::solved::SolvableSystem;

impl DelayHistory {
    /// Time of the next discontinuity; infinity if none is known yet.
    pub(in crate::integrate) fn next_discontinuity(&self) -> f64 {
        let times = self.lags.iter().filter_map(|lag| self.discontinuity_of(lag));
        let crossing = self.crossing.map_or(f64::INFINITY, |(_, t, _)| t);
        times.fold(crossing, f64::min)
    }

    fn discontinuity_of(&self, lag: &DelayReads) -> Option<f64> {
        let mark = self.marks.get(lag.mark - self.first_mark)?;
        Some(mark.t + lag.constant()?)
    }

    /// A discontinuity at `t`, to rounding.
    pub(in crate::integrate) fn discontinuity_at(&self, t: f64) -> Option<Discontinuity> {
        if let Some((lag, time, back)) = self.crossing
            && time <= t
        {
            let mark = self.lags[lag].mark - usize::from(back) - self.first_mark;
            let Breakpoint { level, dt, .. } = &self.marks[mark];
            let varying = match self.lags[lag].tau {
                DelayTime::Constant(_) => None,
                DelayTime::Varying(delay) => Some(delay),
            };
            return Some(Discontinuity { lag, back, level: *level, dt: dt.clone(), varying });
        }
        let due = |lag: &DelayReads| {
            let tau = lag.constant().unwrap_or(0.0);
            self.discontinuity_of(lag).is_some_and(|time| time <= t + ONE_TIME * t.abs().max(tau))
        };
        let lag = self.lags.iter().position(due)?;
        let DelayReads { dtau, mark, .. } = &self.lags[lag];
        let mark = &self.marks[mark - self.first_mark];
        let dt = mark.dt.iter().zip(dtau).map(|(dt, dtau)| dt + dtau).collect();
        Some(Discontinuity { lag, back: false, level: mark.level, dt, varying: None })
    }

    /// Makes the delay read values on the other side of the mark, at `t`, to which delays have been looked up.
    pub(in crate::integrate) fn pass(&mut self, at: &Discontinuity, t: f64) {
        let tau = self.tau(at.lag);
        let alpha = t - tau;
        let lag = &mut self.lags[at.lag];
        let mark = lag.mark - usize::from(at.back) - self.first_mark;
        lag.mark = if at.back { lag.mark - 1 } else { lag.mark + 1 };
        if lag.constant().is_none() {
            // The step ends there to the tolerance only: such an error does not lead back.
            let tolerance = self.tolerances.rtol * tau.abs();
            let error = 2.0 * (alpha - self.marks[mark].t).abs() + tolerance;
            lag.slack = if at.back { [0.0, error] } else { [error, 0.0] };
        }
        self.crossing = None;
    }

    /// Whether variable delays read wherever they lead from now on.
    pub(in crate::integrate) fn free(&mut self, is_free: bool) {
        self.is_free = is_free;
    }

    /// Makes variable delays read where they lead at (t, y), where they may have jumped.
    pub(in crate::integrate) fn locate<S: SolvableSystem>(
        &mut self,
        problem: &Problem<'_, S>,
        t: f64,
        y: &[f64],
        u: &[f64],
    ) {
        self.look_up(problem, t, y, u);
        for lag in 0..self.lags.len() {
            if self.lags[lag].constant().is_none() {
                self.locate_lag(lag, t);
                self.lags[lag].is_none = self.tau(lag) == 0.0;
            }
        }
    }

    /// Makes a variable delay, which has been looked up, read where it leads at `t`.
    pub(super) fn locate_lag(&mut self, index: usize, t: f64) {
        let (alpha, rounding) = (t - self.tau(index), self.rounding(t));
        let lag = &self.lags[index];
        let next = self.marks.get(lag.mark - self.first_mark);
        // Without a delay it reads the piece after a mark at the current time.
        let reads_now = next.is_some_and(|mark| mark.t >= t - rounding && alpha >= t - rounding);
        if reads_now || self.left(index, alpha, rounding).is_some() {
            let reached = self.marks.partition_point(|mark| mark.t <= alpha + rounding);
            self.lags[index].mark = self.first_mark + reached;
            self.lags[index].slack = [0.0; 2];
            self.crossing = None;
        }
    }

    /// Whether α is outside the marks between which a delay reads; if so, whether it is before them.
    fn left(&self, lag: usize, alpha: f64, rounding: f64) -> Option<bool> {
        let DelayReads { mark, slack: [before, behind], .. } = self.lags[lag];
        let next = self.marks.get(mark - self.first_mark);
        let last = mark.checked_sub(1 + self.first_mark).map(|mark| &self.marks[mark]);
        if next.is_some_and(|mark| alpha > mark.t + rounding.max(behind)) {
            Some(false)
        } else if last.is_some_and(|mark| alpha < mark.t - rounding.max(before)) {
            Some(true)
        } else {
            None
        }
    }

    /// The first variable delay that has passed a mark at (t, y), and whether backwards.
    pub(in crate::integrate) fn passed<S: SolvableSystem>(
        &mut self,
        problem: &Problem<'_, S>,
        t: f64,
        y: &[f64],
        u: &[f64],
    ) -> Option<(usize, bool)> {
        self.look_up(problem, t, y, u);
        (0..self.lags.len()).find_map(|i| {
            if self.lags[i].constant().is_some() {
                return None;
            }
            self.left(i, t - self.tau(i), self.rounding(t)).map(|back| (i, back))
        })
    }

    /// Whether a step must end by `t` because a variable delay reaches a mark.
    pub(in crate::integrate) fn stops_by(&self, t: f64) -> bool {
        self.crossing.is_some_and(|(_, time, _)| time <= t)
    }

    /// Requires a step to end at `t`, where a variable delay reaches a mark.
    pub(in crate::integrate) fn stop_at(&mut self, t: f64, lag: usize, back: bool) {
        self.crossing = Some((lag, t, back));
    }

    /// The smallest variable delay, and its value.
    pub(in crate::integrate) fn earliest<S: SolvableSystem>(
        &mut self,
        problem: &Problem<'_, S>,
        t: f64,
        y: &[f64],
        u: &[f64],
    ) -> Option<(usize, f64)> {
        self.look_up(problem, t, y, u);
        let values = self.varying.iter().copied().enumerate();
        values.min_by(|(_, a), (_, b)| a.total_cmp(b))
    }

    /// Rounding error of α near `t`.
    pub(super) fn rounding(&self, t: f64) -> f64 {
        ONE_TIME * t.abs().max(self.from.abs())
    }

    /// Whether there are variable delays.
    pub(in crate::integrate) fn varies(&self) -> bool {
        !self.varying.is_empty()
    }
}
