//! Linear models at steady states that are not isolated.

use serde_json::Value;
use tempfile::TempDir;

use crate::support::{Run, dgd, folder_with, path};

/// A closed loop of two tanks with areas of 2 and 3 m².
const LOOP: &str = "\
model loop
parameter k [m^2/s] = 0.06
state h_1 [m] = 1
state h_2 [m] = 5
let q = k*(h_1 - h_2)
equation one: 2 [m^2]*der(h_1) = -q
equation two: 3 [m^2]*der(h_2) = q
output volume [m^3] = 2 [m^2]*h_1 + 3 [m^2]*h_2
output h_1 [m]
";

fn folder(model: &str, data: &str) -> TempDir {
    folder_with(&[("model.dgd", model.as_bytes()), ("data.csv", data.as_bytes())])
}

fn steady(folder: &TempDir, more: &[&str]) -> Run {
    dgd(&[&["linearize", &path(folder, "model.dgd"), "--at", "steady"], more].concat())
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

/// Coefficient of a state.
fn coefficient(held: &Value, state: &str) -> f64 {
    let mut terms = held["terms"].as_array().expect("terms").iter();
    terms.find(|term| term["state"] == state).map_or(0.0, |term| number(&term["coefficient"]))
}

fn state(result: &Value, name: &str) -> f64 {
    let mut states = result["states"].as_array().expect("states").iter();
    number(&states.find(|state| state["name"] == name).expect("the state")["value"])
}

#[track_caller]
fn assert_close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} is not {expected}");
}

#[test]
fn a_closed_loop_rests_with_the_volume_that_it_has() {
    let folder = folder(LOOP, "");
    let json = ["--format", "json"];
    for (sets, volume) in [(["h_1=1", "h_2=5"], 17.0), (["h_1=4", "h_2=-2"], 2.0)] {
        let sets = ["--set", sets[0], "--set", sets[1]];
        let result = steady(&folder, &[&sets[..], &json].concat()).done().json();
        assert_close(state(&result, "h_1"), volume / 5.0, 1e-12);
        assert_close(state(&result, "h_2"), volume / 5.0, 1e-12);
        let [held] = result["conserved"].as_array().expect("a list").as_slice() else { panic!() };
        // The volume over the area of the tank that names the combination.
        let (c_1, c_2) = (coefficient(held, "h_1"), coefficient(held, "h_2"));
        assert!((c_1 == 1.0 || c_2 == 1.0) && (c_1 / c_2 * 1.5 - 1.0).abs() < 1e-14, "{held}");
        assert_close(number(&held["value"]), volume * c_1 / 2.0, 1e-12);
        assert_eq!(
            (&held["output"], &held["linear"], &held["whatever_inputs"]),
            (&"volume".into(), &true.into(), &true.into())
        );
        // −k (1/2 + 1/3), and exactly zero.
        assert_eq!(number(&result["poles"][0]["re"]), 0.0);
        assert_close(number(&result["poles"][1]["re"]), -0.05, 1e-15);
        assert_eq!((&result["stable"], &result["stable_otherwise"]), (&Value::Null, &true.into()));
    }
    let text = steady(&folder, &[]).done().out;
    for part in ["conserved: h_2 + 0.666667 * h_1", "`volume`, 17.0000 m^3", "conserved (h_2)"] {
        assert!(text.contains(part), "{part} in {text}");
    }
    // At a time of a run nothing is conserved.
    let position = dgd(&["linearize", &path(&folder, "model.dgd"), "--at", "9"]).done().out;
    assert!(position.contains("integrates") && !position.contains("conserved"), "{position}");
}

#[test]
fn the_full_well_keeps_its_mud() {
    let data = "examples/data/pipe_connection.csv";
    let args = ["linearize", "models/dual_gradient_drilling.dgd", "--data", data, "--at", "steady"];
    let result = dgd(&[&args[..], &["--format", "json"]].concat()).done().json();
    let [held] = result["conserved"].as_array().expect("a list").as_slice() else {
        panic!("{result}")
    };
    assert_eq!((&held["named_by"], &held["output"]), (&"pit".into(), &"mud".into()));
    assert_eq!(held["whatever_inputs"], true);
    // From the dimensions in the model files: cross-sections of riser and lines, and V/β per bar.
    let inch = 0.0254_f64;
    let area = |d: f64| std::f64::consts::FRAC_PI_4 * (d * inch).powi(2);
    assert_close(coefficient(held, "riser.h"), -(area(19.75) - area(5.0)), 1e-12);
    assert_close(coefficient(held, "string.p"), area(4.276) * 2500.0 / 15000.0, 1e-12);
    // The booster line has the area of section 3.7, 0.0103 m².
    assert_close(coefficient(held, "booster.p"), 0.0103 * 340.0 / 15000.0, 1e-12);
    assert_eq!(held["terms"].as_array().map(Vec::len), Some(4));
    assert_close(number(&held["value"]), number(&held["at_start"]), 1e-9);
    // The set point of the level, and equal mud flow through the return line.
    assert_close(state(&result, "riser.h"), 50.0, 1e-4);
    assert_close(state(&result, "line.q"), 3100.0 / 60_000.0, 1e-9);
    assert_eq!(number(&result["poles"][0]["re"]), 0.0);
    let others = result["poles"].as_array().expect("poles").iter().skip(1);
    assert!(others.into_iter().all(|pole| number(&pole["re"]) < 0.0), "{}", result["poles"]);

    // Additional mud in the pit raises its level by that amount: the steady state moves.
    let other = dgd(&[&args[..], &["--set", "pit=7", "--format", "json"]].concat()).done().json();
    assert_close(state(&other, "pit"), state(&result, "pit") + 7.0, 1e-9);
}

#[test]
fn what_only_these_inputs_conserve_is_said_to() {
    let tank = "\
model tank
input q_in [m^3/s] linear
state h [m] = 0
state filled [m^3] = 4
equation level: 2 [m^2]*der(h) = q_in - 0.01 [m^2/s]*h
equation meter: der(filled) = q_in
output h [m]
";
    let still = folder(tank, "time [s],q_in [m^3/s]\n0,0\n");
    let result = steady(&still, &["--data", &path(&still, "data.csv"), "--format", "json"]);
    let result = result.done().json();
    assert_eq!(result["conserved"][0]["whatever_inputs"], false);
    assert_eq!(result["conserved"][0]["combination"], "filled");
    assert_eq!(state(&result, "filled"), 4.0);
    let text = steady(&still, &["--data", &path(&still, "data.csv")]).done().out;
    assert!(text.contains("conserved with these inputs: filled"), "{text}");

    let moving = folder(tank, "time [s],q_in [m^3/s]\n0,0.1\n");
    let run = steady(&moving, &["--data", &path(&moving, "data.csv")]);
    run.refused(3, &["no steady state", "`filled` changes by 0.1 m^3/s", "`meter`"]);
    // A loop that is being filled has no steady state either, as its volume shows: 0.3/3 m of `h_2` per second.
    let filled = LOOP
        .replace("= 0.06\n", "= 0.06\ninput q_in [m^3/s] hold\n")
        .replace("= -q\n", "= q_in - q\n");
    let filled = folder(&filled, "time [s],q_in [m^3/s]\n0,0.3\n");
    let run = steady(&filled, &["--data", &path(&filled, "data.csv")]);
    run.refused(3, &["no steady state", "`h_2` together with `h_1` changes by 0.1 m/s"]);
}

#[test]
fn volume_in_tanks_that_widen_is_not_linear_and_kept_all_the_same() {
    // The second tank has an area of (3 + h) m² at level h: V = 2 h₁ + 3 h₂ + h₂²/2.
    let widening = LOOP
        .replace("3 [m^2]*der(h_2) = q", "(3 [m^2] + 1 [m]*h_2)*der(h_2) = q")
        .replace("3 [m^2]*h_2", "3 [m^2]*h_2 + 0.5 [m]*h_2^2");
    let folder = folder(&widening, "");
    let result = steady(&folder, &["--rtol", "1e-9", "--format", "json"]).done().json();
    // 2 + 15 + 12.5 = 5 h + h²/2.
    let h = -5.0 + (25.0_f64 + 59.0).sqrt();
    assert_close(state(&result, "h_1"), h, 1e-6);
    assert_close(state(&result, "h_2"), h, 1e-6);
    let conserved = &result["conserved"][0];
    assert_eq!((&conserved["linear"], &conserved["output"]), (&false.into(), &"volume".into()));
    assert_close(coefficient(conserved, "h_1"), 2.0 / (3.0 + h), 1e-6);
    let text = steady(&folder, &[]).done().out;
    assert!(text.contains("not linear in the states"), "{text}");
}

#[test]
fn modes_on_the_way_may_lose_some() {
    // The second tank spills down to 4 m.
    let spilling = LOOP.replace(
        "equation two: 3 [m^2]*der(h_2) = q\n",
        "modes top {\n  spilling { equation two: 3 [m^2]*der(h_2) = q - 0.05 [m^2/s]*(h_2 - 2 [m]) }\n  \
         below { equation two: 3 [m^2]*der(h_2) = q }\n  spilling -> below when h_2 falls below 4 [m]\n  \
         below -> spilling when h_2 rises above 4 [m]\n}\n",
    );
    let folder = folder(&spilling, "time [s]\n0\n2000\n");
    let result = steady(&folder, &["--format", "json"]).done().json();
    let conserved = &result["conserved"][0];
    assert!(number(&conserved["value"]) < number(&conserved["at_start"]) - 0.1, "{conserved}");
    let model = path(&folder, "model.dgd");
    let args = ["simulate", &model, "--until", "2000", "--every", "2000", "--rtol", "1e-9"];
    let run = dgd(&[&args[..], &["--format", "json"]].concat()).done().json();
    let columns = run["columns"].as_array().expect("columns");
    let h = columns.iter().find(|column| column["name"] == "h_2").expect("h_2");
    let last = h["values"].as_array().and_then(|values| values.last()).expect("rows");
    assert_close(state(&result, "h_2"), number(last), 1e-4);
    let text = steady(&folder, &[]).done().out;
    assert!(text.contains("other modes on the way did not conserve"), "{text}");
}

#[test]
fn poles_are_drawn() {
    let folder = folder(LOOP, "");
    let picture = path(&folder, "poles.svg");
    let run = steady(&folder, &["--plot", &picture]).done();
    assert!(run.out.contains("conserved"), "the table is printed, too");
    let svg = std::fs::read_to_string(&picture).expect("a picture");
    for part in ["0, conserved", "20 s", "Real part"] {
        assert!(svg.contains(part), "{part}");
    }
}
