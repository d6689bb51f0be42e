//! Which unknowns are states, where constraints leave a choice that changes along a solution.
//!
//! Automata of the kind [`AutomatonKind::States`] stand behind the others. Their event functions
//! compare how well the constraints determine the unknowns that are no states; the solution is the
//! same in all of their modes, so that they may change at any time.

use crate::system::{AutomatonKind, Point, Signature, System};

/// Position of the first automaton that chooses states.
pub(crate) fn first_selecting(signature: &Signature) -> usize {
    let automata = &signature.discrete.automata;
    automata.iter().take_while(|automaton| automaton.kind == AutomatonKind::Declared).count()
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
    let first = first_selecting(signature);
    let mut has_changed = false;
    // Each change makes a pivot the larger one, so that they come to an end.
    for _ in 0..discrete.transitions().count() {
        system.event_functions(Point { z, ..at }, e);
        let mut transitions = discrete.transitions().zip(e.iter());
        let due = transitions.find(|((automaton, transition), e)| {
            *automaton >= first
                && z[*automaton] == transition.from as f64
                && transition.crossing.is_past(**e)
        });
        let Some(((automaton, transition), _)) = due else { break };
        z[automaton] = transition.to as f64;
        has_changed = true;
    }
    has_changed
}
