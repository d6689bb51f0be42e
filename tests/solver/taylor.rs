//! Taylor series: coefficients against repeated symbolic differentiation, and solutions against known
//! ones.

use std::num::NonZeroU32;

use dgd_compiler::dae::Dae;
use dgd_compiler::expr::intrinsics::{INTRINSICS, Intrinsic};
use dgd_compiler::expr::{ExprGraph, ExprId, Symbol};
use dgd_compiler::pipeline::CompiledStages;
use dgd_compiler::program::Direction;
use dgd_execute::InterpretedSystem;
use dgd_runtime::taylor::{MOST_ORDER, NoTaylorSeries, SeriesTerms};
use dgd_runtime::{
    EvaluationPoint, InputColumn, Inputs, Interpolation, Method, MethodKind, Options, PerSample,
    Problem, Solution, SolvableSystem, Steps, System, discrete_numbers, find_method, simulate,
    simulate_with_sensitivities,
};

use crate::inline;
use crate::support::{Noise, compiled, every_variant, input_values, model_files};

/// Coefficients of y, without and with sensitivities, and of S at a point, order by order; S row by row.
fn coefficients(
    system: &impl SolvableSystem,
    at: EvaluationPoint<'_>,
    udot: &[f64],
    s0: &[f64],
    h: f64,
    order: usize,
) -> ([Vec<f64>; 2], Vec<f64>) {
    let signature = system.signature();
    let (n, n_s) = (signature.unknowns.len(), signature.directions.len());
    let kept = system.taylor_series().expect("a model with series");
    let mut work: Vec<SeriesTerms> = vec![[f64::NAN; MOST_ORDER + 1]; kept.sensitivities];
    let (mut y, mut s) = (vec![f64::NAN; (order + 1) * n], vec![f64::NAN; (order + 1) * n * n_s]);
    s[..s0.len()].copy_from_slice(s0);
    system.sensitivity_taylor(at, udot, h, order, &mut work, &mut y, &mut s);
    let mut alone = vec![f64::NAN; y.len()];
    let mut work: Vec<SeriesTerms> = vec![[f64::NAN; MOST_ORDER + 1]; kept.unknowns];
    system.taylor(at, udot, h, order, &mut work, &mut alone);
    ([alone, y], s)
}

/// de/dt along solutions.
fn along(graph: &mut ExprGraph, dae: &Dae, e: ExprId) -> ExprId {
    let n = dae.unknowns.len();
    let (n_u, n_late) = (dae.inputs.len(), dae.delayed_inputs.len());
    let gradient = graph.gradient(e, |symbol| match symbol {
        Symbol::Unknown(i) => Some(i as usize),
        Symbol::Time => Some(n),
        Symbol::Input(i) if (i as usize) < n_u + n_late => Some(n + 1 + i as usize),
        _ => None,
    });
    let mut sum = graph.constant(0.0);
    for (position, slope) in gradient {
        let term = match position.checked_sub(n) {
            None => graph.multiply(slope, dae.unknowns[position].rhs),
            Some(0) => slope,
            Some(input) => {
                let udot = graph.symbol(Symbol::InputSlope((input - 1) as u32));
                graph.multiply(slope, udot)
            }
        };
        sum = graph.add(sum, term);
    }
    sum
}

/// A place, and how inputs move there.
struct Place {
    y: Vec<f64>,
    u: Vec<f64>,
    udot: Vec<f64>,
    p: Vec<f64>,
    z: Vec<f64>,
}

const T: f64 = 0.3;
const ORDER: usize = 6;

/// Near the start values, with inputs of a few units that move as they are declared.
fn near_start(system: &InterpretedSystem, noise: &mut Noise) -> Place {
    let signature = system.signature();
    let p: Vec<f64> = signature
        .parameters
        .iter()
        .map(|x| if x.value == 0.0 { 0.1 * x.unit.factor } else { x.value })
        .collect();
    let u = input_values(
        signature,
        |_, x| x.unit.offset + x.unit.factor * (20.0 + 2.0 * noise.next()),
        |_, x| 0.01 * x.unit.factor,
    );
    let declared = |i: usize| match i.checked_sub(signature.inputs.len()) {
        None => Some(i),
        Some(late) => signature.delayed_inputs.get(late).map(|late| late.input),
    };
    let is_linear = |i: usize| {
        declared(i).is_some_and(|i| signature.inputs[i].interpolation == Interpolation::Linear)
    };
    let moves =
        |i: usize| if is_linear(i) { 0.01 * u[i].abs() * (1.5 + noise.next()) } else { 0.0 };
    let udot: Vec<f64> = (0..u.len()).map(moves).collect();
    let z = discrete_numbers(system, &p, T);
    let mut y = vec![0.0; signature.unknowns.len()];
    system.start(EvaluationPoint { t: T, y: &[], u: &u, p: &p, z: &z }, &mut y);
    for (y, unknown) in y.iter_mut().zip(signature.unknowns.iter()) {
        let size = unknown.nominal.unwrap_or(if *y == 0.0 { unknown.unit.factor } else { *y });
        *y += 0.05 * size.abs() * (1.5 + 0.5 * noise.next());
    }
    Place { y, u, udot, p, z }
}

/// Compares coefficients with derivatives that the compiler takes one after the other, and with the
/// derivatives of those to unknowns and parameters.
fn verify_coefficients(compiled: &CompiledStages, label: &str, noise: &mut Noise) {
    let (dae, program) = (&compiled.dae, &compiled.program);
    let system = InterpretedSystem::new(program.clone());
    let signature = system.signature();
    let (n, n_s) = (signature.unknowns.len(), signature.directions.len());
    let Place { y, u, udot, p, z } = &near_start(&system, noise);
    let s0: Vec<f64> = (0..n * n_s).map(|k| y[k / n_s].abs() * noise.next()).collect();
    let at = EvaluationPoint { t: T, y, u, p, z };
    let mut f = vec![0.0; n];
    system.rhs(at, &mut f);
    // A step in which unknowns change by a hundredth.
    let rate = y.iter().zip(&f).fold(0.0_f64, |rate, (y, f)| rate.max((f / y).abs()));
    let h = 0.01 / rate;
    let (found, found_s) = coefficients(&system, at, udot, &s0, h, ORDER);

    let mut graph = dae.graph.clone();
    let value = |symbol: Symbol| match symbol {
        Symbol::Unknown(i) => y[i as usize],
        Symbol::Time => T,
        Symbol::Input(i) => u[i as usize],
        Symbol::InputSlope(i) => udot[i as usize],
        Symbol::Parameter(i) => p[i as usize],
        Symbol::Discrete(i) => z[i as usize],
        other => panic!("{label}: {other:?} in a model with series"),
    };
    for (i, unknown) in signature.unknowns.iter().enumerate() {
        let mut derivative = dae.unknowns[i].rhs;
        let mut factor = h;
        for k in 1..=ORDER {
            let expected = factor * graph.evaluate(derivative, &value);
            // Derivatives are sums of terms that cancel. Where nothing does, terms shrink by about a
            // hundredth from order to order.
            let size = y[i].abs() * 0.01_f64.powf(k as f64);
            let name = &unknown.name;
            for found in &found {
                let computed = found[k * n + i];
                assert!(
                    (computed - expected).abs() <= 1e-9 * expected.abs() + 1e-7 * size,
                    "{label}: order {k} of {name}: {computed:e}, {expected:e}"
                );
            }
            let gradient = graph.gradient(derivative, |symbol| match symbol {
                Symbol::Unknown(i) => Some(i as usize),
                Symbol::Parameter(i) => Some(n + i as usize),
                _ => None,
            });
            for (j, direction) in program.signature.directions.iter().enumerate() {
                // Late inputs depend on parameters through their delays.
                if !dae.delayed_inputs.is_empty() {
                    break;
                }
                let (mut expected, mut size) = (0.0, 0.0_f64);
                for (position, slope) in &gradient {
                    let along = match direction {
                        _ if *position < n => s0[position * n_s + j],
                        Direction::Parameter(p) if n + p == *position => 1.0,
                        Direction::Parameter(_) | Direction::Start(_) => continue,
                    };
                    let term = factor * graph.evaluate(*slope, &value) * along;
                    expected += term;
                    size += term.abs();
                }
                let computed = found_s[(k * n + i) * n_s + j];
                let to = signature.direction_name(j);
                assert!(
                    (computed - expected).abs() <= 1e-9 * size,
                    "{label}: order {k} of {name} to {to}: {computed:e}, {expected:e}"
                );
            }
            derivative = along(&mut graph, dae, derivative);
            factor *= h / (k + 1) as f64;
        }
    }
}

#[test]
fn coefficients_are_repeated_derivatives() {
    let mut compared = 0;
    let mut noise = Noise::new(29);
    for path in model_files() {
        for choices in every_variant(&path) {
            let choices: Vec<(&str, &str)> =
                choices.iter().map(|(v, c)| (v.as_str(), c.as_str())).collect();
            let compiled = compiled(&path, &choices);
            if compiled.program.taylor.is_ok() {
                compared += 1;
                let label = format!("{} {choices:?}", path.display());
                verify_coefficients(&compiled, &label, &mut noise);
            }
        }
    }
    assert!(compared >= 10, "only {compared} models have series");
}

/// Functions whose derivatives are ever new functions.
const WITHOUT: [&str; 2] = ["lgamma", "polygamma"];

/// Every function of the language, of two unknowns that move, in sums, products and quotients.
#[test]
fn every_function_has_its_recurrence() {
    let call = |name: &str, arity: usize, x: &str, y: &str, z: f64| match (name, arity) {
        ("^", _) => format!("({x})^({y})"),
        (_, 1) => format!("{name}({x})"),
        (_, 2) => format!("{name}({x}, {y})"),
        _ => format!("{name}({x}, {y}, {z})"),
    };
    let (without, with): (Vec<&Intrinsic>, Vec<&Intrinsic>) =
        INTRINSICS.iter().partition(|intrinsic| WITHOUT.contains(&intrinsic.name));
    assert_eq!(without.len(), WITHOUT.len());
    let mut noise = Noise::new(41);
    for (k, intrinsic) in with.iter().enumerate() {
        let other = with[(k + 3) % with.len()];
        let arity = |i: &Intrinsic| i.definition.arity();
        for [a, b, third] in intrinsic.sample_points {
            let [c, d, other_third] = other.sample_points[0];
            let f = call(intrinsic.name, arity(intrinsic), "x", "y", *third);
            let by_parameter = call(intrinsic.name, arity(intrinsic), "x", "k", *third);
            let g = call(other.name, arity(other), "v", "w", other_third);
            let text = format!(
                "
model functions
parameter r [1/s] = 0.7
parameter k [1]   = 1.3
state x [1] = {a}  nominal 0.01
state y [1] = {b}  nominal 0.01
state v [1] = {c}  nominal 0.01
state w [1] = {d}  nominal 0.01
state sum     [1] = 1
state product [1] = 1
state ratio   [1] = 1
equation first:  der(x) = r*(0.1 + 0.2*y*v)
equation second: der(y) = r*(0.2 - 0.1*x)
equation third:  der(v) = r*(0.1*w - 0.3*k)
equation fourth: der(w) = r*(0.3 + 0.1*x*x)
equation added:      der(sum)     = r*({f} - k*{g} + {by_parameter})
equation multiplied: der(product) = r*({f}*({g} + k)*x)
equation divided:    der(ratio)   = r*(k/(30 + {f}) + {g}/(40 + x*{f}))
"
            );
            let label = format!("{} and {} at {a}, {b}", intrinsic.name, other.name);
            verify_coefficients(&inline::compiled(&text), &label, &mut noise);
        }
    }
    for call in ["lgamma(x)", "polygamma(1, x)"] {
        let text = format!(
            "model m\nparameter r [1/s] = 1\nstate x [1] = 2\nequation only: der(x) = r*{call}\n"
        );
        let system = InterpretedSystem::new(inline::compiled(&text).program.clone());
        assert!(matches!(system.taylor_series(), Err(NoTaylorSeries::Functions)), "{call}");
    }
}

/// Runs with a tolerance near rounding, at an order of choice.
fn run(text: &str, times: &[f64]) -> Solution {
    static ORDER_20: Method = Method {
        name: "taylor of order 20",
        description: "",
        order: 20,
        source: "",
        kind: MethodKind::Taylor(Some(20)),
    };
    let system = inline::system(text);
    let p: Vec<f64> = system.signature().parameters.iter().map(|p| p.value).collect();
    let inputs = Inputs::none();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let options = Options { rtol: 1e-15, atol: 1e-15, method: &ORDER_20, ..Options::default() };
    simulate_with_sensitivities(&problem, times, &options).expect("a solution")
}

/// e^(−t), with its sensitivities, at step ends and between them.
#[test]
fn the_exponential_is_exact_to_rounding() {
    let text = "
model decay
parameter k  [1/s] = 1
parameter x0 [1]   = 3
state x [1] = x0
equation decay: der(x) = -k*x
";
    let times: Vec<f64> = (0..=40).map(|k| 0.25 * f64::from(k)).collect();
    let solution = run(text, &times);
    assert!(solution.statistics.steps <= 25, "{:?}", solution.statistics);
    for (k, t) in times.iter().enumerate() {
        let e = (-t).exp();
        // Each step rounds a few times, and what it rounds decays.
        let allowed = 4.0 * f64::EPSILON * solution.statistics.steps as f64;
        for (found, exact) in
            [(solution.y(k)[0], 3.0 * e), (solution.s(k)[0], -3.0 * t * e), (solution.s(k)[1], e)]
        {
            assert!((found - exact).abs() <= allowed, "t = {t}: {found} {exact}");
        }
    }
}

/// A planet comes back after each period, and keeps its energy and its angular momentum.
#[test]
fn kepler_orbits_close() {
    let text = "
model kepler
parameter e [1] = 0.3
state x [1]   = 1 - e
state y [1]   = 0  nominal 1
state u [1/s] = 0  nominal 1
state v [1/s] = sqrt((1 + e)/(1 - e)) * 1 [1/s]
let r2 = x^2 + y^2
let cube = r2*sqrt(r2)
constant mu [1/s^2] = 1
equation along_x:  der(x) = u
equation along_y:  der(y) = v
equation falls_x:  der(u) = -mu*x/cube
equation falls_y:  der(v) = -mu*y/cube
";
    let period = 2.0 * std::f64::consts::PI;
    let times: Vec<f64> = (0..=30).map(|k| 0.1 * period * f64::from(k)).collect();
    let solution = run(text, &times);
    let energy =
        |y: &[f64]| 0.5 * (y[2] * y[2] + y[3] * y[3]) - 1.0 / (y[0] * y[0] + y[1] * y[1]).sqrt();
    let momentum = |y: &[f64]| y[0] * y[3] - y[1] * y[2];
    let start = solution.y(0).to_vec();
    // Rounding of each step, on numbers up to the square of the largest speed, 1.9.
    let allowed = 4.0 * f64::EPSILON * solution.statistics.steps as f64;
    for k in 0..times.len() {
        let y = solution.y(k);
        assert!((energy(y) - energy(&start)).abs() <= allowed, "energy {k}: {}", energy(y));
        assert!((momentum(y) - momentum(&start)).abs() <= allowed, "momentum {k}");
    }
    // An error of the energy moves the planet along its orbit: 3 π v per period and part of it.
    for (k, turns) in [(10, 1.0), (20, 2.0), (30, 3.0)] {
        for (found, first) in solution.y(k).iter().zip(&start) {
            let allowed = 20.0 * turns * allowed;
            assert!((found - first).abs() <= allowed, "{k}: {found} {first}");
        }
    }
}

/// x(10) and v(10) from a Taylor series of order 40 with 50 digits; steps of 1/40 and of 1/80 gave the
/// same 45.
#[test]
fn van_der_pol_to_fourteen_digits() {
    let text = "
model oscillator
parameter mu [1/s] = 1
constant omega [1/s] = 1
state x [1]   = 2
state v [1/s] = 0  nominal 1
equation position: der(x) = v
equation force:    der(v) = mu*(1 - x^2)*v - omega^2*x
";
    let solution = run(text, &[0.0, 10.0]);
    let exact = [-2.008_340_782_579_712, 0.032_907_065_863_324_064];
    for (found, exact) in solution.y(1).iter().zip(exact) {
        assert!((found - exact).abs() <= 2e-14, "{found} {exact}");
    }
}

#[test]
fn models_without_series_are_refused() {
    let said = |text: &str, inputs: &Inputs| {
        let system = inline::system(text);
        let p: Vec<f64> = system.signature().parameters.iter().map(|p| p.value).collect();
        let problem = Problem { system: &system, p: &p, inputs, start: &[] };
        let method = find_method("taylor").expect("a method");
        let options = Options { method, ..Options::default() };
        let failure = simulate(&problem, &[0.0, 1.0], &options).expect_err("no series");
        failure.error.to_string()
    };
    let none = Inputs::none();
    for (text, reason) in [
        (
            "
model algebraic
state x [1] = 1
state z [1] = 1
equation first:  der(x) = -z * 1 [1/s]
equation second: 0 = z - x^2
",
            "unknowns are algebraic",
        ),
        (
            "
model late
state x [1] = 1
equation decay: der(x) = -delay(x, 1 [s]) * 1 [1/s]
",
            "unknowns are read late",
        ),
    ] {
        let message = said(text, &none);
        assert!(message.contains(reason) && message.contains("`rodas5p`"), "{message}");
    }
    let column =
        InputColumn { name: "u", interpolation: Interpolation::Linear, values: &[1.0, 2.0] };
    let lines = Inputs::recorded(&[0.0, 1.0], &[column]).expect("sound inputs");
    let text = "
model held
input u [1] hold
state x [1] = 1
equation relaxation: der(x) = (u - x) * 1 [1/s]
";
    let message = said(text, &lines);
    assert!(message.contains("`u`") && message.contains("declare it `linear`"), "{message}");
}

/// A step along series ends at a threshold as any other does, and sensitivities go through it.
#[test]
fn events_are_passed() {
    let system = inline::system(
        "
model ball
parameter g  [m/s^2] = 9.81
parameter h0 [m]     = 2
parameter e  [1]     = 0.8
parameter c  [1/m]   = 0.1
state h [m]   = h0
state v [m/s] = 0  nominal 1
equation way: der(h) = v
modes ball {
  flying { equation fall: der(v) = -g - c*v*abs(v) }
  flying -> flying when h falls below 0 [m] { reset v = -e*v }
}
",
    );
    let p: Vec<f64> = system.signature().parameters.iter().map(|p| p.value).collect();
    let inputs = Inputs::none();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let times = [0.0, 0.5, 1.0, 1.7, 2.0];
    let [series, expected] = ["taylor", "rodas5p"].map(|name| {
        let method = find_method(name).expect("a method");
        let options = Options { rtol: 1e-10, atol: 1e-10, method, ..Options::default() };
        simulate_with_sensitivities(&problem, &times, &options).expect("a solution")
    });
    assert!(series.events.len() >= 2, "{:?}", series.events);
    assert_eq!(series.events.len(), expected.events.len());
    let pairs = series.y.iter().zip(&expected.y).chain(series.s.iter().zip(&expected.s));
    for (found, expected) in pairs {
        // Local errors of some ten steps, larger by the slopes at impacts of numbers up to 10.
        assert!((found - expected).abs() <= 1e-7, "{found} {expected}");
    }
}

#[test]
fn the_order_per_sample_is_as_low_as_the_tolerance_allows() {
    let text = "
model relaxing
parameter k [1/s] = 0.3
input u [1/s] hold
state x [1] = 1
equation relaxation: der(x) = u - k*x - 0.1*k*x^2
";
    let system = inline::system(text);
    let times: Vec<f64> = (0..400).map(f64::from).collect();
    let values: Vec<f64> = times.iter().map(|t| (0.7 * t).sin()).collect();
    let column = InputColumn { name: "u", interpolation: Interpolation::Hold, values: &values };
    let inputs = Inputs::recorded(&times, &[column]).unwrap();
    let problem = Problem { system: &system, p: &[0.3], inputs: &inputs, start: &[] };
    let run = |method: &str, steps: Steps, tolerance: f64| {
        let method = find_method(method).unwrap();
        let options =
            Options { method, steps, rtol: tolerance, atol: tolerance, ..Options::default() };
        simulate_with_sensitivities(&problem, &times, &options).unwrap()
    };
    let exact = run("rodas5p", Steps::Adaptive, 1e-12);
    let mut errors = Vec::new();
    for tolerance in [1e-3, 1e-5, 1e-7, 1e-9] {
        let found = run("taylor", Steps::PerSample(PerSample::Automatic), tolerance);
        assert_eq!(found.statistics.steps, 399, "one step per sample at {tolerance}");
        let differences = |a: &[f64], b: &[f64]| {
            a.iter().zip(b).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()))
        };
        let error = differences(&found.y, &exact.y).max(differences(&found.s, &exact.s));
        // Errors of steps are below the tolerance of numbers near 3, and die out in three samples.
        assert!(error <= 10.0 * tolerance, "{error} at {tolerance}");
        errors.push(error);
    }
    // No more accurate than asked for by more than what one order gives.
    assert!(errors.windows(2).all(|pair| pair[1] < 0.5 * pair[0]), "{errors:?}");
    let named = run("taylor2", Steps::PerSample(PerSample::Exactly(NonZeroU32::MIN)), 1e-9);
    assert!(named.y.iter().zip(&exact.y).any(|(a, b)| (a - b).abs() > 1e-4));
    assert!(find_method("taylor1").is_err() && find_method("taylor32").is_err());
}
