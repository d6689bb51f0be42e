//! Discrete numbers: modes and conditions on time, and when the latter switch.

pub(crate) mod clock;
mod schedule;
pub(crate) mod state_selection;

pub(crate) use self::schedule::SwitchSchedule;
use crate::system::{
    Automaton, Crossing, Discrete, EvaluationPoint, Signature, System, Transition, Trigger,
};

/// The discrete numbers of a simulation that starts at `t`: every automaton in its starting mode, conditions on time as
/// they are just after `t`.
///
/// # Panics
///
/// If the number of parameters differs from that of the model.
pub fn discrete_numbers<S: System>(system: &S, p: &[f64], t: f64) -> Vec<f64> {
    SwitchSchedule::new(system, p, t).z
}

/// Puts each automaton into the mode of the first of its start conditions that holds; without one it stays in its mode.
/// `at` has the start values, `z` replaces its discrete numbers, and `e` is work space for the event functions.
pub(crate) fn choose_start_modes<S: System>(
    system: &S,
    at: EvaluationPoint<'_>,
    e: &mut [f64],
    z: &mut [f64],
) {
    let discrete = &system.signature().discrete;
    let chooses = |automaton: &Automaton| {
        automaton.transitions.iter().any(|transition| transition.trigger == Trigger::Start)
    };
    if !discrete.automata.iter().any(chooses) {
        return;
    }
    // Conditions may share switches with the equations.
    choose_sides(system, at, e, z);
    system.event_functions(EvaluationPoint { z, ..at }, e);
    for (position, _) in discrete.automata.iter().enumerate().filter(|(_, a)| chooses(a)) {
        let holding = discrete.transitions().zip(e.iter()).find(|((of, transition), e)| {
            *of == position
                && transition.trigger == Trigger::Start
                && transition.crossing.is_past(**e)
        });
        if let Some(((_, transition), _)) = holding {
            z[position] = transition.to as f64;
        }
    }
}

/// Positions of the transitions of modes and of `when`s whose conditions hold here.
pub(crate) fn waiting<S: System>(system: &S, at: EvaluationPoint<'_>, e: &mut [f64]) -> Vec<usize> {
    let discrete = &system.signature().discrete;
    system.event_functions(at, e);
    let holds = |(k, (position, transition)): (usize, (usize, &Transition))| {
        let kind = discrete.automata[position].kind;
        (kind.is_declared()
            && transition.trigger == Trigger::Edge
            && at.z[position] == transition.from as f64
            && transition.crossing.is_past(e[k]))
        .then_some(k)
    };
    discrete.transitions().enumerate().filter_map(holds).collect()
}

/// Puts switches on the side of their surfaces that y is on, and algebraic unknowns that would exceed a bound at that
/// bound. `z` replaces the discrete numbers of `at`, and `e` is work space for the event functions.
pub fn choose_sides<S: System>(system: &S, at: EvaluationPoint<'_>, e: &mut [f64], z: &mut [f64]) {
    let Signature { discrete, unknowns, .. } = system.signature();
    if !discrete.automata.iter().any(|automaton| automaton.kind.chooses_side()) {
        return;
    }
    for (z, automaton) in z.iter_mut().zip(discrete.automata.iter()) {
        if automaton.kind.chooses_side() {
            *z = automaton.start as f64;
        }
    }
    system.event_functions(EvaluationPoint { z, ..at }, e);
    count_steps(discrete, e, z);
    for (k, (position, transition)) in discrete.transitions().enumerate() {
        let automaton = &discrete.automata[position];
        if automaton.kind.counts() {
            continue;
        }
        let algebraic = transition.resets.iter().all(|i| !unknowns.is_differential(*i));
        if automaton.kind.chooses_side()
            && algebraic
            && transition.from == automaton.start
            && transition.trigger == Trigger::Level
            && transition.crossing.is_past(e[k])
        {
            z[position] = transition.to as f64;
        }
    }
}

/// Updates the numbers of steps from the event functions, which were evaluated with the old numbers.
pub(crate) fn count_steps(discrete: &Discrete, e: &[f64], z: &mut [f64]) {
    for (position, automaton) in discrete.automata.iter().enumerate() {
        if automaton.kind.counts() {
            count_steps_of(discrete, position, e, z);
        }
    }
}

/// The same for one counting automaton.
pub(crate) fn count_steps_of(discrete: &Discrete, position: usize, e: &[f64], z: &mut [f64]) {
    // x − z is the event function that falls below zero.
    let above = discrete.transitions().zip(e).find_map(|((of, transition), e)| {
        (of == position && transition.crossing == Crossing::Falls).then_some(*e)
    });
    let steps = above.map_or(0.0, f64::floor);
    if steps.is_finite() {
        z[position] += steps;
    }
}

/// For each unknown, whether it is differential in some combination of modes.
pub fn differential_somewhere<S: System>(system: &S) -> Vec<bool> {
    let unknowns = &system.signature().unknowns;
    let by_mode = changes_by_mode(system).into_iter().enumerate();
    by_mode.map(|(i, changes)| changes || unknowns.is_differential(i)).collect()
}

/// For each unknown, whether it is differential in some combination of modes and algebraic in another.
pub fn changes_by_mode<S: System>(system: &S) -> Vec<bool> {
    let signature = system.signature();
    let mut changes = vec![false; signature.unknowns.len()];
    for i in signature.discrete.by_mode.iter() {
        changes[*i] = true;
    }
    changes
}
