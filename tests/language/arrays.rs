//! Arrays and loops against the same models written out element by element.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use dgd_compiler::codegen;
use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{CompiledStages, SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    EvaluationPoint, Inputs, Options, Pattern, Problem, Signature, System,
    simulate_with_sensitivities,
};

use crate::support;
use crate::support::Noise;

/// Compiles a text with all sensitivities.
pub(crate) fn compiled(text: &str) -> (CompiledStages, SourceMap) {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let main = SourceText { name: "model.dgd".to_owned(), text: text.to_owned() };
    let none = &mut |_: &str| Err("no file".to_owned());
    let options = ModelOptions::default();
    let compiled =
        compile(main, &options, &SensitivityDirections::All, none, &mut sources, &mut diagnostics);
    let Ok(compiled) = compiled else {
        panic!("{}", render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain))
    };
    (compiled, sources)
}

pub(crate) fn interpreted(text: &str) -> InterpretedSystem {
    InterpretedSystem::new(compiled(text).0.program)
}

/// A line of cells with everything that rows can hold: neighbours, one element in all rows, the
/// index, parameters, inputs, `let`s of loops and of none, an algebraic array, selections.
const LINE: &str = "\
model line
size N = 5
parameter k [1/s] = 2
parameter a = 0.3
parameter tau [s] = 0.5
input feed linear
input on hold
state total = 0.1
state x[i in 1..N] = a + 0.1*i
unknown y[0..N] = 0.2
let late = delay(feed, tau)
for i in 1..N { let gain[i] = a*sqrt(i) + sin(total) }
for i in 2..N { let step[i] = gain[i]*x[i-1] - gain[i-1]*x[i] }
equation sum: der(total) = k*(x[N] - total*y[2]) + 0.1*late/1 [s]
equation left: y[0] = feed*x[1]^2
for i in 1..N { equation chain[i]: y[i] = y[i-1]*a + x[i]*x[3] + 0.5*y[i]^2 + if on > 0.5 then i*a else 0 }
equation first: 2 [s] * der(x[1]) = feed - x[1]*y[1]
for i in 2..N { equation cell[i]: der(x[i])/k = step[i] + max(x[i], x[i-1]) + time/1 [s]*y[i-1] + on*late }
output last = x[N]
output rate [1/s] = der(x[2])
output y
";

/// The same for five cells, element by element.
fn written_out() -> String {
    let mut text = "\
model line
parameter k [1/s] = 2
parameter a = 0.3
parameter tau [s] = 0.5
input feed linear
input on hold
state total = 0.1
let late = delay(feed, tau)
equation sum: der(total) = k*(x_5 - total*y_2) + 0.1*late/1 [s]
equation left: y_0 = feed*x_1^2
equation first: 2 [s] * der(x_1) = feed - x_1*y_1
unknown y_0 = 0.2
output last = x_5
output rate [1/s] = der(x_2)
output y_0
output y_1
output y_2
output y_3
output y_4
output y_5
"
    .to_owned();
    for i in 1..=5 {
        let _ = writeln!(text, "state x_{i} = a + 0.1*{i}\nunknown y_{i} = 0.2");
        let _ = writeln!(text, "let gain_{i} = a*sqrt({i}) + sin(total)");
        let j = i - 1;
        let _ = writeln!(
            text,
            "equation chain_{i}: y_{i} = y_{j}*a + x_{i}*x_3 + 0.5*y_{i}^2 + \
             if on > 0.5 then {i}*a else 0"
        );
        if i > 1 {
            let _ = writeln!(text, "let step_{i} = gain_{i}*x_{j} - gain_{j}*x_{i}");
            let _ = writeln!(
                text,
                "equation cell_{i}: der(x_{i})/k = step_{i} + max(x_{i}, x_{j}) + \
                 time/1 [s]*y_{j} + on*late"
            );
        }
    }
    text
}

/// `x[3]` as the other model spells it.
fn flat(name: &str) -> String {
    name.replace('[', "_").replace(']', "")
}

/// For each unknown of `a` its position in `b`.
fn positions(a: &Signature, b: &Signature) -> Vec<usize> {
    let of: BTreeMap<String, usize> =
        b.unknowns.iter().enumerate().map(|(i, unknown)| (flat(&unknown.name), i)).collect();
    a.unknowns.iter().map(|unknown| of[&flat(&unknown.name)]).collect()
}

/// A matrix with its rows and columns put elsewhere; places outside of the pattern are none.
fn by_place(
    pattern: &Pattern,
    values: &[f64],
    row: impl Fn(usize) -> usize,
    column: impl Fn(usize) -> usize,
) -> BTreeMap<(usize, usize), f64> {
    let mut places = BTreeMap::new();
    for ((r, c), value) in pattern.positions().zip(values) {
        let earlier = places.insert((row(r), column(c)), *value);
        assert_eq!(earlier, None, "a place stands twice in a pattern");
    }
    places
}

/// Sums are taken in another order: a few roundings of the terms, which are below ten here.
const ROUNDING: f64 = 1e-14;

fn close(what: &str, a: f64, b: f64) {
    assert!((a - b).abs() <= ROUNDING * (1.0 + a.abs()), "{what}: {a:e} and {b:e}");
}

#[test]
fn a_model_with_arrays_is_the_model_written_out() {
    assert_the_same(&interpreted(LINE), &interpreted(&written_out()));
}

/// Asserts that two models are one: their functions, derivatives, start values and outputs at random
/// points. The unknowns of `a` are those of `b`, whose names have `_2` for `[2]`.
pub(crate) fn assert_the_same(a: &InterpretedSystem, b: &InterpretedSystem) {
    let (sa, sb) = (a.signature().clone(), b.signature().clone());
    let (n, n_s) = (sa.unknowns.len(), sa.directions.len());
    assert_eq!((n, n_s), (sb.unknowns.len(), sb.directions.len()));
    let place = positions(&sa, &sb);
    for (i, &other) in place.iter().enumerate() {
        assert_eq!(sa.unknowns.is_differential(i), sb.unknowns.is_differential(other));
    }
    let row = |r: usize| r / n * n + place[r % n];
    let own = |c: usize| c;
    let mut noise = Noise::new(7);
    for _ in 0..5 {
        let mut random = |len: usize| -> Vec<f64> { (0..len).map(|_| noise.next()).collect() };
        let (y, u, udot, s) = (random(n), random(sa.n_u()), random(sa.n_u()), random(n * n_s));
        let moved = random(sa.parameters.len());
        let near = sa.parameters.iter().zip(moved);
        let p: Vec<f64> = near.map(|(p, moved)| p.value * (1.0 + 0.3 * moved)).collect();
        let (mut yb, mut s_b) = (vec![0.0; n], vec![0.0; n * n_s]);
        for i in 0..n {
            yb[place[i]] = y[i];
        }
        for i in 0..n * n_s {
            s_b[row(i)] = s[i];
        }
        let at = EvaluationPoint { t: 0.7, y: &y, u: &u, p: &p, z: &[] };
        let bt = EvaluationPoint { y: &yb, ..at };
        let linear = |system: &InterpretedSystem, at: EvaluationPoint<'_>, s: &[f64]| {
            let signature = system.signature();
            let (mut f, mut dfdt) = (vec![0.0; n], vec![0.0; n]);
            let (mut g, mut dgdt) = (vec![0.0; n * n_s], vec![0.0; n * n_s]);
            let mut jacobian = vec![0.0; signature.jacobian.len()];
            let mut dgdy = vec![0.0; signature.sensitivity_jacobian.len()];
            system.sensitivity_linearize(
                at,
                &udot,
                s,
                &mut f,
                &mut jacobian,
                &mut dfdt,
                &mut g,
                &mut dgdy,
                &mut dgdt,
            );
            let (mut y0, mut s0) = (vec![0.0; n], vec![0.0; n * n_s]);
            system.start(at, &mut y0);
            system.start_sensitivities(at, &mut s0);
            let mut dfdp = vec![0.0; signature.parameter_jacobian.len()];
            let mut dfdu = vec![0.0; signature.input_jacobian.len()];
            let mut partial = vec![0.0; n];
            system.parameter_jacobian(at, &mut dfdp);
            system.input_jacobian(at, &mut dfdu);
            system.time_derivative(at, &mut partial);
            let n_w = signature.outputs.len();
            let (mut w, mut dw) = (vec![0.0; n_w], vec![0.0; n_w * n_s]);
            system.output_sensitivities(at, s, &mut w, &mut dw);
            let dense = [f, dfdt, g, dgdt, y0, s0, partial];
            (dense, [jacobian, dgdy, dfdp, dfdu], [w, dw])
        };
        let (dense_a, sparse_a, out_a) = linear(a, at, &s);
        let (dense_b, sparse_b, out_b) = linear(b, bt, &s_b);
        for (which, (a, b)) in dense_a.iter().zip(&dense_b).enumerate() {
            for (i, value) in a.iter().enumerate() {
                close(&format!("result {which}, row {i}"), *value, b[row(i)]);
            }
        }
        for (a, b) in out_a.iter().flatten().zip(out_b.iter().flatten()) {
            close("outputs", *a, *b);
        }
        let patterns = |s: &Signature| {
            [&s.jacobian, &s.sensitivity_jacobian, &s.parameter_jacobian, &s.input_jacobian]
                .map(Clone::clone)
        };
        let pairs =
            patterns(&sa).into_iter().zip(patterns(&sb)).zip(sparse_a.iter().zip(&sparse_b));
        for (which, ((pa, pb), (va, vb))) in pairs.enumerate() {
            let column = |c: usize| if which < 2 { place[c] } else { c };
            let places_a = by_place(&pa, va, row, column);
            let places_b = by_place(&pb, vb, own, own);
            let keys = |places: &BTreeMap<(usize, usize), f64>| -> Vec<_> {
                places.keys().copied().collect()
            };
            // What depends on an element of an array of parameters has a place in the other rows, too.
            if which != 1 {
                assert_eq!(keys(&places_a), keys(&places_b), "pattern {which}");
            }
            assert!(places_b.keys().all(|place| places_a.contains_key(place)));
            for (place, value) in &places_a {
                let other = places_b.get(place).copied().unwrap_or(0.0);
                close(&format!("matrix {which} at {place:?}"), *value, other);
            }
        }
    }
}

/// A text with every number as `#`.
fn without_numbers(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match (c.is_ascii_digit(), out.ends_with('#')) {
            (true, false) => out.push('#'),
            (true, true) => {}
            (false, _) => out.push(c),
        }
    }
    out
}

#[test]
fn no_text_grows_with_the_size() {
    let texts = |n: usize| {
        let text = LINE.replace("N = 5", &format!("N = {n}"));
        let (compiled, sources) = compiled(&text);
        let rust = codegen::generate(&compiled.program, "line", &sources).to_string();
        [
            dgd_compiler::model::text::write(&compiled.model),
            dgd_compiler::dae::text::write(&compiled.dae),
            compiled.program.to_string(),
            rust,
        ]
    };
    let (small, large) = (texts(100), texts(100_000));
    for (small, large) in small.iter().zip(&large) {
        assert_eq!(without_numbers(small), without_numbers(large));
    }
}

/// Where ∂f/∂y is found not to vanish by moving one unknown after the other.
fn moved_places(system: &InterpretedSystem, noise: &mut Noise) -> Vec<(usize, usize)> {
    let signature = system.signature();
    let n = signature.unknowns.len();
    let p: Vec<f64> = signature.parameters.iter().map(|p| p.value + 0.1 * p.unit.factor).collect();
    let u: Vec<f64> = (0..signature.n_u()).map(|_| 2.0 + noise.next()).collect();
    let z = dgd_runtime::discrete_numbers(system, &p, 0.3);
    let mut places = Vec::new();
    for _ in 0..3 {
        let mut y: Vec<f64> = (0..n).map(|_| 1.5 + noise.next()).collect();
        let rhs = |y: &[f64]| {
            let mut f = vec![0.0; n];
            system.rhs(EvaluationPoint { t: 0.3, y, u: &u, p: &p, z: &z }, &mut f);
            f
        };
        let before = rhs(&y);
        for column in 0..n {
            let kept = y[column];
            y[column] = kept + 0.37;
            for (row, (after, before)) in rhs(&y).iter().zip(&before).enumerate() {
                if after.to_bits() != before.to_bits() {
                    places.push((row, column));
                }
            }
            y[column] = kept;
        }
    }
    places.sort_unstable();
    places.dedup();
    places
}

#[test]
fn the_pattern_is_where_the_rows_depend_on_unknowns() {
    let mut noise = Noise::new(11);
    for system in [support::interpreted("models/transmission_line.dgd", &[]), interpreted(LINE)] {
        let mut pattern: Vec<(usize, usize)> = system.signature().jacobian.positions().collect();
        pattern.sort_unstable();
        assert_eq!(pattern, moved_places(&system, &mut noise), "{}", system.signature().name);
    }
}

/// The equation behind each unknown.
fn matched(text: &str) -> Vec<(String, String)> {
    let system = interpreted(text);
    let signature = system.signature();
    let pairs = signature.unknowns.iter().zip(signature.equations.iter());
    pairs.map(|(unknown, equation)| (unknown.name.to_string(), equation.to_string())).collect()
}

#[test]
fn loops_find_the_elements_that_they_determine() {
    let cases = [
        // From the left, from the right.
        (
            "equation first: x[1] = 1\nfor i in 2..N { equation next[i]: x[i] = 2*x[i-1] }",
            ["first", "next[2]", "next[3]", "next[4]"],
        ),
        (
            "for i in 2..N { equation next[i]: x[i-1] = 2*x[i] }\nequation last: x[N] = 1",
            ["next[2]", "next[3]", "next[4]", "last"],
        ),
        // Conditions at both ends with neighbours in them.
        (
            "equation a: x[1] = x[2]\nequation b: x[N] = 1 - x[N-1]\n\
             for i in 2..N-1 { equation inner[i]: x[i-1] - 2*x[i] + x[i+1] = 1 }",
            ["a", "inner[2]", "inner[3]", "b"],
        ),
        // Both loops could have any two: each takes what the other leaves.
        (
            "for i in 1..2 { equation odd[i]: x[i] + x[i+2] = i }\n\
             for i in 3..4 { equation even[i]: x[i] - x[i-2] = i }",
            ["odd[1]", "odd[2]", "even[3]", "even[4]"],
        ),
        // Element by element alone: the loop gives x[1] and x[3..4].
        (
            "for i in 1..3 { equation most[i]: x[i] + x[i+1] = y[i] }\nequation two: x[2] = 3",
            ["most[1]", "two", "most[2]", "most[3]"],
        ),
    ];
    for (equations, expected) in cases {
        let text = format!(
            "model m\nsize N = 4\nunknown x[1..N] = 1\nunknown y[1..N] = 1\n\
             for i in 1..N {{ equation known[i]: y[i] = i }}\n{equations}\n"
        );
        let found: Vec<String> =
            matched(&text).into_iter().take(4).map(|(_, equation)| equation).collect();
        assert_eq!(found, expected, "{equations}");
    }
}

#[test]
fn sizes_are_set_from_outside() {
    use dgd_compiler::model::Setting;
    use dgd_compiler::syntax::parse_setting;
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let mut settings = Vec::new();
    for text in ["N=7", "x=0.5"] {
        let id = sources.add(SourceText { name: text.to_owned(), text: text.to_owned() });
        let (name, value) = parse_setting(id, &sources, &mut diagnostics).expect("a setting");
        settings.push(Setting { name, value });
    }
    let options = ModelOptions { settings, ..ModelOptions::default() };
    let main = SourceText { name: "line.dgd".to_owned(), text: LINE.to_owned() };
    let none = &mut |_: &str| Err("no file".to_owned());
    let directions = SensitivityDirections::None;
    let compiled =
        compile(main, &options, &directions, none, &mut sources, &mut diagnostics).expect("sound");
    let unknowns = &compiled.program.signature.unknowns;
    assert_eq!((unknowns.len(), &*unknowns.name(15)), (16, "y[7]"));
    let system = InterpretedSystem::new(compiled.program);
    let mut y0 = vec![0.0; 16];
    let p: Vec<f64> = system.signature().parameters.iter().map(|p| p.value).collect();
    let u = vec![1.0; system.signature().n_u()];
    system.start(EvaluationPoint { t: 0.0, y: &[], u: &u, p: &p, z: &[] }, &mut y0);
    assert_eq!(y0[1..8], [0.5; 7]);
}

#[test]
fn rows_of_arrays_read_what_unknowns_were() {
    let text = |loops: &str| {
        format!(
            "model m
             parameter tau [s] = 0.5
             state x = 1
             state z[1..3] = 0
             equation x: der(x) = -x/1 [s]
             equation first: der(z[1]) = (delay(x, tau) - z[1])/1 [s]
             {loops}"
        )
    };
    let of_one = "for i in 2..2 { equation z[i]: der(z[i]) = (z[i-1] - z[i])/1 [s] }
                  equation last: der(z[3]) = (z[2] - delay(x, 2*tau))/1 [s]";
    let of_two = "for i in 2..3 { equation z[i]: der(z[i]) = (delay(x, tau)*i - z[i])/1 [s] }";
    let written_out = |loops: &str| {
        let text =
            text(loops).replace("state z[1..3] = 0", "state a = 0\nstate b = 0\nstate c = 0");
        let text = text.replace("z[1]", "a").replace("z[2]", "b").replace("z[3]", "c");
        interpreted(&text)
    };
    let pairs = [
        (
            of_one,
            "equation b: der(b) = (a - b)/1 [s]
                  equation c: der(c) = (b - delay(x, 2*tau))/1 [s]",
        ),
        (
            of_two,
            "equation b: der(b) = (delay(x, tau)*2 - b)/1 [s]
                  equation c: der(c) = (delay(x, tau)*3 - c)/1 [s]",
        ),
    ];
    for (loops, flat) in pairs {
        let run = |system: &InterpretedSystem| {
            let p = [0.5];
            let problem = Problem { system, p: &p, inputs: &Inputs::none(), start: &[] };
            simulate_with_sensitivities(&problem, &[0.0, 2.0], &Options::default())
                .expect("a solution")
        };
        let (whole, flat) = (run(&interpreted(&text(loops))), run(&written_out(flat)));
        for (a, b) in whole.y(1).iter().chain(whole.s(1)).zip(flat.y(1).iter().chain(flat.s(1))) {
            assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{a} {b}");
        }
    }
}
