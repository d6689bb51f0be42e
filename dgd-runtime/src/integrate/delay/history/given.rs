//! A past that is given to a run.
//!
//! A filter that moves a model from sample to sample, and corrects its state at each, keeps the past of delayed
//! unknowns between the runs: polynomials like those of steps, with corrections that are linear between samples.

use super::polynomial::{BasisValues, divide};
use super::{Breakpoint, DelayHistory, HistoryStart, NODES, ONE_TIME};

/// The past of unknowns until now.
#[derive(Debug, Clone, PartialEq)]
pub struct PastSolution {
    /// Positions of the unknowns, ascending.
    watched: Vec<usize>,
    /// Its start, s; before that, unknowns have the first value or the history that the model gives.
    from: f64,
    /// Start and end of each piece, and its divided differences: those of all unknowns for each node.
    ends: Vec<[f64; 2]>,
    differences: Vec<f64>,
    /// Values before the first piece.
    origin: Vec<f64>,
    /// Points where it is not smooth.
    marks: Vec<PastKink>,
    /// Its sensitivities; zero in all other directions.
    seeds: Vec<HistoryPerturbation>,
}

/// A time at which the past is not smooth, with the first piece after it and the order of the derivative that jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PastKink {
    t: f64,
    piece: usize,
    level: u32,
}

/// How the past of an unknown changes with its value at one time: linearly to zero at the neighbouring independent
/// times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HatFunction {
    /// Where it reaches zero on the left; `None` if it is 1 at all earlier times.
    pub left: Option<f64>,
    /// Where it is 1.
    pub top: f64,
    /// Where it reaches zero on the right; `None` if it is 1 at all later times.
    pub right: Option<f64>,
}

/// The change of one unknown, by its position among the watched ones, in one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HistoryPerturbation {
    /// The direction.
    pub direction: usize,
    /// The unknown.
    pub unknown: usize,
    /// The change over time.
    pub hat: HatFunction,
}

impl HatFunction {
    /// The change at a time, as a fraction of that at the top.
    pub fn evaluate(self, t: f64) -> f64 {
        let part = |zero: Option<f64>| match zero {
            Some(zero) => ((t - zero) / (self.top - zero)).max(0.0),
            None => 1.0,
        };
        if t == self.top {
            1.0
        } else if t < self.top {
            part(self.left)
        } else {
            part(self.right)
        }
    }
}

impl PastSolution {
    /// A past with only the values of the unknowns at the positions `watched` at the time `known_from`.
    pub fn new(watched: Vec<usize>, from: f64, y: &[f64]) -> Self {
        let origin = watched.iter().map(|i| y[*i]).collect();
        let (ends, differences, seeds) = (Vec::new(), Vec::new(), Vec::new());
        Self {
            watched,
            from,
            ends,
            differences,
            origin,
            marks: vec![PastKink { t: from, piece: 0, level: 1 }],
            seeds,
        }
    }

    /// Positions of the unknowns, ascending.
    pub fn watched(&self) -> &[usize] {
        &self.watched
    }

    /// Time from which it is known.
    pub fn known_from(&self) -> f64 {
        self.from
    }

    /// Time until which it is known.
    pub fn until(&self) -> f64 {
        self.ends.last().map_or(self.from, |ends| ends[1])
    }

    /// Extends it from t₀ to t₁ with the values of all unknowns at each of [`NODES`].
    pub fn push<'y>(&mut self, [t0, t1]: [f64; 2], y: impl Fn(usize) -> &'y [f64]) {
        let (n, at) = (self.watched.len(), self.differences.len());
        for node in 0..NODES.len() {
            let y = y(node);
            self.differences.extend(self.watched.iter().map(|i| y[*i]));
        }
        divide(&mut self.differences[at..], n);
        self.ends.push([t0, t1]);
    }

    /// Times at which it is not smooth.
    pub fn marks(&self) -> impl Iterator<Item = f64> {
        self.marks.iter().map(|kink| kink.t)
    }

    /// Marks that the derivative of this order jumps at the end.
    pub fn mark(&mut self, level: u32) {
        self.marks.push(PastKink { t: self.until(), piece: self.ends.len(), level });
    }

    /// Adds to one unknown a `change` over time that is a straight line within each piece.
    pub fn add(&mut self, unknown: usize, change: impl Fn(f64) -> f64) {
        let n = self.watched.len();
        self.origin[unknown] += change(self.from);
        let pieces = self.differences.chunks_exact_mut(n * NODES.len());
        for ([t0, t1], differences) in self.ends.iter().zip(pieces) {
            let at_begin = change(*t0);
            differences[unknown] += at_begin;
            differences[n + unknown] += change(*t1) - at_begin;
        }
    }

    /// Value and rate of an unknown at a time; constant before the past begins.
    pub fn value(&self, unknown: usize, t: f64) -> (f64, f64) {
        let Some(last) = self.ends.len().checked_sub(1) else { return (self.origin[unknown], 0.0) };
        if t < self.from {
            return (self.origin[unknown], 0.0);
        }
        let piece = self.ends.partition_point(|[_, t1]| *t1 < t).min(last);
        let [t0, t1] = self.ends[piece];
        let len = self.watched.len() * NODES.len();
        let differences = &self.differences[piece * len..(piece + 1) * len];
        let basis = BasisValues::evaluate((t.min(t1) - t0) / (t1 - t0));
        let [x, slope, _] = basis.read(differences, self.watched.len(), unknown);
        (x, slope / (t1 - t0))
    }

    /// Drops the pieces before a time at which it was marked.
    pub fn forget_before(&mut self, t: f64) {
        let Some(first) = self.marks.iter().position(|kink| kink.t == t) else { return };
        let piece = self.marks[first].piece;
        if piece == 0 {
            return;
        }
        let n = self.watched.len();
        self.origin = (0..n).map(|i| self.differences[piece * n * NODES.len() + i]).collect();
        self.ends.drain(..piece);
        self.differences.drain(..piece * n * NODES.len());
        self.marks.drain(..first);
        for kink in &mut self.marks {
            kink.piece -= piece;
        }
        self.from = t;
    }

    /// The same past, with sensitivities.
    #[must_use]
    pub fn seeded(&self, seeds: Vec<HistoryPerturbation>) -> Self {
        Self { seeds, ..self.clone() }
    }
}

impl DelayHistory {
    /// Begins with a given past, which must be known up to the time `t`.
    pub(in crate::integrate) fn resume(&mut self, past: &PastSolution, t: f64) {
        let (n_w, n) = (self.watched.len(), self.now.len());
        let (of_past, pieces) = (past.watched.len(), past.ends.len());
        self.from = past.from;
        self.ends.clone_from(&past.ends);
        self.differences = vec![0.0; pieces * NODES.len() * n];
        for (k, unknown) in self.watched.iter().enumerate() {
            let Some(own) = past.watched.iter().position(|other| other == unknown) else {
                continue;
            };
            self.origin[k] = past.origin[own];
            for at in 0..pieces * NODES.len() {
                self.differences[at * n + k] = past.differences[at * of_past + own];
            }
            for &HistoryPerturbation { direction, hat, .. } in
                past.seeds.iter().filter(|of| of.unknown == own)
            {
                if direction >= self.n_s {
                    continue;
                }
                let column = (direction + 1) * n_w + k;
                self.origin[column] = hat.evaluate(past.from);
                for (piece, [t0, t1]) in past.ends.iter().enumerate() {
                    // A straight line.
                    let (begin, end) = (hat.evaluate(*t0), hat.evaluate(*t1));
                    let entry = piece * NODES.len() * n + column;
                    self.differences[entry] = begin;
                    self.differences[entry + n] = end - begin;
                }
            }
        }
        let mark = |&PastKink { t, piece, level }: &PastKink| Breakpoint {
            t,
            piece,
            level,
            dt: vec![0.0; self.n_s],
            left: Vec::new(),
        };
        self.marks = past.marks.iter().map(mark).collect();
        self.begun = HistoryStart::FromAPast;
        self.is_free = true;
        self.pass_all_until(t);
    }

    /// Makes each constant delay read after the last mark that it has reached.
    pub(super) fn pass_all_until(&mut self, t: f64) {
        for i in 0..self.lags.len() {
            let Some(tau) = self.lags[i].constant() else { continue };
            let rounding = ONE_TIME * t.abs().max(tau);
            let Self { marks, lags, first_mark, .. } = self;
            let reached = marks.partition_point(|mark| mark.t + tau <= t + rounding);
            lags[i].mark = *first_mark + reached;
        }
    }
}
