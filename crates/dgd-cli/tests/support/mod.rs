//! The `dgd` command, run as by a user.

#![allow(dead_code, reason = "not every test binary uses all of it")]

#[path = "../../../../tests/support/normal.rs"]
mod normal;

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

pub(crate) use normal::Normal;

/// The outcome of a command.
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

    /// Checks that it was refused with this exit code, and a message that contains all of these parts.
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
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .expect("a package of a workspace")
        .to_owned()
}

pub(crate) fn command(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dgd"));
    command.current_dir(folder).args(args).env_remove("NO_COLOR");
    command
}

pub(crate) fn dgd_in(folder: &Path, args: &[&str]) -> Run {
    Run::of(&command(folder, args).output().expect("the command starts"))
}

/// Runs a command in the root of the repository.
pub(crate) fn dgd(args: &[&str]) -> Run {
    dgd_in(&root(), args)
}

/// Runs a command in a folder with these bytes on its standard input.
pub(crate) fn piped(folder: &Path, args: &[&str], bytes: impl AsRef<[u8]>) -> Run {
    let mut child = command(folder, args)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let mut input = child.stdin.take().expect("a pipe");
    let bytes = bytes.as_ref().to_owned();
    let writer = std::thread::spawn(move || {
        // The command may end before it has read everything.
        let _ = input.write_all(&bytes);
    });
    let output = child.wait_with_output().expect("it ends");
    writer.join().expect("the writer ends");
    Run::of(&output)
}

/// Starts a command with captured output.
pub(crate) fn started(args: &[&str]) -> Child {
    let mut command = command(&root(), args);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().expect("the command starts")
}

/// Runs a command whose results go to `name` in a folder, kills it several times and resumes it with `--resume`, to its
/// end.
pub(crate) fn killed_and_resumed(args: &[&str], folder: &TempDir, name: &str) -> Run {
    let journal = folder.path().join(format!(".{name}.dgd-journal"));
    let size = || fs::metadata(&journal).map_or(0, |file| file.len());
    let is_running = |child: &mut Child| child.try_wait().expect("a child").is_none();
    let resumed = [args, &["--resume"]].concat();
    let (mut kills, mut before) = (0, 64);
    let run = loop {
        let mut child = started(if kills == 0 { args } else { &resumed });
        // After the journal has grown, and a further delay that increases each time.
        while is_running(&mut child) && (size() <= before || kills == 4) {
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(100 * kills));
        if !is_running(&mut child) {
            break Run::of(&child.wait_with_output().expect("it has ended")).done();
        }
        child.kill().expect("it is under way");
        child.wait().expect("it has ended");
        // A truncated record, the worst result of a kill.
        let bytes = fs::read(&journal).expect("it was left");
        fs::write(&journal, &bytes[..bytes.len() - 1]).expect("the folder is writable");
        (kills, before) = (kills + 1, size());
        assert!(!folder.path().join(name).exists(), "nothing half written");
    };
    assert!(kills >= 2, "{kills}");
    let result = run.err.lines().find_map(|line| line.strip_prefix("going on with "));
    let result = result.and_then(|words| words.split(' ').next()).map(str::parse::<usize>);
    assert!(matches!(result, Some(Ok(2..))), "less work: {}", run.err);
    assert!(!journal.exists(), "a run that ends needs it no more");
    run
}

/// Waits until a command handles Ctrl-C.
#[cfg(target_os = "linux")]
pub(crate) fn wait_until_it_minds_ctrl_c(child: &mut Child) {
    // SIGINT is signal 2.
    let minds = |status: &str| {
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
        caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|m| m & 2 > 0)
    };
    let status = format!("/proc/{}/status", child.id());
    while !fs::read_to_string(&status).is_ok_and(|status| minds(&status)) {
        assert!(child.try_wait().expect("a child").is_none(), "it ended by itself");
        std::thread::yield_now();
    }
}

/// Presses Ctrl-C.
#[cfg(unix)]
pub(crate) fn interrupt(child: &Child) {
    let done = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(done.expect("there is `kill`").success());
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

/// Names of the entries of a folder.
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
    let position = headers
        .split(',')
        .position(|cell| cell == header)
        .unwrap_or_else(|| panic!("no {header} in {headers}"));
    lines
        .map(|line| line.split(',').nth(position).unwrap_or_default().parse().unwrap_or(f64::NAN))
        .collect()
}
