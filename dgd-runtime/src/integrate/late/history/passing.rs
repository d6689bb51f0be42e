//! Finds when delays reach marks: the discontinuities of delayed unknowns.
//!
//! For a constant delay the time is known beforehand. A variable delay is watched: if it has passed a mark at the end
//! of a step, the step must end at the mark.

use super::{Discontinuity, History, Lag, Mark, ONE_TIME, Tau};
use crate::problem::Problem;
use crate::solved::Solved;

impl History {
    /// Time of the next discontinuity; infinity if none is known yet.
    pub(in crate::integrate) fn next_discontinuity(&self) -> f64 {
        let times = self.lags.iter().filter_map(|lag| self.discontinuity_of(lag));
        let crossing = self.crossing.map_or(f64::INFINITY, |(_, t, _)| t);
        times.fold(crossing, f64::min)
    }

    fn discontinuity_of(&self, lag: &Lag) -> Option<f64> {
        let mark = self.marks.get(lag.mark - self.first_mark)?;
        Some(mark.t + lag.constant()?)
    }

    /// A discontinuity at `t`, to rounding.
    pub(in crate::integrate) fn discontinuity_at(&self, t: f64) -> Option<Discontinuity> {
        if let Some((lag, time, back)) = self.crossing
            && time <= t
        {
            let mark = self.lags[lag].mark - usize::from(back) - self.first_mark;
            let Mark { level, dt, .. } = &self.marks[mark];
            let varying = match self.lags[lag].tau {
                Tau::Constant(_) => None,
                Tau::Varying(delay) => Some(delay),
            };
            return Some(Discontinuity { lag, back, level: *level, dt: dt.clone(), varying });
        }
        let due = |lag: &Lag| {
            let tau = lag.constant().unwrap_or(0.0);
            self.discontinuity_of(lag).is_some_and(|time| time <= t + ONE_TIME * t.abs().max(tau))
        };
        let lag = self.lags.iter().position(due)?;
        let Lag { dtau, mark, .. } = &self.lags[lag];
        let mark = &self.marks[mark - self.first_mark];
        let dt = mark.dt.iter().zip(dtau).map(|(dt, dtau)| dt + dtau).collect();
        Some(Discontinuity { lag, back: false, level: mark.level, dt, varying: None })
    }

    /// Makes the delay read values after the mark.
    pub(in crate::integrate) fn pass(&mut self, at: &Discontinuity) {
        let mark = &mut self.lags[at.lag].mark;
        *mark = if at.back { *mark - 1 } else { *mark + 1 };
        self.crossing = None;
    }

    /// The first variable delay that has passed a mark at (t, y), and whether backwards.
    pub(in crate::integrate) fn passed<S: Solved>(
        &mut self,
        problem: &Problem<'_, S>,
        t: f64,
        y: &[f64],
        u: &[f64],
    ) -> Option<(usize, bool)> {
        self.look_up(problem, t, y, u);
        (0..self.lags.len()).find_map(|i| {
            let (lag, alpha) = (&self.lags[i], t - self.tau(i));
            if lag.constant().is_some() {
                return None;
            }
            let rounding = self.rounding(t);
            let next = self.marks.get(lag.mark - self.first_mark);
            let last = lag.mark.checked_sub(1 + self.first_mark).map(|mark| &self.marks[mark]);
            if next.is_some_and(|mark| alpha > mark.t + rounding) {
                Some((i, false))
            } else if last.is_some_and(|mark| alpha < mark.t - rounding) {
                Some((i, true))
            } else {
                None
            }
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
    pub(in crate::integrate) fn earliest<S: Solved>(
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
