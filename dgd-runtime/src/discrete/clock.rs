//! Clocks, which tick at the times t₀ + k T.

use crate::system::Discrete;

/// Times that differ by less than this, relative to their size, count as equal: the rounding of a product and a sum.
const ONE_TIME: f64 = 4.0 * f64::EPSILON;

/// The clocks of a model after a start.
#[derive(Debug, Clone, Default)]
pub(crate) struct Clocks {
    all: Vec<Ticking>,
    /// Times of other events, ascending: ticks within rounding of one are moved onto it.
    marks: Vec<f64>,
    /// Time of the next tick of any of them, s.
    next: f64,
}

/// A clock after a start.
#[derive(Debug, Clone, Copy)]
struct Ticking {
    /// Its first condition.
    condition: usize,
    automaton: Option<usize>,
    first: f64,
    period: f64,
    /// ⌊(t − t₀)/T⌋ just after t.
    count: f64,
    /// The number of the next tick, and its time.
    next: f64,
    at: f64,
    /// Whether it ticks where the run starts.
    begins: bool,
}

/// A tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tick {
    /// The first condition of the clock; the second gives the period.
    pub(crate) condition: usize,
    /// The automaton that acts.
    pub(crate) automaton: Option<usize>,
    /// k of t₀ + k T.
    pub(crate) number: f64,
    /// The discrete number of the condition from then on.
    pub(crate) count: f64,
}

impl Clocks {
    /// The clocks of a run that starts at `from`, given the conditions' times and their values afterwards.
    pub(super) fn new(discrete: &Discrete, times: &[f64], after: &[f64], from: f64) -> Self {
        let ticking = |clock: &crate::system::Clock| {
            let (first, period) = (times[clock.condition], times[clock.condition + 1]);
            Ticking {
                condition: clock.condition,
                automaton: clock.automaton,
                ..Ticking::new(first, period, after[clock.condition], from)
            }
        };
        let all = discrete.clocks.iter().map(ticking).collect();
        let mut clocks = Clocks { all, marks: Vec::new(), next: f64::INFINITY };
        clocks.find_next();
        clocks
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Whether a condition is one of the two of a clock.
    pub(super) fn has(&self, condition: usize) -> bool {
        self.all.iter().any(|one| (one.condition..one.condition + 2).contains(&condition))
    }

    /// Writes the discrete numbers of the clocks' conditions, which come first in `z`.
    pub(super) fn write(&self, z: &mut [f64]) {
        for one in &self.all {
            z[one.condition] = one.count;
        }
    }

    /// Moves ticks that are within rounding of one of these times onto it. The times ascend.
    pub(crate) fn align(&mut self, marks: Vec<f64>) {
        self.marks = marks;
        for one in &mut self.all {
            one.at = aligned(&self.marks, one.at);
        }
        self.find_next();
    }

    /// When the next clock ticks; infinity when none does.
    #[inline]
    pub(crate) fn next_time(&self) -> f64 {
        self.next
    }

    /// Ticks at the start of the run, for the automata that act at them; the count already includes them.
    pub(crate) fn first_ticks(&self) -> impl Iterator<Item = usize> {
        self.all.iter().filter(|one| one.begins).filter_map(|one| one.automaton)
    }

    /// Makes the next tick.
    pub(crate) fn tick(&mut self) -> Option<Tick> {
        let one = self.all.iter_mut().find(|one| one.at == self.next)?;
        let number = one.next;
        one.pass();
        let Ticking { condition, automaton, count, .. } = *one;
        let tick = Tick { condition, automaton, number, count };
        one.at = aligned(&self.marks, one.at);
        self.find_next();
        Some(tick)
    }

    fn find_next(&mut self) {
        self.next = self.all.iter().map(|one| one.at).fold(f64::INFINITY, f64::min);
    }
}

impl Ticking {
    /// A clock that never ticks has the count that `level` gives.
    fn new(first: f64, period: f64, level: f64, from: f64) -> Self {
        let mut clock = Ticking {
            condition: 0,
            automaton: None,
            first,
            period,
            count: level.floor(),
            next: f64::INFINITY,
            at: f64::INFINITY,
            begins: false,
        };
        if !first.is_finite() || !period.is_finite() || period == 0.0 {
            return clock;
        }
        let passed = (from - first) / period;
        let nearest = passed.round();
        clock.begins = is_one_time(first + nearest * period, from, first);
        let before = if clock.begins { nearest } else { passed.floor() };
        if period > 0.0 {
            (clock.count, clock.next) = (before, before + 1.0);
        } else {
            clock.count = if clock.begins { nearest - 1.0 } else { before };
            clock.next = clock.count;
        }
        clock.at = clock.time_of(clock.next);
        clock
    }

    fn time_of(&self, number: f64) -> f64 {
        self.first + number * self.period
    }

    /// Passes the next tick.
    fn pass(&mut self) {
        if self.period > 0.0 {
            (self.count, self.next) = (self.next, self.next + 1.0);
        } else {
            (self.count, self.next) = (self.next - 1.0, self.next - 1.0);
        }
        let next = self.time_of(self.next);
        // If the period is below rounding, time does not advance.
        self.at = if next > self.at { next } else { f64::INFINITY };
    }
}

fn is_one_time(a: f64, b: f64, other: f64) -> bool {
    (a - b).abs() <= ONE_TIME * a.abs().max(b.abs()).max(other.abs())
}

/// The mark within rounding of a time, or else the time itself.
fn aligned(marks: &[f64], t: f64) -> f64 {
    if !t.is_finite() {
        return t;
    }
    let rounding = ONE_TIME * t.abs();
    let behind = marks.partition_point(|mark| *mark < t - rounding);
    marks.get(behind).copied().filter(|mark| *mark <= t + rounding).unwrap_or(t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(first: f64, period: f64, from: f64, n: usize) -> (Vec<(f64, f64)>, f64) {
        let mut clock = Ticking::new(first, period, 0.0, from);
        let count = clock.count;
        let next = |_| {
            let t = clock.at;
            clock.pass();
            (t, clock.count)
        };
        ((0..n).map(next).collect(), count)
    }

    #[test]
    fn counts_are_the_floor_of_what_has_passed() {
        assert_eq!(ticks(0.0, 10.0, 0.0, 2), (vec![(10.0, 1.0), (20.0, 2.0)], 0.0));
        assert_eq!(ticks(3.0, 10.0, 5.0, 2), (vec![(13.0, 1.0), (23.0, 2.0)], 0.0));
        assert_eq!(ticks(3.0, 10.0, -8.0, 2), (vec![(-7.0, -1.0), (3.0, 0.0)], -2.0));
        // ⌊−t/10⌋ is −1 just after 0 and −2 just after 10.
        assert_eq!(ticks(0.0, -10.0, 0.0, 2), (vec![(10.0, -2.0), (20.0, -3.0)], -1.0));
        assert_eq!(ticks(0.0, -10.0, 5.0, 1), (vec![(10.0, -2.0)], -1.0));
        // 3 · 0.1 equals 0.3 only to rounding.
        assert_eq!(ticks(0.0, 0.1, 0.3, 1).1, 3.0);
        assert_eq!(ticks(f64::NAN, f64::INFINITY, 0.0, 1).0[0].0, f64::INFINITY);
    }

    #[test]
    fn ticks_are_where_samples_are() {
        assert_eq!(aligned(&[0.1, 0.2, 0.3], 3.0 * 0.1), 0.3);
        assert_eq!(aligned(&[0.1, 0.2, 0.3], 0.31), 0.31);
        assert_eq!(aligned(&[], 0.31), 0.31);
    }
}
