//! `dgd discover`: where a model and recordings disagree, and which known effect is missing.

use std::path::{Path, PathBuf};

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::effects::Effect;
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{Compiled, Directions};
use dgd_compiler::syntax::ast::{Item, ItemKind};
use dgd_discover::{BaseModel, DiscoverError, Discovery, Request, discover, templates};
use dgd_runtime::System;
use dgd_runtime::identify::{Recording, Unwatched};
use dgd_runtime::journal::{Forgetful, Journal};

use crate::args::{DiscoverArgs, SolveArgs, Start};
use crate::attendant::Attendant;
use crate::command_line::command_line;
use crate::console::{Console, print, print_text};
use crate::data::read_renamed;
use crate::effects::{self, FOLDER, load_folder};
use crate::failure::CommandError;
use crate::figure;
use crate::load::Compilation;
use crate::recording;
use crate::report::{self, Subject};
use crate::reservations;
use crate::resume;
use crate::run::{executable, options, verify_memory_of_fit};

pub(crate) fn run(args: &DiscoverArgs, console: Console<'_>) -> Result<(), CommandError> {
    figure::verify_formats(&args.solve.plot)?;
    resume::verify(args.resume, console)?;
    let integration = options(&args.solve)?;
    let mut compilation = Compilation::default();
    let options_of_model =
        ModelOptions { columns: columns(args), ..compilation.options(&args.choices)? };
    let compiled = base_model(args, &options_of_model, &mut compilation)?;
    let library = library(args, &mut compilation, console)?;
    let Compilation { sources, diagnostics, .. } = &mut compilation;
    let Ok(templates) = templates(sources, diagnostics) else {
        return Err(CommandError::diagnosed(diagnostics, sources.clone()));
    };
    let train = recordings(args, &args.data, &compiled, &mut compilation, console)?;
    let valid = recordings(args, &args.valid, &compiled, &mut compilation, console)?;
    console.spare(&compilation.sources)?;
    let (held_out, left_out) = HeldOut::of(args, &train, valid);
    let mut reservations = reserved(args, &compiled, &train, console.threads())?;
    reservations.extend(left_out);

    let base = BaseModel {
        asts: compiled.asts.clone(),
        options: options_of_model,
        free: args.sought.free.clone(),
        fix: args.sought.fix.clone(),
        engine: args.solve.engine.into(),
    };
    let names = recording::names(&[args.data.as_slice(), &held_out.paths].concat());
    let (train_names, valid_names) = names.split_at(args.data.len());
    let request = Request {
        base: &base,
        library: &library,
        templates: &templates,
        sources: &compilation.sources,
        train: (&train, train_names),
        valid: (&held_out.recordings, valid_names),
        options: integration,
        threads: console.threads(),
        seed: console.seed(),
        journal: &Forgetful,
        watch: &Unwatched,
    };
    let journal = resume::journal(args.resume, || request.digest(), console)?;
    let watch = Attendant::ending(console, how_to_go_on(journal.is_some()));
    let kept: &dyn Journal = match &journal {
        Some(journal) => journal,
        None => &Forgetful,
    };
    let request = Request { journal: kept, watch: &watch, ..request };
    let mut diagnostics = Diagnostics::default();
    let found = discover(&request, &mut diagnostics);
    watch.write();
    let found = found.map_err(|error| failed(&error, &diagnostics, &compilation))?;
    let left_out = found.left_out.iter();
    reservations
        .extend(left_out.map(|(name, why)| format!("the effect `{name}` {why}: it is left out")));
    reservations.extend(
        found
            .given_up
            .iter()
            .map(|(names, why)| format!("fits of {} were given up where {why}", names.join(", "))),
    );
    let input = (held_out.paths.as_slice(), reservations.as_slice());
    let shown = show(args, &found, input, (&compiled, &compilation), console);
    if let (Err(_), Some(journal)) = (&shown, &journal) {
        journal.leave();
        console.remark(
            "the search is kept: the same command with `--resume` writes its result without searching again",
        );
    }
    shown
}

fn failed(
    error: &DiscoverError,
    diagnostics: &Diagnostics,
    compilation: &Compilation,
) -> CommandError {
    match error {
        DiscoverError::Model(_) => {
            CommandError::diagnosed(diagnostics, compilation.sources.clone())
        }
        DiscoverError::NoRecording | DiscoverError::NothingMeasured => {
            CommandError::Found(error.to_string())
        }
        DiscoverError::BaseModel(_) => CommandError::Computation(error.to_string()),
    }
}

fn how_to_go_on(is_kept: bool) -> String {
    if is_kept {
        "stopped by Ctrl-C; the same command with `--resume` continues from here".to_owned()
    } else {
        "stopped by Ctrl-C; nothing was kept: with `-o DIR`, `--resume` could have continued from here"
            .to_owned()
    }
}

/// Writes the folder of results, the pictures and the summary.
fn show(
    args: &DiscoverArgs,
    found: &Discovery,
    (held_out, reservations): (&[PathBuf], &[String]),
    (compiled, compilation): (&Compiled, &Compilation),
    console: Console<'_>,
) -> Result<(), CommandError> {
    let command = command_line();
    let subject = Subject {
        discovery: found,
        model: &args.model,
        base: &compilation.sources.get(compiled.asts[0].source).text,
        choices: &args.choices,
        training: &args.data,
        held_out,
        reservations,
        command: &command,
    };
    if let Some(folder) = console.out() {
        report::write(folder, &subject)?;
    }
    if !args.solve.plot.is_empty() {
        let figure = report::gap_figure(found);
        for path in &args.solve.plot {
            figure::save(&figure, path, console)?;
        }
    }
    if console.is_json() {
        print(&report::result_json(&subject))
    } else if console.is_quiet() && console.out().is_some() {
        Ok(())
    } else {
        print_text(&report::summary(found, reservations, console.out()))
    }
}

/// Recordings that are kept out of the fits.
#[derive(Default)]
struct HeldOut {
    paths: Vec<PathBuf>,
    recordings: Vec<Recording>,
}

impl HeldOut {
    /// Those that are none of the training recordings again, and a sentence for each that is.
    fn of(args: &DiscoverArgs, train: &[Recording], valid: Vec<Recording>) -> (Self, Vec<String>) {
        let repeated = reservations::trained_on(train, &valid);
        let (mut kept, mut left_out) = (Self::default(), Vec::new());
        for ((path, recording), of) in args.valid.iter().zip(valid).zip(repeated) {
            if let Some(of) = of {
                let (path, trained) = (path.display(), args.data[of].display());
                left_out.push(format!(
                    "at least half the rows of {path} are rows of {trained}, so it tests nothing and is left out"
                ));
            } else {
                kept.paths.push(path.clone());
                kept.recordings.push(recording);
            }
        }
        (kept, left_out)
    }
}

/// Why the training recordings may not say what they are asked.
fn reserved(
    args: &DiscoverArgs,
    compiled: &Compiled,
    train: &[Recording],
    threads: usize,
) -> Result<Vec<String>, CommandError> {
    let system = executable(compiled.program.clone(), &args.solve)?;
    let signature = system.signature();
    // Candidates only add to it.
    verify_memory_of_fit("the search", signature, train, threads, true)?;
    let p: Vec<f64> = signature.parameters.iter().map(|p| p.value).collect();
    let mut reservations = reservations::of_recordings(&system, &p, train);
    reservations.extend(reservations::of_few_samples(signature, train));
    Ok(reservations)
}

/// The columns that all recordings have, if the model declares inputs that it does not read: effects may, where
/// there are such columns. Faults of a file are reported when it is read next.
fn columns(args: &DiscoverArgs) -> Option<Vec<String>> {
    let mut probe = Compilation::default();
    let options = ModelOptions { columns: Some(Vec::new()), ..probe.options(&args.choices).ok()? };
    let compiled = base_model(args, &options, &mut probe).ok()?;
    let is_read = |name: &str| compiled.dae.inputs.iter().any(|i| i.declared.name == name);
    let is_unread = |item: &Item| match &item.kind {
        ItemKind::Input { name, .. } => !is_read(&name.text),
        _ => false,
    };
    if !compiled.asts[0].items.iter().any(is_unread) {
        return None;
    }
    let mut common: Option<Vec<String>> = None;
    for path in args.data.iter().chain(&args.valid) {
        let Compilation { sources, diagnostics } = &mut probe;
        let table = read_renamed(path, &args.solve.rename, sources, diagnostics).ok()?;
        let has = |name: &String| table.column(name).is_some();
        match &mut common {
            Some(common) => common.retain(has),
            None => common = Some(table.columns.iter().map(|c| c.name.clone()).collect()),
        }
    }
    common
}

/// The model to be examined, with the effects of `--apply` written into its text.
fn base_model(
    args: &DiscoverArgs,
    options: &ModelOptions,
    compilation: &mut Compilation,
) -> Result<Compiled, CommandError> {
    let (free, fixed) = compilation.sought(&args.sought);
    let directions = Directions::Estimated { free, fixed };
    match compilation.compile_text(&args.model, &args.choices.apply, options, &directions)? {
        Ok(compiled) => Ok(compiled),
        Err(_) => {
            Err(CommandError::diagnosed(&compilation.diagnostics, compilation.sources.clone()))
        }
    }
}

/// The effects beside the model, and those of `--effects`. Without any, all that can be told is
/// whether the model explains the data.
fn library(
    args: &DiscoverArgs,
    compilation: &mut Compilation,
    console: Console<'_>,
) -> Result<Vec<Effect>, CommandError> {
    let beside = effects::folder_of(&args.model);
    let mut folders: Vec<PathBuf> = Vec::new();
    if beside.is_dir() {
        folders.push(beside);
    }
    for folder in &args.effects {
        if !folder.is_dir() {
            let message = format!("`--effects {}`: there is no such folder", folder.display());
            return Err(CommandError::Usage(message));
        }
        folders.push(folder.clone());
    }
    let Compilation { sources, diagnostics } = compilation;
    let mut library = Vec::new();
    for folder in &folders {
        library.extend(load_folder(folder, sources, diagnostics).into_iter().flatten());
    }
    if diagnostics.check().is_err() {
        return Err(CommandError::diagnosed(diagnostics, sources.clone()));
    }
    if library.is_empty() && !args.effects.is_empty() {
        return Err(CommandError::Usage(
            "there are no effects in the folders of `--effects`: each is a `.dgd` file".to_owned(),
        ));
    }
    if library.is_empty() {
        console.remark(&format!(
            "there are no effects of this model to look for, only templates: put files of its own \
             into a folder `{FOLDER}` beside `{}`, or give one by `--effects DIR`",
            args.model.display()
        ));
    }
    Ok(library)
}

/// Recordings as the model sees them, with start values from the first measured outputs where these
/// determine them.
fn recordings(
    args: &DiscoverArgs,
    paths: &[PathBuf],
    compiled: &Compiled,
    compilation: &mut Compilation,
    console: Console<'_>,
) -> Result<Vec<Recording>, CommandError> {
    let files = (paths, args.solve.rename.as_slice());
    let clock = recording::Clock::Time;
    let read = recording::Recording::read_all(files, &compiled.dae, clock, compilation, console)?;
    let system = executable(compiled.program.clone(), &args.solve)?;
    let p: Vec<f64> = system.signature().parameters.iter().map(|p| p.value).collect();
    let integration = options(&args.solve)?;
    let with = |start: Start, read: &recording::Recording, path: &Path| {
        let solve = SolveArgs { start, ..args.solve.clone() };
        read.experiment(&system, &p, path, &solve, &integration)
    };
    let one = |(read, path): (&recording::Recording, &PathBuf)| {
        // A guess only: where the outputs do not give one, the model's own start values do.
        with(Start::Measured, read, path).or_else(|_| with(args.solve.start, read, path))
    };
    read.iter().zip(paths).map(one).collect()
}
