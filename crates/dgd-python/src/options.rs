//! Reads options from Python as the command reads its arguments: one dictionary for each call, with an entry for each
//! option that was given.
//!
//! A request declares its options once, so that a new one needs no line here.

use std::error::Error;
use std::ffi::OsString;
use std::path::Path;

use clap::error::{ContextKind, ContextValue};
use clap::{Args, Command};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;

/// Entries that are not options of a request.
const OF_SESSION: [&str; 3] = ["seed", "threads", "command"];

/// Arguments of Python that have another name on the command line.
const RENAMED: [(&str, &str); 2] = [("from", "from_"), ("set", "params")];

/// Random seed and number of threads.
pub(crate) struct SessionOptions {
    pub seed: u64,
    pub threads: Option<usize>,
}

impl SessionOptions {
    pub(crate) fn read(options: &Bound<'_, PyDict>) -> PyResult<Self> {
        let seed = options.get_item("seed")?.map(|seed| seed.extract()).transpose()?;
        let threads = options.get_item("threads")?.map(|threads| threads.extract()).transpose()?;
        Ok(SessionOptions { seed: seed.unwrap_or(0), threads: threads.flatten() })
    }
}

/// The line that reproduces the result.
pub(crate) fn command(options: &Bound<'_, PyDict>) -> PyResult<String> {
    options.get_item("command")?.map_or_else(|| Ok(String::new()), |command| command.extract())
}

/// A request about a model and these recordings, each with the option that names it.
pub(crate) fn request<'a, R: Args>(
    options: &Bound<'_, PyDict>,
    model: &Path,
    recordings: impl IntoIterator<Item = (&'a str, &'a Path)>,
) -> PyResult<R> {
    let mut words = Vec::new();
    for (name, recording) in recordings {
        words.push(word(name, recording));
    }
    for (name, value) in options.iter() {
        let name: String = name.extract()?;
        if !OF_SESSION.contains(&&*name) {
            push(&mut words, &name.replace('_', "-"), &value)?;
        }
    }
    words.extend(["--".into(), model.into()]);
    let command = Command::new("dgd").no_binary_name(true).disable_help_flag(true);
    let matches = R::augment_args(command).try_get_matches_from(words);
    let request = matches.and_then(|matches| R::from_arg_matches(&matches));
    request.map_err(|error| errors::usage(options.py(), &refusal(&error)))
}

fn word(name: &str, value: impl AsRef<std::ffi::OsStr>) -> OsString {
    let mut word = OsString::from(format!("--{name}="));
    word.push(value);
    word
}

/// Appends an option: a flag, a value, or one of several values.
fn push(words: &mut Vec<OsString>, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    if value.is_none() {
        return Ok(());
    }
    if let Ok(is_set) = value.extract::<bool>() {
        words.extend(is_set.then(|| format!("--{name}").into()));
    } else if let Ok(text) = value.extract::<String>() {
        words.push(word(name, text));
    } else if let Ok(whole) = value.extract::<i64>() {
        words.push(word(name, whole.to_string()));
    } else if let Ok(whole) = value.extract::<u64>() {
        words.push(word(name, whole.to_string()));
    } else if let Ok(number) = value.extract::<f64>() {
        // The fewest digits that are read back to the same number.
        words.push(word(name, format!("{number:?}")));
    } else {
        for item in value.try_iter()? {
            push(words, name, &item?)?;
        }
    }
    Ok(())
}

/// An error of the command line in terms of Python's arguments.
fn refusal(error: &clap::Error) -> String {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    let argument = text(ContextKind::InvalidArg).and_then(|option| {
        let name = option.strip_prefix("--")?.split(' ').next()?.replace('-', "_");
        let renamed = RENAMED.iter().find(|(known, _)| *known == name);
        Some(renamed.map_or(name, |(_, argument)| (*argument).to_owned()))
    });
    let (Some(argument), Some(value)) = (argument, text(ContextKind::InvalidValue)) else {
        return error.to_string().trim_start_matches("error: ").trim_end().to_owned();
    };
    if let Some(ContextValue::Strings(known)) = error.get(ContextKind::ValidValue)
        && !known.is_empty()
    {
        let known: Vec<String> = known.iter().map(|known| format!("\"{known}\"")).collect();
        return format!("`{argument}` must be {}, not \"{value}\"", known.join(" or "));
    }
    let reason = error.source().map_or_else(String::new, ToString::to_string);
    match reason.strip_prefix("this ") {
        Some(must_be) => format!("`{argument}` {must_be}, not {value}"),
        None => format!("`{argument}`: {reason}"),
    }
}
