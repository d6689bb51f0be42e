//! Options of `discover` and `adopt`.

use std::path::PathBuf;

use clap::Args;

use super::{ChoiceArgs, RecordingArgs, SolveArgs};

/// Arguments of `discover`.
#[derive(Debug, Args)]
pub(crate) struct DiscoverArgs {
    /// The model file
    pub model: PathBuf,
    #[command(flatten)]
    pub choices: ChoiceArgs,
    #[command(flatten)]
    pub given: RecordingArgs,
    /// Another folder of effects, in addition to `effects` beside the model; repeatable
    #[arg(long, value_name = "DIR")]
    pub effects: Vec<PathBuf>,
    /// End the search after this time, such as 60s, with the best so far
    #[arg(long, value_name = "TIME", value_parser = crate::numbers::time, allow_hyphen_values = true)]
    pub budget: Option<f64>,
    #[command(flatten)]
    pub solve: SolveArgs,
}

/// Arguments of `adopt`.
#[derive(Debug, Args)]
pub(crate) struct AdoptArgs {
    /// The folder written by `dgd discover -o`, or a file in it such as law_1.dgd
    pub result: PathBuf,
    /// New name of the effect
    pub name: String,
}
