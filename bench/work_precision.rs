//! P1 and P2: the two-state model as ODE and as index-1 DAE, without and with five sensitivities.
//!
//! 1001 outputs over 1000 s with a jump of the input at 100 s. The error is the largest difference from a reference
//! solution, relative to a column's largest value: for the states without sensitivities, and for the sensitivities
//! otherwise. `generated` is Rust by `dgd::model!`, `native` the same program as native code made at run time,
//! `interpreted` the interpreter.
//!
//! Before that, the time to compile some models to native code: all functions, and f alone.

#![allow(clippy::print_stdout, reason = "a benchmark prints its table")]

use std::path::Path;
use std::time::Duration;

use dgd_bench::measure;
use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::program::Program;
use dgd_compiler::source::{SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::Name;
use dgd_data::{DataTable, read};
use dgd_execute::{Engine, InterpretedSystem, LoadedSystem};
use dgd_runtime::{
    EvaluationPoint, InputColumn, Inputs, Interpolation, Options, Problem, Solution,
    SolvableSystem, System, simulate, simulate_with_sensitivities,
};

mod models {
    dgd::model!("../models/bench_two_state.dgd", as ode);
    dgd::model!("../models/bench_two_state.dgd", flow = static, as dae);
}

/// Models that are compiled, from small to large.
const COMPILED: [&str; 4] =
    ["bench_two_state", "mud_circulation", "remote_level", "test_set/pollution"];

fn main() {
    println!("model                 operations    all ms      f ms");
    for model in COMPILED {
        compilation(model);
    }
    println!();
    println!("problem  back end     tolerance  least µs  median µs     error  steps  rejected");
    for flow in ["dynamic", "static"] {
        let reference = reference(flow);
        let program = program("bench_two_state", &[("flow", flow)]);
        let interpreted = InterpretedSystem::new(program.clone());
        let native = LoadedSystem::with_engine(program, Engine::Native);
        for with in [false, true] {
            let problem = match (flow, with) {
                ("dynamic", false) => "P1a",
                ("dynamic", true) => "P1b",
                (_, false) => "P2a",
                (_, true) => "P2b",
            };
            for tolerance in [1e-4, 1e-6, 1e-8] {
                let reference = &reference;
                if flow == "dynamic" {
                    row(problem, "generated", &models::ode::Model, reference, with, tolerance);
                } else {
                    row(problem, "generated", &models::dae::Model, reference, with, tolerance);
                }
                row(problem, "native", &native, reference, with, tolerance);
                row(problem, "interpreted", &interpreted, reference, with, tolerance);
            }
        }
    }
}

/// Measures the time to compile a model to native code, and prints it.
fn compilation(model: &str) {
    let program = program(model, &[]);
    let operations = |function: &dgd_compiler::program::ProgramFunction| {
        function.body.len() + function.loops.iter().map(|part| part.body.len()).sum::<usize>()
    };
    let system = || LoadedSystem::with_engine(program.clone(), Engine::Native);
    let all_functions = measure(Duration::from_millis(300), || {
        let system = system();
        system.compile().expect("native code");
        system
    });
    let p: Vec<f64> =
        program.signature.parameters.iter().map(|parameter| parameter.value).collect();
    let (y, u) = (vec![1.0; program.n()], vec![1.0; program.signature.n_u()]);
    let z = vec![0.0; program.signature.discrete.len()];
    let first = measure(Duration::from_millis(300), || {
        let (system, mut f) = (system(), vec![0.0; y.len()]);
        system.rhs(EvaluationPoint { t: 0.0, y: &y, u: &u, p: &p, z: &z }, &mut f);
        system
    });
    println!(
        "{model:<21} {:>10} {:>9.2} {:>9.2}",
        program.functions.iter().map(operations).sum::<usize>(),
        all_functions.least.as_secs_f64() * 1e3,
        first.least.as_secs_f64() * 1e3,
    );
}

/// Measures one case and prints its row.
fn row(
    problem: &str,
    back_end: &str,
    system: &impl SolvableSystem,
    reference: &DataTable,
    with: bool,
    tolerance: f64,
) {
    let p: Vec<f64> = system.signature().parameters.iter().map(|x| x.value).collect();
    let column =
        InputColumn { name: "w", interpolation: Interpolation::Hold, values: &[0.8, 0.88] };
    let inputs = Inputs::recorded(&[0.0, 100.0], &[column]).expect("inputs");
    let times: Vec<f64> = (0..=1000).map(f64::from).collect();
    // As for the peers: atol is a hundredth of rtol, relative to the sizes of the unknowns.
    let options = Options { rtol: tolerance, atol: 0.01 * tolerance, ..Options::default() };
    let case = Problem { system, p: &p, inputs: &inputs, start: &[] };
    let run = || {
        let run = if with { simulate_with_sensitivities } else { simulate };
        run(&case, &times, &options).expect("a solution")
    };
    let solution = run();
    let taken = measure(Duration::from_millis(300), run);
    println!(
        "{problem:<8} {back_end:<12} {tolerance:>9.0e} {:>9.1} {:>10.1} {:>9.1e} {:>6} {:>9}",
        taken.least.as_secs_f64() * 1e6,
        taken.median.as_secs_f64() * 1e6,
        error(system, &solution, reference, with),
        solution.statistics.steps,
        solution.statistics.rejected,
    );
}

/// The largest difference from the reference, relative to a column's largest value.
fn error(
    system: &impl SolvableSystem,
    solution: &Solution,
    reference: &DataTable,
    with: bool,
) -> f64 {
    let signature = system.signature();
    let times = reference.time.as_deref().unwrap_or_default();
    let mut worst: f64 = 0.0;
    for column in &reference.columns {
        let is_state = !column.name.starts_with("d(");
        if is_state == with {
            continue;
        }
        let largest = column.values.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
        for (t, expected) in times.iter().zip(&column.values) {
            let k = *t as usize;
            let value = signature.unknowns.iter().enumerate().find_map(|(i, unknown)| {
                if column.name == unknown.name {
                    return Some(solution.y(k)[i]);
                }
                (0..signature.directions.len()).find_map(|j| {
                    let parameter = signature.direction_name(j);
                    (column.name == format!("d({})/d({parameter})", unknown.name))
                        .then(|| solution.s(k)[j * solution.n + i])
                })
            });
            let value = value.expect("a column of the model");
            worst = worst.max((value - expected).abs() / largest);
        }
    }
    worst
}

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn reference(flow: &str) -> DataTable {
    let path = root().join(format!("tests/reference/bench_two_state_{flow}.csv"));
    read(&path, &mut SourceMap::default(), &mut Diagnostics::default()).expect("a reference")
}

fn program(model: &str, variants: &[(&str, &str)]) -> Program {
    let path = root().join(format!("models/{model}.dgd"));
    let text = std::fs::read_to_string(&path).expect("the model");
    let name = |text: &str| Name { text: text.to_owned(), span: Span::default() };
    let variants = variants.iter().map(|(variant, choice)| (name(variant), name(choice)));
    let options = ModelOptions { variants: variants.collect(), ..ModelOptions::default() };
    let compiled = compile(
        SourceText { name: path.display().to_string(), text },
        &options,
        &SensitivityDirections::All,
        &mut |path| std::fs::read_to_string(path).map_err(|error| error.to_string()),
        &mut SourceMap::default(),
        &mut Diagnostics::default(),
    );
    compiled.expect("a sound model").program
}
