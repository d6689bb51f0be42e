//! Starts of runs: the initial mode, conditions that hold already, and required inputs.

use crate::support::{column, dgd_in, folder_with};

const TANK: &[u8] = b"\
model tank
parameter h_0 [m] = 1
state h [m] = h_0
modes tank {
  draining { equation level: der(h) = -0.1 [m/s] }
  empty    { equation level: h = 0 [m] }
  draining -> empty when h falls below 0 [m] { reset h = 0 [m] }
}
when h falls below 0.5 [m] { reset h = 0.25 [m] }
";

#[test]
fn a_run_says_which_conditions_hold_at_its_start() {
    let folder = folder_with(&[("tank.dgd", TANK)]);
    let run = |more: &[&str]| {
        let args = ["simulate", "tank.dgd", "--until", "1", "--set"];
        dgd_in(folder.path(), &[&args, more].concat()).done()
    };
    let transition = "note: `draining -> empty when h falls below 0 [m]` holds at the start already, \
                      and acts only after it has been false";
    let when = "note: `when h falls below 0.5 [m]` holds at the start";
    let err = run(&["h_0=-1"]).err;
    assert!(err.contains(transition) && err.contains(when), "{err}");
    let err = run(&["h_0=0.4"]).err;
    assert!(!err.contains("draining") && err.contains(when), "{err}");
    for quiet in [&["h_0=1"][..], &["h_0=-1", "--quiet"]] {
        assert_eq!(run(quiet).err, "");
    }
}

#[test]
fn a_run_starts_in_the_mode_whose_condition_holds() {
    let text = String::from_utf8_lossy(TANK)
        .replace("{ reset h = 0 [m] }\n", "\n  start empty if h <= 0\n");
    let folder = folder_with(&[("tank.dgd", text.as_bytes())]);
    let level = |h: &str| {
        let args = ["simulate", "tank.dgd", "--until", "1", "--set", h];
        column(&dgd_in(folder.path(), &args).done().out, "h [m]")
    };
    assert!(level("h_0=-1").iter().all(|h| *h == 0.0));
    let drained = level("h=2");
    assert!((drained[drained.len() - 1] - 1.9).abs() < 1e-6, "{drained:?}");
}

#[test]
fn data_need_no_column_for_what_only_another_choice_reads() {
    let model = b"\
model m
input u [m]
input v [m]
state x [m]
variant law {
  one { equation e: der(x) = (u - x)/1 [s] }
  two { equation e: der(x) = (v - x)/1 [s] }
}
";
    let folder = folder_with(&[("m.dgd", model), ("data.csv", b"time [s],u [m]\n0,1\n1,1\n")]);
    let simulate = |more: &[&str]| {
        dgd_in(folder.path(), &[&["simulate", "m.dgd", "--data", "data.csv"], more].concat())
    };
    let out = simulate(&[]).done().out;
    assert!(out.starts_with("time [s],u [m],x [m]\n"), "{out}");
    simulate(&["--variant", "law=two"]).refused(1, &["E603", "no column for the input `v`"]);
}

#[test]
fn a_choice_that_would_read_what_no_one_binds_is_refused_when_asked_for() {
    let line = b"\
model line
state x
variant end {
  flow     { input q
             equation e: der(x) = q/1 [s] }
  pressure { input p
             equation e: der(x) = p/1 [s] }
}
";
    let pond = b"model pond\nimport \"line.dgd\"\npart one: line\none.q = 1\noutput x = one.x\n";
    let folder = folder_with(&[("line.dgd", line), ("pond.dgd", pond)]);
    let checked = dgd_in(folder.path(), &["check", "pond.dgd", "--format", "json"]).done().json();
    assert_eq!(checked["variants"][0]["choices"], serde_json::json!(["flow"]));
    let other = ["check", "pond.dgd", "--variant", "one.end=pressure"];
    dgd_in(folder.path(), &other).refused(
        1,
        &["E220", "`one.p`", "with `one.end = pressure`", "say what it is: `one.p = …`"],
    );
}

#[test]
fn a_start_value_that_the_equations_replace_is_named_and_a_first_guess_is_not() {
    let joined = b"\
model joined
state v1 [V] = 10
state v2 [V] = 0
unknown i [A] = 0
equation c1: 1 [mF]*der(v1) = -i
equation c2: 3 [mF]*der(v2) = i
equation switch: v1 = v2
";
    // As a state it keeps its initial value, and as an algebraic unknown it does not have one.
    let flow = b"\
model flow
state q [m/s] = 3
variant law {
  dynamic { equation q: 2 [s]*der(q) = 1 [m/s] - q }
  static  { equation q: 0 = 1 [m/s] - q }
}
";
    let folder = folder_with(&[("joined.dgd", joined), ("flow.dgd", flow)]);
    let note = |args: &[&str]| {
        let run = dgd_in(folder.path(), &[&["simulate"], args, &["--until", "1"]].concat());
        run.done().err.contains("is dropped")
    };
    assert!(note(&["joined.dgd"]));
    assert!(!note(&["flow.dgd"]));
    assert!(!note(&["flow.dgd", "--variant", "law=static"]));
}
