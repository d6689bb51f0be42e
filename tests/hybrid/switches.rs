//! `if`, `min`, `max`, `abs` and `sign` as events, and solutions that slide along them.

use dgd_runtime::{
    AutomatonKind, InputColumn, Inputs, Interpolation, Options, Problem, System,
    simulate_with_sensitivities,
};

use crate::exact::{
    assert_close, assert_slopes_are_differences, event_times, options, parameters, run, run_with,
    slopes, value,
};
use crate::inline::system;

/// Rodas5P's error after the few hundred steps of these cases stays within a factor of a hundred of
/// the tolerance of 1e-11.
const CLOSE: f64 = 1e-8;

fn kinds(row: &str) -> Vec<AutomatonKind> {
    let text = format!(
        "model m\nparameter a = 0.3\nstate q = 1\nstate p = 2\n\
         equation one: der(q) = 1 [1/s]*({row})\nequation two: der(p) = -1 [1/s]*q"
    );
    let system = system(&text);
    system.signature().discrete.automata.iter().map(|automaton| automaton.kind).collect()
}

#[test]
fn only_what_does_not_go_on_smoothly_is_an_event() {
    let smooth = [
        "-q*abs(q)",
        "-a*q*abs(q) - q",
        "-q*sqrt(abs(q))",
        "-(if q > 0 then q^2 else -q^2)",
        "if q > a then (q - a)^2 else 0",
        "max(q - a, 0)^3",
        "abs(q)^2",
        "p*(if a > 0.2 then 1 else 2)",
    ];
    for row in smooth {
        assert_eq!(kinds(row), [], "{row}");
    }
    let corners = [
        "abs(q)",
        "max(q, p)",
        "min(q - a, 0)*p",
        "if q > a then 2*(q - a) else 0",
        "if q > 0 then sqrt(q) else 0",
        "abs(q)*p",
    ];
    for row in corners {
        assert_eq!(kinds(row), [AutomatonKind::Corner], "{row}");
    }
    for row in ["sign(q)", "if q > a then 2 else 1", "if q <= a then p else 0"] {
        assert_eq!(kinds(row), [AutomatonKind::Switch], "{row}");
    }
    assert_eq!(kinds("if q > a and q < p then 2 else 1"), [AutomatonKind::Switch; 2]);
    assert_eq!(kinds("sign(q - a) + abs(a - q)"), [AutomatonKind::Switch]);
}

#[test]
fn a_jump_of_a_rate_is_located_and_moves_with_its_threshold() {
    let system = system(
        "model m
         parameter a = 2
         parameter low [1/s] = 1
         parameter high [1/s] = 3
         state x = 0
         state y = 0
         equation one: der(x) = low
         equation two: der(y) = if x > a then high else low",
    );
    let solution = run(&system, &[0.0, 5.0]);
    assert_close(solution.y(1), &[5.0, 2.0 + 9.0], CLOSE);
    assert_close(&event_times(&solution), &[2.0], CLOSE);
    // y = low t₁ + high (5 − t₁) with t₁ = a/low.
    assert_close(&slopes(&system, &solution, "y", 1)[..3], &[-2.0, 6.0, 3.0], CLOSE);
    assert!(solution.statistics.steps < 20, "{:?}", solution.statistics);
}

#[test]
fn a_window_of_ten_seconds_in_an_hour_is_not_stepped_over() {
    let system = system(
        "model m
         parameter a [s] = 1500
         parameter length [s] = 10
         parameter rate = 0.3
         state x [s] = 0
         state y [s] = 0
         equation one: der(x) = 1
         equation two: der(y) = if x > a and x < a + length then rate else 0",
    );
    let solution = run(&system, &[0.0, 3600.0]);
    assert_close(&[value(&system, &solution, "y", 1)], &[3.0], CLOSE);
    assert_close(&slopes(&system, &solution, "y", 1)[..3], &[0.0, 0.3, 10.0], CLOSE);
    assert_close(&event_times(&solution), &[1500.0, 1510.0], CLOSE);
}

#[test]
fn a_threshold_passed_and_passed_back_within_a_step_is_found() {
    // x turns back 0.05 beyond the threshold; with these rates steps are as long as they like.
    let system = system(
        "model m
         parameter a = 0.95
         state x = 0
         state y = 0
         equation one: der(x) = 2e-3 [1/s]*(1 - 1e-3 [1/s]*time)
         equation two: der(y) = if x > a then 1 [1/s] else 0",
    );
    // x = 1 − (1 − t/1000)² is above a for 2000 √(1 − a) seconds.
    let solution = run(&system, &[0.0, 2000.0]);
    let above = 2000.0 * 0.05_f64.sqrt();
    assert_close(&[value(&system, &solution, "y", 1)], &[above], CLOSE);
    assert_close(&slopes(&system, &solution, "y", 1)[..1], &[-1000.0 / 0.05_f64.sqrt()], CLOSE);
}

#[test]
fn a_corner_costs_no_accuracy() {
    let system = system(
        "model m
         parameter a = 0.7
         state x = 0
         state y = 0
         equation one: der(x) = 1 [1/s]
         equation two: der(y) = max(x - a, 0)*1 [1/s]",
    );
    let solution = run(&system, &[0.0, 3.0]);
    assert_close(solution.y(1), &[3.0, 0.5 * 2.3 * 2.3], CLOSE);
    assert_close(&slopes(&system, &solution, "y", 1)[..1], &[-2.3], CLOSE);
    assert!(solution.events.is_empty(), "nothing has changed: {:?}", solution.events);
    assert!(solution.statistics.steps < 80, "{:?}", solution.statistics);
}

/// A block that slides on a floor, pulled by a rope.
const BLOCK: &str = "model block
input pull [N] linear
parameter m [kg] = 2
parameter friction [N] = 3
parameter v_0 [m/s] = 4
state x [m] = 0
state v [m/s] = v_0
equation way: der(x) = v
equation momentum: m * der(v) = pull - friction*sign(v)
";

fn pulled(times: &[f64], values: &[f64]) -> Inputs {
    let column = InputColumn { name: "pull", interpolation: Interpolation::Linear, values };
    Inputs::recorded(times, &[column]).expect("inputs")
}

#[test]
fn a_block_slides_and_stops_for_good() {
    let block = system(BLOCK);
    let inputs = pulled(&[0.0, 100.0], &[0.0, 0.0]);
    let p = parameters(&block);
    let solution = run_with(&block, &p, &inputs, &[0.0, 1.0, 5.0, 100.0]).expect("a solution");
    let [m, f, v] = [2.0, 3.0, 4.0];
    let way = 0.5 * m * v * v / f;
    for k in [2, 3] {
        assert_close(&solution.y(k)[..2], &[way, 0.0], CLOSE);
        let expected = [way / m, -way / f, m * v / f];
        assert_close(&slopes(&block, &solution, "x", k)[..3], &expected, CLOSE);
        assert_close(&slopes(&block, &solution, "v", k)[..3], &[0.0; 3], CLOSE);
    }
    assert_close(&event_times(&solution), &[m * v / f, m * v / f], CLOSE);
    // As long as it rests nothing happens, and nothing is done.
    assert!(solution.statistics.steps < 40, "{:?}", solution.statistics);
}

#[test]
fn a_block_rests_until_it_is_pulled_hard_enough() {
    let block = system(BLOCK);
    // From rest the pull rises by 1 N/s: it breaks away at 3 s.
    let inputs = pulled(&[0.0, 8.0], &[0.0, 8.0]);
    let p = [2.0, 3.0, 0.0];
    let times = [0.0, 1.5, 3.0, 5.0];
    let solution = run_with(&block, &p, &inputs, &times).expect("a solution");
    assert_close(&solution.y(1)[..2], &[0.0, 0.0], CLOSE);
    // Half of what friction can hold pulls: share = (1 + 1/2)/2.
    assert_close(&[solution.y(1)[2]], &[0.75], CLOSE);
    // Then m v̇ = t − 3: v = (t − 3)²/(2m), x = (t − 3)³/(6m).
    assert_close(&solution.y(3)[..2], &[8.0 / 12.0, 1.0], CLOSE);
    // To the mass and the friction; ∂v/∂F = −(t − F)/m.
    assert_close(&slopes(&block, &solution, "v", 3)[..2], &[-0.5, -1.0], CLOSE);
    assert_close(&slopes(&block, &solution, "x", 3)[..2], &[-1.0 / 3.0, -1.0], CLOSE);
}

#[test]
fn friction_through_an_algebraic_force_slides_as_well() {
    let block = system(
        "model block
         input pull [N] linear
         parameter m [kg] = 2
         parameter friction [N] = 3
         parameter v_0 [m/s] = 4
         state x [m] = 0
         state v [m/s] = v_0
         unknown force [N] = 0
         equation way: der(x) = v
         equation momentum: m * der(v) = force
         equation rope: 0 = pull - force - friction*sign(v)",
    );
    let inputs = pulled(&[0.0, 4.0, 20.0], &[0.0, 0.0, 8.0]);
    let p = parameters(&block);
    let times = [0.0, 1.0, 3.5, 8.0, 14.0];
    let solution = run_with(&block, &p, &inputs, &times).expect("a solution");
    // It stops at 8/3 s after 16/3 m, rests until the pull of 0.5 N/s is 3 N at 10 s, and then
    // m v̇ = (t − 10)/2.
    assert_close(&solution.y(2)[..2], &[16.0 / 3.0, 0.0], CLOSE);
    assert_close(&solution.y(3)[..2], &[16.0 / 3.0, 0.0], CLOSE);
    assert_close(&solution.y(4)[..2], &[16.0 / 3.0 + 64.0 / 24.0, 2.0], CLOSE);
    assert_slopes_are_differences(&block, &inputs, &times, 1e-5);
}

#[test]
fn a_mass_on_a_belt_sticks_and_slips() {
    let oscillator = system(
        "model oscillator
         parameter m [kg] = 1
         parameter k [N/m] = 4
         parameter c [N*s/m] = 0.1
         parameter friction [N] = 2
         parameter v_b [m/s] = 0.5
         parameter v_s [m/s] = 1
         state x [m] = 0
         state v [m/s] = 0
         function drag(w [m/s]) = friction*sign(w)/(1 + abs(w)/v_s)
         equation way: der(x) = v
         equation momentum: m * der(v) = -k*x - c*v + drag(v_b - v)",
    );
    let solution = run(&oscillator, &[0.0, 20.0]);
    // Mode by mode with SciPy's DOP853, rtol 1e-13: state at 20 s, and when it sticks and slips.
    assert_close(&solution.y(1)[..2], &[0.591_997_329_28, 0.447_124_632_58], CLOSE);
    let changes = [
        0.337_787_515_83,
        1.149_140_342_04,
        3.582_503_599_14,
        4.876_028_494_10,
        7.309_391_751_20,
        8.602_916_646_17,
        11.036_279_903_27,
        12.329_804_798_23,
        14.763_168_055_33,
        16.056_692_950_30,
        18.490_056_207_40,
        19.783_581_102_37,
    ];
    let mut found = event_times(&solution);
    // It enters the far side of the surface and slides along it at one time.
    found.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    assert_close(&found, &changes, CLOSE);
    // Differences of the same, extrapolated once: good to about 1e-5.
    let by_x = [-3.306_16, 1.261_08, 2.587_77, -0.998_473, 3.528_736, 0.824_576];
    let by_v = [3.858_23, -1.601_15, -3.109_01, 1.428_637, -2.943_857, -0.938_221];
    assert_close(&slopes(&oscillator, &solution, "x", 1)[..6], &by_x, 1e-5);
    assert_close(&slopes(&oscillator, &solution, "v", 1)[..6], &by_v, 1e-5);
}

#[test]
fn what_slips_off_a_belt_that_gathers_speed_leaves_it_for_good() {
    // It leaves tangentially, where errors within the tolerance look like a return.
    for friction in [19, 20, 21] {
        let load = system(&format!(
            "model load
             parameter F [N] = {friction}
             state stretch [m] = 0  nominal 0.01
             state v [m/s] = 0  nominal 0.1
             let slip = 0.1 [m/s] + 0.04 [m/s^2]*time - v
             equation spring: der(stretch) = v
             equation mass: 2 [kg]*der(v) = F*sign(slip)/(1 + abs(slip)/0.5 [m/s]) - 400 [N/m]*stretch"
        ));
        assert_slopes_are_differences(&load, &Inputs::none(), &[0.0, 3.0], 1e-5);
    }
}

#[test]
fn two_blocks_stick_at_one_time_and_pull_each_other() {
    // Both stick from the start; the pull breaks the first away, whose spring takes the second along.
    let blocks = system(
        "model blocks
         parameter rate [N/s] = 1
         parameter f_1 [N] = 1
         parameter f_2 [N] = 2
         parameter k [N/m] = 3
         state x_1 [m] = 0
         state v_1 [m/s] = 0
         state x_2 [m] = 0
         state v_2 [m/s] = 0
         let spring = k*(x_1 - x_2) + 2 [N*s/m]*(v_1 - v_2)
         equation way_1: der(x_1) = v_1
         equation way_2: der(x_2) = v_2
         equation momentum_1: 1 [kg]*der(v_1) = rate*time - spring - f_1*sign(v_1)
         equation momentum_2: 1 [kg]*der(v_2) = spring - f_2*sign(v_2)",
    );
    let solution = run(&blocks, &[0.0, 0.5, 2.0, 8.0]);
    assert_close(&solution.y(1)[..4], &[0.0; 4], CLOSE);
    let x_2 = value(&blocks, &solution, "x_2", 2);
    assert!(x_2.abs() < 1e-12, "the second still sticks: {x_2}");
    assert!(value(&blocks, &solution, "x_2", 3) > 0.1);
    assert_slopes_are_differences(&blocks, &Inputs::none(), &[0.0, 8.0], 1e-5);
}

#[test]
fn a_relay_without_hysteresis_holds_its_level_without_chattering() {
    let relay = system(
        "model relay
         parameter level = 1
         parameter gain [1/s] = 2
         state x = 0
         state on [s] = 0
         equation tank: der(x) = (if x < level then gain else 0) - 0.5 [1/s]*x
         equation counter: der(on) = if x < level then 1 else 0",
    );
    let solution = run(&relay, &[0.0, 1.0, 50.0]);
    // It is at the level after ln(4/3)/0.5, and holds it with a quarter of the gain.
    let reached = 2.0 * f64::ln(4.0 / 3.0);
    assert_close(&solution.y(2)[..1], &[1.0], CLOSE);
    let on = value(&relay, &solution, "on", 2);
    assert_close(&[on], &[reached + 0.25 * (50.0 - reached)], CLOSE);
    // To the level, in closed form: x holds it, dt₁/dL = 2/(4 − L), and the share is L/4.
    assert_close(&slopes(&relay, &solution, "x", 2)[..2], &[1.0, 0.0], CLOSE);
    let by_level = 2.0 / 3.0 * 0.75 + 0.25 * (50.0 - reached);
    assert_close(&slopes(&relay, &solution, "on", 2)[..1], &[by_level], CLOSE);
    assert!(solution.statistics.steps < 60, "{:?}", solution.statistics);
}

/// A stirred tank that a PI controller heats: its command is clamped, and its integral waits at a clamp.
const TANK: &str = "model heated_tank
constant cp [J/(kg*K)] = 4186
constant rho [kg/m^3] = 1000
parameter V [l] = 120
parameter UA [W/K] = 20
parameter Pmax [kW] = 6
parameter Kp [%/°C] = 8
parameter Ti [min] = 5
parameter warmer [K] = 0
input T_set [°C]
input q [lpm]
state T [°C] = 293.15 [K] + warmer
state I [%] = 0
let e = T_set - T
let cmd = Kp*e + I
let duty = min(max(cmd, 0), 1)
equation controller: der(I) = if (cmd > 1 and e > 0) or (cmd < 0 and e < 0) then 0 else Kp*e/Ti
equation heat: rho*V*cp*der(T) = rho*q*cp*(12 [°C] - T) + Pmax*duty - UA*(T - 19 [°C])
";

#[test]
fn a_clamped_controller_slides_along_its_clamp_and_leaves_it() {
    let tank = system(TANK);
    let changes: [(f64, f64, f64); 15] = [
        (0.0, 20.0, 1.3),
        (600.0, 55.0, 1.3),
        (1500.0, 55.0, 0.5),
        (2400.0, 55.0, 1.3),
        (3900.0, 55.0, 0.5),
        (4800.0, 55.0, 1.3),
        (5400.0, 65.0, 1.3),
        (6300.0, 65.0, 0.5),
        (7200.0, 65.0, 1.3),
        (8700.0, 65.0, 0.5),
        (9600.0, 48.0, 1.3),
        (11100.0, 48.0, 0.5),
        (12000.0, 48.0, 1.3),
        (13500.0, 48.0, 0.5),
        (14400.0, 48.0, 0.5),
    ];
    let at = changes.map(|(t, ..)| t);
    let sets = changes.map(|(_, celsius, _)| 273.15 + celsius);
    let flows = changes.map(|(.., lpm)| lpm / 6e4);
    let held = |name, values| InputColumn { name, interpolation: Interpolation::Hold, values };
    let columns = [held("T_set", &sets[..]), held("q", &flows[..])];
    let inputs = Inputs::recorded(&at, &columns).expect("inputs");
    let times: Vec<f64> = (0..=144).map(|k| 100.0 * f64::from(k)).collect();
    // At first the command starts on its clamp, where rounding decides on which side of it.
    for start in [0.0, 0.01, 0.5, 1.0] {
        let mut p = parameters(&tank);
        p[5] = start;
        for rtol in [1e-6, 1e-8] {
            let options = Options { rtol, atol: rtol, ..Options::default() };
            let problem = Problem { system: &tank, p: &p, inputs: &inputs, start: &[] };
            let solution = simulate_with_sensitivities(&problem, &times, &options);
            let solution = solution.expect("a solution");
            assert!(solution.undefined.is_empty(), "{start}: {:?}", solution.undefined);
            assert!(solution.events.len() < 30, "{start}: {:?}", solution.events);
            assert!(solution.statistics.steps < 1000, "{start}: {:?}", solution.statistics);
            let slid = solution.events.iter().filter(|event| &*event.to == "sliding").count();
            assert!(slid > 0, "it slides along its clamp: {:?}", solution.events);
        }
    }
    // Where it starts on its clamp, one that starts warmer does something else than one that starts colder.
    let on_clamp = system(&TANK.replace("parameter warmer", "constant warmer"));
    assert_slopes_are_differences(&on_clamp, &inputs, &times, 1e-5);
    let warmer = system(&TANK.replace("warmer [K] = 0", "warmer [K] = 0.5"));
    assert_slopes_are_differences(&warmer, &inputs, &times, 1e-5);
}

/// x falls, and the elements follow it.
const FOLLOWING: &str = "model m
    size N = 4
    parameter k = 1
    parameter c = 0.3
    state x = 1
    state z[1..N] = 0
    state q = 0
    equation x: der(x) = -k*x/1 [s]
    for i in 1..N { equation z[i]: der(z[i]) = (x - z[i])/1 [s] }
";

#[test]
fn elements_of_arrays_switch_like_other_unknowns() {
    let rows = [
        ("if z[4] > x then 1 else 0", AutomatonKind::Switch),
        ("if z[2] > c then z[1] else 2", AutomatonKind::Switch),
        ("sign(z[3] - c)", AutomatonKind::Switch),
        ("max(z[4] - x, 0)", AutomatonKind::Corner),
        ("abs(z[N] - c)", AutomatonKind::Corner),
    ];
    for (row, kind) in rows {
        let system = system(&format!("{FOLLOWING}equation q: der(q) = ({row})/1 [s]"));
        let automata = &system.signature().discrete.automata;
        assert_eq!(automata.iter().map(|a| a.kind).collect::<Vec<_>>(), [kind], "{row}");
        assert_slopes_are_differences(&system, &Inputs::none(), &[0.0, 2.0], 1e-5);
    }
}

#[test]
fn the_row_of_an_element_switches_beside_loops() {
    let system = system(
        "model m
         size N = 4
         parameter c = 0.3
         parameter v = 1
         state x = 0
         state z[1..N] = 0
         equation x: der(x) = v/1 [s]
         equation first: der(z[1]) = (if x > c then 1 else 0)/1 [s]
         for i in 2..N { equation z[i]: der(z[i]) = (if x > 1 and time > 0.5 [s] then z[i-1] else 2)/1 [s] }",
    );
    let times = [0.0, 2.0];
    let solution = run(&system, &times);
    // z₁ = v (t - c/v) from x = c on.
    assert_close(&solution.y(1)[1..=2], &[1.7, 2.0 + 1.2], CLOSE);
    assert_slopes_are_differences(&system, &Inputs::none(), &times, 1e-6);
}

#[test]
fn rows_of_loops_jump_one_by_one() {
    let system = system(
        "model m
         size N = 4
         parameter k = 1
         parameter c = 0.3
         state x = 1
         state z[1..N] = 0
         state w[1..N] = 1
         equation x: der(x) = -k*x/1 [s]
         for i in 1..N { equation z[i]: der(z[i]) = (if z[i] > c*i/2 then 0.1 else x)/1 [s] }
         for i in 1..N { equation w[i]: der(w[i]) = -sign(w[i] - i*c)/1 [s] }",
    );
    let times = [0.0, 3.0];
    let solution = run(&system, &times);
    assert_close(&solution.y(1)[solution.n - 4..], &[0.3, 0.6, 0.9, 1.2], CLOSE);
    assert_slopes_are_differences(&system, &Inputs::none(), &times, 1e-6);
}

#[test]
fn a_jump_that_another_condition_mostly_hides_is_an_event() {
    // At random places q*p^2 is hardly ever above 1000.
    let row = "if q < a and (q + 5)*p^2 > 1000 then p else 0";
    assert_eq!(kinds(row), [AutomatonKind::Switch; 2]);
    let smooth = "if q < 0 then 0 else if q < 1 then q^2*(3 - 2*q) else 1";
    assert_eq!(kinds(smooth), []);
    // q = p matters only while p is between 1 and 1.47, however often each condition holds by itself; p = 1
    // never does, as q is above it where it could.
    let row = "if (1 < q and ((p >= 1.47 or q > p) or 1 > p)) and 1 >= a*q then 1 else a";
    assert_eq!(kinds(row), [AutomatonKind::Switch; 4]);
    // Both matter only together, and before a time.
    let row = "if time < 1.38 [s] and (q - time/1 [s] < p and 1.9 <= 2*p) then 0.01*a else 1";
    assert_eq!(kinds(row), [AutomatonKind::Switch; 2]);
}

#[test]
fn an_element_is_held_where_a_solution_slides() {
    let text = format!("{FOLLOWING}equation q: der(q) = -sign(q - z[1] + c)/0.1 [s]");
    let system = system(&text);
    let times = [0.0, 2.0];
    let solution = run(&system, &times);
    // z₁ = t exp(-t) for k = 1, and q = z₁ - c.
    let q = 2.0 * (-2.0_f64).exp() - 0.3;
    assert_close(&[value(&system, &solution, "q", 1)], &[q], CLOSE);
    assert_slopes_are_differences(&system, &Inputs::none(), &times, 1e-6);
}

#[test]
fn a_surface_that_jumps_where_another_switch_changes_is_slid_along() {
    // Below x = 1 the row is 1, above it -1, as x + 1 > 2.
    for (level, parameter) in [("2", ""), ("a", "parameter a = 1.8")] {
        let system = system(&format!(
            "model m
             {parameter}
             state x = 0
             equation x: der(x) = -sign((if x > 1 then x + 1 else x*x) - {level})/1 [s]"
        ));
        let solution = run(&system, &[0.0, 0.5, 3.0]);
        let x: Vec<f64> = (0..3).map(|k| value(&system, &solution, "x", k)).collect();
        assert_close(&x, &[0.0, 0.5, 1.0], CLOSE);
    }
}

#[test]
fn surfaces_that_are_one_slide_together() {
    let system = system(
        "model m
         parameter v = 3
         state x = 0
         equation x: der(x) = (if 2*x > 2 then -v else v)/1 [s] - sign(x - 1)/1 [s]",
    );
    assert_eq!(system.signature().discrete.automata.len(), 1);
    let solution = run(&system, &[0.0, 0.1, 3.0]);
    let x: Vec<f64> = (0..3).map(|k| value(&system, &solution, "x", k)).collect();
    assert_close(&x, &[0.0, 0.4, 1.0], CLOSE);
}

#[test]
fn conditions_on_what_was_move_with_the_delay() {
    let system = system(
        "model m
         parameter tau [s] = 0.5
         parameter k = 1
         state x = 1
         state y = 0
         equation x: der(x) = -k*x/1 [s]
         equation y: der(y) = (if delay(x, tau) > 0.5 then 1 else 0)/1 [s]",
    );
    let solution = run(&system, &[0.0, 2.0]);
    // y = tau + log(2)/k.
    let half = 2.0_f64.ln();
    assert_close(&[value(&system, &solution, "y", 1)], &[0.5 + half], CLOSE);
    assert_close(&slopes(&system, &solution, "y", 1), &[1.0, -half], 1e-6);
}

#[test]
fn flat_crossings_move_like_others() {
    for condition in ["q^3 > 0", "q^5 > 0", "q*abs(q) > 0", "exp(q^3) > 1", "(q - 1)^3 > -1"] {
        let system = system(&format!(
            "model m
             parameter a = 0.5
             state q = -1
             state y = 0
             equation q: der(q) = a/1 [s]
             equation y: der(y) = (if {condition} then 1 else 0)/1 [s]"
        ));
        let solution = run(&system, &[0.0, 3.0]);
        // y = t - 1/a.
        // exp(q^3) is 1 to rounding for q up to 6e-6.
        assert_close(&[value(&system, &solution, "y", 1)], &[1.0], 1e-5);
        let slope = slopes(&system, &solution, "y", 1);
        if solution.undefined.is_empty() {
            assert_close(&slope, &[4.0], 1e-4);
        } else {
            assert!(slope[0].is_nan(), "{condition}: {slope:?}");
        }
    }
}

#[test]
fn a_surface_far_from_the_sizes_of_what_it_reads_is_found() {
    let row = "if exp(-q/0.01) > 1e-20 then 1 else 2";
    assert_eq!(kinds(row), [AutomatonKind::Switch]);
}

dgd::model!("tests/hybrid/conditions.dgd");

/// The only rows of the model's array are loops of one, and its condition has a constant in it.
#[test]
fn generated_code_knows_constants_in_conditions_and_loops_of_one() {
    let text = include_str!("conditions.dgd");
    let (loaded, generated) = (system(text), conditions::Model);
    let p = parameters(&loaded);
    let times = [0.0, 1.0, 2.0];
    let loaded = run(&loaded, &times);
    let problem = Problem { system: &generated, p: &p, inputs: &Inputs::none(), start: &[] };
    let generated = simulate_with_sensitivities(&problem, &times, &options()).expect("a solution");
    for k in 0..times.len() {
        assert_eq!(loaded.y(k), generated.y(k));
        assert_eq!(loaded.s(k), generated.s(k));
    }
    assert_eq!(loaded.events.len(), 2);
}

#[test]
fn a_solution_leaves_a_surface_whose_switch_is_taken_out() {
    let system = system(
        "model m
         parameter k = 0.7
         parameter at = 0.2
         state x = 1
         state y = 0
         equation x: der(x) = -k*x/1 [s]
         equation y: der(y) = (if x > 0.6 then -sign(y - at) else 1)/1 [s]",
    );
    let times = [0.0, 0.5, 2.0];
    let solution = run(&system, &times);
    // x is 0.6 at log(1/0.6)/k.
    let leaves = (1.0_f64 / 0.6).ln() / 0.7;
    let y: Vec<f64> = (0..3).map(|k| value(&system, &solution, "y", k)).collect();
    assert_close(&y, &[0.0, 0.2, 0.2 + 2.0 - leaves], CLOSE);
    assert_slopes_are_differences(&system, &Inputs::none(), &times, 1e-6);
}

#[test]
fn a_jump_that_the_sign_of_a_temperature_hides_is_located() {
    // At random, a temperature of the size of one kelvin is always below 20 °C.
    let system = system(
        "model m
         parameter c = 1
         input T [°C] hold
         state x = 0
         state y = 0
         equation x: der(x) = c/1 [s]
         equation y: der(y) = sign(if x > 1 then (T - 20 [°C])/10 [K] else -1)/1 [s]",
    );
    let times = [0.0, 3.0];
    let columns =
        [InputColumn { name: "T", interpolation: Interpolation::Hold, values: &[300.0; 2] }];
    let inputs = Inputs::recorded(&times, &columns).expect("inputs");
    let solution = run_with(&system, &parameters(&system), &inputs, &times).expect("a solution");
    // y = -t until 1/c, then it rises.
    assert_close(&[value(&system, &solution, "y", 1)], &[1.0], CLOSE);
    assert_close(&slopes(&system, &solution, "y", 1), &[2.0], CLOSE);
}

#[test]
fn a_surface_that_an_input_tears_off_is_left() {
    // x rises to its threshold and slides there, until the threshold jumps below it, and above it again.
    let system = system(
        "model m
         input level [1] hold
         parameter v = 1
         state x = 0
         equation x: der(x) = (if x <= level then v else -1)/1 [s]",
    );
    let (at, levels) = ([0.0, 1.0, 1.75, 4.0], [0.5, -1.0, 2.0, 2.0]);
    let column = InputColumn { name: "level", interpolation: Interpolation::Hold, values: &levels };
    let inputs = Inputs::recorded(&at, &[column]).expect("inputs");
    let times = [0.0, 0.75, 1.0, 1.5, 1.75, 2.0];
    let p = parameters(&system);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let solution = simulate_with_sensitivities(&problem, &times, &options()).expect("a solution");
    let x: Vec<f64> = (0..times.len()).map(|k| value(&system, &solution, "x", k)).collect();
    assert_close(&x, &[0.0, 0.5, 0.5, 0.0, -0.25, 0.0], CLOSE);
    assert_slopes_are_differences(&system, &inputs, &times, 1e-6);
}

#[test]
fn a_surface_that_a_reset_tears_off_is_left() {
    // x slides on y = 0.5 until y is reset to 2 at t = 1.
    let system = system(
        "model m
         state x = 0
         state y = 0.5
         state w = 0
         equation x: der(x) = (if x <= y then 1 else -1)/1 [s]
         equation y: der(y) = 0 [1/s]
         equation w: der(w) = 1 [1/s]
         when w rises above 1 { reset y = 2 }",
    );
    let solution = run(&system, &[0.0, 0.75, 2.0, 3.0]);
    let x: Vec<f64> = (1..4).map(|k| value(&system, &solution, "x", k)).collect();
    assert_close(&x, &[0.5, 1.5, 2.0], CLOSE);
}

#[test]
fn sensitivities_are_right_behind_a_corner_at_usual_tolerances() {
    // The rate is 1/√(1 + b²) until q reaches 2 b, b = sin(a + 1)/3, and does not depend on a from there on.
    let system = system(
        "model m
         parameter a = 0.7
         state q = 0
         state x = 0
         equation q: der(q) = 1 [1/s]
         equation x: der(x) = 1/sqrt(1 + max(q/2, sin(a + 1)/3)^2)/1 [s]",
    );
    let b = 1.7_f64.sin() / 3.0;
    let expected = -2.0 * b * b * (1.7_f64.cos() / 3.0) / (1.0 + b * b).powf(1.5);
    for tolerance in [1e-5, 1e-6, 1e-8] {
        let options = Options { rtol: tolerance, atol: tolerance, ..Options::default() };
        let p = parameters(&system);
        let problem = Problem { system: &system, p: &p, inputs: &Inputs::none(), start: &[] };
        let solution = simulate_with_sensitivities(&problem, &[0.0, 1.6], &options);
        let slope = slopes(&system, &solution.expect("a solution"), "x", 1)[0];
        assert!((slope - expected).abs() < 30.0 * tolerance, "{tolerance}: {slope} {expected}");
    }
}

#[test]
fn a_solution_slides_along_an_unknown_that_an_equation_gives() {
    let text = include_str!("found/slide_unknown.dgd").replacen("model x6", "", 1);
    let unknown = system(&format!("model m\n{text}"));
    // As with `let`: x rises to 0.8 at 0.5 s, and stays.
    let by_let =
        system("model m\nlet T = 0.8 - x\nstate x = 0.3\nequation x: der(x) = sign(T)/1 [s]");
    for system in [&unknown, &by_let] {
        let solution = run(system, &[0.0, 0.25, 2.0]);
        let x = [1, 2].map(|k| value(system, &solution, "x", k));
        assert_close(&x, &[0.55, 0.8], CLOSE);
    }
}
