//! Clocks, which tick at the times t₀ + x T.

use crate::system::{Clock, Discrete};

/// Times that differ by less than this, relative to their size, count as equal: the rounding of a product and a sum.
const ONE_TIME: f64 = 4.0 * f64::EPSILON;

/// The clocks of a model after a start.
#[derive(Debug, Clone, Default)]
pub(crate) struct StartedClocks {
    /// Those that drive automata last, each in the order of the model: expressions have their values of an instant
    /// before anything acts in it.
    all: Vec<StartedClock>,
    /// Times of other events, ascending: ticks within rounding of one are moved onto it.
    known: Vec<f64>,
    /// Time of the next tick of any of them, s.
    next: f64,
}

/// A clock after a start.
#[derive(Debug, Clone)]
struct StartedClock {
    clock: Clock,
    first: f64,
    period: f64,
    /// The clock's discrete number.
    count: f64,
    /// Time of the next tick.
    at: f64,
    /// Whether it ticks where the run starts.
    begins: bool,
}

/// A tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ClockTick {
    /// The first condition of the clock; the second gives the period.
    pub(crate) condition: usize,
    /// The automaton that acts.
    pub(crate) automaton: Option<usize>,
    /// x of t₀ + x T.
    pub(crate) number: f64,
    /// The discrete number of the condition from then on.
    pub(crate) count: f64,
}

impl StartedClocks {
    /// The clocks of a run that starts at `from`, given the conditions' times and their values afterwards.
    pub(super) fn new(discrete: &Discrete, times: &[f64], after: &[f64], from: f64) -> Self {
        let ticking = |clock: &Clock| {
            let mut one = StartedClock::new(clock.clone());
            one.place(
                times[clock.condition],
                times[clock.condition + 1],
                after[clock.condition],
                from,
            );
            one
        };
        let mut ticking_clocks: Vec<StartedClock> = discrete.clocks.iter().map(ticking).collect();
        ticking_clocks.sort_by_key(|one| one.clock.automaton.is_some());
        let mut clocks =
            StartedClocks { all: ticking_clocks, known: Vec::new(), next: f64::INFINITY };
        clocks.find_next();
        clocks
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Whether times of some depend on discrete numbers.
    pub(super) fn follow(&self) -> bool {
        self.all.iter().any(|one| one.clock.follows)
    }

    /// Whether a condition is one of the two of a clock.
    pub(super) fn has(&self, condition: usize) -> bool {
        self.all
            .iter()
            .any(|one| (one.clock.condition..one.clock.condition + 2).contains(&condition))
    }

    /// Writes the discrete numbers of the clocks' conditions, which come first in `z`.
    pub(super) fn write(&self, z: &mut [f64]) {
        for one in &self.all {
            z[one.clock.condition] = one.count;
        }
    }

    /// Places the conditions that follow others again, given the conditions' times and values. Returns whether that
    /// changes a discrete number.
    pub(super) fn place_again(&mut self, times: &[f64], after: &[f64], t: f64) -> bool {
        let mut changes = false;
        for one in self.all.iter_mut().filter(|one| one.clock.follows) {
            let (before, k) = (one.count, one.clock.condition);
            one.place(times[k], times[k + 1], after[k], t);
            one.at = aligned(&self.known, one.at);
            changes |= one.count != before;
        }
        self.find_next();
        changes
    }

    /// Moves ticks that are within rounding of one of these times onto it. The times ascend.
    pub(super) fn align(&mut self, known: Vec<f64>) {
        self.known = known;
        for one in &mut self.all {
            one.at = aligned(&self.known, one.at);
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
        self.all.iter().filter(|one| one.begins).filter_map(|one| one.clock.automaton)
    }

    /// Makes the next tick.
    pub(crate) fn tick(&mut self) -> Option<ClockTick> {
        let one = self.all.iter_mut().find(|one| one.at == self.next)?;
        let number = one.number(one.next_index())?;
        one.pass();
        let (condition, automaton, count) = (one.clock.condition, one.clock.automaton, one.count);
        one.at = aligned(&self.known, one.at);
        self.find_next();
        Some(ClockTick { condition, automaton, number, count })
    }

    /// Ticks within rounding of the next one are at the same time.
    fn find_next(&mut self) {
        self.next = self.all.iter().map(|one| one.at).fold(f64::INFINITY, f64::min);
        for one in &mut self.all {
            if is_one_time(one.at, self.next, 0.0) {
                one.at = self.next;
            }
        }
    }
}

impl StartedClock {
    fn new(clock: Clock) -> Self {
        let (first, period, count) = (f64::NAN, f64::NAN, 0.0);
        Self { clock, first, period, count, at: f64::INFINITY, begins: false }
    }

    /// Puts it where it is at t; `level` is x if it never ticks.
    fn place(&mut self, first: f64, period: f64, level: f64, t: f64) {
        (self.first, self.period) = (first, period);
        (self.begins, self.at) = (false, f64::INFINITY);
        if !first.is_finite() || !period.is_finite() || period == 0.0 {
            self.count = self.count_at(level);
            return;
        }
        self.count = self.count_at((t - first) / period);
        // The tick at t may be that before or that after x, which is rounded.
        let rises = self.rises();
        let last = self.last_index();
        let mut here = [last - 1.0, last, last + 1.0].into_iter().filter(|k| self.is_at(*k, t));
        let tick = if rises { here.next_back() } else { here.next() };
        if let Some(tick) = tick {
            self.begins = true;
            self.count += tick - last - if rises { 0.0 } else { 1.0 };
        }
        if rises && self.clock.automaton.is_some() {
            self.count = self.count.max(-1.0);
        }
        self.find_time(t);
    }

    /// Whether a tick is at t.
    fn is_at(&self, index: f64, t: f64) -> bool {
        self.time_of(index).is_some_and(|tick| is_one_time(tick, t, self.first))
    }

    fn rises(&self) -> bool {
        self.period > 0.0
    }

    /// The number of ticks up to x.
    fn count_at(&self, x: f64) -> f64 {
        match &*self.clock.marks {
            [] => x.floor(),
            marks => marks.partition_point(|mark| *mark <= x) as f64,
        }
    }

    /// The last tick that is not above x, by its position among the marks or by its own number.
    fn last_index(&self) -> f64 {
        if self.clock.marks.is_empty() { self.count } else { self.count - 1.0 }
    }

    /// The next tick.
    fn next_index(&self) -> f64 {
        self.last_index() + if self.rises() { 1.0 } else { 0.0 }
    }

    /// x of a tick.
    fn number(&self, index: f64) -> Option<f64> {
        match &*self.clock.marks {
            [] => {
                (index >= 0.0 || self.clock.automaton.is_none() || !self.rises()).then_some(index)
            }
            marks => (index >= 0.0).then(|| marks.get(index as usize).copied()).flatten(),
        }
    }

    fn time_of(&self, index: f64) -> Option<f64> {
        let x = self.number(index)?;
        let exact = self.clock.exact.and_then(|exact| exact.time(x));
        Some(exact.unwrap_or_else(|| self.period.mul_add(x, self.first)))
    }

    /// Passes the next tick.
    fn pass(&mut self) {
        let now = self.at;
        self.count += if self.rises() { 1.0 } else { -1.0 };
        self.find_time(now);
    }

    /// Finds the time of the next tick after `now`; marks that are nearer than rounding are passed as one.
    fn find_time(&mut self, now: f64) {
        self.at = f64::INFINITY;
        while let Some(next) = self.time_of(self.next_index()) {
            if next > now && !is_one_time(next, now, self.first) {
                self.at = next;
                return;
            }
            // If the period is below rounding, time does not advance.
            if self.clock.marks.is_empty() {
                return;
            }
            self.count += if self.rises() { 1.0 } else { -1.0 };
        }
    }
}

/// Whether two times differ by no more than rounding errors, given that they are sums with this number.
pub(super) fn is_one_time(a: f64, b: f64, other: f64) -> bool {
    let distance = (a - b).abs();
    distance.is_finite() && distance <= ONE_TIME * a.abs().max(b.abs()).max(other.abs())
}

/// The known time within rounding of a time, or else the time itself.
pub(super) fn aligned(known: &[f64], t: f64) -> f64 {
    if !t.is_finite() {
        return t;
    }
    let rounding = ONE_TIME * t.abs();
    let behind = known.partition_point(|mark| *mark < t - rounding);
    known.get(behind).copied().filter(|mark| *mark <= t + rounding).unwrap_or(t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signature::{ExactTicks, List};

    fn clock(marks: &'static [f64], exact: Option<ExactTicks>) -> StartedClock {
        let marks = List::Borrowed(marks);
        StartedClock::new(Clock { condition: 0, automaton: None, marks, follows: false, exact })
    }

    fn ticks_of(mut clock: StartedClock, place: [f64; 3], n: usize) -> (Vec<(f64, f64)>, f64) {
        let [first, period, from] = place;
        clock.place(first, period, 0.0, from);
        let count = clock.count;
        let next = |_| {
            let t = clock.at;
            clock.pass();
            (t, clock.count)
        };
        ((0..n).map(next).collect(), count)
    }

    fn ticks(first: f64, period: f64, from: f64, n: usize) -> (Vec<(f64, f64)>, f64) {
        ticks_of(clock(&[], None), [first, period, from], n)
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
    fn marks_are_counted_one_by_one() {
        let marks = || clock(&[1.0, 2.0, 5.0], None);
        let end = (f64::INFINITY, 4.0);
        let all = vec![(1.0, 1.0), (2.0, 2.0), (5.0, 3.0), end];
        assert_eq!(ticks_of(marks(), [0.0, 1.0, 0.0], 4), (all, 0.0));
        assert_eq!(ticks_of(marks(), [10.0, 2.0, 14.0], 1), (vec![(20.0, 3.0)], 2.0));
        // −t falls through them.
        let back = vec![(-2.0, 1.0), (-1.0, 0.0)];
        assert_eq!(ticks_of(marks(), [0.0, -1.0, -4.0], 2), (back, 2.0));
        assert_eq!(ticks_of(marks(), [0.0, -1.0, -2.0], 1), (vec![(-1.0, 0.0)], 1.0));
        // Marks that are one time there are passed at once.
        let near = clock(&[1.0, 1.0 + f64::EPSILON, 2.0], None);
        assert_eq!(ticks_of(near, [1e9, 1.0, 0.0], 2).0, [(1e9 + 1.0, 2.0), (1e9 + 2.0, 3.0)]);
    }

    #[test]
    fn written_periods_do_not_drift() {
        let tenths = || clock(&[], Some(ExactTicks { first: 0, period: 1, denominator: 10 }));
        assert_eq!(ticks_of(tenths(), [0.0, 0.1, 0.25], 1).0, [(0.3, 3.0)]);
        let far = ticks_of(tenths(), [0.0, 0.1, 99_999_999.95], 2);
        assert_eq!(far, (vec![(1e8, 1e9), (100_000_000.1, 1e9 + 1.0)], 1e9 - 1.0));
    }

    #[test]
    fn ticks_that_are_one_time_are_at_one_time() {
        let mut clocks = StartedClocks::default();
        for period in [0.1, 0.1 * 3.0] {
            let mut one = clock(&[], None);
            one.place(0.0, period, 0.0, 0.0);
            clocks.all.push(one);
        }
        clocks.all[1].clock.condition = 2;
        clocks.find_next();
        for k in 1..1_000_000 {
            let t = clocks.next_time();
            let slow = clocks.tick().map(|tick| tick.condition);
            assert_eq!(slow, Some(0));
            if k % 3 == 0 {
                assert_eq!(clocks.next_time(), t, "{k}");
                assert_eq!(clocks.tick().map(|tick| tick.condition), Some(2));
            }
        }
    }

    #[test]
    fn ticks_are_where_samples_are() {
        assert_eq!(aligned(&[0.1, 0.2, 0.3], 3.0 * 0.1), 0.3);
        assert_eq!(aligned(&[0.1, 0.2, 0.3], 0.31), 0.31);
        assert_eq!(aligned(&[], 0.31), 0.31);
    }
}
