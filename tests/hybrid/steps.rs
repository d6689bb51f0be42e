//! `floor` and what is made of it, as events: states, times and sensitivities against closed forms and differences.

use dgd_runtime::{
    AutomatonKind, Inputs, IntegrateError, Options, Problem, System, UndefinedCause, observe,
    simulate, simulate_with_sensitivities,
};

use crate::exact::{
    assert_close, assert_slopes_are_differences, options, parameters, run, run_with, slopes, value,
};
use crate::inline::{compiled, system};
use crate::support::{interpreted, native};

/// Rodas5P's error after the few hundred steps of these cases stays within a factor of a hundred of
/// the tolerance of 1e-11.
const CLOSE: f64 = 1e-8;

/// Kinds of the automata and number of the clocks of a model with this row.
fn made_of(row: &str) -> (Vec<AutomatonKind>, usize) {
    let text = format!(
        "model m\nparameter a = 0.3\ninput u hold\nstate q = 1\nstate p = 2\n\
         equation one: der(q) = 1 [1/s]*({row})\nequation two: der(p) = -1 [1/s]*q*u"
    );
    let system = system(&text);
    let discrete = &system.signature().discrete;
    (discrete.automata.iter().map(|automaton| automaton.kind).collect(), discrete.clocks.len())
}

#[test]
fn steps_of_time_are_clocks_and_steps_of_what_moves_are_events() {
    for row in ["floor(time/1 [s])", "mod(time, a*2 [s])/1 [s]", "round(3 - a*time/2 [s])"] {
        assert_eq!(made_of(row), (vec![], 1), "{row}");
    }
    for row in ["floor(q*p)", "q - ceil(q)", "round(sin(time/1 [s]))"] {
        assert_eq!(made_of(row), (vec![AutomatonKind::Step], 0), "{row}");
    }
    // What only samples move steps at samples.
    for row in ["floor(u)", "floor(a)", "floor(3.7)"] {
        assert_eq!(made_of(row), (vec![], 0), "{row}");
    }
    // A switch that acts only where a step is far away, or not at the start.
    let [step, switch] = [AutomatonKind::Step, AutomatonKind::Switch];
    for far in ["0.32", "8", "-50"] {
        let row = |steps: &str| made_of(&format!("if p > q and {steps} > {far} then q else 0.3"));
        assert_eq!(row("floor(3*q)"), (vec![step, switch], 0), "{far}");
        assert_eq!(row("ceil(1.42*time/1 [s])"), (vec![switch], 1), "{far}");
    }
    // Kinks, and a jump of 2 π; what is smooth is none.
    assert_eq!(made_of("clamp(q, 0, a)").0, [AutomatonKind::Corner; 2]);
    assert_eq!(made_of("hypot(q, 0)").0, [AutomatonKind::Corner]);
    assert_eq!(made_of("atan2(q, p)").0, [AutomatonKind::Switch]);
    assert_eq!(made_of("smoothstep(0, a, q) + hypot(q, p) + erf(q) + atan2(a, p)").0, []);
}

#[test]
fn every_function_that_came_later_has_the_solution_that_is_known() {
    let system = interpreted("models/more_intrinsics.dgd", &[]);
    let (p, inputs) = (parameters(&system), Inputs::none());
    let times: Vec<f64> = (0..=80).map(|k| 0.1 * f64::from(k)).collect();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let solution = simulate(&problem, &times, &options()).expect("a run");
    let observations = observe(&problem, &solution);
    let names = &system.signature().outputs;
    for (k, t) in times.iter().enumerate() {
        for (output, w) in names.iter().zip(observations.w(k)) {
            let is_gap = output.name.starts_with("gap_");
            assert!(!is_gap || w.abs() <= CLOSE, "{} at {t}: {w:e}", output.name);
        }
    }
    // x = 0.73: not at a step, where derivatives are others on both sides.
    assert_slopes_are_differences(&system, &inputs, &[0.0, 7.3], 1e-6);
    let machine = native("models/more_intrinsics.dgd", &[]);
    let problem = Problem { system: &machine, p: &p, inputs: &inputs, start: &[] };
    let same = simulate(&problem, &times, &options()).expect("a run");
    assert_eq!(same.y, solution.y);
}

/// x' = floor(y), y = c t²/2 by itself: y passes n at √(2 n/c).
#[test]
fn a_state_that_counts_another_has_its_times() {
    let system = system(
        "model count\nparameter c = 3\nstate x = 0\nstate v = 0\nstate y = 0\n\
         equation v: der(v) = c/1 [s]\nequation y: der(y) = v/1 [s]\nequation x: der(x) = floor(y)/1 [s]",
    );
    let (c, t) = (3.0_f64, 2.4_f64);
    let passed: Vec<f64> =
        (1..20).map(|n| (2.0 * f64::from(n) / c).sqrt()).take_while(|at| *at < t).collect();
    let expected: f64 = passed.iter().map(|at| t - at).sum();
    // d(−√(2n/c))/dc = √(2n/c)/(2c)
    let slope: f64 = passed.iter().map(|at| 0.5 * at / c).sum();
    assert_eq!(passed.len(), 8);
    let solution = run(&system, &[0.0, t]);
    assert_close(&[value(&system, &solution, "x", 1)], &[expected], CLOSE);
    assert_close(&slopes(&system, &solution, "x", 1), &[slope], CLOSE);
}

/// A start at 7.3 steps, and a reset by several.
#[test]
fn steps_begin_where_values_are_and_follow_resets() {
    let system = system(
        "model far\nstate y = 7.3\nstate x = 0\nequation y: der(y) = -1 [1/s]\nequation x: der(x) = floor(y)/1 [s]\n\
         when time rises above 0.5 [s] { reset y = -40.2 }",
    );
    let solution = run(&system, &[0.0, 0.25, 0.5, 1.0]);
    let found: Vec<f64> = (0..4).map(|k| value(&system, &solution, "x", k)).collect();
    // 7 to 0.3, 6 from there; −41 from 0.5 on, and −40.2 − 0.5 is above −41.
    assert_close(&found, &[0.0, 1.75, 2.1 + 1.2, 2.1 + 1.2 - 20.5], CLOSE);
}

#[test]
fn a_step_that_is_pushed_back_is_an_error_that_says_when() {
    let system = system(
        "model chatter\nstate x = 0.5\nequation x: der(x) = (0.5 - floor(x + 1))/1 [s]\noutput x",
    );
    // x falls to 0, where floor(x + 1) goes from 1 to 0 and back.
    let failure = run_with(&system, &[], &Inputs::none(), &[0.0, 3.0]).expect_err("no way on");
    match failure.error {
        IntegrateError::EndlessEvents { t, automaton, .. } => {
            assert!((t - 1.0).abs() < 1e-6, "{t}");
            assert_eq!(automaton, "floor of x + 1");
        }
        other => panic!("{other}"),
    }
}

/// T of the house at t, hours and kelvin above outside: exponentials from switch to switch.
fn house(t: f64, [morning, evening, tau, warming, _]: [f64; 5]) -> f64 {
    let (mut above, mut now) = (15.0, 0.0);
    for day in 0.. {
        let midnight = 24.0 * f64::from(day);
        let stretches = [(morning, false), (evening, true), (24.0, false)];
        for (end, heats) in stretches.map(|(end, heats)| ((midnight + end).min(t), heats)) {
            let limit = if heats { warming * tau } else { 0.0 };
            above = limit + (above - limit) * (-(end - now) / tau).exp();
            now = end;
            if end == t {
                return above;
            }
        }
    }
    unreachable!("days do not end")
}

#[test]
fn a_day_comes_again() {
    let system = interpreted("models/night_setback.dgd", &[]);
    let p = parameters(&system);
    let own = [6.0, 22.0, 30.0, 0.9, 0.0];
    let hours: Vec<f64> = (0..50).map(|k| 0.3 + 2.6 * f64::from(k)).collect();
    let times: Vec<f64> = std::iter::once(0.0).chain(hours.iter().map(|h| 3600.0 * h)).collect();
    let solution = run(&system, &times);
    for (k, t) in hours.iter().enumerate() {
        let found = value(&system, &solution, "T", k + 1) - p[4];
        assert_close(&[found], &[house(*t, own)], CLOSE);
    }
    // Per hour and per kelvin; `outside` lifts all but what the start leaves.
    let found = slopes(&system, &solution, "T", times.len() - 1);
    for j in 0..4 {
        let central = |h: f64| {
            let moved = |step: f64| {
                let mut p = own;
                p[j] += step;
                house(hours[hours.len() - 1], p)
            };
            (moved(h) - moved(-h)) / (2.0 * h)
        };
        let h = 1e-3 * own[j];
        let expected = (4.0 * central(0.5 * h) - central(h)) / 3.0;
        // The warming is in K/h.
        let found = if j == 3 { found[j] / 3600.0 } else { found[j] * 3600.0 };
        assert!(
            (found - expected).abs() <= 1e-6 * expected.abs().max(1.0),
            "{j}: {found} {expected}"
        );
    }
}

/// atan2 goes from π to −π where y falls below zero behind the origin.
#[test]
fn an_angle_jumps_behind_the_origin() {
    let system = system(
        "model turn\nparameter w = 1.3\nstate x = -1\nstate y = 0.5\nstate s = 0\n\
         equation x: der(x) = 0 [1/s]\nequation y: der(y) = -w/1 [s]\nequation s: der(s) = atan2(y, x)/1 [s]",
    );
    let t = 0.9;
    // With θ = atan2: ∫ θ dt = ∫ θ dy/(−w); ∫ atan2(y, −1) dy = π y sign(y) − (y atan y − ln(1 + y²)/2).
    let primitive =
        |y: f64| std::f64::consts::PI * y.abs() - (y * y.atan() - 0.5 * (1.0 + y * y).ln());
    let integral = |w: f64| (primitive(0.5) - primitive(0.5 - w * t)) / w;
    let solution = run(&system, &[0.0, t]);
    assert_close(&[value(&system, &solution, "s", 1)], &[integral(1.3)], CLOSE);
    let h = 1e-3;
    let wide = (integral(1.3 + h) - integral(1.3 - h)) / (2.0 * h);
    let narrow = (integral(1.3 + 0.5 * h) - integral(1.3 - 0.5 * h)) / h;
    assert_close(&slopes(&system, &solution, "s", 1), &[(4.0 * narrow - wide) / 3.0], 1e-7);
}

#[test]
fn what_steps_is_not_differentiated() {
    let error = std::panic::catch_unwind(|| {
        compiled(
            "model tied\nstate h = 1\nunknown q\nequation h: der(h) = q/1 [s]\n\
             equation hold: h = floor(time/1 [s])",
        )
    });
    let text = error.expect_err("a mistake");
    let text = text.downcast_ref::<String>().expect("a message");
    assert!(text.contains("E404") && text.contains("floor"), "{text}");
}

/// Bins that fill row by row: yᵢ counts how often xᵢ = kᵢ t has passed `lev`, over time.
const BINS: &str = "model bins
    size N = 3
    parameter k[1..N] [1/s] = (1, 1.3, 1.7)
    parameter lev = 0.55
    state x[1..N] = 0
    state y[1..N] = 0
    for i in 1..N {
      equation x[i]: der(x[i]) = k[i]
      equation y[i]: der(y[i]) = STEP/1 [s]
    }";

/// After n steps y = n t − Σ m lev/k, so dy/dlev = −n (n + 1)/(2 k) and dy/dk = lev n (n + 1)/(2 k²).
#[test]
fn rows_of_a_loop_step_where_their_own_states_do() {
    let angle = "(atan2(sin(2*pi*(x[i]/lev - 0.5)), cos(2*pi*(x[i]/lev - 0.5))) * (-1/(2*pi)) + x[i]/lev - 0.5)";
    for step in ["floor(x[i]/lev)", "(ceil(x[i]/lev) - 1)", angle] {
        let system = system(&BINS.replace("STEP", step));
        for until in [0.4, 1.0, 2.0, 3.1] {
            let solution = run(&system, &[0.0, until]);
            assert!(solution.undefined.is_empty(), "{:?}", solution.undefined);
            for (i, k) in [1.0, 1.3, 1.7].into_iter().enumerate() {
                let name = format!("y[{}]", i + 1);
                let n = (k * until / 0.55).floor();
                let sum = 0.5 * n * (n + 1.0);
                let y = value(&system, &solution, &name, 1);
                assert!((y - (n * until - sum * 0.55 / k)).abs() < CLOSE, "{step}: {name} = {y}");
                let mut expected = vec![0.0; 4];
                expected[0] = -sum / k;
                expected[1 + i] = 0.55 * sum / (k * k);
                assert_close(&slopes(&system, &solution, &name, 1), &expected, CLOSE);
            }
        }
    }
}

/// More rows than can have events: values are followed, derivatives are not.
#[test]
fn rows_that_jump_unseen_have_no_sensitivities() {
    for (row, jumps) in [
        ("1 + floor(y[i]/lev)", true),
        ("if y[i] > lev then 2 else 1", true),
        ("max(y[i], lev)", false),
    ] {
        let text = format!(
            "model many\nsize N = 10001\nparameter lev = 0.55\nstate y[1..N] = 0.1\n\
             for i in 1..N {{\n  equation y[i]: 1 [s]*der(y[i]) = {row}\n}}"
        );
        let system = system(&text);
        let p = parameters(&system);
        let problem = Problem { system: &system, p: &p, inputs: &Inputs::none(), start: &[] };
        let options = Options::default();
        let solution =
            simulate_with_sensitivities(&problem, &[0.0, 0.3], &options).expect("a solution");
        assert_eq!(solution.s(1).iter().all(|s| s.is_nan()), jumps, "{row}");
        let causes: Vec<UndefinedCause> = solution.undefined.iter().map(|u| u.cause).collect();
        let expected: &[UndefinedCause] = if jumps { &[UndefinedCause::Unlocated] } else { &[] };
        assert_eq!(causes, expected, "{row}");
    }
}

/// A run that begins on a threshold which a parameter moves.
#[test]
fn a_start_on_a_threshold_has_one_sided_derivatives() {
    let listed = |row: &str, start: &str| -> Vec<Vec<String>> {
        let text = format!(
            "model m\nparameter x0 = 1\nparameter lev = 1\nparameter k [1/s] = 0.5\n\
             state x = {start}\nstate y = 0\nequation x: der(x) = -k*x\nequation y: der(y) = {row}"
        );
        let solution = run(&system(&text), &[0.0, 1.0]);
        assert!(solution.undefined.is_empty(), "{row}: {:?}", solution.undefined);
        solution.one_sided.into_iter().map(|start| start.directions).collect()
    };
    let none: [Vec<String>; 0] = [];
    let both = [vec!["x0".to_owned(), "lev".to_owned()]];
    let jump = "if x < lev then 1 [1/s] else 3 [1/s]";
    assert_eq!(listed(jump, "x0"), both);
    assert_eq!(listed("floor(x/lev)/1 [s]", "x0"), both);
    assert_eq!(listed(jump, "1"), [vec!["lev".to_owned()]]);
    assert_eq!(listed(jump, "1.1*x0"), none);
    // A corner that the solution leaves has one slope.
    assert_eq!(listed("max(x, lev)/1 [s]", "x0"), none);
    let when = "1 [1/s]\nwhen x falls below lev { reset y = y + 1 }";
    assert_eq!(listed(when, "x0"), both);
}
