//! Unknowns that act late, in equations, against closed forms and other integrations.

use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    InputColumn, Inputs, Observations, Options, Problem, Solution, SolvableSystem, System, observe,
    simulate, simulate_with_sensitivities,
};

use crate::inline::system;

const TIGHT: f64 = 1e-11;

fn options() -> Options {
    Options { rtol: TIGHT, atol: TIGHT, ..Options::default() }
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

/// Local errors of the tolerance add up over some hundred steps of problems whose numbers, and
/// sensitivities, are near one.
const CLOSE: f64 = 1e-8;

#[track_caller]
fn close(what: &str, t: f64, found: f64, expected: f64) {
    let allowed = CLOSE * expected.abs().max(1.0);
    assert!((found - expected).abs() <= allowed, "{what} at {t}: {found}, expected {expected}");
}

/// u̇ = −k u(t − τ) with u = u₀ before and at the start, by steps:
/// u = u₀ Σ (−k)ʲ (t − (j − 1) τ)₊ʲ / j!, and its derivatives to k, τ and u₀.
fn decay(t: f64, [k, tau, u0]: [f64; 3]) -> [f64; 4] {
    let mut sums = [1.0, 0.0, 0.0];
    let mut factorial = 1.0;
    for j in 1..60_i32 {
        factorial *= f64::from(j);
        let since = t - f64::from(j - 1) * tau;
        if since <= 0.0 {
            break;
        }
        let (power, less) = (since.powi(j), f64::from(j) * since.powi(j - 1));
        sums[0] += (-k).powi(j) * power / factorial;
        sums[1] += -f64::from(j) * (-k).powi(j - 1) * power / factorial;
        sums[2] += (-k).powi(j) * less * -f64::from(j - 1) / factorial;
    }
    [u0 * sums[0], u0 * sums[1], u0 * sums[2], sums[0]]
}

/// A model of that decay, with the rest of its text.
fn decaying(rest: &str) -> InterpretedSystem {
    let head = "
model decay
parameter k   [1/s] = 1
parameter tau [s]   = 1
parameter u_0 [1]   = 1
state u [1] = u_0";
    system(&[head, rest].concat())
}

#[test]
fn a_decay_that_acts_late() {
    let system = decaying("\nequation decay: der(u) = -k*delay(u, tau)\n");
    let times: Vec<f64> = (0..=101).map(|k| 0.1 * f64::from(k) + 0.003).collect();
    let times = [&[0.0], &times[..]].concat();
    for p in [[1.0, 1.0, 1.0], [0.7, 1.3, 2.0], [2.0, 0.3, 0.5], [1.0, 100.0, 1.0]] {
        let (solution, _) = run(&system, &p, &Inputs::none(), &times);
        for (k, &t) in times.iter().enumerate() {
            let [u, by_k, by_tau, by_start] = decay(t, p);
            close("u", t, solution.y(k)[0], u);
            close("du/dk", t, solution.s(k)[0], by_k);
            close("du/dtau", t, solution.s(k)[1], by_tau);
            close("du/du_0", t, solution.s(k)[2], by_start);
        }
    }
}

/// (t − mτ)₊ⁿ/n! and its derivative to τ.
fn power(t: f64, tau: f64, n: i32, m: i32) -> [f64; 2] {
    let since = t - f64::from(m) * tau;
    if since < 0.0 {
        return [0.0, 0.0];
    }
    let less = (1..n).fold(1.0, |value, j| value * since / f64::from(j));
    let value = if n == 0 { 1.0 } else { less * since / f64::from(n) };
    [value, if n == 0 { 0.0 } else { -f64::from(m) * less }]
}

/// The same, u = h₀ before the start and u₀ at it: with Pₙₘ = (t − mτ)₊ⁿ/n!,
/// u = u₀ Σ (−k)ʲ Pⱼⱼ + h₀ Σ (−k)ʲ⁺¹ (P₍ⱼ₊₁₎ⱼ − P₍ⱼ₊₁₎₍ⱼ₊₁₎), and the derivatives to k, τ, u₀ and h₀.
fn decay_from_a_jump(t: f64, [k, tau, u0, h0]: [f64; 4]) -> [f64; 5] {
    let mut sums = [0.0; 5];
    for j in 0..60 {
        let n = f64::from(j);
        let own = power(t, tau, j, j);
        let [a, b] = [power(t, tau, j + 1, j), power(t, tau, j + 1, j + 1)];
        let before = [a[0] - b[0], a[1] - b[1]];
        let (c, c_before) = ((-k).powi(j), (-k).powi(j + 1));
        sums[0] += u0 * c * own[0] + h0 * c_before * before[0];
        let by_k = if j == 0 { 0.0 } else { -n * (-k).powi(j - 1) };
        sums[1] += u0 * by_k * own[0] - h0 * (n + 1.0) * c * before[0];
        sums[2] += u0 * c * own[1] + h0 * c_before * before[1];
        sums[3] += c * own[0];
        sums[4] += c_before * before[0];
    }
    sums
}

const FROM_A_JUMP: &str = "
model decay
parameter k   [1/s] = 1
parameter tau [s]   = 1
parameter u_0 [1]   = 1
parameter h_0 [1]   = 0
state u [1] = u_0  history h_0
equation decay: der(u) = -k*delay(u, tau)
";

#[test]
fn a_history_of_its_own_jumps_at_the_start() {
    let system = system(FROM_A_JUMP);
    let times: Vec<f64> = (0..=101).map(|k| 0.1 * f64::from(k) + 0.003).collect();
    let times = [&[0.0], &times[..]].concat();
    for p in [[1.0, 1.0, 1.0, 0.0], [0.7, 1.3, 2.0, 0.5], [2.0, 0.3, 0.5, -1.0]] {
        let (solution, _) = run(&system, &p, &Inputs::none(), &times);
        for (k, &t) in times.iter().enumerate() {
            let expected = decay_from_a_jump(t, p);
            close("u", t, solution.y(k)[0], expected[0]);
            for j in 0..4 {
                close(&format!("du/dp{j}"), t, solution.s(k)[j], expected[j + 1]);
            }
        }
    }
}

/// The published values at every tenth of a second: breaks among them.
#[test]
fn the_published_solution_with_one_delay() {
    let system = system(FROM_A_JUMP);
    let times: Vec<f64> = (0..=50).map(|k| 0.1 * f64::from(k)).collect();
    let problem =
        Problem { system: &system, p: &[1.0, 1.0, 1.0, 0.0], inputs: &Inputs::none(), start: &[] };
    let solution = simulate(&problem, &times, &options()).expect("a solution");
    for (t, expected) in [(1.5, 0.5), (2.0, 0.0), (2.5, -0.375), (3.0, -0.5)] {
        let k = times.iter().position(|other| (other - t).abs() < 1e-9).expect("a time");
        close("u", t, solution.y(k)[0], expected);
    }
    for (k, &t) in times.iter().enumerate() {
        close("u", t, solution.y(k)[0], decay_from_a_jump(t, [1.0, 1.0, 1.0, 0.0])[0]);
    }
}

/// With no delay, u = u₀ e^−kt; the delay sets in with du/dτ(0) = k (u₀ − h₀) and goes on by −k u̇.
#[test]
fn no_delay_has_a_derivative() {
    let system = system(FROM_A_JUMP);
    let times: Vec<f64> = (0..=40).map(|k| 0.1 * f64::from(k)).collect();
    let [k, u0, h0] = [0.8, 1.5, 0.25];
    let (solution, _) = run(&system, &[k, 0.0, u0, h0], &Inputs::none(), &times);
    for (row, &t) in times.iter().enumerate() {
        let fading = (-k * t).exp();
        close("u", t, solution.y(row)[0], u0 * fading);
        close("du/dk", t, solution.s(row)[0], -t * u0 * fading);
        // At the start itself nothing has been read yet.
        let by_tau = k * (u0 - h0) * fading - k * k * t * u0 * fading;
        close("du/dtau", t, solution.s(row)[1], by_tau);
        close("du/du_0", t, solution.s(row)[2], fading);
        close("du/dh_0", t, solution.s(row)[3], 0.0);
    }
}

/// x = 1 − c e^−t, sampled late at 0, T, 2T …: nothing changes before the start, so that a sample of that time does not
/// depend on τ.
#[test]
fn a_late_sample_at_the_start_does_not_depend_on_the_delay() {
    let system = system(
        "model sampled\nparameter tau [s] = 0.46\nstate x [1] = -0.8\n\
         equation x: der(x) = (1 - x)/1 [s]\nheld z [1] = 0.68\n\
         every 0.2 [s] { reset z = delay(x, tau) }\n",
    );
    let times: Vec<f64> = (0..=20).map(|k| 0.05 * f64::from(k) + 0.01).collect();
    let (solution, _) = run(&system, &[0.46], &Inputs::none(), &[&[0.0], &*times].concat());
    let unknowns = &system.signature().unknowns;
    let z = (0..solution.n).find(|i| unknowns.name(*i) == "z").expect("it is held");
    for (row, &t) in [0.0].iter().chain(&times).enumerate() {
        let read = (t / 0.2).floor() * 0.2 - 0.46;
        let [value, slope] = match read {
            ..=0.0 => [-0.8, 0.0],
            _ => [1.0 - 1.8 * (-read).exp(), -1.8 * (-read).exp()],
        };
        close("z", t, solution.y(row)[z], value);
        close("dz/dtau", t, solution.s(row)[z], slope);
    }
}

#[test]
fn no_delay_is_no_delay_to_the_bit() {
    let model = |reading: &str| {
        system(&format!(
            "
model pair
parameter tau [s] = 0
state x [1] = 1
unknown q [1] = 0.5
equation x: 1 [s] * der(x) = -x*{reading}
equation q: q*q*q + q = x
"
        ))
    };
    let times: Vec<f64> = (0..=20).map(|k| 0.1 * f64::from(k)).collect();
    let solve = |system| {
        let problem = Problem { system, p: &[0.0], inputs: &Inputs::none(), start: &[] };
        simulate(&problem, &times, &options()).expect("a solution").y
    };
    let (plain, late) = (model("q"), model("delay(q, tau)"));
    assert_eq!(solve(&plain), solve(&late));
    let problem = Problem { system: &late, p: &[0.0], inputs: &Inputs::none(), start: &[] };
    let failure = simulate_with_sensitivities(&problem, &times, &options()).expect_err("no slope");
    assert!(failure.to_string().contains("`delay(q, tau)` is 0 s late"), "{failure}");
    for (tau, shown) in [(-2.0, "-2 s"), (f64::NAN, "NaN s")] {
        let problem = Problem { system: &late, p: &[tau], inputs: &Inputs::none(), start: &[] };
        let failure = simulate(&problem, &times, &options()).expect_err("no such past");
        let message = failure.to_string();
        assert!(message.contains("`delay(q, tau)`") && message.contains(shown), "{message}");
    }
}

/// The same decay where what acts late is algebraic.
#[test]
fn an_algebraic_unknown_acts_late() {
    let system = decaying(
        "
unknown q [1/s] = 0
equation decay: der(u) = -delay(q, tau)
equation rate:  q = k*u
",
    );
    let times: Vec<f64> = (0..=50).map(|k| 0.1 * f64::from(k) + 0.003).collect();
    let times = [&[0.0], &times[..]].concat();
    let p = [0.7, 1.3, 2.0];
    let (solution, _) = run(&system, &p, &Inputs::none(), &times);
    for (k, &t) in times.iter().enumerate() {
        let [u, by_k, by_tau, by_start] = decay(t, p);
        let (y, s) = (solution.y(k), solution.s(k));
        close("u", t, y[0], u);
        close("q", t, y[1], p[0] * u);
        close("du/dk", t, s[0], by_k);
        close("dq/dk", t, s[1], u + p[0] * by_k);
        close("du/dtau", t, s[2], by_tau);
        close("du/du_0", t, s[4], by_start);
    }
}

/// The same decay in two halves of the delay, the first of which an algebraic unknown reads: before the start
/// nothing moves, so that its start value does not depend on τ, nor what reads it.
#[test]
fn an_algebraic_unknown_reads_late_and_acts_late() {
    let system = decaying(
        "
unknown q [1/s] = 0
equation decay: der(u) = -delay(q, tau/2)
equation rate:  q = k*delay(u, tau/2)
output far [1] = delay(u + q * 1 [s], tau)
",
    );
    // Until u has a degree that the method integrates exactly and its dense output does not.
    let times: Vec<f64> = (0..=42).map(|k| 0.1 * f64::from(k) + 0.003).collect();
    let times = [&[0.0], &times[..]].concat();
    let p = [0.7, 1.3, 2.0];
    let [k_0, tau, u_0] = p;
    let (solution, observed) = run(&system, &p, &Inputs::none(), &times);
    // u(t − part τ), and its derivatives to k and τ.
    let late = |t: f64, part: f64| {
        let at = t - part * tau;
        if at <= 0.0 {
            return [u_0, 0.0, 0.0];
        }
        let [u, by_k, by_tau, _] = decay(at, p);
        let rate = -k_0 * decay((at - tau).max(0.0), p)[0];
        [u, by_k, by_tau - part * rate]
    };
    for (k, &t) in times.iter().enumerate() {
        let (y, s) = (solution.y(k), solution.s(k));
        let [[u, by_k, by_tau], [q, q_by_k, q_by_tau]] = [late(t, 0.0), late(t, 0.5)];
        close("u", t, y[0], u);
        close("q", t, y[1], k_0 * q);
        close("du/dk", t, s[0], by_k);
        close("dq/dk", t, s[1], q + k_0 * q_by_k);
        close("du/dtau", t, s[2], by_tau);
        close("dq/dtau", t, s[3], k_0 * q_by_tau);
        let [[u, by_k, by_tau], [q, q_by_k, q_by_tau]] = [late(t, 1.0), late(t, 1.5)];
        close("far", t, observed.w(k)[0], u + k_0 * q);
        close("dfar/dk", t, observed.dw(k)[0], by_k + q + k_0 * q_by_k);
        close("dfar/dtau", t, observed.dw(k)[1], by_tau + k_0 * q_by_tau);
    }
}

/// ẋ = −a x(t − r) − b x(t − s) + u(t − c), x = 0 before the start and 1 at it: a fundamental solution
/// X = Σ (−a)ⁱ (−b)ʲ C(i+j, i) (t − i r − j s)₊ⁱ⁺ʲ/(i+j)!, and Δu ∫ X from where the input steps.
#[test]
fn two_delays_and_an_input_that_steps() {
    let system = system(
        "
model pair
input u [1/s] hold
parameter a [1/s] = 0.9
parameter b [1/s] = 0.6
parameter r [s]   = 0.5
parameter s [s]   = 0.7
parameter c [s]   = 0.3
state x [1] = 1  history 0
equation x: der(x) = delay(u, c) - a*delay(x, r) - b*delay(x, s)
",
    );
    let solution_at = |t: f64, [a, b, r, s, c]: [f64; 5]| {
        let sum = |t: f64, more: i32| {
            let mut sum = 0.0;
            for i in 0..40 {
                let mut binomial = 1.0;
                for j in 0..40 {
                    if j > 0 {
                        binomial *= f64::from(i + j) / f64::from(j);
                    }
                    let since = t - f64::from(i) * r - f64::from(j) * s;
                    if since < 0.0 {
                        break;
                    }
                    let n = i + j + more;
                    let power = (1..=n).fold(1.0, |value, l| value * since / f64::from(l));
                    sum += (-a).powi(i) * (-b).powi(j) * binomial * power;
                }
            }
            sum
        };
        sum(t, 0) + 0.4 * sum(t - 1.0 - c, 1) - 0.7 * sum(t - 2.5 - c, 1)
    };
    let columns = [InputColumn {
        name: "u",
        interpolation: system.signature().inputs[0].interpolation,
        values: &[0.0, 0.4, -0.3, -0.3],
    }];
    let inputs = Inputs::recorded(&[0.0, 1.0, 2.5, 9.0], &columns).expect("inputs");
    let times: Vec<f64> = (0..=60).map(|k| 0.1 * f64::from(k) + 0.043).collect();
    let times = [&[0.0], &times[..]].concat();
    let p = [0.9, 0.6, 0.5, 0.7, 0.3];
    let (solution, _) = run(&system, &p, &inputs, &times);
    for (k, &t) in times.iter().enumerate() {
        close("x", t, solution.y(k)[0], solution_at(t, p));
        for j in 0..5 {
            // Differences of the closed form, two sizes extrapolated: h⁴ and rounding over h.
            let slope = |h: f64| {
                let moved = |h: f64| {
                    let mut p = p;
                    p[j] += h;
                    solution_at(t, p)
                };
                (moved(h) - moved(-h)) / (2.0 * h)
            };
            let expected = (4.0 * slope(5e-4) - slope(1e-3)) / 3.0;
            close(&format!("dx/dp{j}"), t, solution.s(k)[j], expected);
        }
    }
}

/// A heater that is switched by what a sensor saw a time τ ago: x rises as 2 − (2 − x) e^−t and falls
/// as x e^−t; a crossing of 1 or of b at s switches at s + τ.
#[test]
fn a_late_threshold() {
    let system = system(
        "
model thermostat
parameter tau [s] = 0.3
parameter b   [1] = 0.5
state x [1] = 0
modes heater {
  on  { equation x: 1 [s] * der(x) = 2 - x }
  off { equation x: 1 [s] * der(x) = -x }
  on  -> off when delay(x, tau) rises above 1
  off -> on  when delay(x, tau) falls below b
}
",
    );
    let solution_at = |t: f64, [tau, b]: [f64; 2]| {
        let (mut since, mut x, mut heating) = (0.0, 0.0_f64, true);
        loop {
            let switch =
                if heating { since + (2.0 - x).ln() + tau } else { since + (x / b).ln() + tau };
            let along = |t: f64| {
                let fading = (since - t).exp();
                if heating { 2.0 - (2.0 - x) * fading } else { x * fading }
            };
            if switch > t {
                return along(t);
            }
            x = along(switch);
            (since, heating) = (switch, !heating);
        }
    };
    let times: Vec<f64> = (0..=60).map(|k| 0.1 * f64::from(k)).collect();
    let p = [0.3, 0.5];
    let (solution, _) = run(&system, &p, &Inputs::none(), &times);
    assert!(solution.events.len() >= 4, "{:?}", solution.events);
    for (k, &t) in times.iter().enumerate() {
        close("x", t, solution.y(k)[0], solution_at(t, p));
        for j in 0..2 {
            let slope = |h: f64| {
                let moved = |h: f64| {
                    let mut p = p;
                    p[j] += h;
                    solution_at(t, p)
                };
                (moved(h) - moved(-h)) / (2.0 * h)
            };
            let expected = (4.0 * slope(5e-4) - slope(1e-3)) / 3.0;
            close(&format!("dx/dp{j}"), t, solution.s(k)[j], expected);
        }
    }
}

/// A jump at an event, read late: x = e^−t falls to a at t_e = −ln a, jumps to c and stays; then
/// ẏ = x(t − τ) − y.
#[test]
fn a_jump_at_an_event_is_read_late() {
    let system = system(
        "
model jump
parameter a   [1] = 0.5
parameter c   [1] = 2
parameter tau [s] = 0.4
state x [1] = 1
state y [1] = 1
modes x {
  falling { equation x: 1 [s] * der(x) = -x }
  staying { equation x: der(x) = 0 }
  falling -> staying when x falls below a { reset x = c }
}
equation y: 1 [s] * der(y) = delay(x, tau) - y
",
    );
    let solution_at = |t: f64, [a, c, tau]: [f64; 3]| {
        let jump = -a.ln() + tau;
        let until = |t: f64| {
            // 1 while the past is the start, then (1 + s) e^−s.
            let s = (t - tau).max(0.0);
            (1.0 + s) * (-s).exp()
        };
        if t < jump { until(t) } else { c + (until(jump) - c) * (jump - t).exp() }
    };
    let times: Vec<f64> = (0..=40).map(|k| 0.1 * f64::from(k) + 0.02).collect();
    let times = [&[0.0], &times[..]].concat();
    let p = [0.5, 2.0, 0.4];
    let (solution, _) = run(&system, &p, &Inputs::none(), &times);
    for (k, &t) in times.iter().enumerate() {
        close("y", t, solution.y(k)[1], solution_at(t, p));
        for j in 0..3 {
            let slope = |h: f64| {
                let moved = |h: f64| {
                    let mut p = p;
                    p[j] += h;
                    solution_at(t, p)
                };
                (moved(h) - moved(-h)) / (2.0 * h)
            };
            let expected = (4.0 * slope(5e-4) - slope(1e-3)) / 3.0;
            close(&format!("dy/dp{j}"), t, solution.s(k)[2 * j + 1], expected);
        }
    }
}

/// DDETST B1: u̇ = 1 − u(e^(1 − 1/t)), u = ln t; at t = 1 the delay is nothing.
#[test]
fn a_delay_that_vanishes_on_the_way() {
    let system = system(
        "
model b1
parameter scale [1] = 1
state u [1] = log(0.1)  history log(time / 1 [s])
equation u: 1 [s] * der(u) = 1 - delay(u, time - exp(1 - 1 [s] / time) * 1 [s])*scale
",
    );
    let times: Vec<f64> = (1..=100).map(|k| 0.1 * f64::from(k)).collect();
    let (solution, _) = run(&system, &[1.0], &Inputs::none(), &times);
    for (k, &t) in times.iter().enumerate() {
        close("u", t, solution.y(k)[0], t.ln());
    }
}

/// DDETST B2: u̇ = 1 − u where u(t/2) < 0, otherwise −1 − u.
#[test]
fn a_threshold_at_half_the_time() {
    let system = system(
        "
model b2
parameter u_0 [1] = 1
state u [1] = u_0
modes half {
  above { equation u: 1 [s] * der(u) = -1 - u }
  below { equation u: 1 [s] * der(u) = 1 - u }
  above -> below when delay(u, time/2) falls below 0
  below -> above when delay(u, time/2) rises above 0
}
",
    );
    // u = (1 + u₀) e^−t − 1 is zero at ln(1 + u₀) = a; u = 1 + (u(2a) − 1) e^(2a−t) at b.
    let solution_at = |t: f64, u0: f64| {
        let a = (1.0 + u0).ln();
        let first = |t: f64| (1.0 + u0) * (-t).exp() - 1.0;
        let second = |t: f64| 1.0 + (first(2.0 * a) - 1.0) * (2.0 * a - t).exp();
        let b = 2.0 * a + (1.0 - first(2.0 * a)).ln();
        if t < 2.0 * a {
            first(t)
        } else if t < 2.0 * b {
            second(t)
        } else {
            (1.0 + second(2.0 * b)) * (2.0 * b - t).exp() - 1.0
        }
    };
    let times: Vec<f64> = (0..=50).map(|k| 0.1 * f64::from(k)).collect();
    let (solution, _) = run(&system, &[1.0], &Inputs::none(), &times);
    assert_eq!(solution.events.len(), 2);
    for (event, expected) in solution.events.iter().zip([2.0, 6.0]) {
        close("event", expected, event.t, 2.0 * f64::ln(expected));
    }
    for (k, &t) in times.iter().enumerate() {
        close("u", t, solution.y(k)[0], solution_at(t, 1.0));
        let slope = |h: f64| (solution_at(t, 1.0 + h) - solution_at(t, 1.0 - h)) / (2.0 * h);
        close("du/du_0", t, solution.s(k)[0], (4.0 * slope(5e-4) - slope(1e-3)) / 3.0);
    }
}

/// DDETST D1: a delay that the solution itself makes, u₁ = ln t, u₂ = 1/t.
#[test]
fn a_delay_that_depends_on_the_solution() {
    let system = system(
        "
model d1
parameter scale [1] = 1
state u1 [1] = log(0.1)  history log(time / 1 [s])
state u2 [1] = 10        history 1 [s] / time
let tau = time - exp(1 - u2) * 1 [s]
equation u1: 1 [s] * der(u1) = scale*u2
equation u2: 1 [s] * der(u2) = -delay(u2, tau)*u2^2*exp(1 - u2)
",
    );
    let times: Vec<f64> = (1..=50).map(|k| 0.1 * f64::from(k)).collect();
    let (solution, _) = run(&system, &[1.0], &Inputs::none(), &times);
    for (k, &t) in times.iter().enumerate() {
        close("u1", t, solution.y(k)[0], t.ln());
        close("u2", t, solution.y(k)[1], 1.0 / t);
    }
}

/// Compares sensitivities with differences of a closed form, two sizes extrapolated: h⁴ and rounding
/// over h.
#[track_caller]
fn close_to_differences<const P: usize>(
    t: f64,
    found: impl Fn(usize) -> f64,
    solution_at: impl Fn(f64, [f64; P]) -> f64,
    p: [f64; P],
) {
    for j in 0..P {
        let slope = |h: f64| {
            let moved = |h: f64| {
                let mut p = p;
                p[j] += h;
                solution_at(t, p)
            };
            (moved(h) - moved(-h)) / (2.0 * h)
        };
        let expected = (4.0 * slope(5e-4) - slope(1e-3)) / 3.0;
        close(&format!("direction {j}"), t, found(j), expected);
    }
}

/// u̇ = −k u(α) with α = (1 − c) t − τ₀, from u₀ behind a history h₀: the jump at the start comes at
/// t_b = τ₀/(1 − c), where the slope jumps, and u is a parabola until that comes in turn. The delay
/// depends on the time, or on a clock that is a state.
#[test]
fn a_break_that_moves_with_a_delay_that_varies() {
    let model = |clock: &str| {
        system(&format!(
            "
model growing
parameter k     [1/s] = 0.7
parameter tau_0 [s]   = 1
parameter c     [1]   = 0.5
parameter u_0   [1]   = 1.5
parameter h_0   [1]   = 0.25
state u     [1] = u_0  history h_0
state clock [s] = 0
equation u: der(u) = -k*delay(u, tau_0 + c*{clock})
equation clock: der(clock) = 1
"
        ))
    };
    let solution_at = |t: f64, [k, tau, c, u0, h0]: [f64; 5]| {
        let begun = tau / (1.0 - c);
        let line = |t: f64| u0 - k * h0 * t;
        if t < begun {
            return line(t);
        }
        let since = (1.0 - c) * t - tau;
        line(begun) - k * (u0 * (t - begun) - k * h0 * since * since / (2.0 * (1.0 - c)))
    };
    let times: Vec<f64> = (0..=58).map(|k| 0.1 * f64::from(k) + 0.05).collect();
    let times = [&[0.0], &times[..]].concat();
    let p = [0.7, 1.0, 0.5, 1.5, 0.25];
    for clock in ["time", "clock"] {
        let system = model(clock);
        let (solution, _) = run(&system, &p, &Inputs::none(), &times);
        for (k, &t) in times.iter().enumerate() {
            close("u", t, solution.y(k)[0], solution_at(t, p));
            close_to_differences(t, |j| solution.s(k)[2 * j], solution_at, p);
        }
    }
}

/// Values of x, ẋ, their derivatives to g and then to τ by Chebyshev collocation of order 40 on each
/// interval of length τ (numpy 2), the derivatives by extrapolated differences of it; two sizes of
/// them agree to 1e-11.
const OSCILLATOR: [(f64, [f64; 6]); 4] = [
    (
        1.0,
        [
            0.177_497_361_524_832,
            -0.591_825_226_739_811,
            -0.142_055_742_335,
            -0.285_293_799_090,
            0.098_513_154_094,
            0.121_048_018_154,
        ],
    ),
    (
        3.0,
        [
            -0.688_517_783_449_795,
            0.211_094_490_656_813,
            -0.387_536_323_200,
            0.501_591_449_559,
            -0.342_458_816_747,
            -0.572_407_107_760,
        ],
    ),
    (
        7.0,
        [
            -0.121_792_707_460_308,
            -1.248_884_668_188_7,
            -1.184_181_546_550,
            -1.945_181_331_042,
            1.655_542_378_316,
            -0.446_782_595_018,
        ],
    ),
    (
        10.0,
        [
            0.396_378_359_946_347,
            1.557_554_380_744_766,
            2.114_757_819_277,
            2.560_186_645_501,
            -2.825_256_872_428,
            1.354_597_092_223,
        ],
    ),
];

/// ẍ = −x − 0.3 ẋ − g tanh(x(t − τ)) with x = ½ cos t before the start.
#[test]
fn an_oscillator_with_late_feedback() {
    let system = system(
        "
model oscillator
parameter g   [1] = 0.8
parameter tau [s] = 1.1
state x [1] = 0.5  history 0.5*cos(time / 1 [s])
state v [1] = 0
equation x: 1 [s] * der(x) = v
equation v: 1 [s] * der(v) = -x - 0.3*v - g*tanh(delay(x, tau))
",
    );
    let times: Vec<f64> = [0.0].into_iter().chain(OSCILLATOR.map(|(t, _)| t)).collect();
    let (solution, _) = run(&system, &[0.8, 1.1], &Inputs::none(), &times);
    for (k, (t, expected)) in OSCILLATOR.into_iter().enumerate() {
        let found = [solution.y(k + 1), solution.s(k + 1)].concat();
        for (i, (found, expected)) in found.into_iter().zip(expected).enumerate() {
            close(&format!("number {i}"), t, found, expected);
        }
    }
}

/// ẋ = −k x(t − τ) − sin t + k cos(t − τ) with x = cos t before: x = cos t for ever, so long that most
/// of the past has been dropped.
#[test]
fn a_long_run_forgets_what_no_delay_reaches() {
    let system = system(
        "
model driven
parameter k   [1] = 1
parameter tau [s] = 0.05
let t = time / 1 [s]
state x [1] = 1  history cos(t)
equation x: 1 [s] * der(x) = -k*delay(x, tau) - sin(t) + k*cos(t - tau / 1 [s])
",
    );
    let times: Vec<f64> = (0..=300).map(f64::from).collect();
    let problem = Problem { system: &system, p: &[1.0, 0.05], inputs: &Inputs::none(), start: &[] };
    let solution = simulate(&problem, &times, &options()).expect("a solution");
    assert!(solution.statistics.steps > 5000, "{:?}", solution.statistics);
    for (k, &t) in times.iter().enumerate() {
        close("x", t, solution.y(k)[0], t.cos());
    }
}

/// What jumps with an input that arrives late, an algebraic unknown, acts later still: x = Δu (t − 1 −
/// c − τ)₊.
#[test]
fn a_jump_that_moves_is_read_late() {
    let system = system(
        "
model chain
input u [1/s] hold
parameter c   [s] = 0.4
parameter tau [s] = 0.7
state x [1] = 0
unknown q [1/s] = 0
equation q: q = delay(u, c)
equation x: der(x) = delay(q, tau)
",
    );
    let columns = [InputColumn {
        name: "u",
        interpolation: system.signature().inputs[0].interpolation,
        values: &[0.0, 1.5, 1.5],
    }];
    let inputs = Inputs::recorded(&[0.0, 1.0, 9.0], &columns).expect("inputs");
    let solution_at = |t: f64, [c, tau]: [f64; 2]| 1.5 * (t - 1.0 - c - tau).max(0.0);
    let times: Vec<f64> = (0..=40).map(|k| 0.1 * f64::from(k) + 0.05).collect();
    let times = [&[0.0], &times[..]].concat();
    let p = [0.4, 0.7];
    let (solution, _) = run(&system, &p, &inputs, &times);
    for (k, &t) in times.iter().enumerate() {
        close("x", t, solution.y(k)[0], solution_at(t, p));
        close_to_differences(t, |j| solution.s(k)[2 * j], solution_at, p);
    }
}

/// ẋ = c ẋ(t − τ), a neutral equation, with ẋ = 1 before the start: slopes c, c², … on the intervals
/// of length τ.
#[test]
fn a_derivative_with_a_name_acts_late() {
    let system = system(
        "
model neutral
parameter c   [1] = 0.6
parameter tau [s] = 0.9
state x [m] = 1
unknown rate [m/s] = 1  history 1
equation rate: rate = der(x)
equation x: der(x) = c*delay(rate, tau)
",
    );
    let solution_at = |t: f64, [c, tau]: [f64; 2]| {
        let (mut x, mut t, mut slope) = (1.0, t, c);
        while t > tau {
            x += slope * tau;
            slope *= c;
            t -= tau;
        }
        x + slope * t
    };
    let times: Vec<f64> = (0..=40).map(|k| 0.1 * f64::from(k) + 0.05).collect();
    let times = [&[0.0], &times[..]].concat();
    let p = [0.6, 0.9];
    let (solution, _) = run(&system, &p, &Inputs::none(), &times);
    let (n, x) = (solution.n, 0);
    for (k, &t) in times.iter().enumerate() {
        close("x", t, solution.y(k)[x], solution_at(t, p));
        close_to_differences(t, |j| solution.s(k)[n * j + x], solution_at, p);
    }
}

/// An output of now and then, with its derivatives.
#[test]
fn an_output_reads_at_several_times() {
    let system = decaying(
        "
equation decay: der(u) = -k*delay(u, tau)
output change [1] = u - delay(u, tau)
output both   [1] = delay(u, tau)*delay(u, 2*tau)
",
    );
    let times: Vec<f64> = (0..=40).map(|k| 0.1 * f64::from(k) + 0.01).collect();
    let p = [0.7, 1.3, 2.0];
    let (_, observed) = run(&system, &p, &Inputs::none(), &[&[0.0], &times[..]].concat());
    let at = |t: f64, p: [f64; 3]| if t > 0.0 { decay(t, p)[0] } else { p[2] };
    for (k, &t) in times.iter().enumerate() {
        let change = |t: f64, p: [f64; 3]| at(t, p) - at(t - p[1], p);
        let both = |t: f64, p: [f64; 3]| at(t - p[1], p) * at(t - 2.0 * p[1], p);
        close("change", t, observed.w(k + 1)[0], change(t, p));
        close("both", t, observed.w(k + 1)[1], both(t, p));
        close_to_differences(t, |j| observed.dw(k + 1)[2 * j], change, p);
        close_to_differences(t, |j| observed.dw(k + 1)[2 * j + 1], both, p);
    }
}

/// The delay that made a record is found from it: Gauss–Newton with the sensitivities to it.
#[test]
fn a_delay_is_found_from_what_it_does() {
    let system = system(
        "
model decay
parameter tau [s] = 1
state u [1] = 1
equation decay: 1 [s] * der(u) = -delay(u, tau)
",
    );
    let times: Vec<f64> = (0..=80).map(|k| 0.1 * f64::from(k)).collect();
    let data: Vec<f64> = times.iter().map(|t| decay(*t, [1.0, 1.234, 1.0])[0]).collect();
    let mut tau = 0.9;
    for _ in 0..8 {
        let (solution, _) = run(&system, &[tau], &Inputs::none(), &times);
        let (mut normal, mut right) = (0.0, 0.0);
        for (k, measured) in data.iter().enumerate() {
            let slope = solution.s(k)[0];
            normal += slope * slope;
            right += slope * (measured - solution.y(k)[0]);
        }
        tau += right / normal;
    }
    assert!((tau - 1.234).abs() < 1e-8, "{tau}");
}

#[test]
fn a_delay_that_falls_below_zero_ends_the_run() {
    let system = system(
        "
model early
state u [1] = 1
equation u: 1 [s] * der(u) = -delay(u, 1 [s] - time)
",
    );
    let times = [0.0, 0.5, 0.999, 2.0];
    let problem = Problem { system: &system, p: &[], inputs: &Inputs::none(), start: &[] };
    let failure = simulate(&problem, &times, &options()).expect_err("the future");
    assert!(failure.to_string().contains("the delay `1 - time` falls below zero"), "{failure}");
    assert_eq!(failure.partial.times, [0.0, 0.5, 0.999]);
}

/// Samples of every second, on their way through delays much longer than that, do not breed breaks:
/// some steps for each sample are enough.
#[test]
fn a_long_recording_does_not_breed_breaks() {
    let system = system(
        "
model far
input u [1/s] linear
parameter tau [s] = 12.3
state x [1] = 0
unknown q [1/s] = 0
equation q: q + 0.1 [1/s]*(q / 1 [1/s])^3 = delay(u, 3.1 [s]) - 0.05 [1/s]*x
equation x: der(x) = delay(q, tau) - 0.05 [1/s]*delay(x, 7.7 [s])
",
    );
    let stamps: Vec<f64> = (0..=300).map(f64::from).collect();
    let values: Vec<f64> = stamps.iter().map(|t| (0.3 * t).sin() + (1.1 * t).cos()).collect();
    let columns = [InputColumn {
        name: "u",
        interpolation: system.signature().inputs[0].interpolation,
        values: &values,
    }];
    let inputs = Inputs::recorded(&stamps, &columns).expect("inputs");
    let problem = Problem { system: &system, p: &[12.3], inputs: &inputs, start: &[] };
    let solution = simulate(&problem, &stamps, &Options::default()).expect("a solution");
    let steps = solution.statistics.steps;
    assert!(steps < 12 * stamps.len(), "{steps} steps");
}

/// The last stage of a step reads what lies behind that which rows within the step read, and as many
/// pieces as are dropped at once may have been made since.
#[test]
fn rows_within_a_step_read_what_they_need_of_a_long_history() {
    const ROWS: usize = 2500;
    let system = system(
        "model late
         parameter tau [s] = 1.5
         input u [1] linear
         state x [1] = 0
         output w [1/s] = der(x)
         equation e: der(x) = (u - delay(x, tau))/1 [s]",
    );
    let times: Vec<f64> = (0..ROWS).map(|k| k as f64).collect();
    let values: Vec<f64> = (0..ROWS).map(|k| (k % 3) as f64).collect();
    let signature = system.signature();
    let (name, interpolation) = (&*signature.inputs[0].name, signature.inputs[0].interpolation);
    let inputs = Inputs::recorded(&times, &[InputColumn { name, interpolation, values: &values }]);
    let inputs = inputs.expect("inputs");
    let asked: Vec<f64> = (0..4 * (ROWS - 1)).map(|k| 0.25 * k as f64).collect();
    let problem = Problem { system: &system, p: &[1.5], inputs: &inputs, start: &[] };
    let solution = simulate(&problem, &asked, &Options::default()).expect("a solution");
    let observed = observe(&problem, &solution);
    for (k, t) in asked.iter().enumerate().skip(6) {
        let (sample, part) = (k / 4, (k % 4) as f64 / 4.0);
        let u = values[sample] + part * (values[sample + 1] - values[sample]);
        let expected = u - solution.y(k - 6)[0];
        let w = observed.w(k)[0];
        assert!((w - expected).abs() < 1e-5, "{w} for {expected} at {t} s");
    }
}

/// A delay that varies reaches the jump of a reset within a step that a corner cuts.
#[test]
fn a_mark_in_a_step_that_ends_at_a_corner_is_not_missed() {
    let text = |corner: &str| {
        format!(
            "model m
             state x = -0.6 history 1
             state y = 0
             state c = 0.2
             equation x: der(x) = ((1.4 + x)/(2.4 + {corner}) - 0.3*x^3)/1 [s]
             equation c: der(c) = -0.0846/1 [s]
             equation y: der(y) = delay(x, (1 + 0.1*sin(time/1 [s]))*1 [s])/1 [s]
             when x rises above 0 {{ reset x = -0.6 }}"
        )
    };
    // The corner itself is nearly never passed: without it the solution is the same.
    let [plain, cut] = ["x", "min(x, c + 0.2)"].map(|corner| system(&text(corner)));
    for tolerance in [1e-5, 1e-6, 1e-7, 1e-8] {
        let options = Options { rtol: tolerance, atol: tolerance, ..Options::default() };
        let [plain, cut] = [&plain, &cut].map(|system| {
            let problem = Problem { system, p: &[], inputs: &Inputs::none(), start: &[] };
            simulate(&problem, &[0.0, 2.377], &options).expect("a solution").y(1)[1]
        });
        assert!((plain - cut).abs() < 100.0 * tolerance, "{tolerance}: {plain} {cut}");
    }
}

/// At a threshold from the start on, the first step is nearly none; its ends say nothing of a slope.
#[test]
fn a_step_between_two_events_at_one_time_has_no_slope_of_its_own() {
    let system = system(
        "model m
         parameter tau = 0.21
         state x = 0.6388
         unknown y = 0.6
         equation y: y = max(x, delay(x, 0.86 [s]))
         equation x: der(x) = (-0.3736 + y - 0.5*x)/1 [s]
         state z = 0
         equation z: der(z) = delay(x, tau*1 [s])/1 [s]
         output late = delay(x, tau*1 [s])",
    );
    let problem = Problem { system: &system, p: &[0.21], inputs: &Inputs::none(), start: &[] };
    let times: Vec<f64> = (1..=8).map(|k| 0.21 * f64::from(k)).collect();
    let slopes = |tolerance: f64| {
        let options = Options { rtol: tolerance, atol: tolerance, ..Options::default() };
        let solution = simulate_with_sensitivities(&problem, &times, &options).expect("a solution");
        let observations = observe(&problem, &solution);
        (0..times.len()).map(|k| observations.dw(k)[0]).collect::<Vec<f64>>()
    };
    for (a, b) in slopes(1e-6).iter().zip(slopes(1e-9)) {
        assert!((a - b).abs() < 1e-4, "{a} {b}");
    }
}
