//! The table of forms in random models: one row, with a weight, for each form of the language.

use std::fmt::Write;

use super::quantity::{Kind, Known, SCALES, Scale};
use super::{Function, Reads, Writer};

/// Places for a form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A dimensionless expression that is not composed.
    Leaf,
    /// A dimensionless expression.
    Scalar,
    /// A quantity of the wanted dimension.
    Quantity,
    /// A condition.
    Condition,
    /// An item: a constant or a parameter.
    Value,
    /// An item: an input.
    Input,
    /// An item: a state.
    State,
    /// Several items that belong together: an array with its loop, a part, tied states.
    Whole,
    /// An item before equations: `let`, `function`.
    Between,
    /// An unknown with its equation.
    Unknown,
    /// The equation of a state.
    Equation,
    /// An item next to equations, such as `when` or `saturate`, with its prerequisites.
    Beside,
    /// An output.
    Output,
    /// A clause of an effect on the model.
    Effect,
}

/// A form of the language.
pub struct Row {
    /// Its name, for `--without`.
    pub what: &'static str,
    /// Its place.
    pub place: Place,
    /// Its frequency relative to the others of its place.
    pub weight: u32,
    pub(crate) write: fn(&mut Writer, u32) -> String,
}

const fn row(
    place: Place,
    weight: u32,
    what: &'static str,
    write: fn(&mut Writer, u32) -> String,
) -> Row {
    Row { what, place, weight, write }
}

use Place::{
    Beside, Between, Condition, Effect, Equation, Input, Leaf, Output, Quantity, Scalar, State,
    Unknown, Value, Whole,
};

/// The table.
pub const TABLE: &[Row] = &[
    row(Leaf, 2, "number", |w, _| w.number()),
    row(Leaf, 10, "name", |w, _| w.read()),
    row(Leaf, 1, "time", |w, _| time(w, "time/1 [s]")),
    row(Leaf, 1, "pi", |_, _| "pi/3".to_owned()),
    row(Leaf, 1, "delay of an input", |w, _| delayed(w, Kind::Input)),
    row(Leaf, 1, "delay of a state", |w, _| delayed(w, Kind::State)),
    row(Leaf, 1, "delay that varies", |w, _| {
        if w.reads != Reads::All || w.index.is_some() || !w.arguments.is_empty() {
            return w.read();
        }
        let states = w.of_kind(Kind::State);
        if states.is_empty() || w.random.chance(0.6) {
            return w.read();
        }
        let x = w.random.pick(&states).clone();
        let tau = format!("({} + 0.1*sin(time/1 [s]))*1 [s]", w.random.below(3) + 1);
        x.scale.over_size(&format!("delay({}, {tau})", x.name), None)
    }),
    // Sums and products.
    row(Scalar, 8, "a + b", |w, d| format!("({} + {})", w.scalar(d), w.scalar(d))),
    row(Scalar, 8, "a - b", |w, d| format!("({} - {})", w.scalar(d), w.scalar(d))),
    row(Scalar, 10, "a * b", |w, d| format!("({} * {})", w.scalar(d), w.scalar(d))),
    row(Scalar, 3, "-a", |w, d| format!("(-{})", w.scalar(d))),
    row(Scalar, 4, "a/(1 + b^2)", |w, d| format!("({})/(1 + ({})^2)", w.scalar(d), w.scalar(d))),
    row(Scalar, 2, "a/b", |w, d| format!("({})/(2 + sin({}))", w.scalar(d), w.scalar(d))),
    row(Scalar, 6, "leaf", |w, _| w.scalar(0)),
    // Powers.
    row(Scalar, 4, "a^2", |w, d| format!("({})^2", w.scalar(d))),
    row(Scalar, 2, "a^3", |w, d| format!("({})^3", w.scalar(d))),
    row(Scalar, 1, "a^-1", |w, d| format!("(1.5 + ({})^2)^-1", w.scalar(d))),
    row(Scalar, 1, "a^-2^1", |w, d| format!("(-(1 + ({})^2)^-2^1)", w.scalar(d))),
    row(Scalar, 1, "a^(3/2)", |w, d| format!("(0.5 + ({})^2)^(3/2)", w.scalar(d))),
    row(Scalar, 1, "a^b", |w, d| format!("(1 + ({})^2)^tanh({})", w.scalar(d), w.scalar(d))),
    row(Scalar, 1, "a^constant", |w, _| {
        let outer = std::mem::replace(&mut w.reads, Reads::Parameters);
        let exponent = w.scalar(1);
        w.reads = outer;
        format!("(1 + abs({}))^tanh({exponent})", w.scalar(0))
    }),
    // Functions.
    row(Scalar, 2, "sqrt", |w, d| format!("sqrt(1 + ({})^2)", w.scalar(d))),
    row(Scalar, 2, "exp(-a^2)", |w, d| format!("exp(-({})^2)", w.scalar(d))),
    row(Scalar, 1, "exp", |w, d| format!("exp(tanh({}))", w.scalar(d))),
    row(Scalar, 2, "log", |w, d| format!("log(1.5 + ({})^2)", w.scalar(d))),
    row(Scalar, 1, "log10", |w, d| format!("log10(2 + sin({}))", w.scalar(d))),
    row(Scalar, 3, "sin", |w, d| format!("sin({})", w.scalar(d))),
    row(Scalar, 3, "cos", |w, d| format!("cos({})", w.scalar(d))),
    row(Scalar, 1, "tan", |w, d| format!("tan(0.9*tanh({}))", w.scalar(d))),
    row(Scalar, 1, "asin", |w, d| format!("asin(0.9*sin({}))", w.scalar(d))),
    row(Scalar, 1, "acos", |w, d| format!("acos(0.9*cos({}))", w.scalar(d))),
    row(Scalar, 1, "atan", |w, d| format!("atan({})", w.scalar(d))),
    row(Scalar, 2, "atan2", |w, d| format!("atan2({}, 2 + cos({}))", w.scalar(d), w.scalar(d))),
    row(Scalar, 1, "sinh", |w, d| format!("sinh(tanh({}))", w.scalar(d))),
    row(Scalar, 1, "cosh", |w, d| format!("cosh(sin({}))", w.scalar(d))),
    row(Scalar, 3, "tanh", |w, d| format!("tanh({})", w.scalar(d))),
    row(Scalar, 1, "erf", |w, d| format!("erf({})", w.scalar(d))),
    row(Scalar, 1, "erfc", |w, d| format!("erfc({})", w.scalar(d))),
    row(Scalar, 1, "lgamma", |w, d| format!("lgamma(1.5 + tanh({}))", w.scalar(d))),
    row(Scalar, 1, "polygamma", |w, d| {
        let order = w.random.below(3);
        format!("polygamma({order}, 2.5 + tanh({}))", w.scalar(d))
    }),
    row(Scalar, 1, "hypot", |w, d| format!("hypot({}, 1 + ({})^2)", w.scalar(d), w.scalar(d))),
    row(Scalar, 2, "smoothstep", |w, d| {
        let a = w.random.between(-1.0, 0.5);
        format!("smoothstep({a:.2}, {:.2}, {})", a + 0.7, w.scalar(d))
    }),
    // Functions that are not smooth.
    row(Scalar, 2, "clamp", |w, d| {
        let a = w.random.between(-1.0, 0.5);
        format!("clamp({}, {a:.2}, {:.2})", w.scalar(d), a + 0.9)
    }),
    row(Scalar, 2, "mod of time", |w, _| {
        let period = w.positive();
        time(w, &format!("mod(time, {period} [s])/1 [s]"))
    }),
    row(Scalar, 1, "steps of time", |w, _| {
        let (rate, word) = (w.positive(), *w.random.pick(&["floor", "ceil", "round"]));
        time(w, &format!("{word}({rate}*time/1 [s])"))
    }),
    row(Scalar, 3, "abs", |w, d| format!("abs({})", w.scalar(d))),
    row(Scalar, 1, "sign", |w, d| format!("sign({})", w.scalar(d))),
    row(Scalar, 3, "min", |w, d| {
        let smaller = if d == 1 { "complementary" } else { "min" };
        format!("{smaller}({}, {})", w.scalar(d), w.scalar(d))
    }),
    row(Scalar, 3, "max", |w, d| format!("max({}, {})", w.scalar(d), w.scalar(d))),
    row(Scalar, 4, "if", |w, d| {
        format!("(if {} then {} else {})", w.condition(d), w.scalar(d), w.scalar(d))
    }),
    row(Scalar, 1, "a*abs(a)", |w, d| {
        let a = w.scalar(d);
        format!("({a})*abs({a})")
    }),
    row(Scalar, 1, "quantities over each other", |w, d| {
        let scale = w.scale();
        let other = w.scale();
        if scale.dimension == "1" || scale.offset || other.offset {
            return w.scalar(d);
        }
        let a = w.quantity(scale, d);
        format!("(({a}){})", scale.over("/"))
    }),
    row(Scalar, 3, "call", call),
    // Quantities.
    row(Quantity, 3, "number times unit", |w, d| {
        let scale = w.wanted;
        format!("({}){}", w.scalar(d), scale.over("*"))
    }),
    row(Quantity, 2, "sum of quantities", |w, d| {
        let scale = w.wanted;
        format!("({} + {})", w.quantity(scale, d), w.quantity(scale, d))
    }),
    row(Quantity, 1, "min of quantities", |w, d| {
        let scale = w.wanted;
        format!("min({}, {})", w.quantity(scale, d), w.quantity(scale, d))
    }),
    row(Quantity, 1, "abs of a quantity", |w, d| {
        let scale = w.wanted;
        format!("abs({})", w.quantity(scale, d))
    }),
    row(Quantity, 1, "sqrt of a square", |w, d| {
        let scale = w.wanted;
        let one = if scale.symbol == "1" { "1" } else { &scale.over("") };
        format!("sqrt(({one})^2 + ({})^2)", w.quantity(scale, d))
    }),
    row(Quantity, 1, "if of quantities", |w, d| {
        let scale = w.wanted;
        format!("(if {} then {} else 0)", w.condition(d), w.quantity(scale, d))
    }),
    // Conditions.
    row(Condition, 8, "a < b", |w, d| {
        let sign = *w.random.pick(&["<", "<=", ">", ">="]);
        format!("{} {sign} {}", w.scalar(d), w.scalar(0))
    }),
    row(Condition, 3, "condition on quantities", |w, d| {
        let scale = w.scale();
        if scale.offset {
            return format!("{} > 0.1", w.scalar(d));
        }
        let sign = *w.random.pick(&["<", "<=", ">", ">="]);
        format!("{} {sign} {}", w.quantity(scale, d), w.quantity(scale, 0))
    }),
    row(Condition, 3, "condition on time", |w, _| {
        let sign = *w.random.pick(&["<", "<=", ">", ">="]);
        match w.reads {
            Reads::Parameters | Reads::Start => {
                format!("{} {sign} 0.3", w.scalar(0))
            }
            Reads::All | Reads::Loop => format!("time {sign} {} [s]", w.positive()),
        }
    }),
    row(Condition, 2, "pulse", |w, _| {
        let onsets = w.of_kind(Kind::Delay);
        if onsets.is_empty() || w.reads != Reads::All {
            return format!("{} > 0.2", w.scalar(0));
        }
        let onset = w.random.pick(&onsets).name.clone();
        format!("(time > {onset} and time <= {onset} + {} [s])", w.positive())
    }),
    row(Condition, 2, "and", |w, d| format!("({} and {})", w.condition(d), w.condition(d))),
    row(Condition, 2, "or", |w, d| format!("({} or {})", w.condition(d), w.condition(d))),
    row(Condition, 1, "not", |w, d| format!("not ({})", w.condition(d))),
    // Values.
    row(Value, 3, "constant", |w, _| {
        let scale = w.scale();
        let name = w.name("c");
        let value = scale.value(w.random.between(-1.5, 1.5));
        w.declare(&name, scale, Kind::Constant);
        format!("constant {name} {} = {value:.3}", scale.brackets())
    }),
    row(Value, 1, "computed constant", |w, _| {
        let outer = std::mem::replace(&mut w.reads, Reads::Parameters);
        let known = std::mem::take(&mut w.known);
        w.known = known.iter().filter(|known| known.kind == Kind::Constant).cloned().collect();
        let value = w.scalar(2);
        w.known = known;
        w.reads = outer;
        let name = w.name("c");
        w.declare(&name, &SCALES[0], Kind::Constant);
        format!("constant {name} = {value}")
    }),
    row(Value, 6, "parameter", |w, _| parameter(w)),
    row(Value, 1, "unit", |w, _| {
        let (unit, name) = (w.name("unit"), w.name("c"));
        let size = w.positive();
        w.declare(&name, &SCALES[2], Kind::Constant);
        let value = w.random.between(-9.0, 9.0);
        format!("unit {unit} = {size} [mm]\nconstant {name} [{unit}] = {value:.3}")
    }),
    row(Value, 2, "parameter that is a time", |w, _| {
        let name = w.name("t");
        w.known.push(Known::new(&name, &SCALES[0], Kind::Delay));
        format!("parameter {name} [s] = {}  in 0 ..", w.positive())
    }),
    row(Input, 2, "input hold", |w, _| {
        let scale = w.scale();
        let name = w.name("u");
        w.declare(&name, scale, Kind::Input);
        let word = *w.random.pick(&["", " hold"]);
        format!("input {name} {}{word}", scale.brackets())
    }),
    row(Input, 2, "input linear", |w, _| {
        let scale = w.scale();
        let name = w.name("u");
        w.declare(&name, scale, Kind::Input);
        format!("input {name} {} linear", scale.brackets())
    }),
    row(State, 4, "state", |w, _| {
        let scale = w.scale();
        let name = w.name("x");
        let start = scale.value(w.random.between(-1.0, 1.0));
        w.declare(&name, scale, Kind::State);
        let nominal =
            if w.random.chance(0.2) { format!("  nominal {}", scale.size) } else { String::new() };
        let noise = if w.random.chance(0.1) { ", noise 0.01" } else { "" };
        let noise = if nominal.is_empty() { noise.trim_start_matches(',') } else { noise };
        format!("state {name} {} = {start:.2}{nominal}{noise}", scale.brackets())
    }),
    row(State, 2, "state with a computed start", |w, _| {
        let scale = w.scale();
        let name = w.name("x");
        let outer = std::mem::replace(&mut w.reads, Reads::Start);
        let start = w.scalar(2);
        w.reads = outer;
        w.declare(&name, scale, Kind::State);
        format!("state {name} {} = {}", scale.brackets(), scale.quantity(&format!("tanh({start})")))
    }),
    row(State, 1, "history", |w, _| {
        let scale = w.scale();
        let name = w.name("x");
        let start = w.random.between(-1.0, 1.0);
        let slope = w.random.between(-0.5, 0.5);
        let before = scale.quantity(&format!("{start:.2} + {slope:.2}*sin(time/1 [s])"));
        w.declare(&name, scale, Kind::State);
        format!(
            "state {name} {} = {}  history {before}",
            scale.brackets(),
            scale.quantity(&format!("{start:.2}"))
        )
    }),
    // Items that belong together.
    row(Whole, 3, "array with a loop", array),
    row(Whole, 1, "sum over an array", sum_of_array),
    row(Whole, 2, "elements that react", reacting_elements),
    row(Whole, 2, "start equations", start_equations),
    row(Whole, 5, "start steady", |w, _| {
        w.steady = true;
        String::new()
    }),
    row(Whole, 2, "arrays of all kinds", vectors),
    row(Whole, 2, "tied states", |w, _| tied(w)),
    row(Whole, 2, "part", part),
    row(Whole, 2, "several parts", several_parts),
    row(Whole, 1, "oscillator", |w, _| {
        let (x, v) = (w.name("x"), w.name("x"));
        let (a, b) = (w.name("e"), w.name("e"));
        let k = w.positive();
        let line = format!(
            "state {x} [m] = 0.3\nstate {v} [m/s] = 0\nequation {a}: der({x}) = {v}\n\
             equation {b}: 2 [kg]*der({v}) = -{k} [N/m]*{x} - 0.5 [N*s/m]*{v}"
        );
        w.known.push(Known::new(&format!("({x}/0.1 [m])"), &SCALES[0], Kind::OfPart));
        line
    }),
    // Between values and equations.
    row(Between, 4, "let", |w, d| {
        let value = w.scalar(d);
        let name = w.name("l");
        w.declare(&name, &SCALES[0], Kind::Let);
        format!("let {name} = {value}")
    }),
    row(Between, 2, "let with a unit", |w, d| {
        let scale = w.scale();
        let value = w.scalar(d);
        let name = w.name("l");
        w.declare(&name, scale, Kind::Let);
        format!("let {name} {} = {}", scale.brackets(), scale.quantity(&value))
    }),
    row(Between, 2, "function", function),
    row(Between, 1, "function with a block", |w, d| {
        let (name, local, next) = (w.name("f"), w.name("m"), w.name("m"));
        w.arguments = vec!["a0".to_owned()];
        let first = w.scalar(d);
        w.arguments = vec!["a0".to_owned(), local.clone()];
        let second = w.scalar(d.min(1));
        w.arguments = vec![local.clone(), next.clone()];
        let body = w.scalar(d.min(1));
        w.arguments = Vec::new();
        w.functions.push(Function { name: name.clone(), arguments: vec![&SCALES[0]] });
        format!(
            "function {name}(a0) = {{\n  let {local} = {first}\n  let {next} [1] = {second}\n  0 + {body}\n}}"
        )
    }),
    row(Between, 1, "table", table),
    row(Between, 1, "import", library),
    // Unknowns.
    row(Unknown, 4, "unknown = e", |w, d| unknown(w, d, |y, e| format!("{y} = {e}"))),
    row(Unknown, 1, "unknown = min", |w, d| {
        let bound = w.scalar(1);
        unknown(w, d, move |y, e| format!("{y} = min({e}, {bound})"))
    }),
    row(Unknown, 2, "unknown + tanh(unknown) = e", |w, d| {
        unknown(w, d, |y, e| format!("{y} + 0.7*tanh({y}) = {e}"))
    }),
    row(Unknown, 1, "cubic unknown", |w, d| {
        unknown(w, d, |y, e| format!("0 = {e} - 2*{y} - ({y})^3"))
    }),
    row(Unknown, 1, "two unknowns", two_unknowns),
    // Equations of states.
    row(Equation, 8, "der(x) = f", |w, d| {
        let x = w.determined();
        let (label, f) = (w.name("e"), rate(w, &x, d));
        format!("equation {label}: der({}) = ({f}){}", x.name, x.scale.rate_over("*"))
    }),
    row(Equation, 3, "a*der(x) = f", |w, d| {
        let x = w.determined();
        let (label, f, a) = (w.name("e"), rate(w, &x, d), w.scalar(1));
        format!("equation {label}: (1 + ({a})^2)*der({}) = ({f}){}", x.name, x.scale.rate_over("*"))
    }),
    row(Equation, 2, "0 = f - der(x) exact", |w, d| {
        let x = w.determined();
        let (label, f) = (w.name("e"), rate(w, &x, d));
        format!("equation {label}: 0 = ({f}){} - 2*der({}) exact", x.scale.rate_over("*"), x.name)
    }),
    row(Equation, 1, "der(x) + tanh(der(x)) = f", |w, d| {
        let x = w.determined();
        let (label, f) = (w.name("e"), rate(w, &x, d));
        let rate = format!("der({}){}", x.name, x.scale.rate_over("/"));
        format!("equation {label}: {rate} + 0.5*tanh({rate}) = {f}")
    }),
    row(Equation, 1, "variant", |w, d| {
        let x = w.determined();
        let (variant, label) = (w.name("v"), w.name("e"));
        let (f, g) = (rate(w, &x, d), rate(w, &x, d));
        let (der, unit) = (format!("der({})", x.name), x.scale.rate_over("*"));
        format!(
            "variant {variant} {{\n  a {{ equation {label}: {der} = ({f}){unit} }}\n  \
             b {{ equation {label}: 2*{der} = ({g}){unit} }}\n}}"
        )
    }),
    row(Equation, 1, "two phases", |w, d| {
        let x = w.determined();
        let (block, label) = (w.name("b"), w.name("e"));
        let (f, g) = (rate(w, &x, d), rate(w, &x, d));
        let (der, unit) = (format!("der({})", x.name), x.scale.rate_over("*"));
        let outer = std::mem::replace(&mut w.reads, Reads::Start);
        let watched = w.scalar(1);
        w.reads = outer;
        format!(
            "modes {block} {{\n  a {{ equation {label}: {der} = ({f}){unit} }}\n  \
             b {{ equation {label}: {der} = ({g}){unit} }}\n  \
             a -> b when time rises above {} [s]\n  start b if {watched} > 5\n}}",
            w.positive()
        )
    }),
    row(Equation, 1, "derivative with a name", |w, d| {
        let x = w.determined();
        let (label, other, rate_name) = (w.name("e"), w.name("e"), w.name("y"));
        let f = rate(w, &x, d);
        let unit = x.scale.rate;
        format!(
            "unknown {rate_name} [{unit}]\nequation {other}: {rate_name} = der({})\n\
             equation {label}: der({}) = ({f}){} - 0.2*{rate_name}",
            x.name,
            x.name,
            x.scale.rate_over("*")
        )
    }),
    // Beside equations.
    row(Beside, 3, "when", when),
    row(Beside, 2, "every", |w, d| {
        let scale = w.scale();
        let name = w.name("x");
        let start = scale.value(w.random.between(-1.0, 1.0));
        let times = w.of_kind(Kind::Delay);
        let period = if times.is_empty() || w.random.chance(0.5) {
            format!("{} [s]", w.positive())
        } else {
            w.random.pick(&times).name.clone()
        };
        let offset = if w.random.chance(0.3) {
            format!(" offset {} [s]", w.positive())
        } else {
            String::new()
        };
        let known = w.known.clone();
        w.known.retain(|known| known.kind != Kind::Held);
        let value = scale.quantity(&format!("tanh({})", w.scalar(d.min(1))));
        w.known = known;
        w.declare(&name, scale, Kind::Held);
        format!(
            "held {name} {} = {start:.2}\nevery {period}{offset} {{\n  reset {name} = {value}\n}}",
            scale.brackets()
        )
    }),
    row(Beside, 2, "saturate", |w, _| saturate(w)),
    row(Beside, 2, "modes", modes),
    // Outputs.
    row(Output, 6, "output = e", |w, d| {
        let scale = w.scale();
        let (name, value) = (w.name("o"), w.scalar(d));
        let unit = if scale.offset { &SCALES[0] } else { scale };
        let noise = match w.random.between(0.0, 10.0) {
            x if x < 3.0 => "  noise 0.01".to_owned(),
            x if x < 3.5 => "  noise lognormal(0.1)".to_owned(),
            x if x < 4.0 => format!("  noise 2 [%]*abs({name})"),
            x if x < 4.5 => format!("  noise student(4, 1 [%]*abs({name}))"),
            _ => String::new(),
        };
        format!("output {name} {} = {}{noise}", unit.brackets(), unit.quantity(&value))
    }),
    row(Output, 1, "output of an unknown", |w, _| {
        let mut names = w.of_kind(Kind::State);
        names.extend(w.of_kind(Kind::Unknown));
        let known = w.random.pick(&names).clone();
        let line = format!("output {}", known.name);
        if w.lines.contains(&line) { String::new() } else { line }
    }),
    row(Output, 1, "remark", |w, d| {
        let (name, value) = (w.name("o"), w.scalar(d));
        format!("# A remark.\n/// A doc comment.\noutput {name} = {value}    /// and another one")
    }),
    row(Output, 1, "output of an array", |w, _| {
        let arrays: Vec<Known> =
            w.known.iter().filter(|known| matches!(known.kind, Kind::Array(_))).cloned().collect();
        let Some(array) = arrays.first() else { return String::new() };
        let line = format!("output {} {}", array.name, array.scale.brackets());
        if w.lines.contains(&line) { String::new() } else { line }
    }),
    row(Output, 1, "output of whole numbers", |w, d| {
        let name = w.name("o");
        let (a, b) = (w.scalar(d), w.scalar(0));
        format!("output {name} = floor({a}) + ceil({a}) - round({b}) + mod({b}, 0.7)")
    }),
    row(Output, 1, "output of a delayed state", |w, _| {
        let states = w.of_kind(Kind::State);
        let x = w.random.pick(&states).clone();
        let name = w.name("o");
        let late = format!("delay({}, {} [s])", x.name, w.positive());
        format!("output {name} = {}", x.scale.over_size(&late, None))
    }),
    // Effects.
    row(Effect, 2, "effect on a parameter", |w, _| {
        let Some(name) = used(w, Kind::Parameter) else { return effect_on_output(w) };
        format!(
            "kind plant\nparameter more = 0.2\nnull more = 0\nreplace {name} by {name}*(1 + more)\n"
        )
    }),
    row(Effect, 1, "effect on an input", |w, _| {
        let Some(name) = used(w, Kind::Input) else { return effect_on_output(w) };
        format!(
            "kind input\nparameter late [s] = 0.3  in 0 ..\nreplace {name} by delay({name}, late)\n"
        )
    }),
    row(Effect, 1, "effect on an output", |w, _| effect_on_output(w)),
    row(Effect, 2, "effect on an equation", |w, _| {
        // The state's equation, if it is not within a block.
        let states = w.of_kind(Kind::State);
        for x in &states {
            let der = format!(": der({}) = ", x.name);
            let line =
                w.lines.iter().find(|line| line.starts_with("equation ") && line.contains(&der));
            if let Some(label) = line.and_then(|line| line.split([' ', ':']).nth(1)) {
                let unit = x.scale.rate_over("*");
                return format!(
                    "kind plant\nparameter pull = 0.1\nnull pull = 0\nadd pull*cos(time/1 [s]){unit} to {label}\n"
                );
            }
        }
        effect_on_output(w)
    }),
];

/// The first name of a kind that an equation reads: unused names cannot be replaced.
fn used(w: &Writer, kind: Kind) -> Option<String> {
    let in_equation = |name: &str| {
        let word = |text: &str| text.split(|c: char| !c.is_alphanumeric()).any(|word| word == name);
        w.lines.iter().any(|line| line.starts_with("equation ") && word(line))
    };
    w.of_kind(kind).into_iter().map(|known| known.name).find(|name| in_equation(name))
}

/// A sensor that reads too high.
fn effect_on_output(w: &mut Writer) -> String {
    let mut outputs = w.lines.iter().filter(|line| line.starts_with("output o"));
    let name = outputs.find_map(|line| line.split_whitespace().nth(1));
    match name.map(str::to_owned) {
        Some(name) => format!(
            "kind sensor\nparameter gain = 1.1\nnull gain = 1\nreplace output {name} by gain*{name}\n"
        ),
        None => "kind plant\noutput again = time/1 [s]\n".to_owned(),
    }
}

impl Writer {
    /// A unit.
    pub(crate) fn scale(&mut self) -> &'static Scale {
        if self.random.chance(0.35) { &SCALES[0] } else { self.random.pick(SCALES) }
    }

    fn declare(&mut self, name: &str, scale: &'static Scale, kind: Kind) {
        self.known.push(Known::new(name, scale, kind));
    }
}

fn time(w: &mut Writer, text: &str) -> String {
    match w.reads {
        Reads::All | Reads::Loop => format!("({text})"),
        Reads::Parameters | Reads::Start => w.number(),
    }
}

fn parameter(w: &mut Writer) -> String {
    let scale = w.scale();
    let name = w.name("p");
    let value = scale.value(w.random.between(-1.5, 1.5));
    let positive = scale.value(w.random.between(0.2, 1.5));
    w.declare(&name, scale, Kind::Parameter);
    let declared = format!("parameter {name} {}", scale.brackets());
    match w.random.below(7) {
        // The unit has no offset, so that the value is positive.
        5 if !scale.offset => {
            format!("{declared} = {positive:.3}  prior lognormal({positive:.3}, 0.3)")
        }
        6 => format!("{declared} = {value:.3}  prior laplace({value:.3}, {})", scale.size),
        0 => format!("{declared} = {positive:.3}  in 0.01 .. 10000, log"),
        1 => format!("{declared} = {value:.3}  in -1000 .. 1000, fixed"),
        2 => format!("{declared} = {value:.3}  in -1000 .., nominal {}", scale.size),
        3 => format!("{declared} = {value:.3}  prior normal({value:.3}, {})", scale.size),
        _ => format!("{declared} = {value:.3}"),
    }
}

/// A delayed input or state.
fn delayed(w: &mut Writer, kind: Kind) -> String {
    if w.reads != Reads::All || w.index.is_some() || !w.arguments.is_empty() {
        return w.read();
    }
    let known = w.of_kind(kind);
    if known.is_empty() {
        return w.read();
    }
    let known = w.random.pick(&known).clone();
    let times = w.of_kind(Kind::Delay);
    let tau = if times.is_empty() || w.random.chance(0.4) {
        format!("{} [s]", w.positive())
    } else {
        w.random.pick(&times).name.clone()
    };
    known.scale.over_size(&format!("delay({}, {tau})", known.name), None)
}

fn function(w: &mut Writer, d: u32) -> String {
    let name = w.name("f");
    let count = 1 + w.random.below(2);
    let arguments: Vec<&'static Scale> = (0..count)
        .map(|_| {
            let scale = w.scale();
            if scale.offset { &SCALES[0] } else { scale }
        })
        .collect();
    let mut head = String::new();
    let mut texts = Vec::new();
    for (k, scale) in arguments.iter().enumerate() {
        let unit = if scale.symbol == "1" && w.random.chance(0.5) {
            String::new()
        } else {
            format!(" {}", scale.brackets())
        };
        let _ = write!(head, "{}a{k}{unit}", if k == 0 { "" } else { ", " });
        texts.push(scale.over_size(&format!("a{k}"), None));
    }
    w.arguments = texts;
    let body = w.scalar(d);
    w.arguments = Vec::new();
    w.functions.push(Function { name: name.clone(), arguments });
    format!("function {name}({head}) = {body}")
}

fn call(w: &mut Writer, d: u32) -> String {
    // Functions may read everything that the model declares; their names must not be read before them.
    if w.functions.is_empty()
        || w.reads != Reads::All
        || !w.arguments.is_empty()
        || w.index.is_some()
    {
        return w.scalar(d);
    }
    let k = w.random.below(w.functions.len());
    let name = w.functions[k].name.clone();
    let scales = w.functions[k].arguments.clone();
    let arguments: Vec<String> = scales
        .iter()
        .map(|scale| {
            let value = w.scalar(d.min(1));
            scale.quantity(&value)
        })
        .collect();
    format!("{name}({})", arguments.join(", "))
}

/// The rate of a state: bounded, and usually restoring.
fn rate(w: &mut Writer, x: &Known, d: u32) -> String {
    let e = w.scalar(d);
    let bounded = match w.random.below(5) {
        0 => format!("tanh({e})"),
        1 => format!("sin({e})"),
        2 => format!("({e})/sqrt(1 + ({e})^2)"),
        _ => format!("({e})/(1 + abs({e}))"),
    };
    let scaled = x.scale.over_size(&x.name, None);
    match w.random.below(5) {
        0 => bounded,
        1 => format!("{bounded} - 0.3*({scaled})^3"),
        _ => format!("{bounded} - {}*{scaled}", w.positive()),
    }
}

/// An unknown, and an equation between its scaled value and an expression.
fn unknown(w: &mut Writer, d: u32, equation: impl Fn(&str, &str) -> String) -> String {
    let scale = w.scale();
    let e = w.scalar(d);
    let (name, label) = (w.name("y"), w.name("e"));
    let over = scale.over_size(&name, None);
    w.declare(&name, scale, Kind::Unknown);
    format!(
        "unknown {name} {} = {:.2}\nequation {label}: {}",
        scale.brackets(),
        scale.value(0.1),
        equation(&over, &e)
    )
}

fn two_unknowns(w: &mut Writer, d: u32) -> String {
    let (a, b) = (w.scalar(d), w.scalar(d));
    let (y, z) = (w.name("y"), w.name("y"));
    let (first, second) = (w.name("e"), w.name("e"));
    w.declare(&y, &SCALES[0], Kind::Unknown);
    w.declare(&z, &SCALES[0], Kind::Unknown);
    format!(
        "unknown {y}\nunknown {z} = 0.1\nequation {first}: 2*{y} + 0.5*sin({z}) = tanh({a})\n\
         equation {second}: 0 = 3*{z} - 0.5*{y}^2/(1 + {y}^2) - sin({b})"
    )
}

fn when(w: &mut Writer, _: u32) -> String {
    let states = w.of_kind(Kind::State);
    let x = w.random.pick(&states).clone();
    let (bound, reset) = (format!("saturate {} ", x.name), format!("reset {} ", x.name));
    if w.lines.iter().any(|line| line.starts_with(&bound) || line.contains(&reset)) {
        return String::new();
    }
    let threshold = w.random.between(-0.8, 0.8);
    let rises = w.random.chance(0.5);
    let back = threshold + if rises { -0.6 } else { 0.6 };
    let words = if rises { "rises above" } else { "falls below" };
    let kept = if w.random.chance(0.5) {
        format!("{back:.2}")
    } else {
        format!("{back:.2} + 0.1*sin({})", w.scalar(1))
    };
    let kept = x.scale.quantity(&kept);
    let other = if w.random.chance(0.3) {
        format!(" or time rises above {} [s]", w.positive())
    } else {
        String::new()
    };
    format!(
        "when {} {words} {}{other} {{\n  reset {} = {kept}\n}}",
        x.name,
        x.scale.quantity(&format!("{threshold:.2}")),
        x.name
    )
}

fn saturate(w: &mut Writer) -> String {
    let mut candidates = w.of_kind(Kind::State);
    if w.random.chance(0.3) {
        candidates.extend(w.of_kind(Kind::Unknown));
    }
    let x = w.random.pick(&candidates).clone();
    let bound = w.random.between(0.2, 1.0);
    // One bound, and no bound that a reset exceeds endlessly.
    let (head, reset) = (format!("saturate {} ", x.name), format!("reset {} ", x.name));
    if w.lines.iter().any(|line| line.starts_with(&head) || line.contains(&reset)) {
        return String::new();
    }
    if w.random.chance(0.5) {
        format!("saturate {} >= {}", x.name, x.scale.quantity(&format!("-{bound:.2}")))
    } else {
        format!("saturate {} <= {}", x.name, x.scale.quantity(&format!("{bound:.2}")))
    }
}

/// A state that two modes drive up and down between thresholds.
fn modes(w: &mut Writer, d: u32) -> String {
    let scale = w.scale();
    let (name, block) = (w.name("x"), w.name("b"));
    let (up, down) = (w.scalar(d), w.scalar(d));
    let (high, low) = (w.random.between(0.3, 0.9), w.random.between(-0.9, -0.1));
    let rate = scale.rate_over("*");
    let reset = if w.random.chance(0.3) {
        format!(" {{ reset {name} = {} }}", scale.quantity(&format!("{:.2}", high * 0.5)))
    } else {
        String::new()
    };
    w.declare(&name, scale, Kind::State);
    format!(
        "state {name} {} = {:.2}\nmodes {block} {{\n  \
         up {{ equation {block}: der({name}) = (1.2 + 0.5*tanh({up})){rate} }}\n  \
         down {{ equation {block}: der({name}) = (0.5*sin({down}) - 1.1){rate} }}\n  \
         up -> down when {name} rises above {}{reset}\n  \
         down -> up when {name} falls below {}\n}}",
        scale.brackets(),
        scale.value(0.0),
        scale.quantity(&format!("{high:.2}")),
        scale.quantity(&format!("{low:.2}")),
    )
}

/// A line of cells, each relaxing towards the previous one.
fn array(w: &mut Writer, d: u32) -> String {
    let scale = w.scale();
    let (size, name) = (w.name("n"), w.name("z"));
    let count = 2 + w.random.below(4) as u32;
    let (first, cell) = (w.name("e"), w.name("e"));
    let inflow = w.scalar(d);
    let rate = scale.rate_over("*");
    let (z, before) = (
        scale.over_size(&format!("{name}[i]"), None),
        scale.over_size(&format!("{name}[i-1]"), None),
    );
    let start = if scale.offset || w.random.chance(0.5) {
        format!("state {name}[1..{size}] {} = {:.2}", scale.brackets(), scale.value(0.2))
    } else {
        let start = scale.quantity("0.2*i - 0.3");
        format!("state {name}[i in 1..{size}] {} = {start}", scale.brackets())
    };
    w.declare(&name, scale, Kind::Array(count));
    let (outer, index) = (w.reads, w.index.take());
    w.reads = Reads::Loop;
    w.index = Some("i".to_owned());
    let (source, loop_let) = (w.scalar(d), w.name("l"));
    w.reads = outer;
    w.index = index;
    let end = scale.over_size(&format!("{name}[1]"), None);
    let inner = if w.random.chance(0.3) {
        format!(
            "let {loop_let}[i] = tanh({source})\n  equation {cell}[i]: der({name}[i]) = ({before} - {z} + {loop_let}[i]){rate}"
        )
    } else {
        format!("equation {cell}[i]: der({name}[i]) = ({before} - {z} + sin({source})){rate}")
    };
    format!(
        "size {size} = {count}\n{start}\nequation {first}: der({name}[1]) = (tanh({inflow}) - {end}){rate}\n\
         for i in 2..{size} {{\n  {inner}\n}}"
    )
}

/// A plate with arrays of constants, parameters and inputs, and sums over them.
fn vectors(w: &mut Writer, d: u32) -> String {
    let [x, k, g, u, e, f] = ["z", "p", "c", "u", "e", "e"].map(|letter| w.name(letter));
    let total = w.name("o");
    let outer = w.reads;
    w.reads = Reads::Parameters;
    let source = w.scalar(d.min(1));
    w.reads = outer;
    let [a, b, c] = [0.3, 0.7, 1.1].map(|size| size + w.random.between(0.0, 0.3));
    let back = if w.random.chance(0.5) { "4-i" } else { "i" };
    let gain = if w.random.chance(0.3) { format!("{k}[4-i]") } else { format!("{k}[i]") };
    let reduced = w.random.pick(&["sum", "mean", "prod", "max", "min"]).to_owned();
    let column = |i: usize| Known::new(&format!("{u}[{i}]"), &SCALES[0], Kind::Input);
    w.columns.extend([column(1), column(2)]);
    w.known.push(Known::new(&format!("{x}[2][1]"), &SCALES[0], Kind::OfPart));
    w.known.push(Known::new(&format!("{k}[3]"), &SCALES[0], Kind::OfPart));
    format!(
        "parameter {k}[1..3] = ({a:.2}, {b:.2}, {c:.2})\nconstant {g}[i in 1..3] = 0.4*i - 0.5\n\
         input {u}[1..2] linear\nstate {x}[1..3][1..3] = ((0.1, 0.2, 0.3), -0.3, (0.4, 0.6, 0.5))\n\
         for i in 1..3 {{\n  equation {e}[i]: der({x}[i][1]) = ({gain}*tanh({u}[2]) - {x}[i][1] + \
         sum({g}[l]*{x}[l][2] for l in 1..3)/10)/1 [s]\n}}\n\
         for i in 1..3, j in 2..3 {{\n  equation {f}[i][j]: der({x}[i][j]) = ({x}[i][j-1]*{k}[2] - \
         {x}[i][j] + {g}[{back}]*tanh({source} + {u}[1]))/1 [s]\n}}\n\
         output {total} = {reduced}({x}[l][m]*{k}[l] for l in 1..3, m in 1..3)"
    )
}

/// Elements that are bounded, reset, held and delayed, in a loop or one by one.
fn reacting_elements(w: &mut Writer, d: u32) -> String {
    let [x, u, e] = ["z", "z", "e"].map(|letter| w.name(letter));
    let outer = w.reads;
    w.reads = Reads::Parameters;
    let source = w.scalar(d.min(1));
    w.reads = outer;
    let kinds = [(format!("{x}[1]"), Kind::OfPart), (format!("{u}[2]"), Kind::Held)];
    for (element, kind) in kinds {
        w.known.push(Known::new(&element, &SCALES[0], kind));
    }
    let late = match w.random.below(3) {
        0 => format!("0.3*delay({x}[i], 0.3 [s])"),
        1 => format!("0.3*delay({x}[4-i], 0.2 [s]*i)"),
        _ => format!("0.3*{x}[2]"),
    };
    let bounds = match w.random.below(3) {
        0 => format!("saturate {x}[i] <= 0.4 + 0.1*i\n"),
        1 => format!("saturate {x}[4-i] >= 0.1*i\n  saturate {x}[i] <= 0.7\n"),
        _ => String::new(),
    };
    let reset = match w.random.below(3) {
        0 => format!("when {x}[i] rises above 0.2*i {{ reset {u}[i] = {u}[i] - 0.2 }}\n"),
        1 => format!("every 0.4 [s] {{ reset {u}[i] = 0.5*{x}[i] }}\n"),
        _ => format!("when time rises above 0.3 [s] {{ reset {u}[4-i] = 0.2*{x}[i] }}\n"),
    };
    let one = match w.random.below(2) {
        0 => String::new(),
        _ => format!("\nwhen {x}[1] + {u}[2] rises above 0.3 {{\n  reset {x}[2] = 0.2\n}}"),
    };
    format!(
        "state {x}[i in 1..3] = 0.1 + 0.05*i\nheld {u}[1..3] = (0.1, 0.2, -0.1)\nfor i in 1..3 {{\n  \
         equation {e}[i]: der({x}[i]) = (tanh({source}) + {late} + {u}[i] - {x}[i])/1 [s]\n  \
         {bounds}  {reset}}}{one}\noutput {x}"
    )
}

/// States with start equations, single ones and elements.
fn start_equations(w: &mut Writer, d: u32) -> String {
    let [x, z] = ["x", "z"].map(|letter| w.name(letter));
    let labels = ["e", "e", "e", "e"].map(|letter| w.name(letter));
    let [e, f, g, h] = &labels;
    let outer = w.reads;
    w.reads = Reads::Parameters;
    let [a, b] = [(); 2].map(|()| w.scalar(d.min(1)));
    w.reads = outer;
    for known in [x.clone(), format!("{z}[2]")] {
        w.known.push(Known::new(&known, &SCALES[0], Kind::OfPart));
    }
    let guess = if w.random.chance(0.5) { "  guess" } else { "" };
    format!(
        "state {x} = 0.3{guess}\nstate {z}[1..3] = 0.2{guess}\n\
         equation {e}: der({x}) = (tanh({a}) - {x} - 0.2*{x}^3)/1 [s]\n\
         for i in 1..3 {{\n  equation {f}[i]: der({z}[i]) = ({x} - {z}[i] - 0.1*i*{z}[i]^3)/1 [s]\n  \
         start equation {h}[i]: der({z}[i]) = 0.1 [1/s]*(i - 2)\n}}\n\
         start equation {g}: der({x}) = 0.2*tanh({b})/1 [s]\noutput {z}"
    )
}

/// An array that another one sums.
fn sum_of_array(w: &mut Writer, d: u32) -> String {
    let (m, total, label, other, none) =
        (w.name("z"), w.name("z"), w.name("e"), w.name("e"), w.name("e"));
    let outer = w.reads;
    w.reads = Reads::Parameters;
    let k = w.scalar(d.min(1));
    w.reads = outer;
    w.known.push(Known::new(&format!("{total}[3]"), &SCALES[0], Kind::OfPart));
    format!(
        "state {m}[i in 1..3] = 0.1*i\nunknown {total}[0..3] = 0\n\
         for i in 1..3 {{\n  equation {label}[i]: der({m}[i]) = (0.3*i - {m}[i] + tanh({k}))/1 [s]\n  \
         equation {other}[i]: {total}[i] = {total}[i-1] + {m}[i]\n}}\nequation {none}: {total}[0] = 0"
    )
}

/// Two tied states, one of them together with another unknown: an equation that is differentiated.
fn tied(w: &mut Writer) -> String {
    let (x, y, q) = (w.name("x"), w.name("y"), w.name("y"));
    let labels = [w.name("e"), w.name("e"), w.name("e")];
    let outer = w.reads;
    w.reads = Reads::Parameters;
    let k = w.scalar(1);
    w.reads = outer;
    let tie = match w.random.below(3) {
        0 => format!("{y} = {x}"),
        1 => format!("{y} = 0.5*{x} + 0.2*sin({x})"),
        _ => format!("{y} + 0.3*{y}^3 = {x} + tanh({k})"),
    };
    w.declare(&x, &SCALES[0], Kind::OfPart);
    w.declare(&q, &SCALES[0], Kind::OfPart);
    format!(
        "state {x} = 0.4\nstate {y} = 0.3\nunknown {q}\n\
         equation {}: der({x}) = (cos(2*time/1 [s]) - {x} - {q})/1 [s]\n\
         equation {}: der({y}) = (2*{q} - 0.3*{y})/1 [s]\nequation {}: {tie}",
        labels[0], labels[1], labels[2]
    )
}

/// A model inside this one.
fn part(w: &mut Writer, d: u32) -> String {
    let (name, file) = (w.name("s"), w.name("part"));
    let inflow = w.scalar(d.min(2));
    let text = format!(
        "model {file}\nparameter a = 0.5  in 0 .. 2\nconstant b = 1.5\ninput q [1] hold\nstate h = 0.2\n\
         function loss(x) = x*abs(x)\nvariant form {{\n  linear {{ let out = a*h }}\n  quadratic {{ let out = a*loss(h) }}\n}}\n\
         equation level: der(h) = (b*q - out)/1 [s]\noutput twice = 2*out\n"
    );
    w.files.insert(format!("{file}.dgd"), text);
    w.declare(&format!("{name}.h"), &SCALES[0], Kind::OfPart);
    w.declare(&format!("{name}.twice"), &SCALES[0], Kind::OfPart);
    let arguments = match w.random.below(4) {
        0 => "",
        1 => "(a = 0.8)",
        2 => "(form = quadratic)",
        _ => "(a = 0.3, h = 0.4, form = quadratic)",
    };
    format!(
        "import \"{file}.dgd\"\npart {name}: {file}{arguments}\n{name}.q = sin({inflow})\noutput {name}.h"
    )
}

/// Several models of one kind, each connected to the previous one.
fn several_parts(w: &mut Writer, d: u32) -> String {
    let (name, file) = (w.name("s"), w.name("part"));
    let inflow = w.scalar(d.min(2));
    let text = format!(
        "model {file}\nparameter a = 0.5  in 0 .. 2\nconstant b = 1.5\ninput q [1] hold\ninput before [1] hold\n\
         state h = 0.2\nlet net = b*q + 0.3*before - a*h\n\
         variant form {{\n  plain {{ equation level: der(h) = net/1 [s] }}\n\
         \x20 bent {{ equation level: der(h) = tanh(net)/1 [s] }}\n}}\noutput twice = 2*h + net\n"
    );
    w.files.insert(format!("{file}.dgd"), text);
    for element in ["h[2]", "twice[1]", "twice[3]"] {
        w.declare(&format!("{name}.{element}"), &SCALES[0], Kind::OfPart);
    }
    let arguments = match w.random.below(4) {
        0 => "",
        1 => "(a = 0.8, h = (0.1, 0.3, 0.2))",
        2 => "(a = 0.2*n, form = bent)",
        _ => "(a = (0.3, 0.5, 0.9), b = 1 + 0.1*n, h = 0.1*n)",
    };
    let chained = match w.random.below(2) {
        0 => format!("for n in 1..3 {{ {name}.before[n] = 0.1*n }}"),
        _ => format!(
            "{name}.before[1] = 0.2\nfor n in 2..3 {{ {name}.before[n] = {name}.twice[n-1] }}"
        ),
    };
    format!(
        "import \"{file}.dgd\"\npart {name}[n in 1..3]: {file}{arguments}\n{name}.q = sin({inflow})\n\
         {chained}\noutput {name}.h"
    )
}

/// A curve through points, called like a function.
fn table(w: &mut Writer, _: u32) -> String {
    let name = w.name("f");
    let mut abscissa = -1.5;
    let step = w.random.chance(0.3).then(|| w.random.below(3));
    let points: Vec<String> = (0..4)
        .map(|k| {
            let point = format!("({abscissa:.2}, {:.2})", w.random.between(-1.0, 1.0));
            // Two points at one abscissa are a step.
            if step != Some(k) {
                abscissa += w.random.between(0.4, 1.2);
            }
            point
        })
        .collect();
    let shape = w.random.pick(&["linear", "pchip", "natural"]).to_owned();
    let beyond = w.random.pick(&["hold", "extend"]).to_owned();
    w.functions.push(Function { name: name.clone(), arguments: vec![&SCALES[0]] });
    format!("table {name}(a0) = {} {shape}, beyond {beyond}", points.join(", "))
}

/// A library with a constant and a function.
fn library(w: &mut Writer, d: u32) -> String {
    let (file, c, f) = (w.name("lib"), w.name("c"), w.name("f"));
    let known = std::mem::take(&mut w.known);
    w.known.push(Known::new(&c, &SCALES[2], Kind::Constant));
    w.arguments = vec!["a0".to_owned(), "(a1/10 [cm])".to_owned()];
    let outer = w.reads;
    w.reads = Reads::Parameters;
    let body = w.scalar(d.min(2));
    w.reads = outer;
    w.arguments = Vec::new();
    w.known = known;
    let text = format!("constant {c} [cm] = 7\nfunction {f}(a0, a1 [cm]) = {body}\n");
    w.files.insert(format!("{file}.dgd"), text);
    w.declare(&c, &SCALES[2], Kind::Constant);
    w.functions.push(Function { name: f, arguments: vec![&SCALES[0], &SCALES[2]] });
    format!("import \"{file}.dgd\"")
}
