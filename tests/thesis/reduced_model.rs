//! What the thesis says of its models: Fig 3.1, and the static formulation of §3.8.1.

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_execute::InterpretedSystem;

use dgd_runtime::{
    InputColumn, Inputs, Interpolation, Options, Problem, Solution, SolvableSystem, simulate,
    simulate_with_sensitivities,
};

use crate::support;

dgd::model!("models/pump_speed_step.dgd");
/// The riser; generated once, as each model brings a solver of its own to be compiled.
pub(crate) mod riser {
    dgd::model!("models/mud_circulation.dgd", as dynamic_flow);
    dgd::model!("models/mud_circulation.dgd", flow = static, as static_flow);
}

fn options(tolerance: f64) -> Options {
    Options { rtol: tolerance, atol: tolerance, ..Options::default() }
}

/// Inputs that are held, one list of samples for each.
fn held(system: &impl SolvableSystem, times: &[f64], values: &[&[f64]]) -> Inputs {
    let columns: Vec<InputColumn<'_>> = system
        .signature()
        .inputs
        .iter()
        .zip(values)
        .map(|(input, values)| InputColumn {
            name: &input.name,
            interpolation: Interpolation::Hold,
            values,
        })
        .collect();
    Inputs::recorded(times, &columns).expect("inputs")
}

#[test]
fn figure_3_1_has_the_numbers_of_the_equations() {
    use pump_speed_step::{Model, Parameters};
    let p: [f64; 5] = Parameters::default().into();
    let inputs = held(&Model, &[0.0, 50.0], &[&[10.0 / 1.1, 10.0], &[0.02, 0.02]]);
    let problem = Problem { system: &Model, p: &p, inputs: &inputs, start: &[] };
    let times: Vec<f64> = (0..=1000).map(f64::from).collect();
    let solution = simulate_with_sensitivities(&problem, &times, &options(1e-8)).expect("a run");

    let level = |k: usize| solution.y(k)[0];
    assert!((level(0) - 9.12).abs() < 0.005 && (level(50) - level(0)).abs() < 1e-6);
    assert!((level(1000) - 14.60).abs() < 0.005);
    // To the digits that are known of the figure: c0, c1, c2, F.
    let last: Vec<f64> = solution.s(1000).iter().step_by(2).copied().collect();
    for (found, expected) in last[1..].iter().zip([81.7, -0.171, -3.58e-4, -3.26e-8]) {
        assert!((found / expected - 1.0).abs() < 1e-3, "{found} against {expected}");
    }
    let to_m: Vec<f64> = (0..=1000).map(|k| solution.s(k)[0]).collect();
    let smallest = to_m.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = to_m.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    assert!((smallest / -3.28e-10 - 1.0).abs() < 2e-3, "{smallest:e}");
    assert!((largest / 4.58e-11 - 1.0).abs() < 2e-3, "{largest:e}");
}

#[test]
fn sensitivities_to_start_values_are_those_of_differences() {
    // The level's own start, its replacement, and the flow's where it is differential.
    for (variants, starts) in [(&[][..], &["h_r", "q_ssp"][..]), (&[("flow", "static")], &["h_r"])]
    {
        let names = [&["c0"], starts].concat().into_iter().map(support::name).collect();
        let path = std::path::Path::new("models/mud_circulation.dgd");
        let compiled = support::compiled_with(path, variants, &SensitivityDirections::Named(names));
        let system = InterpretedSystem::new(compiled.program);
        let p: [f64; 6] = riser::dynamic_flow::Parameters::default().into();
        let speeds: &[f64] = &[0.50, 0.52];
        let inputs = held(&system, &[0.0, 100.0], &[speeds, &[0.03, 0.03], &[0.005, 0.005]]);
        let times: Vec<f64> = (0..=50).map(|k| f64::from(k) * 10.0).collect();
        let run = |start: &[(usize, f64)]| {
            let problem = Problem { system: &system, p: &p, inputs: &inputs, start };
            simulate_with_sensitivities(&problem, &times, &options(1e-10)).expect("a run")
        };
        let own = run(&[]);
        let start: Vec<(usize, f64)> = own.y(0).iter().copied().enumerate().collect();
        let replaced = run(&start);
        for i in 0..starts.len() {
            let moved = |change: f64| {
                let mut start = start.clone();
                start[i].1 += change;
                run(&start)
            };
            let h = 1e-3 * start[i].1;
            let (low, high) = (moved(-h), moved(h));
            let column = 2 * (i + 1);
            assert_eq!(own.s(0)[column + i], 1.0, "a start value follows itself");
            for (k, t) in times.iter().enumerate() {
                for row in 0..2 {
                    let difference = (high.y(k)[row] - low.y(k)[row]) / (2.0 * h);
                    for s in [own.s(k)[column + row], replaced.s(k)[column + row]] {
                        // Curvature: h² relative. Rounding and tolerance: 1e-10 over 1e-3.
                        let size = if row == i { 1.0 } else { start[row].1 / start[i].1 };
                        let error = (s - difference).abs() / size;
                        assert!(error < 1e-5, "{} in row {row} at {t} s: {error:.1e}", starts[i]);
                    }
                }
            }
        }
    }
}

/// Level, flow and their sensitivities to c0, c2, F2 for a step in pump speed.
fn riser_run(system: &impl SolvableSystem, m: f64, times: &[f64]) -> Solution {
    let p: [f64; 6] = riser::dynamic_flow::Parameters { M_ssp: m, ..Default::default() }.into();
    let speeds: &[f64] = &[0.50, 0.52];
    let inputs = held(system, &[0.0, 100.0], &[speeds, &[0.03, 0.03], &[0.005, 0.005]]);
    let problem = Problem { system, p: &p, inputs: &inputs, start: &[] };
    simulate_with_sensitivities(&problem, times, &options(1e-9)).expect("a run")
}

#[test]
fn sensitivities_without_flow_dynamics_are_the_limit_of_those_with() {
    // Away from the boundary layers behind the start and the step, where q has settled to order M.
    let times = [0.0, 50.0, 99.0, 150.0, 400.0, 1000.0];
    let limit = riser_run(&riser::static_flow::Model, 1.1e8, &times);
    let distance = |m: f64| {
        let with = riser_run(&riser::dynamic_flow::Model, m, &times);
        let mut worst: f64 = 0.0;
        // c0, c2 and F2.
        for direction in [1, 3, 5] {
            for i in 0..2 {
                let at = |s: &Solution, k: usize| s.s(k)[direction * 2 + i];
                let largest = (1..6).fold(0.0f64, |l, k| l.max(at(&limit, k).abs()));
                for k in 1..6 {
                    worst = worst.max((at(&with, k) - at(&limit, k)).abs() / largest);
                }
            }
        }
        worst
    };
    let (far, near) = (distance(1e6), distance(1e5));
    // The distance is of order M.
    assert!(far < 1e-3, "{far:e}");
    assert!((far / near - 10.0).abs() < 0.5, "{far:e} at M = 1e6, {near:e} at M = 1e5");
}

#[test]
fn both_formulations_come_to_the_same_steady_state() {
    let times = [0.0, 20_000.0];
    let with = riser_run(&riser::dynamic_flow::Model, 1.1e8, &times);
    let without = riser_run(&riser::static_flow::Model, 1.1e8, &times);
    for i in 0..2 {
        let (a, b) = (with.y(1)[i], without.y(1)[i]);
        assert!((a - b).abs() < 1e-7 * a.abs(), "{a} against {b}");
    }
}

#[test]
fn with_the_pump_stopped_the_level_comes_to_rest_between_inlet_and_outlet() {
    let system = &riser::static_flow::Model;
    let p: [f64; 6] = riser::static_flow::Parameters::default().into();
    let stopped: &[f64] = &[0.52, 0.0];
    let inputs = held(system, &[0.0, 100.0], &[stopped, &[0.03, 0.0], &[0.005, 0.0]]);
    let problem = Problem { system, p: &p, inputs: &inputs, start: &[] };
    let times: Vec<f64> = (0..=300).map(|k| f64::from(k) * 10.0).collect();
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let solution = simulate(&problem, &times, &options(tolerance)).expect("a run");
        // h_in − h_out = 5 m, to the tolerance of a level of 50 m.
        let (level, flow) = (solution.y(300)[0], solution.y(300)[1]);
        assert!((level - 5.0).abs() < 100.0 * tolerance, "{level} at {tolerance:e}");
        assert!(flow.abs() < tolerance.sqrt(), "{flow} at {tolerance:e}");

        let solution = simulate_with_sensitivities(&problem, &times, &options(tolerance));
        let solution = solution.expect("a run");
        let [undefined] = &solution.undefined[..] else { panic!("{:?}", solution.undefined) };
        assert_eq!(undefined.equation, "return_line");
        assert!((500.0..540.0).contains(&undefined.from), "{undefined}");
        for (k, t) in times.iter().enumerate() {
            let defined = solution.s(k).iter().all(|s| s.is_finite());
            assert_eq!(defined, *t < undefined.from, "at {t} s");
        }
    }
}

/// Level and flow after a step in pump speed at 50 m, by a form of the inertia.
fn stepped(inertia: &str, m: f64, times: &[f64]) -> Solution {
    let path = std::path::Path::new("models/mud_circulation.dgd");
    let named = SensitivityDirections::Named(vec![support::name("M_ssp")]);
    let compiled = support::compiled_with(path, &[("inertia", inertia)], &named);
    let system = InterpretedSystem::new(compiled.program);
    riser_run(&system, m, times)
}

#[test]
fn inertia_by_level_is_the_constant_one_with_the_mud_of_the_riser_on_top() {
    // rho/A_r (h_in − h_r) at 50 m, by hand: 1.46·10⁶ kg/m⁴, 1.3 % of 1.1·10⁸.
    let area = std::f64::consts::FRAC_PI_4 * (19.75_f64 * 0.0254).powi(2);
    let of_riser = 1120.0 / area * (307.0 - 50.0);
    assert!((of_riser / 1.456e6 - 1.0).abs() < 1e-3, "{of_riser:e}");
    // The step is at 100 s. Within five seconds the level moves by less than a millimetre a second: M
    // changes by 2e-7 of itself for each.
    let times = [0.0, 99.0, 100.0, 101.0, 103.0, 105.0];
    let change = |solution: &Solution, k: usize| solution.y(k)[1] - solution.y(2)[1];
    // Levels are to be equal before the step: start at rest by the static model.
    let by_level = stepped("by_level", 1.1e8, &times);
    let level = by_level.y(2)[0];
    let there = 1120.0 / area * (307.0 - level);
    let same = stepped("constant", 1.1e8 + there, &times);
    let lighter = stepped("constant", 1.1e8, &times);
    for k in 3..6 {
        let found = change(&by_level, k);
        let (exact, without) = (change(&same, k), change(&lighter, k));
        assert!((found / exact - 1.0).abs() < 1e-4, "{found:e}, not {exact:e}");
        // The sign and the size of what the riser's mud does: the flow follows later.
        let slower = 1.0 - found / without;
        assert!((0.3..1.05).contains(&(slower / (there / (1.1e8 + there)))), "{slower:e}");
    }
}

#[test]
fn inertia_by_level_leaves_steady_states_alone_and_has_right_sensitivities() {
    let times = [0.0, 20_000.0];
    let (a, b) = (stepped("constant", 1.1e8, &times), stepped("by_level", 1.1e8, &times));
    for i in 0..2 {
        assert!((a.y(1)[i] / b.y(1)[i] - 1.0).abs() < 1e-7, "{} and {}", a.y(1)[i], b.y(1)[i]);
    }
    // To M_ssp, against differences, while the flow goes on changing.
    let times: Vec<f64> = (0..=30).map(|k| f64::from(k) * 10.0).collect();
    let [low, middle, high] = [0.999, 1.0, 1.001].map(|f| stepped("by_level", f * 1.1e8, &times));
    let rows = || 0..times.len();
    for i in 0..2 {
        let largest = rows().map(|k| middle.s(k)[i].abs()).fold(0.0, f64::max);
        for (k, t) in times.iter().enumerate() {
            let difference = (high.y(k)[i] - low.y(k)[i]) / (0.002 * 1.1e8);
            let error = (middle.s(k)[i] - difference).abs() / largest;
            assert!(error < 1e-3, "{i} at {t} s: {error:e}");
        }
    }
}
