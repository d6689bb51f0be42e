//! A program as text, for `dgd emit --stage program`.

use std::fmt;

use super::{
    Argument, Array, Direction, Entry, Factor, Family, Function, Loop, NoTaylor, Operation,
    OutputArray, Program, Recurrence, ResultKind, Run, Series, Store, Taylor, Transition, Trigger,
    ValueId,
};
use crate::expr::Past;
use crate::expr::display::number;
use crate::model::Declared;

impl fmt::Display for Program {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "program {}", self.name)?;
        for (i, unknown) in self.unknowns.iter().enumerate() {
            let row = match (unknown.by_mode, unknown.differential) {
                (true, _) => "0 or der(y)",
                (false, true) => "der(y)",
                (false, false) => "0",
            };
            let (name, unit) = (&unknown.name, &unknown.unit.symbol);
            writeln!(f, "  y[{i}] = {name} [{unit}]: {row} = f[{i}] by `{}`", unknown.equation)?;
        }
        for array in &self.arrays {
            let Array { name, unit, lower, first, count, .. } = array;
            let (end, upper) = (first + *count as usize - 1, lower + i64::from(*count) - 1);
            writeln!(f, "  y[{first}..{end}] = {name}[{lower}..{upper}] [{}]", unit.symbol)?;
        }
        for family in &self.families {
            let Family { first, count, differential, equation, .. } = family;
            let end = first + *count as usize - 1;
            let row = if *differential { "der(y)" } else { "0" };
            writeln!(f, "  y[{first}..{end}]: {row} = f[{first}..{end}] by `{equation}`")?;
        }
        let lists: [(&str, Vec<(&str, &str)>); 3] = [
            ("u", self.inputs.iter().map(|x| head(&x.declared)).collect()),
            ("p", self.parameters.iter().map(|x| head(&x.declared)).collect()),
            ("w", self.outputs.iter().map(|x| (&*x.name, &*x.unit.symbol)).collect()),
        ];
        for (array, list) in lists {
            for (i, (name, unit)) in list.iter().enumerate() {
                writeln!(f, "  {array}[{i}] = {name} [{unit}]")?;
            }
        }
        for array in &self.output_arrays {
            let OutputArray { name, unit, lower, first, count, .. } = array;
            let (end, upper) = (first + *count as usize - 1, lower + i64::from(*count) - 1);
            writeln!(f, "  w[{first}..{end}] = {name}[{lower}..{upper}] [{}]", unit.symbol)?;
        }
        for (i, delayed) in self.delayed_inputs.iter().enumerate() {
            let (name, tau) =
                (&self.inputs[delayed.input].declared.name, &self.delays[delayed.delay]);
            let value = self.inputs.len() + i;
            let slope = value + self.delayed_inputs.len();
            writeln!(f, "  u[{value}] = delay({name}, {tau}), u[{slope}] its slope")?;
        }
        for (k, delayed) in self.delayed_unknowns.iter().enumerate() {
            let name = &self.unknowns[delayed.unknown].name;
            let list = if delayed.varies { &self.varying_delays } else { &self.delays };
            let tau = &list[delayed.delay];
            let [held, value] = [Past::Held, Past::Value].map(|past| self.past().begin(past) + k);
            writeln!(f, "  u[{value}] = delay({name}, {tau}) where u[{held}] is 1")?;
        }
        for (i, tau) in self.delays.iter().enumerate() {
            writeln!(f, "  tau[{i}] = {tau}")?;
        }
        for (i, output) in self.outputs.iter().enumerate() {
            if let Some(delay) = output.delay {
                writeln!(f, "  w[{i}] is read at t - tau[{delay}]")?;
            }
        }
        for (j, direction) in self.directions.iter().enumerate() {
            match *direction {
                Direction::Parameter(i) => {
                    writeln!(f, "  theta[{j}] = {}", self.parameters[i].declared.name)?;
                }
                Direction::Start(i) => {
                    writeln!(f, "  theta[{j}] = {}(0)", self.unknowns[i].name)?;
                }
            }
        }
        for (k, automaton) in self.automata.iter().enumerate() {
            let (name, modes) = (&automaton.name, automaton.modes.join(", "));
            writeln!(f, "  z[{k}] = {name}: {modes}; starts in {}", automaton.start)?;
            for transition in &automaton.transitions {
                let Transition { from, to, crossing, trigger, resets } = transition;
                if *trigger == Trigger::Start {
                    writeln!(f, "    starts in {to}, {crossing:?}")?;
                    continue;
                }
                let acts = match trigger {
                    Trigger::Edge => "",
                    Trigger::Level => ", at any time",
                    Trigger::Entry => ", on entry",
                    Trigger::Start => ", at the start",
                };
                writeln!(f, "    {from} -> {to}, {crossing:?}{acts}, resets {resets:?}")?;
            }
        }
        for k in self.automata.len()..self.n_discrete() {
            writeln!(f, "  z[{k}] switches at a time")?;
        }
        let shown = |kind: &ResultKind| !self.automata.is_empty() || !kind.is_of_modes();
        for (kind, pattern) in self.patterns.iter().filter(|(kind, _)| shown(kind)) {
            let mut places: Vec<String> =
                pattern.iter().map(|(r, c)| format!("({r},{c})")).collect();
            for Run { row, column, diagonal, count } in self.runs.get(kind).into_iter().flatten() {
                let moves = if *diagonal { "+k" } else { "" };
                places.push(format!("({row}+k,{column}{moves}) for k < {count}"));
            }
            writeln!(f, "pattern {kind:?}: {}", places.join(" "))?;
        }
        let mut functions = self.functions.iter().filter(|function| self.computes(function.kind));
        functions.try_for_each(|function| write!(f, "{function}"))?;
        match &self.taylor {
            Ok(Taylor { unknowns, sensitivities }) => {
                write!(f, "\nseries of f\n{unknowns}")?;
                write!(f, "\nseries of f and its derivatives\n{sensitivities}")
            }
            Err(NoTaylor::Algebraic) => {
                writeln!(f, "\nno Taylor series: unknowns are algebraic, always or in some modes")
            }
            Err(NoTaylor::Delays) => writeln!(f, "\nno Taylor series: unknowns are read late"),
            Err(NoTaylor::Arrays) => writeln!(f, "\nno Taylor series: unknowns are arrays"),
        }
    }
}

/// Values at the beginning, then the coefficient of order k of those that move.
impl fmt::Display for Series {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut names = self.names.iter().peekable();
        for (i, operation) in self.body.iter().enumerate() {
            write!(f, "  %{i} = {operation}")?;
            if let Some((_, name)) = names.next_if(|(value, _)| value.index() == i) {
                write!(f, "    # {name}")?;
            }
            writeln!(f)?;
        }
        for (i, recurrence) in self.recurrences.iter().enumerate() {
            if let Some(recurrence) = recurrence {
                writeln!(f, "  %{i}[k] = {}", self.spelt(ValueId(i as u32), *recurrence))?;
            }
        }
        let f_row: Vec<String> = self.f.iter().map(ToString::to_string).collect();
        writeln!(f, "  f = [{}]", f_row.join(", "))?;
        for (name, entries) in [("df/dy", &self.jacobian), ("df/dtheta", &self.directions)] {
            for Entry { row, column, value } in entries {
                writeln!(f, "  {name}({row},{column}) = {value}")?;
            }
        }
        Ok(())
    }
}

impl Series {
    /// A recurrence as a formula of whole series, or of their coefficients where it is linear.
    fn spelt(&self, own: ValueId, recurrence: Recurrence) -> String {
        let part = |a: Option<ValueId>| a.map_or("0".to_owned(), |a| format!("{a}[k]"));
        match recurrence {
            Recurrence::Time => "h for k = 1".to_owned(),
            Recurrence::Input(i) => format!("h udot[{i}] for k = 1"),
            Recurrence::Unknown(i) => format!("y[{i}][k]"),
            Recurrence::Linear { first, count } => {
                let terms =
                    self.terms[first..first + count].iter().map(|(factor, a)| match factor {
                        Factor::One => format!("{a}[k]"),
                        Factor::MinusOne => format!("-{a}[k]"),
                        Factor::Of(c) => format!("{c} * {a}[k]"),
                    });
                terms.collect::<Vec<_>>().join(" + ")
            }
            Recurrence::Multiply(a, b) | Recurrence::MultiplyLine(a, b) => {
                format!("({a} * {b})[k]")
            }
            Recurrence::Square(a) => format!("({a}^2)[k]"),
            Recurrence::Divide(a, b, _) => {
                format!("({} - ({b} * {own})[k])/{b}", part(a))
            }
            Recurrence::Chain(x, d) => format!("integral of {d} d{x}"),
            Recurrence::Root(a, _) => format!("sqrt({a})[k]"),
            Recurrence::Log(a, _) => format!("log({a})[k]"),
            Recurrence::Power(a, exponent, _) => format!("({a}^{exponent})[k]"),
            Recurrence::Magnitude(a) => format!("abs({a})[k]"),
            Recurrence::Select(c, a, b) => format!("if {c} then {} else {}", part(a), part(b)),
        }
    }
}

/// Name and unit.
fn head(declared: &Declared) -> (&str, &str) {
    (&declared.name, &declared.unit.symbol)
}

impl fmt::Display for Function {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let spec = self.kind.spec();
        writeln!(f, "\nfunction {}", spec.name)?;
        let mut names = self.names.iter().peekable();
        for (i, operation) in self.body.iter().enumerate() {
            write!(f, "  %{i} = {operation}")?;
            if let Some((_, name)) = names.next_if(|(value, _)| value.index() == i) {
                write!(f, "    # {name}")?;
            }
            writeln!(f)?;
        }
        for ((result, values), places) in spec.results.iter().zip(&self.results).zip(&self.places) {
            let values = values.iter().enumerate().map(|(i, value)| match places {
                None => value.to_string(),
                Some(places) => format!("[{}] = {value}", places[i]),
            });
            let values: Vec<String> = values.collect();
            writeln!(f, "  {result:?} = [{}]", values.join(", "))?;
        }
        for Loop { count, body, stores } in &self.loops {
            writeln!(f, "  for k in 0..{}", count - 1)?;
            for (i, operation) in body.iter().enumerate() {
                writeln!(f, "    %{} = {operation}", self.body.len() + i)?;
            }
            for Store { result, first, value } in stores {
                writeln!(f, "    {:?}[{first}+k] = {value}", spec.results[*result])?;
            }
        }
        Ok(())
    }
}

impl fmt::Display for ValueId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "%{}", self.0)
    }
}

impl fmt::Display for Operation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Operation::Constant(value) => write!(f, "{}", number(value)),
            Operation::Time => write!(f, "t"),
            Operation::LoadSwept(argument, i) => write!(f, "{}[{i}+k]", argument.symbol()),
            Operation::Counter => write!(f, "k"),
            Operation::Load(argument, i) => write!(f, "{}[{i}]", argument.symbol()),
            Operation::Negate(a) => write!(f, "-{a}"),
            Operation::Add(a, b) => write!(f, "{a} + {b}"),
            Operation::Subtract(a, b) => write!(f, "{a} - {b}"),
            Operation::Multiply(a, b) => write!(f, "{a} * {b}"),
            Operation::Divide(a, b) => write!(f, "{a} / {b}"),
            Operation::Call1(function, a) => write!(f, "{}({a})", function.get().name),
            Operation::Call2(function, a, b) => write!(f, "{}({a}, {b})", function.get().name),
            Operation::Compare(c, a, b) => write!(f, "{a} {} {b}", c.spelling()),
            Operation::And(a, b) => write!(f, "{a} and {b}"),
            Operation::Or(a, b) => write!(f, "{a} or {b}"),
            Operation::Not(a) => write!(f, "not {a}"),
            Operation::Select(c, a, b) => write!(f, "if {c} then {a} else {b}"),
        }
    }
}

impl Argument {
    /// As formulas write it.
    pub fn symbol(self) -> &'static str {
        match self {
            Argument::Y => "y",
            Argument::U => "u",
            Argument::P => "p",
            Argument::Udot => "udot",
            Argument::S => "s",
            Argument::Z => "z",
        }
    }
}
