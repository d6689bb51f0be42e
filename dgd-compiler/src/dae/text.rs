//! A system as text, for `dgd emit --stage dae`.

use std::fmt::Write;

use super::Dae;
use crate::expr::display::listing;
use crate::expr::{ExprId, Symbol};

/// Writes a system out: named and shared expressions first, then rows, start values and outputs.
pub fn write(dae: &Dae) -> String {
    let roots: Vec<ExprId> = dae
        .unknowns
        .iter()
        .map(|unknown| unknown.rhs)
        .chain(dae.unknowns.iter().map(|unknown| unknown.start))
        .chain(dae.outputs.iter().map(|output| output.value))
        .collect();
    let listing = listing(&dae.graph, &roots, &dae.names, &|symbol| symbol_name(dae, symbol));
    let mut text = format!("dae {}\n", dae.name);
    for (name, value) in &listing.lines {
        let _ = writeln!(text, "  {name} = {value}");
    }
    let n = dae.unknowns.len();
    for (unknown, value) in dae.unknowns.iter().zip(&listing.roots) {
        let left =
            if unknown.differential { format!("der({})", unknown.name) } else { "0".to_owned() };
        let _ = writeln!(text, "  {}: {left} = {value}", unknown.equation);
    }
    for (unknown, value) in dae.unknowns.iter().zip(&listing.roots[n..]) {
        let kind = if unknown.differential { "start" } else { "guess" };
        let _ = writeln!(text, "  {kind} {} = {value}", unknown.name);
    }
    for (output, value) in dae.outputs.iter().zip(&listing.roots[2 * n..]) {
        let late = output.delay.map_or(String::new(), |delay| {
            format!("  read at time - {}", bracketed(&dae.delays[delay].text))
        });
        let _ = writeln!(text, "  output {} = {value}{late}", output.declared.name);
    }
    text
}

/// What is subtracted, in brackets where it is more than a name or a number.
fn bracketed(text: &str) -> String {
    let is_atom = text.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '.'));
    if is_atom { text.to_owned() } else { format!("({text})") }
}

fn symbol_name(dae: &Dae, symbol: Symbol) -> String {
    match symbol {
        Symbol::Time => "time".to_owned(),
        Symbol::Parameter(i) => dae.parameters[i as usize].declared.name.clone(),
        Symbol::Input(i) => dae.input_name(i as usize),
        Symbol::Unknown(i) => dae.unknowns[i as usize].name.clone(),
        Symbol::Constant(_)
        | Symbol::Derivative(_)
        | Symbol::InputSlope(_)
        | Symbol::Sensitivity(_)
        | Symbol::Late(_) => {
            unreachable!("a system holds times, parameters, inputs and unknowns only")
        }
    }
}
