//! Build time of a user's crate that has a model, simulates and fits it.
//!
//! The crate is made in a temporary folder, with this repository as its only dependency, and built by two jobs: from
//! scratch, and again after an edit.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;
use std::{env, fs};

/// The program, and the model beside it.
const PROGRAM: &str = include_str!("../user_crate/main.rs");
const MODEL: &str = "models/mud_circulation.dgd";

/// Both builds.
#[derive(Debug)]
pub(crate) struct Builds {
    /// Build from scratch.
    pub(crate) first: Build,
    /// Build with its dependencies built.
    pub(crate) again: Build,
}

/// The cost of a build.
#[derive(Debug)]
pub(crate) struct Build {
    /// Elapsed time, s.
    pub(crate) time: f64,
    /// Processor time of all processors, s; it depends less on the machine's load.
    pub(crate) processors: f64,
}

/// Builds the crate twice.
///
/// # Errors
///
/// The failed step.
pub(crate) fn build(root: &Path) -> Result<Builds, String> {
    let folder = env::temp_dir().join(format!("dgd-user-crate-{}", std::process::id()));
    let builds = build_in(&folder, root);
    // A leftover that cannot be removed does no harm.
    let _ = fs::remove_dir_all(&folder);
    builds
}

fn build_in(folder: &Path, root: &Path) -> Result<Builds, String> {
    let text = |error: std::io::Error| error.to_string();
    let source = folder.join("src/main.rs");
    fs::create_dir_all(folder.join("src")).map_err(text)?;
    fs::write(&source, PROGRAM).map_err(text)?;
    fs::copy(root.join(MODEL), folder.join("src/mud_circulation.dgd")).map_err(text)?;
    // The same versions of dependencies.
    fs::copy(root.join("Cargo.lock"), folder.join("Cargo.lock")).map_err(text)?;
    let path = root.display().to_string();
    let manifest = format!(
        "[package]\nname = \"user-crate\"\nedition = \"2024\"\n\n[dependencies]\ndgd = {{ path = {path:?} }}\n\n[workspace]\n",
    );
    fs::write(folder.join("Cargo.toml"), manifest).map_err(text)?;
    // Downloads happen before the measurement.
    cargo(folder, &["fetch"])?;
    let first = cargo(folder, &["build", "--release", "--jobs", "2"])?;
    fs::write(&source, format!("{PROGRAM}\n// Edited.\n")).map_err(text)?;
    let again = cargo(folder, &["build", "--release", "--jobs", "2"])?;
    Ok(Builds { first, again })
}

fn cargo(folder: &Path, arguments: &[&str]) -> Result<Build, String> {
    let (begin, before) = (Instant::now(), processors());
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments).current_dir(folder).stdin(Stdio::null());
    command.env("CARGO_TARGET_DIR", folder.join("target"));
    // As for its user, without the settings of this program.
    command.env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
    let output = command.output().map_err(|error| error.to_string())?;
    if !output.status.success() {
        let stderr = String::from_utf8_lossy(&output.stderr);
        let error = stderr.lines().find(|line| line.starts_with("error"));
        return Err(error.unwrap_or("cargo does not say why").to_owned());
    }
    Ok(Build { time: begin.elapsed().as_secs_f64(), processors: processors() - before })
}

/// Processor time of finished child processes, s.
fn processors() -> f64 {
    // /proc/self/stat: after the name in brackets, the 14th and 15th number, in hundredths.
    let text = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let numbers = text.rsplit_once(')').map_or("", |(_, numbers)| numbers);
    let ticks = numbers.split_whitespace().skip(13).take(2);
    ticks.filter_map(|text| text.parse::<f64>().ok()).sum::<f64>() / 100.0
}
