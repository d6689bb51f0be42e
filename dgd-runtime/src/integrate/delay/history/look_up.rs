//! Looks up delayed values at a time, and writes them to their places in u.

use std::ops::Range;

use super::polynomial::BasisValues;
use super::{
    DelayHistory, DelayReads, DelayTime, DelayedRead, HistoryStart, NODES, ONE_TIME,
    PrehistoryValues,
};
use crate::problem::Problem;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, PastLayout};

/// A piece shorter than this fraction of its neighbour has no slope of its own.
const SHORT: f64 = 1e-8;

impl DelayHistory {
    /// Writes the past of delayed unknowns at (t, y) after the inputs.
    pub(in crate::integrate) fn write<S: SolvableSystem>(
        &mut self,
        problem: &Problem<'_, S>,
        t: f64,
        y: &[f64],
        u: &mut [f64],
    ) {
        self.look_up(problem, t, y, u);
        let mut past = DelayChannels::split(self.layout, u);
        for lag in 0..self.lags.len() {
            if self.is_free && self.lags[lag].constant().is_none() {
                self.locate_lag(lag, t);
            }
            let tau = self.tau(lag);
            let DelayReads { mark, is_none, .. } = self.lags[lag];
            if mark == 0 {
                self.write_origin(problem, lag, t - tau, &mut past);
            } else if tau == 0.0 && (is_none || self.lags[lag].constant().is_some()) {
                self.write_present(lag, &mut past);
            } else {
                self.write_piece(lag, t - tau, &mut past);
            }
        }
    }

    /// Evaluates the variable delays at (t, y).
    pub(super) fn look_up<S: SolvableSystem>(
        &mut self,
        problem: &Problem<'_, S>,
        t: f64,
        y: &[f64],
        u: &[f64],
    ) {
        if !self.varying.is_empty() {
            // They do not depend on discrete numbers.
            let point = EvaluationPoint { t, y, u, p: problem.p, z: &[] };
            problem.system.varying_delays(point, &mut self.varying);
        }
    }

    pub(super) fn tau(&self, lag: usize) -> f64 {
        match self.lags[lag].tau {
            DelayTime::Constant(tau) => tau,
            DelayTime::Varying(delay) => self.varying[delay],
        }
    }

    /// Writes values before the start.
    fn write_origin<S: SolvableSystem>(
        &mut self,
        problem: &Problem<'_, S>,
        lag: usize,
        alpha: f64,
        past: &mut DelayChannels<'_>,
    ) {
        let lag = &self.lags[lag];
        let alpha = alpha.min(self.from);
        if lag.reads.iter().any(|read| read.has_history) {
            let point = EvaluationPoint { t: alpha, y: &[], u: &[], p: problem.p, z: &[] };
            let PrehistoryValues { values, rates, curvatures, s, s_rates } = &mut self.before;
            problem.system.histories(point, values, rates, curvatures);
            if self.n_s > 0 {
                problem.system.history_sensitivities(point, s, s_rates);
            }
        }
        let (n_v, n_w) = (self.layout.n_v, self.watched.len());
        let has_begun = self.begun != HistoryStart::NotYet;
        for &DelayedRead { delayed: k, watched, has_history } in &lag.reads {
            past.held[k] = f64::from(u8::from(has_history || has_begun));
            if has_history {
                let PrehistoryValues { values, rates, curvatures, s, s_rates } = &self.before;
                past.set(k, [values[k], rates[k], curvatures[k]]);
                for j in (0..self.n_s).map(|j| j * n_v + k) {
                    (past.s[j], past.s_rate[j]) = (s[j], s_rates[j]);
                }
            } else {
                past.set(k, [self.origin[watched], 0.0, 0.0]);
                for j in 0..self.n_s {
                    past.s[j * n_v + k] = self.origin[(j + 1) * n_w + watched];
                    past.s_rate[j * n_v + k] = 0.0;
                }
            }
        }
    }

    /// Writes values with a delay of zero. It matters where values jump: any positive delay would read the left one.
    fn write_present(&mut self, lag: usize, past: &mut DelayChannels<'_>) {
        let lag = &self.lags[lag];
        let mark = self.marks.get(lag.mark - self.first_mark);
        for &DelayedRead { delayed: k, watched, .. } in &lag.reads {
            let left = mark.and_then(|mark| mark.left.get(watched));
            past.held[k] = f64::from(u8::from(left.is_some()));
            past.set(k, [left.copied().unwrap_or(0.0), 0.0, 0.0]);
        }
    }

    /// Writes values between two marks.
    fn write_piece(&mut self, index: usize, alpha: f64, past: &mut DelayChannels<'_>) {
        let (n, n_v, n_w) = (self.now.len(), self.layout.n_v, self.watched.len());
        let lag = &mut self.lags[index];
        let begin = self.marks[lag.mark - 1 - self.first_mark].piece;
        let behind = self.marks.get(lag.mark - self.first_mark).map(|mark| mark.piece);
        let end = behind.unwrap_or(self.first + self.ends.len());
        let ahead =
            |last: &[f64; 2]| alpha > last[1] + ONE_TIME * last[1].abs().max(self.from.abs());
        self.reads_beyond |= behind.is_none() && self.ends.last().is_none_or(ahead);
        if begin >= end {
            // The first step after the mark is not finished yet.
            for &DelayedRead { delayed: k, watched, .. } in &lag.reads {
                past.held[k] = 1.0;
                past.set(k, [self.now[watched], 0.0, 0.0]);
                for j in 0..self.n_s {
                    past.s[j * n_v + k] = self.now[(j + 1) * n_w + watched];
                    past.s_rate[j * n_v + k] = 0.0;
                }
            }
            return;
        }
        let mut piece = lag.piece.clamp(begin, end.max(begin + 1) - 1);
        while piece > begin && alpha < self.ends[piece - self.first][0] {
            piece -= 1;
        }
        while piece + 1 < end && alpha > self.ends[piece - self.first][1] {
            piece += 1;
        }
        lag.piece = piece;

        let window = begin.saturating_sub(self.first)..end - self.first;
        let (at, within) = self.extended(piece - self.first, alpha, window);
        let beyond = alpha - within;
        let sloped = self.sloped(at);
        let here = self.piece(at, within);
        let (basis, _, differences) = here;
        let (rates, per_h, rate_differences) =
            if sloped == at { here } else { self.piece(sloped, within) };
        // Beyond, the extrapolation is a straight line.
        let bent = if beyond == 0.0 { per_h * per_h } else { 0.0 };
        for &DelayedRead { delayed: k, watched, .. } in &self.lags[index].reads {
            let x = basis.read(differences, n, watched)[0];
            let [_, slope, bend] = rates.read(rate_differences, n, watched);
            past.held[k] = 1.0;
            let slope = slope * per_h;
            past.set(k, [x + slope * beyond, slope, bend * bent]);
            for j in 0..self.n_s {
                let i = (j + 1) * n_w + watched;
                let slope = rates.read(rate_differences, n, i)[1] * per_h;
                past.s[j * n_v + k] = basis.read(differences, n, i)[0] + slope * beyond;
                past.s_rate[j * n_v + k] = slope;
            }
        }
    }

    /// The piece of a window that continues to α, if that is outside the piece `evaluate`, and up to where: no further
    /// than by its own length, since polynomials grow beyond all bounds.
    fn extended(&self, at: usize, alpha: f64, window: Range<usize>) -> (usize, f64) {
        let [t0, t1] = self.ends[at];
        let length = |piece: usize| self.ends[piece][1] - self.ends[piece][0];
        let beyond = (alpha - t1).max(t0 - alpha);
        if beyond <= 0.0 || length(at) >= beyond {
            return (at, alpha);
        }
        let longer = |best: usize, other: usize| {
            let is_enough = length(best) >= beyond;
            if is_enough || length(other) <= length(best) { best } else { other }
        };
        let best = if alpha > t1 {
            (window.start..at).rev().fold(at, longer)
        } else {
            (at + 1..window.end).fold(at, longer)
        };
        let [t0, t1] = self.ends[best];
        (best, alpha.clamp(t0 - length(best), t1 + length(best)))
    }

    /// The basis of a piece at α, the reciprocal of its length, and its divided differences.
    fn piece(&self, at: usize, alpha: f64) -> (BasisValues, f64, &[f64]) {
        let n = self.now.len() * NODES.len();
        let [t0, t1] = self.ends[at];
        let per_h = if t1 > t0 { 1.0 / (t1 - t0) } else { 0.0 };
        (
            BasisValues::evaluate((alpha - t0) * per_h),
            per_h,
            &self.differences[at * n..(at + 1) * n],
        )
    }

    /// The piece to take the slope from: a neighbour if this one is so short, between two events at nearly one time,
    /// that the difference of its ends is rounding.
    fn sloped(&self, at: usize) -> usize {
        let length = |at: usize| self.ends.get(at).map_or(0.0, |[t0, t1]| t1 - t0);
        let beside = [Some(at + 1), at.checked_sub(1)].into_iter().flatten();
        beside.into_iter().find(|other| length(at) < SHORT * length(*other)).unwrap_or(at)
    }
}

/// The part of u for delayed unknowns.
struct DelayChannels<'a> {
    held: &'a mut [f64],
    value: &'a mut [f64],
    rate: &'a mut [f64],
    curvature: &'a mut [f64],
    s: &'a mut [f64],
    s_rate: &'a mut [f64],
}

impl<'a> DelayChannels<'a> {
    fn split(PastLayout { first, n_v, n_s }: PastLayout, u: &'a mut [f64]) -> Self {
        let (held, u) = u[first..].split_at_mut(n_v);
        let (value, u) = u.split_at_mut(n_v);
        let (rate, u) = u.split_at_mut(n_v);
        let (curvature, u) = u.split_at_mut(n_v);
        let (s, s_rate) = u.split_at_mut(n_v * n_s);
        Self { held, value, rate, curvature, s, s_rate }
    }

    fn set(&mut self, k: usize, [value, rate, curvature]: [f64; 3]) {
        (self.value[k], self.rate[k], self.curvature[k]) = (value, rate, curvature);
    }
}
