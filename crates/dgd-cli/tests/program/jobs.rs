//! `dgd job`: results of pieces are complete or absent, whichever process is killed.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::schema::assert_is;
use crate::support::{Normal, Run, command, dgd_in, folder_with};

const CUP: &str = "model cup\n\
    parameter tau [s] = 100 in 1 .. 1e4\n\
    state T [K] = 70\n\
    equation cooling: tau*der(T) = -T\n\
    output T [K] noise 0.1\n";

/// A cup that cools, in closed form, with noise.
fn cup(tau: f64, seed: u64) -> String {
    let mut normal = Normal::new(seed);
    let row = |k: u32| {
        let t = f64::from(k) * 5.0;
        format!("{t},{}\n", 75.0 * (-t / tau).exp() + 0.1 * normal.next())
    };
    std::iter::once("time [s],T [K]\n".to_owned()).chain((0..60).map(row)).collect()
}

/// A job with this many wells; its tasks are JSON.
fn job(wells: usize, todo: &Value) -> TempDir {
    let folder = folder_with(&[("cup.dgd", CUP.as_bytes())]);
    let mut entries = serde_json::Map::new();
    for k in 0..wells {
        let name = format!("w{k:03}.csv");
        let text = cup(80.0 + k as f64, 1 + k as u64);
        fs::write(folder.path().join(&name), text).expect("the folder is writable");
        entries.insert(format!("W-{k}"), json!(name));
    }
    let job = json!({ "model": "cup.dgd", "do": todo, "wells": entries });
    fs::write(folder.path().join("job.json"), job.to_string()).expect("the folder is writable");
    folder
}

fn run_in(folder: &TempDir, more: &[&str]) -> Run {
    dgd_in(folder.path(), &[&["job", "run", "job.json", "--into", "out"], more].concat())
}

fn status(folder: &TempDir) -> Value {
    let words = ["job", "status", "job.json", "--into", "out", "--format", "json"];
    let status = dgd_in(folder.path(), &words).done().json();
    assert_is("job_status", &status);
    status
}

/// All results of a folder, by relative path. Temporary files must not be among them.
fn results(into: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut result = BTreeMap::new();
    let mut folders = vec![into.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else {
                // A temporary file may have become a result in the meantime.
                let Ok(bytes) = fs::read(&path) else { continue };
                result.insert(path.strip_prefix(into).expect("below").to_owned(), bytes);
            }
        }
    }
    result
}

fn is_draft(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'))
}

#[test]
fn pieces_are_computed_once_and_are_what_the_command_says() {
    let todo = json!(["fit", { "kind": "profile", "of": ["tau"] }]);
    let folder = job(3, &todo);
    let before = status(&folder);
    assert_eq!((&before["pieces"], &before["open"]), (&json!(6), &json!(6)));
    let tally = run_in(&folder, &["--format", "json"]).done().json();
    assert_is("job_run", &tally);
    assert_eq!(tally, json!({ "pieces": 6, "had": 0, "computed": 6, "failed": 0 }));
    let first = results(&folder.path().join("out"));
    assert_eq!(first.len(), 7, "six results and whose they are");
    let again = run_in(&folder, &[]).done();
    assert!(again.out.contains("0 computed, 6 had a result"), "{}", again.out);
    assert_eq!(results(&folder.path().join("out")), first);
    let after = status(&folder);
    assert_eq!((&after["done"], &after["open"]), (&json!(6), &json!(0)));
    for (path, bytes) in first.iter().filter(|(path, _)| path.starts_with("done")) {
        let document: Value = serde_json::from_slice(bytes).expect("JSON");
        assert_is("job_piece", &document);
        let words = document["piece"]["command"].as_str().expect("a command line");
        let words: Vec<&str> = words.split(' ').skip(1).chain(["--format", "json"]).collect();
        let alone = dgd_in(folder.path(), &words).done().json();
        assert_eq!(document["result"], alone, "{}", path.display());
    }
    // Another folder gives the same names and the same bytes.
    let copy = job(3, &todo);
    run_in(&copy, &["--workers", "1"]).done();
    assert_eq!(results(&copy.path().join("out")), first);
    // Other data is other work.
    fs::write(folder.path().join("w001.csv"), cup(200.0, 9)).expect("writable");
    assert_eq!(status(&folder)["open"], 2);
    run_in(&folder, &[]).done();
    assert_eq!(results(&folder.path().join("out")).len(), 9);
}

#[test]
fn shares_and_single_pieces_are_parts_of_the_whole() {
    let folder = job(5, &json!(["fit"]));
    run_in(&folder, &["--index", "4"]).done();
    assert_eq!(status(&folder)["done"], 1);
    run_in(&folder, &["--share", "0/2"]).done();
    assert_eq!(status(&folder)["done"], 3);
    run_in(&folder, &["--share", "1/2"]).done();
    assert_eq!(status(&folder)["open"], 0);
    run_in(&folder, &["--index", "5"]).refused(2, &["5 pieces", "counted from 0"]);
    run_in(&folder, &["--share", "2/2"]).refused(2, &["`0/100`"]);
}

#[test]
fn starts_and_replicates_of_pieces_are_those_of_one_fit() {
    let todo = json!([
        { "kind": "starts", "count": 4 }, { "kind": "replicates", "count": 45, "each": 15 }
    ]);
    let folder = job(1, &todo);
    run_in(&folder, &[]).done();
    let documents: Vec<Value> = results(&folder.path().join("out"))
        .iter()
        .filter(|(path, _)| path.starts_with("done"))
        .map(|(_, bytes)| serde_json::from_slice(bytes).expect("JSON"))
        .collect();
    let fit = ["fit", "cup.dgd", "--data", "w000.csv", "--format", "json"];
    let whole = |more: &[&str]| dgd_in(folder.path(), &[&fit, more].concat()).done().json();
    let starts = whole(&["--starts", "4"]);
    let value_of = |document: &&Value| document["piece"]["kind"]["start"].is_object();
    let deviances = documents.iter().filter(value_of).map(|one| one["result"]["deviance"].as_f64());
    let least = deviances.map(|one| one.expect("a number")).fold(f64::INFINITY, f64::min);
    assert_eq!(Some(least), starts["deviance"].as_f64());
    // The percentiles of all replicates, merged by the report.
    let bootstrap = &whole(&["--bootstrap", "45"])["bootstrap"]["estimates"]["tau"]["interval"];
    let report = ["job", "report", "job.json", "--into", "out", "--format", "json"];
    let report = dgd_in(folder.path(), &report).done().json();
    let tau = &report["wells"][0]["occasions"][0]["parameters"]["tau"];
    assert_eq!((&tau["by"], &tau["band"]), (&json!("replicates"), bootstrap));
    assert_eq!(report["wells"][0]["occasions"][0]["starts"]["of"], 4);
}

#[test]
fn a_piece_that_fails_has_a_result_and_stops_nobody() {
    let folder = job(3, &json!(["fit"]));
    let file = folder.path().join("w001.csv");
    fs::write(&file, "time [s],T [K]\n0,75\n1,what\n").expect("writable");
    fs::remove_file(folder.path().join("w002.csv")).expect("it was there");
    run_in(&folder, &[])
        .refused(1, &["2 of 3 pieces failed", "dgd job status job.json --into out"]);
    let failed = status(&folder);
    assert_eq!(
        (&failed["done"], &failed["failed"], &failed["open"]),
        (&json!(1), &json!(2), &json!(0))
    );
    let text = dgd_in(folder.path(), &["job", "status", "job.json", "--into", "out"]).done().out;
    assert!(text.contains("dgd fit cup.dgd --data w001.csv"), "{text}");
    assert!(failed["failures"][0]["error"].as_str().is_some_and(|error| error.contains("E6")));
    for (path, bytes) in results(&folder.path().join("out")) {
        if path.starts_with("failed") {
            assert_is("job_piece", &serde_json::from_slice(&bytes).expect("JSON"));
        }
    }
    // Another run leaves them, unless `--retry` is given.
    let again = run_in(&folder, &["--format", "json"]);
    assert_eq!(again.json()["computed"], 0);
    assert_eq!(run_in(&folder, &["--retry", "--format", "json"]).json()["computed"], 2);
    // A corrected recording is a new piece, and done.
    fs::write(&file, cup(90.0, 3)).expect("writable");
    assert_eq!(status(&folder)["open"], 1);
}

#[test]
fn a_job_that_makes_no_sense_is_refused_before_anything_is_computed() {
    let folder = job(1, &json!(["fit"]));
    let write = |text: &str| fs::write(folder.path().join("job.json"), text).expect("writable");
    write(r#"{ "model": "cup.dgd", "do": ["fit"], "wells": { "a": [{ "dat": "a.csv" }] } }"#);
    run_in(&folder, &[]).refused(1, &["job.json", "`wells.a[0].dat`", "did you mean `data`?"]);
    write(
        r#"{ "model": "cup.dgd", "do": ["fit"], "options": ["--rtl", "1"], "wells": { "a": "w000.csv" } }"#,
    );
    run_in(&folder, &[]).refused(2, &["job.json", "fit of `a`", "--rtl"]);
    assert!(!folder.path().join("out").exists());
}

#[test]
fn results_of_another_build_are_not_mixed_with() {
    let folder = job(1, &json!(["fit"]));
    run_in(&folder, &[]).done();
    let path = folder.path().join("out").join("fleet.json");
    let text = fs::read_to_string(&path).expect("it was written");
    let mut value: Value = serde_json::from_str(&text).expect("JSON");
    value["identity"]["build"] = json!("fnv1a-128:0123456789abcdef0123456789abcdef");
    fs::write(&path, value.to_string()).expect("writable");
    run_in(&folder, &[]).refused(1, &["another build", "89abcdef", "--into"]);
}

#[test]
fn an_identical_copy_of_the_program_goes_on() {
    let folder = job(4, &json!(["fit"]));
    run_in(&folder, &["--share", "0/2"]).done();
    let copy = folder.path().join("copied");
    fs::copy(env!("CARGO_BIN_EXE_dgd"), &copy).expect("it can be copied");
    let words = ["job", "run", "job.json", "--into", "out", "--format", "json"];
    let done = std::process::Command::new(&copy).args(words).current_dir(folder.path()).output();
    let run = Run::of(&done.expect("the copy starts")).done();
    assert_eq!((&run.json()["had"], &run.json()["computed"]), (&json!(2), &json!(2)));
}

/// Children of a process.
#[cfg(target_os = "linux")]
fn children(of: u32) -> Vec<u32> {
    let read = |tid: fs::DirEntry| fs::read_to_string(tid.path().join("children")).ok();
    let tasks = fs::read_dir(format!("/proc/{of}/task")).into_iter().flatten().flatten();
    let texts: Vec<String> = tasks.filter_map(read).collect();
    texts.iter().flat_map(|text| text.split_whitespace()).filter_map(|id| id.parse().ok()).collect()
}

#[cfg(target_os = "linux")]
fn kill(process: u32) {
    let _ = std::process::Command::new("kill").args(["-9", &process.to_string()]).status();
}

#[cfg(target_os = "linux")]
fn begun(folder: &TempDir) -> Child {
    let mut run =
        command(folder.path(), &["job", "run", "job.json", "--into", "out", "--workers", "2"]);
    run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the command starts")
}

/// Whichever process is killed, a run or one of its children: the bytes are the same, no piece is computed twice, and
/// another run computes nothing.
#[test]
#[cfg(target_os = "linux")]
fn ten_kills_at_random_moments_change_nothing() {
    use std::os::unix::fs::MetadataExt;
    let todo = json!(["fit", { "kind": "profile", "of": ["tau", "T(0)"] }]);
    let (folder, undisturbed) = (job(20, &todo), job(20, &todo));
    let began = Instant::now();
    run_in(&undisturbed, &["--workers", "2"]).done();
    let took = began.elapsed();
    let into = folder.path().join("out");
    let mut normal = Normal::new(28);
    let mut inodes: BTreeMap<PathBuf, u64> = BTreeMap::new();
    let mut run = begun(&folder);
    let mut kills = 0;
    while kills < 10 {
        std::thread::sleep(took.mul_f64(0.06 * normal.next().abs()));
        if run.try_wait().expect("a child").is_some() {
            break;
        }
        // Alternately the run and one of its children.
        if kills % 2 == 0 {
            kill(run.id());
            run.wait().expect("it ends");
            run = begun(&folder);
        } else if let Some(child) = children(run.id()).first() {
            kill(*child);
        }
        kills += 1;
        for (path, _) in results(&into).iter().filter(|(path, _)| !is_draft(path)) {
            let inode = fs::metadata(into.join(path)).expect("it is there").ino();
            let before = *inodes.entry(path.clone()).or_insert(inode);
            assert_eq!(before, inode, "{} was computed again", path.display());
        }
    }
    assert!(kills >= 6, "the fleet was done after {kills} kills");
    run.wait().expect("it ends");
    let tally = run_in(&folder, &["--format", "json"]).done().json();
    assert_eq!(tally["computed"], 0);
    assert!(results(&into).keys().all(|path| !is_draft(path)), "no left-overs");
    assert_eq!(results(&into), results(&undisturbed.path().join("out")));
    for (path, inode) in inodes {
        assert_eq!(fs::metadata(into.join(&path)).expect("it is there").ino(), inode);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_piece_whose_process_is_ended_each_time_is_given_up() {
    let folder = job(1, &json!([{ "kind": "replicates", "count": 20_000 }, "fit"]));
    let mut run = begun(&folder);
    let done = folder.path().join("out").join("done");
    let began = Instant::now();
    while results(&done).keys().all(|path| is_draft(path)) {
        assert!(began.elapsed() < Duration::from_mins(1), "the other piece is done");
        std::thread::sleep(Duration::from_millis(10));
    }
    while run.try_wait().expect("a child").is_none() {
        children(run.id()).into_iter().for_each(kill);
        assert!(began.elapsed() < Duration::from_mins(2), "it is given up");
        std::thread::sleep(Duration::from_millis(200));
    }
    assert_eq!(run.wait().expect("it ends").code(), Some(1));
    let failed = status(&folder);
    assert_eq!(
        (&failed["done"], &failed["failed"], &failed["open"]),
        (&json!(1), &json!(1), &json!(0))
    );
    let error = failed["failures"][0]["error"].as_str().expect("a reason");
    assert!(error.contains("3 times") && error.contains("was killed"), "{error}");
}

#[test]
#[cfg(target_os = "linux")]
fn children_end_within_a_second_of_their_parent() {
    let folder = job(30, &json!([{ "kind": "replicates", "count": 2000 }]));
    let mut run = begun(&folder);
    let is_there = |id: &u32| {
        let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
        // A zombie process has ended.
        status.lines().any(|line| line.starts_with("State:") && !line.contains('Z'))
    };
    let mut entries = Vec::new();
    let began = Instant::now();
    while entries.len() < 2 && began.elapsed() < Duration::from_secs(20) {
        entries = children(run.id());
    }
    // In the middle of their work.
    std::thread::sleep(Duration::from_millis(300));
    assert!(entries.len() == 2 && entries.iter().all(is_there));
    kill(run.id());
    let killed = Instant::now();
    run.wait().expect("it ends");
    while entries.iter().any(is_there) {
        assert!(killed.elapsed() < Duration::from_secs(1), "{entries:?} are still there");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_discovery_says_what_a_well_lacks_since_when_and_has_the_corrected_model() {
    let folder = folder_with(&[]);
    dgd_in(folder.path(), &["new", "tank", "--template", "tank"]).done();
    let occasion = json!([{ "when": "2024-01", "data": "train.csv", "valid": "valid.csv" }]);
    let job = json!({ "model": "two_tanks.dgd", "do": ["discover"], "wells": { "T-1": occasion } });
    fs::write(folder.path().join("tank/job.json"), job.to_string()).expect("writable");
    let words = ["tank/job.json", "--into", "out"];
    dgd_in(folder.path(), &[&["job", "run"], &words[..]].concat()).done();
    let report = [&["job", "report"], &words[..], &["--format", "json"]].concat();
    let report = dgd_in(folder.path(), &report).done().json();
    assert_is("job_report", &report);
    let lacks = &report["wells"][0]["lacks"][0];
    assert_eq!((&lacks["name"], &lacks["since"]), (&json!("leak_lower"), &json!("2024-01")));
    assert_eq!(report["missing"][0]["wells"], json!(["T-1"]));
    let entries = results(&folder.path().join("out/done"));
    let document = entries.into_values().next().expect("a result");
    let document: Value = serde_json::from_slice(&document).expect("JSON");
    assert_is("job_piece", &document);
    let corrected = document["files"]["two_tanks.dgd"].as_str().expect("a model");
    fs::write(folder.path().join("tank/corrected.dgd"), corrected).expect("writable");
    dgd_in(folder.path(), &["check", "tank/corrected.dgd"]).done();
}

/// A worker, controlled like by its parent.
struct Worker {
    child: Child,
    answers: BufReader<std::process::ChildStdout>,
}

impl Worker {
    fn start(folder: &Path) -> Worker {
        let mut command = command(folder, &["job", "work"]);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the command starts");
        let answers = BufReader::new(child.stdout.take().expect("a pipe"));
        Worker { child, answers }
    }

    fn ask(&mut self, question: &Value) -> Value {
        let mut input = self.child.stdin.as_ref().expect("a pipe");
        writeln!(input, "{question}").expect("it reads");
        let mut line = String::new();
        self.answers.read_line(&mut line).expect("it answers");
        serde_json::from_str(&line).unwrap_or_default()
    }
}

/// The request to a worker for the first piece of a job.
fn task(folder: &TempDir) -> Value {
    let listed = dgd_in(folder.path(), &["job", "tasks", "job.json", "--into", "out"]).done().out;
    let line: Value = serde_json::from_str(listed.lines().nth(1).expect("a piece")).expect("JSON");
    line["task"].clone()
}

#[test]
#[cfg(target_os = "linux")]
fn a_piece_that_needs_too_much_memory_fails_with_a_word() {
    let folder = job(1, &json!([{ "kind": "replicates", "count": 3000 }]));
    let mut task = task(&folder);
    // Any process of dgd uses more.
    task["memory"] = json!(1_000_000);
    let mut worker = Worker::start(folder.path());
    let answer = worker.ask(&json!({ "perform": task }));
    assert_eq!(answer["failed"], task["name"]);
    assert!(worker.child.wait().expect("it ends").success(), "its memory is free again");
    let failed = status(&folder);
    let error = failed["failures"][0]["error"].as_str().expect("a reason");
    assert!(error.contains("1 MB") && error.contains("--memory"), "{error}");
    // With a larger limit it is done.
    let run = run_in(&folder, &["--retry", "--memory", "8GB", "--format", "json"]).done().json();
    assert_eq!((&run["computed"], &run["failed"]), (&json!(1), &json!(0)));
    assert_eq!(status(&folder)["done"], 1);
}

#[test]
fn a_worker_answers_what_it_is_asked_and_says_which_build_it_is() {
    let folder = job(1, &json!(["fit"]));
    let mut worker = Worker::start(folder.path());
    let identity = worker.ask(&json!("identity"))["identity"].clone();
    assert!(identity["build"].as_str().is_some_and(|build| build.starts_with("fnv1a-128:")));
    assert_eq!(status(&folder)["identity"], identity);
    assert!(worker.ask(&json!("what?"))["refused"].is_string());
    let task = task(&folder);
    assert_eq!(worker.ask(&json!({ "perform": task }))["done"], task["name"]);
    // A piece that another run has given up has a result as well.
    let mut lost = task.clone();
    lost["name"] = json!("ff".repeat(16));
    lost["given_up"] = json!("its worker was ended");
    assert_eq!(worker.ask(&json!({ "perform": lost }))["failed"], lost["name"]);
    drop(worker.child.stdin.take());
    assert!(worker.child.wait().expect("it ends").success());
}

#[test]
fn a_report_says_which_wells_are_unlike_and_which_have_moved() {
    let folder = folder_with(&[("cup.dgd", CUP.as_bytes())]);
    let mut wells = serde_json::Map::new();
    let mut normal = Normal::new(3);
    for k in 0..24_u64 {
        let mut occasions = Vec::new();
        for (year, factor) in [("2023", 1.0), ("2024", if k == 5 { 1.05 } else { 1.0 })] {
            let usual = 100.0 + 2.0 * normal.next();
            // One well is a different kind of cup, and one has changed.
            let tau = if k == 11 { 160.0 } else { 100.0 } * factor + 0.001 * usual;
            let name = format!("w{k}_{year}.csv");
            let seed = 1 + 2 * k + u64::from(year == "2024");
            fs::write(folder.path().join(&name), cup(tau, seed)).expect("writable");
            occasions.push(json!({ "when": year, "data": name }));
        }
        wells.insert(format!("W-{k}"), json!(occasions));
    }
    let job = json!({ "model": "cup.dgd", "do": ["fit"], "wells": wells });
    fs::write(folder.path().join("job.json"), job.to_string()).expect("writable");
    run_in(&folder, &[]).done();
    let words = ["job", "report", "job.json", "--into", "out", "-o", "fleet"];
    let report = dgd_in(folder.path(), &words).done().out;
    assert!(report.contains("W-5: `tau` moved by"), "{report}");
    assert!(report.contains("W-11: unlike the other wells"), "{report}");
    let names: BTreeSet<PathBuf> = results(&folder.path().join("fleet")).into_keys().collect();
    let expected = ["index.html", "result.json", "wells.csv", "wells_1.html"].map(PathBuf::from);
    assert_eq!(names, expected.into());
    let text = fs::read_to_string(folder.path().join("fleet/result.json")).expect("written");
    let report: Value = serde_json::from_str(&text).expect("JSON");
    assert_is("job_report", &report);
    let unlike = report["wells"].as_array().expect("wells").iter();
    let unlike = unlike.filter(|well| well["distance"]["unlike"] == true).map(|well| &well["name"]);
    assert!(unlike.clone().any(|name| name == "W-11"), "{:?}", unlike.collect::<Vec<_>>());
    let csv = fs::read_to_string(folder.path().join("fleet/wells.csv")).expect("written");
    assert_eq!(csv.lines().count(), 1 + 48);
    let index = fs::read_to_string(folder.path().join("fleet/index.html")).expect("written");
    assert!(index.contains("<a href=\"wells_1.html\">W-11</a>"));
    // A smaller fleet leaves no pages of the larger one.
    fs::write(folder.path().join("fleet/wells_2.html"), "old").expect("writable");
    dgd_in(folder.path(), &words).done();
    assert!(!folder.path().join("fleet/wells_2.html").exists());
}
