//! The command line, as typed.

mod job;
mod new;
mod requests;
#[cfg(test)]
mod tests;
mod text;
mod values;
mod watch;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use dgd_work::values::{count, whole};
use dgd_work::{
    AdoptRequest, CompareRequest, DiscoverRequest, FitRequest, InvertRequest, LinearizeRequest,
    SensitivityRequest, SimulateRequest, TrackRequest,
};

pub(crate) use job::{JobAction, JobArgs, JobPlaceArgs, JobRunArgs};
pub(crate) use new::NewArgs;
pub(crate) use requests::{DrawnArgs, ScreenArgs};
pub(crate) use text::{
    CheckArgs, CompilerStage, CompletionsArgs, EmitArgs, ExplainArgs, FmtArgs, LspArgs, ManArgs,
};
use values::size;
pub(crate) use watch::WatchArgs;

/// Check, simulate, differentiate and fit models written in a small equation language
///
/// Begin with `dgd new motor --template motor`.
#[derive(Debug, Parser)]
#[command(name = "dgd", version, max_term_width = 100)]
pub(crate) struct Cli {
    #[command(flatten)]
    pub global: GlobalArgs,
    #[command(subcommand)]
    pub command: Command,
}

/// Options of every command.
#[derive(Debug, Args)]
pub(crate) struct GlobalArgs {
    /// Output format of results and diagnostics
    #[arg(long, global = true, value_enum, default_value_t = OutputFormat::Text)]
    pub format: OutputFormat,
    /// Print errors only
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// When to use colours; `NO_COLOR` is respected
    #[arg(long, global = true, value_enum, default_value_t = ColorChoice::Auto)]
    pub color: ColorChoice,
    /// Seed of the random number generator
    #[arg(long, global = true, value_name = "N", default_value_t = 0, value_parser = whole::<u64>, allow_negative_numbers = true)]
    pub seed: u64,
    /// Number of threads; does not affect results [default: all cores]
    #[arg(long, global = true, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// Maximum memory, as in `500MB`; data beyond it go to a file during the run; `job run` applies it to each piece [default: no limit]
    #[arg(long, global = true, value_name = "SIZE", value_parser = size)]
    pub memory: Option<u64>,
    /// Folder on a disk for the file of data beyond `--memory` [default: `TMPDIR`, or /var/tmp]
    #[arg(long, global = true, value_name = "DIR", requires = "memory")]
    pub scratch: Option<PathBuf>,
    /// File to write the result to; `fit`, `discover` and `screen` write a folder [default: standard output]
    #[arg(long, short, global = true, value_name = "PATH")]
    pub out: Option<PathBuf>,
}

/// How results are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum OutputFormat {
    /// For people
    Text,
    /// For programs
    Json,
}

/// When to use colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ColorChoice {
    /// On a terminal
    Auto,
    /// Always
    Always,
    /// Never
    Never,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Start a project from a template, or from your own recording
    ///
    /// `dgd new motor --template motor` writes a folder with a model, two recordings and a library of effects, one of
    /// which is hidden in the recordings. `dgd new plant --from data.csv` makes a runnable model from the columns.
    New(NewArgs),
    /// Check a model: syntax, names, units, structure, in all its variants
    ///
    /// `dgd check model.dgd` lists the mistakes; `dgd check model.dgd --fix` fixes those that have only one
    /// possible correction.
    Check(CheckArgs),
    /// Format model files; comments are kept
    ///
    /// For example `dgd fmt model.dgd effects/*.dgd`.
    Fmt(FmtArgs),
    /// Print the output of a compiler stage
    ///
    /// For example the equations as they are solved: `dgd emit model.dgd --stage dae`.
    Emit(EmitArgs),
    /// Explain an error code in detail
    ///
    /// For example `dgd explain E301`.
    Explain(ExplainArgs),
    /// Simulate a model: states and outputs over time
    ///
    /// For example on recorded inputs, plotted with the measurements:
    /// `dgd simulate model.dgd --data run.csv --plot run.html`
    ///
    /// Ctrl-C stops the run and keeps the rows computed so far.
    #[command(mut_arg("over", |over| over.requires("plot")))]
    Simulate(DrawnArgs<SimulateRequest>),
    /// Watch a model: a page that redraws its curves on every save, with sliders for its parameters
    ///
    /// For example `dgd watch model.dgd --data run.csv`, which prints an address to open in a browser on this machine.
    /// No data leaves the machine. Ctrl-C ends it.
    Watch(WatchArgs),
    /// Compute sensitivities: derivatives of states and outputs with respect to parameters, over time
    ///
    /// For example of the output `h` to two parameters: `dgd sensitivity model.dgd --data run.csv --of h --to A,c0`.
    Sensitivity(DrawnArgs<SensitivityRequest>),
    /// Linearise a model at an operating point: A, B, C, D, poles and time constants
    ///
    /// For example where it is at rest: `dgd linearize model.dgd --data run.csv --at steady`.
    Linearize(DrawnArgs<LinearizeRequest>),
    /// Find the missing term of an equation from measurements of all its other quantities
    ///
    /// For example the flow missing from the balance of a level: `dgd invert models/mud_circulation.dgd --data run.csv
    /// --for riser --unit lpm --plot missing.png`.
    Invert(DrawnArgs<InvertRequest>),
    /// Estimate parameters and initial values from recordings
    ///
    /// For example, validated on a second recording:
    /// `dgd fit model.dgd --data monday.csv --valid tuesday.csv -o fitted`
    ///
    /// Ctrl-C stops the fit, writes the best estimates so far, and lists what was left out; the exit code is
    /// then 130. A second Ctrl-C ends the program at once.
    Fit(DrawnArgs<FitRequest>),
    /// Compare models, variants, effects or results on the same recordings
    ///
    /// All contenders are fitted in the same way:
    /// `dgd compare m.dgd m.dgd+leak --data monday.csv --valid tuesday.csv`
    Compare(DrawnArgs<CompareRequest>),
    /// Estimate states and parameters row by row, as the data arrives
    ///
    /// For example from a logger: `logger | dgd track model.dgd --data - --free F`.
    Track(DrawnArgs<TrackRequest>),
    /// Find where a model and recordings disagree, and name the effect that is missing
    ///
    /// For example `dgd discover model.dgd --data monday.csv --valid tuesday.csv -o found`.
    ///
    /// With `-o`, finished work is stored during the run: if Ctrl-C or a kill ends it, continue with `--resume`.
    Discover(DrawnArgs<DiscoverRequest>),
    /// Add a formula or an effect from a discovery to the library of its model
    ///
    /// For example `dgd adopt found leak`; afterwards, `--apply leak` applies it.
    Adopt(AdoptRequest),
    /// Check recordings for faults before a fit
    ///
    /// For example `dgd screen monday.csv tuesday.csv`, or against a model: `dgd screen run.csv --model model.dgd`.
    Screen(ScreenArgs),
    /// Fit or search many wells on many machines, and report on all of them
    ///
    /// For example `dgd job run fleet.json --into results`, and then `dgd job report fleet.json --into results -o fleet`.
    /// The job file lists wells, recordings, and the work on each.
    Job(JobArgs),
    /// List the integration methods
    ///
    /// `dgd methods` lists the values of `--method`.
    Methods,
    /// Print the JSON schema of all results
    ///
    /// `dgd schema -o results.schema.json`. Its `version` is incremented if a key is removed or changes its
    /// meaning; every result gives it as `provenance.schema`.
    Schema,
    /// Print completions for a shell
    ///
    /// For example `dgd completions bash > ~/.local/share/bash-completion/completions/dgd`.
    Completions(CompletionsArgs),
    /// Write the manual pages into a folder
    ///
    /// For example `dgd man ~/.local/share/man/man1`.
    Man(ManArgs),
    /// Serve an editor on standard input and output through the Language Server Protocol
    ///
    /// Editors start it: `vim.lsp.start({ cmd = { "dgd", "lsp" } })`; settings for Neovim, Helix, Zed
    /// and VS Code are in docs/editors.md.
    Lsp(LspArgs),
}
