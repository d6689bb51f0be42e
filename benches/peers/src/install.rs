//! Fetches peers that are missing into a folder of our own; nothing of the system is changed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Modules that the scripts import.
const MODULES: &[&str] = &["casadi", "scipy", "numpy"];

/// Where what was fetched is: beside the builds.
#[derive(Debug)]
pub(crate) struct Fetched {
    folder: PathBuf,
}

impl Fetched {
    /// What was fetched into a target folder, perhaps nothing.
    pub(crate) fn new(target: &Path) -> Self {
        Self { folder: target.join("fetched") }
    }

    /// The Python with the modules, if it is there.
    pub(crate) fn python(&self) -> Option<PathBuf> {
        Some(self.folder.join("python/bin/python")).filter(|python| python.exists())
    }

    /// The prefix that SUNDIALS is under, if it is there.
    pub(crate) fn sundials(&self) -> Option<PathBuf> {
        Some(self.folder.join("sundials/usr"))
            .filter(|prefix| prefix.join("include/cvodes/cvodes.h").exists())
    }

    /// CasADi and SciPy, by pip in a virtual environment.
    ///
    /// # Errors
    ///
    /// What went wrong.
    pub(crate) fn fetch_python(&self) -> Result<(), String> {
        let folder = self.folder.join("python");
        run(Command::new("python3").args(["-m", "venv"]).arg(&folder))?;
        run(Command::new(folder.join("bin/python")).args(["-m", "pip", "install"]).args(MODULES))
    }

    /// SUNDIALS, by apt as packages that are only unpacked: that needs no rights.
    ///
    /// # Errors
    ///
    /// What went wrong; elsewhere than on Debian and its kin there is no apt.
    pub(crate) fn fetch_sundials(&self) -> Result<(), String> {
        let packages = self.folder.join("packages");
        fs::create_dir_all(&packages).map_err(|error| error.to_string())?;
        // It and all that it needs, one name a line; of what is not SUNDIALS' the C library is enough.
        let only = ["recommends", "suggests", "conflicts", "breaks", "replaces", "enhances"];
        let mut command = Command::new("apt-cache");
        command.args(["depends", "--recurse", "libsundials-dev"]);
        command.args(only.map(|kind| format!("--no-{kind}")));
        let output = command.output().map_err(|error| format!("apt-cache: {error}"))?;
        let text = String::from_utf8_lossy(&output.stdout);
        let names: Vec<&str> =
            text.lines().filter(|line| line.starts_with("libsundials")).collect();
        if names.is_empty() {
            return Err("apt knows no libsundials-dev".to_owned());
        }
        run(Command::new("apt-get").arg("download").args(names).current_dir(&packages))?;
        let entries = packages.read_dir().map_err(|error| error.to_string())?;
        for entry in entries.filter_map(Result::ok) {
            let unpacked = self.folder.join("sundials");
            run(Command::new("dpkg").arg("-x").arg(entry.path()).arg(unpacked))?;
        }
        Ok(())
    }
}

/// Runs it, with what it says on the error stream.
fn run(command: &mut Command) -> Result<(), String> {
    let name = command.get_program().display().to_string();
    let output = command.stdin(Stdio::null()).output();
    let output = output.map_err(|error| format!("{name}: {error}"))?;
    if output.status.success() {
        return Ok(());
    }
    let stderr = String::from_utf8_lossy(&output.stderr);
    Err(format!("{name}: {}", stderr.lines().last().unwrap_or("it failed")))
}
