//! A system as text, for `dgd emit --stage dae`.

use std::fmt::Write;

use super::{AutomatonKind, Dae};
use crate::expr::display::listing;
use crate::expr::{ExprId, Symbol};
use crate::model::Crossing;

/// Writes a system out: named and shared expressions first, then rows, start values and outputs.
pub fn write(dae: &Dae) -> String {
    let transitions =
        || dae.automata.iter().flat_map(|a| a.transitions.iter().map(move |t| (a, t)));
    let roots: Vec<ExprId> = dae
        .unknowns
        .iter()
        .map(|unknown| unknown.rhs)
        .chain(dae.unknowns.iter().map(|unknown| unknown.start))
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
    for output in &dae.outputs {
        let late = output.delay.map_or(String::new(), |delay| {
            format!("  read at time - {}", bracketed(&dae.delays[delay].text))
        });
        let _ = writeln!(text, "  output {} = {}{late}", output.declared.name, next());
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
        let _ = writeln!(text, "  {name} = {after} from time {at} on");
    }
    for automaton in &dae.automata {
        let is_when = matches!(automaton.kind, AutomatonKind::When | AutomatonKind::Corner);
        match automaton.kind {
            AutomatonKind::When => drop(writeln!(text, "  when {}", automaton.name)),
            AutomatonKind::Corner => drop(writeln!(text, "  {}", automaton.name)),
            AutomatonKind::Modes | AutomatonKind::Saturation | AutomatonKind::Switch => {}
        }
        let (name, modes) = (&automaton.name, automaton.modes.join(", "));
        let start = &automaton.modes[automaton.start];
        if !is_when {
            let _ = writeln!(text, "  modes {name} = {modes}; starts in {start}");
        }
        for transition in &automaton.transitions {
            let [from, to] = [transition.from, transition.to].map(|mode| &automaton.modes[mode]);
            let crossing = match transition.crossing {
                Crossing::Rises => "rises above",
                Crossing::Falls => "falls below",
            };
            let change = if is_when { String::new() } else { format!("{from} -> {to} when ") };
            let _ = writeln!(text, "    {change}{} {crossing} 0", next());
            for (unknown, _) in &transition.resets {
                let _ = writeln!(text, "      reset {} = {}", dae.unknowns[*unknown].name, next());
            }
        }
    }
    text
}

/// What is subtracted, in brackets where it is more than a name or a number.
fn bracketed(text: &str) -> String {
    let is_atom = text.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '.'));
    if is_atom { text.to_owned() } else { format!("({text})") }
}

/// What discrete numbers are called: `mode(line)`, and `switched(0)` for conditions on time.
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
        Symbol::Unknown(i) => dae.unknowns[i as usize].name.clone(),
        Symbol::Discrete(i) => discrete_name(dae, i as usize),
        Symbol::Constant(_)
        | Symbol::Derivative(_)
        | Symbol::InputSlope(_)
        | Symbol::Sensitivity(_)
        | Symbol::Late(_) => {
            unreachable!("a system holds what is known at a time, unknowns and discrete numbers")
        }
    }
}
