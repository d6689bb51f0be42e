//! Printed rows fulfil the algebraic equations, wherever in a step their times lie.

use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    EvaluationPoint, InputColumn, Inputs, LimitSide, Options, Problem, Solution, System,
    find_method, observe, simulate, simulate_chosen, simulate_observed,
    simulate_with_sensitivities,
};

use crate::inline::system;

/// An unknown that changes its equation where no step ends.
const LESSER: &str = "model lesser
    parameter k [1] = 0.3
    input u [1] linear
    state x [1] = 0.5
    unknown y [1] = 0.2
    output y
    equation lesser: y = min(u, k*x)
    equation state: der(x) = (1 - x - 0.3*y)/1 [s]";

/// One that moves where the state does not, so that steps are long.
const SMOOTH: &str = "model smooth
    parameter p [1] = -0.76
    input u [1] linear
    state x [1] = -2.4
    unknown y [1] = 0.2
    unknown v [1] = 0.1
    output y
    equation y: y = tanh(p) - log(1.5 + (time/1 [s])^2)
    equation v: v = exp(-(y - 0.1*v + 0.01*u)^2)
    equation state: der(x) = p/1 [s]";

/// One whose sensitivities jump.
const JUMPING: &str = "model jumping
    parameter p [1] = 0.3
    parameter q [1] = 1.7
    input u [1] linear
    state a [1] = -0.63
    state b [1] = p - 1
    unknown y [1] = 0.1
    output y
    equation y: y = min(time/1 [s], b + q)
    equation a: der(a) = (0.2*sin(u/(1 + y^2))/(1 + (1.44 + b)^2) - 0.6*a)/1 [s]
    equation b: der(b) = 0.5*(sin(p*time/1 [s]*a) - 0.8*b)/1 [s]";

fn times() -> Vec<f64> {
    (0..=500).map(|k| 0.01 * f64::from(k)).collect()
}

fn inputs(system: &InterpretedSystem) -> Inputs {
    let input = &system.signature().inputs[0];
    let (name, interpolation) = (&*input.name, input.interpolation);
    let column = InputColumn { name, interpolation, values: &[0.0, 0.6, -0.1] };
    Inputs::recorded(&[0.0, 3.0, 5.0], &[column]).expect("inputs")
}

/// The largest residual of an algebraic equation, and of one of its derivatives, in tolerances.
fn residuals(problem: &Problem<'_, InterpretedSystem>, solution: &Solution, tol: f64) -> [f64; 2] {
    let Problem { system, p, .. } = *problem;
    let signature = system.signature();
    let (n, n_s) = (solution.n, solution.n_s);
    let (mut u, mut f, mut g) = (vec![0.0], vec![0.0; n], vec![0.0; n * n_s]);
    let mut largest = [0.0_f64; 2];
    for (k, &t) in solution.times.iter().enumerate() {
        problem.inputs.value(t, LimitSide::Right, &mut u);
        let at = EvaluationPoint { t, y: solution.y(k), u: &u, p, z: solution.z(k) };
        if n_s == 0 {
            system.rhs(at, &mut f);
        } else {
            system.sensitivity_rhs(at, solution.s(k), &mut f, &mut g);
        }
        for i in (0..n).filter(|i| !signature.unknowns.is_differential(*i)) {
            largest[0] = largest[0].max(f[i].abs() / tol);
            for j in 0..n_s {
                largest[1] = largest[1].max(g[j * n + i].abs() / tol);
            }
        }
    }
    largest
}

#[test]
fn rows_fulfil_the_algebraic_equations() {
    for (text, tol) in [(LESSER, 1e-6), (SMOOTH, 1e-9), (JUMPING, 1e-3), (JUMPING, 1e-6)] {
        let system = system(text);
        let p: Vec<f64> = system.signature().parameters.iter().map(|p| p.value).collect();
        let inputs = inputs(&system);
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        for name in ["rodas5p", "kencarp4", "bdf"] {
            let method = find_method(name).expect("a method");
            let options = Options { rtol: tol, atol: tol, method, ..Options::default() };
            let solution = simulate(&problem, &times(), &options).expect("a solution");
            let [left, _] = residuals(&problem, &solution, tol);
            // The equations are those of unknowns of the size of one.
            assert!(left <= 0.2, "{name}: {left} tolerances are left of an equation\n{text}");

            let last = solution.n - 1;
            let chosen =
                simulate_chosen(&problem, &[last], &times(), &options).expect("a solution");
            let whole = (0..solution.len()).map(|k| solution.y(k)[last]);
            for (k, whole) in whole.enumerate() {
                let apart = (chosen.y(k)[0] - whole).abs();
                assert!(apart <= 0.2 * tol, "{name}: chosen apart by {apart}\n{text}");
            }
        }
        let options = Options { rtol: tol, atol: tol, ..Options::default() };
        let solution = simulate_with_sensitivities(&problem, &times(), &options);
        let solution = solution.expect("a solution");
        assert!(solution.undefined.is_empty());
        let [left, of_derivatives] = residuals(&problem, &solution, tol);
        assert!(left <= 0.2, "{left} tolerances are left of an equation\n{text}");
        assert!(of_derivatives <= 0.2, "{of_derivatives} of a derivative\n{text}");
    }
}

/// A single unknown before an array, an algebraic array, and an input that jumps.
const LINE: &str = "model line
    size N = 4
    input u [1] hold
    state a [1] = 0.3
    state x[1..N] = 0.1
    unknown y[1..N] = 0.2
    equation a: der(a) = (u - a*y[2])/1 [s]
    equation first: der(x[1]) = (a - x[1])/1 [s]
    for i in 2..N { equation cell[i]: der(x[i]) = (x[i-1] - x[i])/1 [s] }
    for i in 1..N { equation slow[i]: y[i] = x[i] + 0.5*exp(-y[i])*u }
    output late_change [1/s] = der(a)
    output y";

#[test]
fn outputs_evaluated_on_the_way_are_those_of_all_that_is_kept() {
    let system = system(LINE);
    let name = &*system.signature().inputs[0].name;
    let interpolation = system.signature().inputs[0].interpolation;
    let column = InputColumn { name, interpolation, values: &[0.4, 1.2, 0.7] };
    let inputs = Inputs::recorded(&[0.0, 1.0, 2.0], &[column]).expect("inputs");
    let problem = Problem { system: &system, p: &[], inputs: &inputs, start: &[] };
    // Both sides of a jump, and one of another.
    let mut times: Vec<f64> = (0..=40).map(|k| 0.1 * f64::from(k)).collect();
    times[10] = 1.0;
    times.insert(10, 1.0);
    times[21] = 2.0;
    for name in ["rodas5p", "bdf"] {
        let method = find_method(name).expect("a method");
        let options = Options { method, ..Options::default() };
        let all = simulate(&problem, &times, &options).expect("a solution");
        let expected = observe(&problem, &all);
        let some = simulate_observed(&problem, &[0], &times, &options).expect("a solution");
        let found = observe(&problem, &some);
        assert_eq!((some.n, some.times.len(), found.n_w), (1, times.len(), 5));
        for (k, t) in times.iter().enumerate() {
            assert!((some.y(k)[0] - all.y(k)[0]).abs() < 1e-12, "{name}: a at {t} s");
            for (found, expected) in found.w(k).iter().zip(expected.w(k)) {
                assert!((found - expected).abs() < 1e-7, "{name}: {found} for {expected} at {t} s");
            }
        }
    }
}
