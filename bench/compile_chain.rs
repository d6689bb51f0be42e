//! Compiles a chain of coupled equations, from text to a program with its Jacobian.
//!
//! Target: 10 000 equations in under 2 s and 500 MB, with a cost that grows linearly. Run with a number to compile a
//! chain of that length only.

#![allow(clippy::print_stdout, reason = "a benchmark prints its table")]

use std::fmt::Write;
use std::time::Duration;

use dgd_bench::{measure, peak_memory};
use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};

fn main() {
    let length = std::env::args().skip(1).find_map(|argument| argument.parse().ok());
    let lengths = length.map_or_else(|| vec![1000, 3000, 10_000, 30_000], |length| vec![length]);
    println!("equations  text kB  least ms  median ms  µs/equation  peak MB");
    for length in lengths {
        let text = chain(length);
        let taken = measure(Duration::from_secs(1), || program(&text));
        println!(
            "{length:>9} {:>8} {:>9.0} {:>10.0} {:>12.1} {:>8.0}",
            text.len() / 1024,
            taken.least.as_secs_f64() * 1e3,
            taken.median.as_secs_f64() * 1e3,
            taken.least.as_secs_f64() * 1e6 / length as f64,
            peak_memory().unwrap_or(f64::NAN),
        );
    }
}

/// Heat along a rod with radiation: each cell exchanges heat with its neighbours and radiates to its surroundings.
fn chain(length: usize) -> String {
    let mut text = String::from(
        "model chain\nparameter k [1/s] = 2\nparameter loss [1/s] = 0.1\nstate x0 [1] = 1\n",
    );
    for i in 1..length {
        let _ = writeln!(text, "state x{i} [1] = 0.5");
    }
    text.push_str("equation e0: der(x0) = k*(x1 - x0) - loss*x0^4\n");
    for i in 1..length - 1 {
        let (before, after) = (i - 1, i + 1);
        let _ = writeln!(
            text,
            "equation e{i}: der(x{i}) = k*(x{before} - 2*x{i} + x{after}) - loss*x{i}^4"
        );
    }
    let (last, before) = (length - 1, length - 2);
    let _ =
        writeln!(text, "equation e{last}: der(x{last}) = k*(x{before} - x{last}) - loss*x{last}^4");
    text
}

fn program(text: &str) -> usize {
    let main = SourceText { name: "chain.dgd".to_owned(), text: text.to_owned() };
    let compiled = compile(
        main,
        &ModelOptions::default(),
        &SensitivityDirections::None,
        &mut |path| Err(format!("`{path}` is not imported")),
        &mut SourceMap::default(),
        &mut Diagnostics::default(),
    );
    compiled.expect("a sound model").program.functions.len()
}
