//! Builds the programs that this machine can build, and reports the requirements of the others.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use crate::arguments::Arguments;
use crate::catalogue::{PEERS, Peer, Program};
use crate::install::Fetched;

/// A program that runs on this machine.
#[derive(Debug)]
pub(crate) struct Installed {
    /// Its peer.
    pub(crate) peer: &'static Peer,
    /// Its version; empty for this repository's own.
    pub(crate) version: String,
    executable: PathBuf,
    first_argument: Option<PathBuf>,
}

impl Installed {
    /// A command that runs it.
    pub(crate) fn command(&self) -> Command {
        let mut command = Command::new(&self.executable);
        command.args(&self.first_argument);
        // For matrices of three columns, several threads only wait for each other.
        command.env("OPENBLAS_NUM_THREADS", "1").env("OMP_NUM_THREADS", "1");
        command
    }
}

/// All requested programs that are available.
pub(crate) fn programs(folder: &Path, arguments: &Arguments) -> Vec<Installed> {
    let mut programs = Vec::new();
    let release = match release_folder() {
        Ok(release) => release,
        Err(message) => {
            eprintln!("{message}");
            return programs;
        }
    };
    let fetched = Fetched::new(&release);
    for peer in PEERS {
        if !peer.methods.iter().any(|(case, _)| arguments.asks_for(case, peer.name)) {
            continue;
        }
        eprintln!("building {}", peer.name);
        let mut built = build(folder, &release, &fetched, peer);
        if built.is_err() && arguments.install {
            let fetch = match peer.program {
                Program::Rust { .. } => Ok(()),
                Program::C { .. } => fetched.fetch_sundials(),
                Program::Python { .. } => fetched.fetch_python(),
            };
            built = fetch.and_then(|()| build(folder, &release, &fetched, peer));
        }
        match built {
            Ok(program) => programs.push(program),
            Err(message) => eprintln!("{} is left out: {message}", peer.name),
        }
    }
    programs
}

fn build(
    folder: &Path,
    release: &Path,
    fetched: &Fetched,
    peer: &'static Peer,
) -> Result<Installed, String> {
    let executable = release.join(format!("peer-{}", peer.name));
    match &peer.program {
        Program::Rust { dependency } => {
            rust(folder, peer.name)?;
            let version = dependency.map_or(Ok(String::new()), |name| locked(folder, name))?;
            Ok(Installed { peer, version, executable, first_argument: None })
        }
        Program::C { folder: sources, libraries, advice } => {
            let prefix = env::var_os("SUNDIALS_DIR").map(PathBuf::from);
            let prefix = prefix.or_else(|| fetched.sundials());
            compile(&folder.join(sources), &executable, prefix.as_deref(), libraries)
                .map_err(|message| format!("{message}\n{advice}"))?;
            let version = text(Command::new(&executable).arg("--version"))?;
            Ok(Installed { peer, version, executable, first_argument: None })
        }
        Program::Python { script, module, advice } => {
            let python = env::var_os("PYTHON").map(PathBuf::from);
            let python =
                python.or_else(|| fetched.python()).unwrap_or_else(|| PathBuf::from("python3"));
            let probe = format!("import {module}; print({module}.__version__)");
            let version = text(Command::new(&python).args(["-c", &probe]))
                .map_err(|message| format!("{message}\n{advice}"))?;
            let script = folder.join("python").join(script);
            Ok(Installed { peer, version, executable: python, first_argument: Some(script) })
        }
    }
}

/// Cargo's folder of release builds, beside this program's own.
fn release_folder() -> Result<PathBuf, String> {
    let executable = env::current_exe().map_err(|error| error.to_string())?;
    let target = executable.parent().and_then(Path::parent);
    target.map(|folder| folder.join("release")).ok_or_else(|| "no target folder".to_owned())
}

fn rust(folder: &Path, name: &str) -> Result<(), String> {
    let status = Command::new(variable("CARGO", "cargo"))
        .args(["build", "--release", "--locked", "--package", &format!("peer-{name}")])
        .arg("--manifest-path")
        .arg(folder.join("Cargo.toml"))
        .status()
        .map_err(|error| error.to_string())?;
    if status.success() { Ok(()) } else { Err("cargo does not build it".to_owned()) }
}

fn compile(
    sources: &Path,
    executable: &Path,
    prefix: Option<&Path>,
    libraries: &[&str],
) -> Result<(), String> {
    let entries = sources.read_dir().map_err(|error| error.to_string())?;
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "c"));
    files.sort();
    let mut command = Command::new(variable("CC", "cc"));
    command.args(["-std=c11", "-D_POSIX_C_SOURCE=200809L", "-O3", "-march=native", "-o"]);
    command.arg(executable).args(files);
    if let Some(prefix) = prefix {
        command.arg("-I").arg(prefix.join("include"));
        // Debian puts libraries one folder deeper than other distributions.
        for library in ["lib", "lib64", "lib/x86_64-linux-gnu", "lib/aarch64-linux-gnu"] {
            let library = prefix.join(library);
            if library.is_dir() {
                command.arg("-L").arg(&library);
                command.arg(format!("-Wl,-rpath,{}", library.display()));
            }
        }
    }
    command.args(libraries.iter().map(|library| format!("-l{library}")));
    text(&mut command).map(drop)
}

/// The version in `Cargo.lock`.
fn locked(folder: &Path, name: &str) -> Result<String, String> {
    let lock = std::fs::read_to_string(folder.join("Cargo.lock"));
    let lock = lock.map_err(|error| error.to_string())?;
    let mut lines = lock.lines();
    lines.find(|line| *line == format!("name = \"{name}\""));
    let version = lines.next().and_then(|line| line.strip_prefix("version = "));
    Ok(version.unwrap_or_default().trim_matches('"').to_owned())
}

/// The output of a command, or the end of its error message.
fn text(command: &mut Command) -> Result<String, String> {
    let program = command.get_program().display().to_string();
    let output = command.stdin(Stdio::null()).output();
    let Output { status, stdout, stderr } =
        output.map_err(|error| format!("{program}: {error}"))?;
    if status.success() {
        return Ok(String::from_utf8_lossy(&stdout).trim().to_owned());
    }
    let stderr = String::from_utf8_lossy(&stderr);
    let first = stderr.lines().find(|line| line.contains("rror")).unwrap_or_default();
    Err(first.to_owned())
}

fn variable(name: &str, otherwise: &str) -> std::ffi::OsString {
    env::var_os(name).unwrap_or_else(|| otherwise.into())
}
