//! Automata that choose the states where the choice must change along a solution.
//!
//! A block of constraints with several choices becomes an automaton with a mode for each. It changes to another mode
//! when the other's pivot is larger by a factor, so that near equality the choice does not alternate. Changing does not
//! affect the solution.

use super::ModeSystems;
use super::dummy_derivatives::ConstraintBlock;
use super::explicit::ExplicitSystem;
use super::variables::UnknownList;
use crate::dae::modes::ModeCombinations;
use crate::dae::transfer::TransferredEquation;
use crate::dae::{AutomatonKind, DaeAutomaton, DaeTransition, Trigger};
use crate::expr::{ExprGraph, ExprId};
use crate::model::{Crossing, Model};

/// Factor by which another pivot must be larger.
const BETTER: f64 = 2.0;

/// The necessary choices, over all combinations of modes.
#[derive(Debug, Default)]
pub(in crate::dae) struct StateSelections {
    /// For each automaton, the dummies of each of its modes.
    dummies: Vec<Vec<Vec<u32>>>,
    /// For each combination and block, the automaton that chooses.
    of_blocks: Vec<Vec<Option<usize>>>,
}

impl StateSelections {
    pub(in crate::dae) fn from_systems(systems: &[ExplicitSystem]) -> Self {
        let mut selections = StateSelections::default();
        for system in systems {
            let of_blocks = system.blocks.iter().map(|block| {
                if block.choices.len() == 1 {
                    return None;
                }
                let dummies = dummies_of(block);
                let known = selections.dummies.iter().position(|other| *other == dummies);
                Some(known.unwrap_or_else(|| {
                    selections.dummies.push(dummies);
                    selections.dummies.len() - 1
                }))
            });
            let of_blocks = of_blocks.collect();
            selections.of_blocks.push(of_blocks);
        }
        selections
    }

    /// Number of modes of each automaton.
    pub(in crate::dae) fn sizes(&self) -> impl Iterator<Item = usize> + '_ {
        self.dummies.iter().map(Vec::len)
    }

    /// The automaton that chooses for a block of a combination; `None` if there is only one choice.
    pub(super) fn automaton_of(&self, combination: usize, block: usize) -> Option<usize> {
        self.of_blocks[combination][block]
    }

    /// The automata.
    pub(in crate::dae) fn automata(
        &self,
        model: &Model,
        graph: &mut ExprGraph,
        equations: &[TransferredEquation<'_>],
        systems: &ModeSystems,
    ) -> Vec<DaeAutomaton> {
        let ModeSystems { parts, explicit: systems, variables, typical, .. } = systems;
        (0..self.dummies.len())
            .map(|k| {
                let pivots_by_system = self.pivots(k, systems);
                // All its blocks belong to one part.
                let first = pivots_by_system.iter().position(Option::is_some).unwrap_or(0);
                let after = parts.partition_point(|(_, begin)| *begin <= first);
                let (combinations, begin) = &parts[after - 1];
                let pivots = &pivots_by_system[*begin..begin + combinations.len()];
                let start = combinations.position(&ModeCombinations::start_modes(model));
                let size = |pivot: ExprId| graph.evaluate(pivot, &|s| typical.value(s)).abs();
                let at_start = pivots[start].as_ref().map_or(0, |pivots| first_mode(pivots, &size));
                let n = self.dummies[k].len();
                let mut transitions = Vec::with_capacity(n * (n - 1));
                for from in 0..n {
                    for to in (0..n).filter(|to| *to != from) {
                        let events = pivots
                            .iter()
                            .map(|pivots| excess(graph, pivots.as_ref().map(|p| [p[from], p[to]])));
                        let events = events.collect();
                        let event = combinations.merge(graph, events);
                        let resets = Vec::new();
                        let crossing = Crossing::Rises;
                        let trigger = Trigger::Level;
                        transitions.push(DaeTransition {
                            from,
                            to,
                            event,
                            crossing,
                            trigger,
                            resets,
                        });
                    }
                }
                let block = self.block(k, systems);
                DaeAutomaton {
                    name: name(equations, block),
                    kind: AutomatonKind::States,
                    modes: block
                        .choices
                        .iter()
                        .map(|c| kept(block, &c.dummies, variables))
                        .collect(),
                    start: at_start,
                    transitions,
                }
            })
            .collect()
    }

    /// A block that the automaton chooses for.
    fn block<'a>(&self, k: usize, systems: &'a [ExplicitSystem]) -> &'a ConstraintBlock {
        let systems_with_automata = systems.iter().zip(&self.of_blocks);
        let mut blocks =
            systems_with_automata.flat_map(|(system, automata)| system.blocks.iter().zip(automata));
        let chosen = blocks.find(|(_, automaton)| **automaton == Some(k));
        chosen.unwrap_or_else(|| unreachable!("an automaton is made for a block")).0
    }

    /// The pivots of an automaton's modes in each combination; `None` where the automaton has no effect.
    fn pivots(&self, k: usize, systems: &[ExplicitSystem]) -> Vec<Option<Vec<ExprId>>> {
        let systems_with_automata = systems.iter().zip(&self.of_blocks);
        systems_with_automata
            .map(|(system, automata)| {
                let position = automata.iter().position(|automaton| *automaton == Some(k))?;
                Some(system.blocks[position].choices.iter().map(|choice| choice.pivot).collect())
            })
            .collect()
    }
}

/// The initial mode: the first unless another is better by the factor.
fn first_mode(pivots: &[ExprId], size: &dyn Fn(ExprId) -> f64) -> usize {
    let mut mode = 0;
    for (other, pivot) in pivots.iter().enumerate() {
        if size(*pivot) > BETTER * size(pivots[mode]) {
            mode = other;
        }
    }
    mode
}

fn dummies_of(block: &ConstraintBlock) -> Vec<Vec<u32>> {
    block.choices.iter().map(|choice| choice.dummies.clone()).collect()
}

/// Δ² − 4 Δ₀²; negative if there is no choice.
fn excess(graph: &mut ExprGraph, pivots: Option<[ExprId; 2]>) -> ExprId {
    let Some([own, other]) = pivots else { return graph.constant(-1.0) };
    let (own, other) = (graph.multiply(own, own), graph.multiply(other, other));
    let factor = graph.constant(BETTER * BETTER);
    let scaled = graph.multiply(factor, own);
    graph.subtract(other, scaled)
}

/// `states of rod`
fn name(equations: &[TransferredEquation<'_>], block: &ConstraintBlock) -> String {
    let labels: Vec<&str> = block.equations.iter().map(|e| equations[*e].label).collect();
    format!("states of {}", labels.join(", "))
}

/// The unknowns that stay states: `x, v_x`.
fn kept(block: &ConstraintBlock, dummies: &[u32], variables: &UnknownList) -> String {
    let kept = block.candidates.iter().filter(|i| !dummies.contains(i));
    let names: Vec<&str> = kept.map(|i| variables.unknowns[*i as usize].name.as_str()).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}
