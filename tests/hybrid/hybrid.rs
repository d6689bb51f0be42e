//! Modes, and conditions on time: states and sensitivities against closed forms and differences.

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::ast::Name;
use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    InputColumn, Inputs, IntegrateError, Interpolation, Problem, UndefinedCause, consistent_start,
    observe, simulate, simulate_with_sensitivities,
};

use crate::exact;
use crate::exact::{options, parameters, position, run, run_with, slopes};
use crate::support;

/// How well closed forms are met, relative to the largest number of the case: Rodas5P's error after
/// the few hundred steps of these cases stays within a factor of a hundred of the tolerance.
const CLOSE: f64 = 1e-8;

fn model(text: &str) -> InterpretedSystem {
    model_with(text, Vec::new())
}

fn model_with(text: &str, variants: Vec<(Name, Name)>) -> InterpretedSystem {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let main = SourceText { name: "model.dgd".to_owned(), text: format!("model m\n{text}") };
    let mut read = |_: &str| Err("no imports".to_owned());
    let options = ModelOptions { variants, ..ModelOptions::default() };
    let compiled = compile(
        main,
        &options,
        &SensitivityDirections::All,
        &mut read,
        &mut sources,
        &mut diagnostics,
    );
    let compiled = compiled.unwrap_or_else(|_| {
        let shown = render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain);
        panic!("{shown}")
    });
    InterpretedSystem::new(compiled.program)
}

#[track_caller]
fn assert_close(found: &[f64], expected: &[f64]) {
    exact::assert_close(found, expected, CLOSE);
}

/// All sensitivities at the last time against central differences, extrapolated once.
#[track_caller]
fn assert_slopes_are_differences(
    system: &InterpretedSystem,
    inputs: &Inputs,
    times: &[f64],
    close: f64,
) {
    exact::assert_slopes_within(system, inputs, times, close, [1e-6, 0.0]);
}

const PULSE: &str = "
parameter t_on [s] = 1500
parameter length [s] = 10
parameter rate [1/s] = 0.3
parameter tau [s] = 100
state x = 2
equation balance: der(x) = -x/tau + (if time > t_on and time <= t_on + length then rate else 0)
";

/// x of [`PULSE`] behind the pulse, and its derivatives: with E(t) = exp(−(t − t_on)/τ),
/// x = x₀ e^(−t/τ) + r τ E (e^(l/τ) − 1).
fn behind_pulse(t: f64, [on, length, rate, tau]: [f64; 4]) -> (f64, [f64; 4]) {
    let start = 2.0 * (-t / tau).exp();
    let late = (-(t - on) / tau).exp();
    let pulse = late * ((length / tau).exp() - 1.0);
    let x = start + rate * tau * pulse;
    let by_length = rate * late * (length / tau).exp();
    let by_tau = start * t / (tau * tau) + rate * pulse + rate * pulse * (t - on) / tau
        - rate * late * (length / tau).exp() * length / tau;
    (x, [rate * pulse, by_length, tau * pulse, by_tau])
}

#[test]
fn a_short_pulse_is_not_stepped_over_and_its_onset_has_a_sensitivity() {
    let system = model(PULSE);
    let times = [0.0, 1600.0, 3600.0];
    let solution = run(&system, &times);
    for (k, t) in times.into_iter().enumerate().skip(1) {
        let (x, slope) = behind_pulse(t, [1500.0, 10.0, 0.3, 100.0]);
        assert_close(solution.y(k), &[x]);
        assert_close(&slopes(&system, &solution, "x", k), &slope);
    }
    assert!(solution.events.is_empty());
}

#[test]
fn conditions_on_time_beyond_the_run_or_before_it_do_nothing() {
    let system = model(PULSE);
    let x = |on: f64, t: f64| {
        let p = [on, 10.0, 0.3, 100.0];
        let solution = run_with(&system, &p, &Inputs::none(), &[0.0, t]).expect("a solution");
        (solution.y(1)[0], slopes(&system, &solution, "x", 1))
    };
    let free = 2.0 * (-4.0_f64).exp();
    let decayed = [0.0, 0.0, 0.0, free * 400.0 / 1e4];
    // Long before the start, and behind the end.
    for on in [-100.0, 500.0] {
        let (value, slope) = x(on, 400.0);
        assert_close(&[value], &[free]);
        assert_close(&slope, &decayed);
    }
    // At the very start the pulse is on, and a start that cannot come earlier has no onset.
    let (value, slope) = x(0.0, 400.0);
    let (expected, mut by) = behind_pulse(400.0, [0.0, 10.0, 0.3, 100.0]);
    // Its end moves with the onset, its beginning not.
    by[0] = by[1];
    assert_close(&[value], &[expected]);
    assert_close(&slope, &by);
    // At the very end it is on from there.
    let (value, slope) = x(400.0, 400.0);
    assert_close(&[value], &[free]);
    assert_close(&slope, &[-0.3, decayed[1], decayed[2], decayed[3]]);
    // A pulse without length is none, but it would be one if it were longer.
    let p = [200.0, 0.0, 0.3, 100.0];
    let solution = run_with(&system, &p, &Inputs::none(), &[0.0, 400.0]).expect("a solution");
    assert_close(solution.y(1), &[free]);
    let by_length = 0.3 * (-2.0_f64).exp();
    assert_close(&slopes(&system, &solution, "x", 1), &[0.0, by_length, 0.0, decayed[3]]);
}

#[test]
fn values_at_the_time_of_a_switch_are_those_before_and_after() {
    let system = model(
        "parameter t_on = 2
         state x = 0
         unknown q = 0
         equation a: der(x) = 1 [1/s] * q
         equation b: q = if time/1 [s] >= t_on then 3 else 1
         output late = if not (time < 2 [s]) then q else -q",
    );
    let p = [2.0];
    let problem = Problem { system: &system, p: &p, inputs: &Inputs::none(), start: &[] };
    let times = [0.0, 2.0, 2.0, 3.0];
    let solution = simulate_with_sensitivities(&problem, &times, &options()).expect("a solution");
    let q = |k: usize| solution.y(k)[position(&system, "q")];
    assert_eq!([q(0), q(1), q(2), q(3)], [1.0, 1.0, 3.0, 3.0]);
    assert_eq!(observe(&problem, &solution).w, [-1.0, -1.0, 3.0, 3.0]);
    let x = position(&system, "x");
    assert_close(&[1, 2, 3].map(|k| solution.s(k)[x]), &[0.0, -2.0, -2.0]);
    // One row means the value after it, as where inputs jump.
    let once = simulate(&problem, &[0.0, 2.0], &options()).expect("a solution");
    assert_eq!(once.y(1)[position(&system, "q")], 3.0);
}

#[test]
fn slopes_that_change_with_time_are_conditions_on_time_too() {
    // A ramp from t_on on that ends at one: max and min compare times.
    let system = model(
        "parameter t_on [s] = 1
         parameter rise [s] = 0.01
         state x [s] = 0
         equation a: der(x) = min(max((time - t_on)/rise, 0), 1)",
    );
    let solution = run(&system, &[0.0, 50.0]);
    assert_close(solution.y(1), &[50.0 - 1.0 - 0.005]);
    assert_close(&slopes(&system, &solution, "x", 1), &[-1.0, -0.5]);
}

const TANK: &str = "
parameter a [m/s] = 0.2
parameter b [m] = 1.5
parameter c [1/s] = 0.4
parameter d [m] = 0.3
parameter x0 [m] = 4
state x [m] = x0
modes tank {
  full { equation level: der(x) = -a }
  low  { equation level: der(x) = -c*(x - d) }
  full -> low when x falls below b
}
";

#[test]
fn a_tank_that_changes_its_law_at_a_level() {
    let system = model(TANK);
    let (a, b, c, d, x0) = (0.2, 1.5, 0.4, 0.3, 4.0);
    let event = (x0 - b) / a;
    for t in [20.0, 14.0] {
        let solution = run(&system, &[0.0, 5.0, t]);
        assert_close(solution.y(1), &[x0 - 5.0 * a]);
        assert_close(&slopes(&system, &solution, "x", 1), &[-5.0, 0.0, 0.0, 0.0, 1.0]);
        // x = d + (b − d) E, E = exp(−c (t − (x₀ − b)/a))
        let e = (-c * (t - event)).exp();
        let by_time = (b - d) * e * c;
        assert_close(solution.y(2), &[d + (b - d) * e]);
        let expected = [
            by_time * -(x0 - b) / (a * a),
            e - by_time / a,
            -(b - d) * e * (t - event),
            1.0 - e,
            by_time / a,
        ];
        assert_close(&slopes(&system, &solution, "x", 2), &expected);
        let [happened] = &solution.events[..] else { panic!("{:?}", solution.events) };
        assert_close(&[happened.t], &[event]);
        let names = [&happened.automaton, &happened.from, &happened.to].map(|name| &**name);
        assert_eq!(names, ["tank", "full", "low"]);
    }
}

#[test]
fn the_values_asked_for_at_the_time_of_a_transition_are_those_after_it() {
    let system = model(
        "parameter v [m/s] = 1
         state x [m] = 0
         unknown q = 0
         equation way: der(x) = v
         modes gate {
           shut { equation flow: q = 0 }
           open { equation flow: q = 1 }
           shut -> open when x rises above 2 [m]
         }",
    );
    let solution = run(&system, &[0.0, 1.0, 3.0]);
    let gate: Vec<f64> = (0..3).map(|k| solution.z(k)[0]).collect();
    let q: Vec<f64> = (0..3).map(|k| solution.y(k)[position(&system, "q")]).collect();
    assert_eq!((gate, q), (vec![0.0, 0.0, 1.0], vec![0.0, 0.0, 1.0]));
}

#[test]
fn an_algebraic_unknown_becomes_differential_and_keeps_its_value() {
    // q = k time until it has reached q1, and then decays: q = q1 exp(−(t − q1/k)/tau).
    let system = model(
        "parameter k [1/s] = 0.5
         parameter q1 = 2
         parameter tau [s] = 3
         state q = 0
         state v [s] = 0
         equation volume: der(v) = q
         modes pump {
           driven { equation flow: q = k*time }
           coasting { equation flow: tau*der(q) = -q }
           driven -> coasting when q rises above q1
         }",
    );
    let (k, q1, tau, t) = (0.5, 2.0, 3.0, 7.0);
    let solution = run(&system, &[0.0, 2.0, t]);
    let e = (-(t - q1 / k) / tau).exp();
    let q = position(&system, "q");
    assert_close(&[solution.y(1)[q], solution.y(2)[q]], &[1.0, q1 * e]);
    assert_close(&slopes(&system, &solution, "q", 1), &[2.0, 0.0, 0.0]);
    // ∂q/∂k = q (−q1/k²)/tau, ∂q/∂q1 = e + q/(k tau), ∂q/∂tau = q (t − q1/k)/tau²
    let expected = [
        q1 * e * (-q1 / (k * k)) / tau,
        e + q1 * e / (k * tau),
        q1 * e * (t - q1 / k) / (tau * tau),
    ];
    assert_close(&slopes(&system, &solution, "q", 2), &expected);
    // v = q1²/(2k) + q1 tau (1 − e)
    let v = position(&system, "v");
    assert_close(&[solution.y(2)[v]], &[q1 * q1 / (2.0 * k) + q1 * tau * (1.0 - e)]);
}

#[test]
fn a_ball_bounces_with_the_sensitivities_of_its_closed_form() {
    let system = model(
        "parameter g [m/s^2] = 9.81
         parameter h0 [m] = 2
         parameter e = 0.8
         state h [m] = h0
         state v [m/s] = 0
         equation way: der(h) = v
         modes ball {
           flying { equation fall: der(v) = -g }
           flying -> flying when h falls below 0 [m] { reset v = -e*v }
         }",
    );
    // After two bounces, before the third: t₂ = t₁ (1 + 2e), t₁ = √(2h₀/g), v₂ = e² g t₁,
    // h = v₂ s − g s²/2 with s = t − t₂.
    let t = 2.4;
    let state = |p: [f64; 3]| {
        let [g, h0, e] = p;
        let t1 = (2.0 * h0 / g).sqrt();
        let s = t - t1 * (1.0 + 2.0 * e);
        let v2 = e * e * g * t1;
        [v2 * s - 0.5 * g * s * s, v2 - g * s]
    };
    let p = [9.81, 2.0, 0.8];
    let solution = run(&system, &[0.0, t]);
    assert_eq!(solution.events.len(), 2);
    assert_close(solution.y(1), &state(p));
    for j in 0..3 {
        // The closed form's derivative by differences, good to about 1e-10.
        let mut around = [p; 4];
        for (p, factor) in around.iter_mut().zip([1.0, -1.0, 2.0, -2.0]) {
            p[j] += factor * 1e-3 * p[j];
        }
        let [up, down, far_up, far_down] = around.map(state);
        let h = 1e-3 * p[j];
        let slope =
            [0, 1].map(|i| (8.0 * (up[i] - down[i]) - (far_up[i] - far_down[i])) / (12.0 * h));
        assert_close(&solution.s(1)[2 * j..2 * j + 2], &slope);
    }
}

#[test]
fn a_held_input_that_jumps_triggers_a_transition_at_its_sample() {
    let system = model(
        "parameter limit = 1
         parameter tau [s] = 2
         input u hold
         state q = u
         modes valve {
           open { equation flow: q = u }
           shut { equation flow: tau*der(q) = -q }
           open -> shut when u falls below limit
           shut -> open when u rises above 2*limit
         }",
    );
    let samples = [0.0, 1.0, 2.0, 5.0];
    let column = InputColumn {
        name: "u",
        interpolation: Interpolation::Hold,
        values: &[3.0, 4.0, 0.5, 6.0],
    };
    let inputs = Inputs::recorded(&samples, &[column]).expect("inputs");
    let p = [1.0, 2.0];
    let times = [0.0, 1.5, 2.0, 4.0, 5.0, 6.0];
    let solution = run_with(&system, &p, &inputs, &times).expect("a solution");
    // It had 4 just before the jump, and keeps that.
    let at = |t: f64| 4.0 * (-(t - 2.0) / 2.0_f64).exp();
    assert_close(&solution.y, &[3.0, 4.0, 4.0, at(4.0), 6.0, 6.0]);
    let slope = at(4.0) * 2.0 / 4.0;
    assert_close(&slopes(&system, &solution, "q", 3), &[0.0, slope]);
    let events: Vec<(f64, &str)> = solution.events.iter().map(|e| (e.t, &*e.to)).collect();
    assert_eq!(events, [(2.0, "shut"), (5.0, "open")]);
}

/// A line that drains into a riser when its pump slows down, and refills before it delivers.
const LINE: &str = "
parameter area = 0.5
parameter inertia = 2
parameter friction = 1.2
parameter head = 1
input u linear
state h = 0
state q = u
state riser = 0
equation level: 1 [s] * der(riser) = q - 0.1*riser
modes line {
  full {
    equation line_level: h = 0
    equation line_flow:  q = u
  }
  draining {
    equation line_level: area * 1 [s] * der(h) = q - u
    equation line_flow:  inertia * 1 [s] * der(q) = (head - h) - friction*q
  }
  full -> draining when friction*u falls below head
  draining -> full when h falls below 0
}
";

#[test]
fn a_line_drains_and_refills_with_the_sensitivities_of_differences() {
    let system = model(LINE);
    let column = InputColumn {
        name: "u",
        interpolation: Interpolation::Linear,
        values: &[1.5, 1.5, 0.0, 0.0, 1.7, 1.7],
    };
    let inputs = Inputs::recorded(&[0.0, 2.0, 4.0, 9.0, 12.0, 40.0], &[column]).expect("inputs");
    let p = parameters(&system);
    let whole = run_with(&system, &p, &inputs, &[0.0, 40.0]).expect("a solution");
    let to: Vec<&str> = whole.events.iter().map(|event| &*event.to).collect();
    assert_eq!(to, ["draining", "full"], "{:?}", whole.events);
    let refilled = whole.events[1].t;
    // While it drains, and after it has refilled. Differences of solutions with errors of about
    // 1e-10 over steps of 1e-3, and what is left of their own error.
    assert_slopes_are_differences(&system, &inputs, &[0.0, 8.0], 1e-5);
    assert_slopes_are_differences(&system, &inputs, &[0.0, refilled + 2.0], 1e-5);
}

#[test]
fn a_transition_that_a_switch_triggers_moves_with_its_time() {
    // x = time until t_on, where u jumps and the mode with it; then x decays.
    let system = model(
        "parameter t_on [s] = 2
         parameter tau [s] = 3
         state x [s] = 0
         let u = if time > t_on then 1 else 0
         modes m1 {
           rising  { equation a: der(x) = 1 }
           falling { equation a: der(x) = -x/tau }
           rising -> falling when u rises above 0.5
         }",
    );
    let (t_on, tau, t) = (2.0, 3.0, 5.0);
    let solution = run(&system, &[0.0, t]);
    let e = f64::exp(-(t - t_on) / tau);
    assert_close(solution.y(1), &[t_on * e]);
    let expected = [e + t_on * e / tau, t_on * e * (t - t_on) / (tau * tau)];
    assert_close(&slopes(&system, &solution, "x", 1), &expected);
}

#[test]
fn a_condition_that_is_true_on_entry_acts_once_it_has_been_false() {
    let system = model(
        "parameter a [1/s] = 1
         state x = 0
         equation way: der(x) = a * cos(1 [1/s] * time)
         unknown q = 0
         modes m1 {
           first  { equation b: q = 1 }
           second { equation b: q = 2 }
           first -> second when x falls below 0.5
           start first
         }",
    );
    // x = sin(t) starts below one half; it falls below at 5π/6.
    let solution = run(&system, &[0.0, 6.0]);
    let [event] = &solution.events[..] else { panic!("{:?}", solution.events) };
    assert_close(&[event.t], &[std::f64::consts::PI * 5.0 / 6.0]);
}

#[test]
fn a_threshold_that_is_only_touched_leaves_sensitivities_undefined() {
    // x = t² − 2t + 1 touches 0 at t = 1; the event function is x − 1e-30.
    let system = model(
        "parameter a = 1
         state x = 1
         equation way: 1 [s] * der(x) = 2*a*(time/1 [s] - 1)
         unknown q = 0
         modes m1 {
           before { equation b: q = 1 }
           after  { equation b: q = 2 }
           before -> after when x falls below 1e-14
         }",
    );
    let solution = run(&system, &[0.0, 3.0]);
    if solution.events.is_empty() {
        // Rounding kept it above: then nothing has happened at all.
        assert!(solution.undefined.is_empty());
    } else {
        assert_eq!(solution.undefined[0].cause, UndefinedCause::Grazing);
        assert!(solution.s(1).iter().all(|s| s.is_nan()));
    }
}

#[test]
fn modes_without_end_at_one_time_are_an_error() {
    let system = model(
        "state x = 1
         modes relay {
           on  { equation a: 1 [s] * der(x) = -1 }
           off { equation a: 1 [s] * der(x) = 1 }
           on -> off when x falls below 0
           off -> on when x rises above 0
         }",
    );
    let failure = run_with(&system, &[], &Inputs::none(), &[0.0, 3.0]).expect_err("no solution");
    let IntegrateError::EndlessEvents { t, automaton, .. } = &failure.error else {
        panic!("{}", failure.error)
    };
    assert_eq!(automaton, "relay");
    assert!((t - 1.0).abs() < 1e-6);
}

#[test]
fn two_blocks_of_modes_are_independent() {
    let both = model(&format!(
        "{TANK}
         state y = 0
         modes other {{
           slow {{ equation o: 1 [s] * der(y) = 1 }}
           fast {{ equation o: 1 [s] * der(y) = 3 }}
           slow -> fast when y rises above 2
           start slow
         }}"
    ));
    let tank = model(TANK);
    let (found, alone) = (run(&both, &[0.0, 20.0]), run(&tank, &[0.0, 20.0]));
    assert_close(&found.y(1)[..1], alone.y(1));
    assert_close(&found.y(1)[1..], &[2.0 + 3.0 * 18.0]);
    assert_eq!(found.events.len(), 2);
}

/// The effect as a user would write it into the model file: the boost line before the riser.
fn with_booster_line(flow: &str) -> InterpretedSystem {
    let path = support::root().join("models/mud_circulation.dgd");
    let text = std::fs::read_to_string(path).expect("the model");
    let (_, text) = text.split_once("model mud_circulation").expect("its first line");
    let riser = "equation riser: A_r * der(h_r) = q_ssp - q_boost - q_tf";
    assert!(text.contains(riser));
    let text = text.replace(riser, &riser.replace("q_boost", "q_bo"));
    let line = "
constant  A_b [m^2]        = 0.0103
parameter F_b [Pa*s/m^3]   = 6e7  in 1e6 .. 1e9, log
parameter M_b [kg/m^4]     = 4e7
state h_b  [m]     = 0
state q_bo [m^3/s] = q_boost
modes booster_line {
  full {
    equation line_level: h_b = 0 [m]
    equation line_flow:  q_bo = q_boost
  }
  draining {
    equation line_level: A_b * der(h_b) = q_bo - q_boost
    equation line_flow:  M_b * der(q_bo) = rho*g*(h_r - h_b) - F_b*q_bo
  }
  full -> draining when F_b*q_boost falls below rho*g*h_r
  draining -> full when h_b falls below 0 [m]
}
";
    let choices = [("flow", flow)].map(|(v, c)| (support::name(v), support::name(c)));
    model_with(&format!("{text}{line}"), choices.to_vec())
}

#[test]
fn a_booster_line_drains_in_both_forms_of_the_riser_model() {
    // The pump ramps down within ten seconds and comes back after a minute, recorded at 1 Hz.
    let times: Vec<f64> = (0..=400).map(f64::from).collect();
    let lpm = |q: f64| q / 60_000.0;
    let boost: Vec<f64> = times
        .iter()
        .map(|t| {
            2000.0 - 200.0 * (t - 100.0).clamp(0.0, 10.0) + 200.0 * (t - 160.0).clamp(0.0, 10.0)
        })
        .map(lpm)
        .collect();
    let (speed, top) = (vec![0.93; times.len()], vec![lpm(100.0); times.len()]);
    let column = |name, interpolation, values| InputColumn { name, interpolation, values };
    let inputs = Inputs::recorded(
        &times,
        &[
            column("w_ssp", Interpolation::Hold, &speed),
            column("q_boost", Interpolation::Linear, &boost),
            column("q_tf", Interpolation::Hold, &top),
        ],
    )
    .expect("inputs");
    for flow in ["dynamic", "static"] {
        let system = with_booster_line(flow);
        let p = parameters(&system);
        let solution = run_with(&system, &p, &inputs, &times).expect("a solution");
        let to: Vec<&str> = solution.events.iter().map(|event| &*event.to).collect();
        let h = |k: usize| solution.y(k)[position(&system, "h_r")];
        assert_eq!(
            to,
            ["draining", "full"],
            "{flow}: {} {} {}: {:?}",
            h(0),
            h(160),
            h(400),
            solution.events
        );
        let [drained, refilled] = [solution.events[0].t, solution.events[1].t];
        assert!(100.0 < drained && drained < 110.0 && 160.0 < refilled, "{drained}, {refilled}");
        // The level in the line is below its top while it drains, and never above it.
        let h_b = position(&system, "h_b");
        assert!((0..times.len()).all(|k| solution.y(k)[h_b] >= -1e-9));
        assert_slopes_are_differences(&system, &inputs, &[0.0, 150.0], 1e-4);
        assert_slopes_are_differences(&system, &inputs, &[0.0, 400.0], 1e-4);
    }
}

const LATE_SWITCH: &str = "
input u hold
input v hold
parameter tau  [s]   = 3.5
parameter rate [1/s] = 0.2
parameter gain [1/s] = 0.3
state x = 1
let late = delay(u, tau)
modes drive {
  low  { equation x: der(x) = -rate*x + v*0.1 [1/s] }
  high { equation x: der(x) = gain*late }
  low -> high when late rises above 0.5 { reset x = 2*x }
}
";

#[test]
fn a_transition_that_a_late_input_triggers_moves_with_the_delay() {
    let system = model(LATE_SWITCH);
    let times: Vec<f64> = (0..=20).map(f64::from).collect();
    let step = |at: f64| times.iter().map(|t| f64::from(u8::from(*t >= at))).collect::<Vec<f64>>();
    // With τ = 3 s the late jump falls on a sample. Where v jumps there as well, derivatives are those
    // to a later transition, before which v acts.
    for (tau, v_from, by_v) in [(3.5, 30.0, 0.0), (3.0, 30.0, 0.0), (3.0, 7.0, 2.0 * 0.1)] {
        let (u, v) = (step(4.0), step(v_from));
        let columns = [("u", &u), ("v", &v)];
        let columns = columns.map(|(name, values)| InputColumn {
            name,
            interpolation: Interpolation::Hold,
            values,
        });
        let inputs = Inputs::recorded(&times, &columns).expect("inputs");
        let p = [tau, 0.2, 0.3];
        let solution = run_with(&system, &p, &inputs, &times).expect("a solution");
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        let values = simulate(&problem, &times, &options()).expect("a solution");
        for found in [&solution, &values] {
            assert_eq!(found.events.len(), 1);
            assert_close(&[found.events[0].t], &[4.0 + tau]);
        }
        // x = 2 e^(−r t_e) + g (t − t_e) behind t_e = 4 + τ
        for (k, &t) in times.iter().enumerate().filter(|(_, t)| **t > 4.0 + tau) {
            let t_e = 4.0 + tau;
            let before = (-0.2 * t_e).exp();
            assert_close(solution.y(k), &[2.0 * before + 0.3 * (t - t_e)]);
            assert_close(values.y(k), &[2.0 * before + 0.3 * (t - t_e)]);
            let exact = [by_v - 0.4 * before - 0.3, -2.0 * t_e * before, t - t_e];
            assert_close(&slopes(&system, &solution, "x", k), &exact);
        }
    }
}

#[test]
fn outputs_are_late_with_the_modes_and_conditions_of_the_time_they_are_read_at() {
    let system = model(
        "
parameter tau  [s] = 5
parameter t_on [s] = 10.5
parameter top  [1] = 2
state x = 1
let on = if time > t_on then 1 else 0
modes way {
  up   { equation x: der(x) = 0.25 [1/s] * on }
  down { equation x: der(x) = -0.5 [1/s] }
  up -> down when x rises above top
}
output late  [1]   = delay(on*x, tau)
output slope [1/s] = delay(der(x), tau)
output early [1/s] = delay(der(x), -2 [s])
",
    );
    let p = parameters(&system);
    let inputs = Inputs::none();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let times: Vec<f64> = (0..=30).map(f64::from).collect();
    let solution = simulate_with_sensitivities(&problem, &times, &options()).expect("a solution");
    let observed = observe(&problem, &solution);
    // It rises from 10.5 s on, by one in four seconds, and falls from 14.5 s on.
    let slope = |t: f64| match t {
        t if t < 10.5 => 0.0,
        t if t < 14.5 => 0.25,
        _ => -0.5,
    };
    for (k, &t) in times.iter().enumerate() {
        let s = t - 5.0;
        // Where it falls: x = top − (t − t_top)/2 with t_top = t_on + 4 (top − 1).
        let (x, dx) = match s {
            s if s < 10.5 => (0.0, [0.0; 3]),
            s if s < 14.5 => (1.0 + 0.25 * (s - 10.5), [-0.25, -0.25, 0.0]),
            _ => (2.0 - 0.5 * (s - 14.5), [0.5, 0.5, 3.0]),
        };
        assert_close(observed.w(k), &[x, slope(s), slope(t + 2.0)]);
        let found: Vec<f64> =
            observed.dw(k).chunks(3).map(|of_parameter| of_parameter[0]).collect();
        assert_close(&found, &dx);
    }
}

#[test]
fn a_condition_on_a_time_that_is_past_switches_at_its_own_time() {
    let system = model(
        "
parameter tau  [s] = 2.25
parameter t_on [s] = 3
state x = 0
equation x: der(x) = delay(if time > t_on then 1 else 0, tau) * 1 [1/s]
",
    );
    let solution = run(&system, &[0.0, 5.0, 6.0, 10.0]);
    assert_close(&solution.y, &[0.0, 0.0, 0.75, 4.75]);
    for k in [2, 3] {
        assert_close(&slopes(&system, &solution, "x", k), &[-1.0, -1.0]);
    }
}

/// Slow below a threshold, fast above it, at rest where there is nothing.
const DECAY: &str = "
parameter x_0 = 2
parameter limit = 1
parameter a [1/s] = 0.1
parameter b [1/s] = 0.7
input gain
state x = x_0*gain
unknown rate [1/s] = 0
equation loss: der(x) = -rate*x
modes speed {
  slow { equation rate: rate = a }
  fast { equation rate: rate = b }
  rest { equation rate: rate = 0 [1/s] }
  fast -> slow when x falls below limit
  start rest if not x > 0 and a > 0 [1/s]
  start fast if x > limit
  start slow
}
";

/// A constant input.
fn held(name: &str, value: f64) -> Inputs {
    let column = InputColumn { name, interpolation: Interpolation::Hold, values: &[value, value] };
    Inputs::recorded(&[0.0, 10.0], &[column]).expect("a recording")
}

#[test]
fn the_mode_to_start_in_is_chosen_by_conditions() {
    let system = model(DECAY);
    let times = [0.0, 0.5];
    for (x_0, gain, rate) in
        [(2.0, 1.0, 0.7), (0.5, 1.0, 0.1), (0.5, 4.0, 0.7), (1.0, 1.0, 0.1), (-1.0, 1.0, 0.0)]
    {
        let p = [x_0, 1.0, 0.1, 0.7];
        let inputs = held("gain", gain);
        let solution = run_with(&system, &p, &inputs, &times).expect("a solution");
        assert!(solution.events.is_empty(), "{:?}", solution.events);
        let fading = (-rate * 0.5_f64).exp();
        let x = x_0 * gain * fading;
        assert_close(solution.y(1), &[x, rate]);
        assert_eq!(solution.y(0), [x_0 * gain, rate]);
        // x₀ g e^(−r t) by x₀, the limit, a and b.
        let by = |which: f64| if rate == which { -0.5 * x } else { 0.0 };
        let slopes = slopes(&system, &solution, "x", 1);
        assert_close(&slopes, &[gain * fading, 0.0, by(0.1), by(0.7)]);
        // Start values that are given from outside choose, too.
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[(0, 3.0)] };
        let given = simulate(&problem, &times, &options()).expect("a solution");
        assert_close(given.y(1), &[3.0 * (-0.35_f64).exp(), 0.7]);
        let start = consistent_start(&problem, 0.0, &options()).expect("a start");
        assert_eq!((start.y[1], start.z[0]), (0.7, 1.0));
    }
}

#[test]
fn transitions_go_on_from_the_mode_that_was_chosen() {
    let system = model(DECAY);
    let solution = run_with(&system, &[4.0, 1.0, 0.1, 0.7], &held("gain", 1.0), &[0.0, 3.0]);
    let solution = solution.expect("a solution");
    // From 4 to 1 in ln 4/b, then slowly.
    let t = 4.0_f64.ln() / 0.7;
    let x = (-0.1 * (3.0 - t)).exp();
    assert_eq!(solution.events.len(), 1);
    assert_close(&[solution.events[0].t, solution.y(1)[0]], &[t, x]);
    // x = e^(−a (T − t)) with t = ln(x₀/l)/b, times l.
    let by_t = 0.1 * x;
    let expected = [by_t / (4.0 * 0.7), x - by_t / 0.7, -(3.0 - t) * x, -by_t * t / 0.7];
    assert_close(&slopes(&system, &solution, "x", 1), &expected);
}

#[test]
fn a_state_is_algebraic_from_the_start_where_the_mode_says_so() {
    // An empty tank that is filled: the level stays, what comes in overflows.
    let text = "
parameter h_0 [m] = 1
parameter q [m/s] = 0.2
state h [m] = h_0
unknown spilt [m/s] = 0
modes tank {
  filling { equation level: der(h) = q
            equation rim: spilt = 0 [m/s] }
  full { equation level: h = 3 [m]
         equation rim: spilt = q }
  filling -> full when h rises above 3 [m]
  start full if h_0 >= 3 [m]
}
";
    let system = model(text);
    let at =
        |h_0: f64| run_with(&system, &[h_0, 0.2], &Inputs::none(), &[0.0, 5.0]).expect("a run");
    let full = at(4.0);
    assert_close(full.y(1), &[3.0, 0.2]);
    assert_close(&slopes(&system, &full, "h", 1), &[0.0, 0.0]);
    assert_close(&slopes(&system, &full, "spilt", 1), &[0.0, 1.0]);
    let filling = at(1.0);
    assert_close(filling.y(1), &[2.0, 0.0]);
    assert_close(&slopes(&system, &filling, "h", 1), &[1.0, 5.0]);
}
