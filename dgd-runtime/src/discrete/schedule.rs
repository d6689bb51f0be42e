//! When conditions on time switch and clocks tick.

use crate::discrete::clock::{StartedClocks, aligned, is_one_time};
use crate::system::{EvaluationPoint, System};

/// The times at which conditions on time switch after a start, and the current discrete numbers.
#[derive(Debug, Clone)]
pub(crate) struct SwitchSchedule {
    pub(crate) z: Vec<f64>,
    /// Conditions that switch after the start, by time, then by group.
    switches: Vec<TimedSwitch>,
    next: usize,
    pub(crate) clocks: StartedClocks,
    n_automata: usize,
    /// Work space: times and values of all conditions.
    times: Vec<f64>,
    after: Vec<f64>,
}

/// A condition that switches.
#[derive(Debug, Clone, Copy)]
struct TimedSwitch {
    t: f64,
    /// Its position among the conditions.
    condition: usize,
    /// Its discrete number from then on.
    after: f64,
    /// The first condition whose time has the same derivatives.
    group: usize,
}

impl SwitchSchedule {
    pub(crate) fn new<S: System>(system: &S, p: &[f64], from: f64) -> Self {
        let discrete = &system.signature().discrete;
        let mut z: Vec<f64> = discrete.automata.iter().map(|a| a.start as f64).collect();
        let (n_automata, n) = (z.len(), discrete.n_time_conditions);
        z.resize(n_automata + n, 0.0);
        let (mut times, mut after) = (vec![0.0; n], vec![0.0; n]);
        system.condition_times(
            EvaluationPoint { t: from, y: &[], u: &[], p, z: &z },
            &mut times,
            &mut after,
        );
        let clocks = StartedClocks::new(discrete, &times, &after, from);
        let mut switches = Vec::new();
        for (condition, (&t, &after)) in times.iter().zip(&after).enumerate() {
            if clocks.has(condition) {
                continue;
            }
            // A NaN time never comes.
            let has_switched = t <= from || is_one_time(t, from, 0.0);
            z[n_automata + condition] = if has_switched { after } else { 1.0 - after };
            if t > from && !has_switched {
                switches.push(TimedSwitch { t, condition, after, group: 0 });
            }
        }
        clocks.write(&mut z[n_automata..]);
        let mut schedule = Self { z, switches, next: 0, clocks, n_automata, times, after };
        schedule.sort();
        schedule.follow(system, p, from);
        schedule
    }

    /// Uses the derivatives of the times, n_c × n_s by columns, to separate conditions that switch at one time but
    /// would not for other parameters: these switch one after the other.
    pub(crate) fn tell_apart(&mut self, dtimes: &[f64], n_s: usize) {
        let n = dtimes.len().checked_div(n_s).unwrap_or(0);
        let derivatives =
            |condition: usize| (0..n_s).map(move |j| dtimes[j * n + condition].to_bits());
        let earliest = |switch: &TimedSwitch| {
            (0..switch.condition)
                .find(|earlier| derivatives(*earlier).eq(derivatives(switch.condition)))
                .unwrap_or(switch.condition)
        };
        for switch in &mut self.switches {
            switch.group = earliest(switch);
        }
        self.sort();
    }

    /// Switches that are within rounding of one another are at one time.
    fn sort(&mut self) {
        let by_time = |a: &TimedSwitch, b: &TimedSwitch| a.t.total_cmp(&b.t);
        self.switches.sort_by(by_time);
        for k in 1..self.switches.len() {
            let before = self.switches[k - 1].t;
            if is_one_time(self.switches[k].t, before, 0.0) {
                self.switches[k].t = before;
            }
        }
        self.switches.sort_by(|a, b| {
            by_time(a, b).then(a.group.cmp(&b.group)).then(a.condition.cmp(&b.condition))
        });
    }

    /// Whether nothing switches or ticks.
    pub(crate) fn is_empty(&self) -> bool {
        self.switches.is_empty() && self.clocks.is_empty()
    }

    /// Moves switches within rounding errors of one of these times onto it, and ticks onto switches. The times ascend.
    pub(crate) fn align(&mut self, mut known: Vec<f64>) {
        for switch in &mut self.switches {
            switch.t = aligned(&known, switch.t);
        }
        self.sort();
        known.extend(self.switches.iter().map(|switch| switch.t));
        known.sort_by(f64::total_cmp);
        known.dedup();
        self.clocks.align(known);
    }

    /// Places clocks whose times depend on discrete numbers where they are at t. Returns whether there are any.
    pub(crate) fn follow<S: System>(&mut self, system: &S, p: &[f64], t: f64) -> bool {
        if !self.clocks.follow() {
            return false;
        }
        // A clock depends on others before it only.
        for _ in 0..=self.times.len() {
            let point = EvaluationPoint { t, y: &[], u: &[], p, z: &self.z };
            system.condition_times(point, &mut self.times, &mut self.after);
            let changes = self.clocks.place_again(&self.times, &self.after, t);
            self.clocks.write(&mut self.z[self.n_automata..]);
            if !changes {
                break;
            }
        }
        true
    }

    /// Time at which the next condition switches or clock ticks; infinity if none does.
    #[inline]
    pub(crate) fn next_time(&self) -> f64 {
        self.next_switch().min(self.clocks.next_time())
    }

    /// Time at which the next condition switches; infinity if none does.
    #[inline]
    pub(crate) fn next_switch(&self) -> f64 {
        self.switches.get(self.next).map_or(f64::INFINITY, |switch| switch.t)
    }

    /// The condition that switches next.
    pub(crate) fn next_condition(&self) -> Option<usize> {
        self.switches.get(self.next).map(|switch| switch.condition)
    }

    /// Switches the next condition and all that switch together with it.
    pub(crate) fn switch(&mut self) {
        let Some(first) = self.switches.get(self.next).copied() else { return };
        while let Some(switch) = self.switches.get(self.next)
            && switch.t == first.t
            && switch.group == first.group
        {
            self.z[self.n_automata + switch.condition] = switch.after;
            self.next += 1;
        }
    }
}
