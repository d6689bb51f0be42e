//! Errors of job files, stores and worker processes.

use std::error::Error;
use std::fmt;
use std::io;
use std::path::PathBuf;

use dgd_data::files::WriteError;
use dgd_work::{Argument, Sentence, meant, sentence};
use serde_json::Value;

/// The reason why a job cannot be read or done.
#[derive(Debug)]
#[non_exhaustive]
pub enum JobError {
    /// The job file cannot be read.
    Unreadable {
        /// Its path.
        path: PathBuf,
        /// The cause.
        error: io::Error,
    },
    /// The job file has a mistake.
    Invalid {
        /// Its path.
        path: PathBuf,
        /// The mistake.
        mistake: Box<JobMistake>,
    },
    /// There are fewer pieces.
    NoPiece(usize),
    /// The results are of another build.
    OtherBuild {
        /// How this build differs.
        difference: String,
        /// The folder of the results.
        into: PathBuf,
    },
    /// This build does not write to such a store.
    NoBuckets(String),
    /// A store, or a text in it, cannot be read or written.
    Store {
        /// Its location.
        path: PathBuf,
        /// The cause.
        reason: String,
    },
    /// A file cannot be written.
    Write(WriteError),
    /// A thread ended.
    ThreadEnded,
    /// No worker process can be started.
    NoProcess(io::Error),
    /// A worker process did not write a result.
    WorkerEnded(String),
    /// A worker process could not begin or store a piece, for the reason that it gave.
    WorkerRefused(String),
}

/// A mistake in a job file.
#[derive(Debug)]
#[non_exhaustive]
pub enum JobMistake {
    /// It is not JSON, or has a key twice.
    NotJson(serde_json::Error),
    /// Nothing is to be done.
    NoTask,
    /// There are no assets.
    NoAssets,
    /// An asset without a model.
    NoModel(String),
    /// A task without its numbers or names.
    ShortTask {
        /// Its place.
        place: String,
        /// Its kind.
        kind: String,
    },
    /// A task without a kind.
    NoKind(String),
    /// A kind that does not exist.
    UnknownKind {
        /// Its place.
        place: String,
        /// The word.
        kind: String,
    },
    /// A task without a key that its kind needs.
    LacksKey {
        /// Its place.
        place: String,
        /// The key.
        key: String,
        /// Its kind.
        kind: String,
    },
    /// A task with a key that its kind does not take.
    ExtraKey {
        /// Its place.
        place: String,
        /// Its kind.
        kind: String,
        /// The key.
        key: String,
    },
    /// More starting points than there can be.
    TooManyPoints(String),
    /// An asset without recordings.
    NoRecordings(String),
    /// Recordings of one date twice.
    SameDate {
        /// The place of the asset.
        place: String,
        /// The date.
        when: String,
    },
    /// A recording without data.
    NoData(String),
    /// A value of another type.
    WrongType {
        /// Its place.
        place: String,
        /// The value.
        value: Value,
        /// What it should be.
        expected: ExpectedValue,
    },
    /// A key that does not exist.
    UnknownKey {
        /// Its place.
        place: String,
        /// The key.
        key: String,
        /// The keys that there are.
        known: Vec<String>,
    },
    /// An option that the job has a key for.
    OwnKey {
        /// Its place.
        place: String,
        /// The option.
        option: Argument,
        /// What to give instead.
        instead: Sentence,
    },
}

/// What a value of a job file should be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ExpectedValue {
    /// An object.
    Object,
    /// A text.
    Text,
    /// The words of options, as in this example.
    Words(Vec<String>),
    /// A whole number from this one on.
    Whole(u64),
    /// A size of memory.
    Size,
    /// A recording.
    Recording,
}

/// The notation of a kind of task.
fn example(kind: &str) -> &'static str {
    match kind {
        "replicates" => r#"{ "kind": "replicates", "count": 200, "each": 20 }"#,
        "profile" => r#"{ "kind": "profile", "of": ["c0", "c2"] }"#,
        _ => r#"{ "kind": "starts", "count": 20 }"#,
    }
}

impl JobMistake {
    /// The mistake in words.
    pub fn sentence(&self) -> Sentence {
        match self {
            Self::NotJson(error) => error.to_string(),
            Self::NoTask => {
                "`do` is missing, what is done with each recording, as in \"do\": [\"fit\"]".to_owned()
            }
            Self::NoAssets => {
                "`wells` are missing, as in \"wells\": { \"A-1\": \"a1.csv\" }".to_owned()
            }
            Self::NoModel(name) => {
                format!("there is no model for `wells.{name}`: give the job a `model`")
            }
            Self::ShortTask { place, kind } => {
                format!("`{place}`: `{kind}` is written as {}", example(kind))
            }
            Self::NoKind(place) => format!("`{place}` has no `kind`, as in {}", example("starts")),
            Self::UnknownKind { place, kind } => {
                let help = meant(kind, &["fit", "starts", "replicates", "profile", "discover"]);
                format!("`{place}`: nothing is called `{kind}`; {help}")
            }
            Self::LacksKey { place, key, kind } => {
                format!("`{place}` has no `{key}`, as in {}", example(kind))
            }
            Self::ExtraKey { place, kind, key } => format!("`{place}`: `{kind}` takes no `{key}`"),
            Self::TooManyPoints(place) => format!("`{place}`: at most 100000 points"),
            Self::NoRecordings(place) => format!("`{place}` has no recordings"),
            Self::SameDate { place, when } => format!(
                "`{place}` has recordings of `{when}` twice: tell them apart, as in {{ \"when\": \"2024-03\", \"data\": \
                 \"…\" }}"
            ),
            Self::NoData(place) => format!("`{place}` has no `data`"),
            Self::WrongType { place, value, expected } => {
                let expected = match expected {
                    ExpectedValue::Object => "an object was expected".to_owned(),
                    ExpectedValue::Text => "a text was expected".to_owned(),
                    ExpectedValue::Words(example) => format!(
                        "a list of words was expected, as in {}",
                        serde_json::to_string(example).unwrap_or_default().replace(',', ", ")
                    ),
                    ExpectedValue::Whole(least) => {
                        format!("a whole number from {least} on was expected")
                    }
                    ExpectedValue::Size => "a size was expected, as in \"2 GB\"".to_owned(),
                    ExpectedValue::Recording => {
                        "a file was expected, or { \"data\": \"a.csv\" }".to_owned()
                    }
                };
                format!("`{place}` is {value}, where {expected}")
            }
            Self::UnknownKey { place, key, known } => {
                let path = if place.is_empty() { key.clone() } else { format!("{place}.{key}") };
                let known: Vec<&str> = known.iter().map(String::as_str).collect();
                format!("`{path}`: there is no such key; {}", meant(key, &known))
            }
            Self::OwnKey { place, option, instead } => {
                return sentence![format!("`{place}` has "), *option, ": ", instead];
            }
        }
        .into()
    }
}

impl JobError {
    /// The error in words.
    pub fn sentence(&self) -> Sentence {
        match self {
            Self::Unreadable { path, error } => format!("`{}`: {error}", path.display()),
            Self::Invalid { path, mistake } => {
                return sentence![format!("`{}`: ", path.display()), mistake.sentence()];
            }
            Self::NoPiece(index) => format!("there is no piece {index}"),
            Self::OtherBuild { difference, into } => {
                return sentence![
                    format!(
                        "this is {difference}, of which the results in `{}` are: give another folder to ",
                        into.display()
                    ),
                    Argument::Into,
                    ", or do the rest with that build"
                ];
            }
            Self::NoBuckets(name) => format!(
                "`{name}`: this build writes results to folders only; the program that is built in `tools/s3/` of the \
                 sources also writes to buckets"
            ),
            Self::Store { path, reason } => format!("`{}`: {reason}", path.display()),
            Self::Write(error) => error.to_string(),
            Self::ThreadEnded => "a thread ended".to_owned(),
            Self::NoProcess(error) => format!("no process can be started: {error}"),
            Self::WorkerEnded(how) => format!("the process that was to write a result {how}"),
            Self::WorkerRefused(reason) => reason.clone(),
        }
        .into()
    }
}

/// With the arguments as a library names them.
impl fmt::Display for JobMistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.sentence().fmt(f)
    }
}

impl Error for JobMistake {}

/// With the arguments as a library names them.
impl fmt::Display for JobError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.sentence().fmt(f)
    }
}

impl Error for JobError {}
