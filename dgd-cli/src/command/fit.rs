//! `dgd fit`: parameters and start values from recordings, tested on others.

use std::path::{Path, PathBuf};

use dgd_compiler::diagnostics::{Code, Diagnostic};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{Compiled, Directions};
use dgd_compiler::source::Sources;
use dgd_execute::Loaded;
use dgd_runtime::identify::filter::FilterProblem;
use dgd_runtime::identify::{
    Estimate, EstimateError, Evaluation, Fit, Noise, NoiseCorrelation, OutputErrorProblem, Prior,
    Recording, StoppingRule, Termination, TrialFailed, TrialFailure, Watch, counts_from, evaluate,
    fit_starts, nonlinear, operating_points,
};
use dgd_runtime::journal::{Digest, Keeping};
use dgd_runtime::linearize::NotLinearised;
use dgd_runtime::{Direction, Options, Problem, Signature, System};
use serde_json::Value;

use crate::args::{FitArgs, NoiseFrom, Place};
use crate::attendant::Attendant;
use crate::command::{prediction_error, regress};
use crate::console::{Console, print, print_text};
use crate::data::journal::RunJournal;
use crate::data::{Files, write_folder};
use crate::estimator::Estimator;
use crate::failure::{CommandError, meant};
use crate::few_samples::FewSamples;
use crate::figure::{self, Line, Subject};
use crate::fit_quality::Quality;
use crate::fit_report::{Outcome, Tested, name_of};
use crate::fitted_model;
use crate::information::Origins;
use crate::intervals::Intervals;
use crate::left_out::LeftOut;
use crate::linearised::{self, Linearised};
use crate::load::Compilation;
use crate::multi_start::Minima;
use crate::plot::Text;
use crate::recording::{self, Clock};
use crate::refit::options_of_refit;
use crate::reservations;
use crate::resume;
use crate::run::{
    executable, options, verify_memory_of_fit, with_method, with_method_per_sample,
    with_method_to_begin,
};

/// Most evaluations of a model without states, which cost next to nothing.
const MOST_EVALUATIONS_OF_ROWS: usize = 5000;

pub(crate) fn run(args: &FitArgs, console: Console<'_>) -> Result<(), CommandError> {
    figure::verify_formats(&args.solve.plot)?;
    resume::verify(args.resume, console)?;
    let place = args.regression.place()?;
    let mut task = Task::load(args, console)?;
    if let Some(place) = place {
        task.linearise(place);
    }
    let task = task;
    let signature = task.system.signature();
    args.search.verify(args.regression.estimator)?;
    args.regression.verify_evaluations(args.evaluations)?;
    args.intervals.verify(args.regression.estimator, signature)?;
    match args.regression.estimator {
        Estimator::OutputError | Estimator::Linearised => {}
        Estimator::PredictionError => return prediction_error::run(&task, args, console),
        Estimator::LeastSquares
        | Estimator::Bounded
        | Estimator::Separable
        | Estimator::NelderMead
        | Estimator::Recursive => return regress::run(&task, args, console),
    }
    let problem = OutputErrorProblem { loss: args.search.loss.loss(), ..task.problem(console) };
    let fitted = |problem: &OutputErrorProblem<'_, Loaded>| {
        let found = args.search.fit(problem, console.seed());
        found.map_err(|error| task.failed(error, &args.data))
    };
    let found = fitted(&problem)?;
    let (problem, found) =
        match options_of_refit(&problem.options, &args.solve, &found, &task.train, console) {
            None => (problem, found),
            Some(options) => {
                let problem = OutputErrorProblem { options, ..problem };
                let found = fitted(&problem)?;
                (problem, found)
            }
        };
    let (mut fit, minima) = (found.fit.clone(), Minima::of(found));
    let is_converged = fit.termination.is_converged();
    let train = task.evaluated(&problem, &fit, &args.data)?;
    let mut left_out = LeftOut::of(fit.termination, || task.unconverged(&fit, &args.data));
    if let Some(minima) = &minima {
        minima.push_left_out(&mut left_out);
    }
    let valid =
        task.tested_unless_stopped(args, &mut left_out, || task.tested(&problem, &fit, args));
    let valid = match valid {
        // What has been found is kept.
        Err(error) if !is_converged => {
            left_out.push(format!("validation recordings were not simulated: {error}"));
            None
        }
        valid => valid?,
    };
    let linearised = place.map(|place| task.linearised(place, &problem, &fit, &train, args));
    let intervals = Intervals::find(&args.intervals, &problem, &fit, console.seed())
        .map_err(|error| task.failed(error, &args.data))?;
    let recording_names = recording::names(&args.data);
    intervals.push_left_out(&mut left_out, |i| name_of(&fit.estimates[i], &recording_names));
    task.watch.write();
    let information = args
        .intervals
        .information
        .then(|| Origins::find(&problem, &fit, &train))
        .transpose()
        .map_err(|error| task.failed(error, &args.data))?;
    let mut reservations = reservations::of_recordings(&task.system, &fit.p, &task.train);
    reservations.extend(task.repeated(args));
    if task.few.hide_stds() {
        fit.forget_uncertainty();
    }
    let outcome = Outcome {
        signature,
        variants: &task.compiled.model.variants,
        fit: &fit,
        data: &args.data,
        recording_names,
        recordings: &task.train,
        information,
        intervals,
        reservations,
        minima,
        few: &task.few,
        left_out: &left_out,
        quality: Quality::of(signature, &task.train, &train, &fit),
        quality_valid: valid
            .as_ref()
            .map(|tested| Quality::of(signature, &tested.recordings, &tested.evaluation, &fit)),
        train,
        valid,
        linearised: linearised.transpose()?,
    };
    let json = outcome.to_json();
    if let Some(folder) = console.out() {
        task.save(folder, args, &fit.estimates, &json, Vec::new())?;
        console.remark(&format!("wrote {}", folder.display()));
    }
    if !args.solve.plot.is_empty() {
        let figure = figure::panels(&subjects(&outcome, &task, args));
        for path in &args.solve.plot {
            figure::save(&figure, path, console)?;
            for (path, figure) in outcome.intervals.figures(&outcome, path) {
                figure::save(&figure, &path, console)?;
            }
        }
    }
    if console.is_json() { print(&format!("{json:#}\n")) } else { print_text(&outcome.to_text()) }?;
    left_out.ended(task.journal.as_ref(), console)
}

/// What is to be fitted to what.
pub(super) struct Task {
    pub(super) compiled: Compiled,
    sources: Sources,
    options_of_model: ModelOptions,
    pub(super) system: Loaded,
    /// Parameters as the model file and `--set` have them, SI.
    pub(super) p: Vec<f64>,
    pub(super) train: Vec<Recording>,
    pub(super) valid: Vec<Recording>,
    pub(super) noise: Vec<Option<Noise>>,
    /// Outputs whose noise cannot be estimated.
    pub(super) few: FewSamples,
    /// Whether a file has rows without time.
    pub(super) clock: Clock,
    options: Options,
    /// Shows how far it is, and stops it.
    pub(super) watch: Attendant,
    /// Most simulations or evaluations, where the command line says so.
    pub(super) evaluations: Option<usize>,
    /// Simulations, profiles and refits, kept until all is written.
    pub(super) journal: Option<RunJournal>,
    /// Of the model, where something is kept.
    digest: Digest,
}

impl Task {
    fn load(args: &FitArgs, console: Console<'_>) -> Result<Task, CommandError> {
        let options = options(&args.solve)?;
        let mut compilation = Compilation::default();
        let options_of_model = compilation.options(&args.choices)?;
        let (free, fixed) = compilation.sought(&args.sought);
        let directions = if args.regression.estimator == Estimator::PredictionError {
            Directions::Tracked { free, fixed }
        } else {
            Directions::Estimated { free, fixed }
        };
        let apply = &args.choices.apply;
        let compiled =
            compilation.compile_text(&args.model, apply, &options_of_model, &directions)?;
        let compiled = match compiled {
            Ok(compiled) => compiled,
            Err(reported) => return Err(compilation.fail(reported)),
        };
        let used = used_outputs(&mut compilation, &compiled, &args.outputs);
        let mut read = |paths: &[PathBuf]| {
            let files = (paths, args.solve.rename.as_slice());
            let dae = &compiled.dae;
            recording::Recording::read_all(files, dae, Clock::Rows, &mut compilation, console)
        };
        // What is reported of the second are the mistakes of both.
        let (train, valid) = (read(&args.data), read(&args.valid));
        let (valid, train) = (valid?, train?);

        let mut clocks = train.iter().chain(&valid).map(|read| read.clock);
        let clock =
            if clocks.any(|clock| clock == Clock::Rows) { Clock::Rows } else { Clock::Time };
        let system = executable(compiled.program.clone(), &args.solve)?;
        let signature = system.signature();
        let options = with_method(options, &args.solve, signature);
        let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
        let experiments = |read: Vec<recording::Recording>, paths: &[PathBuf]| {
            let read = read.iter().zip(paths);
            read.map(|(read, path)| read.experiment(&system, &p, path, &args.solve, &options))
                .collect::<Result<Vec<Recording>, CommandError>>()
        };
        let train = experiments(train, &args.data)?;
        let valid = experiments(valid, &args.valid)?;
        if args.regression.estimator.simulates() {
            let keeps =
                args.regression.estimator == Estimator::Linearised || args.intervals.information;
            verify_memory_of_fit("the fit", signature, &train, console.threads(), keeps)?;
        }
        let options = match train.first() {
            None => options,
            Some(Recording { inputs, start, times, .. }) => {
                let problem = Problem { system: &system, p: &p, inputs, start };
                with_method_per_sample(options, &args.solve, &problem, times)?
            }
        };
        let runs =
            train.iter().chain(&valid).filter_map(|Recording { inputs, start, times, .. }| {
                Some((Problem { system: &system, p: &p, inputs, start }, *times.first()?))
            });
        let options = with_method_to_begin(options, &args.solve, runs, console);
        let mut noise: Vec<Option<Noise>> = (0..signature.outputs.len())
            .map(|i| {
                let measured = train.iter().any(|recording| recording.measured[i].is_some());
                let declared = signature.outputs[i].noise;
                let noise = match (args.noise, declared) {
                    (NoiseFrom::Declared, Some(sigma)) => Noise::Known(sigma),
                    (NoiseFrom::Declared, None) | (NoiseFrom::Estimated, _) => Noise::Estimated,
                };
                (used[i] && measured).then_some(noise)
            })
            .collect();
        let estimates = match args.regression.estimator {
            Estimator::OutputError | Estimator::Linearised => {
                estimates(signature, train.len(), |_| true)
            }
            Estimator::PredictionError => {
                let levels = FilterProblem::new(&system, &p).states().len()
                    + noise.iter().filter(|noise| **noise == Some(Noise::Estimated)).count();
                let is_free =
                    |direction: &Direction| prediction_error::is_free(&compiled, args, direction);
                estimates(signature, train.len(), is_free) + levels
            }
            Estimator::LeastSquares
            | Estimator::Bounded
            | Estimator::Separable
            | Estimator::NelderMead
            | Estimator::Recursive => estimates(signature, 0, |_| true),
        };
        let few = FewSamples::find(&signature.outputs, &train, &mut noise, estimates);
        let sources = compilation.sources;
        console.spare(&sources)?;
        let of_model = || Digest::EMPTY.of(&compiled.program);
        // Whose estimator simulates, it takes long.
        let journal = if args.regression.estimator == Estimator::OutputError {
            let input = || of_model().of(&(&p, &train, &valid, &noise)).of(&options);
            resume::journal(args.resume, input, console)?
        } else if args.resume {
            return Err(CommandError::Usage(
                "`--resume` needs `--estimator output-error`".to_owned(),
            ));
        } else {
            None
        };
        let digest = if journal.is_some() { of_model() } else { Digest::EMPTY };
        Ok(Task {
            compiled,
            sources,
            options_of_model,
            system,
            p,
            train,
            valid,
            noise,
            few,
            clock,
            options,
            watch: Attendant::stopping(console),
            evaluations: args.evaluations,
            journal,
            digest,
        })
    }

    /// Has all recordings simulated by linear models.
    fn linearise(&mut self, place: Place) {
        for recording in self.train.iter_mut().chain(&mut self.valid) {
            recording.linear = place.of(&recording.inputs, &recording.times);
        }
    }

    /// Where the linear models were, and what the model itself makes of the estimates.
    fn linearised(
        &self,
        place: Place,
        problem: &OutputErrorProblem<'_, Loaded>,
        fit: &Fit,
        train: &Evaluation,
        args: &FitArgs,
    ) -> Result<Linearised, CommandError> {
        let failed = |error| self.failed(EstimateError::Start(error), &args.data);
        let points = operating_points(problem, &fit.p, &fit.starts).map_err(failed)?;
        let model = nonlinear(problem, &fit.p, &fit.starts);
        if let Ok(model) = &model {
            let mut all = args.data.iter().zip(&model.departures);
            if let Some((path, departure)) =
                all.find_map(|(path, found)| Some((path, found.as_ref()?)))
            {
                return Err(CommandError::Found(linearised::other_mode(path, departure)));
            }
        }
        let model = model.map_err(|error| named(&error, &args.data));
        let signature = self.system.signature();
        Ok(Linearised::new(signature, place, points, (&self.train, train), fit, model))
    }

    pub(super) fn problem(&self, console: Console<'_>) -> OutputErrorProblem<'_, Loaded> {
        let parameters = self.compiled.program.parameters.iter().enumerate();
        let prior = |(parameter, declared): (usize, &dgd_compiler::model::Parameter)| {
            declared.prior.map(|(mean, std)| Prior { parameter, mean, std })
        };
        let mut stopping = StoppingRule::default();
        if self.compiled.dae.is_static() {
            stopping.evaluations = MOST_EVALUATIONS_OF_ROWS;
        }
        stopping.evaluations = self.evaluations.unwrap_or(stopping.evaluations);
        OutputErrorProblem {
            stopping,
            noise: self.noise.clone(),
            priors: parameters.filter_map(prior).collect(),
            options: self.options,
            threads: console.threads(),
            watch: &self.watch,
            keeping: match &self.journal {
                Some(journal) => Keeping { journal, of: self.digest },
                None => Keeping::NOTHING,
            },
            ..OutputErrorProblem::new(&self.system, &self.p, &self.train)
        }
    }

    fn evaluated(
        &self,
        problem: &OutputErrorProblem<'_, Loaded>,
        fit: &Fit,
        paths: &[PathBuf],
    ) -> Result<Evaluation, CommandError> {
        evaluate(problem, &fit.p, &fit.starts)
            .map_err(|error| self.failed(EstimateError::Start(error), paths))
    }

    /// The validation recordings, simulated with start values from their beginnings.
    fn tested(
        &self,
        problem: &OutputErrorProblem<'_, Loaded>,
        fit: &Fit,
        args: &FitArgs,
    ) -> Result<Option<Tested>, CommandError> {
        if self.valid.is_empty() {
            return Ok(None);
        }
        let noise = fit.noise.iter().map(|sigma| sigma.map(Noise::Known)).collect();
        let held_out =
            OutputErrorProblem { p: &fit.p, recordings: &self.valid, noise, ..problem.clone() };
        self.simulated(&held_out, &args.valid).map(Some)
    }

    /// Validation recordings, or what is said where Ctrl-C came first: start values that were not fitted to
    /// the end say nothing of the model.
    pub(super) fn tested_unless_stopped<T>(
        &self,
        args: &FitArgs,
        left_out: &mut LeftOut,
        tested: impl FnOnce() -> Result<Option<T>, CommandError>,
    ) -> Result<Option<T>, CommandError> {
        let valid = if self.watch.is_stopped() { None } else { tested()? };
        if self.watch.is_stopped() && !args.valid.is_empty() {
            left_out.push("validation recordings were not simulated");
            return Ok(None);
        }
        Ok(valid)
    }

    /// The recordings of a problem, simulated at its parameters with start values from their beginnings.
    pub(super) fn simulated(
        &self,
        held_out: &OutputErrorProblem<'_, Loaded>,
        paths: &[PathBuf],
    ) -> Result<Tested, CommandError> {
        let failed = |error| self.failed(error, paths);
        let mut recordings = held_out.recordings.to_vec();
        // Without a state nothing has to be estimated, and all rows count.
        if !self.compiled.dae.is_static() {
            let white = vec![NoiseCorrelation::NONE; held_out.noise.len()];
            for (recording, from) in recordings.iter_mut().zip(counts_from(held_out, &white)) {
                recording.counts_from = from;
            }
        }
        let before: Vec<f64> = recordings.iter().map(|recording| recording.counts_from).collect();
        let starts = fit_starts(held_out, &before).map_err(failed)?;
        let counted = OutputErrorProblem { recordings: &recordings, ..held_out.clone() };
        let evaluation = evaluate(&counted, held_out.p, &starts)
            .map_err(|error| failed(EstimateError::Start(error)))?;
        Ok(Tested { paths: paths.to_vec(), recordings, starts, evaluation })
    }

    /// A sentence for each validation recording that the fit knows.
    fn repeated(&self, args: &FitArgs) -> Vec<String> {
        let found = reservations::trained_on(&self.train, &self.valid);
        let repeated = args.valid.iter().zip(found).filter_map(|(path, of)| Some((path, of?)));
        let said = |(path, of): (&PathBuf, usize)| {
            let (path, trained) = (path.display(), args.data[of].display());
            format!("{path} is {trained} again, at least half of it: as a test it tells nothing")
        };
        repeated.map(said).collect()
    }

    /// Writes the folder of results.
    pub(super) fn save(
        &self,
        folder: &Path,
        args: &FitArgs,
        estimates: &[Estimate],
        json: &Value,
        more: Vec<(String, Vec<u8>)>,
    ) -> Result<(), CommandError> {
        let settings = &self.options_of_model.settings;
        let text = fitted_model::text(
            &self.compiled,
            &self.sources,
            settings,
            estimates,
            &args.model,
            folder,
        );
        let name = fitted_model::file_name(&args.model);
        let json = format!("{json:#}\n");
        let mut written =
            vec![(name, text.into_bytes()), (fitted_model::RESULT.to_owned(), json.into_bytes())];
        written.extend(more);
        let result = write_folder(folder, &Files { written, ..Files::default() });
        if let (Err(_), Some(journal)) = (&result, &self.journal) {
            journal.leave();
        }
        Ok(result?)
    }

    pub(super) fn failed(&self, error: EstimateError, paths: &[PathBuf]) -> CommandError {
        match error {
            EstimateError::NothingFree => CommandError::Usage(error.to_string()),
            EstimateError::NothingMeasured => {
                let outputs: Vec<String> = self
                    .system
                    .signature()
                    .outputs
                    .iter()
                    .map(|output| format!("`{} [{}]`", output.name, output.unit.symbol))
                    .collect();
                CommandError::Found(format!(
                    "{error}; the model's outputs are {}",
                    outputs.join(", ")
                ))
            }
            EstimateError::TooFewSamples { .. } => CommandError::Found(error.to_string()),
            EstimateError::Start(failed) => {
                let (what, instead) = match &failed.reason {
                    TrialFailure::NotLinearised(reason) => {
                        let rest = matches!(
                            **reason,
                            NotLinearised::NoSteadyState(_) | NotLinearised::Unstable { .. }
                        );
                        let run = if rest { "`--at T` takes a point of its run, and " } else { "" };
                        let itself = "`--estimator output-error` simulates the model itself";
                        ("linearised", format!("; {run}{itself}"))
                    }
                    TrialFailure::Simulation(_)
                    | TrialFailure::OutputNotFinite { .. }
                    | TrialFailure::NoSensitivity { .. } => ("simulated", String::new()),
                };
                let reason = named(&failed, paths);
                CommandError::Computation(format!("the model cannot be {what}: {reason}{instead}"))
            }
            EstimateError::Noise { .. }
            | EstimateError::NotPositive { .. }
            | EstimateError::NotFiltered(_)
            | EstimateError::Stopped => CommandError::Computation(error.to_string()),
        }
    }

    /// Why the fit ended in no minimum.
    fn unconverged(&self, fit: &Fit, paths: &[PathBuf]) -> String {
        let reason = match fit.termination {
            Termination::Blocked => self.blocked(fit, paths),
            Termination::Flat => flat(&fit.estimates),
            _ => format!("no minimum was reached in {} simulations", fit.evaluations),
        };
        format!("{reason}{}", self.few.as_reason())
    }

    /// The fit ended where simulations fail.
    fn blocked(&self, fit: &Fit, paths: &[PathBuf]) -> String {
        let parameters = &self.system.signature().parameters;
        let reached: Vec<String> = fit
            .estimates
            .iter()
            .filter_map(|estimate| {
                let Direction::Parameter(i) = estimate.of else { return None };
                let unit = &parameters[i].unit;
                let value = unit.from_si(estimate.value);
                Some(format!("`{}` = {value:.4e} {}", estimate.name, unit.symbol))
            })
            .collect();
        let reason = fit
            .last_failure
            .as_ref()
            .map_or_else(String::new, |failed| format!(": {}", named(failed, paths)));
        format!(
            "the fit went as far as {} and every better point that it tried cannot be \
             simulated{reason}",
            reached.join(", ")
        )
    }
}

/// The search ended on a plain among bounds.
pub(super) fn flat(estimates: &[Estimate]) -> String {
    let held = estimates.iter().filter(|estimate| estimate.at_bound.is_some());
    let held: Vec<String> = held.map(|estimate| format!("`{}`", estimate.name)).collect();
    let at_bounds = match held.len() {
        0 => String::new(),
        1 => format!("with {} at its bound, ", held[0]),
        _ => format!("with {} at their bounds, ", held.join(", ")),
    };
    format!(
        "{at_bounds}the outputs see nothing of the parameters where the search ended, so that nothing leads \
         to a minimum from there: other values to start from (`--set`), several of them (`--starts`) or \
         narrower bounds may"
    )
}

/// How much is estimated of so many recordings: each has start values of its own.
fn estimates(
    signature: &Signature,
    recordings: usize,
    is_free: impl Fn(&Direction) -> bool,
) -> usize {
    let free = signature.directions.iter().filter(|direction| is_free(direction));
    let each = free.map(|direction| match direction {
        Direction::Parameter(_) => 1,
        Direction::Start(_) => recordings,
    });
    each.sum()
}

/// A failed trial with the recording's file.
fn named(failed: &TrialFailed, paths: &[PathBuf]) -> String {
    match paths.get(failed.recording) {
        Some(path) => format!("{}: {}", path.display(), failed.reason),
        None => failed.to_string(),
    }
}

/// Which outputs `--outputs` names; all where it names none.
fn used_outputs(compilation: &mut Compilation, compiled: &Compiled, names: &[String]) -> Vec<bool> {
    let outputs = compiled.program.output_names();
    if names.is_empty() {
        return vec![true; outputs.len()];
    }
    let mut used = vec![false; outputs.len()];
    for name in names {
        let name = compilation.name("--outputs", name.trim());
        if let Some(i) = outputs.iter().position(|output| *output == name.text) {
            used[i] = true;
            continue;
        }
        let known: Vec<&str> = outputs.iter().map(String::as_str).collect();
        let help = meant(&name.text, &known);
        let message = format!("no output is called `{}`", name.text);
        let diagnostic = Diagnostic::new(Code::E201, name.span, message).help(help);
        compilation.diagnostics.error(diagnostic);
    }
    used
}

/// Each output of each recording, simulated and measured.
fn subjects(outcome: &Outcome<'_>, task: &Task, args: &FitArgs) -> Vec<Subject> {
    let names = recording::names(&[args.data.as_slice(), &args.valid].concat());
    let train = task.train.iter().zip(&outcome.train.observations);
    let tested = outcome.valid.iter().flat_map(|tested| &tested.evaluation.observations);
    let valid = task.valid.iter().zip(tested);
    let mut subjects = Vec::new();
    for (file, (recording, observations)) in names.iter().zip(train.chain(valid)) {
        for (i, output) in outcome.signature.outputs.iter().enumerate() {
            let Some(measured) = &recording.measured[i] else { continue };
            let unit = &output.unit;
            let in_unit = |value: f64| unit.from_si(value);
            let simulated = (0..recording.times.len()).map(|k| in_unit(observations.w(k)[i]));
            let line = |name: &str, values: Vec<f64>, measured| Line {
                name: Text::plain(name),
                times: recording.times.clone(),
                values,
                measured,
            };
            subjects.push(Subject {
                title: Text::name(&output.name).then(Text::plain(&format!(", {file}"))),
                unit: unit.symbol.to_string(),
                lines: vec![
                    line("fitted", simulated.collect(), false),
                    line("measured", measured.iter().copied().map(in_unit).collect(), true),
                ],
            });
        }
    }
    subjects
}
