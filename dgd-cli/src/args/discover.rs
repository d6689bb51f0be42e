//! Options of `discover` and `adopt`.

use std::path::PathBuf;

use clap::Args;

use super::{Choices, SolveArgs, Sought};

/// Arguments of `discover`.
#[derive(Debug, Args)]
pub(crate) struct DiscoverArgs {
    /// The model file
    pub model: PathBuf,
    #[command(flatten)]
    pub choices: Choices,
    /// A recording to search in; repeatable
    #[arg(long, value_name = "FILE", required = true)]
    pub data: Vec<PathBuf>,
    /// A recording for validation, not used in fits; repeatable
    #[arg(long, value_name = "FILE")]
    pub valid: Vec<PathBuf>,
    /// Another folder of effects, in addition to `effects` beside the model; repeatable
    #[arg(long, value_name = "DIR")]
    pub effects: Vec<PathBuf>,
    /// End the search after this time, such as 60s, with the best so far
    #[arg(long, value_name = "TIME", value_parser = crate::numbers::time, allow_hyphen_values = true)]
    pub budget: Option<f64>,
    #[command(flatten)]
    pub sought: Sought,
    /// Continue an earlier run that was ended, with the same input and `-o`; the result is the same
    #[arg(long)]
    pub resume: bool,
    #[command(flatten)]
    pub solve: SolveArgs,
}

/// Arguments of `adopt`.
#[derive(Debug, Args)]
pub(crate) struct AdoptArgs {
    /// The folder that `dgd discover -o` wrote, or a file in it such as law_1.dgd
    pub result: PathBuf,
    /// What the effect is to be called
    pub name: String,
}
