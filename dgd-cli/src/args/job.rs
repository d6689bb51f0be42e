//! Options of `job`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::numbers::{count, count_or_none};

/// Arguments of `job`.
#[derive(Debug, Args)]
pub(crate) struct JobArgs {
    #[command(subcommand)]
    pub action: JobAction,
}

/// What is done with a job.
#[derive(Debug, Subcommand)]
pub(crate) enum JobAction {
    /// Compute the pieces that have no result
    ///
    /// `dgd job run fleet.json --into results` computes all; any number of these on any number of machines share the
    /// work. A Slurm array computes a piece each: `dgd job run fleet.json --into results --index $SLURM_ARRAY_TASK_ID`.
    ///
    /// What is ended on its way leaves nothing half written; the same command goes on. Pieces that fail have results
    /// that say why, and the exit code is then 1.
    Run(JobRunArgs),
    /// Say which pieces are done, have failed, or are open
    ///
    /// For example `dgd job status fleet.json --into results --format json`.
    Status(JobPlaceArgs),
    /// Write tables and pages over all wells: which lacks what, since when, and what to look at first
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
    /// Folder of the results, or `s3://BUCKET/FOLDER` with a program that knows buckets
    #[arg(long, value_name = "DIR")]
    pub into: PathBuf,
}

/// Arguments of `job run`.
#[derive(Debug, Args)]
pub(crate) struct JobRunArgs {
    #[command(flatten)]
    pub place: JobPlaceArgs,
    /// The piece of this number alone, counted from 0
    #[arg(long, value_name = "N", value_parser = count_or_none, allow_negative_numbers = true, conflicts_with = "share")]
    pub index: Option<usize>,
    /// The K-th of N equal shares of the pieces, counted from 0, as in `0/100`
    #[arg(long, value_name = "K/N", value_parser = share)]
    pub share: Option<(usize, usize)>,
    /// Number of pieces at a time, each in a process of its own [default: cores divided by `--threads`]
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub workers: Option<usize>,
    /// Also compute the pieces again that failed
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
