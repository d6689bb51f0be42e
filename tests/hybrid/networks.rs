//! Networks of diodes, valves and amplifiers at their limits: algebraic equations made of linear pieces, against
//! solutions that try all combinations of pieces.

use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    AutomatonKind, Inputs, METHODS, Method, Options, Problem, Solution, System, UndefinedCause,
    simulate,
};

use crate::exact::{assert_slopes_within, parameters, run, value};
use crate::inline::system;

/// Methods that solve algebraic equations.
const METHODS_FOR_DAES: [&str; 4] = ["rodas5p", "rodas4", "bdf", "kencarp4"];

fn method(name: &str) -> &'static Method {
    METHODS.iter().find(|method| method.name == name).expect("a method")
}

/// A run without sensitivities, to a relative tolerance.
fn run_by(
    system: &InterpretedSystem,
    method: &'static Method,
    times: &[f64],
    rtol: f64,
) -> Solution {
    let (p, inputs) = (parameters(system), Inputs::none());
    let problem = Problem { system, p: &p, inputs: &inputs, start: &[] };
    let options = Options { method, rtol, atol: rtol, ..Options::default() };
    simulate(&problem, times, &options).expect("a solution")
}

/// Solves A x = b.
fn solved<const N: usize>(mut a: [[f64; N]; N], mut b: [f64; N]) -> [f64; N] {
    for k in 0..N {
        let pivot = (k..N).max_by(|i, j| a[*i][k].abs().total_cmp(&a[*j][k].abs())).unwrap_or(k);
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..N {
            let factor = a[i][k] / a[k][k];
            let row = a[k];
            for (to, from) in a[i].iter_mut().zip(row) {
                *to -= factor * from;
            }
            b[i] -= factor * b[k];
        }
    }
    for k in (0..N).rev() {
        let known: f64 = (k + 1..N).map(|j| a[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / a[k][k];
    }
    b
}

/// One state from zero by the classical Runge–Kutta method, in equal steps, for slopes of the form (t, x).
fn integrated(until: f64, steps: usize, mut slope: impl FnMut(f64, f64) -> f64) -> f64 {
    let h = until / steps as f64;
    (0..steps).fold(0.0, |x, k| {
        let t = k as f64 * h;
        let first = slope(t, x);
        let second = slope(t + 0.5 * h, x + 0.5 * h * first);
        let third = slope(t + 0.5 * h, x + 0.5 * h * second);
        let last = slope(t + h, x + h * third);
        x + h / 6.0 * (first + 2.0 * second + 2.0 * third + last)
    })
}

/// Tries all states of n diodes, the last found first, until each voltage is on the side of its state.
fn of_states<T>(n: u32, last: &mut u32, mut at: impl FnMut(u32) -> (Vec<f64>, T)) -> T {
    for mask in std::iter::once(*last).chain(0..1 << n) {
        let (voltages, found) = at(mask);
        let fits =
            |(k, v): (usize, &f64)| if mask >> k & 1 == 1 { *v >= -1e-9 } else { *v <= 1e-9 };
        if voltages.iter().enumerate().all(fits) {
            *last = mask;
            return found;
        }
    }
    panic!("no state of the diodes fits")
}

const OMEGA: f64 = 314.159_265_358_979;

fn bridge(g: f64, leak: f64, r_s: f64) -> String {
    format!(
        "model bridge
constant w [rad/s] = 314.159265358979
parameter C [mF] = 1
parameter R [ohm] = 50
parameter V [V] = 100
parameter R_s [ohm] = {r_s}
state v [V] = 0 nominal 100
let e = V*sin(w*time/1 [rad])
unknown a [V] = 0
unknown b [V] = 0
unknown i_s [A] = 0
unknown d1 [A] = 0
unknown d2 [A] = 0
unknown d3 [A] = 0
unknown d4 [A] = 0
constant g [S] = {g}
constant leak [S] = {leak}
equation source: a - b = e - R_s*i_s
equation nodea: i_s = d1 - d2
equation nodeb: i_s = d4 - d3
equation D1: d1 = g*max(a - v, 0) + leak*(a - v)
equation D2: d2 = g*max(-a, 0) - leak*a
equation D3: d3 = g*(b - v + abs(v - b))/2 + leak*(b - v)
equation D4: d4 = if b < 0 [V] then -(g + leak)*b else -leak*b
equation load: C*der(v) = d1 + d3 - v/R
"
    )
}

/// The voltage of [`bridge`] at the end of the run.
fn bridge_by_states(until: f64, g: f64, leak: f64, r_s: f64) -> f64 {
    let mut last = 0;
    integrated(until, 20_000, |t, v| {
        let e = 100.0 * (OMEGA * t).sin();
        let i = of_states(4, &mut last, |mask| {
            let k: Vec<f64> = (0..4).map(|d| leak + g * f64::from(mask >> d & 1)).collect();
            let [a, b, _] = solved(
                [[1.0, -1.0, r_s], [-k[0] - k[1], 0.0, 1.0], [0.0, k[2] + k[3], 1.0]],
                [e, -k[0] * v, k[2] * v],
            );
            (vec![a - v, -a, b - v, -b], k[0] * (a - v) + k[2] * (b - v))
        });
        (i - v / 50.0) / 1e-3
    })
}

#[test]
fn a_bridge_of_diodes_charges_a_capacitor() {
    let mut worst = 0.0_f64;
    for g in [10.0, 1000.0] {
        for leak in [1e-5, 1e-3] {
            for r_s in [0.1, 1.0, 10.0] {
                let system = system(&bridge(g, leak, r_s));
                let kinds = system.signature().discrete.automata.iter().map(|a| a.kind);
                assert_eq!(kinds.collect::<Vec<_>>(), [AutomatonKind::Piece; 4]);
                let exact = bridge_by_states(0.02, g, leak, r_s);
                for name in METHODS_FOR_DAES {
                    let solution = run_by(&system, method(name), &[0.0, 0.02], 1e-6);
                    let found = value(&system, &solution, "v", 1);
                    assert!(solution.folds.is_empty(), "{:?}", solution.folds);
                    worst = worst.max((found - exact).abs());
                    assert!(
                        (found - exact).abs() < 1e-3,
                        "{name}, g {g}, leak {leak}, R_s {r_s}: {found} is not {exact}"
                    );
                }
            }
        }
    }
    assert!(worst > 0.0);
}

#[test]
fn a_bridge_is_the_same_in_other_units_from_other_guesses_and_written_in_another_order() {
    let text = bridge(1000.0, 1e-3, 1.0);
    let exact = bridge_by_states(0.02, 1000.0, 1e-3, 1.0);
    let in_other_units = text
        .replace("unknown a [V] = 0", "unknown a [kV] = 0.3")
        .replace("unknown i_s [A] = 0", "unknown i_s [mA] = -700");
    let mut lines: Vec<&str> = text.lines().collect();
    lines[2..].reverse();
    let reversed = lines.join("\n");
    let guessed = text.replace("[V] = 0\n", "[V] = -55\n").replace("[A] = 0", "[A] = 4");
    for text in [in_other_units, reversed, guessed] {
        let system = system(&text);
        let solution = run_by(&system, method("rodas5p"), &[0.0, 0.02], 1e-6);
        let found = value(&system, &solution, "v", 1);
        assert!((found - exact).abs() < 1e-3, "{found} is not {exact}\n{text}");
    }
}

#[test]
fn sensitivities_go_on_through_a_bridge() {
    let system = system(&bridge(10.0, 1e-3, 1.0));
    assert_slopes_within(&system, &Inputs::none(), &[0.0, 0.02], 1e-4, [1e-3, 1e-6]);
}

const SIX_PULSES: &str = "model six
constant w [rad/s] = 314.159265358979
parameter V [V] = 100
parameter R [ohm] = 10
parameter L [mH] = 10
parameter R_s [ohm] = 0.1
constant g [S] = 1000
constant leak [S] = 1e-5
state i [A] = 0 nominal 10
let e1 = V*sin(w*time/1 [rad])
let e2 = V*sin(w*time/1 [rad] - 2.0943951023931953)
let e3 = V*sin(w*time/1 [rad] + 2.0943951023931953)
unknown a1 [V] = 0
unknown a2 [V] = 0
unknown a3 [V] = 0
unknown p [V] = 0
unknown n [V] = 0
unknown u1 [A] = 0
unknown u2 [A] = 0
unknown u3 [A] = 0
unknown l1 [A] = 0
unknown l2 [A] = 0
unknown l3 [A] = 0
equation s1: a1 = e1 - R_s*(u1 - l1)
equation s2: a2 = e2 - R_s*(u2 - l2)
equation s3: a3 = e3 - R_s*(u3 - l3)
equation U1: u1 = g*max(a1 - p, 0) + leak*(a1 - p)
equation U2: u2 = g*max(a2 - p, 0) + leak*(a2 - p)
equation U3: u3 = g*max(a3 - p, 0) + leak*(a3 - p)
equation L1: l1 = g*max(n - a1, 0) + leak*(n - a1)
equation L2: l2 = g*max(n - a2, 0) + leak*(n - a2)
equation L3: l3 = g*max(n - a3, 0) + leak*(n - a3)
equation top: u1 + u2 + u3 = i
equation bottom: l1 + l2 + l3 = i
equation load: L*der(i) = p - n - R*i
";

/// The current of [`SIX_PULSES`] at the end of the run.
fn six_pulses_by_states(until: f64) -> f64 {
    let (g, leak, r_s) = (1000.0, 1e-5, 0.1);
    let mut last = 0;
    integrated(until, 10_000, |t, i| {
        let e = [0.0, -1.0, 1.0].map(|k| 100.0 * (OMEGA * t + k * 2.094_395_102_393_195_3).sin());
        let voltage = of_states(6, &mut last, |mask| {
            let k: Vec<f64> = (0..6).map(|d| leak + g * f64::from(mask >> d & 1)).collect();
            let mut m = [[0.0; 5]; 5];
            for phase in 0..3 {
                let (up, low) = (k[phase], k[phase + 3]);
                m[phase][phase] = 1.0 + r_s * (up + low);
                m[phase][3] = -r_s * up;
                m[phase][4] = -r_s * low;
                m[3][phase] = up;
                m[3][3] -= up;
                m[4][phase] = -low;
                m[4][4] += low;
            }
            let [a1, a2, a3, p, n] = solved(m, [e[0], e[1], e[2], i, i]);
            (vec![a1 - p, a2 - p, a3 - p, n - a1, n - a2, n - a3], p - n)
        });
        (voltage - 10.0 * i) / 10e-3
    })
}

#[test]
fn a_six_pulse_bridge_starts_from_any_guess_and_commutes() {
    let exact = six_pulses_by_states(0.02);
    for guess in ["[V] = 0", "[V] = 300", "[V] = -1e-9"] {
        let system = system(&SIX_PULSES.replace("[V] = 0", guess));
        for name in METHODS_FOR_DAES {
            let solution = run_by(&system, method(name), &[0.0, 0.02], 1e-6);
            let found = value(&system, &solution, "i", 1);
            assert!(solution.folds.is_empty(), "{:?}", solution.folds);
            assert!((found - exact).abs() < 1e-3, "{name} from {guess}: {found} is not {exact}");
        }
    }
}

#[test]
fn an_ideal_diode_is_the_limit_of_a_steep_one() {
    // Half a wave through a resistor: i = max(e − v, 0)/R_s.
    let text = "model half
constant w [rad/s] = 314.159265358979
parameter R_s [ohm] = 1
state v [V] = 0 nominal 100
unknown i [A] = 0
unknown a [kV] = 0
equation source: a = 100 [V]*sin(w*time/1 [rad]) - R_s*i
equation diode: complementary(i, v - a) = 0
equation load: 1 [mF]*der(v) = i - v/50 [ohm]
";
    let exact = integrated(0.02, 40_000, |t, v| {
        let e = 100.0 * (OMEGA * t).sin();
        ((e - v).max(0.0) - v / 50.0) / 1e-3
    });
    let turned = text.replace("complementary(i, v - a) = 0", "0 = complementary(v - a, i)");
    for text in [text, &turned] {
        let system = system(text);
        for name in METHODS_FOR_DAES {
            let solution = run_by(&system, method(name), &[0.0, 0.02], 1e-6);
            let found = value(&system, &solution, "v", 1);
            assert!((found - exact).abs() < 1e-3, "{name}: {found} is not {exact}");
        }
    }
}

/// Ideal diodes, whose leaks to ground keep voltages determined while none conducts.
const IDEAL_BRIDGE: &str = "model ideal_bridge
parameter C [F] = 1e-3
parameter R [ohm] = 100
parameter Rs [ohm] = 1
parameter G [S] = 1e-9
let e = 100 [V]*sin(2*pi*50 [1/s]*time)
unknown va [V] = 0
unknown vb [V] = 0
unknown i1 [A] = 0
unknown i2 [A] = 0
unknown i3 [A] = 0
unknown i4 [A] = 0
unknown i [A] = 0
state v [V] = 0
equation source: va - vb = e - Rs*i
equation na: i + i3 - i1 - G*va = 0
equation nb: -i + i4 - i2 - G*vb = 0
equation d1: complementary(i1/1 [A], (v - va)/1 [V]) = 0
equation d2: complementary(i2/1 [A], (v - vb)/1 [V]) = 0
equation d3: complementary(i3/1 [A], va/1 [V]) = 0
equation d4: complementary(i4/1 [A], vb/1 [V]) = 0
equation cap: C*der(v) = i1 + i2 - v/R
output v
";

#[test]
fn a_bridge_of_ideal_diodes_starts_on_all_corners_at_once() {
    let exact = integrated(0.06, 60_000, |t, v| {
        let e = 100.0 * (OMEGA * t).sin().abs();
        ((e - v).max(0.0) - v / 100.0) / 1e-3
    });
    let system = system(IDEAL_BRIDGE);
    for name in METHODS_FOR_DAES {
        let solution = run_by(&system, method(name), &[0.0, 0.06], 1e-6);
        let found = value(&system, &solution, "v", 1);
        assert!(solution.folds.is_empty(), "{:?}", solution.folds);
        assert!((found - exact).abs() < 1e-4, "{name}: {found} is not {exact}");
    }
}

/// Behind resistances so small that the coil sees the largest voltage less the smallest.
const IDEAL_SIX_PULSES: &str = "model six_pulse
parameter L [H] = 1e-3
parameter R [ohm] = 10
parameter Rs [ohm] = 1e-6
parameter G [S] = 1e-9
let w = 2*pi*50 [1/s]
let ea = 100 [V]*sin(w*time)
let eb = 100 [V]*sin(w*time - 2*pi/3)
let ec = 100 [V]*sin(w*time + 2*pi/3)
unknown va [V] = 0
unknown vb [V] = 0
unknown vc [V] = 0
unknown vp [V] = 0
unknown vn [V] = 0
unknown p1 [A] = 0
unknown p2 [A] = 0
unknown p3 [A] = 0
unknown n1 [A] = 0
unknown n2 [A] = 0
unknown n3 [A] = 0
state i [A] = 0
equation na: (ea - va)/Rs = p1 - n1 + G*va
equation nb: (eb - vb)/Rs = p2 - n2 + G*vb
equation nc: (ec - vc)/Rs = p3 - n3 + G*vc
equation np: p1 + p2 + p3 = i + G*vp
equation nn: n1 + n2 + n3 = i - G*vn
equation d1: complementary(p1/1 [A], (vp - va)/1 [V]) = 0
equation d2: complementary(p2/1 [A], (vp - vb)/1 [V]) = 0
equation d3: complementary(p3/1 [A], (vp - vc)/1 [V]) = 0
equation d4: complementary(n1/1 [A], (va - vn)/1 [V]) = 0
equation d5: complementary(n2/1 [A], (vb - vn)/1 [V]) = 0
equation d6: complementary(n3/1 [A], (vc - vn)/1 [V]) = 0
equation coil: L*der(i) = vp - vn - R*i
output i
";

#[test]
fn a_six_pulse_bridge_of_ideal_diodes_gives_the_largest_voltage_less_the_smallest() {
    let exact = integrated(0.0613, 60_000, |t, i| {
        let third = 2.094_395_102_393_195_3;
        let e = [0.0, -third, third].map(|phase| 100.0 * (OMEGA * t + phase).sin());
        let most = e.into_iter().fold(f64::MIN, f64::max);
        let least = e.into_iter().fold(f64::MAX, f64::min);
        (most - least - 10.0 * i) / 1e-3
    });
    let system = system(IDEAL_SIX_PULSES);
    for name in METHODS_FOR_DAES {
        let solution = run_by(&system, method(name), &[0.0, 0.0613], 1e-6);
        let found = value(&system, &solution, "i", 1);
        assert!(solution.folds.is_empty(), "{:?}", solution.folds);
        assert!((found - exact).abs() < 1e-4, "{name}: {found} is not {exact}");
    }
}

const VALVES: &str = "model valves
parameter k = 5
parameter c = 1e-6
state h1 = 1
state h2 = 0.2
state h3 = 0.5
unknown x = 0
unknown y = 0
unknown q1 = 0
unknown q2 = 0
unknown q3 = 0
unknown q4 = 0
let pump = 2*sin(3*time/1 [s])
equation v1: q1 = k*max(h1 + pump - x, 0) + c*(h1 + pump - x)
equation v2: q2 = k*max(x - y, 0) + c*(x - y)
equation v3: q3 = if y > h2 then k*(y - h2) + c*(y - h2) else c*(y - h2)
equation v4: q4 = k*(x - h3 + abs(x - h3))/2 + c*(x - h3)
equation jx: q1 = q2 + q4
equation jy: q2 = q3
equation t1: 1 [s]*der(h1) = 0.3*h2 + 0.3*h3 - q1
equation t2: 1 [s]*der(h2) = q3 - 0.3*h2
equation t3: 1 [s]*der(h3) = q4 - 0.3*h3
";

#[test]
fn check_valves_let_flow_pass_one_way_and_nothing_is_lost() {
    let system = system(VALVES);
    let exact = run(&system, &[0.0, 5.0]);
    for name in METHODS_FOR_DAES {
        let solution = run_by(&system, method(name), &[0.0, 5.0], 1e-7);
        let of = |solution: &Solution, k: usize| {
            ["h1", "h2", "h3"].map(|h| value(&system, solution, h, k))
        };
        let (start, end) = (of(&solution, 0), of(&solution, 1));
        assert!((start.iter().sum::<f64>() - end.iter().sum::<f64>()).abs() < 1e-5, "{name}");
        for (found, exact) in end.iter().zip(of(&exact, 1)) {
            assert!((found - exact).abs() < 1e-4, "{name}: {found} is not {exact}");
        }
        assert!(solution.folds.is_empty(), "{:?}", solution.folds);
    }
}

/// A relaxation oscillator: vo is ±12 V, vc moves towards it until it passes half of it, but for 12 V/K.
const OSCILLATOR: &str = "model oscillator
parameter K = 1e4
constant b = 0.5
state vc [V] = 0
unknown vo [V] = 12
equation amp: vo = clamp(K*(b*vo - vc), -12 [V], 12 [V])
equation cap: 1 [ms]*der(vc) = vo - vc
";

/// vc of [`OSCILLATOR`], by exponentials.
fn oscillation(t: f64) -> (f64, usize) {
    let threshold: f64 = 6.0 - 12.0 / 1e4;
    let first = 1e-3 * (12.0 / (12.0 - threshold)).ln();
    let half = 1e-3 * ((12.0 + threshold) / (12.0 - threshold)).ln();
    if t < first {
        return (12.0 * (1.0 - (-t / 1e-3).exp()), 0);
    }
    let jumps = 1 + ((t - first) / half) as usize;
    let since = t - first - (jumps - 1) as f64 * half;
    let side = if jumps % 2 == 1 { -12.0 } else { 12.0 };
    let from = if jumps % 2 == 1 { threshold } else { -threshold };
    (side + (from - side) * (-since / 1e-3).exp(), jumps)
}

#[test]
fn jumps_over_a_fold_are_made_and_recorded() {
    let system = system(OSCILLATOR);
    let (exact, n) = oscillation(0.01);
    assert!((exact + 1.302_34).abs() < 1e-4, "{exact}");
    for name in METHODS_FOR_DAES {
        let solution = run_by(&system, method(name), &[0.0, 0.01], 1e-8);
        let found = value(&system, &solution, "vc", 1);
        assert!((found - exact).abs() < 1e-4, "{name}: {found} is not {exact}");
        assert_eq!(solution.folds.len(), n, "{name}");
        let fold = &solution.folds[0];
        assert_eq!(fold.unknown, "vo");
        assert!((fold.from - 12.0).abs() < 1e-3 && (fold.to + 12.0).abs() < 1e-3, "{fold:?}");
    }
}

#[test]
fn derivatives_end_at_a_fold() {
    let system = system(OSCILLATOR);
    let solution = run(&system, &[0.0, 0.01]);
    assert_eq!(solution.undefined[0].cause, UndefinedCause::Fold);
    assert!(solution.s(1).iter().all(|s| s.is_nan()));
}

/// An inverting amplifier of gain 10 and, behind it, an integrator, both on their rails for a while.
const RAILS: &str = "model rails
parameter K = 1e5
state u [V] = 0
unknown m [V] = 5
unknown vo [V] = 0
unknown wo [V] = 0
unknown n [V] = 0
let e = 2 [V]*cos(6.283185307179586*time/1 [s])
equation amp: vo = clamp(K*(-m), -12 [V], 12 [V])
equation node: (e - m)/1000 = (m - vo)/10000
equation amp2: wo = clamp(K*(-n), -12 [V], 12 [V])
equation cap: u = n - wo
equation node2: 0.1 [s]*der(u) = vo - n
";

/// u of [`RAILS`] at the end of the run: each amplifier is −K times its input or at a rail.
fn on_rails(until: f64) -> f64 {
    let k = 1e5;
    integrated(until, 40_000, |t, u| {
        let e = 2.0 * (2.0 * std::f64::consts::PI * t).cos();
        let linear = -10.0 * e / (1.0 + 11.0 / k);
        let vo = linear.clamp(-12.0, 12.0);
        // n = u + wo, wo = −K n
        let wo = (-k * u / (1.0 + k)).clamp(-12.0, 12.0);
        (vo - (u + wo)) / 0.1
    })
}

#[test]
fn amplifiers_start_on_their_rails_and_leave_them() {
    let system = system(RAILS);
    for (until, close) in [(0.3, 1e-3), (2.0, 2e-3)] {
        let exact = on_rails(until);
        for name in METHODS_FOR_DAES {
            let solution = run_by(&system, method(name), &[0.0, until], 1e-8);
            let found = value(&system, &solution, "u", 1);
            assert!((found - exact).abs() < close, "{name} to {until}: {found} is not {exact}");
            assert!((value(&system, &solution, "vo", 0) + 12.0).abs() < 1e-9);
        }
    }
}

#[test]
fn what_lies_beyond_a_bound_does_not_come_into_other_states() {
    let text = "model decay
parameter K [mol/m^3] = 1e-6
state c [mol/m^3] = 1
state p [mol/m^3] = 0
let r = 0.01 [mol/(m^3*s)]*c/(K + c)
equation c: der(c) = -r
equation p: der(p) = r
saturate c >= 0
";
    let smaller = text.replace("1e-6", "1e-9").replace("0.01 [mol", "0.05 [mol");
    for text in [text, &smaller] {
        let system = system(text);
        for method in METHODS.iter().filter(|method| !method.name.starts_with("taylor")) {
            for times in [vec![0.0, 300.0], (0..5).map(|k| 50.0 * f64::from(k)).collect()] {
                let (p, inputs) = (parameters(&system), Inputs::none());
                let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
                let options = Options { method, ..Options::default() };
                let Ok(solution) = simulate(&problem, &times, &options) else { continue };
                let of = |unknown| value(&system, &solution, unknown, times.len() - 1);
                let sum = of("c") + of("p");
                assert!((sum - 1.0).abs() < 1e-4, "{}: {sum}", method.name);
            }
        }
    }
}
