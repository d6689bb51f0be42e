//! Which unknowns are states, where constraints leave a choice that changes along a solution.
//!
//! The event functions of automata of the kind [`AutomatonKind::States`] compare how well the
//! constraints determine the unknowns that are no states; the solution is the
//! same in all of their modes, so that they may change at any time.

use crate::system::{AutomatonKind, Point, Signature, System};

/// Whether each automaton chooses states.
pub(crate) fn selecting(signature: &Signature) -> impl Iterator<Item = bool> + '_ {
    signature.discrete.automata.iter().map(|automaton| automaton.kind == AutomatonKind::States)
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
    let mut has_changed = false;
    // Each change makes a pivot the larger one, so that they come to an end.
    for _ in 0..discrete.transitions().count() {
        system.event_functions(Point { z, ..at }, e);
        let mut transitions = discrete.transitions().zip(e.iter());
        let due = transitions.find(|((automaton, transition), e)| {
            discrete.automata[*automaton].kind == AutomatonKind::States
                && z[*automaton] == transition.from as f64
                && transition.crossing.is_past(**e)
        });
        let Some(((automaton, transition), _)) = due else { break };
        z[automaton] = transition.to as f64;
        has_changed = true;
    }
    has_changed
}
