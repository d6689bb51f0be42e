//! A program as text, for `dgd emit --stage program`.

use std::fmt;

use dgd_signature::arrays::{Array, Family, OutputArray, PatternRun};
use dgd_signature::{Direction, Discrete, Signature, Transition, Trigger, Unknowns};

use super::{
    ConstantFactor, FunctionArgument, FunctionKind, Loop, LoopStore, MatrixEntry, NoTaylor,
    Program, ProgramFunction, ProgramOperation, RUNS, Recurrence, ResultKind, SharedSeries,
    StridedPosition, TaylorSeries, ValueId,
};
use crate::expr::display::number;

impl fmt::Display for Program {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let signature = &self.signature;
        writeln!(f, "program {}", signature.name)?;
        write_unknowns(self, f)?;
        let lists: [(&str, Vec<(&str, &str)>); 3] = [
            ("u", signature.inputs.iter().map(|x| (&*x.name, &*x.unit.symbol)).collect()),
            ("p", signature.parameters.iter().map(|x| (&*x.name, &*x.unit.symbol)).collect()),
            ("w", self.single_outputs().iter().map(|x| (&*x.name, &*x.unit.symbol)).collect()),
        ];
        for (array, list) in lists {
            for (i, (name, unit)) in list.iter().enumerate() {
                writeln!(f, "  {array}[{i}] = {name} [{unit}]")?;
            }
        }
        let mut first = self.single_outputs().len();
        for OutputArray { name, unit, lower, count, .. } in &self.output_arrays {
            let (end, upper) =
                (first + count - 1, lower.saturating_add_unsigned(*count as u64) - 1);
            writeln!(f, "  w[{first}..{end}] = {name}[{lower}..{upper}] [{}]", unit.symbol)?;
            first += count;
        }
        write_delays(signature, f)?;
        for (j, direction) in signature.directions.iter().enumerate() {
            match *direction {
                Direction::Parameter(i) => {
                    writeln!(f, "  theta[{j}] = {}", signature.parameters[i].name)?;
                }
                Direction::Start(i) => {
                    writeln!(f, "  theta[{j}] = {}(0)", signature.unknowns.name(i))?;
                }
            }
        }
        write_discrete(&signature.discrete, f)?;
        let shown =
            |kind: &ResultKind| !signature.discrete.automata.is_empty() || !kind.is_of_modes();
        let of_events = [
            ResultKind::EventJacobian,
            ResultKind::EventDirections,
            ResultKind::ResetJacobian,
            ResultKind::ResetDirections,
        ];
        let of_jumps = self.computes(FunctionKind::Jumps).then_some(ResultKind::JumpJacobian);
        for kind in RUNS.into_iter().chain(of_events).filter(shown).chain(of_jumps) {
            let Some(pattern) = self.pattern(kind) else { continue };
            let single = pattern.rows.iter().zip(pattern.columns.iter());
            let mut places: Vec<String> = single.map(|(r, c)| format!("({r},{c})")).collect();
            for PatternRun { row, column, diagonal, count } in pattern.runs.iter() {
                let moves = if *diagonal { "+k" } else { "" };
                places.push(format!("({row}+k,{column}{moves}) for k < {count}"));
            }
            writeln!(f, "pattern {kind:?}: {}", places.join(" "))?;
        }
        let mut functions = self.functions.iter().filter(|function| self.computes(function.kind));
        functions.try_for_each(|function| write!(f, "{function}"))?;
        match &self.taylor {
            Ok(TaylorSeries { unknowns, sensitivities }) => {
                write!(f, "\nseries of f\n{unknowns}")?;
                write!(f, "\nseries of f and its derivatives\n{sensitivities}")
            }
            Err(NoTaylor::Algebraic) => {
                writeln!(f, "\nno Taylor series: unknowns are algebraic, always or in some modes")
            }
            Err(NoTaylor::Delays) => writeln!(f, "\nno Taylor series: unknowns are read late"),
            Err(NoTaylor::Arrays) => writeln!(f, "\nno Taylor series: unknowns are arrays"),
            Err(NoTaylor::Functions) => {
                writeln!(f, "\nno Taylor series: a function has ever new derivatives")
            }
        }
    }
}

/// Unknowns and the rows that determine them.
fn write_unknowns(program: &Program, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let Unknowns { single, arrays, families } = &program.signature.unknowns;
    for (i, (unknown, own)) in single.iter().zip(&program.source.rows).enumerate() {
        let row = match (own.by_mode, unknown.differential) {
            (true, _) => "0 or der(y)",
            (false, true) => "der(y)",
            (false, false) => "0",
        };
        let (name, unit) = (&unknown.name, &unknown.unit.symbol);
        let equation = program.signature.equations.get(i);
        writeln!(f, "  y[{i}] = {name} [{unit}]: {row} = f[{i}] by `{equation}`")?;
    }
    let mut first = single.len();
    for Array { name, unit, lower, count, .. } in arrays.iter() {
        let (end, upper) = (first + count - 1, lower.saturating_add_unsigned(*count as u64) - 1);
        writeln!(f, "  y[{first}..{end}] = {name}[{lower}..{upper}] [{}]", unit.symbol)?;
        first += count;
    }
    let mut first = single.len();
    for Family { count, differential, equation, .. } in families.iter() {
        let end = first + count - 1;
        let row = if *differential { "der(y)" } else { "0" };
        writeln!(f, "  y[{first}..{end}]: {row} = f[{first}..{end}] by `{equation}`")?;
        first += count;
    }
    Ok(())
}

/// Delayed outputs, inputs and unknowns.
fn write_delays(signature: &Signature, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let Signature { inputs, delays, delayed_inputs, .. } = signature;
    for (i, delayed) in delayed_inputs.iter().enumerate() {
        let (name, tau) = (&inputs[delayed.input].name, &delays[delayed.delay]);
        let value = inputs.len() + i;
        let slope = value + delayed_inputs.len();
        writeln!(f, "  u[{value}] = delay({name}, {tau}), u[{slope}] its slope")?;
    }
    for (k, delayed) in signature.delayed_unknowns.iter().enumerate() {
        let name = &signature.unknowns.single[delayed.unknown].name;
        let list = if delayed.varies { &signature.varying_delays } else { delays };
        let tau = &list[delayed.delay];
        let past = signature.past();
        let [held, value] = [past.held(), past.values()].map(|numbers| numbers.start + k);
        writeln!(f, "  u[{value}] = delay({name}, {tau}) where u[{held}] is 1")?;
    }
    for (i, tau) in delays.iter().enumerate() {
        writeln!(f, "  tau[{i}] = {tau}")?;
    }
    for (i, output) in signature.outputs.iter().enumerate() {
        if let Some(delay) = output.delay {
            writeln!(f, "  w[{i}] is read at t - tau[{delay}]")?;
        }
    }
    Ok(())
}

/// Automata, their transitions, and conditions on time.
fn write_discrete(discrete: &Discrete, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    for (k, automaton) in discrete.automata.iter().enumerate() {
        let (name, modes) = (&automaton.name, automaton.modes.join(", "));
        writeln!(f, "  z[{k}] = {name}: {modes}; starts in {}", automaton.start)?;
        for transition in automaton.transitions.iter() {
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
                Trigger::Clock => ", at ticks",
            };
            writeln!(f, "    {from} -> {to}, {crossing:?}{acts}, resets {resets:?}")?;
        }
    }
    for k in 0..discrete.n_time_conditions {
        let z = discrete.automata.len() + k;
        let clock = |condition: usize| discrete.clocks.iter().any(|c| c.condition == condition);
        match (clock(k), k.checked_sub(1).is_some_and(clock)) {
            (true, _) => writeln!(f, "  z[{z}] counts from a time")?,
            (false, true) => writeln!(f, "  z[{z}] is the period of that")?,
            (false, false) => writeln!(f, "  z[{z}] switches at a time")?,
        }
    }
    Ok(())
}

/// Initial values, then the coefficients of order k of those that vary.
impl fmt::Display for SharedSeries {
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
            for MatrixEntry { row, column, value } in entries {
                writeln!(f, "  {name}({row},{column}) = {value}")?;
            }
        }
        Ok(())
    }
}

impl SharedSeries {
    /// A recurrence as a formula of whole series, or of their coefficients if it is linear.
    fn spelt(&self, own: ValueId, recurrence: Recurrence) -> String {
        let part = |a: Option<ValueId>| a.map_or("0".to_owned(), |a| format!("{a}[k]"));
        match recurrence {
            Recurrence::Time => "h for k = 1".to_owned(),
            Recurrence::Input(i) => format!("h udot[{i}] for k = 1"),
            Recurrence::Unknown(i) => format!("y[{i}][k]"),
            Recurrence::Linear { first, count } => {
                let terms =
                    self.terms[first..first + count].iter().map(|(factor, a)| match factor {
                        ConstantFactor::One => format!("{a}[k]"),
                        ConstantFactor::MinusOne => format!("-{a}[k]"),
                        ConstantFactor::Of(c) => format!("{c} * {a}[k]"),
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

impl fmt::Display for ProgramFunction {
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
        for Loop { rounds, head, count, body, stores } in &self.loops {
            let mut value = self.body.len()..;
            let mut write_all = |f: &mut fmt::Formatter<'_>, operations: &[ProgramOperation]| {
                let mut remaining = operations.iter().zip(&mut value);
                remaining.try_for_each(|(operation, k)| writeln!(f, "    %{k} = {operation}"))
            };
            if *rounds > 1 {
                writeln!(f, "  for r in 0..{}", rounds - 1)?;
                write_all(f, head)?;
            }
            if *count > 1 {
                writeln!(f, "  for k in 0..{}", count - 1)?;
            }
            write_all(f, body)?;
            for LoopStore { result, first, by_round, value } in stores {
                let (result, by) = (spec.results[*result], RoundOffset(*by_round as i64));
                let k = if *count > 1 { "+k" } else { "" };
                writeln!(f, "    {result:?}[{first}{by}{k}] = {value}")?;
            }
        }
        Ok(())
    }
}

/// Displacement of a position in round r.
struct RoundOffset(i64);

impl fmt::Display for RoundOffset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            0 => Ok(()),
            1 => write!(f, "+r"),
            -1 => write!(f, "-r"),
            by => write!(f, "{by:+}*r"),
        }
    }
}

impl fmt::Display for ValueId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "%{}", self.0)
    }
}

impl fmt::Display for ProgramOperation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            ProgramOperation::Constant(value) => write!(f, "{}", number(value)),
            ProgramOperation::Time => write!(f, "t"),
            ProgramOperation::LoadSwept(argument, StridedPosition { first, by_round }) => {
                write!(f, "{}[{first}{}+k]", argument.symbol(), RoundOffset(by_round.into()))
            }
            ProgramOperation::LoadRound(argument, StridedPosition { first, by_round }) => {
                write!(f, "{}[{first}{}]", argument.symbol(), RoundOffset(by_round.into()))
            }
            ProgramOperation::Counter => write!(f, "k"),
            ProgramOperation::Round => write!(f, "r"),
            ProgramOperation::Load(argument, i) => write!(f, "{}[{i}]", argument.symbol()),
            ProgramOperation::Negate(a) => write!(f, "-{a}"),
            ProgramOperation::Add(a, b) => write!(f, "{a} + {b}"),
            ProgramOperation::Subtract(a, b) => write!(f, "{a} - {b}"),
            ProgramOperation::Multiply(a, b) => write!(f, "{a} * {b}"),
            ProgramOperation::Divide(a, b) => write!(f, "{a} / {b}"),
            ProgramOperation::Call1(function, a) => write!(f, "{}({a})", function.get().name),
            ProgramOperation::Call2(function, a, b) => {
                write!(f, "{}({a}, {b})", function.get().name)
            }
            ProgramOperation::Curve(curve, a) => write!(f, "{}({a})", curve.get().name),
            ProgramOperation::Compare(c, a, b) => write!(f, "{a} {} {b}", c.spelling()),
            ProgramOperation::And(a, b) => write!(f, "{a} and {b}"),
            ProgramOperation::Or(a, b) => write!(f, "{a} or {b}"),
            ProgramOperation::Not(a) => write!(f, "not {a}"),
            ProgramOperation::Select(c, a, b) => write!(f, "if {c} then {a} else {b}"),
        }
    }
}

impl FunctionArgument {
    /// Its symbol in formulas.
    pub fn symbol(self) -> &'static str {
        match self {
            FunctionArgument::Y => "y",
            FunctionArgument::U => "u",
            FunctionArgument::P => "p",
            FunctionArgument::Udot => "udot",
            FunctionArgument::S => "s",
            FunctionArgument::Z => "z",
        }
    }
}
