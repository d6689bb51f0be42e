//! A model as text, for `dgd emit --stage model`: what was understood, in SI units.

use std::fmt::Write;

use super::{Bound, Declared, Equation, Interpolation, Model, Origin};
use crate::expr::display::{listing, number};
use crate::expr::{Node, Symbol};
use crate::units::describe;

/// Writes a model out.
pub fn write(model: &Model) -> String {
    let mut text = String::new();
    let mut line = |indent: &str, content: String| {
        let _ = writeln!(text, "{indent}{content}");
    };
    line("", format!("model {}", model.name));
    for part in &model.parts {
        line("  ", format!("part {}: {}", part.name, part.model));
    }
    for variant in &model.variants {
        line("  ", format!("variant {} = {}", variant.name, variant.choices[variant.chosen]));
    }
    for (name, size) in &model.sizes {
        line("  ", format!("size {} = {size}", name.text));
    }
    for constant in &model.constants {
        line("  ", format!("constant {} = {}", head(&constant.declared), number(constant.value)));
    }
    for input in &model.inputs {
        let hold = match input.interpolation {
            Interpolation::Hold => "hold",
            Interpolation::Linear => "linear",
        };
        line("  ", format!("input {} {hold}", head(&input.declared)));
    }
    for parameter in &model.parameters {
        let mut content =
            format!("parameter {} = {}", head(&parameter.declared), number(parameter.value));
        if parameter.lower.is_finite() || parameter.upper.is_finite() {
            let end = |x: f64| if x.is_finite() { number(x) } else { String::new() };
            let _ = write!(content, " in {} .. {}", end(parameter.lower), end(parameter.upper));
            content.truncate(content.trim_end().len());
        }
        for (flag, word) in [(parameter.log, ", log"), (parameter.fixed, ", fixed")] {
            if flag {
                content.push_str(word);
            }
        }
        line("  ", content);
    }
    let names = model.let_names();
    let symbol = |symbol| symbol_name(model, symbol);
    let show = |id| {
        let mut unnamed = names.clone();
        unnamed.remove(&id);
        let listing = listing(&model.graph, &[id], &unnamed, &symbol);
        // Other `let`s stand by their names; what only was too long is written above.
        let longer: Vec<(String, String)> =
            listing.lines.into_iter().filter(|(name, _)| name.starts_with('_')).collect();
        (longer, listing.roots[0].clone())
    };
    let mut shown = |indent: &str, head: String, id| {
        let (longer, root) = show(id);
        for (name, value) in longer {
            let _ = writeln!(text, "{indent}  {name} = {value}");
        }
        let _ = writeln!(text, "{indent}{head} = {root}");
    };
    for l in &model.lets {
        shown("  ", format!("let {} [{}]", l.name, describe(l.dimension)), l.value);
    }
    for unknown in &model.unknowns {
        let kind = if unknown.state { "state" } else { "unknown" };
        shown("  ", format!("{kind} {}", head(&unknown.declared)), unknown.start);
        if let Some(history) = unknown.history {
            shown("    ", "history".to_owned(), history);
        }
    }
    for array in &model.arrays {
        let kind = if array.unknown.state { "state" } else { "unknown" };
        let upper = array.lower + i64::from(array.count) - 1;
        let Declared { name, unit, .. } = &array.unknown.declared;
        let range = format!("{name}[{}..{upper}] [{}]", array.lower, describe(unit.dimension));
        shown("  ", format!("{kind} {range}"), array.unknown.start);
    }
    let equation = |text: &mut String, indent: &str, equation: &Equation| {
        let ((longer_left, left), (longer_right, right)) =
            (show(equation.left), show(equation.right));
        for (name, value) in longer_left.into_iter().chain(longer_right) {
            let _ = writeln!(text, "{indent}  {name} = {value}");
        }
        let _ = writeln!(text, "{indent}equation {}: {left} = {right}", equation.label);
    };
    for common in &model.equations {
        equation(&mut text, "  ", common);
    }
    for family in &model.families {
        let upper = family.lower + i64::from(family.count) - 1;
        let (index, lower) = (&family.index, family.lower);
        let _ = writeln!(text, "  for {index} in {lower}..{upper}, {index} = {lower} + _k");
        equation(&mut text, "    ", &family.equation);
    }
    for saturation in &model.saturations {
        let (longer, bound) = show(saturation.bound);
        for (name, value) in longer {
            let _ = writeln!(text, "    {name} = {value}");
        }
        let name = &model.unknowns[saturation.unknown as usize].declared.name;
        let sign = match saturation.side {
            Bound::Lower => ">=",
            Bound::Upper => "<=",
        };
        let _ = writeln!(text, "  saturate {name} {sign} {bound}");
    }
    for automaton in &model.automata {
        let is_when = automaton.origin == Origin::When;
        if !is_when {
            let start = &automaton.modes[automaton.start].name;
            let _ = writeln!(text, "  modes {}, starts in {start}", automaton.name);
        }
        for mode in automaton.modes.iter().filter(|_| !is_when) {
            let _ = writeln!(text, "    {}", mode.name);
            for own in &mode.equations {
                equation(&mut text, "      ", own);
            }
        }
        for transition in &automaton.transitions {
            let to = &automaton.modes[transition.to].name;
            let Some(from) = transition.from.map(|mode| &automaton.modes[mode].name) else {
                let condition = match model.graph.node(transition.left) {
                    Node::Select(condition, ..) => condition,
                    _ => transition.left,
                };
                let (longer, condition) = show(condition);
                for (name, value) in longer {
                    let _ = writeln!(text, "      {name} = {value}");
                }
                let _ = writeln!(text, "    starts in {to} if {condition}");
                continue;
            };
            let crosses = transition.crossing.words();
            let ((longer_left, left), (longer_right, right)) =
                (show(transition.left), show(transition.right));
            for (name, value) in longer_left.into_iter().chain(longer_right) {
                let _ = writeln!(text, "      {name} = {value}");
            }
            let _ = if is_when {
                writeln!(text, "  when {left} {crosses} {right}")
            } else {
                writeln!(text, "    {from} -> {to} when {left} {crosses} {right}")
            };
            for reset in &transition.resets {
                let (longer, value) = show(reset.value);
                for (name, value) in longer {
                    let _ = writeln!(text, "        {name} = {value}");
                }
                let name = &model.unknowns[reset.unknown as usize].declared.name;
                let _ = writeln!(text, "      reset {name} = {value}");
            }
        }
    }
    for output in &model.outputs {
        let (longer, value) = show(output.value);
        for (name, value) in longer {
            let _ = writeln!(text, "    {name} = {value}");
        }
        let noise =
            output.noise.map_or(String::new(), |noise| format!("  noise {}", number(noise)));
        let _ = writeln!(text, "  output {} = {value}{noise}", head(&output.declared));
    }
    output_arrays(model, &mut text);
    text
}

/// Outputs for each element of an array.
fn output_arrays(model: &Model, text: &mut String) {
    for output in &model.output_arrays {
        let array = &model.arrays[output.array];
        let upper = array.lower + i64::from(array.count) - 1;
        let Declared { name, unit, .. } = &output.declared;
        let (lower, unit) = (array.lower, describe(unit.dimension));
        let noise =
            output.noise.map_or(String::new(), |noise| format!("  noise {}", number(noise)));
        let _ = writeln!(text, "  output {name}[{lower}..{upper}] [{unit}]{noise}");
    }
}

/// `p[3+_k]` of `p[3]`; no name of a model begins like that.
fn moving(element: &str) -> String {
    format!("{}+_k]", element.trim_end_matches(']'))
}

/// Name and SI unit.
fn head(declared: &Declared) -> String {
    format!("{} [{}]", declared.name, describe(declared.unit.dimension))
}

fn symbol_name(model: &Model, symbol: Symbol) -> String {
    let unknown = |i: u32| model.unknowns[i as usize].declared.name.clone();
    match symbol {
        Symbol::Time => "time".to_owned(),
        Symbol::Constant(i) => model.constants[i as usize].declared.name.clone(),
        Symbol::Parameter(i) => model.parameters[i as usize].declared.name.clone(),
        Symbol::Input(i) => model.inputs[i as usize].declared.name.clone(),
        Symbol::Unknown(i) => unknown(i),
        Symbol::Derivative(i) => format!("der({})", unknown(i)),
        Symbol::Element(i) => model.element_name(i),
        Symbol::ElementRate(i) => format!("der({})", model.element_name(i)),
        // In the first passage; the next has the next.
        Symbol::Swept(i) => moving(&model.element_name(i)),
        Symbol::SweptRate(i) => format!("der({})", moving(&model.element_name(i))),
        Symbol::Counter => "_k".to_owned(),
        Symbol::InputSlope(_)
        | Symbol::Sensitivity(_)
        | Symbol::SweptSensitivity(_)
        | Symbol::Discrete(_)
        | Symbol::Late(_)
        | Symbol::DelayedUnknown(_)
        | Symbol::Past(..) => {
            unreachable!("only later stages read slopes, sensitivities, modes and late values")
        }
    }
}
