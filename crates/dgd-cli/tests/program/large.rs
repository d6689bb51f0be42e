//! `--memory`: data beyond the memory limit, with a bitwise identical result.
#![cfg(target_os = "linux")]

use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use crate::support::{Run, command, dgd_in};

/// A plate with a heater that switches every hour, just before a sample, which is then held for the following second.
const HEATER: &str = include_str!("../models/heater.dgd");

/// The same with the heater's power from the data.
const HEATED: &str = include_str!("../models/heated.dgd");

/// Rows of the recording.
const ROWS: usize = 3_000_000;

/// The memory limit; the data take several times as much.
const MEMORY: u64 = 150_000_000;

/// Runs a command; also returns its peak memory in bytes.
fn watched(folder: &Path, args: &[&str]) -> (Run, u64) {
    let mut command = command(folder, args);
    let mut child =
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    let path = format!("/proc/{}/status", child.id());
    let mut most = 0;
    while child.try_wait().expect("it is ours").is_none() {
        let status = fs::read_to_string(&path).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let number = line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse().ok());
        most = most.max(1024 * number.unwrap_or(0_u64));
        std::thread::sleep(Duration::from_millis(5));
    }
    (Run::of(&child.wait_with_output().expect("it has ended")), most)
}

#[cfg(feature = "parquet")]
#[test]
fn a_recording_larger_than_what_may_be_held_is_simulated_and_fitted() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let write =
        |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("writable");
    write("heater.dgd", HEATER);
    write("heated.dgd", HEATED);
    let memory = format!("{}MB", MEMORY / 1_000_000);
    let bounded = ["--memory", memory.as_str(), "--scratch", "."];
    let until = (ROWS - 1).to_string();
    let simulate =
        ["simulate", "heater.dgd", "--until", &until, "--every", "1", "--noise-seed", "3"];
    let (run, most) =
        watched(folder.path(), &[&simulate[..], &bounded, &["-o", "a.parquet"]].concat());
    run.done();
    assert!(most < MEMORY, "the simulation held {most} bytes");
    let (run, most) = watched(folder.path(), &[&simulate[..], &["-o", "b.parquet"]].concat());
    run.done();
    assert!(most > MEMORY, "the test is too small: {most} bytes are enough");
    let bytes = |name: &str| fs::read(folder.path().join(name)).expect("it was written");
    assert!(bytes("a.parquet") == bytes("b.parquet"), "the simulation's bytes are others");
    assert!(bytes("a.parquet").len() > 16 * ROWS);

    let fit = ["fit", "heated.dgd", "--data", "a.parquet", "--format", "json"];
    let (run, most) = watched(folder.path(), &[&fit[..], &bounded].concat());
    let outcome = run.done();
    assert!(most < MEMORY, "the fit held {most} bytes");
    let (run, most) = watched(folder.path(), &[&fit[..], &["--threads", "1"]].concat());
    assert!(most > 2 * MEMORY, "the test is too small: {most} bytes are enough");
    assert!(outcome.out == run.done().out, "the fit's bytes are others");
    let result = outcome.json();
    for (name, value) in [("tau", 400.0), ("gain", 0.5)] {
        let one = &result["parameters"][name];
        let (at, std) = (one["value"].as_f64().expect("SI"), one["std"].as_f64().expect("SI"));
        assert!((at - value).abs() < 5.0 * std && std < 1e-3 * value, "{name} = {at} ± {std}");
    }
}

#[test]
fn what_cannot_be_bounded_is_refused() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let refused = |words: &[&str], parts: &[&str]| {
        let run = dgd_in(folder.path(), &[&["methods"], words].concat());
        run.refused(2, parts);
    };
    refused(&["--memory", "much"], &["this must be a size, as in 500MB"]);
    refused(&["--scratch", "."], &["--memory"]);
    refused(&["--memory", "1MB"], &["`--memory`: 1 MB are too little", "the program alone holds"]);
    let nowhere = ["--memory", "1GB", "--scratch", "nowhere"];
    refused(&nowhere, &["`--memory`: no file can lie in `nowhere`"]);
    if Path::new("/dev/shm").is_dir() {
        let in_memory = ["--memory", "1GB", "--scratch", "/dev/shm"];
        refused(&in_memory, &["files in `/dev/shm` are held in memory: name a folder on a disk"]);
    }
    let json = dgd_in(folder.path(), &["methods", "--memory", "1MB", "--format", "json"]);
    assert!(json.json()["error"].as_str().is_some_and(|error| error.contains("too little")));
}
