//! Arguments of `compare`.

use std::path::Path;

use clap::Args;
use dgd_work::CompareRequest;

use super::{RecordingArgs, SolveArgs};
use crate::command_line::command_line;
use crate::numbers::count;

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// Contenders: `MODEL`, `MODEL@VARIANT=CHOICE`, `MODEL+EFFECT`, or a folder written by `fit -o` or
    /// `discover -o`; at least two
    #[arg(value_name = "CONTENDER", required = true, num_args = 2..)]
    pub contenders: Vec<String>,
    #[command(flatten)]
    pub given: RecordingArgs,
    /// Set a constant, a parameter or a start value, as in `c0=280` or 'F2=1.8e8 [Pa*s^2/m^6]', in every contender that
    /// has it
    #[arg(long, value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Treat the first contender as nested in each of the others, and run likelihood-ratio tests [default: contenders of
    /// the same model that only have more effects]
    #[arg(long)]
    pub nested: bool,
    /// Maximum number of simulations in each search [default: 200]
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub evaluations: Option<usize>,
    #[command(flatten)]
    pub solve: SolveArgs,
}

impl CompareArgs {
    /// The request of a comparison; its journal is kept beside `out`.
    pub(crate) fn request(&self, out: Option<&Path>) -> CompareRequest {
        let mut request = CompareRequest::new(self.contenders.clone(), self.given.data.clone());
        request.valid.clone_from(&self.given.valid);
        request.sought = self.given.sought.request();
        request.set.clone_from(&self.set);
        request.keep = self.given.keep(out);
        request.nested = self.nested;
        request.evaluations = self.evaluations;
        request.solve = self.solve.request();
        request.command = command_line();
        request
    }
}
