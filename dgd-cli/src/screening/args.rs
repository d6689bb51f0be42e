//! Arguments of `screen`.

use std::path::PathBuf;

use clap::Args;

use crate::args::Choices;
use crate::data::Rename;

/// Arguments of `screen`.
#[derive(Debug, Args)]
pub(crate) struct ScreenArgs {
    /// A model: what it says of the columns is compared with them, too
    pub model: Option<PathBuf>,
    #[command(flatten)]
    pub choices: Choices,
    /// A recording to look at; repeatable
    #[arg(long, value_name = "FILE", required = true)]
    pub data: Vec<PathBuf>,
    /// Call a column by another name, with its unit where the file has none, as in `P_RIS=p_r` or
    /// 'P_RIS=p_r [barg]'; repeatable
    #[arg(long, value_name = "COLUMN=NAME")]
    pub rename: Vec<Rename>,
    /// Columns that measure the same, as in `p_main,p_backup`; repeatable [default: those whose names
    /// differ in a last letter or figure and that move together]
    #[arg(long, value_name = "NAMES")]
    pub same: Vec<String>,
    /// Length of the windows over which slopes are taken, s [default: 30 usual sampling intervals]
    #[arg(long, value_name = "T")]
    pub window: Option<f64>,
    /// Largest slope of a column at rest, per second in its unit, as in `q_ssp=2`; repeatable
    #[arg(long, value_name = "NAME=RATE")]
    pub rest: Vec<String>,
    /// Fail if a fault was found
    #[arg(long)]
    pub check: bool,
    /// Draw the columns, what was found shaded; .svg or .png, repeatable
    #[arg(long, value_name = "FILE")]
    pub plot: Vec<PathBuf>,
}
