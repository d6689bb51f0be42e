//! Loops over several indices, and along elements that do not follow each other, which are rounds of loops: against the same
//! models written out element by element, in all back ends, and in lengths that do not matter.

use std::fmt::Write as _;

use dgd_compiler::codegen;
use dgd_compiler::program::{FunctionKind, Loop, Program, ProgramFunction};

use crate::arrays::{assert_the_same, compiled, interpreted};

const N: i64 = 5;
const M: i64 = 4;

/// Loops by their ranges and their equations.
///
/// Rows differ in numbers, those of a round and those of its passages; places move forwards, backwards and along columns; what
/// belongs to a round is computed before its passages; one row reads what another row of the same round or another round is.
const LOOPS: [(&str, &str, &str); 8] = [
    ("1..5", "", "q[i][0] = u[i]*g[i] - k[N+1-i]*T[i][1]*1 [s]"),
    (
        "1..5",
        "1..4",
        "q[i][j] = w[i][j]*T[i][j] + sin(k[i]*1 [s])*exp(-r[i][j]*T[N+1-i][j])/j - x[i]*(i + 2*j)",
    ),
    ("1..5", "", "der(T[i][1]) = (q[i][0] - q[i][1])*k[i] - g[N+1-i]*x[2]*T[i][1]/1 [s]"),
    (
        "1..5",
        "2..4",
        "der(T[i][j]) = (q[i][j-1] - q[i][j])*sqrt(k[i]*k[i] + k[N+1-i]*k[1]) + r[i][1]*x[j]*k[1] + u[i]*w[i][j]/1 [s]",
    ),
    ("1..5", "", "der(x[i]) = tanh(x[i] - T[i][2])*k[i] - T[1][3]/1 [s]"),
    ("1..2", "1..4", "z[i][j] = a*T[i][j] + T[i+1][j]"),
    ("3..5", "1..3", "z[i][j] = hypot(x[i], T[i][j])*g[i]*r[i][j+1] + time/1 [s]"),
    ("3..5", "", "z[i][4] = x[i]^2*g[2]"),
];

/// Arrays of declarations: what is declared, for each index, and the value.
const DECLARED: [(&str, &str, &str); 8] = [
    ("parameter k", "[1/s]", "0.1*i/1 [s]"),
    ("parameter r", "[1]", "0.2*i + 0.03*j"),
    ("input u", "[1]", ""),
    ("state T", "[1]", "a*i + 0.1*j"),
    ("state x", "[1]", "0.3/i"),
    ("unknown q", "[1]", "0.1"),
    ("unknown z", "[1]", "0.1"),
    ("output T", "[1]", ""),
];

/// Indices of declared arrays, first and last.
fn indices(name: &str) -> Vec<[i64; 2]> {
    match name.chars().last() {
        Some('k' | 'u' | 'x') => vec![[1, N]],
        Some('q') => vec![[1, N], [0, M]],
        _ => vec![[1, N], [1, M]],
    }
}

const CONSTANTS: &str = "size N = 5\nsize M = 4\n\
    constant g[1..N] = (1, 2.5, -1, 4, 2.5)\n\
    constant w[i in 1..N][j in 1..M] = 0.1*i^2 - 0.7*j\n\
    constant o[1..N] = 1\n";

fn in_loops() -> String {
    let mut text = format!("model m\n{CONSTANTS}parameter a = 0.7\n");
    for (name, unit, value) in DECLARED {
        let brackets = indices(name).into_iter().zip(["i", "j"]);
        let brackets = brackets.map(|([lower, upper], index)| match value {
            "" => format!("[{lower}..{upper}]"),
            _ => format!("[{index} in {lower}..{upper}]"),
        });
        let brackets: String = match name {
            "output T" => String::new(),
            _ => brackets.collect(),
        };
        let value = if value.is_empty() { String::new() } else { format!(" = {value}") };
        let kind = if name.starts_with("input") { " linear" } else { "" };
        let _ = writeln!(text, "{name}{brackets} {unit}{value}{kind}");
    }
    for (number, (outer, inner, equation)) in LOOPS.into_iter().enumerate() {
        let (ranges, label) = match inner {
            "" => (format!("i in {outer}"), "[i]"),
            _ => (format!("i in {outer}, j in {inner}"), "[i][j]"),
        };
        let _ = writeln!(text, "for {ranges} {{ equation e{number}{label}: {equation} }}");
    }
    text
}

/// Text with indices as numbers, and elements as names: `T[i+1][2]` as `T_3_2`.
fn at(text: &str, i: i64, j: i64) -> String {
    let mut out = String::new();
    let mut rest = text;
    let constant = |name: &str, indices: &[i64]| match (name, indices) {
        ("g", [i]) => Some([1.0, 2.5, -1.0, 4.0, 2.5][*i as usize - 1]),
        ("w", [i, j]) => Some(0.1 * (i * i) as f64 - 0.7 * *j as f64),
        _ => None,
    };
    while let Some(begin) = rest.find(|c: char| c.is_ascii_alphabetic()) {
        out += &rest[..begin];
        rest = &rest[begin..];
        let end = rest.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(rest.len());
        let (name, after) = rest.split_at(end);
        rest = after;
        let mut indices = Vec::new();
        while rest.starts_with('[') {
            let (index, after) = rest[1..].split_once(']').expect("a bracket closes");
            indices.push(whole(index, i, j));
            rest = after;
        }
        match (name, constant(name, &indices)) {
            (_, Some(value)) => {
                let _ = write!(out, "({value:?})");
            }
            ("i", _) => out += &i.to_string(),
            ("j", _) => out += &j.to_string(),
            _ => {
                out += name;
                for index in &indices {
                    let _ = write!(out, "_{index}");
                }
            }
        }
    }
    out + rest
}

/// A sum of indices.
fn whole(index: &str, i: i64, j: i64) -> i64 {
    let index = index.replace('-', "+-");
    let term = |term: &str| {
        let (sign, term) = term.strip_prefix('-').map_or((1, term), |term| (-1, term));
        sign * match term {
            "i" => i,
            "j" => j,
            "N" => N,
            number => number.parse().expect("a number"),
        }
    };
    index.split('+').map(term).sum()
}

fn range(range: &str) -> std::ops::RangeInclusive<i64> {
    let (lower, upper) = range.split_once("..").expect("a range");
    lower.parse().expect("a number")..=upper.parse().expect("a number")
}

fn written_out() -> String {
    let mut text = "model m\nparameter a = 0.7\n".to_owned();
    for (name, unit, value) in DECLARED {
        let kind = if name.starts_with("input") { " linear" } else { "" };
        let all = indices(name);
        let [lower, upper] = all.get(1).copied().unwrap_or([0, 0]);
        for i in all[0][0]..=all[0][1] {
            for j in lower..=upper {
                let end = if all.len() > 1 { format!("_{j}") } else { String::new() };
                let value = match value {
                    "" => String::new(),
                    value => format!(" = {}", at(value, i, j)),
                };
                let _ = writeln!(text, "{name}_{i}{end} {unit}{value}{kind}");
            }
        }
    }
    for (number, (outer, inner, equation)) in LOOPS.into_iter().enumerate() {
        for i in range(outer) {
            for j in if inner.is_empty() { 0..=0 } else { range(inner) } {
                // Units are in brackets, too.
                let equation = equation.replace("1 [s]", "second");
                let equation = at(&equation, i, j).replace("second", "1 [s]");
                let _ = writeln!(text, "equation e{number}_{i}_{j}: {equation}");
            }
        }
    }
    text
}

#[test]
fn rounds_are_the_model_written_out() {
    let rounds = rounds(&compiled(&in_loops()).0.program);
    assert!(rounds.contains(&(5, 1)) && rounds.contains(&(5, 3)), "{rounds:?}");
    assert_the_same(&interpreted(&in_loops()), &interpreted(&written_out()));
}

/// How many rounds and passages the loops of f have.
fn rounds(program: &Program) -> Vec<(u32, u32)> {
    let loops = &program.function(FunctionKind::Rhs).loops;
    loops.iter().map(|part| (part.rounds, part.count)).collect()
}

/// How many operations and stores the functions of a program are.
fn operations(program: &Program) -> usize {
    let length = |function: &ProgramFunction| {
        let of_loop = |part: &Loop| part.operations().count() + part.stores.len();
        let results: usize = function.results.iter().map(Vec::len).sum();
        function.body.len() + results + function.loops.iter().map(of_loop).sum::<usize>()
    };
    program.functions.iter().map(length).sum()
}

/// A plate and a chain of these lengths, without sums.
fn sized(n: usize, m: usize) -> Program {
    let text = format!(
        "model sized
         size N = {n}
         size M = {m}
         constant g[i in 1..M] = i
         constant w[i in 1..N][j in 1..M] = i + 2*j
         parameter a [1/s] = 0.1  in 0 ..
         input u[1..M]
         state x[1..M] = 1
         state T[i in 1..N][j in 1..M] = i + j
         unknown q[1..N][0..M] [1/s] = 0
         for i in 1..M {{ equation x[i]: der(x[i]) = u[i]*a*g[M+1-i] - a*x[i] }}
         for i in 1..N {{ equation left[i]: q[i][0] = i*a*(1 - T[i][1]) }}
         for i in 1..N, j in 1..M-1 {{ equation q[i][j]: q[i][j] = w[i][j]*a*(T[i][j] - T[i][j+1]) }}
         for i in 1..N {{ equation right[i]: q[i][M] = 0 }}
         for i in 1..N, j in 1..M {{
           equation T[i][j]: der(T[i][j]) = q[i][j-1] - q[i][j] + a*(x[j] - T[i][j])*g[j]
         }}
         output x
        "
    );
    let (compiled, sources) = compiled(&text);
    let rust = codegen::generate(&compiled.program, "sized", &sources).to_string();
    assert!(rust.contains("_k") && rust.contains("_r"), "loops stay loops");
    compiled.program
}

#[test]
fn functions_do_not_grow_with_any_index() {
    let own = operations(&sized(4, 10));
    for (n, m) in [(4, 3000), (40, 10), (300, 20)] {
        assert_eq!(operations(&sized(n, m)), own, "{n} x {m}");
    }
}

#[test]
fn rust_of_rows_with_events_grows_with_the_rows() {
    let written = |n: usize| {
        let text = format!(
            "model bins
             size N = {n}
             parameter k[1..N] [1/s] = 1
             parameter level = 0.55
             state x[1..N] = 0
             state y[1..N] = 0
             for i in 1..N {{
               equation x[i]: der(x[i]) = k[i]
               equation y[i]: der(y[i]) = (if x[i] > level then 1 else 0)/1 [s]
             }}
             output y
            "
        );
        let (compiled, sources) = compiled(&text);
        codegen::generate(&compiled.program, "bins", &sources).to_string().len()
    };
    let [few, some, many] = [10, 20, 40].map(written);
    // A row more has one more digit now and then.
    let each = (some - few) / 10;
    assert!(many - some < 21 * each, "{few}, {some}, {many}");
}
