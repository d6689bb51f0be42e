//! A system as text, for `dgd emit --stage dae`.

use std::fmt::Write;

use super::{AutomatonKind, Dae, Trigger, position};
use crate::expr::display::listing;
use crate::expr::{ExprId, Symbol};

/// Writes a system out: named and shared expressions first, then rows, start values and outputs.
pub fn write(dae: &Dae) -> String {
    let transitions =
        || dae.automata.iter().flat_map(|a| a.transitions.iter().map(move |t| (a, t)));
    let roots: Vec<ExprId> = dae
        .unknowns
        .iter()
        .map(|unknown| unknown.rhs)
        .chain(dae.unknowns.iter().map(|unknown| unknown.start))
        .chain(dae.unknowns.iter().filter_map(|unknown| unknown.history))
        .chain(dae.outputs.iter().map(|output| output.value))
        .chain(dae.unknowns.iter().map(|unknown| unknown.mass))
        .chain(dae.time_conditions.iter().flat_map(|condition| [condition.at, condition.after]))
        .chain(transitions().flat_map(|(_, transition)| {
            let resets = transition.resets.iter().map(|(_, value)| *value);
            [transition.event].into_iter().chain(resets)
        }))
        .collect();
    let listing = listing(&dae.graph, &roots, &dae.names, &|symbol| symbol_name(dae, symbol));
    let mut text = format!("dae {}\n", dae.name);
    for (name, value) in &listing.lines {
        let _ = writeln!(text, "  {name} = {value}");
    }
    let mut roots = listing.roots.iter();
    let mut next = || roots.next().map_or("", String::as_str);
    for unknown in &dae.unknowns {
        let left = match dae.graph.value(unknown.mass) {
            Some(0.0) => "0".to_owned(),
            Some(_) => format!("der({})", unknown.name),
            None => format!("0 or der({})", unknown.name),
        };
        let _ = writeln!(text, "  {}: {left} = {}", unknown.equation, next());
    }
    for unknown in &dae.unknowns {
        let kind = if unknown.differential { "start" } else { "guess" };
        let _ = writeln!(text, "  {kind} {} = {}", unknown.name, next());
    }
    for unknown in dae.unknowns.iter().filter(|unknown| unknown.history.is_some()) {
        let _ = writeln!(text, "  history {} = {}", unknown.name, next());
    }
    families(dae, &mut text);
    for output in &dae.outputs {
        let delayed = output.delay.map_or(String::new(), |delay| {
            format!("  read at time - {}", bracketed(&dae.delays[delay].text))
        });
        let _ = writeln!(text, "  output {} = {}{delayed}", output.declared.name, next());
    }
    for output in &dae.output_arrays {
        let (name, lower) = (&output.declared.name, output.lower);
        let read = moving(dae.unknown_name(output.first));
        let _ = writeln!(text, "  output {name}[{lower}+_k] = {read}");
    }
    for unknown in &dae.unknowns {
        let mass = next();
        if dae.graph.value(unknown.mass).is_none() {
            let _ = writeln!(text, "  mass of der({}) = {mass}", unknown.name);
        }
    }
    for k in 0..dae.time_conditions.len() {
        let name = discrete_name(dae, dae.automata.len() + k);
        let (at, after) = (next(), next());
        let clock = |condition: usize| dae.clocks.iter().find(|c| c.condition == condition);
        let _ = match (clock(k), k.checked_sub(1).and_then(clock)) {
            (Some(clock), _) if !clock.marks.is_empty() => {
                writeln!(text, "  {name} counts {} marks from time {at} on", clock.marks.len())
            }
            (None, Some(clock)) if !clock.marks.is_empty() => {
                writeln!(text, "    in units of {at}")
            }
            (Some(_), _) => writeln!(text, "  {name} steps at time {at}"),
            (None, Some(_)) => writeln!(text, "    and every {at} from there"),
            (None, None) => writeln!(text, "  {name} = {after} from time {at} on"),
        };
    }
    for automaton in &dae.automata {
        let shows_modes = automaton.kind.shows_modes();
        let (name, modes) = (&automaton.name, automaton.modes.join(", "));
        let start = &automaton.modes[automaton.start];
        let _ = if shows_modes {
            writeln!(text, "  modes {name} = {modes}; starts in {start}")
        } else {
            let when = match automaton.kind {
                AutomatonKind::When => "when ",
                AutomatonKind::Every => "every ",
                _ => "",
            };
            writeln!(text, "  {when}{name}")
        };
        for transition in &automaton.transitions {
            let target = &automaton.modes[transition.to];
            if transition.trigger == Trigger::Start {
                let _ = writeln!(text, "    starts in {target} if {} is above 0", next());
                continue;
            }
            let from = &automaton.modes[transition.from];
            let crossing = transition.crossing.words();
            let change =
                if shows_modes { format!("{from} -> {target} when ") } else { String::new() };
            let event = next();
            if transition.trigger != Trigger::Clock {
                let _ = writeln!(text, "    {change}{event} {crossing} 0");
            }
            for (unknown, _) in &transition.resets {
                let name = dae.unknown_name(position(*unknown));
                let _ = writeln!(text, "      reset {name} = {}", next());
            }
        }
    }
    text
}

/// Rows and start values of arrays, k counting from zero.
fn families(dae: &Dae, text: &mut String) {
    let show = |text: &mut String, id: ExprId| {
        let listing = listing(&dae.graph, &[id], &dae.names, &|symbol| match symbol {
            Symbol::Swept(i) => moving(dae.unknown_name(i as usize)),
            Symbol::SweptParameter(i, _) => {
                moving(dae.parameters[i as usize].declared.name.clone())
            }
            Symbol::SweptInput(i, _) => moving(dae.input_name(i as usize)),
            Symbol::Counter => "_k".to_owned(),
            other => symbol_name(dae, other),
        });
        for (name, value) in &listing.lines {
            let _ = writeln!(text, "    {name} = {value}");
        }
        listing.roots[0].clone()
    };
    for family in &dae.families {
        let (mut label, mut name) = (family.label(0), dae.unknown_name(family.first));
        if family.count > 1 {
            let _ = writeln!(text, "  for _k in 0..{}", family.count - 1);
            (label, name) = (moving(label), moving(name));
        }
        let value = show(text, family.rhs);
        let left = if family.differential { format!("der({name})") } else { "0".to_owned() };
        let _ = writeln!(text, "  {label}: {left} = {value}");
    }
    for array in &dae.arrays {
        let value = show(text, array.start);
        let _ = writeln!(text, "  start {} = {value}", moving(array.element_name(0)));
        if let Some(history) = array.history {
            let value = show(text, history);
            let _ = writeln!(text, "  history {} = {value}", moving(array.element_name(0)));
        }
    }
}

/// `p[3+_k]` for `p[3]`; no name of a model begins with `_k`.
fn moving(name: String) -> String {
    match name.strip_suffix(']') {
        Some(open) => format!("{open}+_k]"),
        None => name,
    }
}

/// A subtrahend, in brackets unless it is a name or a number.
fn bracketed(text: &str) -> String {
    let is_atom = text.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '.'));
    if is_atom { text.to_owned() } else { format!("({text})") }
}

/// Names of discrete numbers: `mode(line)`, and `switched(0)` for conditions on time.
fn discrete_name(dae: &Dae, position: usize) -> String {
    match dae.automata.get(position) {
        Some(automaton) => format!("mode({})", automaton.name),
        None => format!("switched({})", position - dae.automata.len()),
    }
}

pub(super) fn symbol_name(dae: &Dae, symbol: Symbol) -> String {
    match symbol {
        Symbol::Time => "time".to_owned(),
        Symbol::Parameter(i) => dae.parameters[i as usize].declared.name.clone(),
        Symbol::Input(i) => dae.input_name(i as usize),
        Symbol::Unknown(i) => {
            let name = dae.unknown_name(i as usize);
            if name.contains(' ') { format!("({name})") } else { name }
        }
        Symbol::Discrete(i) => discrete_name(dae, i as usize),
        Symbol::DelayedUnknown(i) => dae.delayed_unknown_name(i as usize),
        Symbol::Constant(_)
        | Symbol::Derivative(_)
        | Symbol::Element(_)
        | Symbol::Swept(_)
        | Symbol::SweptParameter(..)
        | Symbol::SweptInput(..)
        | Symbol::SweptInputSlope(..)
        | Symbol::Counter
        | Symbol::ElementRate(_)
        | Symbol::SweptRate(_)
        | Symbol::SweptSensitivity(_)
        | Symbol::InputSlope(_)
        | Symbol::Sensitivity(_)
        | Symbol::Delayed(_)
        | Symbol::Past(..) => {
            unreachable!("a system holds what is known at a time, unknowns and discrete numbers")
        }
    }
}
