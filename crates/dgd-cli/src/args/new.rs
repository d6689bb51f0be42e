//! Options of `new`.

use std::path::PathBuf;

use clap::{ArgGroup, Args};

/// Names of templates, in the order in which they are listed.
pub(crate) const TEMPLATES: [&str; 8] =
    ["motor", "tank", "exchanger", "battery", "reactor", "circuit", "vehicle", "drilling"];

/// Arguments of `new`.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("source").required(true).args(["from", "template"])))]
pub(crate) struct NewArgs {
    /// The folder to create; the model gets its name
    pub name: PathBuf,
    /// A recording: its columns become inputs, outputs and states
    #[arg(long, value_name = "DATA")]
    pub from: Option<PathBuf>,
    /// A project to experiment with
    #[arg(long, value_name = "NAME", value_parser = TEMPLATES)]
    pub template: Option<String>,
    /// With `--from`, the columns that are outputs; the others are inputs [default: those that change in nearly every
    /// row]
    #[arg(long, value_name = "COLUMNS", value_delimiter = ',', requires = "from")]
    pub outputs: Vec<String>,
}
