//! `when` and `saturate`: states, times and sensitivities against closed forms.

use std::path::Path;

use dgd_runtime::{InputColumn, Inputs, IntegrateError, Interpolation, System, UndefinedCause};

use crate::exact::{
    assert_close, assert_slopes_are_differences, event_times, run, run_with, slopes, value,
};
use crate::inline::system;

/// Rodas5P's error after the few hundred steps of these cases stays within a factor of a hundred of
/// the tolerance of 1e-11.
const CLOSE: f64 = 1e-8;

const BALL: &str = "model ball
parameter g [m/s^2] = 9.81
parameter h_0 [m] = 10
parameter e = 0.8
state x [m] = h_0
state v [m/s] = 0
equation height: der(x) = v
equation speed: der(v) = -g
when x falls below 0 [m] { reset v = -e*v }
";

/// Impact times of [`BALL`]: t₁ = √(2h/g), and then 2 eᵏ t₁ from one to the next.
fn impacts([g, h, e]: [f64; 3], n: usize) -> Vec<f64> {
    let first = (2.0 * h / g).sqrt();
    let mut times = vec![first];
    for k in 1..n {
        let flight = 2.0 * e.powi(i32::try_from(k).expect("few impacts")) * first;
        times.push(times[k - 1] + flight);
    }
    times
}

/// x and v of [`BALL`] after the k-th impact: from speed eᵏ √(2gh) at tₖ.
fn flight(t: f64, p: [f64; 3]) -> [f64; 2] {
    let [g, h, e] = p;
    let times = impacts(p, 2000);
    let k = times.iter().take_while(|impact| **impact < t).count();
    if k == 0 {
        return [h - 0.5 * g * t * t, -g * t];
    }
    let since = t - times[k - 1];
    let speed = e.powi(i32::try_from(k).expect("few impacts")) * (2.0 * g * h).sqrt();
    [speed * since - 0.5 * g * since * since, speed - g * since]
}

/// Derivatives of [`flight`], x and v to g, h₀ and e: the k-th impact moves by dtₖ, its speed by dvₖ,
/// and with s = t − tₖ
///
/// ```text
///   dx = s dvₖ − (vₖ − g s) dtₖ − s²/2 dg,   dv = dvₖ + g dtₖ − s dg
/// ```
fn flight_slopes(t: f64, p: [f64; 3]) -> [f64; 6] {
    let [g, h, e] = p;
    let times = impacts(p, 2000);
    let k = times.iter().take_while(|impact| **impact < t).count();
    if k == 0 {
        return [-0.5 * t * t, -t, 1.0, 0.0, 0.0, 0.0];
    }
    let (impact, s) = (times[k - 1], t - times[k - 1]);
    let k = i32::try_from(k).expect("few impacts");
    let speed = e.powi(k) * (2.0 * g * h).sqrt();
    // t_k = √(2h/g) (1 + 2 Σ eⁱ), i < k
    let by_e: f64 = (1..k).map(|i| f64::from(i) * e.powi(i - 1)).sum();
    let of_time = [-0.5 * impact / g, 0.5 * impact / h, 2.0 * (2.0 * h / g).sqrt() * by_e];
    let of_speed = [0.5 * speed / g, 0.5 * speed / h, f64::from(k) * speed / e];
    let of_g = [1.0, 0.0, 0.0];
    let slopes = |j: usize| {
        let x = s * of_speed[j] - (speed - g * s) * of_time[j] - 0.5 * s * s * of_g[j];
        [x, of_speed[j] + g * of_time[j] - s * of_g[j]]
    };
    let [by_g, by_h, by_e] = [0, 1, 2].map(slopes);
    [by_g[0], by_g[1], by_h[0], by_h[1], by_e[0], by_e[1]]
}

#[test]
fn a_ball_bounces_as_the_closed_form_does() {
    let ball = system(BALL);
    let p = [9.81, 10.0, 0.8];
    let times: Vec<f64> = (0..=72).map(|k| f64::from(k) * 0.125).collect();
    let solution = run(&ball, &times);
    for (k, t) in times.iter().enumerate().skip(1) {
        assert_close(solution.y(k), &flight(*t, p), CLOSE);
        assert_close(solution.s(k), &flight_slopes(*t, p), CLOSE);
    }
    assert!(solution.events.len() > 4, "{:?}", solution.events);
    assert_close(&event_times(&solution), &impacts(p, 6)[..event_times(&solution).len()], CLOSE);
    assert!(solution.undefined.is_empty());
}

#[test]
fn a_ball_bounces_as_the_reference_does() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared/data/reference/dde_hybrid/bouncing_ball.csv");
    let Ok(text) = std::fs::read_to_string(&file) else {
        println!("skipped: there is no reference in {}", file.display());
        return;
    };
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect())
        .collect();
    let times: Vec<f64> = std::iter::once(0.0).chain(rows.iter().map(|row| row[0])).collect();
    let solution = run(&system(BALL), &times);
    // The reference ends just before the fourth; the closed form goes on.
    assert_eq!(solution.events.len(), 3, "{:?}", solution.events);
    for (k, row) in rows.iter().enumerate() {
        assert_close(solution.y(k + 1), &row[1..3], CLOSE);
        assert_close(solution.s(k + 1), &row[3..9], CLOSE);
    }
}

#[test]
fn a_ball_that_comes_to_rest_is_an_error_that_says_where() {
    for e in [0.8, 0.5, 0.99, 0.05] {
        let p = [9.81, 10.0, e];
        let zeno = (2.0_f64 * p[1] / p[0]).sqrt() * (1.0 + e) / (1.0 - e);
        let times: Vec<f64> = (0..=60).map(|k| f64::from(k) * zeno / 50.0).collect();
        let failure = run_with(&system(BALL), &p, &Inputs::none(), &times).expect_err("no end");
        let IntegrateError::EndlessEvents { t, automaton, .. } = &failure.error else {
            panic!("e = {e}: {}", failure.error)
        };
        assert!((t - zeno).abs() < 1e-6 * zeno, "e = {e}: {t} is not {zeno}");
        assert_eq!(automaton, "x falls below 0 [m]");
        // What came before is there, and right.
        assert!(failure.partial.len() >= 49, "e = {e}");
        assert_close(failure.partial.y(40), &flight(times[40], p), 1e-6);
    }
}

#[test]
fn several_resets_read_what_was_just_before() {
    let swap = system(
        "model swap
         parameter a = 2
         state x = 0
         state y = 10
         equation one: der(x) = 1 [1/s]
         equation two: der(y) = 1 [1/s]*0.5
         when x rises above a {
           reset x = y - a
           reset y = x
         }",
    );
    let solution = run(&swap, &[0.0, 1.0, 3.0]);
    // At t = a: x = 10 + a/2 − a, y = a; then both go on.
    assert_close(solution.y(2), &[9.0 + 1.0, 2.0 + 0.5], CLOSE);
    // dx/da = 1/2 − 1 − 1 and dy/da = 1 − 1/2.
    assert_close(&slopes(&swap, &solution, "x", 2), &[-1.5], CLOSE);
    assert_close(&slopes(&swap, &solution, "y", 2), &[0.5], CLOSE);
}

#[test]
fn a_when_may_watch_time_and_inputs() {
    let counter = system(
        "model counter
         input u
         parameter t_1 [s] = 2.5
         state n = 0
         state m = 0
         equation count: der(n) = 0
         equation count_2: der(m) = 0.1 [1/s]
         when time rises above t_1 { reset m = m + 10 }
         when u rises above 0.5 { reset n = n + 1 }",
    );
    let samples: Vec<f64> = (0..8).map(f64::from).collect();
    let values = [0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0];
    let column = InputColumn { name: "u", interpolation: Interpolation::Hold, values: &values };
    let inputs = Inputs::recorded(&samples, &[column]).expect("inputs");
    let solution = run_with(&counter, &[2.5], &inputs, &[0.0, 3.5, 8.0]).expect("a solution");
    assert_close(solution.y(1), &[1.0, 10.35], CLOSE);
    assert_close(solution.y(2), &[3.0, 10.8], CLOSE);
}

/// A basin that rain fills and a pump empties, between its floor and its rim.
const BASIN: &str = "model basin
input q [m/s] hold
parameter rim [m] = 2
parameter floor [m] = 0.5
parameter gain = 1
state h [m] = 1
state lost [m] = 0
equation level: der(h) = gain*q
equation overflow: der(lost) = if h >= rim then gain*q else 0
saturate h >= floor
saturate h <= rim
";

#[test]
fn a_state_stays_within_both_bounds() {
    let basin = system(&BASIN.replace("if h >= rim then gain*q else 0", "0"));
    let samples = [0.0, 3.0, 8.0, 9.0];
    let column = InputColumn {
        name: "q",
        interpolation: Interpolation::Hold,
        values: &[0.5, -0.4, 0.1, 0.1],
    };
    let inputs = Inputs::recorded(&samples, &[column]).expect("inputs");
    let times = [0.0, 1.0, 2.5, 4.0, 7.5, 9.0];
    let p = [2.0, 0.5, 1.0];
    let solution = run_with(&basin, &p, &inputs, &times).expect("a solution");
    let h: Vec<f64> = (0..times.len()).map(|k| value(&basin, &solution, "h", k)).collect();
    assert_close(&h, &[1.0, 1.5, 2.0, 2.0 - 0.4, 0.5, 0.6], CLOSE);
    // To the rim, the floor and the gain: free, at the rim, falling from it, on the floor, rising.
    let expected =
        [[0.0, 0.0, 0.5], [1.0, 0.0, 0.0], [1.0, 0.0, -0.4], [0.0, 1.0, 0.0], [0.0, 1.0, 0.1]];
    for (k, expected) in expected.iter().enumerate() {
        assert_close(&slopes(&basin, &solution, "h", k + 1)[..3], expected, CLOSE);
    }
    assert_close(&event_times(&solution), &[2.0, 3.0, 3.0 + 1.5 / 0.4, 8.0], CLOSE);
}

#[test]
fn a_start_beyond_a_bound_begins_at_it() {
    let basin = system(
        "model basin
         parameter rim [m] = 2
         state h [m] = 3
         equation level: der(h) = 0.5 [m/s] - 0.25 [1/s]*h*(if time > 4 [s] then 2 else 0)
         saturate h <= rim",
    );
    let solution = run(&basin, &[0.0, 1.0, 5.0]);
    let after = 1.0 + (-0.5_f64).exp();
    assert_close(&solution.y, &[2.0, 2.0, after], CLOSE);
    assert_close(&slopes(&basin, &solution, "h", 2)[..1], &[(-0.5_f64).exp()], CLOSE);
}

#[test]
fn a_bound_can_be_a_linear_input() {
    let gate = system(
        "model gate
         input lid [m] linear
         parameter rate [m/s] = 1
         state h [m] = 0
         equation level: der(h) = rate
         saturate h <= lid",
    );
    let samples = [0.0, 4.0, 8.0];
    let column = InputColumn {
        name: "lid",
        interpolation: Interpolation::Linear,
        values: &[2.0, 4.0, 14.0],
    };
    let inputs = Inputs::recorded(&samples, &[column]).expect("inputs");
    // It meets the lid at t = 4, where the lid begins to rise faster than it can.
    let times = [0.0, 3.0, 5.0];
    let solution = run_with(&gate, &[1.0], &inputs, &times).expect("a solution");
    assert_close(&solution.y, &[0.0, 3.0, 5.0], CLOSE);
    // With twice the rate it rests against the lid from t = 4/3 on, and is free from t = 4 on.
    let solution = run_with(&gate, &[2.0], &inputs, &times).expect("a solution");
    assert_close(&solution.y, &[0.0, 3.5, 6.0], CLOSE);
    assert_close(&slopes(&gate, &solution, "h", 1)[..1], &[0.0], CLOSE);
    assert_close(&slopes(&gate, &solution, "h", 2)[..1], &[1.0], CLOSE);
}

#[test]
fn events_at_one_time_that_do_not_meet_have_their_sensitivities() {
    let balls = system(
        "model balls
         parameter h_1 [m] = 5
         parameter h_2 [m] = 5
         parameter e = 0.8
         state x_1 [m] = h_1
         state v_1 [m/s] = 0
         state x_2 [m] = h_2
         state v_2 [m/s] = 0
         equation height_1: der(x_1) = v_1
         equation speed_1: der(v_1) = -10 [m/s^2]
         equation height_2: der(x_2) = v_2
         equation speed_2: der(v_2) = -10 [m/s^2]
         when x_1 falls below 0 [m] { reset v_1 = -e*v_1 }
         when x_2 falls below 0 [m] { reset v_2 = -e*v_2 }",
    );
    let solution = run(&balls, &[0.0, 2.0]);
    let at = |h: f64| flight(2.0, [10.0, h, 0.8]);
    let slope = [0, 1].map(|i| {
        let central = |d: f64| (at(5.0 + d)[i] - at(5.0 - d)[i]) / (2.0 * d);
        (4.0 * central(5e-3) - central(1e-2)) / 3.0
    });
    let [x, v] = at(5.0);
    assert_close(solution.y(1), &[x, v, x, v], CLOSE);
    assert!(solution.undefined.is_empty(), "{:?}", solution.undefined);
    assert_close(
        &solution.s(1)[..8],
        &[slope[0], slope[1], 0.0, 0.0, 0.0, 0.0, slope[0], slope[1]],
        1e-7,
    );
}

#[test]
fn events_at_one_time_whose_order_matters_end_sensitivities() {
    let clocks = system(
        "model clocks
         parameter a = 0
         parameter b = 0
         state x = a
         state y = b
         state z = 1
         equation one: der(x) = 1 [1/s]
         equation two: der(y) = 1 [1/s]
         equation three: der(z) = 0
         when x rises above 1 { reset z = 2*z }
         when y rises above 1 { reset z = z + 1 }",
    );
    let solution = run(&clocks, &[0.0, 0.5, 2.0]);
    // In the order of the file.
    assert_close(&[value(&clocks, &solution, "z", 2)], &[3.0], CLOSE);
    let [undefined] = &solution.undefined[..] else { panic!("{:?}", solution.undefined) };
    assert_eq!(undefined.cause, UndefinedCause::Simultaneous);
    assert_eq!(undefined.equation, "x rises above 1` and `y rises above 1");
    assert_close(&[undefined.from], &[1.0], CLOSE);
    assert!(solution.s(1).iter().all(|s| s.is_finite()));
    assert!(solution.s(2).iter().all(|s| s.is_nan()));
    // With another start of one of them the order is clear.
    let solution = run_with(&clocks, &[0.0, 0.5], &Inputs::none(), &[0.0, 2.0]);
    let solution = solution.expect("a solution");
    assert_close(&[value(&clocks, &solution, "z", 1)], &[4.0], CLOSE);
    assert!(solution.undefined.is_empty());
}

/// The mud circulation with a non-return valve in its return line.
fn with_valve(variant: &str) -> String {
    let text = include_str!("../../models/mud_circulation.dgd");
    let text = text.replace("variant flow {", "saturate q_ssp >= 0 [m^3/s]\nvariant flow {");
    if variant == "dynamic" {
        return text;
    }
    let dynamic = "  dynamic { equation return_line: M * der(q_ssp) = net }\n";
    assert!(text.contains(dynamic));
    text.replace(dynamic, "")
}

#[test]
fn a_valve_keeps_the_return_line_from_flowing_back() {
    // The pump stops at 100 s, the riser fills, and at 300 s the pump starts again.
    let times = [0.0, 100.0, 300.0, 600.0];
    let (w, q_b, q_t) = ([0.9, 0.0, 0.9, 0.9], [0.02; 4], [0.002; 4]);
    let column = |name, interpolation, values| InputColumn { name, interpolation, values };
    let inputs = Inputs::recorded(
        &times,
        &[
            column("w_ssp", Interpolation::Hold, &w),
            column("q_boost", Interpolation::Linear, &q_b),
            column("q_tf", Interpolation::Hold, &q_t),
        ],
    )
    .expect("inputs");
    for variant in ["dynamic", "static"] {
        let circulation = system(&with_valve(variant));
        let p: Vec<f64> = circulation.signature().parameters.iter().map(|p| p.value).collect();
        let asked = [0.0, 99.0, 180.0, 280.0, 310.0, 600.0];
        let solution = run_with(&circulation, &p, &inputs, &asked).expect("a solution");
        let h: Vec<f64> = (0..6).map(|k| value(&circulation, &solution, "h_r", k)).collect();
        let q: Vec<f64> = (0..6).map(|k| value(&circulation, &solution, "q_ssp", k)).collect();
        assert_eq!(q[2..4], [0.0, 0.0], "{variant}");
        assert!(q[1] > 0.01 && q[4] > 0.01, "{variant}: {q:?}");
        // With the valve shut the riser fills at a constant rate.
        let area = std::f64::consts::FRAC_PI_4 * (19.75_f64 * 0.0254).powi(2);
        assert_close(&[h[2] - h[3]], &[100.0 * 0.022 / area], CLOSE);
        assert_eq!(solution.events.len(), 2, "{variant}: {:?}", solution.events);
        assert_close(&event_times(&solution)[1..], &[300.0], CLOSE);
        assert!(solution.undefined.is_empty(), "{variant}: {:?}", solution.undefined);
        assert_slopes_are_differences(&circulation, &inputs, &asked, 1e-5);
    }
}

#[test]
fn a_bound_that_jumps_takes_a_state_along_or_leaves_it_behind() {
    let gate = system(
        "model gate
         input lid [m] hold
         state h [m] = 1
         equation level: der(h) = 0.5 [m/s]
         saturate h <= lid",
    );
    // It meets the lid at 2 s, follows it up from 3 s on, is pressed down at 5 s, and at once free.
    let column = InputColumn {
        name: "lid",
        interpolation: Interpolation::Hold,
        values: &[2.0, 4.0, 1.0, 9.0, 9.0],
    };
    let inputs = Inputs::recorded(&[0.0, 3.0, 5.0, 6.0, 8.0], &[column]).expect("inputs");
    let times = [0.0, 2.5, 4.0, 5.5, 7.0];
    let solution = run_with(&gate, &[], &inputs, &times).expect("a solution");
    assert_close(&solution.y, &[1.0, 2.0, 2.5, 1.0, 1.5], CLOSE);
}
