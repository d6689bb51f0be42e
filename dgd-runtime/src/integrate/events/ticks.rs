//! Conditions on time that switch, and clocks that tick.
//!
//! Each is an instant of its own, with the derivatives τ of its own time. Ticks at one time act in the order of the
//! model. If their times have other derivatives, the order is another for other parameters: S is then defined only if
//! the order makes no difference.

use crate::discrete::clock::ClockTick;
use crate::error::IntegrateError;
use crate::integrate::events::simultaneous::is_same;
use crate::integrate::simulation::Simulation;
use crate::problem::Problem;
use crate::solution::Solution;
use crate::solved::SolvableSystem;
use crate::system::EvaluationPoint;

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Switches the conditions on time, and makes the ticks, that are due now.
    #[inline]
    pub(in crate::integrate) fn switch_conditions(
        &mut self,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        if !S::FEATURES.events {
            return Ok(());
        }
        while self.discrete.next_switch() == self.t {
            if self.discrete.schedule.next_switch() != self.t {
                self.make_ticks(solution)?;
                continue;
            }
            let hybrid = &mut self.discrete;
            let n_c = hybrid.z().len() - hybrid.n_automata;
            let condition = hybrid.schedule.next_condition().unwrap_or(0);
            for (tau, column) in
                hybrid.saltation.tau.iter_mut().zip(hybrid.dtimes.chunks_exact(n_c))
            {
                *tau = column[condition];
            }
            self.begin_instant(solution);
            self.discrete.schedule.switch();
            self.place_followers();
            self.take_over(None, solution)?;
            self.settle(solution)?;
            self.mark_instant();
        }
        Ok(())
    }

    /// Makes the next tick of a clock; where it acts, all others that act at this time as well.
    fn make_ticks(&mut self, solution: &mut Solution) -> Result<(), IntegrateError> {
        let Some(tick) = self.discrete.schedule.clocks.tick() else { return Ok(()) };
        let mut ticks = std::mem::take(&mut self.discrete.ticks);
        ticks.clear();
        ticks.push(tick);
        while tick.automaton.is_some()
            && self.discrete.schedule.clocks.next_time() == self.t
            && let Some(other) = self.discrete.schedule.clocks.tick()
        {
            ticks.push(other);
        }
        if self.directions.is_some() && self.order_matters(&ticks) {
            self.verify_order_of_ticks(&ticks, solution);
        }
        for tick in &ticks {
            self.make_tick(*tick, solution)?;
            self.mark_instant();
        }
        self.discrete.ticks = ticks;
        Ok(())
    }

    /// Makes one tick, and the transition that it drives.
    fn make_tick(
        &mut self,
        tick: ClockTick,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        for j in 0..self.discrete.saltation.tau.len() {
            self.discrete.saltation.tau[j] = self.slope_of_tick(tick, j);
        }
        self.begin_instant(solution);
        let position = self.discrete.n_automata + tick.condition;
        self.discrete.schedule.z[position] = tick.count;
        if let Some(automaton) = tick.automaton {
            self.act(automaton, solution)?;
        } else {
            self.place_followers();
            self.take_over(None, solution)?;
        }
        self.settle(solution)
    }

    /// The derivative of t₀ + x T in direction j.
    fn slope_of_tick(&self, tick: ClockTick, j: usize) -> f64 {
        let n_c = self.discrete.z().len() - self.discrete.n_automata;
        let column = &self.discrete.dtimes[j * n_c..];
        column[tick.condition] + tick.number * column[tick.condition + 1]
    }

    /// Places clocks whose times depend on discrete numbers that have just changed.
    fn place_followers(&mut self) {
        let Problem { system, p, .. } = *self.problem;
        let hybrid = &mut self.discrete;
        if hybrid.schedule.follow(system, p, self.t) && !hybrid.dtimes.is_empty() {
            let point = EvaluationPoint { t: self.t, y: &[], u: &[], p, z: &hybrid.schedule.z };
            system.condition_time_sensitivities(point, &mut hybrid.dtimes);
        }
    }

    /// Whether ticks at one time would be at different times for other parameters.
    fn order_matters(&self, ticks: &[ClockTick]) -> bool {
        let [first, others @ ..] = ticks else { return false };
        let differs = |other: &ClockTick| {
            (0..self.discrete.saltation.tau.len())
                .any(|j| !is_same(self.slope_of_tick(*first, j), self.slope_of_tick(*other, j)))
        };
        others.iter().any(differs)
    }

    /// Tries ticks in both orders; ends sensitivities if the outcomes differ.
    fn verify_order_of_ticks(&mut self, ticks: &[ClockTick], solution: &mut Solution) {
        let agree = self.orders_agree(solution, |run, reversed, solution| {
            for place in 0..ticks.len() {
                let place = if reversed { ticks.len() - 1 - place } else { place };
                run.make_tick(ticks[place], solution)?;
            }
            Ok(())
        });
        if !agree {
            let automata = ticks.iter().filter_map(|tick| tick.automaton);
            self.end_sensitivities_of_order(automata.collect(), solution);
        }
    }

    /// Makes the transitions of ticks at the start of a run.
    pub(in crate::integrate) fn make_first_ticks(
        &mut self,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        if !S::FEATURES.events || self.discrete.schedule.clocks.is_empty() {
            return Ok(());
        }
        let acting: Vec<usize> = self.discrete.schedule.clocks.first_ticks().collect();
        for automaton in acting {
            self.begin_sample();
            self.act(automaton, solution)?;
            self.settle(solution)?;
        }
        Ok(())
    }

    /// Makes the transition of an automaton that a clock drives.
    fn act(&mut self, automaton: usize, solution: &mut Solution) -> Result<(), IntegrateError> {
        let mut transitions = self.problem.system.signature().discrete.transitions();
        match transitions.position(|(of, _)| of == automaton) {
            Some(k) => self.make_transition(k, solution),
            None => self.take_over(None, solution),
        }
    }
}
