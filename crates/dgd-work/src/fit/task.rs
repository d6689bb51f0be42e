//! The set-up of a fit: the model, training and validation recordings, and the estimates.

use std::path::PathBuf;

use dgd_compiler::argument::Argument;
use dgd_compiler::diagnostics::{Code, Diagnostic};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{CompiledStages, SensitivityDirections};
use dgd_compiler::sentence;
use dgd_compiler::sentence::Sentence;
use dgd_compiler::source::SourceMap;
use dgd_data::files::journal::RunJournal;
use dgd_execute::LoadedSystem;
use dgd_identify::filter::FilterProblem;
use dgd_identify::journal::{Digest, JournalScope};
use dgd_identify::{
    EstimateError, Fit, NoiseCorrelation, NoiseSource, OutputErrorEvaluation, OutputErrorProblem,
    ParameterEstimate, Prior, Recording, StoppingRule, Termination, TrialFailed, counts_from,
    evaluate, fit_starts, nonlinear, operating_points,
};
use dgd_runtime::signature::PriorDensity;
use dgd_runtime::signature::number::short;
use dgd_runtime::{Direction, Options, Problem, Signature, System};

use crate::error::{ComputationError, Interruption, UnusableFile, UsageError, WorkError, meant};
use crate::fit::prediction_error;
use crate::fit::report::few_samples::FewSamples;
use crate::fit::report::left_out::IncompleteFit;
use crate::fit::report::linearised::LinearisedReport;
use crate::fit::report::outcome::ValidationResult;
use crate::fit::report::standard::NoiseStandard;
use crate::model::Compilation;
use crate::output::provenance::{self, DataFile, Provenance};
use crate::request::{EstimationApproach, Estimator, FitRequest, LinearizeAt};
use crate::run::recording::{self, TimeColumnRule};
use crate::run::{
    densities, executable, keeping, options, reservations, verify_memory_of_fit, with_method,
    with_method_per_sample, with_method_to_begin,
};
use crate::session::TaskContext;

/// Most evaluations of a static model; they are cheap.
const MOST_EVALUATIONS_OF_ROWS: usize = 5000;

/// The set-up of a fit.
pub(super) struct FitSetup<'s> {
    pub(super) compiled: CompiledStages,
    pub(super) sources: SourceMap,
    pub(super) options_of_model: ModelOptions,
    pub(super) system: LoadedSystem,
    /// Parameters from the model file and `--set`, SI.
    pub(super) p: Vec<f64>,
    pub(super) train: Vec<Recording>,
    pub(super) valid: Vec<Recording>,
    pub(super) noise: Vec<Option<NoiseSource>>,
    /// Outputs whose noise cannot be estimated.
    pub(super) few: FewSamples,
    /// Whether a file has rows without time.
    pub(super) clock: TimeColumnRule,
    options: Options,
    /// Receives progress, and may cancel.
    pub(super) session: TaskContext<'s>,
    /// Most simulations or evaluations, if set on the command line.
    pub(super) evaluations: Option<usize>,
    /// Simulations, profiles and refits, kept until all results are written.
    pub(super) journal: Option<RunJournal>,
    /// Digest of the model, if there is a journal.
    digest: Digest,
    pub(super) provenance: Provenance,
}

impl<'s> FitSetup<'s> {
    pub(super) fn load(
        request: &FitRequest,
        session: TaskContext<'s>,
    ) -> Result<FitSetup<'s>, WorkError> {
        let options = Options { watched: session.listener.watched(), ..options(&request.solve)? };
        let mut compilation = Compilation::new(session.files);
        let options_of_model = compilation.options(&request.choices.starting(&request.solve))?;
        let (free, fixed) = compilation.sought(&request.sought);
        let directions = if request.regression.estimator.is_filter() {
            SensitivityDirections::Tracked { free, fixed }
        } else {
            SensitivityDirections::Estimated { free, fixed }
        };
        let apply = &request.choices.apply;
        let compiled =
            compilation.compile_text(&request.model, apply, &options_of_model, &directions)?;
        let compiled = match compiled {
            Ok(compiled) => compiled,
            Err(reported) => return Err(compilation.fail(reported)),
        };
        let of_model = provenance::of_model(&compilation.sources);
        let used = used_outputs(&mut compilation, &compiled, &request.outputs);
        let mut read = |paths: &[PathBuf]| {
            let (renames, dae) = (&request.solve.rename, &compiled.dae);
            let compilation = &mut compilation;
            recording::RunRecording::read_all(
                paths,
                renames,
                dae,
                TimeColumnRule::Rows,
                compilation,
                session,
            )
        };
        // The second error contains the mistakes of both files.
        let (train, valid) = (read(&request.data), read(&request.valid));
        let (valid, train) = (valid?, train?);
        let paths = request.data.iter().chain(&request.valid);
        let files = paths.zip(train.iter().chain(&valid));
        let files = files.map(|(path, read)| DataFile::new(path, read.digest)).collect();
        let provenance = Provenance::new(session, Some(of_model), files);

        let mut clocks = train.iter().chain(&valid).map(|read| read.clock);
        let clock = if clocks.any(|clock| clock == TimeColumnRule::Rows) {
            TimeColumnRule::Rows
        } else {
            TimeColumnRule::Time
        };
        let system = executable(compiled.program.clone(), &request.solve)?;
        let signature = system.signature();
        let options = with_method(options, &request.solve, signature);
        let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
        let experiments = |read: Vec<recording::RunRecording>, paths: &[PathBuf]| {
            let read = read.iter().zip(paths);
            read.map(|(read, path)| read.experiment(&system, &p, path, &request.solve, &options))
                .collect::<Result<Vec<Recording>, WorkError>>()
        };
        let train = experiments(train, &request.data)?;
        let valid = experiments(valid, &request.valid)?;
        if request.regression.estimator.simulates() {
            let keeps =
                !request.regression.estimator.simulates_model() || request.intervals.information;
            verify_memory_of_fit("the fit", signature, &train, session.threads, keeps)?;
        }
        let options = match train.first() {
            None => options,
            Some(Recording { inputs, start, times, .. }) => {
                let problem = Problem { system: &system, p: &p, inputs, start };
                with_method_per_sample(options, &request.solve, &problem, times)?
            }
        };
        let runs =
            train.iter().chain(&valid).filter_map(|Recording { inputs, start, times, .. }| {
                Some((Problem { system: &system, p: &p, inputs, start }, *times.first()?))
            });
        let options = with_method_to_begin(options, &request.solve, runs, session);
        let mut noise =
            densities::of_outputs(signature, &compiled.model, request, &used, &train, &valid)?;
        let estimates = match request.regression.estimator.approach() {
            EstimationApproach::Simulation | EstimationApproach::LinearSimulation => {
                estimates(signature, train.len(), |_| true)
            }
            EstimationApproach::Filter => {
                let levels = FilterProblem::new(system.as_model(), &p).states().len()
                    + noise.iter().filter(|noise| **noise == Some(NoiseSource::Estimated)).count();
                let is_free = |direction: &Direction| {
                    prediction_error::is_free(&compiled, request, direction)
                };
                estimates(signature, train.len(), is_free) + levels
            }
            EstimationApproach::Regression(_) | EstimationApproach::RecursiveRegression => {
                estimates(signature, 0, |_| true)
            }
        };
        let few = FewSamples::find(&signature.outputs, &train, &mut noise, estimates);
        let sources = compilation.sources;
        session.spare(&sources)?;
        let of_program = || Digest::EMPTY.debug(&compiled.program);
        // Only the estimator that simulates takes long enough for a journal.
        let journal = if request.regression.estimator.simulates_model() {
            let input = || of_program().debug(&(&p, &train, &valid, &noise)).debug(&options);
            keeping::journal(&request.keep, input, session)?
        } else if request.keep.resume {
            return Err(UsageError::NeedsEstimator {
                given: vec![Argument::Resume.into()],
                estimators: &[Estimator::OutputError],
            }
            .into());
        } else {
            None
        };
        session.listener.begins(journal.is_some());
        let digest = if journal.is_some() { of_program() } else { Digest::EMPTY };
        Ok(FitSetup {
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
            session,
            evaluations: request.evaluations,
            journal,
            digest,
            provenance,
        })
    }

    /// Simulates all recordings with linear models from now on.
    pub(super) fn linearise(&mut self, place: LinearizeAt) {
        for recording in self.train.iter_mut().chain(&mut self.valid) {
            recording.linear = place.locate(&recording.inputs, &recording.times);
        }
    }

    /// The operating points of the linear models, and the nonlinear model with the same estimates.
    pub(super) fn linearised(
        &self,
        place: LinearizeAt,
        problem: &OutputErrorProblem<'_>,
        fit: &Fit,
        train: &OutputErrorEvaluation,
        request: &FitRequest,
    ) -> Result<LinearisedReport, WorkError> {
        let failed = |error| self.failed(EstimateError::Start(error), &request.data);
        let points = operating_points(problem, &fit.p, &fit.starts).map_err(failed)?;
        let model = nonlinear(problem, &fit.p, &fit.starts);
        if let Ok(model) = &model {
            let mut departures = request.data.iter().zip(&model.departures);
            if let Some((path, departure)) =
                departures.find_map(|(path, found)| Some((path, found.as_ref()?)))
            {
                let (path, departure) = (path.clone(), departure.clone());
                return Err(UnusableFile::LeavesMode { path, departure }.into());
            }
        }
        let model = model.map_err(|error| named(&error, &request.data));
        let standard = NoiseStandard { noise: &problem.noise, fit };
        let signature = self.system.signature();
        Ok(LinearisedReport::new(signature, place, points, &self.train, train, standard, model))
    }

    pub(super) fn problem(&self) -> OutputErrorProblem<'_> {
        let parameters = self.compiled.dae.parameters.iter().enumerate();
        let prior = |(parameter, declared): (usize, &dgd_compiler::model::Parameter)| {
            // A uniform prior acts as bounds.
            let density = declared.prior.filter(|of| !matches!(of, PriorDensity::Uniform { .. }));
            density.map(|density| Prior::for_parameter(parameter, density))
        };
        let smooth = |of: &dgd_compiler::model::Smoothness| Prior {
            weights: of.weights.iter().map(|(i, weight)| (*i as usize, *weight)).collect(),
            density: PriorDensity::Normal { mean: of.mean, std: of.std },
        };
        let smoothness = self.compiled.dae.smoothness.iter().map(smooth);
        let mut stopping = StoppingRule::default();
        if self.compiled.dae.is_static() {
            stopping.evaluations = MOST_EVALUATIONS_OF_ROWS;
        }
        stopping.evaluations = self.evaluations.unwrap_or(stopping.evaluations);
        OutputErrorProblem {
            stopping,
            noise: self.noise.clone(),
            priors: parameters.filter_map(prior).chain(smoothness).collect(),
            options: self.options,
            threads: self.session.threads,
            watch: self.session.listener,
            keeping: match &self.journal {
                Some(journal) => JournalScope { journal, of: self.digest },
                None => JournalScope::NOTHING,
            },
            ..OutputErrorProblem::new(self.system.as_model(), &self.p, &self.train)
        }
    }

    pub(super) fn evaluated(
        &self,
        problem: &OutputErrorProblem<'_>,
        fit: &Fit,
        paths: &[PathBuf],
    ) -> Result<OutputErrorEvaluation, WorkError> {
        evaluate(problem, &fit.p, &fit.starts)
            .map_err(|error| self.failed(EstimateError::Start(error), paths))
    }

    /// The validation recordings, simulated with initial values estimated from their beginnings.
    pub(super) fn tested(
        &self,
        problem: &OutputErrorProblem<'_>,
        fit: &Fit,
        request: &FitRequest,
    ) -> Result<Option<ValidationResult>, WorkError> {
        if self.valid.is_empty() {
            return Ok(None);
        }
        let of_fit = |(noise, sigma): (&Option<NoiseSource>, &Option<f64>)| {
            noise.filter(|noise| noise.is_likelihood()).or(sigma.map(NoiseSource::Known))
        };
        let noise = problem.noise.iter().zip(&fit.noise).map(of_fit).collect();
        let held_out =
            OutputErrorProblem { p: &fit.p, recordings: &self.valid, noise, ..problem.clone() };
        self.simulated(&held_out, &request.valid).map(Some)
    }

    /// Validation recordings, or a remark after Ctrl-C: before the fit of initial values has ended, the simulation says
    /// nothing about the model.
    pub(super) fn tested_unless_stopped<T>(
        &self,
        request: &FitRequest,
        left_out: &mut IncompleteFit,
        tested: impl FnOnce() -> Result<Option<T>, WorkError>,
    ) -> Result<Option<T>, WorkError> {
        let is_stopped = || self.session.listener.is_stopped();
        let tested = if is_stopped() { Ok(None) } else { tested() };
        // A cancelled simulation also returns an error.
        let valid = if is_stopped() { None } else { tested? };
        if is_stopped() && !request.valid.is_empty() {
            left_out.push("validation recordings were not simulated");
            return Ok(None);
        }
        Ok(valid)
    }

    /// The recordings of a problem, simulated at its parameters with initial values estimated from their beginnings.
    pub(super) fn simulated(
        &self,
        held_out: &OutputErrorProblem<'_>,
        paths: &[PathBuf],
    ) -> Result<ValidationResult, WorkError> {
        let failed = |error| self.failed(error, paths);
        let mut recordings = held_out.recordings.to_vec();
        // Without states nothing is estimated, and all rows count.
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
        Ok(ValidationResult { paths: paths.to_vec(), recordings, starts, evaluation })
    }

    /// A sentence for each validation recording that is also a training recording.
    pub(super) fn repeated(&self, request: &FitRequest) -> Vec<String> {
        let sources = reservations::trained_on(&self.train, &self.valid);
        let repeated = request.valid.iter().zip(sources).filter_map(|(path, of)| Some((path, of?)));
        let sentence = |(path, of): (&PathBuf, usize)| {
            let (path, trained) = (path.display(), request.data[of].display());
            format!("{path} is {trained} again, at least half of it, so it tests nothing")
        };
        repeated.map(sentence).collect()
    }

    pub(super) fn failed(&self, error: EstimateError, paths: &[PathBuf]) -> WorkError {
        match error {
            error if error.is_stopped() => Interruption::NoSimulation.into(),
            EstimateError::NothingFree | EstimateError::LossOfDensity { .. } => {
                UsageError::Estimate(error).into()
            }
            EstimateError::NothingMeasured => {
                let outputs: Vec<String> = self
                    .system
                    .signature()
                    .outputs
                    .iter()
                    .map(|output| format!("{} [{}]", output.name, output.unit.symbol))
                    .collect();
                UnusableFile::NothingMeasured { outputs }.into()
            }
            EstimateError::TooFewSamples { .. } => UnusableFile::Estimate(error).into(),
            EstimateError::Start(failed) => {
                let name = match paths.get(failed.recording) {
                    Some(path) => path.display().to_string(),
                    None => format!("recording {}", failed.recording + 1),
                };
                ComputationError::Start { name, reason: failed.reason }.into()
            }
            EstimateError::Reading { recording, output, t, wrong } => {
                let path = paths.get(recording).cloned();
                UnusableFile::Reading { path, output, t, wrong }.into()
            }
            EstimateError::Length(_)
            | EstimateError::Noise { .. }
            | EstimateError::NotPositive { .. }
            | EstimateError::NotFiltered(_)
            | EstimateError::Stopped => ComputationError::Estimate(error).into(),
        }
    }

    /// Why the fit did not converge.
    pub(super) fn unconverged(&self, fit: &Fit, paths: &[PathBuf]) -> String {
        let reason = match fit.termination {
            Termination::Blocked => self.blocked(fit, paths).into(),
            Termination::Flat => flat(&fit.estimates),
            Termination::Stalled => stalled(fit),
            _ => format!("no minimum was reached in {} simulations", fit.evaluations).into(),
        };
        let reason = reason.spelled(self.session.spelling());
        format!("{reason}{}", self.few.as_reason())
    }

    /// The sentence for a fit that ended where simulations fail.
    fn blocked(&self, fit: &Fit, paths: &[PathBuf]) -> String {
        let parameters = &self.system.signature().parameters;
        let reached: Vec<String> = fit
            .estimates
            .iter()
            .filter_map(|estimate| {
                let Direction::Parameter(i) = estimate.of else { return None };
                let unit = &parameters[i].unit;
                let value = unit.from_si(estimate.value);
                Some(format!("`{}` = {} {}", estimate.name, short(value, 5), unit.symbol))
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

/// The sentence for a search that ended where no step reduces the deviance although the gradient is not zero.
fn stalled(fit: &Fit) -> Sentence {
    if fit.samples_without_sensitivity > 0 {
        return sentence![
            format!(
                "the search stalled: no step makes the residuals smaller, and {} of {} samples have no defined \
                 sensitivities, so that their part in the slope is not known; several starts (",
                fit.samples_without_sensitivity, fit.samples
            ),
            Argument::Starts,
            ") may lead further"
        ];
    }
    sentence![
        "the search stalled: no step makes the residuals smaller, although their slope says that one should, even at ",
        Argument::Rtol.with(short(fit.options.rtol, 2)),
        "; where outputs have kinks, several starts (",
        Argument::Starts,
        ") may lead further"
    ]
}

/// The sentence for a search that ended on a plateau between bounds.
pub(super) fn flat(estimates: &[ParameterEstimate]) -> Sentence {
    let bound = estimates.iter().filter(|estimate| estimate.at_bound.is_some());
    let bound: Vec<String> = bound.map(|estimate| format!("`{}`", estimate.name)).collect();
    let at_bounds = match bound.len() {
        0 => String::new(),
        1 => format!("with {} at its bound, ", bound[0]),
        _ => format!("with {} at their bounds, ", bound.join(", ")),
    };
    sentence![
        format!(
            "{at_bounds}the outputs see nothing of the parameters where the search ended, so that nothing leads to a \
             minimum from there: other values to start from ("
        ),
        Argument::Set,
        "), several of them (",
        Argument::Starts,
        ") or narrower bounds may"
    ]
}

/// Number of estimates for these recordings; each has initial values of its own.
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

/// The requested outputs; all if none are named.
fn used_outputs(
    compilation: &mut Compilation<'_>,
    compiled: &CompiledStages,
    names: &[String],
) -> Vec<bool> {
    let outputs = &compiled.program.signature.outputs;
    if names.is_empty() {
        return vec![true; outputs.len()];
    }
    let mut used = vec![false; outputs.len()];
    for name in names {
        let name = compilation.name(Argument::Outputs, name.trim());
        if let Some(i) = outputs.iter().position(|output| output.name == name.text) {
            used[i] = true;
            continue;
        }
        let known: Vec<&str> = outputs.iter().map(|output| &*output.name).collect();
        let help = meant(&name.text, &known);
        let message = format!("no output is called `{}`", name.text);
        let diagnostic = Diagnostic::new(Code::UnknownName, name.span, message).help(help);
        compilation.diagnostics.error(diagnostic);
    }
    used
}
