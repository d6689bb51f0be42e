//! Past values of unknowns, as far back as a model or its outputs read them.
//!
//! The past is no better known than the present, and samples correct both. So each row adds a copy of the delayed
//! unknowns to the variables (stochastic cloning: Roumeliotis, Burdick 2002). Between two of these *nodes* the past is
//! the model's trajectory, plus a piecewise linear perturbation:
//!
//! ```text
//!   y(s) = ŷ(s) + Σ_j hat_j(s) δ_j,   hat_j(t_i) = 1 if i = j, else 0
//!   ∂x(t_{k+1})/∂δ_j is the sensitivity to a past that has the sensitivity hat_j
//! ```
//!
//! If rows are dense, only some of them are nodes. Values beyond the longest delay are dropped.

use dgd_runtime::for_identify::{HatFunction, HistoryPerturbation, NODES, PastSolution};
use dgd_runtime::{Event, Solution};

use super::coordinates::FilterCoordinates;
use super::interval::TimeInterval;

/// Number of nodes within the longest delay.
const MOST_NODES: f64 = 60.0;
/// Margin, relative to the longest delay, for which the past is stored: delays may be estimated.
const MARGIN: f64 = 1.25;
/// Minimum number of polynomials for an interval between two rows, and their number if it has many kinks.
const PIECES: usize = 2;
const MOST_PIECES: usize = 6;
/// Jumps at events happen within this fraction of the interval.
const AT_ONCE: f64 = 1e-7;

/// The past of an estimate.
#[derive(Debug, Clone)]
pub(super) struct EstimateHistory {
    past: PastSolution,
    /// Sizes of the unknowns.
    sizes: Vec<f64>,
    /// Times of the nodes, ascending; the last is the current time.
    nodes: Vec<f64>,
}

impl EstimateHistory {
    /// The past of the unknowns at the positions `watched`; `sizes` has the sizes of all unknowns.
    pub(super) fn new(watched: &[usize], sizes: &[f64], t: f64, y: &[f64]) -> Self {
        let sizes = watched.iter().map(|i| sizes[*i]).collect();
        Self { past: PastSolution::new(watched.to_vec(), t, y), sizes, nodes: vec![t] }
    }

    pub(super) fn past(&self) -> &PastSolution {
        &self.past
    }

    /// The earliest known time.
    pub(super) fn since(&self) -> f64 {
        self.past.known_from()
    }

    /// Positions of the unknowns.
    pub(super) fn watched(&self) -> &[usize] {
        self.past.watched()
    }

    /// Sizes of the unknowns.
    pub(super) fn sizes(&self) -> &[f64] {
        &self.sizes
    }

    /// Number of variables, node by node.
    pub(super) fn len(&self) -> usize {
        self.nodes.len() * self.sizes.len()
    }

    /// Times at which a run from row to row has to return the unknowns: ends and inner nodes of polynomials, which end
    /// where a value delayed by one of `delays` reads a row, at which it has a kink, and around events.
    pub(super) fn asked(
        &self,
        delays: &[(usize, f64)],
        events: &[Event],
        over: TimeInterval,
    ) -> Vec<f64> {
        let TimeInterval { from, until } = over;
        let apart = (until - from) / (MOST_PIECES * PIECES) as f64;
        let kinks = delays.iter().flat_map(|(_, tau)| self.past.marks().map(move |t| t + tau));
        let mut ends: Vec<f64> =
            kinks.filter(|t| (from + apart..until - apart).contains(t)).collect();
        ends.sort_by(f64::total_cmp);
        ends.dedup_by(|later, t| *later < *t + apart);
        ends.truncate(MOST_PIECES - PIECES);
        let about = AT_ONCE * (until - from);
        for event in events {
            let sides = [event.t - about, event.t + about];
            if from < sides[0] && sides[1] < until {
                ends.retain(|t| !(sides[0] - apart..sides[1] + apart).contains(t));
                ends.extend(sides);
            }
        }
        ends.sort_by(f64::total_cmp);
        ends.dedup_by(|later, t| *later <= *t);
        if ends.is_empty() {
            ends.extend((1..PIECES).map(|k| from + (until - from) * k as f64 / PIECES as f64));
        }
        let mut times = vec![from];
        let mut begin = from;
        for end in ends.into_iter().chain([until]) {
            times.extend(inner_nodes().map(|part| begin + (end - begin) * part));
            times.push(end);
            begin = end;
        }
        times
    }

    /// Continues with a run over the [`asked`](Self::asked) times.
    pub(super) fn go_on(&mut self, run: &Solution) {
        let rows = NODES.len() - 1;
        let about = AT_ONCE * (run.times[run.len() - 1] - run.times[0]);
        for piece in 0..(run.len() - 1) / rows {
            let row = |part: f64| {
                let before = NODES.iter().filter(|other| **other < part).count();
                piece * rows + before
            };
            let [mut begin, mut end] = [0.0, 1.0].map(|end| run.times[row(end)]);
            let is_within = |event: &&Event| begin < event.t && event.t < end;
            if end - begin < 3.0 * about && run.events.iter().any(|event| is_within(&event)) {
                continue;
            }
            // Times around an event belong to the polynomials next to it.
            begin = self.past.until();
            let next = run.events.iter().find(|event| (event.t - end - about).abs() < 0.5 * about);
            if let Some(event) = next {
                end = event.t;
            }
            self.past.push([begin, end], |node| run.y(row(NODES[node])));
            if next.is_some() {
                self.past.mark(0);
            }
        }
        self.add_node();
    }

    /// Continues with the last value if the interval is unknown.
    pub(super) fn hold(&mut self, until: f64) {
        let from = self.past.until();
        let n = self.watched().iter().max().map_or(0, |last| last + 1);
        let mut y = vec![0.0; n];
        for (k, i) in self.watched().to_vec().into_iter().enumerate() {
            y[i] = self.past.value(k, from).0;
        }
        self.past.push([from, until], |_| &y);
        self.add_node();
    }

    fn add_node(&mut self) {
        self.past.mark(1);
        self.nodes.push(self.past.until());
    }

    /// Drops values more than `reach` before the current time, and superfluous nodes. Returns the positions of their
    /// variables, ascending.
    pub(super) fn forget(&mut self, reach: f64) -> Vec<usize> {
        let n = self.nodes.len();
        let present = self.nodes[n - 1];
        let old = self.nodes.partition_point(|t| *t < present - MARGIN * reach).saturating_sub(1);
        let mut gone: Vec<usize> = (0..old).collect();
        // The last but one, if it is close to the one before.
        if n >= old + 3 && self.nodes[n - 2] - self.nodes[n - 3] < reach / MOST_NODES {
            gone.push(n - 2);
        }
        self.past.forget_before(self.nodes[old]);
        for node in gone.iter().rev() {
            self.nodes.remove(*node);
        }
        let each = self.sizes.len();
        gone.iter().flat_map(|node| node * each..(node + 1) * each).collect()
    }

    fn hat(&self, node: usize) -> HatFunction {
        let node_time = |node: usize| self.nodes.get(node).copied();
        let left = node.checked_sub(1).and_then(node_time);
        HatFunction { left, top: self.nodes[node], right: node_time(node + 1) }
    }

    /// Derivatives of one of the unknowns at a time with respect to each variable: positions and weights.
    pub(super) fn weights(&self, unknown: usize, t: f64) -> Vec<(usize, f64)> {
        let each = self.sizes.len();
        let weights = (0..self.nodes.len())
            .map(|node| (node * each + unknown, self.hat(node).evaluate(t) * self.sizes[unknown]));
        weights.filter(|(_, weight)| *weight != 0.0).collect()
    }

    /// Value and rate of one of the unknowns at a time.
    pub(super) fn value(&self, unknown: usize, t: f64) -> (f64, f64) {
        self.past.value(unknown, t)
    }

    /// Positions of the variables that `delays`, pairs of unknown and delay, read between two times.
    pub(super) fn read_between(&self, delays: &[(usize, f64)], over: TimeInterval) -> Vec<usize> {
        let TimeInterval { from, until } = over;
        let each = self.sizes.len();
        let is_read = |variable: &usize| {
            let HatFunction { left, right, .. } = self.hat(variable / each);
            delays.iter().any(|&(unknown, tau)| {
                unknown == variable % each
                    && left.is_none_or(|left| until - tau > left)
                    && right.is_none_or(|right| from - tau < right)
            })
        };
        (0..self.len()).filter(is_read).collect()
    }

    /// The past with the sensitivity to one variable in each direction, SI.
    pub(super) fn seeded(&self, variables: &[usize]) -> PastSolution {
        let each = self.sizes.len();
        let seeds = variables.iter().enumerate().map(|(direction, variable)| HistoryPerturbation {
            direction,
            unknown: variable % each,
            hat: self.hat(variable / each),
        });
        self.past.seeded(seeds.collect())
    }

    /// Moves the past by steps of its variables.
    pub(super) fn correct(&mut self, steps: &[f64]) {
        let (each, nodes) = (self.sizes.len(), &self.nodes);
        for (unknown, size) in self.sizes.iter().enumerate() {
            let step = |node: usize| steps[node * each + unknown] * size;
            self.past.add(unknown, |t| {
                let right = nodes.partition_point(|node| *node < t).min(nodes.len() - 1);
                let Some(left) = right.checked_sub(1) else { return step(0) };
                let part = ((t - nodes[left]) / (nodes[right] - nodes[left])).min(1.0);
                step(left) + part * (step(right) - step(left))
            });
        }
    }

    /// Sets the end to the states given by the variables.
    pub(super) fn end_at(&mut self, coordinates: &FilterCoordinates, variables: &[f64]) {
        let mut steps = vec![0.0; self.len()];
        let present = *self.nodes.last().unwrap_or(&0.0);
        for unknown in 0..self.sizes.len() {
            let state = coordinates.states.iter().position(|i| *i == self.watched()[unknown]);
            let Some(state) = state else { continue };
            let value = coordinates.value(state, variables[state]);
            let last = steps.len() - self.sizes.len() + unknown;
            steps[last] = (value - self.past.value(unknown, present).0) / self.sizes[unknown];
        }
        self.correct(&steps);
    }
}

/// Nodes between the ends, ascending.
fn inner_nodes() -> impl Iterator<Item = f64> {
    let mut inner: Vec<f64> = NODES.into_iter().filter(|part| *part > 0.0 && *part < 1.0).collect();
    inner.sort_by(f64::total_cmp);
    inner.into_iter()
}
