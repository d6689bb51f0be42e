//! Which unknowns are states, where constraints leave a choice that changes along a solution.
//!
<<<<<<< HEAD
//! They are what automata of the kind [`AutomatonKind::States`] choose, which stand together. Their event functions
//! compare how well the constraints determine the unknowns that are no states; the solution is the
=======
//! The event functions of automata of the kind [`AutomatonKind::States`] compare how well the constraints determine the unknowns that are no states; the solution is the
>>>>>>> index
//! same in all of their modes, so that they may change at any time.

use std::ops::Range;

<<<<<<< HEAD
use crate::system::{Automaton, AutomatonKind, Point, Signature, System};

/// Positions of the automata that choose states.
pub(crate) fn selecting(signature: &Signature) -> Range<usize> {
    let automata = &signature.discrete.automata;
    let chooses = |automaton: &Automaton| automaton.kind == AutomatonKind::States;
    let first = automata.iter().position(chooses).unwrap_or(automata.len());
    let count = automata.iter().skip(first).take_while(|automaton| chooses(automaton)).count();
    first..first + count
=======
/// Whether each automaton chooses states.
pub(crate) fn selecting(signature: &Signature) -> impl Iterator<Item = bool> + '_ {
    signature.discrete.automata.iter().map(|automaton| automaton.kind == AutomatonKind::States)
>>>>>>> index
}

/// Changes the modes of these automata in `z` to those that suit `at`, whose own `z` is not read;
/// whether one has changed. `e` is work space for the event functions.
pub(crate) fn select_states<S: System>(
    system: &S,
    at: Point<'_>,
    z: &mut [f64],
    e: &mut [f64],
) -> bool {
    let signature = system.signature();
    let discrete = &signature.discrete;
<<<<<<< HEAD
    let selecting = selecting(signature);
=======
>>>>>>> index
    let mut has_changed = false;
    // Each change makes a pivot the larger one, so that they come to an end.
    for _ in 0..discrete.transitions().count() {
        system.event_functions(Point { z, ..at }, e);
        let mut transitions = discrete.transitions().zip(e.iter());
        let due = transitions.find(|((automaton, transition), e)| {
<<<<<<< HEAD
            selecting.contains(automaton)
=======
            discrete.automata[*automaton].kind == AutomatonKind::States
>>>>>>> index
                && z[*automaton] == transition.from as f64
                && transition.crossing.is_past(**e)
        });
        let Some(((automaton, transition), _)) = due else { break };
        z[automaton] = transition.to as f64;
        has_changed = true;
    }
    has_changed
}
