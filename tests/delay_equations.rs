//! Unknowns that act late, in equations, against closed forms and other integrations.

#[path = "support/inline.rs"]
mod inline;

use dgd::{
    Column, Inputs, Observations, Options, Problem, Solution, System, observe, simulate,
    simulate_with_sensitivities,
};
use inline::system;

const TIGHT: f64 = 1e-11;

fn options() -> Options {
    Options { rtol: TIGHT, atol: TIGHT, ..Options::default() }
}

fn run(
    system: &impl System,
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

#[test]
fn a_decay_that_acts_late() {
    let system = system(
        "
model decay
parameter k   [1/s] = 1
parameter tau [s]   = 1
parameter u_0 [1]   = 1
state u [1] = u_0
equation decay: der(u) = -k*delay(u, tau)
",
    );
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
    let problem = Problem {
        system: &system,
        p: &[1.0, 1.0, 1.0, 0.0],
        inputs: &Inputs::none(),
        start: &[],
    };
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
    let system = system(
        "
model decay
parameter k   [1/s] = 1
parameter tau [s]   = 1
parameter u_0 [1]   = 1
state u [1] = u_0
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
    let columns = [Column {
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
            let switch = if heating {
                since + ((2.0 - x) / 1.0).ln() + tau
            } else {
                since + (x / b).ln() + tau
            };
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
