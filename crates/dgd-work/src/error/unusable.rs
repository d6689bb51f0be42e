//! Files and data that cannot be used.

use std::fmt;
use std::io;
use std::path::PathBuf;

use dgd_compiler::argument::Argument;
use dgd_compiler::sentence;
use dgd_compiler::sentence::Sentence;
use dgd_data::files::WriteError;
use dgd_data::stream::RowFault;
use dgd_discover::DiscoverError;
use dgd_identify::filter::FilterError;
use dgd_identify::regression::RegressionError;
use dgd_identify::{EstimateError, ModeDeparture, WrongReading};
use dgd_runtime::InputError;

use super::named;
use crate::request::Estimator;

/// The reason why a file or its content cannot be used.
#[derive(Debug)]
#[non_exhaustive]
pub enum UnusableFile {
    /// A file cannot be read.
    Unreadable {
        /// Its path.
        path: PathBuf,
        /// The cause, as the system or the reader gives it.
        reason: String,
    },
    /// There is no effect of this name.
    NoEffect {
        /// The name.
        name: String,
        /// The folder.
        folder: PathBuf,
        /// The one that is probably meant.
        near: Option<String>,
        /// The effects that there are.
        known: Vec<String>,
    },
    /// An effect has several forms.
    SeveralForms {
        /// Its name.
        name: String,
        /// The names of its forms.
        forms: Vec<String>,
    },
    /// A folder of results without a model.
    NoModel(PathBuf),
    /// A folder of results with several models.
    SeveralModels {
        /// The folder.
        folder: PathBuf,
        /// The number of models.
        count: usize,
    },
    /// Contenders without a common output.
    NoCommonOutput,
    /// Contenders whose common outputs were not measured.
    NothingMeasuredInCommon,
    /// Contenders that were run over different recordings.
    OtherRecordings,
    /// A recording leaves the mode of its operating point.
    LeavesMode {
        /// The recording.
        path: PathBuf,
        /// Where it leaves it.
        departure: ModeDeparture,
    },
    /// No output of the model was measured.
    NothingMeasured {
        /// The outputs, each with its unit.
        outputs: Vec<String>,
    },
    /// A reading that its noise does not allow.
    Reading {
        /// The recording.
        path: Option<PathBuf>,
        /// The output.
        output: String,
        /// The time, s.
        t: f64,
        /// What is wrong with it.
        wrong: WrongReading,
    },
    /// Recordings from which nothing can be estimated.
    Estimate(EstimateError),
    /// Recordings that a regression cannot use.
    Regression(RegressionError),
    /// Recordings that a filter cannot use.
    Filter(FilterError),
    /// Recordings that a discovery cannot use.
    Discovery(DiscoverError),
    /// Inputs beyond their data.
    Inputs(InputError),
    /// A row of a stream that cannot be read.
    Row(RowFault),
    /// A stream without rows.
    NoRow(PathBuf),
    /// A result without anything to adopt.
    NothingToAdopt(PathBuf),
    /// A file that is not the result of a discovery.
    NotADiscovery {
        /// Its path.
        path: PathBuf,
        /// The error of reading it.
        error: serde_json::Error,
    },
    /// A journal that another run is writing.
    JournalInUse(PathBuf),
    /// A file that could not be written.
    Write(WriteError),
    /// A report that could not be written.
    Report(askama::Error),
    /// A result that could not be written.
    Output {
        /// What it is.
        what: OutputPart,
        /// The cause.
        error: io::Error,
    },
}

/// A part of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputPart {
    /// A row.
    Row,
    /// A table.
    Table,
}

impl UnusableFile {
    /// The error in words.
    pub fn sentence(&self) -> Sentence {
        match self {
            Self::Unreadable { path, reason } => {
                format!("cannot read `{}`: {reason}", path.display()).into()
            }
            Self::NoEffect { name, folder, near, known } => {
                let hint = match near {
                    Some(near) => format!("did you mean `{near}`?"),
                    None if known.is_empty() => "there are no effects".to_owned(),
                    None => format!("there is {}", named(known)),
                };
                format!("there is no effect `{name}` in `{}`; {hint}", folder.display()).into()
            }
            Self::SeveralForms { name, forms } => {
                let mut sentence = sentence![format!("effect `{name}` has several forms: say ")];
                for (k, form) in forms.iter().enumerate() {
                    sentence.push(if k == 0 { "" } else { " or " });
                    sentence.push(Argument::Apply.with(form));
                }
                sentence
            }
            Self::NoModel(folder) => format!(
                "`{}` has no model: name the folder of a fit's or a discovery's results",
                folder.display()
            )
            .into(),
            Self::SeveralModels { folder, count } => {
                format!("`{}` has {count} models: name one of them", folder.display()).into()
            }
            Self::NoCommonOutput => {
                "the contenders have no output of one name: nothing can be compared".into()
            }
            Self::NothingMeasuredInCommon => {
                "no output that all contenders have was measured: nothing can be compared".into()
            }
            Self::OtherRecordings => {
                "not all contenders were run over the same recordings: see what was left out of their fits"
                    .into()
            }
            Self::LeavesMode { path, departure } => {
                let ModeDeparture { t, automaton, at_point, in_run } = departure;
                sentence![
                    format!(
                        "{}: the linear model is that of `{automaton}: {at_point}`, and at t = {t} s the model with \
                         these estimates is in `{in_run}`; take a stretch in one mode by ",
                        path.display()
                    ),
                    Argument::From,
                    " and ",
                    Argument::Until,
                    ", another operating point by ",
                    Argument::At,
                    ", or ",
                    Argument::Estimator.with(Estimator::OutputError.name())
                ]
            }
            Self::NothingMeasured { outputs } => format!(
                "{}; the model's outputs are {}",
                EstimateError::NothingMeasured,
                named(outputs)
            )
            .into(),
            Self::Reading { path, output, t, wrong } => {
                let path = path.as_ref().map(|path| format!("`{}`: ", path.display()));
                format!("{}`{output}` at {t} s: {wrong}", path.unwrap_or_default()).into()
            }
            Self::Estimate(error) => error.to_string().into(),
            Self::Regression(error) => error.to_string().into(),
            Self::Filter(error) => error.to_string().into(),
            Self::Discovery(error) => error.to_string().into(),
            Self::Inputs(error) => error.to_string().into(),
            Self::Row(fault) => fault.to_string().into(),
            Self::NoRow(path) => format!("`{}` has no row to track", path.display()).into(),
            Self::NothingToAdopt(path) => format!(
                "there is nothing to adopt in `{}`: the discovery found no formula and described no effect",
                path.display()
            )
            .into(),
            Self::NotADiscovery { path, error } => {
                format!("`{}` is not the result of a discovery: {error}", path.display()).into()
            }
            Self::JournalInUse(path) => {
                format!("{} is in use: another run is still writing it", path.display()).into()
            }
            Self::Write(error) => error.to_string().into(),
            Self::Output { what, error } => match what {
                OutputPart::Row => format!("cannot write a row: {error}"),
                OutputPart::Table => error.to_string(),
            }
            .into(),
            Self::Report(error) => format!("cannot write the report: {error}").into(),
        }
    }
}

/// With the arguments as a library names them.
impl fmt::Display for UnusableFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.sentence().fmt(f)
    }
}

impl std::error::Error for UnusableFile {}
