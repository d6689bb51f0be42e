//! Instruction counts of dgd's main paths, compared with recorded numbers.
//!
//! Times depend on the load of a machine, instruction counts hardly. The program runs itself under valgrind, once with
//! one run of a path and once with two, so that the difference excludes start-up, shutdown and first-time work. Run
//! with `UPDATE_GOLDEN=1` to record the counts.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command prints its result")]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::{env, fs};

use peers_problems::request::answer;

/// Case, method and tolerance, as in requests of the driver in `peers`.
const PATHS: &[(&str, &str, &str)] = &[
    ("p1a", "rodas5p", "1e-6"),
    ("p1a", "rodas5p, loaded", "1e-6"),
    ("p1b", "rodas5p", "1e-6"),
    ("p2a", "rodas5p", "1e-6"),
    ("p2b", "rodas5p", "1e-6"),
    ("p3-1000", "rodas5p, loaded", "1e-5"),
    ("p4-64", "rodas5p", "1e-6"),
    ("p5a", "rodas5p", "1e-6"),
    ("p5b", "rodas5p", "1e-6"),
    ("fit", "rodas5p", "1e-4"),
];

/// A larger relative increase is a regression; changes due to the allocator and the linker are smaller.
const SLACK: f64 = 0.02;

fn main() -> ExitCode {
    // With arguments, this is a run to be counted.
    if env::args_os().len() > 1 {
        return answer(peer_dgd::solve);
    }
    if Command::new("valgrind").arg("--version").output().is_err() {
        eprintln!("instructions were NOT counted: valgrind is missing (apt-get install valgrind)");
        return ExitCode::SUCCESS;
    }
    match check(Path::new(env!("CARGO_MANIFEST_DIR"))) {
        Ok(counted) => {
            print!("{counted}");
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

/// Counts all paths and compares them with the file, or writes it; returns its text.
fn check(folder: &Path) -> Result<String, String> {
    let file = folder.join("instructions.csv");
    let unreadable = |error| format!("{}: {error}", file.display());
    let recorded = fs::read_to_string(&file);
    let mut counted = String::from("# Instructions of one run; written by instructions.rs.\n");
    let mut complaints = String::new();
    for &(case, method, rtol) in PATHS {
        let path = format!("{case};{method};{rtol};");
        let runs = |runs| count(folder, [case, method, rtol], runs);
        let number = runs(2)?.saturating_sub(runs(1)?);
        let _ = writeln!(counted, "{path}{number}");
        let mut before = recorded.iter().flat_map(|text| text.lines());
        let before = before.find_map(|line| line.strip_prefix(&path)?.parse::<u64>().ok());
        match before {
            Some(before) if number as f64 > before as f64 * (1.0 + SLACK) => {
                let part = 100.0 * (number as f64 / before as f64 - 1.0);
                let _ = writeln!(
                    complaints,
                    "{case} by {method} at {rtol}: {number} instructions, {before} before: {part:+.1} %",
                );
            }
            Some(_) => {}
            None => {
                let _ = writeln!(complaints, "{case} by {method} at {rtol}: no number recorded");
            }
        }
    }
    if env::var_os("UPDATE_GOLDEN").is_some() {
        fs::write(&file, &counted).map_err(unreadable)?;
        return Ok(counted);
    }
    recorded.map_err(unreadable)?;
    if complaints.is_empty() {
        return Ok(counted);
    }
    let advice = "where they are needed, UPDATE_GOLDEN=1 records the new numbers";
    Err(format!("{complaints}{advice}"))
}

/// Instructions of this program when it runs a path this many times.
fn count(folder: &Path, path: [&str; 3], runs: usize) -> Result<u64, String> {
    let answer = env::temp_dir().join(format!("dgd-instructions-{}.bin", std::process::id()));
    let program: PathBuf = env::current_exe().map_err(|error| error.to_string())?;
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(program)
        .args(path)
        .arg(format!("{runs}x"))
        .args([&folder.join("peers/data"), &answer])
        .output()
        .map_err(|error| format!("valgrind: {error}"))?;
    let stderr = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Err(format!("{} by {}: {stderr}", path[0], path[1]));
    }
    fs::remove_file(&answer).map_err(|error| error.to_string())?;
    // ==1234== Collected : 12345678
    let line = stderr.lines().find_map(|line| line.split_once("Collected :"));
    let number = line.and_then(|(_, text)| text.split_whitespace().next()?.parse().ok());
    number.ok_or_else(|| format!("valgrind says nothing of instructions:\n{stderr}"))
}
