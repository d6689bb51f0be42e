//! What a run goes on from where another one has ended, beside its unknowns.
//!
//! Sides of switches, chosen states, bounds of algebraic unknowns and conditions on time are seen from
//! the values at the time. In which mode a system is, which of its conditions have been true all along,
//! and whether a state is held by its bound are not. Nor is how long a step may be, which is found once.

use crate::integrate::simulation::Simulation;
use crate::problem::Problem;
use crate::solved::Solved;
use crate::system::{Discrete, Point};

/// What a run that has ended remembers beside its unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct Memory {
    z: Vec<f64>,
    armed: Vec<bool>,
    /// The natural step size where the run ended, of methods that make their first step as they do others.
    natural_step: Option<f64>,
}

impl Memory {
    /// The discrete numbers: modes, then conditions on time.
    pub fn z(&self) -> &[f64] {
        &self.z
    }
}

/// Unknowns that are at their bounds in the modes `z`, by their positions.
pub fn held_by_bounds(discrete: &Discrete, z: &[f64]) -> Vec<usize> {
    let held = discrete
        .automata
        .iter()
        .zip(z)
        .filter(|(automaton, z)| automaton.kind.is_bound() && **z != automaton.start as f64);
    let mut bounded: Vec<usize> = held
        .flat_map(|(automaton, _)| automaton.transitions.iter().flat_map(|of| of.resets.iter()))
        .copied()
        .collect();
    bounded.sort_unstable();
    bounded.dedup();
    bounded
}

impl<S: Solved> Simulation<'_, S> {
    /// What another run would go on from.
    pub(in crate::integrate) fn memory(&self) -> Memory {
        Memory {
            z: self.discrete.z().to_vec(),
            armed: self.discrete.armed.clone(),
            natural_step: self.natural_step,
        }
    }

    /// The step size to go on with, in a run that goes on.
    pub(in crate::integrate) fn resumed_step(&self) -> Option<f64> {
        self.resumed.and_then(|memory| memory.natural_step)
    }

    /// Begins in the modes of a run that has ended here.
    pub(in crate::integrate) fn recall_modes(&mut self, memory: &Memory) {
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
        let u = self.drive.at(self.t, self.y.as_ref());
        let at = Point { t: self.t, y: &[], u, p, z: &self.discrete.schedule.z };
        system.mass(at, mass.as_mut());
        self.algebraic.enter_modes(mass.as_ref());
    }

    /// Holds the states that were at their bounds, after sides have been chosen.
    pub(in crate::integrate) fn recall_bounds(&mut self, memory: &Memory) {
        let signature = self.problem.system.signature();
        for (k, automaton) in signature.discrete.automata.iter().enumerate() {
            let mut resets = automaton.transitions.iter().flat_map(|of| of.resets.iter());
            if automaton.kind.is_bound() && resets.any(|i| signature.unknowns.is_differential(*i)) {
                self.discrete.schedule.z[k] = memory.z[k];
            }
        }
    }
}
