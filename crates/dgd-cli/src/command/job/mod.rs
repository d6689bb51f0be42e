//! `dgd job`: work on many wells, split into pieces that any machine can compute.

mod perform;

use std::fs;
use std::path::{Path, PathBuf};

use dgd_data::files::ResultFolder;
use dgd_identify::{Monitor, Progress, Total};
use dgd_job::work::{self, JobShare, PieceTask, RunPlan};
use dgd_job::{
    BuildIdentity, FleetStore, Job, JobError, JobStatus, PieceKeys, PieceState, ProgramFile, fleet,
    is_elsewhere, status,
};
use dgd_work::{Reporter, TaskEnd};
use serde_json::json;

use crate::args::{JobAction, JobArgs, JobPlaceArgs, JobRunArgs};
use crate::command_line::{OPTIONS, command_line, option, program};
use crate::console::{Console, print};
use crate::failure::CommandError;
use crate::progress::{InterruptPolicy, ProgressDisplay};
use crate::tail::{CommandOutput, PrintedText, SavedContent, finish};

pub(crate) fn run(args: &JobArgs, console: Console<'_>) -> Result<(), CommandError> {
    match &args.action {
        JobAction::Run(args) => compute(args, console),
        JobAction::Status(args) => say_status(args, console),
        JobAction::Report(args) => report(args, console),
        JobAction::Work => answer(),
        JobAction::Tasks(args) => list(args, console),
    }
}

impl From<JobError> for CommandError {
    fn from(error: JobError) -> Self {
        CommandError::Found(error.sentence().spelled(option))
    }
}

/// The job with an absolute folder, after a check of the options of every piece.
fn loaded(path: &Path) -> Result<Job, CommandError> {
    let mut job = Job::load(path, OPTIONS)?;
    perform::verify(&job)
        .map_err(|what| CommandError::Usage(format!("`{}`: {what}", path.display())))?;
    job.folder = absolute(&job.folder)?;
    Ok(job)
}

fn absolute(path: &Path) -> Result<PathBuf, CommandError> {
    if is_elsewhere(path) {
        return Ok(path.to_owned());
    }
    fs::canonicalize(path)
        .map_err(|error| CommandError::Found(format!("`{}`: {error}", path.display())))
}

/// This program and its build.
fn this() -> Result<(ProgramFile, BuildIdentity), CommandError> {
    let unreadable = |error: std::io::Error| {
        CommandError::Found(format!("the program cannot read its own file: {error}"))
    };
    let program = program().map_err(unreadable)?;
    let identity = BuildIdentity::read(&program.file).map_err(unreadable)?;
    Ok((program, identity))
}

fn compute(args: &JobRunArgs, console: Console<'_>) -> Result<(), CommandError> {
    let job = loaded(&args.place.job)?;
    let share = match (args.index, args.share) {
        (Some(index), _) if index >= job.len() => {
            return Err(CommandError::Usage(format!(
                "`--index {index}`: the job has {} pieces, which are counted from 0",
                job.len()
            )));
        }
        (Some(index), _) => JobShare::One(index),
        (None, Some((first, of))) => JobShare::Every { first, of },
        (None, None) => JobShare::All,
    };
    let (program, identity) = this()?;
    let store = FleetStore::open(&args.place.into, &identity)?;
    let into = absolute(&args.place.into)?;
    let threads = console.threads_asked().unwrap_or(job.threads);
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let memory = console.memory_asked().or(job.memory);
    if memory.is_some() && !work::is_limited() {
        console.remark(
            "this system does not tell how much memory a process has, so that none is limited",
        );
    }
    let plan = RunPlan {
        job: &job,
        store: &store,
        into: &into,
        names: &PieceKeys::new(&job.folder, &identity, OPTIONS),
        program: &program,
        workers: args.workers.unwrap_or(cores / threads).max(1),
        threads,
        memory,
        share,
        retries: args.retry,
    };
    let display = ProgressDisplay::new(console, InterruptPolicy::Ends(how_to_go_on));
    display.begins(true);
    let heard =
        |done, all| display.advanced(Progress { what: "pieces", done, of: Total::Exactly(all) });
    let tally = work::run(&plan, &heard);
    display.ends();
    let tally = tally?;
    let word = if tally.pieces == 1 { "piece" } else { "pieces" };
    let text = format!(
        "{} {word}: {} computed, {} had a result; {} of them failed\n",
        tally.pieces, tally.computed, tally.had, tally.failed
    );
    let ended = match tally.failed {
        0 => TaskEnd::Done,
        n => TaskEnd::Found(
            format!(
                "{n} of {} {word} failed: `dgd job status {} --into {}` says why",
                tally.pieces,
                args.place.job.display(),
                args.place.into.display()
            )
            .into(),
        ),
    };
    let (json, printed) = (Some(json!(tally)), PrintedText::Text(text));
    finish(CommandOutput { json, printed, ..CommandOutput::new(ended) }, console)
}

fn how_to_go_on(_is_kept: bool) -> &'static str {
    "stopped by Ctrl-C; the same command goes on from here"
}

/// The job with its store and the build that wrote the results, which may differ from this one.
fn known(args: &JobPlaceArgs) -> Result<(Job, FleetStore, BuildIdentity), CommandError> {
    let job = loaded(&args.job)?;
    let store = FleetStore::open_in(&args.into)?;
    let identity = match store.identity()? {
        Some(identity) => identity,
        None => this()?.1,
    };
    Ok((job, store, identity))
}

fn say_status(args: &JobPlaceArgs, console: Console<'_>) -> Result<(), CommandError> {
    let (job, store, identity) = known(args)?;
    let status: JobStatus = status(&job, &store, &identity, OPTIONS)?;
    let json = Some(status.to_json(&args.job, &args.into));
    let printed = PrintedText::Text(status.to_text());
    finish(CommandOutput { json, printed, ..CommandOutput::new(TaskEnd::Done) }, console)
}

fn report(args: &JobPlaceArgs, console: Console<'_>) -> Result<(), CommandError> {
    let (job, store, identity) = known(args)?;
    let fleet = fleet::collect(&job, &store, &identity, OPTIONS)?;
    let saved = match console.out() {
        Some(_) => SavedContent::Folder {
            files: ResultFolder {
                written: fleet.files(&command_line()),
                removed: fleet.stale(console.out()),
            },
            is_told: true,
        },
        None => SavedContent::Nothing,
    };
    let json = console.is_json().then(|| fleet.to_json());
    let printed = PrintedText::Text(fleet.to_text());
    finish(CommandOutput { json, saved, printed, ..CommandOutput::new(TaskEnd::Done) }, console)
}

/// Computes pieces for another process.
fn answer() -> Result<(), CommandError> {
    let program = program().map_err(|error| CommandError::Found(error.to_string()))?;
    work::serve(&program, OPTIONS, perform::perform)
        .map_err(|error| CommandError::Found(error.to_string()))
}

/// All pieces with their states, one line each, for schedulers; the first line gives the build.
fn list(args: &JobPlaceArgs, console: Console<'_>) -> Result<(), CommandError> {
    let job = loaded(&args.job)?;
    let (_, identity) = this()?;
    let store = FleetStore::open(&args.into, &identity)?;
    let (into, there) = (absolute(&args.into)?, store.all()?);
    let names = PieceKeys::new(&job.folder, &identity, OPTIONS);
    let threads = console.threads_asked().unwrap_or(job.threads);
    print(&format!(
        "{}\n",
        json!({ "identity": identity, "pieces": job.len(), "threads": threads, "memory": job.memory })
    ))?;
    for (index, piece) in job.pieces().enumerate() {
        let name = names.key(&piece);
        let state = there.get(&name).copied();
        let what = piece.kind.to_string();
        let path = store.path(&name, state.unwrap_or(PieceState::Done));
        let task = PieceTask {
            name,
            piece,
            folder: job.folder.clone(),
            into: into.clone(),
            threads,
            memory: job.memory,
            given_up: None,
        };
        let state = state.map(PieceState::name);
        print(&format!(
            "{}\n",
            json!({ "index": index, "what": what, "state": state, "path": path, "task": task })
        ))?;
    }
    Ok(())
}
