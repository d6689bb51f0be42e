//! How many instructions dgd's main paths take, against recorded numbers.
//!
//! Times move with the load of a machine, instructions hardly: valgrind shows every program the same
//! processor. Run with `UPDATE_GOLDEN=1` to record what is counted.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::{env, fs};

/// Cases with their tolerances.
const PATHS: &[(&str, &str)] = &[
    ("p1a", "1e-6"),
    ("p1b", "1e-6"),
    ("p2a", "1e-6"),
    ("p2b", "1e-6"),
    ("p5a", "1e-6"),
    ("p5b", "1e-6"),
];

/// More than this is a regression; what the allocator and the linker change is less.
const SLACK: f64 = 0.02;

fn main() -> ExitCode {
    match check(Path::new(env!("CARGO_MANIFEST_DIR"))) {
        Ok(report) => {
            print!("{report}");
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn check(folder: &Path) -> Result<String, String> {
    let program = build(folder)?;
    let file = folder.join("instructions.csv");
    let mut counted =
        String::from("# Instructions of one run; written by src/bin/instructions.rs.\n");
    let mut numbers = Vec::new();
    for (case, rtol) in PATHS {
        // What comes before and after the runs cancels.
        let (few, many) =
            (count(&program, folder, case, rtol, 2)?, count(&program, folder, case, rtol, 4)?);
        let number = many.saturating_sub(few) / 2;
        let _ = writeln!(counted, "{case},{rtol},{number}");
        numbers.push(number);
    }
    if env::var_os("UPDATE_GOLDEN").is_some() {
        fs::write(&file, &counted).map_err(|error| format!("{}: {error}", file.display()))?;
        return Ok(counted);
    }
    let recorded =
        fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
    let mut complaints = String::new();
    for ((case, rtol), number) in PATHS.iter().zip(numbers) {
        let before =
            recorded.lines().find_map(|line| line.strip_prefix(&format!("{case},{rtol},")));
        let before: u64 = before.and_then(|text| text.parse().ok()).unwrap_or(0);
        if number as f64 > before as f64 * (1.0 + SLACK) {
            let _ =
                writeln!(complaints, "{case} at {rtol}: {number} instructions, {before} before");
        }
    }
    if complaints.is_empty() { Ok(counted) } else { Err(complaints) }
}

/// The program of dgd.
fn build(folder: &Path) -> Result<PathBuf, String> {
    let status = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["build", "--release", "--locked", "--package", "peer-dgd", "--manifest-path"])
        .arg(folder.join("Cargo.toml"))
        .status()
        .map_err(|error| error.to_string())?;
    if !status.success() {
        return Err("dgd's program does not build".to_owned());
    }
    let own = env::current_exe().map_err(|error| error.to_string())?;
    let target = own.parent().and_then(Path::parent).ok_or("no target folder")?;
    Ok(target.join("release").join("peer-dgd"))
}

/// Instructions of a program that runs a case `runs` times.
fn count(
    program: &Path,
    folder: &Path,
    case: &str,
    rtol: &str,
    runs: usize,
) -> Result<u64, String> {
    let file = env::temp_dir().join(format!("dgd-instructions-{}.bin", std::process::id()));
    let output = Command::new("valgrind")
        .args(["--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"])
        .arg(program)
        .args([case, "rodas5p", rtol, &format!("{runs}x")])
        .args([&folder.join("data"), &file])
        .output()
        .map_err(|error| format!("valgrind: {error}"))?;
    let stderr = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Err(stderr.into_owned());
    }
    fs::remove_file(&file).map_err(|error| error.to_string())?;
    // ==1234== I   refs:      12,345,678
    let line = stderr.lines().find_map(|line| line.split_once("refs:"));
    let digits: String =
        line.map_or("", |(_, text)| text).chars().filter(char::is_ascii_digit).collect();
    digits.parse().map_err(|_| format!("valgrind says nothing of instructions:\n{stderr}"))
}
