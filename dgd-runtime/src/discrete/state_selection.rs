//! Selects which unknowns are states if constraints leave a choice that changes along a solution.
//!
//! The event functions of automata of the kind [`States`](crate::system::AutomatonKind::States) compare how well the
//! constraints determine the unknowns that are not states. The solution is the same in all of their modes, so they may
//! change at any time.

use crate::system::{EvaluationPoint, Signature, Storage, System};

/// For each automaton, whether it selects states.
pub(crate) fn selecting(signature: &Signature) -> impl Iterator<Item = bool> + '_ {
    signature.discrete.automata.iter().map(|automaton| automaton.kind.chooses_states())
}

/// Changes the modes of these automata in `z` to those that suit `at`, whose own `z` is not read. Returns whether one
/// changed. `e` is work space for the event functions.
pub fn select_states<S: System>(
    system: &S,
    at: EvaluationPoint<'_>,
    z: &mut [f64],
    e: &mut [f64],
) -> bool {
    let signature = system.signature();
    let discrete = &signature.discrete;
    let mut has_changed = false;
    // Each change increases a pivot, so the loop ends.
    for _ in 0..discrete.transitions().count() {
        system.event_functions(EvaluationPoint { z, ..at }, e);
        let mut transitions = discrete.transitions().zip(e.iter());
        let due = transitions.find(|((automaton, transition), e)| {
            discrete.automata[*automaton].kind.chooses_states()
                && z[*automaton] == transition.from as f64
                && transition.crossing.is_past(**e)
        });
        let Some(((automaton, transition), _)) = due else { break };
        z[automaton] = transition.to as f64;
        has_changed = true;
    }
    has_changed
}

/// Gives unknowns that are tied together, share a unit and have no declared size the largest of their sizes: y of a
/// level rod of 1 m starts near 0, but its scale is 1 m.
pub(crate) fn share_sizes<S: System>(system: &S, sizes: &mut [f64]) {
    let signature = system.signature();
    for (k, _) in selecting(signature).enumerate().filter(|(_, selects)| *selects) {
        let is_tied = tied_by(system, k);
        let tied: Vec<usize> = (0..sizes.len())
            .filter(|i| is_tied[*i] && signature.unknowns.nominal(*i).is_none())
            .collect();
        let of_kind = |i: usize, j: usize| signature.unknowns.unit(i) == signature.unknowns.unit(j);
        let shared: Vec<f64> = tied
            .iter()
            .map(|&i| tied.iter().filter(|j| of_kind(i, **j)).fold(0.0, |s, j| sizes[*j].max(s)))
            .collect();
        for (i, size) in tied.into_iter().zip(shared) {
            sizes[i] = size;
        }
    }
}

/// The unknowns that are states in some modes of an automaton and not in others.
fn tied_by<S: System>(system: &S, k: usize) -> Vec<bool> {
    let signature = system.signature();
    let automata = &signature.discrete.automata;
    let n = signature.unknowns.len();
    let (y, u) = (vec![0.0; n], vec![0.0; signature.n_u()]);
    let p = vec![0.0; signature.parameters.len()];
    let (mut first, mut mass) = (S::Vector::zeros(n), S::Vector::zeros(n));
    let mut is_tied = vec![false; n];
    // Modes of other automata decide whether there is a choice.
    for (other, automaton) in automata.iter().enumerate() {
        for mode in 0..automaton.modes.len() {
            let mut z: Vec<f64> = automata.iter().map(|automaton| automaton.start as f64).collect();
            z.resize(signature.discrete.len(), 0.0);
            z[other] = mode as f64;
            for choice in 0..automata[k].modes.len() {
                z[k] = choice as f64;
                let point = EvaluationPoint { t: 0.0, y: &y, u: &u, p: &p, z: &z };
                let masses = if choice == 0 { &mut first } else { &mut mass };
                system.mass(point, masses.as_mut());
                if choice > 0 {
                    let masses = first.as_ref().iter().zip(mass.as_ref());
                    for (is_tied, (first, mass)) in is_tied.iter_mut().zip(masses) {
                        *is_tied |= first != mass;
                    }
                }
            }
        }
    }
    is_tied
}
