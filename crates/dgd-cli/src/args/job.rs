//! Options of `job`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use dgd_work::values::{count, count_or_none};

/// Arguments of `job`.
#[derive(Debug, Args)]
pub(crate) struct JobArgs {
    #[command(subcommand)]
    pub action: JobAction,
}

/// The actions of a job.
#[derive(Debug, Subcommand)]
pub(crate) enum JobAction {
    /// Compute the pieces that have no result
    ///
    /// `dgd job run fleet.json --into results` computes all of them; run it on any number of machines to share the
    /// work. In a Slurm array, each task computes one piece:
    /// `dgd job run fleet.json --into results --index $SLURM_ARRAY_TASK_ID`.
    ///
    /// An interrupted run leaves no partial results; the same command continues it. The result of a failed piece gives
    /// the reason, and the exit code is then 1.
    Run(JobRunArgs),
    /// List the pieces that are done, failed or open
    ///
    /// For example `dgd job status fleet.json --into results --format json`.
    Status(JobPlaceArgs),
    /// Write tables and pages about all wells: missing effects, their onsets, and the wells to examine first
    ///
    /// For example `dgd job report fleet.json --into results -o fleet`, then open `fleet/index.html`.
    Report(JobPlaceArgs),
    /// Answer questions of another program, one a line
    #[command(hide = true)]
    Work,
    /// List all pieces for another program, one a line
    #[command(hide = true)]
    Tasks(JobPlaceArgs),
}

/// A job and its results.
#[derive(Debug, Args)]
pub(crate) struct JobPlaceArgs {
    /// The job file, JSON
    pub job: PathBuf,
    /// Folder of the results, or `s3://BUCKET/FOLDER` in a program with support for buckets
    #[arg(long, value_name = "DIR")]
    pub into: PathBuf,
}

/// Arguments of `job run`.
#[derive(Debug, Args)]
pub(crate) struct JobRunArgs {
    #[command(flatten)]
    pub place: JobPlaceArgs,
    /// Compute only the piece with this number, counted from 0
    #[arg(long, value_name = "N", value_parser = count_or_none, allow_negative_numbers = true, conflicts_with = "share")]
    pub index: Option<usize>,
    /// Compute only the K-th of N equal shares of the pieces, counted from 0, as in `0/100`
    #[arg(long, value_name = "K/N", value_parser = share)]
    pub share: Option<(usize, usize)>,
    /// Number of pieces computed at a time, each in its own process [default: cores divided by `--threads`]
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub workers: Option<usize>,
    /// Also recompute failed pieces
    #[arg(long)]
    pub retry: bool,
}

/// A share of the pieces.
fn share(text: &str) -> Result<(usize, usize), String> {
    let parts = text.split_once('/').and_then(|(first, of)| {
        Some((first.trim().parse::<usize>().ok()?, of.trim().parse::<usize>().ok()?))
    });
    let share = parts.filter(|(first, of)| first < of);
    share.ok_or_else(|| {
        "this must be a share, from `0/N` to one below `N/N`, as in `0/100`".to_owned()
    })
}
