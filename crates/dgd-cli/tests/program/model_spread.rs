//! `dgd fit`: the reported error of estimates of a wrong model.

use std::fmt::Write as _;

use serde_json::Value;

use crate::support::{Normal, dgd_in, folder_with};

/// A straight line fitted to a parabola.
const LINE: &[u8] = b"\
model line
input u [1] linear
parameter a [1] = 1
parameter b [1] = 1
output y [1] = a + b*u
";

#[track_caller]
fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

fn fitted(model: &[u8], data: &str, more: &[&str]) -> Value {
    let folder = folder_with(&[("m.dgd", model), ("a.csv", data.as_bytes())]);
    let args = ["fit", "m.dgd", "--data", "a.csv", "--format", "json"];
    dgd_in(folder.path(), &[&args[..], more].concat()).done().json()
}

/// a and b of y = a + b u by least squares.
fn line(rows: &[[f64; 3]]) -> [f64; 2] {
    let n = rows.len() as f64;
    let mean = |of: fn(&[f64; 3]) -> f64| rows.iter().map(of).sum::<f64>() / n;
    let (u, y) = (mean(|row| row[1]), mean(|row| row[2]));
    let products: f64 = rows.iter().map(|row| (row[1] - u) * (row[2] - y)).sum();
    let b = products / rows.iter().map(|row| (row[1] - u).powi(2)).sum::<f64>();
    [y - b * u, b]
}

/// Each part in the result, left out of a regression in closed form.
#[test]
fn the_spread_is_that_of_regressions_without_each_part() {
    let mut random = Normal(11);
    let rows: Vec<[f64; 3]> = (0..400)
        .map(|k| {
            let t = f64::from(k);
            let u = 0.005 * t + (0.05 * t).sin();
            [t, u, 2.0 + 3.0 * u + 0.4 * u * u + 0.02 * random.next()]
        })
        .collect();
    let mut data = "time [s],u [1],y [1]\n".to_owned();
    for [t, u, y] in &rows {
        let _ = writeln!(data, "{t},{u},{y}");
    }
    let result = fitted(LINE, &data, &[]);
    assert_eq!(result["left_over"]["autocorrelated"][0], "y");
    let parts = result["left_over"]["parts"].as_array().expect("parts");
    assert_eq!(parts.len(), 10, "{parts:?}");
    let whole = line(&rows);
    let mut pseudo = Vec::new();
    let mut counted = 0;
    for part in parts {
        let expected = number(&part["from"])..=number(&part["until"]);
        let rest: Vec<[f64; 3]> =
            rows.iter().filter(|row| !expected.contains(&row[0])).copied().collect();
        counted += rows.len() - rest.len();
        let without = line(&rest);
        let say = |i: usize| 10.0 * whole[i] - 9.0 * without[i];
        pseudo.push([say(0), say(1)]);
    }
    assert_eq!(counted, rows.len(), "parts are all of the recording, once");
    for (i, name) in ["a", "b"].into_iter().enumerate() {
        let mean = pseudo.iter().map(|all| all[i]).sum::<f64>() / 10.0;
        let variance = pseudo.iter().map(|all| (all[i] - mean).powi(2)).sum::<f64>() / 9.0;
        let std = number(&result["parameters"][name]["std_model"]);
        assert!((std / variance.sqrt() - 1.0).abs() < 1e-5, "{name}: {std} {variance}");
        assert!(std > 5.0 * number(&result["parameters"][name]["std"]), "{name}: {std}");
    }
    let folder = folder_with(&[("m.dgd", LINE), ("a.csv", data.as_bytes())]);
    let text = dgd_in(folder.path(), &["fit", "m.dgd", "--data", "a.csv"]).done().out;
    assert!(text.contains("std model") && text.contains("10 parts of the recordings"), "{text}");
}

/// A pipe whose modelled friction is quadratic in q; M, A and the meter's gain are those of the rig.
const PIPE: &[u8] = b"\
model pipe
input u [1] linear
input d [1] hold
parameter M [s] = 15 in 1 .. 100
parameter F [1] = 1 in 0 ..
parameter gain [1] = 1 in 0.5 .. 2
constant A [s] = 50
state q [1] = 1
state h [1] = 0
equation flow:  M * der(q) = u - F*q*abs(q)
equation level: A * der(h) = q - d
output meter [1] = gain*q
output h     [1] = h
";

/// M, and the meter's gain.
const TRUTH: [f64; 2] = [20.0, 1.05];

/// The rig, by the Runge–Kutta method: friction 1.5 q^k, a wandering pump, and an outflow that follows.
fn pipe(seed: u64, k: f64) -> String {
    let [m, gain] = TRUTH;
    let mut random = Normal(seed);
    let (mut q, mut h, mut u, mut aim) = (1.5_f64, 0.0, 3.0, 3.0);
    let mut text = "time [s],u [1],d [1],meter [1],h [1]\n".to_owned();
    for row in 0..1200 {
        if row % 40 == 0 {
            aim = 2.0 + 4.0 * random.uniform();
        }
        let before = u;
        u += (aim - u) / 8.0;
        // Rounded to thousandths, as in the file.
        u = (1000.0 * u).round() / 1000.0;
        let d = ((q + 0.2 * h) * 100.0).round() / 100.0;
        let meter = gain * q + 0.01 * random.next();
        let _ = writeln!(text, "{row},{before},{d},{meter},{}", h + 0.005 * random.next());
        let rate = |u: f64, q: f64| (u - 1.5 * q.max(0.0).powf(k)) / m;
        let steps = 20;
        let dt = 1.0 / f64::from(steps);
        for step in 0..steps {
            let value_at = |part: f64| before + (u - before) * (f64::from(step) + part) * dt;
            let k1 = rate(value_at(0.0), q);
            let k2 = rate(value_at(0.5), q + 0.5 * dt * k1);
            let k3 = rate(value_at(0.5), q + 0.5 * dt * k2);
            let k4 = rate(value_at(1.0), q + dt * k3);
            let moved = dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            // Simpson's rule, with the midpoint by cubic Hermite interpolation.
            let middle = q + 0.5 * moved + dt / 8.0 * (k1 - rate(value_at(1.0), q + moved));
            h += dt * ((q + 4.0 * middle + q + moved) / 6.0 - d) / 50.0;
            q += moved;
        }
    }
    text
}

/// For this many rigs, how often M and gain are within two deviations, and how often there is a deviation.
fn covered(rigs: u64, k: f64) -> ([usize; 2], [usize; 2]) {
    let (mut within, mut known) = ([0; 2], [0; 2]);
    for seed in 0..rigs {
        let result = fitted(PIPE, &pipe(1000 + seed, k), &["--start", "measured"]);
        for (name, truth) in ["M", "gain"].iter().zip(TRUTH) {
            let estimate = &result["parameters"][name];
            let off = (number(&estimate["value"]) - truth).abs();
            for (i, of) in ["std", "std_model"].into_iter().enumerate() {
                let Some(std) = estimate[of].as_f64() else { continue };
                known[i] += 1;
                within[i] += usize::from(off <= 2.0 * std);
            }
        }
    }
    println!("q^{k}: std and std_model hold the truth {within:?} of {known:?}");
    (within, known)
}

/// Twenty rigs with friction that the model describes wrongly.
#[test]
fn the_truth_is_within_two_deviations_of_a_wrong_model() {
    let (within, known) = covered(20, 1.5);
    assert_eq!(known, [40, 40]);
    assert!(within[0] <= 30, "{within:?}: the covariance takes the model for right");
    assert!(within[1] >= 36, "{within:?}");
}

/// For a correct model the residuals are noise; chance makes one in a hundred fail.
#[test]
fn a_right_model_has_one_deviation() {
    let (within, known) = covered(20, 2.0);
    assert_eq!(known[0], 40);
    assert!(
        within[0] >= 34,
        "{within:?}: Binomial(40, 0.954) is below with a probability of 0.005"
    );
    assert!(known[1] <= 4, "{known:?}");
}

/// An impulse that only one sample determines: its model error cannot be estimated.
#[test]
fn an_estimate_that_rests_on_one_part_is_said_to() {
    let mut random = Normal(5);
    let mut data = "time [s],u [1],y [1]\n".to_owned();
    for k in 0..400_i32 {
        let u = if k == 250 { 10.0 } else { 0.0 };
        let drift = 0.3 * (0.02 * f64::from(k)).sin();
        let _ = writeln!(data, "{k},{u},{}", 1.0 + 2.0 * u + drift + 0.05 * random.next());
    }
    let result = fitted(LINE, &data, &[]);
    assert!(result["parameters"]["b"]["std_model"].is_null());
    assert!(result["parameters"]["a"]["std_model"].is_number());
    let part = &result["left_over"]["rests_on_part"]["b"];
    let part = &result["left_over"]["parts"][part.as_u64().expect("a part") as usize];
    assert!(number(&part["from"]) <= 250.0 && 250.0 <= number(&part["until"]), "{part}");
    let folder = folder_with(&[("m.dgd", LINE), ("a.csv", data.as_bytes())]);
    let text = dgd_in(folder.path(), &["fit", "m.dgd", "--data", "a.csv"]).done().out;
    assert!(text.contains("`b` rests on one part"), "{text}");
}

/// White residuals of three times the declared noise.
#[test]
fn residuals_beyond_the_declared_noise_are_left_over() {
    let mut random = Normal(6);
    let mut data = "time [s],u [1],y [1]\n".to_owned();
    for k in 0..400 {
        let u = (0.1 * f64::from(k)).sin();
        let _ = writeln!(data, "{k},{u},{}", 1.0 + 2.0 * u + 0.3 * random.next());
    }
    let model = String::from_utf8_lossy(LINE).replace("a + b*u", "a + b*u noise 0.1 [1]");
    let run_by = |noise: &str| fitted(model.as_bytes(), &data, &["--noise", noise]);
    let declared = run_by("declared");
    assert_eq!(declared["left_over"]["exceeds_declared_noise"], true);
    let value_of = |what: &str| number(&declared["parameters"]["b"][what]);
    // √10 times three of the declared, and the scatter of a standard deviation of ten numbers.
    let ratio = value_of("std_model") / value_of("std") / (3.0 * 10f64.sqrt());
    assert!((0.4..1.7).contains(&ratio), "{ratio}");
    assert!(run_by("estimated")["left_over"].is_null());
}
