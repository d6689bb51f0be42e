//! Fetches missing peers into a folder of this workspace; nothing of the system is changed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Modules that the scripts import.
const MODULES: &[&str] = &["casadi", "scipy", "numpy"];

/// The folder of fetched peers, beside the builds.
#[derive(Debug)]
pub(crate) struct Fetched {
    folder: PathBuf,
}

impl Fetched {
    /// The peers fetched into a target folder, possibly none.
    pub(crate) fn new(target: &Path) -> Self {
        Self { folder: target.join("fetched") }
    }

    /// The Python with the modules, if it exists.
    pub(crate) fn python(&self) -> Option<PathBuf> {
        Some(self.folder.join("python/bin/python")).filter(|python| python.exists())
    }

    /// The prefix of SUNDIALS, if it exists.
    pub(crate) fn sundials(&self) -> Option<PathBuf> {
        Some(self.folder.join("sundials/usr"))
            .filter(|prefix| prefix.join("include/cvodes/cvodes.h").exists())
    }

    /// CasADi and SciPy, by pip in a virtual environment.
    ///
    /// # Errors
    ///
    /// The failed step.
    pub(crate) fn fetch_python(&self) -> Result<(), String> {
        let folder = self.folder.join("python");
        run(Command::new("python3").args(["-m", "venv"]).arg(&folder))?;
        run(Command::new(folder.join("bin/python")).args(["-m", "pip", "install"]).args(MODULES))
    }

    /// SUNDIALS, from apt packages that are only unpacked, which needs no privileges.
    ///
    /// # Errors
    ///
    /// The failed step; there is apt only on Debian and its derivatives.
    pub(crate) fn fetch_sundials(&self) -> Result<(), String> {
        let packages = self.folder.join("packages");
        fs::create_dir_all(&packages).map_err(|error| error.to_string())?;
        // The packages with their dependencies, one name per line; apart from those of SUNDIALS only the C library is
        // needed.
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

/// Runs a command; the error contains its standard error.
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
