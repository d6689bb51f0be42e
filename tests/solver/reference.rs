//! States and sensitivities against independent solutions of 1e-10 and better, for generated Rust
//! and the interpreter; both give the same bits.
//!
//! How the references were made stands in their headers and in `tests/reference/README.md`.

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::SourceMap;
use dgd_compiler::units::parse_unit;
use dgd_data::{DataTable, read, select};
use dgd_runtime::{
    Inputs, Options, Problem, Solution, SolvableSystem, simulate_with_sensitivities,
};

use crate::generated;
use crate::support::{interpreted, native, root};

fn table(path: &str) -> DataTable {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    read(&root().join(path), &mut sources, &mut diagnostics).expect("a table")
}

/// The inputs of a model from a data file.
fn inputs(system: &impl SolvableSystem, path: &str) -> Inputs {
    let table = table(path);
    let mut diagnostics = Diagnostics::default();
    let signature = system.signature();
    let units: Vec<_> =
        signature.inputs.iter().map(|x| parse_unit(&x.unit.symbol).expect("a unit")).collect();
    let declared: Vec<_> = signature
        .inputs
        .iter()
        .zip(&units)
        .map(|(x, unit)| select::DeclaredColumn { name: &x.name, unit, place: None })
        .collect();
    let values = select::inputs(&table, &declared, &mut diagnostics).expect("the model's inputs");
    let columns: Vec<_> = signature
        .inputs
        .iter()
        .zip(&values)
        .map(|(x, values)| dgd_runtime::InputColumn {
            name: &x.name,
            interpolation: x.interpolation,
            values,
        })
        .collect();
    Inputs::recorded(table.time.as_deref().expect("a recording"), &columns).expect("inputs")
}

/// What a test compares with what.
struct Case {
    model: &'static str,
    variants: &'static [(&'static str, &'static str)],
    inputs: Option<&'static str>,
    reference: &'static str,
    options: Options,
    /// Allowed difference, of a column's largest value.
    allowed: f64,
}

fn run(system: &impl SolvableSystem, case: &Case, times: &[f64]) -> Solution {
    let signature = system.signature();
    let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
    let inputs = case.inputs.map_or_else(Inputs::none, |path| inputs(system, path));
    let problem = Problem { system, p: &p, inputs: &inputs, start: &[] };
    simulate_with_sensitivities(&problem, times, &case.options).expect("a solution")
}

/// Runs a case on generated Rust, on the interpreter and as native code, and compares with the
/// reference.
fn check(generated: &impl SolvableSystem, case: &Case) {
    let reference = table(case.reference);
    let times = reference.time.as_deref().expect("a recording");
    let solution = run(generated, case, times);
    let interpreted = interpreted(case.model, case.variants);
    let native = native(case.model, case.variants);
    assert_eq!(solution, run(&interpreted, case, times), "{}: not the same bits", case.reference);
    assert_eq!(solution, run(&native, case, times), "{}: not the bits", case.reference);
    assert!(solution.undefined.is_empty());

    let signature = generated.signature();
    let mut compared = 0;
    for column in &reference.columns {
        let value = |k: usize| {
            for (i, unknown) in signature.unknowns.iter().enumerate() {
                if column.name == unknown.name {
                    return solution.y(k)[i];
                }
                for j in 0..signature.directions.len() {
                    let parameter = signature.direction_name(j);
                    if column.name == format!("d({})/d({parameter})", unknown.name) {
                        return solution.s(k)[j * solution.n + i];
                    }
                }
            }
            panic!("{}: no column `{}` in the model", case.reference, column.name)
        };
        let largest = column.values.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
        for (k, expected) in column.values.iter().enumerate() {
            let error = (value(k) - expected).abs() / largest;
            assert!(
                error <= case.allowed,
                "{}: {} at {} s is {:e}, reference {expected:e}, off by {error:.1e} of the largest",
                case.reference,
                column.name,
                times[k],
                value(k)
            );
        }
        compared += 1;
    }
    // What a reference leaves out has no part in the model's variant.
    assert!(compared > signature.unknowns.len(), "{}: sensitivities are compared", case.reference);
}

/// The same without generated Rust, each model of which brings a solver of its own to be compiled.
fn check_loaded(case: &Case) {
    check(&native(case.model, case.variants), case);
}

fn tolerance(tolerance: f64) -> Options {
    Options { rtol: tolerance, atol: tolerance, ..Options::default() }
}

const STATIC: &[(&str, &str)] = &[("flow", "static")];

/// The bar of the command line: `--rtol 1e-8` gives 1e-6.
fn two_state(
    model: &'static str,
    variants: &'static [(&'static str, &'static str)],
    inputs: &'static str,
    reference: &'static str,
) -> Case {
    let options = tolerance(1e-8);
    Case { model, variants, inputs: Some(inputs), reference, options, allowed: 1e-6 }
}

#[test]
fn held_and_linear_inputs_with_a_jump() {
    use generated::mud_circulation::{dynamic_flow, static_flow};
    let model = "models/mud_circulation.dgd";
    let inputs = "tests/reference/mud_circulation_inputs.csv";
    let reference = "tests/reference/mud_circulation_dynamic.csv";
    check(&dynamic_flow::Model, &two_state(model, &[], inputs, reference));
    let reference = "tests/reference/mud_circulation_static.csv";
    check(&static_flow::Model, &two_state(model, STATIC, inputs, reference));
}

#[test]
fn the_thesis_speed_step() {
    let model = "models/pump_speed_step.dgd";
    let inputs = "examples/data/pump_speed_step.csv";
    let reference = "tests/reference/pump_speed_step_dynamic.csv";
    check_loaded(&two_state(model, &[], inputs, reference));
    let reference = "tests/reference/pump_speed_step_static.csv";
    check_loaded(&two_state(model, STATIC, inputs, reference));
}

#[test]
fn the_two_state_benchmark() {
    use generated::bench_two_state::{dynamic_flow, static_flow};
    let model = "models/bench_two_state.dgd";
    let inputs = "tests/reference/bench_two_state_inputs.csv";
    let reference = "tests/reference/bench_two_state_dynamic.csv";
    check(&dynamic_flow::Model, &two_state(model, &[], inputs, reference));
    let reference = "tests/reference/bench_two_state_static.csv";
    check(&static_flow::Model, &two_state(model, STATIC, inputs, reference));
}

#[test]
fn a_reactor_that_runs_away() {
    let case = Case {
        model: "models/cstr.dgd",
        variants: &[],
        inputs: Some("tests/reference/cstr_inputs.csv"),
        reference: "tests/reference/cstr.csv",
        options: tolerance(1e-9),
        allowed: 1e-6,
    };
    check_loaded(&case);
}

#[test]
fn an_index_one_circuit_with_a_linear_input() {
    let case = Case {
        model: "models/rc_circuit.dgd",
        variants: &[],
        inputs: Some("tests/reference/rc_circuit_inputs.csv"),
        reference: "tests/reference/rc_circuit.csv",
        options: tolerance(1e-9),
        allowed: 1e-6,
    };
    check_loaded(&case);
}

#[test]
fn stiff_kinetics_as_ode_and_as_dae() {
    let case = |variants| Case {
        model: "models/robertson.dgd",
        variants,
        inputs: None,
        reference: "tests/reference/robertson.csv",
        options: tolerance(1e-10),
        allowed: 1e-6,
    };
    check(&generated::robertson_ode::Model, &case(&[]));
    check(&generated::robertson_dae::Model, &case(&[("form", "dae")]));
}

#[test]
fn relaxation_oscillations() {
    let case = Case {
        model: "models/van_der_pol.dgd",
        variants: &[],
        inputs: None,
        reference: "tests/reference/van_der_pol.csv",
        // Each jump multiplies what came before by about ten.
        options: tolerance(1e-11),
        allowed: 1e-6,
    };
    check_loaded(&case);
}
