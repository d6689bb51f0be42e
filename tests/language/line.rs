//! The hydraulic line of the benchmarks, whose size is chosen when it is compiled.

use std::path::Path;

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_execute::InterpretedSystem;
use dgd_runtime::linalg::{AutoLu, Factorisation};
use dgd_runtime::{Inputs, Options, Problem, Solution, System, simulate_chosen};

use crate::support::{compiled_text, root};

const FILE: &str = "bench/peers/dgd/line.dgd";
const RTOL: f64 = 1e-5;

/// The line with `cells` cells and some items more.
fn line(cells: usize, more: &str) -> InterpretedSystem {
    let text = std::fs::read_to_string(root().join(FILE)).expect("the model's file");
    let settings = format!("N = {cells}");
    let choices = (&[][..], &[settings.as_str()][..]);
    let compiled =
        compiled_text(Path::new(FILE), text + more, choices, &SensitivityDirections::None);
    InterpretedSystem::new(compiled.program)
}

/// Chosen unknowns at whole seconds, with the tolerances of the benchmark.
fn run(system: &InterpretedSystem, chosen: &[usize]) -> Solution {
    let inputs = Inputs::none();
    let times: Vec<f64> = (0..=20).map(f64::from).collect();
    let options = Options { rtol: RTOL, atol: RTOL, ..Options::default() };
    let problem = Problem { system, p: &[], inputs: &inputs, start: &[] };
    simulate_chosen(&problem, chosen, &times, &options).expect("a solution")
}

#[test]
fn the_pressure_at_the_inlet_is_that_of_the_reference() {
    for cells in [100, 1000] {
        let path = format!("bench/peers/data/p3-{cells}.bin");
        let bytes = std::fs::read(root().join(Path::new(&path))).expect("the reference");
        let (numbers, _) = bytes.as_chunks::<8>();
        let reference: Vec<f64> = numbers.iter().map(|x| f64::from_le_bytes(*x)).collect();
        let solution = run(&line(cells, ""), &[0]);
        assert_eq!(solution.y.len(), reference.len());
        for (p, expected) in solution.y.iter().zip(&reference) {
            // What a step may err by in the mean of all unknowns: rtol of the pressure and of its
            // nominal value, 1e6 Pa. The inlet, where the wave begins, has more than the mean of it.
            let weight = RTOL * (expected.abs() + 1e6);
            assert!(
                (p - expected).abs() <= 3.0 * weight,
                "{cells} cells: {p} instead of {expected}"
            );
        }
    }
}

#[test]
fn the_work_does_not_depend_on_the_number_of_cells() {
    let steps = |cells| run(&line(cells, ""), &[]).statistics.steps;
    let (few, many) = (steps(500), steps(4000));
    assert!(few.abs_diff(many) <= 2, "{few} and {many} steps");
}

#[test]
fn what_is_kept_of_the_model_does_not_grow_with_it() {
    let (few, many) = (line(100, ""), line(100_000, ""));
    let (few, many) = (few.signature(), many.signature());
    assert_eq!(many.unknowns.len(), 200_000);
    // 5N − 2 non-zeros.
    assert_eq!(many.jacobian.len() + 2, 1000 * (few.jacobian.len() + 2));
    for signature in [few, many] {
        assert!(signature.jacobian.runs.len() < 10, "{:?}", signature.jacobian);
        assert!(signature.jacobian.rows.len() < 10, "{:?}", signature.jacobian);
        let lu = AutoLu::new(signature.unknowns.len(), &signature.jacobian);
        assert!(matches!(lu, AutoLu::Tridiagonal(_)), "pressures and flows are interleaved");
    }
    assert_eq!((&*many.unknowns.name(0), &*many.unknowns.name(199_999)), ("p[1]", "q[100001]"));
}

/// The line has gained the inflow less the outflow: a linear invariant, which Rosenbrock
/// methods keep, as far as their equations are solved.
#[test]
fn no_volume_is_lost() {
    let cells = 300;
    let more =
        "\nstate gained [m^3] = 0  nominal 0.01\nequation gain: der(gained) = q_in - q[N+1]\n";
    let system = line(cells, more);
    let unknowns = &system.signature().unknowns;
    let position = |name: &str| unknowns.iter().position(|x| x.name == name).expect("an unknown");
    let chosen: Vec<usize> =
        (position("p[1]")..position("p[1]") + cells).chain([position("gained")]).collect();
    let solution = run(&system, &chosen);
    // A Δx/β of each cell's pressure.
    let capacity = 0.0185 * 3000.0 / cells as f64 / 1.5e9;
    let volume = |k: usize| capacity * solution.y(k)[..cells].iter().sum::<f64>();
    let last = solution.len() - 1;
    let gained = solution.y(last)[cells];
    // Terms add up to 1 m³; each of some 60 steps has eight stages, and eliminations of a
    // well-conditioned band lose a digit or two more than one rounding.
    let rounding = 60.0 * 8.0 * 100.0 * f64::EPSILON;
    assert!(gained > 0.01, "{gained}");
    assert!((volume(last) - volume(0) - gained).abs() <= rounding, "{gained}");
}
