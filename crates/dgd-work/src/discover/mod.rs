//! Where a model and recordings disagree, and which known effect is missing.

mod adopt;
pub mod invert;
mod offered;
mod report;

use std::path::{Path, PathBuf};

use dgd_compiler::argument::Argument;
use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::effects::Effect;
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{CompiledStages, SensitivityDirections};
use dgd_compiler::sentence;
use dgd_compiler::source::SourceText;
use dgd_compiler::syntax::{layout, table_files};
use dgd_data::files::ResultFolder;
use dgd_data::files::journal::RunJournal;
use dgd_data::{FileSystem, InMemory};
use dgd_discover::{
    BaseModel, DiscoverError, Discovery, DiscoveryOptions, OutputGap, OutputScales, templates,
};
use dgd_identify::journal::{Journal, NoJournal};
use dgd_identify::{NoMonitor, Recording};
use dgd_plot::Figure;
use dgd_runtime::integrate::catalogue::AUTOMATIC;
use dgd_runtime::signature::Direction;
use dgd_runtime::{Signature, System};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use crate::error::{ComputationError, UnusableFile, UsageError, WorkError};
use crate::model::Compilation;
use crate::model::effects::{self, FOLDER, load_folder};
use crate::output::provenance::{self, DataFile, Provenance};
use crate::output::quantity::{of_differences, rounded};
use crate::request::{DiscoverRequest, ModelChoices, StartChoice};
use crate::result::discover::DiscoverDocument;
use crate::run::recording;
use crate::run::{executable, keeping, options, reservations, verify_memory_of_fit};
use crate::session::TaskContext;
pub use adopt::{AdoptedFile, adopt};
use offered::{with_inputs, without_unread};
use report::DiscoverySubject;
pub use report::file_names;

/// The result of a discovery, with the inputs of its report.
#[derive(Debug)]
#[non_exhaustive]
pub struct DiscoveryResult {
    /// The result.
    pub discovery: Discovery,
    /// Reasons to doubt that the recordings can answer.
    pub reservations: Vec<String>,
    /// The file of the base model.
    pub model: PathBuf,
    /// Its text, with the effects of the request.
    pub base: String,
    /// Training recordings.
    pub training: Vec<PathBuf>,
    /// Validation recordings.
    pub held_out: Vec<PathBuf>,
    /// Versions and digests of the inputs.
    pub provenance: Provenance,
    files: InMemory,
    choices: ModelChoices,
    command: String,
    journal: Option<RunJournal>,
}

/// Searches for the missing terms of a model.
///
/// # Errors
///
/// [`WorkError`].
pub fn discover(
    request: &DiscoverRequest,
    session: TaskContext<'_>,
) -> Result<DiscoveryResult, WorkError> {
    keeping::verify(&request.keep)?;
    let choices = request.choices.starting(&request.solve);
    let request = &DiscoverRequest { choices, ..request.clone() };
    let integration = options(&request.solve)?;
    let mut compilation = Compilation::new(session.files);
    let offered = offered::offered(request, session.files);
    let options_of_model =
        ModelOptions { columns: offered.columns, ..compilation.options(&request.choices)? };
    let inputs = offered.inputs;
    let compiled = base_model(request, &options_of_model, &mut compilation)?;
    // Provenance covers the user's own texts, as in other commands.
    let of_model = provenance::of_model(&compilation.sources);
    let compiled = with_inputs(compiled, &inputs, request, &options_of_model, &mut compilation)?;
    let library = library(request, &mut compilation, session)?;
    let Compilation { sources, diagnostics, .. } = &mut compilation;
    let Ok(templates) = templates(sources, diagnostics) else {
        return Err(WorkError::diagnosed(diagnostics, sources.clone()));
    };
    let (train, mut files) =
        recordings(request, &request.data, &compiled, &mut compilation, session)?;
    let (valid, more) = recordings(request, &request.valid, &compiled, &mut compilation, session)?;
    files.extend(more);
    let provenance = Provenance::new(session, Some(of_model), files);
    session.spare(&compilation.sources)?;
    let (held_out, left_out) = HeldOut::collect(request, &train, valid);
    let mut reservations = reserved(request, &compiled, &train, session.threads)?;
    reservations.extend(left_out);

    let base = BaseModel {
        asts: compiled.asts.clone(),
        options: options_of_model,
        free: request.sought.free.clone(),
        fix: request.sought.fix.clone(),
        engine: request.solve.engine,
        scales: OutputScales::default(),
    };
    let names = recording::names(&[request.data.as_slice(), &held_out.paths].concat());
    let (train_names, valid_names) = names.split_at(request.data.len());
    let search = DiscoveryOptions {
        base: &base,
        library: &library,
        templates: &templates,
        sources: &compilation.sources,
        train: (&train, train_names),
        valid: (&held_out.recordings, valid_names),
        options: integration,
        is_method_named: request.solve.method != AUTOMATIC,
        threads: session.threads,
        seed: session.seed,
        budget: request.budget,
        journal: &NoJournal,
        watch: &NoMonitor,
    };
    let journal = keeping::journal(&request.keep, || search.digest(), session)?;
    session.listener.begins(journal.is_some());
    let kept: &dyn Journal = match &journal {
        Some(journal) => journal,
        None => &NoJournal,
    };
    let search = DiscoveryOptions { journal: kept, watch: session.listener, ..search };
    let mut diagnostics = Diagnostics::default();
    let discovery = dgd_discover::discover(&search, &mut diagnostics);
    session.listener.ends();
    let mut discovery = discovery.map_err(|error| failed(&error, &diagnostics, &compilation))?;
    let main = compiled.asts[0].source;
    // Removed lines may have been the longest of their columns.
    let stripped =
        |text: &str| layout::like(main, &compilation.sources, without_unread(text, &inputs));
    discovery.corrected = stripped(&discovery.corrected);
    let left_out = discovery.left_out.iter();
    reservations
        .extend(left_out.map(|(name, why)| format!("the effect `{name}` {why}: it is left out")));
    reservations.extend(
        discovery
            .given_up
            .iter()
            .map(|(names, why)| format!("fits of {} were given up where {why}", names.join(", "))),
    );
    let system = executable(compiled.program.clone(), &request.solve)?;
    reservations
        .extend(discovery.gap.iter().filter_map(|gap| other_noise(gap, system.signature())));
    let outputs = system.signature().outputs.iter().zip(&discovery.lonely);
    reservations.extend(outputs.filter(|(_, lost)| **lost > 0).map(|(output, lost)| {
        let (readings, stand) =
            if *lost == 1 { ("reading", "stands") } else { ("readings", "stand") };
        format!(
            "{lost} {readings} of `{}` {stand} alone, far outside the neighbours: left out",
            output.name
        )
    }));
    if !discovery.uneven.is_empty() {
        let names: Vec<String> = discovery.uneven.iter().map(|name| format!("`{name}`")).collect();
        reservations.push(format!(
            "the noise of {} is not the same for all readings: each counts by its own, and noise and errors are given for \
             a usual reading",
            names.join(" and ")
        ));
    }
    if held_out.recordings.is_empty() {
        let words = sentence![
            "no validation data was given (",
            Argument::Valid,
            "): an effect is named only if fits to three quarters of the recordings predict the fourth"
        ];
        reservations.push(words.spelled(session.spelling()));
    }
    if discovery.is_cut_short {
        let why = if session.listener.is_stopped() {
            "was stopped".into()
        } else {
            sentence!["ended when the time of ", Argument::Budget, " had passed"]
        };
        let words = sentence![
            "the search ",
            why,
            ": this is the best so far, and `not_tried` and the ranking list what was not tried"
        ];
        reservations.push(words.spelled(session.spelling()));
    }
    let is_model =
        |source: &&SourceText| Path::new(&source.name).extension().is_some_and(|e| e == "dgd");
    let of_tables = table_files::files(&compiled.asts);
    let of_tables = of_tables.into_iter().map(|id| compilation.sources.get(id));
    let texts = compilation.sources.files().filter(is_model).chain(of_tables);
    let texts = texts.fold(InMemory::default(), |files, source| {
        files.with_file(&source.name, without_unread(&source.text, &inputs).as_bytes())
    });
    Ok(DiscoveryResult {
        discovery,
        reservations,
        model: request.model.clone(),
        base: stripped(&compilation.sources.get(main).text),
        training: request.data.clone(),
        held_out: held_out.paths,
        provenance,
        files: texts,
        choices: request.choices.clone(),
        command: request.command.clone(),
        journal,
    })
}

impl DiscoveryResult {
    fn subject(&self) -> DiscoverySubject<'_> {
        DiscoverySubject {
            discovery: &self.discovery,
            model: &self.model,
            base: &self.base,
            files: &self.files,
            choices: &self.choices,
            training: &self.training,
            held_out: &self.held_out,
            reservations: &self.reservations,
            command: &self.command,
            provenance: Some(&self.provenance),
        }
    }

    /// The result, for programs.
    pub fn result(&self) -> DiscoverDocument {
        report::result(&self.subject())
    }

    /// `result.json`.
    pub fn to_json(&self) -> Value {
        json!(self.result())
    }

    /// As text; with the report's folder, if it was written.
    pub fn to_text(&self, folder: Option<&Path>) -> String {
        report::summary(&self.discovery, &self.reservations, folder)
    }

    /// The report, the result for programs, the corrected model and how it differs: [`file_names`].
    ///
    /// # Errors
    ///
    /// The corrected model does not compile, or the page cannot be made.
    pub fn files(&self) -> Result<ResultFolder, WorkError> {
        report::files(&self.subject())
    }

    /// `report.html`.
    ///
    /// # Errors
    ///
    /// Those of [`Self::files`].
    pub fn page(&self) -> Result<String, WorkError> {
        report::page(&self.subject())
    }

    /// Residuals before and after the correction, on validation data if there is any.
    pub fn figure(&self) -> Figure {
        report::gap_figure(&self.discovery)
    }

    /// Keeps the search's journal, if any, so that the same request, resumed, returns this result without
    /// searching. Otherwise the journal is removed with the result.
    pub fn leave(&self) -> bool {
        if let Some(journal) = &self.journal {
            journal.leave();
        }
        self.journal.is_some()
    }
}

impl Serialize for DiscoveryResult {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_json().serialize(serializer)
    }
}

fn failed(
    error: &DiscoverError,
    diagnostics: &Diagnostics,
    compilation: &Compilation<'_>,
) -> WorkError {
    match error {
        DiscoverError::Model(_) => WorkError::diagnosed(diagnostics, compilation.sources.clone()),
        DiscoverError::NoRecording | DiscoverError::NothingMeasured => {
            UnusableFile::Discovery(error.clone()).into()
        }
        DiscoverError::BaseModel(_) | DiscoverError::Corrected(_) => {
            ComputationError::Discovery(error.clone()).into()
        }
    }
}

/// A declared noise is reported if it differs from the observed noise by more than this factor.
const OTHER_NOISE: f64 = 1.5;
/// Reduced χ² up to which residuals pass for noise.
const PASSES: f64 = 1.1;

/// A sentence about an output whose declared noise differs from the observed noise: how each judges the model.
fn other_noise(gap: &OutputGap, signature: &Signature) -> Option<String> {
    let output = signature.outputs.iter().find(|output| *output.name == *gap.output)?;
    let declared = output.noise?;
    let ratio = gap.noise / declared;
    if !(ratio.is_finite() && ratio > 0.0 && !(1.0 / OTHER_NOISE..=OTHER_NOISE).contains(&ratio)) {
        return None;
    }
    let unit = of_differences(&gap.unit);
    let shown = |x: f64| format!("{} {}", rounded(x / unit.factor, 3), unit.symbol);
    let judged = |noise: f64| {
        let square = (gap.train_before / noise).powi(2);
        let passes = if square <= PASSES { ", which passes for noise" } else { "" };
        format!("{} times the noise variance{passes}", rounded(square, 3))
    };
    Some(format!(
        "the model declares a noise of {} for `{}`, and the readings show {}: by the declared noise the base model leaves \
         {}, by the readings' {}",
        shown(declared),
        gap.output,
        shown(gap.noise),
        judged(declared),
        judged(gap.noise)
    ))
}

/// Validation recordings.
#[derive(Default)]
struct HeldOut {
    paths: Vec<PathBuf>,
    recordings: Vec<Recording>,
}

impl HeldOut {
    /// The recordings that are not training recordings as well, with a sentence for each that is.
    fn collect(
        request: &DiscoverRequest,
        train: &[Recording],
        valid: Vec<Recording>,
    ) -> (Self, Vec<String>) {
        let repeated = reservations::trained_on(train, &valid);
        let (mut kept, mut left_out) = (Self::default(), Vec::new());
        for ((path, recording), of) in request.valid.iter().zip(valid).zip(repeated) {
            if let Some(of) = of {
                let (path, trained) = (path.display(), request.data[of].display());
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

/// Reasons to doubt that the training recordings can answer.
fn reserved(
    request: &DiscoverRequest,
    compiled: &CompiledStages,
    train: &[Recording],
    threads: usize,
) -> Result<Vec<String>, WorkError> {
    let system = executable(compiled.program.clone(), &request.solve)?;
    let signature = system.signature();
    // Candidates only add parameters.
    verify_memory_of_fit("the search", signature, train, threads, true)?;
    let p: Vec<f64> = signature.parameters.iter().map(|p| p.value).collect();
    let mut reservations = reservations::of_recordings(&system, &p, train);
    reservations.extend(reservations::of_few_samples(signature, train));
    Ok(reservations)
}

/// The model to be examined, with the effects of `--apply` written into its text.
fn base_model(
    request: &DiscoverRequest,
    options: &ModelOptions,
    compilation: &mut Compilation<'_>,
) -> Result<CompiledStages, WorkError> {
    let directions = directions(request, compilation);
    let (path, apply) = (&request.model, &request.choices.apply);
    let compiled = compilation.compile_text(path, apply, options, &directions)?;
    compiled
        .map_err(|_| WorkError::diagnosed(&compilation.diagnostics, compilation.sources.clone()))
}

fn directions(
    request: &DiscoverRequest,
    compilation: &mut Compilation<'_>,
) -> SensitivityDirections {
    let (free, fixed) = compilation.sought(&request.sought);
    SensitivityDirections::Estimated { free, fixed }
}

/// The folders of effects: beside the model, and those of the request.
fn folders(request: &DiscoverRequest, files: &dyn FileSystem) -> Vec<PathBuf> {
    let beside = effects::folder_of(&request.model);
    let folders = std::iter::once(beside).chain(request.effects.iter().cloned());
    folders.filter(|folder| files.is_folder(folder)).collect()
}

/// The effects beside the model, and those of the request. Without any, the search can only tell whether the model
/// explains the data.
fn library(
    request: &DiscoverRequest,
    compilation: &mut Compilation<'_>,
    session: TaskContext<'_>,
) -> Result<Vec<Effect>, WorkError> {
    if let Some(missing) = request.effects.iter().find(|own| !compilation.files.is_folder(own)) {
        return Err(UsageError::NoEffectFolder(missing.clone()).into());
    }
    let folders = folders(request, compilation.files);
    let Compilation { files, sources, diagnostics } = compilation;
    let mut library = Vec::new();
    for folder in &folders {
        library.extend(load_folder(*files, folder, sources, diagnostics).into_iter().flatten());
    }
    if diagnostics.check().is_err() {
        return Err(WorkError::diagnosed(diagnostics, sources.clone()));
    }
    if library.is_empty() && !request.effects.is_empty() {
        return Err(UsageError::NoEffects.into());
    }
    if library.is_empty() {
        session.remark(sentence![
            format!(
                "there are no effects of this model to look for, only templates: put files of its own into a folder \
                 `{FOLDER}` beside `{}`, or give one by ",
                request.model.display()
            ),
            Argument::Effects.taking("DIR")
        ]);
    }
    Ok(library)
}

/// Recordings as the model reads them, with initial values from the first measured outputs where these determine them.
fn recordings(
    request: &DiscoverRequest,
    paths: &[PathBuf],
    compiled: &CompiledStages,
    compilation: &mut Compilation<'_>,
    session: TaskContext<'_>,
) -> Result<(Vec<Recording>, Vec<DataFile>), WorkError> {
    let (renames, dae) = (&request.solve.rename, &compiled.dae);
    let clock = recording::TimeColumnRule::Time;
    let read = recording::RunRecording::read_all(paths, renames, dae, clock, compilation, session)?;
    let system = executable(compiled.program.clone(), &request.solve)?;
    let p: Vec<f64> = system.signature().parameters.iter().map(|p| p.value).collect();
    let integration = options(&request.solve)?;
    let with = |start: StartChoice, read: &recording::RunRecording, path: &Path| {
        let mut solve = request.solve.clone();
        solve.start = start;
        read.experiment(&system, &p, path, &solve, &integration)
    };
    let directions = &system.signature().directions;
    let one = |(read, path): (&recording::RunRecording, &PathBuf)| {
        if request.solve.start == StartChoice::Measured {
            return with(StartChoice::Measured, read, path);
        }
        // Only a guess: if the outputs do not determine it, the model's own initial values apply.
        let Ok(mut guessed) = with(StartChoice::Measured, read, path) else {
            return with(request.solve.start, read, path);
        };
        // Initial values that are not estimated stay as the model gives them.
        guessed.start.retain(|(state, _)| directions.contains(&Direction::Start(*state)));
        Ok(guessed)
    };
    let files = read.iter().zip(paths).map(|(read, path)| DataFile::new(path, read.digest));
    let recordings: Result<Vec<Recording>, WorkError> = read.iter().zip(paths).map(one).collect();
    Ok((recordings?, files.collect()))
}
