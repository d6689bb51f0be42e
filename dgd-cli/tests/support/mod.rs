//! The `dgd` command, run as a user runs it.

#![allow(dead_code, reason = "not every test binary uses all of it")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

/// What a command left behind.
pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Run {
    pub(crate) fn of(output: &Output) -> Run {
        Run {
            code: output.status.code().expect("no signal ends the command"),
            out: String::from_utf8_lossy(&output.stdout).into_owned(),
            err: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// It was refused with this exit code, and the message has all of these parts.
    #[track_caller]
    pub(crate) fn refused(&self, code: i32, parts: &[&str]) {
        assert_eq!(self.code, code, "{}", self.err);
        for part in parts {
            assert!(self.err.contains(part), "no {part:?} in\n{}", self.err);
        }
        assert!(!self.err.contains("panicked"), "{}", self.err);
    }

    #[track_caller]
    pub(crate) fn done(self) -> Run {
        assert_eq!(self.code, 0, "{}", self.err);
        self
    }

    #[track_caller]
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error}:\n{}", self.out))
    }
}

pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a package of a workspace").to_owned()
}

pub(crate) fn command(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dgd"));
    command.current_dir(folder).args(args).env_remove("NO_COLOR");
    command
}

pub(crate) fn dgd_in(folder: &Path, args: &[&str]) -> Run {
    Run::of(&command(folder, args).output().expect("the command starts"))
}

/// Runs in the repository's root.
pub(crate) fn dgd(args: &[&str]) -> Run {
    dgd_in(&root(), args)
}

pub(crate) fn folder_with(files: &[(&str, &[u8])]) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder for the test");
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).expect("the folder is writable");
    }
    folder
}

pub(crate) fn path(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).display().to_string()
}

/// Names of what is in a folder.
pub(crate) fn listing(folder: &TempDir) -> Vec<String> {
    let entries = fs::read_dir(folder.path()).expect("the folder is there");
    let mut names: Vec<String> = entries
        .map(|entry| entry.expect("a readable folder").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// A column of CSV text.
#[track_caller]
pub(crate) fn column(csv: &str, header: &str) -> Vec<f64> {
    let mut lines = csv.lines();
    let headers = lines.next().unwrap_or_default();
    let at = headers
        .split(',')
        .position(|cell| cell == header)
        .unwrap_or_else(|| panic!("no {header} in {headers}"));
    lines
        .map(|line| line.split(',').nth(at).unwrap_or_default().parse().unwrap_or(f64::NAN))
        .collect()
}
