//! The loop: propose a step, try it, accept it or not, record requested values, continue.
//!
//! Inputs are smooth within a segment ([`Inputs`](crate::Inputs)). At the end of one
//!
//! 1. the step ends exactly there, and the natural step size is carried over;
//! 2. everything evaluated with the old inputs is discarded;
//! 3. if the jump affects the algebraic equations, their unknowns and then their sensitivities are made consistent
//!    again.
//!
//! A step also ends where a condition on time switches, and where a transition between modes is due (`events`).
//!
//! Errors are measured in the weighted root-mean-square norm with weights rtol |y| + atol · size, separately for the
//! unknowns and for each direction's sensitivities; the largest counts.
//!
//! Where ∂f_a/∂y_a becomes singular, sensitivities end and only the states continue
//! ([`UndefinedSensitivity`](crate::UndefinedSensitivity)).

pub(crate) mod begin;
pub(crate) mod controller;
mod delay;
pub(crate) mod drive;
pub(crate) mod enclosure;
mod events;
pub(crate) mod fixed_step;
pub(crate) mod methods;
pub(crate) mod record;
mod request;
mod segments;
mod simulation;
pub(crate) mod start;
mod step;
pub(crate) mod watched;

use crate::error::IntegrateError;
use crate::solution::Solution;
use crate::solved::SolvableSystem;
use controller::Controller;
pub use delay::history::{HatFunction, HistoryPerturbation, NODES, PastSolution};
pub use delay::memory::{RunMemory, held_by_bounds};
pub use methods::{catalogue, tableaux};
pub use request::{
    integrate, simulate, simulate_chosen, simulate_observed, simulate_with_sensitivities,
    verify_inputs, verify_request,
};
use simulation::Simulation;

/// The part of an initial step that leads off a corner: an error of ∂f/∂y there is small as the square of it.
const OFF_CORNER: f64 = 1e-3;

impl<S: SolvableSystem> Simulation<'_, S> {
    fn integrate(
        &mut self,
        times: &[f64],
        until: f64,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        self.align_clocks(times);
        self.span = until - self.t;
        self.start(solution)?;
        self.record_now(times, solution);
        self.natural_step = self.resumed_step();
        if self.t == until {
            return Ok(());
        }

        let first = self.stop().min(until) - self.t;
        let h = match self.natural_step.or(self.initial_step) {
            Some(h) => h,
            None if self.is_at_corner() => OFF_CORNER * self.initial_step(first, solution),
            None => self.initial_step(first, solution),
        };
        let kind = self.method.kind;
        let order = kind.estimate_order(self.tolerances.rtol);
        let mut controller = Controller::new(h, order, kind.law());
        loop {
            if let Some(watched) = self.watched {
                watched.passes(self.t)?;
            }
            // A step may end with an event, which delays turn into a discontinuity.
            let end = self.stop().min(until);
            if self.t < end {
                self.step(&mut controller, times, end, solution)?;
                continue;
            }
            if solution.times.len() == times.len() {
                // A multistep method begins with its lowest order.
                self.natural_step = (!self.stepper.traits.is_multistep()).then_some(controller.h);
                return Ok(());
            }
            if self.t == self.segment_end {
                self.enter_next_segment(solution)?;
            }
            self.switch_conditions(solution)?;
            self.pass_discontinuities(solution)?;
            self.record_now(times, solution);
        }
    }
}
