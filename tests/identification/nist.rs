//! NIST's nonlinear regressions, each a model file and a table of independent rows in `tests/nist`, from
//! both of their starts.
//!
//! Source of `certified.csv`: NIST/ITL Statistical Reference Datasets, nonlinear regression (1998).

use std::fs;

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_execute::LoadedSystem;
use dgd_identify::Recording;
use dgd_identify::regression::{RegressionMethod, RegressionProblem, regress};
use dgd_runtime::System;

use crate::recorded::recorded;
use crate::support;

/// A certified parameter.
struct Certified {
    name: String,
    starts: [String; 2],
    value: f64,
    std: f64,
}

/// Problem by problem, the parameters and the residual sum of squares.
fn certified() -> Vec<(String, Vec<Certified>, f64)> {
    let path = support::root().join("tests/nist/certified.csv");
    let text = fs::read_to_string(path).expect("the certified values");
    let mut problems: Vec<(String, Vec<Certified>, f64)> = Vec::new();
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |k: usize| cells[k].parse::<f64>().expect("a number");
        let parameter = Certified {
            name: cells[1].to_owned(),
            starts: [cells[2].to_owned(), cells[3].to_owned()],
            value: number(4),
            std: number(5),
        };
        match problems.last_mut().filter(|(problem, ..)| problem == cells[0]) {
            Some((_, parameters, _)) => parameters.push(parameter),
            None => problems.push((cells[0].to_owned(), vec![parameter], number(6))),
        }
    }
    problems
}

/// The model with the parameters of one start, and its table.
fn load(problem: &str, settings: &[&str]) -> (LoadedSystem, Recording) {
    let path = support::root().join(format!("tests/nist/{problem}.dgd"));
    let text = fs::read_to_string(&path).expect("the model");
    let directions = SensitivityDirections::Estimated { free: Vec::new(), fixed: Vec::new() };
    let compiled = support::compiled_text(&path, text, (&[], settings), &directions);
    assert!(compiled.dae.is_static());
    let recording = recorded(&compiled, &path.with_extension("csv"));
    (LoadedSystem::new(compiled.program), recording)
}

/// Digits that agree: −log₁₀ of the relative error, 11 at most, which is what is certified.
fn digits(found: f64, certified: f64) -> f64 {
    (-((found - certified) / certified).abs().log10()).min(11.0)
}

/// Which parameter is which: the two terms of MGH17, b2 exp(−b4 x) and b3 exp(−b5 x), have no order, and the
/// certified values have the slower first.
fn order(problem: &str, p: &[f64]) -> Vec<usize> {
    if problem == "mgh17" && p[3] > p[4] { vec![0, 2, 1, 4, 3] } else { (0..p.len()).collect() }
}

/// Digits that are asked for, of parameters and of their standard deviations.
const DIGITS: f64 = 6.0;

/// Its data has 14 digits and follows a model exactly: residuals, and so standard deviations, are rounding.
const EXACT: &str = "lanczos1";

#[test]
fn all_problems_are_solved_from_both_starts_by_variable_projection() {
    let mut failures = Vec::new();
    let problems = certified();
    assert_eq!(problems.len(), 27);
    for (problem, parameters, rss) in &problems {
        for start in 0..2 {
            let settings: Vec<String> =
                parameters.iter().map(|p| format!("{}={}", p.name, p.starts[start])).collect();
            let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
            let (system, recording) = load(problem, &settings);
            let p: Vec<f64> = system.signature().parameters.iter().map(|p| p.value).collect();
            let recordings = [recording];
            let asked = RegressionProblem::new(&system, &p, &recordings);
            let fit = match regress(&asked, RegressionMethod::VariableProjection) {
                Ok(fit) => fit,
                Err(error) => {
                    failures.push(format!("{problem} {}: {error}", start + 1));
                    continue;
                }
            };
            let order = order(problem, &fit.p);
            let by_value = parameters.iter().zip(&order).map(|(c, j)| digits(fit.p[*j], c.value));
            let least = by_value.fold(f64::INFINITY, f64::min);
            let std = parameters.iter().zip(&order).map(|(c, j)| (&fit.estimates[*j], c));
            let of_std = std
                .map(|(e, c)| e.std.map_or(0.0, |std| digits(std, c.std)))
                .fold(f64::INFINITY, f64::min);
            let mse = fit.rows[0].mean_squared_error * fit.samples as f64;
            println!(
                "{problem} {}: {least:.1} digits, std {of_std:.1}, rss {:.1}, {} linear, {} evaluations",
                start + 1,
                digits(mse, *rss),
                fit.linear.iter().filter(|l| **l).count(),
                fit.evaluations
            );
            if least < DIGITS || (of_std < DIGITS && problem != EXACT) {
                failures.push(format!("{problem} {}: {least:.1}, {of_std:.1} digits", start + 1));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
