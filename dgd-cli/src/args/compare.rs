//! Arguments of `compare`.

use std::path::PathBuf;

use clap::Args;
use dgd_work::CompareRequest;

use super::{SolveArgs, Sought};
use crate::command_line::command_line;
use crate::numbers::count;

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// What to compare: `MODEL`, `MODEL@VARIANT=CHOICE`, `MODEL+EFFECT`, or a folder that `fit -o` or `discover -o` has
    /// written; at least two
    #[arg(value_name = "CONTENDER", required = true, num_args = 2..)]
    pub contenders: Vec<String>,
    /// A recording that all are fitted to; repeatable
    #[arg(long, value_name = "FILE", required = true)]
    pub data: Vec<PathBuf>,
    /// A recording for validation, not used in the fits; repeatable
    #[arg(long, value_name = "FILE")]
    pub valid: Vec<PathBuf>,
    #[command(flatten)]
    pub sought: Sought,
    /// Take the first contender for a special case of each other one, and test whether they do better than chance
    /// [default: contenders of one model that only have more effects]
    #[arg(long)]
    pub nested: bool,
    /// Maximum number of simulations in each search [default: 200]
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub evaluations: Option<usize>,
    #[command(flatten)]
    pub solve: SolveArgs,
}

impl CompareArgs {
    /// For those who do the work.
    pub(crate) fn request(&self) -> CompareRequest {
        let mut request = CompareRequest::new(self.contenders.clone(), self.data.clone());
        request.valid.clone_from(&self.valid);
        request.sought = self.sought.request();
        request.nested = self.nested;
        request.evaluations = self.evaluations;
        request.solve = self.solve.request();
        request.command = command_line();
        request
    }
}
