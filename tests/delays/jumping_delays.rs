//! Delays whose lengths jump, against closed forms.
//!
//! x = e^−kt, and 1 before the start, is read a time τ ago, which is constant between jumps. With I(a) = ∫₀ᵃ x, a reading
//! z of ż = x(t − τ) grows by I(b − τ) − I(a − τ) from a to b.

use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    InputColumn, Inputs, METHODS, Observations, Options, Problem, Solution, SolvableSystem, System,
    observe, simulate, simulate_with_sensitivities,
};

use crate::inline::system;

fn options(tolerance: f64) -> Options {
    Options { rtol: tolerance, atol: tolerance, ..Options::default() }
}

#[track_caller]
fn run(
    system: &impl SolvableSystem,
    p: &[f64],
    inputs: &Inputs,
    times: &[f64],
) -> (Solution, Observations) {
    let problem = Problem { system, p, inputs, start: &[] };
    let solution =
        simulate_with_sensitivities(&problem, times, &options(1e-11)).expect("a solution");
    let observed = observe(&problem, &solution);
    (solution, observed)
}

/// Local errors of the tolerance add up over some hundred steps.
const CLOSE: f64 = 1e-8;

#[track_caller]
fn close(what: &str, t: f64, found: f64, expected: f64) {
    let allowed = CLOSE * expected.abs().max(1.0);
    assert!((found - expected).abs() <= allowed, "{what} at {t}: {found}, expected {expected}");
}

/// x and I at a time.
fn decay(k: f64, at: f64) -> [f64; 2] {
    if at <= 0.0 { [1.0, at] } else { [(-k * at).exp(), -(-k * at).exp_m1() / k] }
}

/// x(t − τ) and z, for jumps at these times, ascending from 0, to these lengths.
fn read(t: f64, k: f64, jumps: &[[f64; 2]]) -> [f64; 2] {
    let (mut late, mut z) = (0.0, 0.0);
    for (i, [begin, tau]) in jumps.iter().enumerate() {
        if *begin > t {
            break;
        }
        let end = jumps.get(i + 1).map_or(t, |next| next[0].min(t));
        z += decay(k, end - tau)[1] - decay(k, begin - tau)[1];
        late = decay(k, end - tau)[0];
    }
    [late, z]
}

/// The model with the rest of its text, which gives `length`.
fn model(rest: &str) -> InterpretedSystem {
    system(&format!(
        "model late
         parameter k [1/s] = 0.3
         parameter d [s] = 0.1
         state x = 1 fixed
         state z [s] = 0 fixed
         equation x: der(x) = -k*x
         equation z: der(z) = delay(x, length + d)
         output late = delay(x, length + d)
         output ratio = x/delay(x, length + d)
         {rest}"
    ))
}

/// Values and derivatives of z and of the outputs, where the lengths jump as told for parameters. Rows at jumps are
/// those that follow.
#[track_caller]
fn verify<const P: usize>(
    system: &InterpretedSystem,
    inputs: &Inputs,
    p: [f64; P],
    times: &[f64],
    jumps: impl Fn([f64; P]) -> Vec<[f64; 2]>,
) {
    let (solution, observed) = run(system, &p, inputs, times);
    let reading = |t: f64, p: [f64; P]| {
        let jumps: Vec<[f64; 2]> = jumps(p).iter().map(|[t, tau]| [*t, tau + p[1]]).collect();
        read(t, p[0], &jumps)
    };
    let z = 1;
    for (row, &t) in times.iter().enumerate() {
        let [late, sum] = reading(t, p);
        close("z", t, solution.y(row)[z], sum);
        close("late", t, observed.w(row)[0], late);
        close("ratio", t, observed.w(row)[1], (-p[0] * t).exp() / late);
        for j in 0..P {
            let slope = |h: f64, of: usize| {
                let moved = |h: f64| {
                    let mut p = p;
                    p[j] += h;
                    reading(t, p)[of]
                };
                (moved(h) - moved(-h)) / (2.0 * h)
            };
            let expected = |of| (4.0 * slope(5e-4, of) - slope(1e-3, of)) / 3.0;
            close(&format!("dz/dp{j}"), t, solution.s(row)[j * solution.n + z], expected(1));
            // Differences reach across a jump at this time.
            if jumps(p).iter().all(|jump| (jump[0] - t).abs() > 1e-2) {
                close(&format!("dlate/dp{j}"), t, observed.dw(row)[2 * j], expected(0));
            }
        }
    }
}

/// Times between those of a grid, on which nothing jumps.
fn between(until: f64) -> Vec<f64> {
    let grid = (0..).map(|k| 0.37 * f64::from(k)).take_while(|t| *t < until);
    grid.chain([until]).collect()
}

fn held(system: &InterpretedSystem, stamps: &[f64], values: &[f64]) -> Inputs {
    let interpolation = system.signature().inputs[0].interpolation;
    Inputs::recorded(stamps, &[InputColumn { name: "w", interpolation, values }]).expect("inputs")
}

/// Longer, shorter, to before the start, to nothing but d.
const LENGTHS: [f64; 10] = [1.0, 2.5, 0.4, 7.0, 3.0, 0.0, 0.0, 1.7, 4.0, 4.0];

#[test]
fn a_length_that_an_input_gives() {
    let system = model("input w [s] hold\nlet length = w");
    let stamps: Vec<f64> = (0..10).map(f64::from).collect();
    let inputs = held(&system, &stamps, &LENGTHS);
    let jumps = |_: [f64; 2]| stamps.iter().copied().zip(LENGTHS).map(|(t, w)| [t, w]).collect();
    for times in [between(9.0), stamps.clone()] {
        verify(&system, &inputs, [0.3, 0.1], &times, jumps);
    }
}

/// The present itself, where there is no delay.
#[test]
fn a_length_that_jumps_to_nothing() {
    let system = model("input w [s] hold\nlet length = w");
    let stamps: Vec<f64> = (0..10).map(f64::from).collect();
    let inputs = held(&system, &stamps, &LENGTHS);
    let problem = Problem { system: &system, p: &[0.3, 0.0], inputs: &inputs, start: &[] };
    let solution = simulate(&problem, &between(9.0), &options(1e-11)).expect("a solution");
    let jumps: Vec<[f64; 2]> = stamps.iter().copied().zip(LENGTHS).map(|(t, w)| [t, w]).collect();
    for (row, t) in between(9.0).into_iter().enumerate() {
        close("z", t, solution.y(row)[1], read(t, 0.3, &jumps)[1]);
    }
}

/// A `held` value that a clock sets, and one that an event does, at ln 2/k.
#[test]
fn a_length_that_is_reset() {
    let system = model(
        "held length [s] = 1
         held n = 0
         every 1.5 [s] { reset n = n + 1
                         reset length = if n > 2.5 then 0.2 [s] else (n + 1)*1.1 [s] }",
    );
    let lengths = [1.1, 2.2, 3.3, 0.2, 0.2, 0.2];
    let jumps = |_: [f64; 2]| {
        let ticks = (0..).map(|k| 1.5 * f64::from(k));
        ticks.zip(lengths).map(|(t, tau)| [t, tau]).collect()
    };
    verify(&system, &Inputs::none(), [0.3, 0.1], &between(8.0), jumps);
    let system = model(
        "parameter a = 0.5
         held length [s] = 2
         when x falls below a { reset length = 0.3 [s] + x*1 [s] }",
    );
    verify(&system, &Inputs::none(), [0.3, 0.1, 0.5], &between(8.0), |[k, _, a]: [f64; 3]| {
        vec![[0.0, 2.0], [-a.ln() / k, 0.3 + a]]
    });
}

/// Modes, each with a length of its own.
#[test]
fn a_length_of_a_mode() {
    let system = model(
        "parameter a = 0.5
         parameter far [s] = 3
         unknown length [s] = 1
         modes reading {
           near { equation length: length = 0.6 [s] }
           far  { equation length: length = far }
           near -> far when x falls below a
         }",
    );
    verify(&system, &Inputs::none(), [0.3, 0.1, 0.5, 3.0], &between(8.0), |[k, _, a, far]| {
        vec![[0.0, 0.6], [-a.ln() / k, far]]
    });
}

/// A condition on time, steps of time, and a condition on a state, within the length.
#[test]
fn a_length_with_conditions() {
    let system =
        model("parameter on [s] = 2.7\nlet length = if time > on then 1.9 [s] else 0.5 [s]");
    verify(&system, &Inputs::none(), [0.3, 0.1, 2.7], &between(8.0), |[_, _, on]: [f64; 3]| {
        vec![[0.0, 0.5], [on, 1.9]]
    });
    let system = model("let length = 0.7*floor(time/2 [s])*1 [s]");
    verify(&system, &Inputs::none(), [0.3, 0.1], &between(7.9), |_: [f64; 2]| {
        (0..4).map(|k| [2.0 * f64::from(k), 0.7 * f64::from(k)]).collect()
    });
    let system = model("parameter a = 0.5\nlet length = if x < a then 0.2 [s] else 2 [s]");
    verify(&system, &Inputs::none(), [0.3, 0.1, 0.5], &between(8.0), |[k, _, a]: [f64; 3]| {
        vec![[0.0, 2.0], [-a.ln() / k, 0.2]]
    });
}

/// Every method, at its usual tolerance, or its reason.
#[test]
fn methods_agree_on_a_length_that_jumps() {
    let system = model("input w [s] hold\nlet length = w");
    let stamps: Vec<f64> = (0..10).map(f64::from).collect();
    let inputs = held(&system, &stamps, &LENGTHS);
    let jumps: Vec<[f64; 2]> = stamps.iter().zip(LENGTHS).map(|(t, w)| [*t, w + 0.1]).collect();
    let mut n = 0;
    for method in METHODS {
        for times in [between(9.0), vec![0.0, 9.0]] {
            let problem = Problem { system: &system, p: &[0.3, 0.1], inputs: &inputs, start: &[] };
            let options = Options { method, ..options(1e-8) };
            let Ok(solution) = simulate(&problem, &times, &options) else { continue };
            n += 1;
            for (row, t) in times.iter().enumerate() {
                let (z, expected) = (solution.y(row)[1], read(*t, 0.3, &jumps)[1]);
                // Errors of all steps, which backward differentiation begins anew at each jump.
                let steps = solution.statistics.steps as f64;
                let allowed = 2e-8 * steps.sqrt().max(5.0) * (1.0 + expected.abs());
                let name = method.name;
                assert!((z - expected).abs() < allowed, "{name}: {z} for {expected} at {t}");
            }
        }
    }
    assert!(n >= 10, "{n}");
}

/// What x is read with where `length` is an unknown, with all that is known of it: τ and its derivatives.
#[track_caller]
fn verify_unknown(
    system: &InterpretedSystem,
    p: &[f64],
    times: &[f64],
    tau: impl Fn(f64, &[f64]) -> f64,
) {
    let reading = |t: f64, p: &[f64]| decay(p[0], t - tau(t, p))[0];
    let (_, observed) = run(system, p, &Inputs::none(), times);
    for (row, &t) in times.iter().enumerate() {
        close("late", t, observed.w(row)[0], reading(t, p));
        for j in 0..p.len() {
            let slope = |h: f64| {
                let moved = |h: f64| {
                    let mut p = p.to_vec();
                    p[j] += h;
                    reading(t, &p)
                };
                (moved(h) - moved(-h)) / (2.0 * h)
            };
            // Differences reach across the start.
            if (t - tau(t, p)).abs() > 1e-2 {
                let expected = (4.0 * slope(5e-4) - slope(1e-3)) / 3.0;
                let allowed = 1e-7 * expected.abs().max(1.0);
                let found = observed.dw(row)[observed.n_w * j];
                assert!((found - expected).abs() < allowed, "{j} at {t}: {found} {expected}");
            }
        }
    }
    let methods = METHODS.iter().filter(|method| !matches!(method.name, "tsit5" | "taylor"));
    for method in methods {
        let problem = Problem { system, p, inputs: &Inputs::none(), start: &[] };
        let options = Options { method, ..options(1e-8) };
        for times in [times.to_vec(), vec![times[0], times[times.len() - 1]]] {
            let solution = simulate(&problem, &times, &options).expect(method.name);
            let observed = observe(&problem, &solution);
            for (row, t) in times.iter().enumerate() {
                let (late, expected) = (observed.w(row)[0], reading(*t, p));
                let name = method.name;
                assert!((late - expected).abs() < 2e-7, "{name}: {late} for {expected} at {t}");
            }
        }
    }
}

fn root(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if (f(middle) > 0.0) == (f(high) > 0.0) { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

#[test]
fn a_length_that_is_an_unknown() {
    let rest = "state v [m/s] = 1
                equation v: der(v) = 0.3*cos(time/1 [s])/1 [s]*1 [m/s]
                parameter far [m] = 1.2
                unknown length [s] = 1
                equation length: length*v = far";
    verify_unknown(&model(rest), &[0.3, 0.1, 1.2], &between(9.0), |t, p| {
        p[2] / (1.0 + 0.3 * t.sin()) + p[1]
    });
    // From the reading itself.
    let rest = "parameter far [s] = 0.5
                unknown length [s] = 1
                equation length: length = far + 2 [s]*delay(x, length + d)";
    verify_unknown(&model(rest), &[0.3, 0.1, 0.5], &between(9.0), |t, p| {
        let length = root(0.0, 10.0, |tau| tau - p[2] - 2.0 * decay(p[0], t - tau - p[1])[0]);
        length + p[1]
    });
}

/// A delay of the solution reaches breaks that are nearly one, at the start and after a corner there.
#[test]
fn methods_agree_where_a_delay_of_the_solution_reaches_its_breaks() {
    let system = system(
        "model kept
         state x = 0.2
         state q = 0.3
         state y = 0
         equation x: der(x) = delay(x, 0.5 [s] + 0.2 [s]*x)/1 [s]
         equation q: der(q) = 0.3/1 [s]
         equation y: der(y) = min(max(q, 0.3), q)/1 [s]",
    );
    let problem = Problem { system: &system, p: &[], inputs: &Inputs::none(), start: &[] };
    for method in METHODS {
        let options = Options { method, ..options(1e-9) };
        let Ok(solution) = simulate(&problem, &[0.0, 1.2649], &options) else { continue };
        let x = solution.y(1)[0];
        assert!((x - 0.499_939_350_687).abs() < 1.5e-8, "{}: {x}", method.name);
    }
}
