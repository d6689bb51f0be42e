//! Delays of outputs and inputs against closed forms and differences of runs.

use std::path::Path;

use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    InputColumn, Inputs, Observations, Options, Problem, Solution, SolvableSystem, System, observe,
    simulate, simulate_with_sensitivities,
};

use crate::inline::system;
use crate::support::compiled;

const TIGHT: f64 = 1e-10;

fn options() -> Options {
    Options { rtol: TIGHT, atol: TIGHT, ..Options::default() }
}

/// Recorded inputs, a list of samples for each declared input.
fn recorded(system: &impl SolvableSystem, times: &[f64], values: &[&[f64]]) -> Inputs {
    let columns: Vec<InputColumn<'_>> = (system.signature().inputs.iter().zip(values))
        .map(|(input, values)| InputColumn {
            name: &input.name,
            interpolation: input.interpolation,
            values,
        })
        .collect();
    Inputs::recorded(times, &columns).expect("inputs")
}

fn run(
    system: &impl SolvableSystem,
    p: &[f64],
    inputs: &Inputs,
    times: &[f64],
) -> (Solution, Observations) {
    let problem = Problem { system, p, inputs, start: &[] };
    let solution = simulate_with_sensitivities(&problem, times, &options()).expect("a solution");
    let observed = observe(&problem, &solution);
    (solution, observed)
}

/// The run's tolerance leaves each number wrong by some hundred times itself over some hundred
/// steps; numbers here are near one.
#[track_caller]
fn close(what: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e4 * TIGHT, "{what}: {found}, expected {expected}");
}

/// ẍ = −x from (0, 1): x = sin t, ẋ = cos t.
const OSCILLATOR: &str = "
model oscillator
parameter a [s] = 0.5
parameter b [s] = -0.25
parameter c [1] = 3
state x [m] = 0
state v [m/s] = 1
let x_late = delay(c*x, a)
function twice_late(z [m], by [s]) = delay(delay(z, by), by)
equation position: der(x) = v
equation speed: der(v) = -x/1 [s^2]
output now   [m] = x
output late  [m] = x_late + 2 [m]
output early [m] = delay(x, b)
output twice [m] = twice_late(x, a)
output rate  [m/s] = delay(der(x), a) + 0.1 [m/s^2]*time
output both  [m^2] = delay(x, a)*delay(v*1 [s], a)
output order [m] = delay(delay(x, a), b) + delay(delay(x, b), a)
";

#[test]
fn outputs_are_read_late_and_early() {
    let system = system(OSCILLATOR);
    let (a, b, c) = (0.5, -0.25, 3.0);
    let p = [a, b, c];
    let times: Vec<f64> = (0..=40).map(|k| 0.1 * f64::from(k)).collect();
    let (solution, observed) = run(&system, &p, &Inputs::none(), &times);
    assert_eq!(solution.times, times);
    let n_w = observed.n_w;
    for (k, &t) in times.iter().enumerate() {
        // Before the start the state has its start value; beyond the end the run went on.
        let at = |tau: f64| (t - tau).max(0.0);
        let moving = |tau: f64| f64::from(u8::from(t - tau >= 0.0));
        let cos_start = |tau: f64| at(tau).cos();
        let w = observed.w(k);
        close("now", w[0], t.sin());
        close("late", w[1], c * at(a).sin() + 2.0);
        close("early", w[2], at(b).sin());
        close("twice", w[3], at(2.0 * a).sin());
        close("rate", w[4], cos_start(a) + 0.1 * t);
        close("both", w[5], at(a).sin() * at(a).cos());
        close("order", w[6], 2.0 * at(a + b).sin());

        let dw = |i: usize, j: usize| observed.dw(k)[j * n_w + i];
        for j in 0..3 {
            close("dnow", dw(0, j), 0.0);
        }
        close("dlate/da", dw(1, 0), -c * at(a).cos() * moving(a));
        close("dlate/db", dw(1, 1), 0.0);
        close("dlate/dc", dw(1, 2), at(a).sin());
        close("dearly/db", dw(2, 1), -at(b).cos());
        close("dtwice/da", dw(3, 0), -2.0 * at(2.0 * a).cos() * moving(2.0 * a));
        close("drate/da", dw(4, 0), at(a).sin() * moving(a));
        close("dboth/da", dw(5, 0), -(2.0 * at(a)).cos() * moving(a));
        close("dorder/db", dw(6, 1), -2.0 * at(a + b).cos() * moving(a + b));
    }
}

#[test]
fn a_delay_longer_than_the_run_reads_the_start() {
    let system = system(OSCILLATOR);
    let times = [0.0, 1.0, 2.0];
    let (_, observed) = run(&system, &[100.0, 0.0, 3.0], &Inputs::none(), &times);
    for k in 0..3 {
        assert_eq!(observed.w(k)[1], 2.0);
        assert_eq!(observed.dw(k)[1], 0.0);
    }
}

/// With τ = 0 everything is what it is without a delay, to the last bit.
#[test]
fn no_delay_is_no_delay() {
    let model = |reading: &str, arriving: &str| {
        system(&format!(
            "
model tank
input u [m/s] linear
input s [1] hold
parameter tau [s] = 0
parameter k [1/s] = 0.3
state h [m] = 1
unknown z [m] = 1
equation level: der(h) = {arriving} - k*z
equation square: z*z = h*h + 0.1 [m^2] * s*s
output reading [m] = {reading}
"
        ))
    };
    let plain = model("h + z", "u*s");
    let late = model("delay(h + z, tau)", "delay(u, tau)*delay(s, tau)");
    let stamps = [0.0, 1.0, 1.0, 2.5, 4.0];
    let values: [&[f64]; 2] = [&[0.3, 0.7, 0.1, 0.9, 0.2], &[1.0, 2.0, 0.5, 0.7, 1.3]];
    let times = [0.0, 0.3, 1.0, 1.0, 1.7, 2.5, 2.5, 3.9, 4.0];
    let (expected, expected_w) =
        run(&plain, &[0.0, 0.3], &recorded(&plain, &stamps, &values), &times);
    let inputs = recorded(&late, &stamps, &values);
    let problem = Problem { system: &late, p: &[0.0, 0.3], inputs: &inputs, start: &[] };
    let found = simulate(&problem, &times, &options()).expect("a solution");
    let problem = Problem { system: &plain, inputs: &inputs, ..problem_of(&plain, &problem) };
    let plain_again = simulate(&problem, &times, &options()).expect("a solution");
    assert_eq!(found.y, plain_again.y);
    let problem = Problem { system: &late, p: &[0.0, 0.3], inputs: &inputs, start: &[] };
    assert_eq!(
        observe(&problem, &found).w,
        found.y.chunks(2).map(|y| y[0] + y[1]).collect::<Vec<_>>()
    );

    // With sensitivities steps differ, for the derivatives to τ have errors of their own.
    let (solution, observed) = run(&late, &[0.0, 0.3], &inputs, &times);
    for k in 0..times.len() {
        for i in 0..2 {
            close("dy/dk", solution.s(k)[2 + i], expected.s(k)[2 + i]);
        }
        close("w", observed.w(k)[0], expected_w.w(k)[0]);
        close("dw/dk", observed.dw(k)[1], expected_w.dw(k)[1]);
    }
}

fn problem_of<'a>(
    system: &'a InterpretedSystem,
    other: &Problem<'a, InterpretedSystem>,
) -> Problem<'a, InterpretedSystem> {
    Problem { system, p: other.p, inputs: other.inputs, start: other.start }
}

/// ẋ = u(t − τ) − x: what a step and a ramp do, in closed form.
#[test]
fn inputs_arrive_late() {
    let text = |interpolation: &str| {
        format!(
            "
model lag
input u [1] {interpolation}
parameter tau [s] = 0.7
state x [1] = 0
equation lag: 1 [s] * der(x) = delay(u, tau) - x
output arriving [1] = delay(u, tau) - x
output reading  [1] = delay(x, 2*tau)
"
        )
    };
    let tau = 0.7;
    let times: Vec<f64> = (0..=60).map(|k| 0.1 * f64::from(k) + 0.013).collect();
    let stamps = [0.0, 1.0, 10.0];

    // A step from 0 to 2 at 1 + τ: x = 2 (1 − e^−s), dx/dτ = −2 e^−s, with s since the step.
    let held = system(&text("hold"));
    let inputs = recorded(&held, &stamps, &[&[0.0, 2.0, 2.0]]);
    let (solution, observed) = run(&held, &[tau], &inputs, &times);
    let step =
        |s: f64| if s < 0.0 { (0.0, 0.0) } else { (2.0 - 2.0 * (-s).exp(), -2.0 * (-s).exp()) };
    for (k, t) in times.iter().enumerate() {
        let (x, dx) = step(t - 1.0 - tau);
        close("step", solution.y(k)[0], x);
        close("dstep/dtau", solution.s(k)[0], dx);
        // x(t − 2τ) is late by 3τ in all.
        let (late, dlate) = step(t - 1.0 - 3.0 * tau);
        close("late step", observed.w(k)[1], late);
        close("dlate/dtau", observed.dw(k)[1], 3.0 * dlate);
    }

    // A ramp u = t from 0 on: x = s − 1 + e^−s, dx/dτ = −(1 − e^−s), with s = t − τ.
    let linear = system(&text("linear"));
    let inputs = recorded(&linear, &stamps, &[&[0.0, 1.0, 10.0]]);
    let (solution, observed) = run(&linear, &[tau], &inputs, &times);
    for (k, t) in times.iter().enumerate() {
        let s = (t - tau).max(0.0);
        close("ramp", solution.y(k)[0], s - 1.0 + (-s).exp());
        close("dramp/dtau", solution.s(k)[0], (-s).exp() - 1.0);
        let moving = if *t > tau { 1.0 } else { 0.0 };
        close("arriving", observed.w(k)[0], s - solution.y(k)[0]);
        close("darriving/dtau", observed.dw(k)[0], -moving - solution.s(k)[0]);
    }
}

#[test]
fn an_input_from_the_future_is_refused_by_name() {
    let system = system(
        "
model lag
input u [1]
parameter tau [s] = 1
state x [1] = 0
equation lag: 1 [s] * der(x) = delay(u, tau) - x
",
    );
    let inputs = recorded(&system, &[0.0], &[&[1.0]]);
    for (tau, shown) in [(-2.0, "-2 s"), (f64::NAN, "NaN s")] {
        let problem = Problem { system: &system, p: &[tau], inputs: &inputs, start: &[] };
        let failure = simulate(&problem, &[0.0, 1.0], &options()).expect_err("no such input");
        let message = failure.to_string();
        assert!(message.contains("`delay(u, tau)`") && message.contains(shown), "{message}");
    }
}

/// Sensitivities of the repository's model against extrapolated differences of its runs: two
/// jumps of a held input, kinks of a linear one, four delays.
#[test]
fn sensitivities_to_delays_agree_with_differences() {
    let system =
        InterpretedSystem::new(compiled(Path::new("models/delayed_sensor.dgd"), &[]).program);
    let signature = system.signature();
    let p: Vec<f64> = signature.parameters.iter().map(|x| x.value).collect();
    let lpm = signature.inputs[0].unit.factor;
    let flow: Vec<f64> = [300.0, 420.0, 360.0, 360.0, 250.0].iter().map(|q| q * lpm).collect();
    let heat = [10e3, 10e3, 40e3, 25e3, 25e3];
    let inputs = recorded(&system, &[0.0, 30.0, 60.0, 90.0, 150.0], &[&flow, &heat]);
    // No row within a difference's step of a kink or jump: those stand at 0, 30 … plus a delay.
    let times: Vec<f64> = (0..22).map(|k| 5.9 * f64::from(k)).collect();
    let (solution, observed) = run(&system, &p, &inputs, &times);
    let (n, n_w) = (solution.n, observed.n_w);
    let values = |p: &[f64]| {
        let problem = Problem { system: &system, p, inputs: &inputs, start: &[] };
        let solution = simulate(&problem, &times, &options()).expect("a solution");
        let w = observe(&problem, &solution).w;
        (solution.y, w)
    };
    for (j, parameter) in signature.parameters.iter().enumerate() {
        let h = 2e-3 * parameter.value;
        let central = |h: f64| {
            let shifted = |change: f64| {
                let mut p = p.clone();
                p[j] += change;
                values(&p)
            };
            let ((y, w), (y0, w0)) = (shifted(h), shifted(-h));
            let slope = |a: Vec<f64>, b: Vec<f64>| -> Vec<f64> {
                a.iter().zip(&b).map(|(a, b)| (a - b) / (2.0 * h)).collect()
            };
            (slope(y, y0), slope(w, w0))
        };
        // Richardson: (4 D(h/2) − D(h))/3, wrong by h⁴ and by ε/h of the runs.
        let ((y1, w1), (y2, w2)) = (central(h), central(h / 2.0));
        let check = |what: &str,
                     of: usize,
                     rows: usize,
                     found: &dyn Fn(usize) -> f64,
                     d1: &[f64],
                     d2: &[f64],
                     size: f64| {
            let differences =
                (0..times.len()).map(|k| (4.0 * d2[k * rows + of] - d1[k * rows + of]) / 3.0);
            let expected: Vec<f64> = differences.collect();
            let largest = expected.iter().fold(0.0f64, |m, d| m.max(d.abs()));
            for (k, expected) in expected.iter().enumerate() {
                let allowed = 1e-4 * largest + 1e2 * TIGHT * size / h.abs();
                assert!(
                    (found(k) - expected).abs() <= allowed,
                    "d{what}/d{} at {} s: {}, difference {expected}",
                    parameter.name,
                    times[k],
                    found(k)
                );
            }
        };
        for i in 0..n {
            let size = solution.y(0)[i].abs();
            check(&signature.unknowns.name(i), i, n, &|k| solution.s(k)[j * n + i], &y1, &y2, size);
        }
        for i in 0..n_w {
            let size = (0..times.len()).fold(0.0f64, |m, k| m.max(observed.w(k)[i].abs()));
            check(
                &signature.outputs[i].name,
                i,
                n_w,
                &|k| observed.dw(k)[j * n_w + i],
                &w1,
                &w2,
                size,
            );
        }
    }
}

mod generated {
    dgd::model!("models/delayed_sensor.dgd");
    dgd::model!("models/remote_level.dgd");
}

#[test]
fn generated_and_interpreted_runs_give_the_same_bits() {
    let interpreted =
        InterpretedSystem::new(compiled(Path::new("models/delayed_sensor.dgd"), &[]).program);
    let p: Vec<f64> = interpreted.signature().parameters.iter().map(|x| x.value).collect();
    let lpm = interpreted.signature().inputs[0].unit.factor;
    let flow = [300.0 * lpm, 420.0 * lpm, 360.0 * lpm];
    let inputs = recorded(&interpreted, &[0.0, 30.0, 60.0], &[&flow, &[10e3, 30e3, 40e3]]);
    let times: Vec<f64> = (0..60).map(f64::from).collect();
    let of_interpreted = run(&interpreted, &p, &inputs, &times);
    let of_generated = run(&generated::delayed_sensor::Model, &p, &inputs, &times);
    assert_eq!(of_interpreted, of_generated);
}

/// The same of unknowns that act late: what a run keeps of its past is one routine over both.
#[test]
fn generated_and_interpreted_runs_with_a_past_give_the_same_bits() {
    let interpreted =
        InterpretedSystem::new(compiled(Path::new("models/remote_level.dgd"), &[]).program);
    let p: Vec<f64> = interpreted.signature().parameters.iter().map(|x| x.value).collect();
    let lpm = interpreted.signature().inputs[0].unit.factor;
    let inputs =
        recorded(&interpreted, &[0.0, 30.0, 60.0], &[&[300.0, 420.0, 360.0].map(|q| q * lpm)]);
    let times: Vec<f64> = (0..60).map(f64::from).collect();
    let of_interpreted = run(&interpreted, &p, &inputs, &times);
    let of_generated = run(&generated::remote_level::Model, &p, &inputs, &times);
    assert_eq!(of_interpreted, of_generated);
    assert!(of_interpreted.0.undefined.is_empty(), "{:?}", of_interpreted.0.undefined);
}

/// A condition reads the past, and no derivative tells of it.
#[test]
fn an_output_whose_condition_alone_reads_late_is_what_it_says() {
    let system = system(
        "model m\nparameter k = 2\nstate x = 1\nequation e: der(x) = 1 [1/s]\n\
         output w = if delay(x, 0.5 [s]) < x then 0.5*k else k\n",
    );
    let problem = Problem { system: &system, p: &[2.0], inputs: &Inputs::none(), start: &[] };
    let solution = simulate(&problem, &[0.0, 0.25, 1.0], &options()).expect("a solution");
    assert_eq!(observe(&problem, &solution).w, [2.0, 1.0, 1.0]);
}

/// Before the start an input rests, and time does not: a condition on time is that of the row.
#[test]
fn a_condition_on_time_beside_what_is_late_is_that_of_now() {
    let system = system(
        "model m\ninput u hold\nstate x = 1\nequation e: der(x) = -x/1 [s]\n\
         output w = if time > 0.6 [s] then delay(u, 2 [s]) else 7\n",
    );
    let inputs = recorded(&system, &[0.0, 4.0], &[&[3.0, 5.0]]);
    let problem = Problem { system: &system, p: &[], inputs: &inputs, start: &[] };
    let solution = simulate(&problem, &[0.0, 0.5, 1.0, 3.0], &options()).expect("a solution");
    assert_eq!(observe(&problem, &solution).w, [7.0, 7.0, 3.0, 3.0]);
}
