//! `dgd linearize`: matrices computed by hand, poles, steady states, and impossible requests.

use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use crate::support::{Run, column, dgd, folder_with, path};

const MUD: &str = "models/mud_circulation.dgd";
/// Speed in %, and flows in l/min, of the mud circulation.
const CIRCULATING: &str = "time [s],w_ssp [%],q_boost [lpm],q_tf [lpm]\n0,50,1800,300\n";

/// A folder with a model and inputs.
fn folder(model: &str, data: &str) -> TempDir {
    folder_with(&[("model.dgd", model.as_bytes()), ("data.csv", data.as_bytes())])
}

/// Linearises `model.dgd` of a folder.
fn run_in(folder: &TempDir, more: &[&str]) -> Run {
    dgd(&[&["linearize", &path(folder, "model.dgd")], more].concat())
}

fn json_of(run: Run) -> Value {
    run.done().json()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

fn matrix(result: &Value, name: &str) -> Vec<Vec<f64>> {
    let rows = result[name].as_array().unwrap_or_else(|| panic!("no matrix {name}"));
    rows.iter().map(|row| row.as_array().expect("a row").iter().map(number).collect()).collect()
}

/// Real and imaginary parts of the poles.
fn poles(result: &Value) -> Vec<[f64; 2]> {
    let poles = result["poles"].as_array().expect("poles");
    poles.iter().map(|pole| [number(&pole["re"]), number(&pole["im"])]).collect()
}

#[track_caller]
fn assert_matrix(found: &[Vec<f64>], expected: &[&[f64]], relative: f64) {
    assert_eq!(found.len(), expected.len(), "rows");
    for (row, expected) in found.iter().zip(expected) {
        assert_eq!(row.len(), expected.len(), "columns");
        for (a, b) in row.iter().zip(*expected) {
            assert!((a - b).abs() <= relative * b.abs(), "{a:e} and {b:e} in {found:?}");
        }
    }
}

/// The reduced model (2.32)–(2.33), derived by hand, at the steady state for a given speed and flows.
struct ByHand {
    flow: f64,
    level: f64,
    area: f64,
    /// ∂(return line)/∂q over M, and ∂/∂ω.
    by_flow: f64,
    by_speed: f64,
    by_level: f64,
}

const RHO: f64 = 1120.0;
const G: f64 = 9.81;
const M: f64 = 1.1e8;
const C0: f64 = 275.0;
const C2: f64 = 9.0e3;
const F2: f64 = 1.75e8;
/// 1 l/min in m³/s, 1 bar in Pa.
const LPM: f64 = 1e-3 / 60.0;
const BAR: f64 = 1e5;

impl ByHand {
    fn new() -> Self {
        let (speed, flow) = (0.5, 2100.0 * LPM);
        let area = std::f64::consts::PI / 4.0 * (19.75_f64 * 0.0254).powi(2);
        // 0 = ρg(h_in − h_r) + ρg(c0 ω² − c2 q²) − F2 q² − ρg h_out
        let level =
            307.0 - 302.0 + C0 * speed * speed - C2 * flow * flow - F2 * flow * flow / (RHO * G);
        ByHand {
            flow,
            level,
            area,
            by_flow: -(2.0 * RHO * G * C2 * flow + 2.0 * F2 * flow) / M,
            by_speed: 2.0 * RHO * G * C0 * speed / M,
            by_level: -RHO * G / M,
        }
    }
}

#[test]
fn the_mud_circulation_is_as_worked_out_by_hand() {
    let folder = folder_with(&[("data.csv", CIRCULATING.as_bytes())]);
    let data = path(&folder, "data.csv");
    let args = ["linearize", MUD, "--data", &data, "--at", "steady", "--format", "json"];
    let result = json_of(dgd(&args));
    let hand = ByHand::new();
    let states = result["states"].as_array().expect("states");
    let named =
        |i: usize| (states[i]["name"].as_str().expect("a name"), number(&states[i]["value"]));
    assert_eq!((named(0).0, named(1).0), ("h_r", "q_ssp"));
    assert!((named(0).1 - hand.level).abs() < 1e-11, "{}", named(0).1);
    assert!((named(1).1 - hand.flow).abs() < 1e-15, "{}", named(1).1);
    assert_eq!(result["steady"], true);

    let inflow = -LPM / hand.area;
    let tight = 1e-12;
    assert_matrix(
        &matrix(&result, "A"),
        &[&[0.0, 1.0 / hand.area], &[hand.by_level, hand.by_flow]],
        tight,
    );
    assert_matrix(
        &matrix(&result, "B"),
        &[&[0.0, inflow, inflow], &[hand.by_speed / 100.0, 0.0, 0.0]],
        tight,
    );
    // Pressures in bar and the flow in l/min; the pump adds its head downstream.
    let weight = -RHO * G / BAR;
    let pump = -2.0 * RHO * G * C2 * hand.flow / BAR;
    assert_matrix(
        &matrix(&result, "C"),
        &[&[weight, 0.0], &[weight, 0.0], &[weight, pump], &[0.0, 1.0 / LPM]],
        tight,
    );
    let head = 2.0 * RHO * G * C0 * 0.5 / 100.0 / BAR;
    let none: &[f64] = &[0.0, 0.0, 0.0];
    assert_matrix(&matrix(&result, "D"), &[none, none, &[head, 0.0, 0.0], none], tight);

    // s² − a s − b = 0
    let half = hand.by_flow / 2.0;
    let root = (half * half + hand.by_level / hand.area).sqrt();
    for (pole, expected) in poles(&result).iter().zip([half + root, half - root]) {
        assert!((pole[0] - expected).abs() < 1e-14 && pole[1] == 0.0, "{pole:?} {expected}");
    }
    assert_eq!(result["stable"], true);
    let slow = number(&result["poles"][0]["time_constant"]);
    assert!((slow + 1.0 / (half + root)).abs() < 1e-9, "{slow}");

    // Means: the speed is held, the boost piecewise linear.
    let moving = "time [s],w_ssp [%],q_boost [lpm],q_tf [lpm]\n\
                  0,40,1700,300\n10,60,1800,300\n20,90,1900,300\n";
    let folder = folder_with(&[("data.csv", moving.as_bytes())]);
    let data = path(&folder, "data.csv");
    let args = ["linearize", MUD, "--data", &data, "--at", "mean", "--format", "json"];
    let mean = json_of(dgd(&args));
    let level = number(&mean["states"][0]["value"]);
    assert!((level - hand.level).abs() < 1e-10, "{level}");
    assert_matrix(
        &matrix(&mean, "A"),
        &[&[0.0, 1.0 / hand.area], &[hand.by_level, hand.by_flow]],
        tight,
    );
    assert_eq!(mean["steady"], true);
    dgd(&["linearize", "models/pendulum_cartesian.dgd", "--at", "mean"])
        .refused(2, &["`--data FILE`"]);
}

/// (3.17)–(3.18): the flow follows the level immediately.
#[test]
fn the_static_return_line_is_the_dynamic_one_without_inertia() {
    let folder = folder_with(&[("data.csv", CIRCULATING.as_bytes())]);
    let data = path(&folder, "data.csv");
    let value_at = |more: &[&str]| {
        let args = ["linearize", MUD, "--data", &data, "--at", "steady", "--format", "json"];
        json_of(dgd(&[&args, more].concat()))
    };
    let (moving, still) = (value_at(&[]), value_at(&["--variant", "flow=static"]));
    assert_eq!(still["eliminated"][0]["name"], "q_ssp");
    assert_eq!(still["eliminated"][0]["by"], "return_line");
    let hand = ByHand::new();
    // 0 = by_level h + by_flow q + by_speed ω
    let (level, speed) = (-hand.by_level / hand.by_flow, -hand.by_speed / hand.by_flow);
    assert_matrix(&matrix(&still, "A"), &[&[level / hand.area]], 1e-12);
    let inflow = -LPM / hand.area;
    assert_matrix(&matrix(&still, "B"), &[&[speed / 100.0 / hand.area, inflow, inflow]], 1e-12);
    assert_matrix(&matrix(&still, "C")[3..], &[&[level / LPM]], 1e-12);
    assert_matrix(&matrix(&still, "D")[3..], &[&[speed / 100.0 / LPM, 0.0, 0.0]], 1e-12);

    // The static gain of the inputs is the same: D − C A⁻¹ B.
    let moving_gain = gain_of_two(&moving);
    let a = matrix(&still, "A")[0][0];
    let (b, c, d) = (matrix(&still, "B"), matrix(&still, "C"), matrix(&still, "D"));
    for (i, row) in moving_gain.iter().enumerate() {
        for (j, gain) in row.iter().enumerate() {
            let other = d[i][j] - c[i][0] * b[0][j] / a;
            assert!((gain - other).abs() <= 1e-11 * gain.abs().max(1e-6), "{gain} {other}");
        }
    }
}

/// D − C A⁻¹ B of a model with two states.
fn gain_of_two(result: &Value) -> Vec<Vec<f64>> {
    let [a, b, c, d] = ["A", "B", "C", "D"].map(|name| matrix(result, name));
    let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    let gain = |i: usize, j: usize| {
        let x = (a[1][1] * b[0][j] - a[0][1] * b[1][j]) / det;
        let y = (a[0][0] * b[1][j] - a[1][0] * b[0][j]) / det;
        d[i][j] - c[i][0] * x - c[i][1] * y
    };
    (0..c.len()).map(|i| (0..b[0].len()).map(|j| gain(i, j)).collect()).collect()
}

/// Half the step has a quarter of the error: the linear model is correct to first order.
#[test]
fn steps_are_answered_alike_to_second_order() {
    let folder = folder_with(&[("data.csv", CIRCULATING.as_bytes())]);
    let data = path(&folder, "data.csv");
    let linear =
        json_of(dgd(&["linearize", MUD, "--data", &data, "--at", "steady", "--format", "json"]));
    let [a, b, c, d] = ["A", "B", "C", "D"].map(|name| matrix(&linear, name));
    let outputs = linear["outputs"].as_array().expect("outputs");
    let at_rest: Vec<f64> = outputs.iter().map(|output| number(&output["value"])).collect();
    let states = linear["states"].as_array().expect("states");
    let start: Vec<String> = states
        .iter()
        .map(|state| format!("{}={}", state["name"].as_str().expect("a name"), state["value"]))
        .collect();

    let error = |step: f64| {
        let text = format!(
            "time [s],w_ssp [%],q_boost [lpm],q_tf [lpm]\n0,{},1800,300\n200,{},1800,300\n",
            50.0 + step,
            50.0 + step
        );
        fs::write(folder.path().join("step.csv"), text).expect("the folder is writable");
        let step_data = path(&folder, "step.csv");
        let args = ["simulate", MUD, "--data", &step_data, "--every", "10", "--rtol", "1e-10"];
        let sets = ["--set", &start[0], "--set", &start[1]];
        let out = dgd(&[&args[..], &sets].concat()).done().out;
        // ẋ = A x + B u from steady state, by the classical Runge–Kutta method with steps of 0.05 s: accurate to 1e-9
        // of the response, whose fastest mode has 6 s.
        let slope = |x: [f64; 2]| [0, 1].map(|i| a[i][0] * x[0] + a[i][1] * x[1] + b[i][0] * step);
        let ahead = |x: [f64; 2], k: [f64; 2], h: f64| [x[0] + h * k[0], x[1] + h * k[1]];
        let h = 0.05;
        let mut x = [0.0, 0.0];
        let mut worst = [0.0_f64; 4];
        let headers = ["p_r [bara]", "p_in [barg]", "p_out [barg]", "q_ssp [lpm]"];
        let columns = headers.map(|header| column(&out, header));
        for row in 0..=20 {
            for (i, column) in columns.iter().enumerate() {
                let w = at_rest[i] + c[i][0] * x[0] + c[i][1] * x[1] + d[i][0] * step;
                worst[i] = worst[i].max((column[row] - w).abs());
            }
            for _ in 0..200 {
                let k1 = slope(x);
                let k2 = slope(ahead(x, k1, h / 2.0));
                let k3 = slope(ahead(x, k2, h / 2.0));
                let k4 = slope(ahead(x, k3, h));
                for i in 0..2 {
                    x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
                }
            }
        }
        worst
    };
    let (wide, narrow) = (error(0.4), error(0.2));
    for (i, (wide, narrow)) in wide.iter().zip(&narrow).enumerate() {
        let order = (wide / narrow).log2();
        // The third order contributes slightly.
        assert!((order - 2.0).abs() < 0.05, "output {i}: {wide} and {narrow}");
    }
}

const SPRING: &str = "\
model spring
input force [N] linear
constant m [kg] = 2
parameter k [N/m] = 50
parameter c [N*s/m] = 4
state x [m] = 0.3
state v [m/s] = 0
equation speed: der(x) = v
equation motion: m*der(v) = force - k*x - c*v
output x [mm]
output pull [N] = k*x
";

#[test]
fn a_mass_on_a_spring_swings_as_it_should() {
    let folder = folder(SPRING, "time [s],force [N]\n0,10\n9,10\n");
    let data = path(&folder, "data.csv");
    let result = json_of(run_in(&folder, &["--data", &data, "--at", "3", "--format", "json"]));
    assert_matrix(&matrix(&result, "A"), &[&[0.0, 1.0], &[-25.0, -2.0]], 0.0);
    assert_matrix(&matrix(&result, "B"), &[&[0.0], &[0.5]], 0.0);
    assert_matrix(&matrix(&result, "C"), &[&[1000.0, 0.0], &[50.0, 0.0]], 1e-15);
    assert_matrix(&matrix(&result, "D"), &[&[0.0], &[0.0]], 0.0);
    // s² + 2 s + 25: ω = 5 1/s, ζ = 0.2.
    let pole = &result["poles"][0];
    assert!((number(&pole["re"]) + 1.0).abs() < 1e-14, "{pole}");
    assert!((number(&pole["im"]) - 24_f64.sqrt()).abs() < 1e-14, "{pole}");
    assert!((number(&pole["damping"]) - 0.2).abs() < 1e-15, "{pole}");
    assert!((number(&pole["period"]) - std::f64::consts::TAU / 24_f64.sqrt()).abs() < 1e-14);
    assert_eq!(number(&result["poles"][1]["im"]), -number(&pole["im"]));
    assert_eq!((&result["t"], &result["steady"]), (&Value::from(3.0), &Value::from(false)));

    let text = run_in(&folder, &["--data", &data, "--at", "steady"]).done().out;
    let expected = "\
spring, linear close to its steady state with the inputs of t = 0 s

state  value  unit
x        0.2  m
v          0  m/s

input  value  unit
force     10  N

output  value  unit
x         200  mm
pull       10  N

A: slopes of the states by the states
                 x [m]  v [m/s]
d(x)/dt [m/s]        0        1
d(v)/dt [m/s/s]    -25       -2
";
    for (line, expected) in text.lines().zip(expected.lines()).take(14) {
        assert_eq!(line, expected);
    }
    for line in ["-1 1/s  ± 4.89898i  1 s                0.2  1.2825 s", "stable"] {
        assert!(text.lines().any(|other| other == line), "no {line:?} in\n{text}");
    }
}

/// The same two tanks, with the flows between them as unknowns or substituted by hand.
#[test]
fn algebraic_unknowns_are_eliminated() {
    let ode = "\
model tanks
input q_in [m^3/s] linear
state h_1 [m] = 3
state h_2 [m] = 1
equation first:  2 [m^2]*der(h_1) = q_in - 0.01 [m^2/s]*(h_1 - h_2)/(1 + 0.5)
equation second: 1 [m^2]*der(h_2) = 0.01 [m^2/s]*(h_1 - h_2)/(1 + 0.5) - 0.02 [m^2/s]*h_2
output q [m^3/s] = 0.01 [m^2/s]*(h_1 - h_2)/(1 + 0.5)
output out [m^3/s] = 0.02 [m^2/s]*h_2
";
    // q has an additional resistance: q + 0.5 q.
    let dae = "\
model tanks
input q_in [m^3/s] linear
state h_1 [m] = 3
state h_2 [m] = 1
unknown q [m^3/s] = 0
unknown out [m^3/s] = 0
unknown drop [m] = 0
equation first:  2 [m^2]*der(h_1) = q_in - q
equation second: 1 [m^2]*der(h_2) = q - out
equation opening: 0.01 [m^2/s]*drop = q
equation outlet: out = 0.02 [m^2/s]*h_2
equation drop: drop + 0.5*q/0.01 [m^2/s] = h_1 - h_2
output q [m^3/s]
output out [m^3/s]
";
    let data = "time [s],q_in [m^3/s]\n0,0.01\n50,0.02\n";
    let value_of = |text: &str| {
        let folder = folder(text, data);
        let data = path(&folder, "data.csv");
        json_of(run_in(&folder, &["--data", &data, "--at", "20", "--format", "json"]))
    };
    let (ode, dae) = (value_of(ode), value_of(dae));
    let names = |result: &Value| {
        let entries = result["eliminated"].as_array().expect("a list");
        entries.iter().map(|x| x["name"].as_str().expect("a name").to_owned()).collect::<Vec<_>>()
    };
    assert!(names(&ode).is_empty());
    assert_eq!(names(&dae), ["q", "out", "drop"]);
    for name in ["A", "B", "C", "D"] {
        let expected = matrix(&ode, name);
        let expected: Vec<&[f64]> = expected.iter().map(Vec::as_slice).collect();
        assert_matrix(&matrix(&dae, name), &expected, 1e-14);
    }
}

#[test]
fn the_index_is_one_before_anything_is_eliminated() {
    // Two tanks with one level and a total area of 5 m²; the flow between them follows its slope. The float is moved
    // externally, so that its speed contains the slope of that input.
    let folder =
        folder_with(&[("data.csv", b"time [s],q_in [m^3/s],path [m]\n0,0.005,0\n90,0.005,9\n")]);
    let data = path(&folder, "data.csv");
    let args = ["linearize", "models/rigid_tanks.dgd", "--data", &data, "--at", "10"];
    let result = json_of(dgd(&[&args[..], &["--format", "json"]].concat()));
    let inputs: Vec<&str> = result["inputs"]
        .as_array()
        .expect("inputs")
        .iter()
        .map(|input| input["name"].as_str().expect("a name"))
        .collect();
    assert_eq!(inputs, ["q_in", "path", "der(path)"]);
    let slope = &result["inputs"][2];
    assert_eq!((slope["unit"].as_str(), slope["slope"].as_bool()), (Some("m/s"), Some(true)));
    assert!((number(&slope["value"]) - 0.1).abs() < 1e-15);
    assert_eq!(result["states"].as_array().map(Vec::len), Some(2));
    let a = matrix(&result, "A");
    // −k/(A_1 + A_2)
    assert!((a[0][0] + 0.05 / 5.0).abs() < 1e-16 && a[0][1] == 0.0, "{a:?}");
    let d = matrix(&result, "D");
    // The third output is the float's speed, path' + h_1'.
    assert!((d[2][2] - 1.0).abs() < 1e-15, "{d:?}");
}

#[test]
fn what_acts_late_is_said_and_counts_in_the_poles() {
    // ẋ = −k x(t − τ): s + k e^(−sτ) = 0, which oscillates undamped at frequency k for kτ = π/2.
    let late = "\
model late
parameter k [1/s] = 0.5
parameter tau [s] = 1
state x [m] = 1
equation slow: der(x) = -k*delay(x, tau)
output x [m]
output seen [m] = delay(x, 2*tau)
";
    let folder = folder(late, "");
    let result = json_of(run_in(&folder, &["--at", "steady", "--format", "json"]));
    assert_eq!(result["all_poles"], false);
    assert_eq!(result["late"][0]["unknown"], "x");
    assert_eq!(number(&result["late"][0]["delay"]), 1.0);
    assert_matrix(&matrix(&result, "A"), &[&[0.0]], 0.0);
    assert_matrix(&matrix(&result, "A1"), &[&[-0.5]], 0.0);
    assert_eq!(number(&result["outputs"][1]["delay"]), 2.0);
    let found_poles = poles(&result);
    // Two pairs are within |s| τ < 12; the next is at 13.9.
    assert_eq!(found_poles.len(), 4, "{found_poles:?}");
    assert_eq!(result["stable"], true);
    for [re, im] in &found_poles {
        // s + k e^(−sτ), real and imaginary part.
        let size = 0.5 * (-re).exp();
        let rest = (re + size * im.cos()).hypot(im - size * im.sin());
        assert!(rest < 1e-11 * re.hypot(*im), "{re} {im}: {rest}");
    }
    // The first is −W₀(−kτ)/τ of the branch next to zero, as kτ > 1/e: W₀(−1/2) = −0.79402 ± 0.77011 i.
    assert!((found_poles[0][0] + 0.794_023_6).abs() < 1e-6, "{found_poles:?}");
    assert!((found_poles[0][1] - 0.770_111_7).abs() < 1e-6, "{found_poles:?}");
    let set = format!("k={}", std::f64::consts::FRAC_PI_2);
    let result = json_of(run_in(&folder, &["--at", "steady", "--set", &set, "--format", "json"]));
    let [re, im] = poles(&result)[0];
    assert!(re.abs() < 1e-12 && (im - std::f64::consts::FRAC_PI_2).abs() < 1e-12, "{re} {im}");

    // A delayed input is an input of its own.
    let text = run_in(&folder, &["--at", "3"]).done().out;
    for part in ["x(t - 1 s)", "infinitely many poles", "`seen` is read 2 s late"] {
        assert!(text.contains(part), "no {part:?} in\n{text}");
    }
    let data = folder_with(&[("d.csv", b"time [s],q_pump [lpm],heat [kW]\n0,300,20\n99,300,20\n")]);
    let data_path = path(&data, "d.csv");
    let args = ["linearize", "models/delayed_sensor.dgd", "--data", &data_path, "--at", "steady"];
    let text = dgd(&args).done().out;
    assert!(text.contains("q_pump(t - 12 s)") && text.contains("heat(t - 7 s)"), "{text}");
    assert!(!text.contains("infinitely"), "{text}");
}

const VESSEL: &str = "\
model vessel
input q_in [m^3/s] linear
parameter k [m^2/s] = 0.01
constant A [m^2] = 2
constant crest [m] = 1.5
state h [m] = 0.5
unknown over [m^3/s] = 0
modes weir {
  below {
    equation level: A*der(h) = q_in - k*h - over
    equation spill: over = 0
  }
  spilling {
    equation level: A*der(h) = q_in - k*h - over
    equation spill: over = 1 [m^2/s]*(h - crest)
  }
  below -> spilling when h rises above crest
  spilling -> below when h falls below crest
}
output h [m]
output over [m^3/s]
";

#[test]
fn the_mode_that_holds_is_linearised() {
    let folder = folder(VESSEL, "time [s],q_in [m^3/s]\n0,0.1\n2000,0.1\n");
    let data = path(&folder, "data.csv");
    let value_at = |t: &str, more: &[&str]| {
        let args = ["--data", &data, "--at", t, "--format", "json"];
        json_of(run_in(&folder, &[&args, more].concat()))
    };
    let early = value_at("5", &[]);
    assert_eq!(early["modes"][0]["mode"], "below");
    assert_matrix(&matrix(&early, "A"), &[&[-0.005]], 1e-15);
    let later = value_at("500", &[]);
    assert_eq!(later["modes"][0]["mode"], "spilling");
    assert_matrix(&matrix(&later, "A"), &[&[-0.505]], 1e-15);

    // The initial mode would settle at 10 m, where it does not apply: 0.1 = 0.01 h + (h − 1.5).
    let rest = value_at("steady", &[]);
    assert_eq!(rest["modes"][0]["mode"], "spilling");
    assert!((number(&rest["states"][0]["value"]) - 1.6 / 1.01).abs() < 1e-12, "{rest}");
    // With a wide outlet it applies.
    let rest = value_at("steady", &["--set", "k=0.2"]);
    assert_eq!(rest["modes"][0]["mode"], "below");
    assert!((number(&rest["states"][0]["value"]) - 0.5).abs() < 1e-12, "{rest}");
}

#[test]
fn how_far_a_solution_slides_is_a_mode_and_no_unknown() {
    const ROOM: &str = "model room
parameter a [1/s] = 0.5
parameter warm [K] = 20
state T [K] = 30
equation heat: der(T) = (if T < warm then 15 [K/s] else 0 [K/s]) - a*T
output T [K]
";
    let folder = folder(ROOM, "");
    let model = path(&folder, "model.dgd");
    let text = dgd(&["linearize", &model, "--at", "15"]).done().out;
    assert!(text.contains("T - warm at 0: sliding"), "{text}");
    let result = dgd(&["linearize", &model, "--at", "15", "--format", "json"]).done().json();
    assert_eq!(result["eliminated"], serde_json::json!([]), "{result}");
    let text = dgd(&["check", &model]).done().err;
    assert!(text.contains("1 state, 2 parameters, 1 output"), "{text}");
    let args = ["simulate", &model, "--until", "20", "--every", "10", "--method", "tsit5"];
    dgd(&args).refused(
        3,
        &["solves no equations, as a solution that may slide along `switch T - warm at 0` needs"],
    );
}

#[test]
fn where_there_is_no_steady_state_the_equation_and_the_unknown_are_named() {
    let tank = "\
model tank
input q_in [m^3/s] linear
state h [m] = 0
state filled [m^3] = 0
equation level: 2 [m^2]*der(h) = q_in - 0.01 [m^2/s]*h
equation meter: der(filled) = q_in
output h [m]
";
    let folder = folder(tank, "time [s],q_in [m^3/s]\n0,0.1\n");
    let data = path(&folder, "data.csv");
    let run = run_in(&folder, &["--data", &data, "--at", "steady"]);
    run.refused(3, &["no steady state", "`meter`", "`filled`"]);
    // At a time of a run there is a linear model, and it integrates.
    let text = run_in(&folder, &["--data", &data, "--at", "0"]).done().out;
    assert!(text.contains("integrates"), "{text}");

    // x² + 1 has no real root, so x diverges; no equation depends on another.
    let away = "model away\nstate x = 1\nequation growth: der(x) = (x^2 + 1)*1 [1/s]\noutput x\n";
    let folder = self::folder(away, "");
    run_in(&folder, &["--at", "steady"]).refused(3, &["no steady state", "`growth`", "`x`"]);
    // The same equation twice for unknowns without derivatives.
    let twice = "\
model twice
state x = 1
unknown y
unknown z
equation decay: der(x) = -x/1 [s]
equation one: y + z = x
equation two: y*y + 2*y*z + z*z = x*x
output y
";
    let folder = self::folder(twice, "");
    let run = run_in(&folder, &["--at", "0"]);
    assert_eq!(run.code, 3, "{}", run.err);
}

#[test]
fn a_model_may_have_several_steady_states() {
    // Example 2.5 of Seborg, Edgar and Mellichamp: a state on either side of an unstable one.
    let folder = folder_with(&[("data.csv", b"time [s],q_f [lpm],T_c [degC]\n0,100,26.85\n")]);
    let data = path(&folder, "data.csv");
    for (start, temperature, is_stable) in [
        (["c=877", "T=51"], 324.48, true),
        (["c=500", "T=77"], 350.0, false),
        (["c=209", "T=96"], 369.7, false),
    ] {
        let args = ["linearize", "models/cstr.dgd", "--data", &data, "--at", "steady"];
        let sets = ["--set", start[0], "--set", start[1], "--format", "json"];
        let result = json_of(dgd(&[&args[..], &sets].concat()));
        let kelvin = number(&result["states"][1]["value"]) + 273.15;
        assert!((kelvin - temperature).abs() < 0.1, "{kelvin} K");
        assert_eq!(result["stable"], is_stable, "{kelvin} K");
    }
}

#[test]
fn tables_are_for_people_programs_and_files() {
    let folder = folder(SPRING, "time [s],force [N]\n0,10\n9,10\n");
    let data = path(&folder, "data.csv");
    let out = path(&folder, "out.csv");
    let run = run_in(&folder, &["--data", &data, "--at", "1", "-o", &out]).done();
    assert!(run.out.is_empty() && run.err.contains("wrote"), "{}{}", run.out, run.err);
    let table = fs::read_to_string(&out).expect("the table");
    assert!(table.starts_with("matrix,row,column,value,unit\nA,d(x)/dt,x,0,"), "{table}");
    assert!(table.contains("\nA,d(v)/dt,x,-25,m/s/s/m\n"), "{table}");
    assert!(table.contains("\nC,x,x,1000,mm/m\n"), "{table}");
    // 4 + 2 + 4 + 2 entries.
    assert_eq!(table.lines().count(), 1 + 12);

    let run_by = |engine: &str| {
        run_in(&folder, &["--data", &data, "--at", "1", "--engine", engine]).done().out
    };
    assert_eq!(run_by("native"), run_by("interpreter"));
}

#[test]
fn wrong_usage_is_refused() {
    let folder = folder(SPRING, "time [s],force [N]\n0,10\n9,10\n");
    let data = path(&folder, "data.csv");
    run_in(&folder, &["--data", &data]).refused(2, &["--at"]);
    run_in(&folder, &["--data", &data, "--at", "soon"]).refused(2, &["steady"]);
    run_in(&folder, &["--at", "steady"]).refused(2, &["--data", "force [N]"]);
    run_in(&folder, &["--data", &data, "--at", "1", "--until", "4"]).refused(2, &["--until"]);
    run_in(&folder, &["--data", &data, "--at", "1", "--plot", "a.gif"]).refused(2, &["a.gif"]);
    run_in(&folder, &["--data", &data, "--at", "-1"]).refused(2, &["-1"]);
    // Linear inputs end with the recording.
    run_in(&folder, &["--data", &data, "--at", "20"]).refused(3, &["force"]);
}
