//! Random index-1 DAEs with events: all methods come to the same solution, and none fails.
//!
//! A case is a model text: states that decay, are driven by a sine and couple weakly; algebraic
//! unknowns with dominant diagonals and a cubic; a pulse of a given onset and length; two modes that
//! drive the first state up to one threshold and down to another one, in some cases with a third
//! equation that is differential in one mode only, and with resets. Texts are compiled and interpreted
//! as the command line does it.
//!
//! # How near two runs must be
//!
//! Local errors of rtol |y| + atol are carried on by the solution's own dynamics. What they become is
//! what becomes of changes of start values, thresholds and forcing, so the run itself tells it by its
//! sensitivities:
//!
//! ```text
//!   κ = 1 + max over time and unknowns of Σⱼ |∂yᵢ/∂θⱼ|,    |y − y'| ≤ STEPS · rtol · κ · (1 + |y|)
//! ```
//!
//! with STEPS for the accumulation of local errors, and κ² for the sensitivities, which change with
//! what they are taken along. Where the bound is no longer small, or the run says that a threshold is
//! only touched, a case is set aside and counted.

use std::fmt::Write;

use dgd_runtime::{
    Inputs, Method, Options, Problem, Solution, System, find_method, simulate,
    simulate_with_sensitivities,
};

use crate::inline;
use crate::support::Noise;

const CASES: u64 = 2000;
/// Every so often sensitivities are compared, too.
const WITH_SENSITIVITIES: u64 = 10;
/// Local errors that may add up.
const STEPS: f64 = 100.0;
/// A bound larger than this says nothing.
const SMALL: f64 = 3e-2;
const UNTIL: f64 = 4.0;

/// Those of the catalogue that solve index-1 DAEs, and at which tolerances they are compared.
const COMPARED: &[(&str, f64)] =
    &[("rodas5p", 1e-6), ("rodas5p", 1e-8), ("kencarp4", 1e-6), ("bdf", 1e-6)];

/// A number between two others.
fn between(noise: &mut Noise, low: f64, high: f64) -> f64 {
    low + (high - low) * 0.5 * (noise.next() + 1.0)
}

/// The text of a case.
fn model(noise: &mut Noise) -> String {
    let below = |noise: &mut Noise, n: usize| (between(noise, 0.0, n as f64) as usize).min(n - 1);
    let n = 1 + below(noise, 3);
    let m = 1 + below(noise, 2);
    let inertia = below(noise, 2) == 1;
    let resets = below(noise, 2) == 1;
    let mut text = String::from("model random\n");
    for i in 1..=n {
        let _ = writeln!(text, "parameter s{i} = {}", between(noise, -0.5, 0.5));
    }
    let onset = between(noise, 0.2, 0.8 * UNTIL);
    let _ = writeln!(text, "constant onset [s] = {onset}");
    let _ = writeln!(text, "constant length [s] = {}", between(noise, 0.01, 0.5));
    let _ = writeln!(text, "parameter force = {}", between(noise, -1.0, 1.0));
    let _ = writeln!(text, "parameter high = {}", between(noise, 0.6, 1.0));
    let _ = writeln!(text, "parameter low = {}", between(noise, -1.0, -0.6));
    for i in 1..=n {
        let _ = writeln!(text, "state x{i} = s{i}  nominal 1");
    }
    for k in 1..=m {
        let _ = writeln!(text, "unknown z{k} = 0  nominal 1");
    }
    text.push_str("state v = 2  nominal 1\n");
    text.push_str("let pulse = if time > onset and time <= onset + length then force else 0\n");
    for i in 1..=n {
        let decay =
            between(noise, 0.3, 3.0) * if i > 1 && below(noise, 4) == 0 { 100.0 } else { 1.0 };
        let (omega, phase) = (between(noise, 0.5, 5.0), between(noise, 0.0, 3.0));
        let drive = if i == 1 { "1.5*v + pulse" } else { "0.3*v" };
        let other = 1 + below(noise, n);
        let z = 1 + below(noise, m);
        let weak = between(noise, -0.2, 0.2);
        let _ = writeln!(
            text,
            "equation e{i}: 1 [s] * der(x{i}) = {decay}*(0.2*sin({omega}*time/1 [s] + {phase}) - x{i}) + \
             {weak}*sin(x{other}) + 0.2*z{z} + {drive}"
        );
    }
    for k in 1..=m {
        let (diagonal, weak) = (between(noise, 1.0, 4.0), between(noise, -0.4, 0.4));
        let (x, z) = (1 + below(noise, n), 1 + below(noise, m));
        let _ = writeln!(
            text,
            "equation a{k}: 0 = {diagonal}*z{k} + 0.3*z{k}^3 + {weak}*sin(z{z}) - tanh(x{x}) - 0.2*pulse"
        );
    }
    let kept = between(noise, 0.5, 1.0);
    let reset = |x: usize| format!(" {{\n    reset x{x} = {kept}*x{x}\n  }}");
    let (up, down) = match (resets, n) {
        (true, 2..) => (reset(n), reset(2)),
        _ => (String::new(), String::new()),
    };
    let (rate, pull) = (between(noise, 1.0, 5.0), between(noise, 2.0, 3.0));
    let falling = if inertia {
        format!("1 [s] * der(v) = {rate}*(-{pull} - v)")
    } else {
        format!("v = -{pull} + 0.1*x1")
    };
    let _ = writeln!(
        text,
        "modes relay {{\n  rising {{ equation drive: v = {pull} - 0.1*x1 }}\n  falling {{ equation drive: {falling} }}\n  \
         rising -> falling when x1 rises above high{up}\n  falling -> rising when x1 falls below low{down}\n}}"
    );
    text
}

/// Names of the modes in the order in which they were entered.
fn sequence(solution: &Solution) -> Vec<&str> {
    solution.events.iter().map(|event| &*event.to).collect()
}

/// Whether an event of either run is so near to a sample that they may be on different sides.
fn at_an_event(a: &Solution, b: &Solution, k: usize) -> bool {
    let events = |solution: &Solution| {
        solution.events.iter().filter(|event| event.t <= solution.times[k]).count()
    };
    events(a) != events(b)
}

/// How changes are amplified along a run.
fn condition(solution: &Solution) -> f64 {
    let n = solution.n;
    let sum = |k: usize, i: usize| -> f64 {
        (0..solution.n_s).map(|j| solution.s(k)[j * n + i].abs()).sum()
    };
    let rows = (0..solution.len()).flat_map(|k| (0..n).map(move |i| (k, i)));
    1.0 + rows.map(|(k, i)| sum(k, i)).fold(0.0, f64::max)
}

/// What became of some cases.
#[derive(Default)]
struct Counts {
    /// Cases in which a threshold is only touched.
    touched: u64,
    /// Runs whose bound is not small.
    sensitive: u64,
    compared: u64,
    events: usize,
}

/// The methods compared; those that the catalogue does not have are left out.
fn methods() -> Vec<(&'static Method, f64)> {
    let known = |(name, rtol): &(&str, f64)| Some((find_method(name).ok()?, *rtol));
    COMPARED.iter().filter_map(known).collect()
}

/// Runs a case by all methods.
fn check(case: u64, counts: &mut Counts) {
    let text = model(&mut Noise::new(case));
    let system = inline::system(&text);
    let p: Vec<f64> = system.signature().parameters.iter().map(|x| x.value).collect();
    let problem = Problem { system: &system, p: &p, inputs: &Inputs::none(), start: &[] };
    let times: Vec<f64> = (0..=20).map(|k| UNTIL * f64::from(k) / 20.0).collect();
    let run_by = |method: &'static Method, rtol: f64, with: bool| {
        let options = Options { rtol, atol: rtol, method, ..Options::default() };
        let run = if with { simulate_with_sensitivities } else { simulate };
        run(&problem, &times, &options).unwrap_or_else(|failure| {
            panic!("case {case} by {} at {rtol:e}: {failure}\n{text}", method.name)
        })
    };
    let (usual, _) = methods()[0];
    // Two digits of the condition are enough.
    let rough = run_by(usual, 1e-4, true);
    if !rough.undefined.is_empty() {
        counts.touched += 1;
        return;
    }
    let with = case.is_multiple_of(WITH_SENSITIVITIES);
    let exact = run_by(usual, 1e-9, with);
    counts.events += exact.events.len();
    let kappa = condition(&rough);
    for (method, rtol) in methods() {
        let bound = STEPS * rtol * kappa;
        if bound > SMALL {
            counts.sensitive += 1;
            continue;
        }
        counts.compared += 1;
        let found = run_by(method, rtol, with);
        let label = || format!("case {case} by {} at {rtol:e}\n{text}", method.name);
        assert_eq!(sequence(&found), sequence(&exact), "{}", label());
        for (k, t) in times.iter().enumerate() {
            if at_an_event(&found, &exact, k) {
                continue;
            }
            let near = |what: &str, found: &[f64], exact: &[f64], bound: f64| {
                for (i, (value, expected)) in found.iter().zip(exact).enumerate() {
                    let allowed = bound * (1.0 + expected.abs());
                    // NaN is not near.
                    assert!(
                        (value - expected).abs() <= allowed,
                        "{what}[{i}] = {value} is not {expected} at {t} s within {allowed:e}, {}",
                        label()
                    );
                }
            };
            near("y", found.y(k), exact.y(k), bound);
            if with {
                near("s", found.s(k), exact.s(k), bound * kappa);
            }
        }
    }
}

#[test]
fn all_methods_come_to_the_same_solution() {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get() as u64);
    let some = |first: u64| {
        let mut counts = Counts::default();
        (first..CASES).step_by(threads as usize).for_each(|case| check(case, &mut counts));
        counts
    };
    let all: Vec<Counts> = std::thread::scope(|scope| {
        let running: Vec<_> = (0..threads).map(|first| scope.spawn(move || some(first))).collect();
        running.into_iter().map(|thread| thread.join().expect("no case fails")).collect()
    });
    let sum = |count: fn(&Counts) -> u64| all.iter().map(count).sum::<u64>();
    let (touched, sensitive, compared) =
        (sum(|c| c.touched), sum(|c| c.sensitive), sum(|c| c.compared));
    // Few models are set aside, and those compared have events.
    assert!(touched <= CASES / 50, "{touched} cases touch a threshold");
    assert!(sensitive <= compared / 20, "{sensitive} runs are too sensitive");
    let events: usize = all.iter().map(|counts| counts.events).sum();
    assert!(events >= 2 * CASES as usize, "{events} events in {CASES} cases");
}
