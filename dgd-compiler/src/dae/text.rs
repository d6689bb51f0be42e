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
        let _ = writeln!(text, "  output {} = {value}", output.declared.name);
    }
    text
}

fn symbol_name(dae: &Dae, symbol: Symbol) -> String {
    match symbol {
        Symbol::Time => "time".to_owned(),
        Symbol::Parameter(i) => dae.parameters[i as usize].declared.name.clone(),
        Symbol::Input(i) => dae.inputs[i as usize].declared.name.clone(),
        Symbol::Unknown(i) => dae.unknowns[i as usize].name.clone(),
        Symbol::Constant(_)
        | Symbol::Derivative(_)
        | Symbol::InputSlope(_)
        | Symbol::Sensitivity(_) => {
            unreachable!("a system holds times, parameters, inputs and unknowns only")
        }
    }
}
