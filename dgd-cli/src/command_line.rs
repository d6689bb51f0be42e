//! The command line, as it can be typed again.

use std::ffi::{OsStr, OsString};
use std::io;
use std::path::PathBuf;
use std::sync::OnceLock;

use dgd_job::{Program, shell};

/// The words behind `dgd`.
static WORDS: OnceLock<Vec<OsString>> = OnceLock::new();

/// The program, where it is not the executable alone.
static PROGRAM: OnceLock<Program> = OnceLock::new();

/// Has this be the program that is started again.
pub(crate) fn set_program(start: Vec<OsString>, file: PathBuf) {
    let _ = PROGRAM.set(Program { start, file });
}

/// How this program is started again.
pub(crate) fn program() -> io::Result<Program> {
    PROGRAM.get().map_or_else(Program::this, |program| Ok(program.clone()))
}

/// Has these words be the command line; a process has one.
pub(crate) fn set(words: Vec<OsString>) {
    let _ = WORDS.set(words);
}

/// The words behind `dgd`.
pub(crate) fn words() -> impl Iterator<Item = &'static OsStr> {
    WORDS.get().into_iter().flatten().map(OsString::as_os_str)
}

/// Whether the words ask for JSON, though they may not be a command line.
pub(crate) fn wants_json() -> bool {
    let words: Vec<&OsStr> = words().collect();
    words.contains(&OsStr::new("--format=json"))
        || words.windows(2).any(|pair| pair[0] == "--format" && pair[1] == "json")
}

/// The command line of this process, to be typed again. It gives the same without `--resume`.
pub(crate) fn command_line() -> String {
    let words = words().filter(|word| *word != "--resume");
    let words = words.map(|word| word.to_string_lossy().into_owned());
    shell(std::iter::once("dgd".to_owned()).chain(words))
}
