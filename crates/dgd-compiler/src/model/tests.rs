//! Models made of parts, after resolving their names.

use super::*;
use crate::expr::Symbol;
use crate::syntax::ast::Name;
use crate::tank::{TANK, TankCompilation};

impl TankCompilation {
    /// The messages for an invalid model.
    fn messages(&mut self) -> Vec<String> {
        if !self.asts.is_empty() {
            let model = resolve(&self.asts, &ModelOptions::default(), &mut self.diagnostics);
            assert!(model.is_err());
        }
        let sorted = self.diagnostics.sorted();
        sorted.iter().map(|d| format!("{}: {}", d.code, d.message)).collect()
    }
}

#[test]
fn arguments_are_values_start_values_and_choices() {
    let pump = "model pump\nconstant c = 1\nparameter k [bar] = 2\nstate x [m] = 3\n\
                variant law { linear { equation e: der(x) = c*x/1 [s] } \
                still { equation e: der(x) = 0 } }\n";
    let main =
        "model pond\nimport \"pump.dgd\"\npart one: pump(k = 2*2, x = 1 [cm], law = still)\n";
    let mut run = TankCompilation::new(&[("pond.dgd", main), ("pump.dgd", pump)]);
    let model = run.model();
    assert_eq!(model.parameters[0].declared.name, "one.k");
    assert_eq!(model.parameters[0].value, 4e5);
    assert_eq!(model.graph.value(model.unknowns[0].start), Some(0.01));
    assert_eq!(model.variants[0].name, "one.law");
    assert_eq!(model.variants[0].choices, ["still", "linear"]);
    assert_eq!(model.variants[0].chosen, 0);
}

#[test]
fn an_argument_that_reads_a_parameter_ties_the_two() {
    let main = "model pond\nimport \"tank.dgd\"\nparameter A [m^2] = 4\nconstant B [m^2] = 5\n\
                let half = A/2\n\
                part one: tank(A = half, a = B/500)\npart two: tank(a = 0.02, A = B)\n\
                one.q_in = two.q_out\ntwo.q_in = one.q_out\n";
    let mut run = TankCompilation::new(&[("pond.dgd", main), ("tank.dgd", TANK)]);
    let model = run.model();
    let parameters: Vec<&str> = model.parameters.iter().map(|p| p.declared.name.as_str()).collect();
    assert_eq!(parameters, ["A", "one.a", "two.a"]);
    let constants: Vec<&str> = model.constants.iter().map(|c| c.declared.name.as_str()).collect();
    // A value computed from a tied value is tied as well.
    assert_eq!(constants, ["B", "one.g", "two.g", "two.A", "two.V"]);
}

#[test]
fn libraries_are_there_once_and_their_names_do_not_meet_others() {
    let law = "constant k = 2\nfunction twice(x) = k*x\n";
    let pump = "model pump\nimport \"law.dgd\"\nstate x = 1\nequation e: der(x) = twice(x)/1 [s]\n";
    // The model itself sees the library as well: one set of names.
    let main = "model pond\nimport \"law.dgd\"\nimport \"pump.dgd\"\npart one: pump\npart two: pump\n\
                let y = k\n";
    let mut run = TankCompilation::new(&[("pond.dgd", main), ("law.dgd", law), ("pump.dgd", pump)]);
    let names: Vec<String> =
        run.model().constants.iter().map(|c| c.declared.name.clone()).collect();
    assert_eq!(names, ["k"]);
    // It does not: the name belongs to the file, whose own constant differs.
    let main = "model pond\nimport \"pump.dgd\"\npart one: pump\npart law: pump\nconstant k = 7\n";
    let mut run = TankCompilation::new(&[("pond.dgd", main), ("law.dgd", law), ("pump.dgd", pump)]);
    let names: Vec<String> =
        run.model().constants.iter().map(|c| c.declared.name.clone()).collect();
    assert_eq!(names, ["law_2.k", "k"]);
}

#[test]
fn parts_of_parts_have_longer_names() {
    let pair = "model pair\nimport \"tank.dgd\"\ninput q [m^3/s]\npart a: tank(a = 0.02)\npart b: tank\n\
                a.q_in = q\nb.q_in = a.q_out\noutput q_out [m^3/s] = b.q_out\n";
    let main = "model whole\nimport \"pair.dgd\"\ninput rain [m^3/s]\n\
                part first: pair(a.h = 2, b.a = 0.03)\n\
                part second: pair\nfirst.q = rain\nsecond.q = first.q_out\n";
    let mut run = TankCompilation::new(&[("w.dgd", main), ("pair.dgd", pair), ("tank.dgd", TANK)]);
    let model = run.model();
    let unknowns: Vec<&str> = model.unknowns.iter().map(|x| x.declared.name.as_str()).collect();
    assert_eq!(unknowns, ["first.a.h", "first.b.h", "second.a.h", "second.b.h"]);
    assert_eq!(model.graph.value(model.unknowns[0].start), Some(2.0));
    let value = |name: &str| model.parameters.iter().find(|p| p.declared.name == name);
    assert_eq!(value("first.b.a").map(|p| p.value), Some(0.03));
    assert_eq!(value("second.a.a").map(|p| p.value), Some(0.02));
    let parts: Vec<&str> = model.parts.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(parts, ["first", "first.a", "first.b", "second", "second.a", "second.b"]);
}

#[test]
fn a_part_can_stand_in_a_choice() {
    let still = "model still\ninput q_in [m^3/s]\nstate h [m] = 3\nequation e: der(h) = 0\n";
    let main = "model pond\nimport \"tank.dgd\"\nimport \"still.dgd\"\nvariant kind {\n\
                full { part one: tank }\nempty { part one: still }\n}\none.q_in = 2\nlet x = one.h\n";
    let mut run =
        TankCompilation::new(&[("p.dgd", main), ("tank.dgd", TANK), ("still.dgd", still)]);
    assert_eq!(run.model().equations[0].label, "one.level");
}

#[test]
fn mistakes_are_named() {
    let with = |lines: &str| {
        let main = format!("model pond\nimport \"tank.dgd\"\nconstant c = 1\n{lines}\n");
        TankCompilation::new(&[("pond.dgd", &main), ("tank.dgd", TANK)]).messages()
    };
    let bound = "\none.q_in = 2";
    for (lines, expected) in [
        ("part one: tnk", "E201: there is no model `tnk`"),
        ("part one: tank", "E220: input `one.q_in` is not bound"),
        (&format!("part one: tank(b = 1){bound}"), "E201: model `tank` has no `b`"),
        (&format!("part one: tank(q_out = 1){bound}"), "E205: `q_out` cannot be given a value"),
        (&format!("part one: tank(q_in = 1){bound}"), "E205: `q_in` is an input of `tank`"),
        (&format!("part one: tank(a = 1, a = 2){bound}"), "E202: `a` is given twice"),
        (&format!("part one: tank{bound}{bound}"), "E202: `one.q_in` is bound twice"),
        (&format!("part one: tank{bound}\none.a = 2"), "E205: `one.a` is no input of part `one`"),
        (&format!("part one: tank{bound}\none.q = 2"), "E201: part `one` has no input `one.q`"),
        (&format!("part one: tank{bound}\ntwo.q = 2"), "E201: there is no part `two`"),
        (&format!("part one: tank{bound}\npart one: tank"), "E202: `one` is declared twice"),
        ("part c: tank\nc.q_in = 1", "E202: `c` is declared twice"),
        (
            &format!("part one: tank{bound} [s]"),
            "E302: declared in `m^3/s`, but the value is in `s`",
        ),
        (
            "part one: tank\none.q_in = one.p/1e5 [Pa*s/m^3]\nlet z = one.hh",
            "E201: nothing is called `one.hh`",
        ),
        (
            "part one: tank\none.q_in = x\nlet x = one.q_in",
            "E206: `one.q_in` depends on itself: `one.q_in` → `x` → `one.q_in`",
        ),
    ] {
        assert_eq!(with(lines), [expected], "{lines}");
    }
}

/// A line whose end has a given flow or a given pressure; one choice declares an input, another reads one.
const LINE: &str = "\
model line
state q = 1
input slow
let slowed = slow*q
variant end {
  flow { input q_end
    equation end: der(q) = (q_end - q)/1 [s] }
  pressure { input p_end
    equation end: der(q) = (p_end - slowed)/1 [s] }
}
output late = slowed
";

#[test]
fn inputs_that_the_chosen_variants_do_not_read_need_not_be_bound() {
    let with = |lines: &str| {
        let main = format!("model pond\nimport \"line.dgd\"\n{lines}\n");
        TankCompilation::new(&[("pond.dgd", &main), ("line.dgd", LINE)])
    };
    let mut run = with("part one: line\none.q_end = 2");
    let model = run.model();
    assert!(model.inputs.is_empty());
    // The other choice is impossible.
    assert_eq!(model.variants[0].choices, ["flow"]);
    assert_eq!(model.lets.iter().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["one.q_end"]);
    // They may be bound nevertheless.
    let model = with("part one: line\none.q_end = 2\none.slow = 1\none.p_end = 0").model();
    assert_eq!(model.variants[0].choices, ["flow", "pressure"]);
    for (lines, expected) in [
        // Another choice reads others.
        (
            "part one: line(end = pressure)\none.q_end = 2",
            "E220: inputs `one.p_end`, `one.slow` are not bound",
        ),
        // The whole model reads a value that needs the input.
        ("part one: line\none.q_end = 2\nlet x = one.late", "E220: input `one.slow` is not bound"),
        // Bound in one choice of the whole and missing in the chosen one.
        (
            "part one: line\nvariant v {\na { let x = 1 }\nb { one.q_end = 2 }\n}",
            "E220: input `one.q_end` is not bound",
        ),
    ] {
        assert_eq!(with(lines).messages(), [expected], "{lines}");
    }
    let lines = "part one: line\nvariant v {\na { one.q_end = 2 }\nb { let x = 1 }\n}";
    with(lines).model();
}

#[test]
fn inputs_that_other_choices_read_are_not_asked_for() {
    let text = "model m\ninput u\ninput v\ninput shown\nlet both = u + v\nfunction f(u) = u\n\
                state x\nvariant law {\none { equation e: der(x) = f(v)/1 [s] }\n\
                two { equation e: der(x) = both/1 [s] }\n}\n";
    let inputs = |choice: &str| {
        let mut run = TankCompilation::new(&[("m.dgd", text)]);
        let name = |text: &str| Name { text: text.into(), span: Span::default() };
        let variants = vec![(name("law"), name(choice))];
        let options = ModelOptions { variants, ..ModelOptions::default() };
        let model = resolve(&run.asts, &options, &mut run.diagnostics).expect(choice);
        model.inputs.iter().map(|input| input.declared.name.clone()).collect::<Vec<_>>()
    };
    assert_eq!(inputs("one"), ["v", "shown"]);
    assert_eq!(inputs("two"), ["u", "v", "shown"]);
}

#[test]
fn start_values_of_a_part_read_what_the_whole_starts_with() {
    let pipe = "model pipe\ninput q_in [m^3/s]\nsize N = 2\nstate q [m^3/s] = 2*q_in\n\
                state r[i in 1..N] [m^3/s] = i*q_in\n\
                equation e: der(q) = (q_in - q)/1 [s]\n\
                for i in 1..N { equation f[i]: der(r[i]) = (q_in - r[i])/1 [s] }\n";
    let with = |lines: &str| {
        let main = format!("model pond\nimport \"pipe.dgd\"\nparameter a [m^3/s] = 3\n{lines}\n");
        TankCompilation::new(&[("pond.dgd", &main), ("pipe.dgd", pipe)])
    };
    // Through two parts, in either order, and an element of an array.
    let model = with(
        "part two: pipe\npart one: pipe\ntwo.q_in = one.q + one.r[2]\none.q_in = x\n\
         state x [m^3/s] = 5*a\nequation e: der(x) = 0",
    )
    .model();
    let start = |name: &str| {
        let unknown = model.unknowns.iter().find(|x| x.declared.name == name).expect(name);
        model.graph.evaluate(unknown.start, &|symbol| match symbol {
            Symbol::Parameter(0) => 3.0,
            _ => f64::NAN,
        })
    };
    assert_eq!([start("x"), start("one.q"), start("two.q")], [15.0, 30.0, 2.0 * (30.0 + 30.0)]);

    for (lines, expected) in [
        (
            "part one: pipe\npart two: pipe\none.q_in = two.q\ntwo.q_in = one.q",
            "E206: start values depend on each other: `one.q` → `two.q` → `one.q`",
        ),
        (
            "part one: pipe\none.q_in = y\nunknown y [m^3/s]\nequation e: y = a",
            "E503: this start value depends on `y`, which is not known before",
        ),
        (
            "part one: pipe\none.q_in = a\nstate y [m^3/s] = one.q\nequation e: der(y) = 0",
            "E503: this start value depends on `one.q`, which is not known before",
        ),
        (
            "part one: pipe\none.q_in = delay(x, 1 [s])\nstate x [m^3/s]\nequation e: der(x) = 0",
            "E503: this start value depends on an unknown, which is not known before",
        ),
    ] {
        assert_eq!(with(lines).messages()[0], expected, "{lines}");
    }
}

#[test]
fn an_input_that_is_not_bound_is_said_where_the_part_stands() {
    let pair = "model pair\nimport \"line.dgd\"\npart a: line(end = pressure)\na.slow = 1\n";
    let main = "model pond\nimport \"pair.dgd\"\npart first: pair\n";
    let mut run =
        TankCompilation::new(&[("pond.dgd", main), ("pair.dgd", pair), ("line.dgd", LINE)]);
    assert_eq!(run.messages(), ["E220: input `first.a.p_end` is not bound"]);
    let shown = run.shown();
    for part in [
        "--> pair.dgd:3:6",
        "an input of the part's model with `first.a.end = pressure`",
        "say what it is: `a.p_end = …`",
    ] {
        assert!(shown.contains(part), "{part}\n{shown}");
    }
}

#[test]
fn a_part_knows_nothing_of_the_whole() {
    let main = "model pond\nimport \"p.dgd\"\nconstant k = 1\nfunction f(x) = x\npart one: p\n";
    let part = "model p\nstate x = 1\nequation e: der(x) = k*x/1 [s] + f(x)/1 [s]\nlet z = out\n\
                output out = x\n";
    let messages = TankCompilation::new(&[("pond.dgd", main), ("p.dgd", part)]).messages();
    assert_eq!(
        messages,
        [
            "E201: nothing is called `k`",
            "E203: there is no function `f`",
            "E205: `out` is an output, which cannot be read inside the model"
        ]
    );
}

#[test]
fn a_model_does_not_contain_itself() {
    let a = "model a\nimport \"b.dgd\"\npart x: b\n";
    let b = "model b\nimport \"c.dgd\"\npart x: c\n";
    let c = "model c\nimport \"b.dgd\"\npart x: b\n";
    let messages = TankCompilation::new(&[("a.dgd", a), ("b.dgd", b), ("c.dgd", c)]).messages();
    assert_eq!(messages, ["E221: `b` contains itself: `b` → `c` → `b`"]);
    let messages = TankCompilation::new(&[("a.dgd", "model a\npart x: a\n")]).messages();
    assert_eq!(messages, ["E221: `a` contains itself: `a` → `a`"]);
}

#[test]
fn a_name_means_one_model() {
    let main =
        "model pond\nimport \"x/tank.dgd\"\nimport \"tank.dgd\"\npart one: tank\none.q_in = 1\n";
    let files = [("pond.dgd", main), ("tank.dgd", TANK), ("x/tank.dgd", TANK)];
    assert_eq!(TankCompilation::new(&files).messages(), ["E202: two models are called `tank`"]);
}

#[test]
fn there_is_an_end_to_what_parts_come_to() {
    // Each model holds two of the next: 2^40 tanks.
    let texts: Vec<(String, String)> = (0..40)
        .map(|i| {
            let next = i + 1;
            let text =
                format!("model m{i}\nimport \"m{next}.dgd\"\npart a: m{next}\npart b: m{next}\n");
            (format!("m{i}.dgd"), text)
        })
        .collect();
    let mut files: Vec<(&str, &str)> =
        texts.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
    files.push(("m40.dgd", "model m40\nstate x = 1\nequation e: der(x) = 0\n"));
    let messages = TankCompilation::new(&files).messages();
    assert!(messages[0].starts_with("E211"), "{messages:?}");
}

#[test]
fn modes_of_a_part_start_as_its_model_says() {
    let valve = "model valve\ninput u\nparameter tau [s] = 2\nparameter k = 1\nstate x = 1\n\
                 function gain(k) = 2*k\n\
                 modes side {\nopen { equation e: der(x) = -gain(k)*x/1 [s] }\n\
                 shut { equation e: der(x) = 0 }\n\
                 open -> shut when x falls below delay(u, tau) { reset x = k }\n\
                 start shut\nstart open if x > k and not u > tau/1 [s]\n}\n";
    let main = "model whole\nimport \"valve.dgd\"\ninput w\npart one: valve\none.u = w\n\
                modes side {\na { equation f: y = one.x }\nb { equation f: y = 0 }\n\
                a -> b when y rises above 2 { reset one.x = 3 }\n}\nunknown y\n";
    let mut run = TankCompilation::new(&[("w.dgd", main), ("valve.dgd", valve)]);
    let model = run.model();
    assert_eq!(model.automata.len(), 2);
    assert_eq!(model.automata[0].start, 1);
}

/// Compares a smoothness: table, weights of parameters by name, mean and standard deviation.
#[track_caller]
fn agrees(model: &Model, k: usize, table: &str, weights: &[(&str, f64)], normal: [f64; 2]) {
    let found = &model.smoothness[k];
    let near = |a: f64, b: f64| (a - b).abs() < 1e-12 * b.abs().max(1.0);
    let is_same = |((i, weight), (name, wanted)): (&(u32, f64), &(&str, f64))| {
        model.parameters[*i as usize].declared.name == *name && near(*weight, *wanted)
    };
    assert_eq!((found.table.as_str(), found.weights.len()), (table, weights.len()));
    assert!(found.weights.iter().zip(weights).all(is_same), "{found:?}");
    assert!(near(found.mean, normal[0]) && near(found.std, normal[1]), "{found:?}");
}

#[test]
fn a_smooth_table_is_known_by_its_second_differences() {
    let text = "model m\nparameter p [1] = 1\nparameter c[1..4] [K] = (1, 2, 3, 4)\n\
                parameter b [K] = 2\nconstant rough = 2\nlet twice = 2*b\nstate x = 1\n\
                table f(T [°C]) [K] at (0, 20, 60, 100) = c linear, smooth 0.5\n\
                table g(T [°C]) [°C] = (30, twice), (0, 2), (10, b - 3*(1 [K] - b)), (40, 5) \
                natural, smooth rough*0.5 [K]\n\
                equation e: der(x) = 0\n";
    let mut run = TankCompilation::new(&[("m.dgd", text)]);
    let model = run.model();
    assert_eq!(model.smoothness.len(), 4);
    let third = 1.0 / 3.0;
    agrees(&model, 0, "f", &[("c[1]", -2.0 * third), ("c[2]", 1.0), ("c[3]", -third)], [0.0, 0.5]);
    agrees(&model, 1, "f", &[("c[2]", -0.5), ("c[3]", 1.0), ("c[4]", -0.5)], [0.0, 0.5]);
    // 4 b - 3 less 2/3 of 2 °C and 1/3 of 2 b.
    let mean = 3.0 + 2.0 * third * 275.15;
    agrees(&model, 2, "g", &[("b", 4.0 - 2.0 * third)], [mean, 1.0]);
    // 2 b less 1/3 of 4 b - 3 and 2/3 of 5 °C.
    let mean = 2.0 * third * 278.15 - 1.0;
    agrees(&model, 3, "g", &[("b", 2.0 - 4.0 * third)], [mean, 1.0]);
}

#[test]
fn what_a_smooth_table_says_goes_along_with_its_part() {
    let part = "model heater\nconstant rough [kJ/K] = 0.1\nparameter c[1..3] [kJ/K] = (1, 2, 3)\n\
                input T [°C]\ntable C(T [°C]) [kJ/K] at (0, 10, 20) = c linear, smooth rough\n\
                output C [kJ/K] = C(T)\n";
    let main = "model two\nimport \"heater.dgd\"\ninput T [°C]\npart one: heater(rough = 0.2)\n\
                part other: heater\none.T = T\nother.T = T\n";
    let mut run = TankCompilation::new(&[("two.dgd", main), ("heater.dgd", part)]);
    let model = run.model();
    assert_eq!(model.smoothness.len(), 2);
    let weights = [("one.c[1]", -0.5), ("one.c[2]", 1.0), ("one.c[3]", -0.5)];
    agrees(&model, 0, "one.C", &weights, [0.0, 200.0]);
    let weights = [("other.c[1]", -0.5), ("other.c[2]", 1.0), ("other.c[3]", -0.5)];
    agrees(&model, 1, "other.C", &weights, [0.0, 100.0]);
}
