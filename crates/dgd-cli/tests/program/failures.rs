//! Messages for runs that cannot be finished, and their partial results: equation and variable by name, the time, exit
//! code 3, and the rows up to there; and the state after Ctrl-C.

use std::fmt::Write as _;
use std::fs;
use std::process::Command;
use std::time::{Duration, SystemTime};

use crate::support::{
    Run, column, dgd, dgd_in, folder_with, killed_and_resumed, listing, path, root,
};

#[cfg(target_os = "linux")]
use crate::support::{interrupt, started, wait_until_it_minds_ctrl_c};
use tempfile::TempDir;

/// A folder with a model of this text.
fn with_model(text: &str) -> (TempDir, String) {
    let folder = folder_with(&[("m.dgd", format!("model m\n{text}").as_bytes())]);
    let model = path(&folder, "m.dgd");
    (folder, model)
}

/// Simulates a model of this text, in four rows.
fn run(text: &str, more: &[&str]) -> Run {
    let (_folder, model) = with_model(text);
    let args = ["simulate", &model, "--until", "3", "--every", "1"];
    dgd(&[&args, more].concat())
}

#[test]
fn a_start_that_is_impossible_names_equation_and_unknown() {
    let text = "unknown z [m] = 1\nequation area: z^2 + 1 [m^2] = 0\n";
    run(text, &[]).refused(3, &["no consistent values at t = 0 s", "`area`", "`z`"]);
    let text = "parameter a = -1\nstate x = sqrt(a)\nequation e: der(x) = -x * 1 [1/s]\n";
    run(text, &[]).refused(3, &["start value of `x`", "t = 0 s", "not finite"]);
}

/// s falls to zero at 1.5 s; its root is undefined afterwards.
const ROOT: &str = "
state s [cm] = 150
state v [m^(1/2)*s] = 0
equation fall: der(s) = -1 [m/s]
equation gain: der(v) = sqrt(s)
";

#[test]
fn what_is_not_finite_is_said_with_equation_unknown_time_and_values() {
    run(ROOT, &[]).refused(3, &["`gain`", "t = 1.49999999", "it determines `v`", "`s` = ", " cm"]);
}

#[test]
fn rows_up_to_a_failure_are_printed() {
    let rows = |csv: &str| (column(csv, "time [s]"), column(csv, "s [cm]"));
    let stopped = run(ROOT, &[]);
    let (times, s) = rows(&stopped.out);
    assert_eq!(times, [0.0, 1.0]);
    assert!((s[1] - 50.0).abs() < 1e-6, "{s:?}");

    let stopped = run(ROOT, &["--format", "json"]);
    stopped.refused(3, &["`gain`"]);
    let result = stopped.json();
    assert_eq!(result["rows"], 2);
    assert!(result["error"].as_str().is_some_and(|error| error.contains("`gain`")), "{result}");
}

#[test]
fn rows_up_to_a_failure_are_kept_beside_the_file_asked_for() {
    let (folder, model) = with_model(ROOT);
    for command in ["simulate", "sensitivity"] {
        let out = path(&folder, &format!("{command}.csv"));
        let args = [command, &model, "--until", "3", "--every", "1", "-o", &out];
        dgd(&args).refused(3, &[&format!("{command}.partial.csv (2 rows)"), "`gain`"]);
        assert!(!fs::exists(&out).expect("the folder is there"));
        let kept = fs::read_to_string(path(&folder, &format!("{command}.partial.csv")));
        assert_eq!(column(&kept.expect("it was written"), "time [s]"), [0.0, 1.0]);
    }
}

#[test]
fn a_step_that_becomes_too_small_names_the_unknown() {
    // x = √(1 − t/s) ends at 1 s with an infinite slope.
    let text = "state x = 1\nequation decay: der(x) = -0.5 [1/s] / x\n";
    run(text, &[]).refused(3, &["step size fell to", "t = 1", "`x`"]);
}

#[test]
fn an_input_that_ends_too_early_is_named_with_both_times() {
    let text = "input q [lpm] linear\nstate v [l] = 0\nequation e: der(v) = q\n";
    let folder = folder_with(&[
        ("m.dgd", format!("model m\n{text}").as_bytes()),
        ("q.csv", b"time [s],q [lpm]\n0,1\n2,3\n"),
    ]);
    let (model, data) = (path(&folder, "m.dgd"), path(&folder, "q.csv"));
    let args = ["simulate", &model, "--data", &data, "--until", "3"];
    dgd(&args).refused(3, &["`q`", "3 s", "2 s"]);
}

#[test]
fn a_delay_below_zero_is_named() {
    let text = "input q [lpm]\nparameter tau [s] = 1\nstate v [l] = 0\n\
                equation e: der(v) = delay(q, tau)\n";
    let folder = folder_with(&[
        ("m.dgd", format!("model m\n{text}").as_bytes()),
        ("q.csv", b"time [s],q [lpm]\n0,1\n2,3\n"),
    ]);
    let (model, data) = (path(&folder, "m.dgd"), path(&folder, "q.csv"));
    let run = dgd(&["simulate", &model, "--data", &data, "--set", "tau=-2"]);
    run.refused(3, &["`delay(q, tau)`", "-2 s"]);
}

#[test]
fn a_ball_that_comes_to_rest_has_endless_impacts() {
    let text = "
state h [m] = 1
state v [m/s] = 0
equation fall: der(h) = v
modes ball {
  flying { equation weight: der(v) = -9.81 [m/s^2] }
  flying -> flying when h falls below 0 [m] {
    reset h = 0 [m]
    reset v = -0.5*v
  }
}
";
    // The impacts accumulate at √(2 h/g) (1 + e)/(1 − e) = 1.35457 s.
    let stopped = run(text, &[]);
    stopped.refused(3, &["`ball`", "without end at t = 1.3545"]);
    assert_eq!(column(&stopped.out, "time [s]"), [0.0, 1.0]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_fit_that_ctrl_c_stops_writes_the_best_so_far() {
    const DATA: &str = "examples/data/circulation.csv";
    const MODEL: &str = "models/mud_circulation.dgd";
    let folder = folder_with(&[]);
    let goal = path(&folder, "fitted");
    // Many recordings at high accuracy: far from done when it is stopped.
    let mut args = vec!["fit", MODEL, "--steps", "adaptive", "--rtol", "1e-10", "-o", &goal];
    args.extend(["--format", "json", "--profile", "c0", "--bootstrap", "9", "--valid", DATA]);
    args.extend(["--data", DATA].repeat(8));
    let mut child = started(&args);
    wait_until_it_minds_ctrl_c(&mut child);
    // After the first simulation in the journal there is a best so far.
    let journal = folder.path().join(".fitted.dgd-journal");
    while fs::metadata(&journal).map_or(0, |file| file.len()) <= 64 {
        assert!(child.try_wait().expect("a child").is_none(), "it ended by itself");
        std::thread::sleep(Duration::from_millis(1));
    }
    interrupt(&child);
    let run = Run::of(&child.wait_with_output().expect("it ends"));
    assert_eq!(run.code, 130, "{}", run.err);
    let words = format!("what there is, is in {goal}; the same command with `--resume` goes on");
    assert!(run.err.contains(&words), "{}", run.err);
    let result = run.json();
    assert_eq!((&result["status"], &result["termination"]), (&"stopped".into(), &"stopped".into()));
    let left_out: Vec<&str> = (result["left_out"].as_array().expect("a list").iter())
        .map(|words| words.as_str().expect("words"))
        .collect();
    let [converged, held_out, profile] = left_out.as_slice() else { panic!("{left_out:?}") };
    assert!(converged.starts_with("stopped before it converged"), "{converged}");
    assert_eq!(*held_out, "validation recordings were not simulated");
    assert_eq!(*profile, "there is no profile of `c0`");
    assert!(result["outputs"]["p_r"]["rms_train"].is_number(), "{result}");
    assert!(result["outputs"]["p_r"]["rms_valid"].is_null(), "{result}");
    let written = |name: &str| fs::read_to_string(folder.path().join("fitted").join(name));
    assert_eq!(written("result.json").expect("it was written"), run.out);
    dgd(&["check", &path(&folder, "fitted/mud_circulation.dgd")]).done();
}

#[test]
fn a_fit_that_is_killed_goes_on_and_ends_with_the_same_bytes() {
    let folder = folder_with(&[]);
    let (goal, other) = (path(&folder, "fitted"), path(&folder, "other"));
    let args = |goal| {
        let args = ["fit", "models/mud_circulation.dgd", "--data", "examples/data/circulation.csv"];
        [
            &args[..],
            &["--starts", "3", "--loss", "huber", "--profile", "c0"],
            &["--bootstrap", "30", "--seed", "3", "-o", goal],
        ]
        .concat()
    };
    let whole = dgd(&args(&other)).done();
    let resumed = killed_and_resumed(&args(&goal), &folder, "fitted");
    assert_eq!(resumed.out, whole.out);
    for name in ["result.json", "mud_circulation.dgd"] {
        let read = |goal: &str| fs::read(format!("{goal}/{name}")).expect("it was written");
        assert!(read(&goal) == read(&other), "{name} differs");
    }
    let args = ["fit", "m.dgd", "--data", "d.csv", "--resume"];
    dgd(&args).refused(2, &["`--resume`", "-o DIR"]);
}

#[test]
fn a_copy_of_the_program_goes_on_whatever_its_time_stamp() {
    let folder = folder_with(&[]);
    let goal = path(&folder, "fitted");
    let args = ["fit", "models/mud_circulation.dgd", "--data", "examples/data/circulation.csv"];
    let args = [&args[..], &["-o", &goal, "--evaluations"]].concat();
    assert_eq!(dgd(&[&args[..], &["3"]].concat()).code, 3, "it ends in no minimum");
    let copy = folder.path().join("copy-of-dgd");
    fs::copy(env!("CARGO_BIN_EXE_dgd"), &copy).expect("the folder is writable");
    let file = fs::File::options().append(true).open(&copy).expect("it is there");
    file.set_modified(SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000_000))
        .expect("the folder is writable");
    drop(file);
    let mut resumed = Command::new(&copy);
    resumed.current_dir(root()).args(&args).args(["100", "--resume"]);
    let resumed = Run::of(&resumed.output().expect("the copy starts")).done();
    assert!(resumed.err.contains("going on with"), "{}", resumed.err);
}

/// A run that takes days: a long rod, shaken many times a second.
#[cfg(target_os = "linux")]
const LONG: &[u8] = b"\
model rod
size N = 2000
parameter tau [s] = 1  in 0.1 .. 10
state T[1..N] [1] = 0
equation first: tau*der(T[1]) = sin(50 [1/s]*time) - T[1]
for i in 2..N { equation cell[i]: tau*der(T[i]) = T[i-1] - T[i] }
output near [1] = T[1]  noise 0.1 [1]
";

/// Presses Ctrl-C after a command has computed for a while; returns how it ended.
#[cfg(target_os = "linux")]
fn interrupted(args: &[&str]) -> Run {
    let mut child = started(args);
    wait_until_it_minds_ctrl_c(&mut child);
    std::thread::sleep(Duration::from_millis(1500));
    assert!(child.try_wait().expect("a child").is_none(), "it ended by itself");
    interrupt(&child);
    let pressed = std::time::Instant::now();
    let run = Run::of(&child.wait_with_output().expect("it ends"));
    assert!(pressed.elapsed() < Duration::from_secs(20), "{:?}", pressed.elapsed());
    assert_eq!(run.code, 130, "{}", run.err);
    run
}

#[cfg(target_os = "linux")]
#[test]
fn ctrl_c_stops_within_a_run_and_the_rows_so_far_are_kept() {
    let folder = folder_with(&[("rod.dgd", LONG), ("sets.csv", b"tau [s]\n1\n2\n")]);
    let (model, out) = (path(&folder, "rod.dgd"), path(&folder, "run.csv"));
    let until = ["--until", "1e4", "--rtol", "1e-9"];
    let often = ["--every", "0.01", "-o", &out];
    let run = interrupted(&[&["simulate", &model], &until[..], &often].concat());
    assert!(
        run.err.contains("stopped by Ctrl-C at ") && run.err.contains(" of 10000 s"),
        "{}",
        run.err
    );
    assert_eq!(listing(&folder), ["rod.dgd", "run.partial.csv", "sets.csv"]);
    let kept = fs::read_to_string(folder.path().join("run.partial.csv")).expect("it was written");
    let near = column(&kept, "near [1]");
    assert!(near.len() > 2 && near.iter().all(|value| value.is_finite()), "{}", near.len());
    assert!(run.err.contains(&format!("({} rows)", near.len())), "{}", run.err);

    let sets = path(&folder, "sets.csv");
    let seldom = ["--every", "10"];
    let run =
        interrupted(&[&["simulate", &model, "--ensemble", &sets], &until[..], &seldom].concat());
    assert!(run.err.contains("the result has the 0 of 2 sets that were done"), "{}", run.err);
    let of_args = ["--of", "near", "--to", "tau", "--format", "json"];
    let run = interrupted(&[&["sensitivity", &model], &of_args[..], &until, &seldom].concat());
    let document = run.json();
    assert!(
        document["error"].as_str().is_some_and(|words| words.contains("Ctrl-C")),
        "{}",
        document["error"]
    );
    let run = interrupted(&[&["linearize", &model, "--at", "1e4"], &until[2..]].concat());
    assert!(run.err.contains("there is no result"), "{}", run.err);
}

#[cfg(target_os = "linux")]
#[test]
fn a_fit_whose_first_simulation_ctrl_c_stops_says_that_nothing_is_kept() {
    let data = b"time [s],near [1]\n0,0\n1e3,0.1\n2e3,0.1\n3e3,0\n1e4,0.1\n";
    let folder = folder_with(&[("rod.dgd", LONG), ("d.csv", data)]);
    let (model, data, out) =
        (path(&folder, "rod.dgd"), path(&folder, "d.csv"), path(&folder, "out"));
    let run = interrupted(&["fit", &model, "--data", &data, "--steps", "adaptive", "-o", &out]);
    assert!(run.err.contains("before the first simulation had ended"), "{}", run.err);
    assert!(!folder.path().join("out").exists());
}

#[cfg(target_os = "linux")]
#[test]
fn ctrl_c_stops_a_filter_between_two_rows() {
    const MODEL: &[u8] = b"\
model shaken
parameter tau [s] = 1  in 0.1 .. 10
state x [1] = 0
equation lag: tau*der(x) = sin(50 [1/s]*time) - x
output y [1] = x  noise 0.1 [1]
";
    let mut data = "time [s],y [1]\n".to_owned();
    // Two rows are nearly as many steps apart as allowed, and a likelihood takes minutes.
    for row in 0..400 {
        let _ = writeln!(data, "{row}e3,{}", 0.1 * f64::from(row % 3));
    }
    let folder = folder_with(&[("m.dgd", MODEL), ("d.csv", data.as_bytes())]);
    let (model, data) = (path(&folder, "m.dgd"), path(&folder, "d.csv"));
    let run = interrupted(&["fit", &model, "--data", &data, "--estimator", "prediction-error"]);
    assert!(run.err.contains("before the first simulation had ended"), "{}", run.err);
}

#[cfg(target_os = "linux")]
#[test]
fn a_bootstrap_that_ctrl_c_stops_gives_what_is_complete() {
    let data = "time [s],y [1]\n0,1\n1,2.1\n2,2.9\n3,4.2\n4,4.8\n5,6.1\n";
    let model =
        "model line\nparameter a [1/s] = 0.5\nparameter b [1] = 0\noutput y [1] = a*time + b\n";
    let folder = folder_with(&[("m.dgd", model.as_bytes()), ("d.csv", data.as_bytes())]);
    let (model, data) = (path(&folder, "m.dgd"), path(&folder, "d.csv"));
    // More data sets than there is time for. The interrupt comes later each time, until the fit itself is finished.
    let mut waited = std::time::Duration::from_millis(50);
    loop {
        let mut child = started(&["fit", &model, "--data", &data, "--bootstrap", "1000000"]);
        wait_until_it_minds_ctrl_c(&mut child);
        std::thread::sleep(waited);
        interrupt(&child);
        let run = Run::of(&child.wait_with_output().expect("it ends"));
        assert_eq!(run.code, 130, "{}", run.err);
        if !run.out.contains("stopped before it converged") {
            assert!(run.out.contains("the bootstrap was stopped after "), "{}", run.out);
            assert!(run.out.contains(" of 1000000 data sets"), "{}", run.out);
            break;
        }
        waited *= 2;
    }
}

/// A request beyond the memory of any machine is refused before it is tried, and the message names its cause.
#[test]
fn a_run_that_needs_too_much_memory_says_what_asks_for_it() {
    let line = "size N = 20000
        state T[1..N] [K] = 290
        equation first: der(T[1]) = (300 [K] - T[1])/1 [s]
        for i in 2..N { equation cell[i]: der(T[i]) = (T[i-1] - T[i])/1 [s] }
        output T";
    let (_folder, model) = with_model(line);
    let args = ["simulate", &model, "--until", "1", "--every", "1e-7"];
    dgd(&args).refused(3, &["of memory", "10000001 rows of 20000 outputs", "`--every`"]);
}

/// The same for commands that run a model many times.
#[test]
fn a_fit_a_search_and_an_ensemble_that_need_too_much_memory_say_what_asks_for_it() {
    let model = "model rod
        size N = 100000
        parameter tau [s] = 1  in 0.1 .. 10, log
        state T[1..N] [K] = 290
        equation first: der(T[1]) = (300 [K] - T[1])/tau
        for i in 2..N { equation cell[i]: der(T[i]) = (T[i-1] - T[i])/tau }
        output near [K] = T[1]  noise 0.1 [K]";
    // A million rows: more than a terabyte.
    let mut rows = String::new();
    for k in 0..1_000_000 {
        let _ = writeln!(rows, "{k},{}", 290 + k % 2);
    }
    let folder = folder_with(&[
        ("m.dgd", model.as_bytes()),
        ("d.csv", format!("time [s],near [K]\n{rows}").as_bytes()),
        ("s.csv", b"tau [s]\n1\n2\n"),
    ]);
    let run = |args: &[&str]| dgd_in(folder.path(), args);
    let what = ["of memory", "1000000 rows of 100000 unknowns and 1 output", "`--until`"];
    run(&["fit", "m.dgd", "--data", "d.csv"]).refused(3, &[&["the fit needs"][..], &what].concat());
    run(&["discover", "m.dgd", "--data", "d.csv"])
        .refused(3, &["the search needs", what[0], "100000 unknowns", what[2]]);
    run(&["simulate", "m.dgd", "--data", "d.csv", "--ensemble", "s.csv", "-o", "o.csv"])
        .refused(3, &[&["the ensemble needs", "sets at a time"][..], &what].concat());
    assert_eq!(listing(&folder), ["d.csv", "m.dgd", "s.csv"]);
}

/// A rate that starts at zero, without a second derivative there.
const HILL: &str = "
parameter k = 1.5
state x = 0 fixed
state y = 1 fixed
equation e: 1 [s]*der(x) = 1
equation f: 1 [s]*der(y) = -y*x^k/(0.4^k + x^k)
output y
";

/// If the default method cannot start a run but another can, the other is used with a note. A method named by the user
/// is never replaced.
#[test]
fn a_method_that_can_begin_is_taken_before_the_run() {
    let (folder, model) = with_model(HILL);
    let args = ["sensitivity", &model, "--until", "3", "--every", "1", "--of", "y"];
    let chosen = dgd(&args).done();
    let text =
        "`rodas5p` cannot begin at t = 0 s, where a derivative of equation `f` is not finite";
    assert!(chosen.err.contains(text) && chosen.err.contains("`kencarp4`"), "{}", chosen.err);
    let named = dgd(&[&args[..], &["--method", "kencarp4"]].concat()).done();
    assert_eq!(chosen.out, named.out);
    dgd(&[&args[..], &["--method", "rodas5p"]].concat())
        .refused(3, &["a derivative of equation `f` is not finite at t = 0 s"]);

    let simulated = dgd(&["simulate", &model, "--until", "3", "--every", "0.1"]).done();
    let recording = path(&folder, "r.csv");
    fs::write(&recording, &simulated.out).expect("a file");
    let fitted = dgd(&["fit", &model, "--data", &recording, "--set", "k=1.3"]).done();
    assert!(fitted.err.contains(text), "{}", fitted.err);
}

/// A fit that starts where the default method can start a run, and ends where it cannot.
#[test]
fn a_fit_that_comes_to_where_its_method_cannot_begin_is_run_again_with_another() {
    let (folder, model) = with_model(HILL);
    let recording = path(&folder, "r.csv");
    for k in ["1.5", "1.2"] {
        let set = format!("k={k}");
        let args = ["simulate", &model, "--until", "3", "--every", "0.1", "--set", &set];
        fs::write(&recording, dgd(&args).done().out).expect("a file");
        let fit = ["fit", &model, "--data", &recording, "--set", "k=2.5", "--format", "json"];
        let run = dgd(&fit).done();
        let text = "`rodas5p` cannot begin at t = 0 s";
        assert!(run.err.contains(text) && run.err.contains("again"), "{}", run.err);
        let estimate = run.json()["parameters"]["k"]["value"].as_f64().expect("a number");
        let apart = (estimate - k.parse::<f64>().expect("a number")).abs();
        assert!(apart < 1e-3, "{estimate}");
        dgd(&[&fit[..], &["--method", "rodas5p"]].concat()).refused(3, &["cannot be simulated"]);
    }
}
