//! Tasks on texts that were never in a file, and on several threads at once.

use std::path::PathBuf;

use dgd_data::{DataColumns, DiskFiles, FileSystem, InMemory, LayeredFiles};
use dgd_discover::Verdict;
use dgd_identify::{Monitor, Progress};
use serde_json::Value;

use crate::{
    CheckRequest, DiscoverRequest, FitRequest, LinearizeAt, LinearizeRequest, Remark, Reporter,
    RunRequest, ScreenRequest, SensitivityRequest, SilentReporter, SimulateRequest, TaskContext,
    check, discover, fit, linearize, screen, sensitivity, simulate,
};

const MODEL: &str = "\
model tank
import \"valves.dgd\"

input q_in [lpm] hold
parameter A [m^2] = 2    in 0.1 .. 10
parameter k [lpm] = 300  in 0 ..
state h [m] = 1
equation level: A * der(h) = q_in - k * opening(h)
output h [m] noise 1 [mm]
";

const LIBRARY: &str = "function opening(h [m]) = sqrt(max(h, 0) / 1 [m])\n";

const LEAK: &str = "\
/// A hole in the wall.
effect leak on tank
kind plant
parameter q_leak [lpm] = 60 in 0 ..
null q_leak = 0
replace q_in by q_in - (if h > 0.5 [m] then q_leak else 0 [lpm])
";

const SLIP: &str = "\
/// The pump moves less than its strokes say.
effect slip on tank
kind input
parameter part [%] = 5 in 0 .. 50
null part = 0
replace q_in by q_in * (1 - part)
";

/// The pump is switched on and off.
fn inputs() -> String {
    let rows = (0..240).map(|k| {
        let q = [300, 420, 180, 360][k / 20 % 4];
        format!("{},{q}\n", 10 * k)
    });
    rows.fold("time [s],q_in [lpm]\n".to_owned(), |all, row| all + &row)
}

fn files() -> InMemory {
    InMemory::default()
        .with_file("rig/tank.dgd", MODEL)
        .with_file("rig/valves.dgd", LIBRARY)
        .with_file("rig/effects/leak.dgd", LEAK)
        .with_file("rig/effects/slip.dgd", SLIP)
        .with_file("rig/inputs.csv", inputs())
}

/// A recording of a rig with a leak.
fn recorded(seed: u64) -> Vec<u8> {
    let files = files();
    let mut run = RunRequest::new("rig/tank.dgd");
    run.data = Some("rig/inputs.csv".into());
    run.choices.apply = vec!["leak".to_owned()];
    let mut request = SimulateRequest::new(run);
    request.noise_seed = Some(seed);
    let session = TaskContext::new(&SilentReporter).with_files(&files);
    let simulated = simulate(&request, session).unwrap_or_else(|error| panic!("{error}"));
    let mut csv = Vec::new();
    simulated.table.write_csv(&mut csv).expect("memory can be written to");
    csv
}

fn recordings() -> InMemory {
    files().with_file("rig/monday.csv", recorded(1)).with_file("rig/tuesday.csv", recorded(2))
}

/// The results of every task on the rig.
fn worked(files: &dyn FileSystem, root: &str) -> Vec<Value> {
    let path = |name: &str| PathBuf::from(root).join(name);
    let session = TaskContext::new(&SilentReporter).with_files(files).with_threads(1);
    let mut run = RunRequest::new(path("rig/tank.dgd"));
    run.data = Some(path("rig/monday.csv"));
    let monday = vec![path("rig/monday.csv")];
    let mut linear = LinearizeRequest::new(path("rig/tank.dgd"), LinearizeAt::Time(500.0));
    linear.data.clone_from(&run.data);
    let json = |value: Result<Value, crate::WorkError>| value.unwrap_or_else(|e| panic!("{e}"));
    let mut results = vec![
        json(check(&CheckRequest::new(path("rig/tank.dgd")), session).map(|x| {
            x.to_json().unwrap_or_else(|| panic!("a model that is checked has a description"))
        })),
        json(simulate(&SimulateRequest::new(run.clone()), session).map(|x| x.to_json())),
        json(sensitivity(&SensitivityRequest::new(run), session).map(|x| x.to_json())),
        json(linearize(&linear, session).map(|x| x.to_json())),
        json(screen(&ScreenRequest::new(monday.clone()), session).map(|x| x.to_json())),
        json(fit(&FitRequest::new(path("rig/tank.dgd"), monday), session).map(|x| x.to_json())),
    ];
    // File names have the prefix of the request.
    for value in &mut results {
        let text = value.to_string().replace(root, "");
        *value = serde_json::from_str(&text).expect("it was JSON");
    }
    results
}

#[test]
fn texts_give_what_files_give() {
    let texts = recordings();
    let folder = tempfile::tempdir().expect("a folder for the test");
    let root = format!("{}/", folder.path().display());
    let names = ["tank.dgd", "valves.dgd", "effects/leak.dgd", "effects/slip.dgd", "monday.csv"];
    std::fs::create_dir_all(folder.path().join("rig/effects")).expect("it is writable");
    for name in names {
        let path = PathBuf::from("rig").join(name);
        let mut contents = Vec::new();
        let mut file = texts.open(&path).expect("it is there");
        file.read_to_end(&mut contents).expect("memory can be read");
        std::fs::write(folder.path().join(path), contents).expect("it is writable");
    }
    for (k, (text, file)) in worked(&texts, "").iter().zip(worked(&DiskFiles, &root)).enumerate() {
        assert!(*text == file, "piece of work {k}");
    }
}

#[test]
fn what_is_hidden_in_texts_is_named() {
    let texts = recordings();
    let mut request = DiscoverRequest::new("rig/tank.dgd", vec!["rig/monday.csv".into()]);
    request.valid = vec!["rig/tuesday.csv".into()];
    let session = TaskContext::new(&SilentReporter).with_files(&texts);
    let discovered = discover(&request, session).unwrap_or_else(|error| panic!("{error}"));
    let names: Vec<&str> = discovered.discovery.effects.iter().map(|e| e.name.as_str()).collect();
    assert_eq!(names, ["leak"], "{}", discovered.to_text(None));
    let files = discovered.files().unwrap_or_else(|error| panic!("{error}"));
    let report = files.written.iter().find(|(name, _)| name == "report.html");
    let (_, page) = report.expect("there is a report");
    assert!(String::from_utf8_lossy(page).contains("<math"), "equations are in the report");
    // The corrected model is a text like any other.
    let corrected =
        texts.clone().with_file("rig/corrected.dgd", discovered.discovery.corrected.as_bytes());
    let session = session.with_files(&corrected);
    assert!(check(&CheckRequest::new("rig/corrected.dgd"), session).is_ok());
}

const ROOM: &str = "\
model room
input P [W] hold

parameter C [kJ/K] = 150  in 10 .. 5000, log
parameter R [K/kW] = 25   in 1 .. 500, log
state T [K] = 8    # above the outdoors
equation air: C*der(T) = P - T/R
output T [K] noise 20 [mK]
";

/// Influences on a room whose model reads only the heating: the sun matters, the wind does not.
fn day(room: &str, seed: u64) -> Vec<u8> {
    let rows = (0..400).map(|k: u64| {
        let heating = [0, 800, 1500, 300][((k / 23 + seed) % 4) as usize];
        let sun = 400.0 * (0.017 * k as f64 + seed as f64).sin().max(0.0);
        let wind = 5.0 + (0.3 * k as f64).sin() + (0.11 * k as f64 * seed as f64).cos();
        format!("{},{heating},{sun:.1},{wind:.2},7\n", 60 * k)
    });
    let header = "time [s],P [W],sun [W/m^2],wind [m/s],spare\n".to_owned();
    let table = rows.fold(header, |all, row| all + &row);
    let truth = room
        .replace("hold\n", "hold\ninput sun [W/m^2] linear\ninput wind [m/s]\ninput spare\n")
        .replace("P - T", "P + 1.7 [m^2]*sun - T");
    let files = InMemory::default().with_file("room.dgd", truth).with_file("inputs.csv", table);
    let mut run = RunRequest::new("room.dgd");
    run.data = Some("inputs.csv".into());
    run.choices.set = vec!["C=220".to_owned(), "R=18".to_owned()];
    let mut request = SimulateRequest::new(run);
    request.noise_seed = Some(seed);
    let simulated = simulate(&request, TaskContext::new(&SilentReporter).with_files(&files));
    let mut csv = Vec::new();
    let table = simulated.unwrap_or_else(|error| panic!("{error}")).table;
    table.write_csv(&mut csv).expect("memory can be written to");
    csv
}

#[test]
fn a_column_that_the_model_lacks_is_found_where_it_acts() {
    let files = InMemory::default()
        .with_file("room.dgd", ROOM)
        .with_file("monday.csv", day(ROOM, 1))
        .with_file("tuesday.csv", day(ROOM, 2));
    let session = TaskContext::new(&SilentReporter).with_files(&files);
    let mut request = DiscoverRequest::new("room.dgd", vec!["monday.csv".into()]);
    request.valid = vec!["tuesday.csv".into()];
    let discovered = discover(&request, session).unwrap_or_else(|error| panic!("{error}"));
    let law = discovered.discovery.law.as_ref().expect("a law");
    let [term] = &law.terms[..] else { panic!("{:?}", law.terms) };
    assert_eq!(term.target, "air");
    assert!(term.formula.ends_with("[m^2] * sun"), "{}", term.formula);
    let [area] = &term.coefficients[..] else { panic!("{term:?}") };
    assert!((area.value - 1.7).abs() < 4.0 * area.std.expect("a standard deviation"), "{area:?}");
    // Only the declaration of the used column is added.
    assert_eq!(discovered.base, ROOM);
    let corrected = &discovered.discovery.corrected;
    assert!(
        corrected.contains("input P   [W]     hold\ninput sun [W/m^2] linear\n"),
        "{corrected}"
    );
    assert!(!corrected.contains("wind") && !corrected.contains("spare"), "{corrected}");
    let corrected = files.clone().with_file("corrected.dgd", corrected.as_bytes());
    let session = session.with_files(&corrected);
    assert!(check(&CheckRequest::new("corrected.dgd"), session).is_ok());
    // The digest is that of the original model.
    let mut request = FitRequest::new("room.dgd", vec!["monday.csv".into()]);
    request.valid = vec!["tuesday.csv".into()];
    let fit = fit(&request, session).unwrap_or_else(|error| panic!("{error}"));
    let digest = |of: &Value| of.pointer("/provenance/model").cloned().expect("a digest");
    assert_eq!(digest(&discovered.to_json()), digest(&fit.to_json()));
}

/// A cell with a known initial charge. Its voltmeter has a small offset, for which the other parameters can compensate,
/// unless the first readings determine the initial charge.
const CELL: &str = "\
model cell
input i [A] hold
parameter Q [A*h]  = 60  in 1 .. 500, log
parameter R [mOhm] = 2   in 0.1 .. 50, log
parameter k [V]    = 0.8 in 0.1 .. 2
parameter d [V]    = 0   fixed
state s [1] = 0.9 fixed
equation charge: Q*der(s) = -i
output v [V] = 3.2 [V] + d + k*s - R*i noise 2 [mV]
";

#[test]
fn a_start_that_is_fixed_stays_in_a_search_as_in_a_fit() {
    let session = TaskContext::new(&SilentReporter);
    let mut files = InMemory::default().with_file("cell.dgd", CELL);
    for (name, seed) in [("monday.csv", 1), ("tuesday.csv", 2)] {
        let rows = (0..400).map(|k| format!("{k},{}\n", [10, 0, 20, 5, 15][(k / 20 + seed) % 5]));
        files = files
            .with_file("i.csv", rows.fold("time [min],i [A]\n".to_owned(), |all, row| all + &row));
        let mut run = RunRequest::new("cell.dgd");
        run.data = Some("i.csv".into());
        run.choices.set = vec!["d=0.03".to_owned()];
        let mut request = SimulateRequest::new(run);
        request.noise_seed = Some(seed as u64);
        let simulated = simulate(&request, session.with_files(&files));
        let mut csv = Vec::new();
        let table = simulated.unwrap_or_else(|error| panic!("{error}")).table;
        table.write_csv(&mut csv).expect("memory can be written to");
        files = files.with_file(name, csv);
    }
    let session = session.with_files(&files);
    let mut request = DiscoverRequest::new("cell.dgd", vec!["monday.csv".into()]);
    request.valid = vec!["tuesday.csv".into()];
    let discovered = discover(&request, session).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(
        discovered.discovery.verdict,
        Verdict::Sufficient,
        "{}",
        discovered.discovery.reason
    );
    let mut request = FitRequest::new("cell.dgd", vec!["monday.csv".into()]);
    request.valid = vec!["tuesday.csv".into()];
    let fit = fit(&request, session).unwrap_or_else(|error| panic!("{error}"));
    let k = fit.to_json().pointer("/parameters/k/value").and_then(Value::as_f64);
    let base = discovered.discovery.base_parameters.iter().find(|p| p.name == "k");
    let (k, base) = (k.expect("a value"), base.expect("it is estimated").value);
    assert!((k - base).abs() < 1e-6, "{k} {base}");
}

/// Three bodies in a row, the first of which is heated.
const BODIES: &str = "\
model bodies
size N = 3
input q [kW] hold
parameter k [kW/K] = 0.1  in 0.001 .. 10, log
constant C [kJ/K] = 4
state T[1..N] [°C] = 20
equation first: C*der(T[1]) = q - k*(T[1] - T[2])
for i in 2..N-1 { equation inner[i]: C*der(T[i]) = k*(T[i-1] - 2*T[i] + T[i+1]) }
equation last: C*der(T[N]) = k*(T[N-1] - T[N])
output T [°C] noise 0.05 [K]
";

#[test]
fn start_values_of_elements_are_estimated_where_asked() {
    let rows = (0..100).map(|k| format!("{},{}\n", 2 * k, k / 20 % 2));
    let inputs = rows.fold("time [s],q [kW]\n".to_owned(), |all, row| all + &row);
    let mut files = InMemory::default().with_file("bodies.dgd", BODIES).with_file("q.csv", inputs);
    let session = TaskContext::new(&SilentReporter);
    let mut run = RunRequest::new("bodies.dgd");
    run.data = Some("q.csv".into());
    run.choices.set = vec!["T=(35, 20, 10)".to_owned(), "k=0.14".to_owned()];
    let mut request = SimulateRequest::new(run);
    request.noise_seed = Some(1);
    let simulated = simulate(&request, session.with_files(&files));
    let mut csv = Vec::new();
    let table = simulated.unwrap_or_else(|error| panic!("{error}")).table;
    table.write_csv(&mut csv).expect("memory can be written to");
    files = files.with_file("data.csv", csv);
    let fitted = |free: &[&str]| {
        let mut request = FitRequest::new("bodies.dgd", vec!["data.csv".into()]);
        request.sought.free = free.iter().map(|&name| name.to_owned()).collect();
        fit(&request, session.with_files(&files)).unwrap_or_else(|error| panic!("{error}"))
    };
    let result = fitted(&["k", "T"]).to_json();
    let close = |pointer: &str, wanted: f64, within: f64| {
        let value = result.pointer(pointer).and_then(Value::as_f64);
        assert!(value.is_some_and(|v| (v - wanted).abs() < within), "{pointer}: {value:?}");
    };
    close("/parameters/k/value", 0.14, 1e-3);
    for (element, wanted) in [("T[1]", 35.0), ("T[2]", 20.0), ("T[3]", 10.0)] {
        close(&format!("/starts/0/values/{element}/value"), wanted, 0.1);
    }
    let starts = |free: &[&str]| -> Vec<String> {
        let starts = fitted(free).to_json()["starts"][0]["values"].as_object().cloned();
        starts.unwrap_or_default().into_iter().map(|(name, _)| name).collect()
    };
    assert_eq!(starts(&["k", "T[2]"]), ["T[2]"]);
    // Without a request they come from the model.
    assert!(starts(&[]).is_empty());
}

/// Stops a search as soon as it has begun.
#[derive(Debug)]
struct Impatient;

impl Monitor for Impatient {
    fn advanced(&self, _progress: Progress) {}

    fn is_stopped(&self) -> bool {
        true
    }
}

impl Reporter for Impatient {
    fn remark(&self, _remark: Remark<'_>) {}
}

#[test]
fn a_search_that_is_stopped_has_a_result_that_says_so() {
    let texts = recordings();
    let mut request = DiscoverRequest::new("rig/tank.dgd", vec!["rig/monday.csv".into()]);
    request.valid = vec!["rig/tuesday.csv".into()];
    let session = TaskContext::new(&Impatient).with_files(&texts);
    let discovered = discover(&request, session).unwrap_or_else(|error| panic!("{error}"));
    assert!(discovered.discovery.is_cut_short && discovered.discovery.effects.is_empty());
    assert!(
        discovered.reservations.iter().any(|words| words.starts_with("the search was stopped"))
    );
    let json = discovered.to_json().to_string();
    assert!(!json.contains("--budget") && discovered.page().is_ok(), "{json}");
}

/// The columns of a CSV text.
fn columns(csv: &[u8]) -> DataColumns {
    let text = String::from_utf8_lossy(csv).into_owned();
    let mut lines = text.lines();
    let headers = lines.next().unwrap_or_default().split(',');
    let mut columns: Vec<(String, Vec<f64>)> =
        headers.map(|header| (header.to_owned(), Vec::new())).collect();
    for line in lines {
        for (cell, (_, values)) in line.split(',').zip(&mut columns) {
            values.push(cell.parse().unwrap_or(f64::NAN));
        }
    }
    DataColumns { all: columns }
}

#[test]
fn columns_give_what_their_text_gives() {
    let monday = recorded(1);
    let as_text = files().with_file("rig/monday.csv", monday.clone());
    let as_columns = files().with_columns("rig/monday.csv", columns(&monday));
    let texts_and_columns = LayeredFiles { above: &as_columns, below: &as_text };
    let results = worked(&as_text, "").into_iter().zip(worked(&texts_and_columns, ""));
    for (k, (mut text, mut columns)) in results.enumerate() {
        // Digests are those of the files that were read.
        for value in [&mut text, &mut columns] {
            if let Some(data) = value.pointer_mut("/provenance/data") {
                *data = Value::Null;
            }
        }
        assert!(text == columns, "piece of work {k}");
    }
}

#[test]
fn a_missing_text_is_told_by_its_name() {
    let texts = InMemory::default().with_file("rig/tank.dgd", MODEL);
    let session = TaskContext::new(&SilentReporter).with_files(&texts);
    let error = |path: &str| match check(&CheckRequest::new(path), session) {
        Ok(_) => panic!("`{path}` is not there"),
        Err(error) => error.to_string(),
    };
    assert_eq!(error("tank.dgd"), "cannot read `tank.dgd`: there is no such file");
    let import = error("rig/tank.dgd");
    assert!(import.contains("cannot read `rig/valves.dgd`: there is no such file"), "{import}");
}

/// A compiled program serves any number of threads; each loads it without compiling.
#[test]
fn a_program_is_compiled_once_for_all_threads() {
    let texts = recordings();
    let session = TaskContext::new(&SilentReporter).with_files(&texts);
    let path = PathBuf::from("rig/tank.dgd");
    let directions = dgd_compiler::pipeline::SensitivityDirections::All;
    let model = crate::load(&path, &crate::ModelChoices::default(), &directions, session);
    let program = model.unwrap_or_else(|error| panic!("{error}")).compiled.program;
    let rates: Vec<f64> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4)
            .map(|k| {
                let program = program.clone();
                scope.spawn(move || {
                    let loaded = dgd_execute::LoadedSystem::new(program);
                    let p: Vec<f64> = {
                        use dgd_runtime::System;
                        loaded.signature().parameters.iter().map(|p| p.value).collect()
                    };
                    let mut rate = [0.0];
                    let point = dgd_runtime::EvaluationPoint {
                        t: 0.0,
                        y: &[1.0],
                        u: &[0.001 * f64::from(k)],
                        p: &p,
                        z: &[],
                    };
                    dgd_runtime::System::rhs(&loaded, point, &mut rate);
                    rate[0]
                })
            })
            .collect();
        threads.into_iter().filter_map(|thread| thread.join().ok()).collect()
    });
    assert_eq!(rates.len(), 4);
    for (k, rate) in rates.iter().enumerate() {
        let expected = (0.001 * k as f64 - 0.005) / 2.0;
        assert!((rate - expected).abs() < 1e-15, "{rate} {expected}");
    }
}
