//! The state, other than its unknowns, that a run needs to continue another.
//!
//! Sides of switches, chosen states, bounds of algebraic unknowns and conditions on time follow from the values at the
//! time. The mode of a system, which of its conditions have been true all along, and whether a state is held by its
//! bound do not. Nor does the step size, which would otherwise have to be found again.

use crate::integrate::simulation::Simulation;
use crate::problem::Problem;
use crate::solved::SolvableSystem;
use crate::system::{Discrete, EvaluationPoint};

/// The state of a run at its end, other than its unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct RunMemory {
    z: Vec<f64>,
    armed: Vec<bool>,
    /// The natural step size at the end of the run, for methods whose first step is like any other.
    natural_step: Option<f64>,
}

impl RunMemory {
    /// The discrete numbers: modes, then conditions on time.
    pub fn z(&self) -> &[f64] {
        &self.z
    }
}

/// Positions of the unknowns that are at their bounds in the modes `z`.
pub fn held_by_bounds(discrete: &Discrete, z: &[f64]) -> Vec<usize> {
    let remembered = discrete
        .automata
        .iter()
        .zip(z)
        .filter(|(automaton, z)| automaton.kind.is_bound() && **z != automaton.start as f64);
    let mut bounded: Vec<usize> = remembered
        .flat_map(|(automaton, _)| automaton.transitions.iter().flat_map(|of| of.resets.iter()))
        .copied()
        .collect();
    bounded.sort_unstable();
    bounded.dedup();
    bounded
}

impl<S: SolvableSystem> Simulation<'_, S> {
    /// The state from which another run can continue.
    pub(in crate::integrate) fn memory(&self) -> RunMemory {
        RunMemory {
            z: self.discrete.z().to_vec(),
            armed: self.discrete.armed.clone(),
            natural_step: self.natural_step,
        }
    }

    /// The step size to continue with, in a resumed run.
    pub(in crate::integrate) fn resumed_step(&self) -> Option<f64> {
        self.resumed.and_then(|memory| memory.natural_step)
    }

    /// Begins in the final modes of the previous run.
    pub(in crate::integrate) fn recall_modes(&mut self, memory: &RunMemory) {
        if !S::FEATURES.events {
            return;
        }
        let Problem { system, p, .. } = *self.problem;
        let discrete = &system.signature().discrete;
        let hybrid = &mut self.discrete;
        for (k, automaton) in discrete.automata.iter().enumerate() {
            if automaton.kind.is_remembered() {
                hybrid.schedule.z[k] = memory.z[k];
            }
        }
        for (k, (automaton, _)) in discrete.transitions().enumerate() {
            if discrete.automata[automaton].kind.is_remembered() {
                hybrid.armed[k] = memory.armed[k];
            }
        }
        let mut mass = self.algebraic.mass.clone();
        let u = self.drive.evaluate(self.t, self.y.as_ref());
        let point = EvaluationPoint { t: self.t, y: &[], u, p, z: &self.discrete.schedule.z };
        system.mass(point, mass.as_mut());
        self.algebraic.enter_modes(mass.as_ref());
    }

    /// Holds the states that were at their bounds, after sides have been chosen.
    pub(in crate::integrate) fn recall_bounds(&mut self, memory: &RunMemory) {
        let signature = self.problem.system.signature();
        for (k, automaton) in signature.discrete.automata.iter().enumerate() {
            let mut resets = automaton.transitions.iter().flat_map(|of| of.resets.iter());
            if automaton.kind.is_bound() && resets.any(|i| signature.unknowns.is_differential(*i)) {
                self.discrete.schedule.z[k] = memory.z[k];
            }
        }
    }
}
