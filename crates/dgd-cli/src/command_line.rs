//! The command line of this process, in a form that can be typed again.

use std::ffi::{OsStr, OsString};
use std::io;
use std::path::PathBuf;
use std::sync::OnceLock;

use dgd_job::{ProgramFile, shell};

/// The arguments after `dgd`.
static WORDS: OnceLock<Vec<OsString>> = OnceLock::new();

/// The program, if it is more than the executable.
static PROGRAM: OnceLock<ProgramFile> = OnceLock::new();

/// Sets the program to be started again.
pub(crate) fn set_program(start: Vec<OsString>, file: PathBuf) {
    let _ = PROGRAM.set(ProgramFile { start, file });
}

/// The program to start again.
pub(crate) fn program() -> io::Result<ProgramFile> {
    PROGRAM.get().map_or_else(ProgramFile::this, |program| Ok(program.clone()))
}

/// Sets the arguments; a process has one command line.
pub(crate) fn set(words: Vec<OsString>) {
    let _ = WORDS.set(words);
}

/// The arguments after `dgd`.
pub(crate) fn words() -> impl Iterator<Item = &'static OsStr> {
    WORDS.get().into_iter().flatten().map(OsString::as_os_str)
}

/// Whether the arguments request JSON, even if they are not a valid command line.
pub(crate) fn wants_json() -> bool {
    let words: Vec<&OsStr> = words().collect();
    words.contains(&OsStr::new("--format=json"))
        || words.windows(2).any(|pair| pair[0] == "--format" && pair[1] == "json")
}

/// The command line of this process, to be typed again. `--resume` is left out, because it does not change the result.
pub(crate) fn command_line() -> String {
    let words = words().filter(|word| *word != "--resume");
    let words = words.map(|word| word.to_string_lossy().into_owned());
    shell(std::iter::once("dgd".to_owned()).chain(words))
}
