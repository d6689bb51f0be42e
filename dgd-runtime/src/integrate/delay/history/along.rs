//! Delayed values along an interval, enclosed.

use super::polynomial::NODES;
use super::{DelayHistory, ONE_TIME};
use crate::integrate::enclosure::{Interval, PolynomialCoefficients, Tube, tube_of};

impl DelayHistory {
    /// Enclosure of the number at a position of u between two times, if it is the value of an unknown with a constant
    /// delay, after the start.
    pub(in crate::integrate) fn tube(&self, position: usize, times: [f64; 2]) -> Option<Tube> {
        let values = self.layout.values();
        let k = values.contains(&position).then(|| position - values.start)?;
        let (lag, watched) = self.lags.iter().find_map(|lag| {
            let read = lag.reads.iter().find(|read| read.delayed == k)?;
            Some((lag, read.watched))
        })?;
        let tau = lag.constant().filter(|tau| *tau > 0.0)?;
        let begin = self.marks.get(lag.mark.checked_sub(self.first_mark + 1)?)?.piece;
        let behind = self.marks.get(lag.mark - self.first_mark).map(|mark| mark.piece);
        let end = behind.unwrap_or(self.first + self.ends.len());
        let pieces = begin.checked_sub(self.first)?..end.checked_sub(self.first)?;
        self.tube_of_pieces(pieces, watched, times.map(|t| t - tau))
    }

    /// A watched value between two times of these pieces.
    fn tube_of_pieces(
        &self,
        pieces: std::ops::Range<usize>,
        watched: usize,
        [from, to]: [f64; 2],
    ) -> Option<Tube> {
        let ends = self.ends.get(pieces.clone()).filter(|ends| !ends.is_empty())?;
        let first = ends.partition_point(|[_, end]| *end <= from).min(ends.len() - 1);
        let last = ends.partition_point(|[begin, _]| *begin < to).max(first + 1) - 1;
        let error = ONE_TIME * from.abs().max(to.abs());
        let (mut range, mut slopes) = (Interval::EMPTY, Interval::EMPTY);
        for (piece, [t0, t1]) in ends.iter().enumerate().take(last + 1).skip(first) {
            let begin = if piece == first { from } else { *t0 };
            let end = if piece == last { to } else { *t1 };
            let (low, high) = (begin - error, end + error);
            let here = self.tube_of_piece(pieces.start + piece, watched, [low, high])?;
            range = range.hull(here.range);
            slopes = slopes.hull(here.change / Interval::point(high - low));
        }
        let value = |piece: usize, t: f64| {
            let here = self.tube_of_piece(pieces.start + piece, watched, [t - error, t + error])?;
            Some(here.range)
        };
        let (left, right) = (value(first, from)?, value(last, to)?);
        Some(Tube::moving(left, right, range, slopes * Interval::point(to - from)))
    }

    /// A watched value between two times near a piece; `None` for one without length.
    fn tube_of_piece(&self, piece: usize, watched: usize, times: [f64; 2]) -> Option<Tube> {
        let [t0, t1] = self.ends[piece];
        let length = t1 - t0;
        if length <= 0.0 {
            return None;
        }
        let n = self.now.len();
        let first = piece * n * NODES.len();
        let coefficients = powers(|k| self.differences[first + k * n + watched]);
        let [a, b] = times.map(|t| (t - t0) / length);
        Some(tube_of(&coefficients[..NODES.len()], a, b))
    }
}

/// Newton's form with these divided differences, in powers of its variable.
fn powers(difference: impl Fn(usize) -> f64) -> PolynomialCoefficients {
    let mut c = PolynomialCoefficients::default();
    for k in (0..NODES.len()).rev() {
        // c ← c (θ − θₖ) + dₖ
        for power in (0..NODES.len()).rev() {
            let lower = if power > 0 { c[power - 1] } else { 0.0 };
            c[power] = lower - NODES[k] * c[power];
        }
        c[0] += difference(k);
    }
    c
}
