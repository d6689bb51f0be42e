//! The machine and the versions of a measurement.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::installed::Installed;

/// Commit, machine and versions, as lines of Markdown.
pub(crate) fn header(folder: &Path, programs: &[Installed]) -> String {
    let mut versions = vec![said(Command::new("rustc").arg("--version"))];
    for program in programs.iter().filter(|program| !program.version.is_empty()) {
        versions.push(format!("{} {}", program.peer.name, program.version));
    }
    let git = |arguments: &[&str]| said(Command::new("git").arg("-C").arg(folder).args(arguments));
    let changed = if git(&["status", "--porcelain"]).is_empty() { "" } else { ", with changes" };
    format!(
        "commit {}{changed}; {}; {}\n",
        git(&["rev-parse", "--short", "HEAD"]),
        processor(),
        versions.join(", "),
    )
}

fn processor() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let name = model.map_or(std::env::consts::ARCH, |(_, name)| name);
    // The run itself adds a load of one; anything more affects the times.
    let load = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let load = load.split(' ').nth(1).map_or(String::new(), |load| format!(" with load {load}"));
    format!("{name}, {cores} cores{load}")
}

/// The output of a command; empty if it cannot be run.
fn said(command: &mut Command) -> String {
    let output = command.output().map(|output| output.stdout).unwrap_or_default();
    String::from_utf8_lossy(&output).trim().to_owned()
}
