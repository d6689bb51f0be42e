//! The command line of this process, in a form that can be typed again.

use std::ffi::{OsStr, OsString};
use std::io;
use std::path::PathBuf;
use std::sync::OnceLock;

use dgd_job::{OptionSyntax, ProgramFile, shell};
use dgd_work::{Argument, ArgumentUse, ArgumentValue};

/// The arguments after `dgd`.
static WORDS: OnceLock<Vec<OsString>> = OnceLock::new();

/// The program, if it is more than the executable.
static PROGRAM: OnceLock<ProgramFile> = OnceLock::new();

/// How options are written.
pub(crate) const OPTIONS: OptionSyntax =
    OptionSyntax { spelling: option, words: option_words, read: read_option };

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

/// An argument as an option, with its value quoted for a shell.
pub(crate) fn option(given: &ArgumentUse) -> String {
    let name = option_name(given.argument);
    match &given.value {
        None => name,
        Some(ArgumentValue::Literal(text)) => {
            format!("{name} {}", shell(std::iter::once(text.clone())))
        }
        Some(ArgumentValue::Placeholder(word)) => format!("{name} {word}"),
    }
}

fn option_words(given: &ArgumentUse) -> Vec<String> {
    let name = option_name(given.argument);
    std::iter::once(name).chain(given.value().map(str::to_owned)).collect()
}

fn option_name(argument: Argument) -> String {
    match argument {
        Argument::Out => "-o".to_owned(),
        other => format!("--{}", other.name()),
    }
}

fn read_option(word: &str) -> Option<(Argument, Option<&str>)> {
    let (name, value) = match word.split_once('=') {
        Some((name, value)) => (name, Some(value)),
        None => (word, None),
    };
    let is_it = |argument: &Argument| match name.strip_prefix("--") {
        Some(name) => argument.name() == name,
        None => option_name(*argument) == name,
    };
    Some((Argument::all().find(is_it)?, value))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::CommandFactory;

    use super::*;
    use crate::args::Cli;

    #[test]
    fn arguments_are_options_of_commands() {
        let mut known = BTreeSet::new();
        let mut commands = vec![Cli::command()];
        while let Some(command) = commands.pop() {
            let names = command.get_arguments().filter_map(|argument| argument.get_long());
            known.extend(names.map(str::to_owned));
            commands.extend(command.get_subcommands().cloned());
        }
        for argument in Argument::all() {
            assert!(known.contains(argument.name()), "{argument:?}");
            for word in option_words(&argument.into()) {
                assert_eq!(read_option(&word), Some((argument, None)), "{word}");
            }
        }
        assert_eq!(read_option("--out=x"), Some((Argument::Out, Some("x"))));
        assert_eq!(read_option("x=y"), None);
    }

    #[test]
    fn options_can_be_typed_as_they_are_shown() {
        assert_eq!(option(&Argument::Until.taking("T")), "--until T");
        assert_eq!(option(&Argument::Apply.with("gain_error(q)")), "--apply 'gain_error(q)'");
        assert_eq!(option(&Argument::Start.with("measured")), "--start measured");
        assert_eq!(option(&Argument::Out.taking("DIR")), "-o DIR");
    }
}
