//! The drilling rig that the recordings with hidden effects come from: its own invariants, and that
//! the model explains what it records when nothing is hidden.

use dgd_runtime::{
    EvaluationPoint, InputColumn, Inputs, Interpolation, Options, Problem, System, simulate,
};

use crate::drilling_rig::effects::{LIBRARY, OUTSIDE};
use crate::drilling_rig::plant::{
    A_R, BoosterLine, Controls, G, H_IN, H_OUT, LPM, Plant, RHO, State,
};
use crate::drilling_rig::recording::{HEADER, Recording, Row};
use crate::drilling_rig::sensors::Noise;
use crate::drilling_rig::{Scenario, record};
use crate::reduced_model::riser::dynamic_flow::{Model, Parameters};

const F_B: f64 = 6e7;
const M_B: f64 = 4e7;

fn plant() -> Plant {
    Plant {
        inertia: 1.1e8,
        c0: 275.0,
        exponent: 2.0,
        c2: 9.0e3,
        f2: 1.75e8,
        speed_lag: 0.02,
        booster_line: None,
        influx: None,
        ageing: None,
        valve: None,
        f4: 0.0,
        wear: 0.0,
        plugging: None,
        density_step: None,
    }
}

fn draining_plant() -> Plant {
    let booster_line = Some(BoosterLine { inertia: M_B, friction: F_B });
    Plant { booster_line, ..plant() }
}

/// Runs a second at a time with the booster flow given at every second, in so many steps a second;
/// `seen` gets every step's time and state.
fn run(
    plant: &Plant,
    start: State,
    boost: &[f64],
    top_fill: f64,
    steps: u32,
    mut seen: impl FnMut(f64, &State),
) -> State {
    let mut state = start;
    seen(0.0, &state);
    for (k, pair) in boost.windows(2).enumerate() {
        let since = k as f64;
        let controls = Controls {
            since,
            reference: start.speed,
            speed_before: state.speed,
            boost: pair[0],
            boost_slope: pair[1] - pair[0],
            top_fill,
        };
        for step in 0..steps {
            let at = |step: u32| since + f64::from(step) / f64::from(steps);
            state = plant.advance(at(step), &state, &controls, at(step + 1));
            seen(at(step + 1), &state);
        }
    }
    state
}

/// At rest with that level and those flows.
fn at_rest(plant: &Plant, h_r: f64, boost: f64, top_fill: f64) -> State {
    let q_ssp = boost + top_fill;
    let speed = plant.steady_speed(h_r, q_ssp);
    State { h_r, h_b: 0.0, q_ssp, q_bo: boost, speed, draining: false }
}

/// Full flow, stopped for five minutes within `ramp` seconds, and full flow again.
fn stop_and_go(flow: f64, ramp: f64) -> Vec<f64> {
    let down = |t: f64| (1.0 - (t - 60.0) / ramp).clamp(0.0, 1.0);
    let up = |t: f64| ((t - 360.0) / ramp).clamp(0.0, 1.0);
    (0..=700).map(|k| flow * down(f64::from(k)).max(up(f64::from(k)))).collect()
}

#[test]
fn steady_state_is_that_of_the_hand_calculation() {
    // 275 ω² = 50 − 5 + (9000 + 1.75e8/(1120·9.81)) 0.04²  m  = 84.884 m
    let plant = plant();
    let rest = at_rest(&plant, 50.0, 0.036, 0.004);
    assert!((rest.speed - (84.884f64 / 275.0).sqrt()).abs() < 1e-5, "{}", rest.speed);

    // Level and flow stay there, and come back from elsewhere: with the time constant
    // 2 (c2 + F2/(ρ g)) A_r q = 394 s, 5 m shrink by e^(-15) in 6000 s.
    let boost = vec![0.036; 6001];
    let end = run(&plant, rest, &boost, 0.004, 5, |_, _| {});
    assert!((end.h_r - 50.0).abs() < 1e-9 && (end.q_ssp - 0.04).abs() < 1e-12);
    let end = run(&plant, State { h_r: 55.0, ..rest }, &boost, 0.004, 5, |_, _| {});
    assert!((end.h_r - 50.0).abs() < 1e-5, "{}", end.h_r);
}

#[test]
fn a_stopped_rig_comes_to_rest_where_inlet_and_outlet_balance() {
    let plant = plant();
    let rest = State { h_r: H_IN - H_OUT, q_ssp: 0.0, ..at_rest(&plant, 5.0, 0.0, 0.0) };
    assert_eq!(rest.speed, 0.0);
    let still = vec![0.0; 10_801];
    let end = run(&plant, rest, &still[..101], 0.0, 5, |_, _| {});
    assert!((end.h_r - 5.0).abs() < 1e-12 && end.q_ssp.abs() < 1e-12);

    // From 1 m off, M A_r ẍ = −ρ g x − F A_r² ẋ|ẋ| swings with a period of 280 s and 1/amplitude
    // grows by 8/3 F A_r / M = 1.3 per metre and swing: 2 cm after 3 h.
    let mut last_swing: f64 = 0.0;
    run(&plant, State { h_r: 6.0, ..rest }, &still, 0.0, 5, |t, state| {
        if t > 10_500.0 {
            last_swing = last_swing.max((state.h_r - 5.0).abs());
        }
    });
    assert!((0.01..0.03).contains(&last_swing), "{last_swing}");
}

#[test]
fn no_mud_is_lost() {
    let plant = draining_plant();
    let (flow, top_fill) = (0.036, 0.004);
    let boost = stop_and_go(flow, 17.0);
    let start = at_rest(&plant, 50.0, flow, top_fill);
    let mut drained: f64 = 0.0;
    let (mut out, mut before) = (0.0, start.q_ssp);
    let end = run(&plant, start, &boost, top_fill, 20, |t, state| {
        if t > 0.0 {
            out += 0.05 * before.midpoint(state.q_ssp);
        }
        before = state.q_ssp;
        drained = drained.max(state.h_b);
    });
    // The line drained far, and is full again.
    assert!(drained > 40.0 && end.h_b == 0.0 && !end.draining, "{drained} {end:?}");

    // A_r Δh_r = ∫ (q_ssp − q_boost − q_tf) dt, since Δh_b = 0. The trapezoidal rule is off by at
    // most h²/12 times the variation of q̇_ssp, which stays below 2e-4 m³/s² and comes and goes
    // with each of the two ramps and as the line opens and is full: 4e-7 m³.
    let pumped: f64 = boost.windows(2).map(|pair| pair[0].midpoint(pair[1])).sum();
    let balance = A_R * (end.h_r - start.h_r) - (out - pumped - 700.0 * top_fill);
    assert!(balance.abs() < 4e-7, "{balance} m³");
}

#[test]
fn the_booster_line_opens_when_its_top_is_at_the_pressure_of_the_air_and_drains_to_the_riser() {
    let plant = draining_plant();
    let (flow, ramp) = (0.036, 20.0);
    let mut boost = stop_and_go(flow, ramp);
    boost.truncate(360);
    boost.resize(2000, 0.0);
    let mut opened = None;
    let start = at_rest(&plant, 50.0, flow, 0.004);
    let end = run(&plant, start, &boost, 0.004, 100, |t, state| {
        if state.draining && opened.is_none() {
            opened = Some((t, state.h_r));
        }
    });
    // F_b q + M_b dq/dt = ρ g h_r with q = flow (1 − (t − 60)/ramp), found within a step of 0.01 s.
    let (t, h_r) = opened.expect("the line opens");
    let q = (RHO * G * h_r + M_B * flow / ramp) / F_B;
    let expected = 60.0 + ramp * (1.0 - q / flow);
    assert!((expected..expected + 0.02).contains(&t), "{t} {expected}");

    // A_b ḣ_b = q_bo ≈ ρ g (h_r − h_b)/F_b: the levels meet with a time constant of 56 s, and the
    // riser's own drift behind which the line lags is slow by then.
    assert!((end.h_b - end.h_r).abs() < 0.05 && end.q_bo.abs() < 1e-5, "{end:?}");
    let never = run(&self::plant(), start, &boost, 0.004, 5, |_, s| assert!(!s.draining));
    assert_eq!((never.h_b, never.q_bo), (0.0, 0.0));
}

#[test]
fn the_error_falls_with_the_fourth_power_of_the_step_across_changes_of_mode() {
    let plant = Plant { speed_lag: 10.0, ..draining_plant() };
    let boost = stop_and_go(0.036, 17.0);
    let start = State { h_r: 52.0, ..at_rest(&plant, 50.0, 0.036, 0.004) };
    // At the end and half-way, while the line is not full.
    let levels = |steps: u32| {
        let mut half_way = 0.0;
        let end = run(&plant, start, &boost, 0.004, steps, |t, state| {
            if t == 300.0 {
                half_way = state.h_b;
            }
        });
        [half_way, end.h_r]
    };
    let exact = levels(80);
    let [coarse, fine] = [5, 10].map(|steps| {
        let found = levels(steps);
        (found[0] - exact[0]).abs().max((found[1] - exact[1]).abs())
    });
    assert!(coarse < 1e-9, "{coarse:e}");
    assert!((10.0..30.0).contains(&(coarse / fine)), "{coarse:e} {fine:e}");
}

#[test]
fn a_scenario_is_the_same_text_every_time() {
    let scenario = Scenario::drawn(3, 12.0, &["booster_u_tubing"]).expect("a known effect");
    let (once, again) = (record(&scenario), record(&scenario));
    assert_eq!(once.train.csv(), again.train.csv());
    assert_eq!(once.valid.csv(), again.valid.csv());
    assert_ne!(once.train.csv(), once.valid.csv());
    let text = once.train.csv();
    assert_eq!(text.lines().next(), Some(HEADER));
    assert_eq!(text.lines().count(), 1 + 12 * 60 + 1);
    assert!(text.lines().all(|line| line.split(',').count() == 8));

    let other = Scenario { seed: 4, ..scenario };
    assert_ne!(record(&other).train.csv(), once.train.csv());
}

#[test]
fn every_effect_has_a_name_and_shows() {
    let healthy = Scenario::new(11, 30.0, Vec::new());
    for name in LIBRARY.iter().chain(&OUTSIDE) {
        let scenario = Scenario::drawn(11, 30.0, &[name]).expect("a known effect");
        let listed = if OUTSIDE.contains(name) { "?" } else { name };
        assert_eq!(scenario.effects[0].name(), listed);
        assert!(!scenario.effects[0].sizes().is_empty());
        assert_ne!(record(&scenario).train.rows, record(&healthy).train.rows, "{name}");
    }
    assert!(Scenario::drawn(1, 30.0, &["ghost"]).is_none());
}

/// Residuals of p_r, p_in, p_out, q_ssp over their noise, with the rig's own parameters and start.
fn residuals(plant: &Plant, recording: &Recording) -> [Vec<f64>; 4] {
    let rows = &recording.rows;
    let column = |of: fn(&Row) -> f64| -> Vec<f64> { rows.iter().map(of).collect() };
    let times = column(|row| row.time);
    let speeds = column(|row| row.w_ssp / 100.0);
    let boosts = column(|row| row.q_boost * LPM);
    let fills = column(|row| row.q_tf * LPM);
    let columns = [
        InputColumn { name: "w_ssp", interpolation: Interpolation::Hold, values: &speeds },
        InputColumn { name: "q_boost", interpolation: Interpolation::Linear, values: &boosts },
        InputColumn { name: "q_tf", interpolation: Interpolation::Hold, values: &fills },
    ];
    let inputs = Inputs::recorded(&times, &columns).expect("inputs");
    let p: [f64; 6] = Parameters {
        M_ssp: plant.inertia,
        c0: plant.c0,
        c2: plant.c2,
        F2: plant.f2,
        ..Parameters::default()
    }
    .into();
    let start = [(0, recording.hidden[0].h_r), (1, recording.hidden[0].q_ssp)];
    let problem = Problem { system: &Model, p: &p, inputs: &inputs, start: &start };
    // A relative error of 1e-6 is 5e-5 m of the level, 5 Pa: half a percent of the noise.
    let options = Options { rtol: 1e-6, atol: 1e-6, ..Options::default() };
    let solution = simulate(&problem, &times, &options).expect("a run");

    let Noise { p_r, p_in, p_out, q_ssp } = Noise::FIELD;
    let mut residuals: [Vec<f64>; 4] = Default::default();
    for (k, row) in rows.iter().enumerate() {
        let u = [speeds[k], boosts[k], fills[k]];
        let mut w = [0.0; 4];
        Model.outputs(
            EvaluationPoint { t: times[k], y: solution.y(k), u: &u, p: &p, z: &[] },
            &mut w,
        );
        let read = [row.p_r * 1e5, row.p_in * 1e5, row.p_out * 1e5, row.q_ssp * LPM];
        for (i, sigma) in [p_r, p_in, p_out, q_ssp].into_iter().enumerate() {
            residuals[i].push((read[i] - w[i]) / sigma);
        }
    }
    residuals
}

fn mean_square(r: &[f64]) -> f64 {
    r.iter().map(|r| r * r).sum::<f64>() / r.len() as f64
}

/// Correlation of each residual with the next.
fn whiteness(r: &[f64]) -> f64 {
    r.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / (r.len() as f64 * mean_square(r))
}

#[test]
fn the_model_explains_a_healthy_rig_to_the_noise_and_no_other() {
    let pair = record(&Scenario::new(21, 40.0, Vec::new()));
    for recording in [&pair.train, &pair.valid] {
        let n = recording.rows.len() as f64;
        for (i, r) in residuals(&pair.rig.plant, recording).iter().enumerate() {
            // Five standard deviations of either, for white noise.
            let (square, next) = (mean_square(r), whiteness(r));
            assert!((square - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{i}: {square}");
            assert!(next.abs() < 5.0 / n.sqrt(), "{i}: {next}");
        }
    }
    for name in LIBRARY {
        let pair = record(&Scenario::drawn(21, 40.0, &[name]).expect("a known effect"));
        let worst = residuals(&pair.rig.plant, &pair.train)
            .iter()
            .map(|r| mean_square(r))
            .fold(0.0, f64::max);
        assert!(worst > 3.0, "{name}: {worst}");
    }
}

#[test]
fn the_recordings_of_the_repository_are_those_of_the_example() {
    let scenario = Scenario::drawn(8000, 45.0, &["booster_u_tubing"]).expect("a known effect");
    let pair = record(&scenario);
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data/booster_stop");
    for (part, recording) in [("train", &pair.train), ("valid", &pair.valid)] {
        let file = std::fs::read_to_string(format!("{folder}.{part}.csv")).expect("a file");
        let found = recording.csv();
        assert_eq!(file.lines().count(), found.lines().count());
        assert_eq!(file.lines().next(), found.lines().next());
        // The mathematics library of another platform may round the last of five digits otherwise.
        for (expected, found) in file.lines().zip(found.lines()).skip(1) {
            for (expected, found) in expected.split(',').zip(found.split(',')) {
                let [a, b] = [expected, found].map(|x| x.parse::<f64>().expect("a number"));
                assert!((a - b).abs() <= 2e-4 * a.abs() + 1e-9, "{expected} {found}");
            }
        }
    }
}
