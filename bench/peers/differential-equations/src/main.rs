//! The problems solved with differential-equations.
//!
//! States are scaled by their sizes, because a single absolute tolerance applies to all. Each interval of constant
//! inputs is a problem of its own.

mod systems;

use std::process::ExitCode;

use differential_equations::prelude::*;
use peers_problems::request::{Answer, Failure, Request, Sample, answer};
use peers_problems::two_state::{LEVEL, SETS, SIZES, STRETCHES, TwoState, WIDTH, ensemble};

use systems::{Augmented, States};

/// Rows of N scaled numbers, and the steps of the solver.
type Run<const N: usize> = (Vec<[f64; N]>, usize);

/// Solves interval by interval; `$problem` makes a problem from the model, the interval and its start.
macro_rules! stretches {
    ($request:expr, $model:expr, $start:expr, $problem:expr, $method:expr) => {{
        let (mut rows, mut steps, mut y) = (Vec::with_capacity(1001), 0, $start);
        for (from, to, w) in STRETCHES {
            let model = TwoState { w, ..$model };
            let (from, to) = (f64::from(from), f64::from(to));
            let method = $method.rtol($request.rtol).atol(0.01 * $request.rtol);
            let solution = $problem(&model, from, to, y)
                .even(1.0)
                .method(method)
                .solve()
                .map_err(|error| format!("{error:?}"))?;
            // The start of an interval is the end of the previous one.
            rows.extend_from_slice(&solution.y[usize::from(from > 0.0)..]);
            steps += solution.steps.accepted;
            y = rows[rows.len() - 1];
        }
        Ok::<_, Failure>((rows, steps))
    }};
}

/// The same for inputs that change every second; the first trial step is a whole second.
macro_rules! recording {
    ($request:expr, $samples:expr, $start:expr, $system:expr, $method:expr) => {{
        let (mut rows, mut steps, mut y) = (vec![$start], 0, $start);
        rows.reserve($samples.len());
        for sample in &$samples[..$samples.len() - 1] {
            let system = $system(model_at(sample));
            let method = $method.rtol($request.rtol).atol(0.01 * $request.rtol).h0(1.0);
            let solution = IVP::ode(&system, 0.0, 1.0, y)
                .method(method)
                .solve()
                .map_err(|error| format!("{error:?}"))?;
            steps += solution.steps.accepted;
            y = solution.y[solution.y.len() - 1];
            rows.push(y);
        }
        Ok::<_, Failure>((rows, steps))
    }};
}

fn main() -> ExitCode {
    answer(|request| match request.case.as_str() {
        "p1a" => ode(request),
        "p1b" => ode_with_sensitivities(request),
        "p2a" => dae(request),
        "p4" => sets(request),
        "p5a" | "p5b" => recorded(request),
        case => Err(format!("no program for {case}").into()),
    })
}

fn ode(request: &Request) -> Result<(), Failure> {
    match request.method.as_str() {
        "radau5" => request.measure(|| radau5(request, TwoState::start()), scaled_back),
        "dopri5" => request.measure(
            || {
                let problem =
                    |model: &TwoState, from, to, y| IVP::ode_owned(States(*model), from, to, y);
                let model = TwoState::start();
                stretches!(request, model, [1.0, 1.0], problem, ExplicitRungeKutta::dopri5())
            },
            scaled_back,
        ),
        method => Err(format!("no {method} for {}", request.case).into()),
    }
}

fn radau5(request: &Request, model: TwoState) -> Result<Run<2>, Failure> {
    let problem = |model: &TwoState, from, to, y| IVP::ode_owned(States(*model), from, to, y);
    stretches!(request, model, [1.0, 1.0], problem, ImplicitRungeKutta::radau5())
}

/// `radau5` with the crate's own sensitivity equations, `dopri5` with twelve hand-written equations.
fn ode_with_sensitivities(request: &Request) -> Result<(), Failure> {
    let model = TwoState::start();
    match request.method.as_str() {
        "radau5" => request.measure(
            || {
                let problem = |model: &TwoState, from, to, y: [f64; WIDTH]| {
                    IVP::ode_owned(States(*model), from, to, [y[0], y[1]]).forward_sensitivity(y)
                };
                stretches!(request, model, at_rest(), problem, ImplicitRungeKutta::radau5())
            },
            |(rows, steps)| scaled_back((rows.iter().map(by_parameter).collect(), steps)),
        ),
        "dopri5" => request.measure(
            || {
                let problem =
                    |model: &TwoState, from, to, y| IVP::ode_owned(Augmented(*model), from, to, y);
                stretches!(request, model, at_rest(), problem, ExplicitRungeKutta::dopri5())
            },
            scaled_back,
        ),
        method => Err(format!("no {method} for {}", request.case).into()),
    }
}

/// The crate does not compute a consistent start, so q is made consistent at the start of each interval.
fn dae(request: &Request) -> Result<(), Failure> {
    if request.method != "radau5" {
        return Err(format!("no {} for {}", request.method, request.case).into());
    }
    request.measure(
        || {
            let (mut rows, mut steps, mut y) = (Vec::with_capacity(1001), 0, [1.0, 1.0]);
            for (from, to, w) in STRETCHES {
                let system = States(TwoState { w, ..TwoState::start() });
                let method =
                    ImplicitRungeKutta::radau5().rtol(request.rtol).atol(0.01 * request.rtol);
                let start = system.consistent(y);
                let solution = IVP::dae(&system, f64::from(from), f64::from(to), start)
                    .even(1.0)
                    .method(method)
                    .solve()
                    .map_err(|error| format!("{error:?}"))?;
                rows.extend_from_slice(&solution.y[usize::from(from > 0)..]);
                steps += solution.steps.accepted;
                y = rows[rows.len() - 1];
            }
            Ok((rows, steps))
        },
        scaled_back,
    )
}

/// P4: the mean level over all sets and outputs.
fn sets(request: &Request) -> Result<(), Failure> {
    if request.method != "radau5" {
        return Err(format!("no {} for {}", request.method, request.case).into());
    }
    request.measure(
        || {
            let (mut sum, mut steps) = (0.0, 0);
            for p in ensemble(SETS) {
                let (rows, taken) = radau5(request, TwoState { p, ..TwoState::start() })?;
                sum += rows.iter().map(|row| LEVEL * row[0]).sum::<f64>();
                steps += taken;
            }
            Ok((sum / (SETS * 1001) as f64, steps))
        },
        |(mean, steps)| Answer::new(vec![mean], steps),
    )
}

fn recorded(request: &Request) -> Result<(), Failure> {
    let samples = request.recording()?;
    match (request.with_sensitivities(), request.method.as_str()) {
        (false, "dopri5") => request.measure(
            || recording!(request, samples, [1.0, 1.0], States, ExplicitRungeKutta::dopri5()),
            scaled_back,
        ),
        (false, "radau5") => request.measure(
            || recording!(request, samples, [1.0, 1.0], States, ImplicitRungeKutta::radau5()),
            scaled_back,
        ),
        (true, "dopri5") => request.measure(
            || recording!(request, samples, at_rest(), Augmented, ExplicitRungeKutta::dopri5()),
            scaled_back,
        ),
        (_, method) => Err(format!("no {method} for {}", request.case).into()),
    }
}

fn model_at(sample: &Sample) -> TwoState {
    TwoState { w: sample.w, q_out: sample.q_b + sample.q_tf, ..TwoState::start() }
}

/// Scaled states, with zero sensitivities.
fn at_rest() -> [f64; WIDTH] {
    let mut y = [0.0; WIDTH];
    y[0] = 1.0;
    y[1] = 1.0;
    y
}

/// The crate orders all sensitivities of the first state before those of the second.
fn by_parameter(row: &[f64; WIDTH]) -> [f64; WIDTH] {
    std::array::from_fn(|i| if i < 2 { row[i] } else { row[2 + 5 * (i % 2) + (i - 2) / 2] })
}

fn scaled_back<const N: usize>((rows, steps): Run<N>) -> Answer {
    let values =
        rows.iter().flat_map(|row| row.iter().zip(SIZES.iter().cycle()).map(|(x, s)| x * s));
    Answer::new(values.collect(), steps)
}
