//! Runs of models to a tight tolerance, and what they are compared by.

#![allow(dead_code, reason = "no test binary uses all of it")]

use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    Failure, Inputs, Options, Problem, Solution, System, simulate, simulate_with_sensitivities,
};

/// The relative tolerance of the runs.
pub(crate) const RTOL: f64 = 1e-11;

pub(crate) fn options() -> Options {
    Options { rtol: RTOL, atol: RTOL, ..Options::default() }
}

pub(crate) fn parameters(system: &InterpretedSystem) -> Vec<f64> {
    system.signature().parameters.iter().map(|parameter| parameter.value).collect()
}

pub(crate) fn run_with(
    system: &InterpretedSystem,
    p: &[f64],
    inputs: &Inputs,
    times: &[f64],
) -> Result<Solution, Failure> {
    let problem = Problem { system, p, inputs, start: &[] };
    simulate_with_sensitivities(&problem, times, &options())
}

pub(crate) fn run(system: &InterpretedSystem, times: &[f64]) -> Solution {
    run_with(system, &parameters(system), &Inputs::none(), times).expect("a solution")
}

pub(crate) fn position(system: &InterpretedSystem, unknown: &str) -> usize {
    let unknowns = &system.signature().unknowns;
    unknowns.iter().position(|u| u.name == unknown).expect("an unknown")
}

/// An unknown at the k-th time.
pub(crate) fn value(
    system: &InterpretedSystem,
    solution: &Solution,
    unknown: &str,
    k: usize,
) -> f64 {
    solution.y(k)[position(system, unknown)]
}

/// Sensitivities of an unknown at the k-th time, by parameter.
pub(crate) fn slopes(
    system: &InterpretedSystem,
    solution: &Solution,
    unknown: &str,
    k: usize,
) -> Vec<f64> {
    let i = position(system, unknown);
    solution.s(k).chunks(solution.n).map(|column| column[i]).collect()
}

/// Times of the events.
pub(crate) fn event_times(solution: &Solution) -> Vec<f64> {
    solution.events.iter().map(|event| event.t).collect()
}

/// Numbers agree to a part of the largest of them.
#[track_caller]
pub(crate) fn assert_close(found: &[f64], expected: &[f64], close: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?}\n{expected:?}");
    let largest = expected.iter().fold(1e-3_f64, |largest, x| largest.max(x.abs()));
    for (j, (f, e)) in found.iter().zip(expected).enumerate() {
        assert!(
            (f - e).abs() <= close * largest,
            "number {j}: {f} is not {e}\n{found:?}\n{expected:?}"
        );
    }
}

/// All sensitivities at the last time against central differences, extrapolated once.
#[track_caller]
pub(crate) fn assert_slopes_are_differences(
    system: &InterpretedSystem,
    inputs: &Inputs,
    times: &[f64],
    close: f64,
) {
    assert_slopes_within(system, inputs, times, close, [1e-3, 1e-9]);
}

/// The same, a difference counting as no smaller than a part of y/p, and than a number.
#[track_caller]
pub(crate) fn assert_slopes_within(
    system: &InterpretedSystem,
    inputs: &Inputs,
    times: &[f64],
    close: f64,
    [part, least]: [f64; 2],
) {
    let p = parameters(system);
    let exact = run_with(system, &p, inputs, times).expect("a solution");
    assert!(exact.undefined.is_empty(), "{:?}", exact.undefined);
    let k = times.len() - 1;
    let n = exact.n;
    for j in 0..p.len() {
        let h = 1e-3 * if p[j] == 0.0 { 1.0 } else { p[j].abs() };
        let moved = |step: f64| {
            let mut p = p.clone();
            p[j] += step;
            let problem = Problem { system, p: &p, inputs, start: &[] };
            simulate(&problem, times, &options()).expect("a solution").y(k).to_vec()
        };
        let central = |h: f64| -> Vec<f64> {
            let pair = moved(h).into_iter().zip(moved(-h));
            pair.map(|(high, low)| (high - low) / (2.0 * h)).collect()
        };
        let (wide, narrow) = (central(h), central(0.5 * h));
        let found = &exact.s(k)[j * n..(j + 1) * n];
        for i in 0..n {
            let difference = (4.0 * narrow[i] - wide[i]) / 3.0;
            let size = difference.abs().max(part * exact.y(k)[i].abs() / p[j].abs().max(1e-3));
            assert!(
                (found[i] - difference).abs() <= close * size.max(least),
                "d({})/d(p[{j}]) = {} is not {difference}",
                system.signature().unknowns.name(i),
                found[i]
            );
        }
    }
}
