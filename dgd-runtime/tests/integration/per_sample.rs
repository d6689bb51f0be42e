//! Compares equal steps per sample with closed forms and with adaptive steps.

use std::num::NonZeroU32;

use dgd_runtime::{
    InputColumn, Inputs, IntegrateError, Interpolation, Options, PerSample, PerSampleError,
    Problem, Solution, SolvableSystem, Steps, find_method, simulate, simulate_with_sensitivities,
};

use crate::support::problems::{Algebraic, AlgebraicStacked, Relaxation, RelaxationStacked};
use crate::support::{Heaped, parameters};

const SAMPLES: usize = 40;

fn exactly(n: u32) -> Steps {
    Steps::PerSample(PerSample::Exactly(NonZeroU32::new(n).unwrap()))
}

fn options(method: &str, steps: Steps, tolerance: f64) -> Options {
    let method = find_method(method).unwrap();
    Options { method, steps, rtol: tolerance, atol: tolerance, ..Options::default() }
}

/// One sample a second, and an input that changes at each.
fn recorded(interpolation: Interpolation) -> (Vec<f64>, Vec<f64>, Inputs) {
    let times: Vec<f64> = (0..SAMPLES).map(|k| k as f64).collect();
    let values: Vec<f64> = times.iter().map(|t| (1.7 * t).sin()).collect();
    let column = InputColumn { name: "u", interpolation, values: &values };
    let inputs = Inputs::recorded(&times, &[column]).unwrap();
    (times, values, inputs)
}

/// Values at the samples with a held input, and their derivatives with respect to k and x₀: x ← u/k + (x − u/k) e^(−k).
fn relaxed(u: &[f64], p: &[f64]) -> Vec<[f64; 3]> {
    let (k, e) = (p[0], (-p[0]).exp());
    let (mut x, mut dk, mut d0) = (p[1], 0.0, 1.0);
    let mut rows = vec![[x, dk, d0]];
    for u in &u[..u.len() - 1] {
        let rest = u / k;
        dk = -rest / k * (1.0 - e) - (x - rest) * e + dk * e;
        d0 *= e;
        x = rest + (x - rest) * e;
        rows.push([x, dk, d0]);
    }
    rows
}

fn worst(solution: &Solution, exact: &[[f64; 3]]) -> [f64; 2] {
    let mut worst = [0.0_f64; 2];
    for (k, [x, dk, d0]) in exact.iter().enumerate() {
        worst[0] = worst[0].max((solution.y(k)[0] - x).abs());
        let [sk, s0] = solution.s(k) else { panic!("two directions") };
        worst[1] = worst[1].max((sk - dk).abs()).max((s0 - d0).abs());
    }
    worst
}

#[test]
fn errors_fall_with_the_fifth_power_of_steps() {
    let system = RelaxationStacked::of::<Relaxation>();
    let p = parameters::<Relaxation>();
    let (times, u, inputs) = recorded(Interpolation::Hold);
    let exact = relaxed(&u, &p);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    for method in ["tsit5", "rodas5p"] {
        let errors = [1, 2, 4].map(|n| {
            let options = options(method, exactly(n), 1e-6);
            let solution = simulate_with_sensitivities(&problem, &times, &options).unwrap();
            assert_eq!(solution.statistics.per_sample, n);
            assert_eq!(solution.statistics.steps, n as usize * (SAMPLES - 1));
            worst(&solution, &exact)
        });
        for pair in errors.windows(2) {
            for (coarse, fine) in pair[0].iter().zip(pair[1]) {
                // 2⁵ = 32 as h → 0. The next order adds a few times h k = 0.7, relatively.
                let ratio = coarse / fine;
                assert!((20.0..80.0).contains(&ratio), "{method}: {ratio}, {errors:?}");
            }
        }
    }
}

#[test]
fn the_number_of_steps_keeps_the_tolerance() {
    fn compare(system: &impl SolvableSystem, p: &[f64]) {
        let (times, u, inputs) = recorded(Interpolation::Hold);
        let exact = relaxed(&u, p);
        let problem = Problem { system, p, inputs: &inputs, start: &[] };
        let steps = Steps::PerSample(PerSample::Automatic);
        for method in ["tsit5", "rodas5p"] {
            let mut before = 0;
            for tolerance in [1e-3, 1e-6, 1e-9] {
                let options = options(method, steps, tolerance);
                let solution = simulate_with_sensitivities(&problem, &times, &options).unwrap();
                let n = solution.statistics.per_sample;
                assert!(n >= before, "{method}: {n} steps after {before}");
                before = n;
                // Local errors are below the tolerance and decay at the rate k = 0.7: 1/(1 − e^(−0.7)) = 2 of each of
                // the n steps of a second, at values up to 2.
                let most = 4.0 * f64::from(n) * tolerance;
                let [y, s] = worst(&solution, &exact);
                assert!(y <= most && s <= most, "{method}: {y:e} {s:e} at {tolerance:e}");
            }
            assert!(before > 1);
        }
    }
    let p = parameters::<Relaxation>();
    compare(&RelaxationStacked::of::<Relaxation>(), &p);
    compare(&Heaped::of::<Relaxation>(), &p);
}

#[test]
fn between_samples_and_with_linear_inputs_it_is_the_adaptive_solution() {
    let system = RelaxationStacked::of::<Relaxation>();
    let p = parameters::<Relaxation>();
    let (samples, _, inputs) = recorded(Interpolation::Linear);
    // Off the samples, on them, and once on both sides of one.
    let mut times: Vec<f64> = (0..=100).map(|k| 0.37 * f64::from(k)).collect();
    times.extend(&samples[..38]);
    times.push(7.0);
    times.sort_by(f64::total_cmp);
    times.dedup_by(|a, b| a == b && *a != 7.0);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let tolerance = 1e-9;
    let adaptive = options("rodas5p", Steps::Adaptive, 1e-2 * tolerance);
    let reference = simulate_with_sensitivities(&problem, &times, &adaptive).unwrap();
    for method in ["tsit5", "rodas5p"] {
        let options = options(method, Steps::PerSample(PerSample::Automatic), tolerance);
        let found = simulate_with_sensitivities(&problem, &times, &options).unwrap();
        assert_eq!(found.times, times);
        // Interpolants are of order 4: ten times the error of the steps, which add up tenfold.
        let most = 100.0 * tolerance;
        for (a, b) in found.y.iter().zip(&reference.y).chain(found.s.iter().zip(&reference.s)) {
            assert!((a - b).abs() <= most, "{method}: {a} {b}");
        }
    }
}

#[test]
fn algebraic_unknowns_follow() {
    let system = AlgebraicStacked::of::<Algebraic>();
    let p = parameters::<Algebraic>();
    let times: Vec<f64> = (0..31).map(|k| 0.1 * f64::from(k)).collect();
    let inputs = Inputs::constant(&[0.0]);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let tolerance = 1e-7;
    let locked = options("rodas5p", Steps::PerSample(PerSample::Automatic), tolerance);
    let solution = simulate_with_sensitivities(&problem, &times, &locked).unwrap();
    for (k, &t) in times.iter().enumerate() {
        let (y, s) = Algebraic::solution(t, &p);
        for (found, exact) in solution.y(k).iter().zip(y).chain(solution.s(k).iter().zip(s)) {
            // As with adaptive steps in `accuracy.rs`.
            assert!((found - exact).abs() <= 20.0 * tolerance, "{found} {exact} at {t}");
        }
    }
    let explicit = options("tsit5", exactly(1), tolerance);
    let failure = simulate(&problem, &times, &explicit).unwrap_err();
    let IntegrateError::PerSample(PerSampleError::Algebraic { equation, .. }) = failure.error
    else {
        panic!("{failure}");
    };
    assert_eq!(equation, "of_z");
}

#[test]
fn unknowns_are_the_same_with_and_without_sensitivities_and_on_stack_and_heap() {
    let p = parameters::<Relaxation>();
    let (times, _, inputs) = recorded(Interpolation::Hold);
    let runs = |system: &RelaxationStacked, heaped: &Heaped, method: &str| {
        let options = options(method, exactly(2), 1e-6);
        let problem = Problem { system, p: &p, inputs: &inputs, start: &[] };
        let on_heap = Problem { system: heaped, p: &p, inputs: &inputs, start: &[] };
        [
            simulate(&problem, &times, &options).unwrap().y,
            simulate_with_sensitivities(&problem, &times, &options).unwrap().y,
            simulate(&on_heap, &times, &options).unwrap().y,
            simulate_with_sensitivities(&on_heap, &times, &options).unwrap().y,
        ]
    };
    for method in ["tsit5", "rodas5p"] {
        let [first, others @ ..] =
            runs(&RelaxationStacked::of::<Relaxation>(), &Heaped::of::<Relaxation>(), method);
        for other in others {
            assert_eq!(first, other, "{method}");
        }
    }
}

#[test]
fn sensitivities_are_the_derivatives_of_what_is_computed() {
    let system = RelaxationStacked::of::<Relaxation>();
    let p = parameters::<Relaxation>();
    let (times, _, inputs) = recorded(Interpolation::Hold);
    for method in ["tsit5", "rodas5p"] {
        // One step per sample: the error of the solution is far above that of the comparison.
        let options = options(method, exactly(1), 1e-6);
        let at = |k: f64| {
            let p = [k, p[1]];
            let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
            simulate_with_sensitivities(&problem, &times, &options).unwrap()
        };
        let d = 1e-4;
        let run = at(p[0]);
        let [far_below, below, above, far_above] =
            [-2.0, -1.0, 1.0, 2.0].map(|times| at(p[0] + times * d).y);
        for k in 0..times.len() {
            // Of order d⁴ = 1e-16, and rounding over d.
            let difference =
                (8.0 * (above[k] - below[k]) - (far_above[k] - far_below[k])) / (12.0 * d);
            let found = run.s(k)[0];
            assert!((found - difference).abs() <= 1e-10, "{method}: {found} {difference}");
        }
    }
}

#[test]
fn what_cannot_be_is_said() {
    let system = RelaxationStacked::of::<Relaxation>();
    let p = parameters::<Relaxation>();
    let (times, _, inputs) = recorded(Interpolation::Hold);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let said = |p: &[f64], options: &Options| {
        simulate(&Problem { p, ..problem }, &times, options).unwrap_err().to_string()
    };
    for method in ["bdf", "kencarp4"] {
        let message = said(&p, &options(method, exactly(1), 1e-6));
        assert!(message.contains(method) && message.contains("adaptive"), "{message}");
    }
    // k = 1e6: every step multiplies by more than 1e25.
    let message = said(&[1e6, 2.0], &options("tsit5", exactly(1), 1e-6));
    assert!(message.contains("1 per sample by `tsit5`"), "{message}");
    let automatic = Steps::PerSample(PerSample::Automatic);
    let message = said(&[1e6, 2.0], &options("tsit5", automatic, 1e-6));
    assert!(message.contains("64 per sample by `tsit5`"), "{message}");
    let few = Options { max_steps: 10, ..options("tsit5", exactly(1), 1e-6) };
    let message = said(&p, &few);
    assert!(message.contains("10"), "{message}");
    // The stiff method goes through; with steps so long it does not follow the transients.
    let stiff = options("rodas5p", exactly(1), 1e-6);
    simulate(&Problem { p: &[1e6, 2.0], ..problem }, &times, &stiff).unwrap();
}
