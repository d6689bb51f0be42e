//! A model as text, for `dgd emit --stage model`: the resolved model, in SI units.

use std::collections::BTreeMap;
use std::fmt::Write;

use dgd_signature::Distribution;

use super::{
    Array, Automaton, AutomatonOrigin, BoundSide, DeclarationHeader, Density, Equation,
    Interpolation, Model, Parameter, Smoothness, Transition, Unknown,
};
use crate::expr::display::{listing, number};
use crate::expr::{ExprId, Node, Symbol};
use crate::units::describe;

/// Writes a model as text.
pub fn write(model: &Model) -> String {
    let mut writer = SectionWriter { model, names: model.let_names(), text: String::new() };
    writer.line("", &format!("model {}", model.name));
    writer.choices();
    writer.values();
    writer.lets();
    writer.unknowns();
    writer.equations();
    writer.saturations();
    for automaton in &model.automata {
        writer.automaton(automaton);
    }
    writer.outputs();
    writer.text
}

/// Writes one section after another.
struct SectionWriter<'a> {
    model: &'a Model,
    /// Names of expressions.
    names: BTreeMap<ExprId, String>,
    text: String,
}

impl SectionWriter<'_> {
    fn line(&mut self, indent: &str, content: &str) {
        let _ = writeln!(self.text, "{indent}{content}");
    }

    /// An expression; long subexpressions are written above it, with names of their own.
    fn shown(&mut self, indent: &str, id: ExprId) -> String {
        let [text] = self.all_shown(indent, [id]);
        text
    }

    /// Expressions; long subexpressions are written above them.
    fn all_shown<const N: usize>(&mut self, indent: &str, ids: [ExprId; N]) -> [String; N] {
        ids.map(|id| {
            let mut unnamed = self.names.clone();
            unnamed.remove(&id);
            let symbol = |symbol| symbol_name(self.model, symbol);
            let listing = listing(&self.model.graph, &[id], &unnamed, &symbol);
            // Other `let`s appear by name.
            for (name, value) in listing.lines.iter().filter(|(name, _)| name.starts_with('_')) {
                let _ = writeln!(self.text, "{indent}{name} = {value}");
            }
            listing.roots[0].clone()
        })
    }

    /// Parts, variants and sizes.
    fn choices(&mut self) {
        for part in &self.model.parts {
            self.line("  ", &format!("part {}: {}", part.name, part.model));
        }
        for variant in &self.model.variants {
            let chosen = &variant.choices[variant.chosen];
            self.line("  ", &format!("variant {} = {chosen}", variant.name));
        }
        for (name, size) in &self.model.sizes {
            self.line("  ", &format!("size {} = {size}", name.text));
        }
    }

    /// Constants, inputs, parameters and the smoothness of tables.
    fn values(&mut self) {
        for constant in &self.model.constants {
            let value = number(constant.value);
            self.line("  ", &format!("constant {} = {value}", head(&constant.declared)));
        }
        for input in &self.model.inputs {
            let hold = match input.interpolation {
                Interpolation::Hold => "hold",
                Interpolation::Linear => "linear",
            };
            self.line("  ", &format!("input {} {hold}", head(&input.declared)));
        }
        for parameter in &self.model.parameters {
            self.line("  ", &parameter_text(parameter));
        }
        for Smoothness { table, weights, mean, std } in &self.model.smoothness {
            let weighted = |(i, weight): &(u32, f64)| {
                format!("{} {}", number(*weight), self.model.parameters[*i as usize].declared.name)
            };
            let sum = weights.iter().map(weighted).collect::<Vec<_>>().join(" + ");
            let (mean, std) = (number(*mean), number(*std));
            self.line("  ", &format!("smooth {table}: {sum} ~ normal({mean}, {std})"));
        }
    }

    fn lets(&mut self) {
        for l in &self.model.lets {
            let value = self.shown("    ", l.value);
            self.line("  ", &format!("let {} [{}] = {value}", l.name, describe(l.dimension)));
        }
    }

    /// Unknowns and arrays of unknowns, with their start values.
    fn unknowns(&mut self) {
        for unknown in &self.model.unknowns {
            let (kind, head) = (kind_of(unknown), head(&unknown.declared));
            let start = self.shown("    ", unknown.start);
            self.line("  ", &format!("{kind} {head} = {start}"));
            self.history(unknown);
        }
        for array in &self.model.arrays {
            let kind = kind_of(&array.unknown);
            let range = range_of(array, &array.unknown.declared);
            let start = self.shown("    ", array.unknown.start);
            self.line("  ", &format!("{kind} {range} = {start}"));
            self.history(&array.unknown);
        }
    }

    fn history(&mut self, unknown: &Unknown) {
        if let Some(history) = unknown.history {
            let history = self.shown("      ", history);
            self.line("    ", &format!("history = {history}"));
        }
    }

    /// Equations that hold in all modes, then those of loops.
    fn equations(&mut self) {
        for equation in &self.model.equations {
            self.equation("  ", equation);
        }
        for family in &self.model.families {
            let upper = family.lower + i64::from(family.count) - 1;
            let (index, lower) = (&family.index, family.lower);
            self.line("  ", &format!("for {index} in {lower}..{upper}, {index} = {lower} + _k"));
            self.equation("    ", &family.equation);
        }
    }

    fn equation(&mut self, indent: &str, equation: &Equation) {
        let sides = [equation.left, equation.right];
        let [left, right] = self.all_shown(&format!("{indent}  "), sides);
        let exact = if equation.is_exact { " exact" } else { "" };
        self.line(indent, &format!("equation {}: {left} = {right}{exact}", equation.label));
    }

    fn saturations(&mut self) {
        for saturation in &self.model.saturations {
            let bound = self.shown("    ", saturation.bound);
            let name = self.model.unknown_name(saturation.unknown);
            let sign = match saturation.side {
                BoundSide::Lower => ">=",
                BoundSide::Upper => "<=",
            };
            self.line("  ", &format!("saturate {name} {sign} {bound}"));
        }
    }

    /// A `modes` block or a `when`.
    fn automaton(&mut self, automaton: &Automaton) {
        if automaton.origin == AutomatonOrigin::Modes {
            let start = &automaton.modes[automaton.start].name;
            self.line("  ", &format!("modes {}, starts in {start}", automaton.name));
            for mode in &automaton.modes {
                self.line("    ", &mode.name);
                for equation in &mode.equations {
                    self.equation("      ", equation);
                }
            }
        }
        for transition in &automaton.transitions {
            match transition.from {
                None => self.start_mode(automaton, transition),
                Some(from) => self.transition(automaton, from, transition),
            }
        }
    }

    /// The condition that selects an initial mode.
    fn start_mode(&mut self, automaton: &Automaton, transition: &Transition) {
        let condition = match self.model.graph.node(transition.left) {
            Node::Select(condition, ..) => condition,
            _ => transition.left,
        };
        let condition = self.shown("      ", condition);
        let target = &automaton.modes[transition.to].name;
        self.line("    ", &format!("starts in {target} if {condition}"));
    }

    fn transition(&mut self, automaton: &Automaton, from: usize, transition: &Transition) {
        let [left, right] = self.all_shown("      ", [transition.left, transition.right]);
        let condition = format!("when {left} {} {right}", transition.crossing.words());
        match automaton.origin {
            AutomatonOrigin::When => self.line("  ", &condition),
            AutomatonOrigin::Every => {
                let times = automaton.period.map(|times| self.all_shown("      ", times));
                let [first, period] = times.unwrap_or_default();
                let offset = if first == "0" { String::new() } else { format!(" offset {first}") };
                self.line("  ", &format!("every {period}{offset}"));
            }
            AutomatonOrigin::Modes => {
                let [from, to] = [from, transition.to].map(|mode| &automaton.modes[mode].name);
                self.line("    ", &format!("{from} -> {to} {condition}"));
            }
        }
        for reset in &transition.resets {
            let value = self.shown("        ", reset.value);
            let name = self.model.unknown_name(reset.unknown);
            self.line("      ", &format!("reset {name} = {value}"));
        }
    }

    fn density_text(&self, density: &Density) -> String {
        let sigma = &self.model.outputs[density.deviation].declared.name;
        match density.distribution {
            Distribution::Normal => format!("  noise {sigma}"),
            Distribution::LogNormal => format!("  noise lognormal({sigma})"),
            Distribution::Student { freedom } => {
                format!("  noise student({}, {sigma})", number(freedom))
            }
        }
    }

    /// Outputs, then those for each element of an array.
    fn outputs(&mut self) {
        for (i, output) in self.model.outputs.iter().enumerate() {
            let value = self.shown("    ", output.value);
            let mut of_output = self.model.densities.iter().filter(|density| density.output == i);
            let noise = match of_output.next() {
                Some(density) => self.density_text(density),
                None => noise_text(output.noise),
            };
            let head = head(&output.declared);
            self.line("  ", &format!("output {head} = {value}{noise}"));
        }
        for output in &self.model.output_arrays {
            let range = range_of(&self.model.arrays[output.array], &output.declared);
            self.line("  ", &format!("output {range}{}", noise_text(output.noise)));
        }
    }
}

/// `parameter k [m] = 1 in 0 .. 2, log`
fn parameter_text(parameter: &Parameter) -> String {
    let mut text = format!("parameter {} = {}", head(&parameter.declared), number(parameter.value));
    if parameter.lower.is_finite() || parameter.upper.is_finite() {
        let end = |x: f64| if x.is_finite() { number(x) } else { String::new() };
        let _ = write!(text, " in {} .. {}", end(parameter.lower), end(parameter.upper));
        text.truncate(text.trim_end().len());
    }
    for (flag, word) in [(parameter.log, ", log"), (parameter.fixed, ", fixed")] {
        if flag {
            text.push_str(word);
        }
    }
    text
}

fn kind_of(unknown: &Unknown) -> &'static str {
    if unknown.state { "state" } else { "unknown" }
}

fn noise_text(noise: Option<f64>) -> String {
    noise.map_or(String::new(), |noise| format!("  noise {}", number(noise)))
}

/// `p[1..4] [Pa]`
fn range_of(array: &Array, declared: &DeclarationHeader) -> String {
    let (lower, upper) = (array.lower, array.lower + i64::from(array.count) - 1);
    format!("{}[{lower}..{upper}] [{}]", declared.name, describe(declared.unit.dimension))
}

/// `p[3+_k]` for `p[3]`; no name of a model begins with `_k`.
fn moving(element: &str) -> String {
    format!("{}+_k]", element.trim_end_matches(']'))
}

/// Name and SI unit.
fn head(declared: &DeclarationHeader) -> String {
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
        // In the first passage; later passages read later elements.
        Symbol::Swept(i) => moving(&model.element_name(i)),
        Symbol::SweptRate(i) => format!("der({})", moving(&model.element_name(i))),
        Symbol::SweptParameter(i, _) => moving(&model.parameters[i as usize].declared.name),
        Symbol::SweptInput(i, _) => moving(&model.inputs[i as usize].declared.name),
        Symbol::Counter => "_k".to_owned(),
        Symbol::InputSlope(_)
        | Symbol::SweptInputSlope(..)
        | Symbol::Sensitivity(_)
        | Symbol::SweptSensitivity(_)
        | Symbol::Discrete(_)
        | Symbol::Delayed(_)
        | Symbol::DelayedUnknown(_)
        | Symbol::Past(..) => {
            unreachable!("only later stages read slopes, sensitivities, modes and late values")
        }
    }
}
