//! Compares solutions and sensitivities with known ones.

use dgd_runtime::{
    InputColumn, Inputs, Interpolation, METHODS, Method, MethodKind, Options, Problem,
    SolvableSystem, simulate, simulate_with_sensitivities,
};

use crate::support::problems::{
    Algebraic, AlgebraicStacked, Logistic, LogisticStacked, Relaxation, RelaxationStacked,
    Robertson, RobertsonDae, RobertsonDaeStacked, RobertsonStacked,
};
use crate::support::{Equations, Heaped, parameters};

/// Local errors are kept below the tolerance; on these problems, in which errors decay, the global error is a small
/// multiple of it.
const GLOBAL: f64 = 20.0;

/// The methods, and the multiple for each: with backward differentiation, errors of the same sign add up over several
/// steps.
fn methods(algebraic: bool) -> impl Iterator<Item = (&'static Method, f64)> {
    METHODS.iter().filter_map(move |method| match method.kind {
        MethodKind::Rosenbrock(_) | MethodKind::Esdirk(_) => Some((method, GLOBAL)),
        MethodKind::Bdf(_) => Some((method, 5.0 * GLOBAL)),
        MethodKind::Explicit(_) | MethodKind::Taylor(_) => (!algebraic).then_some((method, GLOBAL)),
    })
}

fn times(until: f64, count: u32) -> Vec<f64> {
    (0..=count).map(|k| until * f64::from(k) / f64::from(count)).collect()
}

fn options(tolerance: f64) -> Options {
    Options { rtol: tolerance, atol: tolerance, ..Options::default() }
}

#[test]
fn errors_follow_the_tolerance() {
    let system = LogisticStacked::of::<Logistic>();
    let p = parameters::<Logistic>();
    let inputs = Inputs::constant(&[0.0]);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let times = times(8.0, 160);
    let cases = methods(false).flat_map(|m| [1e-4, 1e-6, 1e-8, 1e-10].map(|tol| (m, tol)));
    for ((method, most), tolerance) in cases {
        let options = Options { method, ..options(tolerance) };
        let solution = simulate_with_sensitivities(&problem, &times, &options).unwrap();
        let (mut worst, mut worst_s) = (0.0_f64, 0.0_f64);
        for (k, &t) in times.iter().enumerate() {
            let [x, dx @ ..] = Logistic::solution(t, &p);
            worst = worst.max((solution.y(k)[0] - x).abs());
            for j in 0..3 {
                // In units of the direction's tolerance.
                worst_s = worst_s.max((solution.s(k)[j] - dx[j]).abs() * p[j]);
            }
        }
        let name = method.name;
        assert!(worst <= most * tolerance, "{name}: {worst:e} at {tolerance:e}");
        assert!(worst_s <= most * tolerance, "{name}: {worst_s:e} at {tolerance:e}");
    }
}

#[test]
fn algebraic_unknowns_are_as_good_as_differential_ones() {
    let system = AlgebraicStacked::of::<Algebraic>();
    let p = parameters::<Algebraic>();
    let inputs = Inputs::constant(&[0.0]);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let times = times(3.0, 60);
    let cases = methods(true).flat_map(|m| [1e-4, 1e-6, 1e-8].map(|tol| (m, tol)));
    for ((method, most), tolerance) in cases {
        let options = Options { method, ..options(tolerance) };
        let solution = simulate_with_sensitivities(&problem, &times, &options).unwrap();
        for (k, &t) in times.iter().enumerate() {
            let (y, s) = Algebraic::solution(t, &p);
            let pairs = solution.y(k).iter().zip(&y).chain(solution.s(k).iter().zip(&s));
            for (i, (computed, exact)) in pairs.enumerate() {
                let error = (computed - exact).abs();
                let name = method.name;
                assert!(
                    error <= most * tolerance,
                    "{name}, {i}: {error:e} at {tolerance:e}, t = {t}"
                );
            }
        }
    }
}

#[test]
fn robertson_as_ode_and_as_dae() {
    // Hairer and Wanner, Solving Ordinary Differential Equations II: reference solution at t = 1e11.
    let reference =
        [0.208_334_014_970_122_e-7, 0.833_336_077_033_471_3e-13, 0.999_999_979_166_506_9];
    let inputs = Inputs::none();
    let p = parameters::<Robertson>();
    let times = [0.0, 1e11];
    let tolerance = 1e-7;
    let options = Options { rtol: tolerance, atol: 1e-4 * tolerance, ..Options::default() };

    let system = RobertsonStacked::of::<Robertson>();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let ode = simulate(&problem, &times, &options).unwrap();
    let system = RobertsonDaeStacked::of::<RobertsonDae>();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let dae = simulate(&problem, &times, &options).unwrap();

    for solution in [&ode, &dae] {
        for (computed, exact) in solution.y(1).iter().zip(reference) {
            // The tolerance of b, 1e-16, is a thousandth of its value at the end.
            let error = (computed / exact - 1.0).abs();
            assert!(error <= 1e-3, "{computed:e} {exact:e}");
        }
    }
}

#[test]
fn held_and_linear_inputs() {
    let system = RelaxationStacked::of::<Relaxation>();
    let p = parameters::<Relaxation>();
    let (k, x0) = (p[0], p[1]);
    let sampled = [0.0, 1.0, 2.0, 3.0];
    let values = [1.0, 3.0, -1.0, 2.0];
    let times = times(3.0, 30);
    let tolerance = 1e-8;

    let kinds = [Interpolation::Hold, Interpolation::Linear];
    for ((method, most), interpolation) in methods(false).flat_map(|m| kinds.map(|k| (m, k))) {
        let column = InputColumn { name: "u", interpolation, values: &values };
        let inputs = Inputs::recorded(&sampled, &[column]).unwrap();
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        let options = Options { method, ..options(tolerance) };
        let solution = simulate_with_sensitivities(&problem, &times, &options).unwrap();

        // On a segment u = c + m τ: x = α + β τ + (x(0) − α) e^(−kτ), β = m/k, α = (c − β)/k.
        let (mut start, mut s0, mut s1) = (x0, 0.0, 1.0);
        let mut segment = 0;
        for (index, &t) in times.iter().enumerate() {
            let at = |start: f64, s0: f64, s1: f64, segment: usize, tau: f64| {
                let c = values[segment];
                let m = match interpolation {
                    Interpolation::Hold => 0.0,
                    Interpolation::Linear => values[segment + 1] - c,
                };
                let (beta, e) = (m / k, (-k * tau).exp());
                let alpha = (c - beta) / k;
                let (dbeta, dalpha) = (-m / (k * k), -c / (k * k) + 2.0 * m / (k * k * k));
                (
                    alpha + beta * tau + (start - alpha) * e,
                    dalpha + dbeta * tau + (s0 - dalpha) * e - tau * (start - alpha) * e,
                    s1 * e,
                )
            };
            while segment < 2 && t >= sampled[segment + 1] {
                (start, s0, s1) = at(start, s0, s1, segment, 1.0);
                segment += 1;
            }
            let (x, dk, dx0) = at(start, s0, s1, segment, t - sampled[segment]);
            let computed = [solution.y(index)[0], solution.s(index)[0], solution.s(index)[1]];
            for (computed, exact) in computed.iter().zip([x, dk, dx0]) {
                let error = (computed - exact).abs();
                let name = method.name;
                assert!(error <= most * tolerance, "{name} {interpolation:?} {t}: {error:e}");
            }
        }
        // Three between four samples, and one after the last.
        assert_eq!(solution.statistics.segments, 4);
    }
}

#[test]
fn storage_does_not_change_a_bit() {
    fn compare<E: Equations>(stacked: &impl SolvableSystem, until: f64, inputs: &Inputs) {
        let heaped = Heaped::of::<E>();
        let p = parameters::<E>();
        let times = times(until, 50);
        let options = Options::default();
        let problem = Problem { system: stacked, p: &p, inputs, start: &[] };
        let a = simulate_with_sensitivities(&problem, &times, &options).unwrap();
        let problem = Problem { system: &heaped, p: &p, inputs, start: &[] };
        let b = simulate_with_sensitivities(&problem, &times, &options).unwrap();
        let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&a.y), bits(&b.y));
        assert_eq!(bits(&a.s), bits(&b.s));
        assert_eq!(a.statistics, b.statistics);
    }
    let column =
        InputColumn { name: "u", interpolation: Interpolation::Linear, values: &[1.0, 2.0, 0.0] };
    let inputs = Inputs::recorded(&[0.0, 1.5, 4.0], &[column]).unwrap();
    compare::<Relaxation>(&RelaxationStacked::of::<Relaxation>(), 4.0, &inputs);
    compare::<Algebraic>(&AlgebraicStacked::of::<Algebraic>(), 3.0, &Inputs::constant(&[0.0]));
    compare::<RobertsonDae>(&RobertsonDaeStacked::of::<RobertsonDae>(), 40.0, &Inputs::none());
}

/// Measures global errors with steps of 1/4 and 1/8, without error control: an input that no equation reads changes at
/// every step, and the tolerance exceeds any error.
#[test]
fn the_order_is_that_of_the_method() {
    fn errors<E: Equations>(
        steps: u32,
        start: &[(usize, f64)],
        exact: impl Fn(f64) -> Vec<f64>,
    ) -> [f64; 3] {
        let system = Heaped::of::<E>();
        let p = parameters::<E>();
        let samples = times(2.0, steps);
        let values: Vec<f64> = samples.iter().map(|t| t * 3.0).collect();
        let clock =
            InputColumn { name: "clock", interpolation: Interpolation::Hold, values: &values };
        let inputs = Inputs::recorded(&samples, &[clock]).unwrap();
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start };
        let options = Options { rtol: 1e6, initial_step: Some(1.0), ..Options::default() };
        // Step ends, and a third of the last step for the dense output.
        let asked = [0.0, 2.0 - 2.0 / 3.0 * 2.0 / f64::from(steps), 2.0];
        let solution = simulate_with_sensitivities(&problem, &asked, &options).unwrap();
        assert_eq!(solution.statistics.steps, steps as usize);
        let n = solution.n;
        let error = |computed: &[f64], exact: &[f64]| {
            computed.iter().zip(exact).fold(0.0_f64, |worst, (c, e)| worst.max((c - e).abs()))
        };
        let (inside, end) = (exact(asked[1]), exact(asked[2]));
        [
            error(solution.y(2), &end[..n]),
            error(solution.s(2), &end[n..]),
            error(solution.y(1), &inside[..n]).max(error(solution.s(1), &inside[n..])),
        ]
    }
    fn orders<E: Equations>(start: &[(usize, f64)], exact: impl Fn(f64) -> Vec<f64>) {
        let (coarse, fine) = (errors::<E>(16, start, &exact), errors::<E>(32, start, &exact));
        let order = |k: usize| (coarse[k] / fine[k]).log2();
        // At these step sizes the next power of h is still visible.
        assert!(order(0) > 4.7, "unknowns: {}", order(0));
        assert!(order(1) > 4.7, "sensitivities: {}", order(1));
        // The error of one step of an interpolant of order 4 is of order h⁵.
        assert!(order(2) > 4.5, "dense output: {}", order(2));
    }
    orders::<Logistic>(&[], |t| Logistic::solution(t, &parameters::<Logistic>()).to_vec());
    // With such a large tolerance any guess counts as consistent, so it must be exactly so.
    let p = parameters::<Algebraic>();
    orders::<Algebraic>(&[(1, p[1] * p[2])], |t| {
        let (y, s) = Algebraic::solution(t, &p);
        y.into_iter().chain(s).collect()
    });
}

#[test]
fn replaced_start_values_depend_on_nothing() {
    let system = RelaxationStacked::of::<Relaxation>();
    let p = parameters::<Relaxation>();
    let inputs = Inputs::constant(&[1.0]);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[(0, 5.0)] };
    let solution = simulate_with_sensitivities(&problem, &[0.0, 1.0], &options(1e-8)).unwrap();
    assert_eq!(solution.y(0), [5.0]);
    assert_eq!(solution.s(0), [0.0, 0.0]);
    assert_eq!(solution.s(1)[1], 0.0);
}
