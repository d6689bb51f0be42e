//! Arguments of `screen`.

use std::path::PathBuf;

use clap::Args;
use dgd_data::Rename;
use dgd_work::ScreenRequest;

use super::ChoiceArgs;
use crate::command_line::command_line;
use crate::numbers::time;

/// Arguments of `screen`.
#[derive(Debug, Args)]
pub(crate) struct ScreenArgs {
    /// A model whose declarations the columns are also checked against
    pub model: Option<PathBuf>,
    #[command(flatten)]
    pub choices: ChoiceArgs,
    /// A recording to check; repeatable
    #[arg(long, value_name = "FILE", required = true)]
    pub data: Vec<PathBuf>,
    /// Rename a column, adding a unit if the file has none, as in `P_RIS=p_r` or 'P_RIS=p_r [barg]';
    /// repeatable
    #[arg(long, value_name = "COLUMN=NAME")]
    pub rename: Vec<Rename>,
    /// Columns that measure the same quantity, as in `p_main,p_backup`; repeatable [default: those whose
    /// names differ only in the last letter or digit and that move together]
    #[arg(long, value_name = "NAMES")]
    pub same: Vec<String>,
    /// Length of the windows over which slopes are computed, in s or as in `5min` [default: 30 usual sampling intervals]
    #[arg(long, value_name = "T", value_parser = time, allow_hyphen_values = true)]
    pub window: Option<f64>,
    /// Largest slope at which a column counts as at rest, in its unit per second, as in `q_ssp=2`; repeatable
    #[arg(long, value_name = "NAME=RATE")]
    pub rest: Vec<String>,
    /// Fail if a fault is found
    #[arg(long)]
    pub check: bool,
    /// Plot the columns, with findings shaded; a picture (.svg, .pdf, .png) or a page of all recordings (.html); repeatable
    #[arg(long, value_name = "FILE")]
    pub plot: Vec<PathBuf>,
}

impl ScreenArgs {
    /// The request of a screening.
    pub(crate) fn request(&self) -> ScreenRequest {
        let mut request = ScreenRequest::new(self.data.clone());
        request.model.clone_from(&self.model);
        request.choices = self.choices.request();
        request.rename.clone_from(&self.rename);
        request.same.clone_from(&self.same);
        request.window = self.window;
        request.rest.clone_from(&self.rest);
        request.check = self.check;
        request.command = command_line();
        request
    }
}
