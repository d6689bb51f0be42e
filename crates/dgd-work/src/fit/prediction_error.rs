//! Prediction-error estimation: maximum likelihood of the innovations, with process noise.

use std::fmt::Write as _;
use std::path::PathBuf;

use dgd_compiler::model::ProcessNoise;
use dgd_compiler::pipeline::CompiledStages;
use dgd_identify::filter::{
    FilterProblem, LevelEstimate, NoiseLevelSource, PredictionError, PredictionErrorProblem,
    TrackedRow, prediction_error, prediction_error_profiles, predictions,
};
use dgd_identify::{
    BoundReached, EstimateError, NoiseSource, OutputErrorEvaluation, OutputErrorProblem,
    ParameterEstimate, Recording, Starts, StoppingRule, Termination, evaluate,
};
use dgd_plot::{Figure, MathText, Panel, SeriesMeaning};
use dgd_runtime::{Direction, Options, Output, Signature, System, Unit};

use super::page::traces::traces;
use super::task::{FitSetup, flat};
use super::{EstimatorResult, FitFigure};
use crate::error::WorkError;
use crate::fit::report::intervals::{IntervalEstimates, Intervals};
use crate::fit::report::left_out::IncompleteFit;
use crate::fit::report::outcome::{ValidationResult, digits_of, entry, name_of, rms_of, unit_of};
use crate::output::figure::{self, PanelLine, PanelSubject};
use crate::output::table::{push_table, significant};
use crate::request::FitRequest;
use crate::result::fit::{
    BoundEntry, EstimateEntry, FitDocument, NoiseEntry, OutputEntry, RecordingValues,
    UndeterminedTerm,
};
use crate::run::{densities, recording};

/// Tolerance that differences of innovations need.
const TIGHT: f64 = 1e-8;

const MINUTE: f64 = 60.0;

pub(super) fn run(task: &FitSetup<'_>, request: &FitRequest) -> Result<EstimatorResult, WorkError> {
    let problem = problem(task, request);
    let mut fit = prediction_error(&problem).map_err(|error| task.failed(error, &request.data))?;
    if task.few.hide_stds() {
        fit.forget_uncertainty();
    }
    let fit = fit;
    let reason = || match fit.termination {
        Termination::Flat => flat(&fit.estimates).spelled(task.session.spelling()),
        _ => format!(
            "no maximum of the likelihood was reached in {} evaluations ({}){}",
            fit.evaluations,
            fit.termination.name(),
            task.few.as_reason()
        ),
    };
    let of_simulation =
        OutputErrorProblem { p: &fit.p, free: problem.free.clone(), ..task.problem() };
    let train = evaluate(&of_simulation.unwatched(), &fit.p, &fit.starts)
        .map_err(|error| task.failed(EstimateError::Start(error), &request.data))?;
    let held_out = OutputErrorProblem {
        recordings: &task.valid,
        noise: fit
            .noise
            .iter()
            .map(|noise| noise.map(|noise| NoiseSource::Known(noise.value)))
            .collect(),
        ..of_simulation
    };
    let is_converged = fit.termination.is_converged();
    let mut left_out = IncompleteFit::from_termination(fit.termination, reason);
    let profiled = request.intervals.profiled(&fit.estimates);
    let profiles = if profiled.is_empty() || !is_converged {
        Vec::new()
    } else {
        let profiles = prediction_error_profiles(&problem, &fit, &profiled);
        profiles.map_err(|error| task.failed(error, &request.data))?
    };
    let intervals = Intervals::of_profiles(profiles, profiled);
    let recording_names = recording::names(&request.data);
    let name = |i: usize| name_of(&fit.estimates[i], &recording_names);
    intervals.push_left_out(&mut left_out, name);
    let valid = task.tested_unless_stopped(request, &mut left_out, || {
        let is_asked = !task.valid.is_empty();
        is_asked.then(|| task.simulated(&held_out, &request.valid)).transpose()
    });
    let valid = match valid {
        // The result so far is kept.
        Err(error) if !is_converged => {
            left_out.push(format!("validation recordings were not simulated: {error}"));
            None
        }
        valid => valid?,
    };
    task.session.listener.ends();
    let outcome = PredictionErrorReport {
        task,
        request,
        found: &fit,
        recording_names,
        train,
        valid,
        intervals,
        left_out: &left_out,
    };
    let mut figures = Vec::new();
    if request.figures {
        figures.push(FitFigure { of: None, figure: outcome.figure(&problem.unwatched())? });
        figures.extend(FitFigure::of_profiles(&outcome.intervals, &outcome));
    }
    let traces = traces(
        task.system.signature(),
        [&request.data, &request.valid],
        [
            Some((&task.train, &outcome.train)),
            outcome.valid.as_ref().map(|tested| (&*tested.recordings, &tested.evaluation)),
        ],
        |_, _, _, _| None,
    );
    Ok(EstimatorResult {
        result: outcome.result(),
        text: outcome.to_text(),
        figures,
        estimates: fit.estimates.clone(),
        traces,
        more: Vec::new(),
        left_out,
    })
}

fn problem<'a>(task: &'a FitSetup<'_>, request: &FitRequest) -> PredictionErrorProblem<'a> {
    let defaults = PredictionErrorProblem::new(task.system.as_model(), &task.p, &task.train);
    let is_free = |direction: &Direction| is_free(&task.compiled, request, direction);
    let output_error = task.problem();
    let refused = || unreachable!("refused when the task was loaded");
    let level = |noise: &Option<NoiseSource>| {
        noise.map(|noise| match noise {
            NoiseSource::Known(sigma) => NoiseLevelSource::Known(sigma),
            NoiseSource::Estimated => NoiseLevelSource::Estimated,
            NoiseSource::Density(density) => {
                let parameter = densities::parameter_of(&task.compiled.model, density);
                parameter.map_or_else(refused, NoiseLevelSource::Parameter)
            }
            NoiseSource::Recorded | NoiseSource::Stabilised(..) => refused(),
        })
    };
    let Options { rtol, atol, .. } = output_error.options;
    PredictionErrorProblem {
        free: task.system.signature().directions.iter().map(is_free).collect(),
        rates: rates(task),
        noise: output_error.noise.iter().map(level).collect(),
        options: Options { rtol: rtol.min(TIGHT), atol: atol.min(TIGHT), ..output_error.options },
        stopping: StoppingRule {
            evaluations: task.evaluations.unwrap_or(defaults.stopping.evaluations),
            ..defaults.stopping
        },
        priors: output_error.priors,
        threads: output_error.threads,
        watch: output_error.watch,
        ..defaults
    }
}

/// Process noise of each state: as declared, and estimated otherwise.
fn rates(task: &FitSetup<'_>) -> Vec<NoiseLevelSource> {
    let system = task.system.as_model();
    let level = |i: usize| {
        let name = task.system.signature().unknowns.name(i);
        match task.compiled.model.process_noise(&name)? {
            ProcessNoise::Known(rate) => Some(NoiseLevelSource::Known(rate)),
            ProcessNoise::Parameter(i) => Some(NoiseLevelSource::Parameter(i as usize)),
        }
    };
    let states = FilterProblem::new(system, &task.p).states().into_iter();
    states.map(|i| level(i).unwrap_or(NoiseLevelSource::Estimated)).collect()
}

/// Whether a direction is estimated. All states have one; some initial values are given.
pub(super) fn is_free(
    compiled: &CompiledStages,
    request: &FitRequest,
    direction: &Direction,
) -> bool {
    let dae = &compiled.dae;
    match direction {
        Direction::Parameter(_) => true,
        Direction::Start(i) => {
            let named =
                |names: &[String]| names.iter().any(|name| dae.positions(name.trim()).contains(i));
            // Elements of arrays are estimated only on request.
            let is_fixed = dae.unknowns.get(*i).is_none_or(|unknown| unknown.fixed);
            let (free, fixed) = (named(&request.sought.free), named(&request.sought.fix));
            // An unknown that is algebraic at the start follows from the others.
            dae.is_differential(*i) && !fixed && (free || !is_fixed)
        }
    }
}

/// The result, as text and JSON.
struct PredictionErrorReport<'a> {
    task: &'a FitSetup<'a>,
    request: &'a FitRequest,
    found: &'a PredictionError,
    /// Names of the recordings.
    recording_names: Vec<String>,
    train: OutputErrorEvaluation,
    valid: Option<ValidationResult>,
    intervals: Intervals,
    left_out: &'a IncompleteFit,
}

impl IntervalEstimates for PredictionErrorReport<'_> {
    fn signature(&self) -> &Signature {
        self.task.system.signature()
    }

    fn estimates(&self) -> &[ParameterEstimate] {
        &self.found.estimates
    }

    fn name(&self, i: usize) -> String {
        name_of(&self.found.estimates[i], &self.recording_names)
    }
}

impl PredictionErrorReport<'_> {
    /// Positions of the states.
    fn states(&self) -> Vec<usize> {
        FilterProblem::new(self.task.system.as_model(), &self.task.p).states()
    }

    /// Measured values and one-step predictions, and the innovations with the band of ± 2 of the filter's standard
    /// deviations; training recordings first, then validation recordings.
    fn figure(&self, problem: &PredictionErrorProblem<'_>) -> Result<Figure, WorkError> {
        let Self { task, request, found, .. } = self;
        let (mut subjects, mut panels) = (Vec::new(), Vec::new());
        let mut draw = |problem: &PredictionErrorProblem<'_>,
                        starts: &[Starts],
                        paths: &[PathBuf]|
         -> Result<(), WorkError> {
            let rows = predictions(problem, found, starts);
            let rows = rows.map_err(|error| task.failed(error, paths))?;
            let names = recording::names(paths);
            for ((rows, recording), name) in rows.iter().zip(problem.recordings).zip(&names) {
                for (i, output) in self.signature().outputs.iter().enumerate() {
                    if found.noise[i].is_none() || recording.measured[i].is_none() {
                        continue;
                    }
                    let (subject, panel) = innovations(output, i, recording, rows, name);
                    subjects.push(subject);
                    panels.push(panel);
                }
            }
            Ok(())
        };
        draw(problem, &found.starts, &request.data)?;
        if let Some(valid) = &self.valid {
            let held_out =
                PredictionErrorProblem { recordings: &valid.recordings, ..problem.clone() };
            draw(&held_out, &valid.starts, &request.valid)?;
        }
        Ok(figure::beside(&subjects, panels, MathText::plain("Time").with_unit("s")))
    }

    fn rms(&self, evaluation: &OutputErrorEvaluation, output: usize) -> Option<f64> {
        rms_of(evaluation, output, &self.signature().outputs[output].unit)
    }

    fn result(&self) -> FitDocument {
        let (signature, found, task) = (self.signature(), self.found, self.task);
        let of_parameter =
            |estimate: &&ParameterEstimate| matches!(estimate.of, Direction::Parameter(_));
        let parameters = found.estimates.iter().filter(of_parameter);
        let starts = self.request.data.iter().enumerate().map(|(r, path)| {
            let starts = found.estimates.iter().filter(|estimate| estimate.recording == Some(r));
            let values = starts.map(|estimate| entry(signature, estimate)).collect();
            RecordingValues { data: path.display().to_string(), values }
        });
        let output = |(i, output): (usize, &Output)| {
            let noise = found.noise[i].filter(|_| !task.few.hide_noise(&output.name));
            let noise = noise.map(|level| level_entry(level, &output.unit, 1.0));
            let entry = OutputEntry {
                unit: output.unit.symbol.to_string(),
                fitted: None,
                noise: noise.map(|level| NoiseEntry::Estimate(Box::new(level))),
                over_declared_noise: None,
                light_samples: None,
                rms_train: self.rms(&self.train, i),
                rms_valid: self.valid.as_ref().and_then(|v| self.rms(&v.evaluation, i)),
                quality: None,
            };
            (output.name.to_string(), entry)
        };
        let process = self.states().into_iter().zip(&found.rates).map(|(i, rate)| {
            let entry = level_entry(*rate, signature.unknowns.unit(i), MINUTE.sqrt());
            (signature.unknowns.name(i).to_string(), entry)
        });
        FitDocument {
            model: signature.name.to_string(),
            estimator: Some(crate::request::Estimator::PredictionError.name().to_owned()),
            variants: None,
            parameters: parameters.map(|estimate| entry(signature, estimate)).collect(),
            fixed: None,
            outputs: signature.outputs.iter().enumerate().map(output).collect(),
            starts: Some(starts.collect()),
            starts_valid: None,
            counts_from: self.valid.as_ref().map(ValidationResult::counts_from),
            rows: None,
            process_noise_in_a_minute: Some(process.collect()),
            names: None,
            covariance: None,
            correlation: None,
            undetermined: self
                .undetermined_names()
                .into_iter()
                .map(|names| names.into_iter().map(UndeterminedTerm::Name).collect())
                .collect(),
            regression: None,
            few_samples: task.few.entries(),
            reservations: None,
            samples: found.samples,
            simulation: None,
            cost: None,
            deviance: Some(found.deviance),
            iterations: found.iterations,
            evaluations: found.evaluations,
            termination: Some(found.termination.name().to_owned()),
            converged: found.termination.is_converged(),
            status: self.left_out.status(),
            left_out: self.left_out.all().to_vec(),
            profiles: self.intervals.profile_entries(self),
            bootstrap: None,
            multi_start: None,
            linearised: None,
            information: None,
            operating_points: None,
            provenance: task.provenance.clone(),
        }
    }

    /// Names of estimates that can change together without changing the likelihood.
    fn undetermined_names(&self) -> Vec<Vec<String>> {
        let n = self.found.estimates.len();
        let sought_rates = (self.states().into_iter().zip(rates(self.task)))
            .filter(|(_, level)| *level == NoiseLevelSource::Estimated)
            .map(|(i, _)| format!("process noise of {}", self.signature().unknowns.name(i)));
        let outputs = self.signature().outputs.iter().zip(&self.task.noise);
        let sought_noise = outputs
            .filter(|(_, noise)| **noise == Some(NoiseSource::Estimated))
            .map(|(output, _)| format!("noise of {}", output.name));
        let levels: Vec<String> = sought_rates.chain(sought_noise).collect();
        let name = |i: usize| match i.checked_sub(n) {
            None => self.name(i),
            Some(level) => levels[level].clone(),
        };
        let combinations = self.found.undetermined.iter();
        combinations.map(|of| of.terms.iter().map(|term| name(term.estimate)).collect()).collect()
    }

    fn to_text(&self) -> String {
        let (signature, found) = (self.signature(), self.found);
        let mut text = format!(
            "{}: {} samples, prediction error, {} iterations\n\n",
            signature.name, found.samples, found.iterations
        );
        let cells = |row: [&str; 4]| row.map(str::to_owned);
        let mut rows = vec![cells(["estimate", "value", "std", "unit"])];
        for (i, estimate) in found.estimates.iter().enumerate() {
            let unit = unit_of(signature, estimate);
            let value = unit.from_si(estimate.value);
            let std = estimate.std.map(|std| std / unit.factor.abs());
            let shown = match (std, estimate.at_bound) {
                (_, Some(reached)) => format!("at its {} bound", BoundEntry::from(reached).name()),
                (Some(std), None) => significant(std, 2),
                (None, None) if self.task.few.hide_stds() => "-".to_owned(),
                (None, None) => "not determined".to_owned(),
            };
            rows.push([self.name(i), digits_of(value, std), shown, unit.symbol.to_string()]);
        }
        push_table(&mut text, &rows);
        text.push('\n');
        let mut rows = vec![cells(["noise", "value", "std", "unit"])];
        for (i, rate) in self.states().into_iter().zip(&found.rates) {
            let name = format!("{} strays in a minute", signature.unknowns.name(i));
            rows.push(level_row(name, *rate, signature.unknowns.unit(i), MINUTE.sqrt()));
        }
        for (output, noise) in signature.outputs.iter().zip(&found.noise) {
            if let Some(noise) = noise
                && !self.task.few.hide_noise(&output.name)
            {
                rows.push(level_row(output.name.to_string(), *noise, &output.unit, 1.0));
            }
        }
        push_table(&mut text, &rows);
        text.push('\n');
        let mut rows = vec![cells(["simulated", "rms, train", "rms, valid", "unit"])];
        for (i, output) in signature.outputs.iter().enumerate() {
            let number = |value: Option<f64>| value.map_or("-".to_owned(), |v| significant(v, 4));
            let valid = self.valid.as_ref().and_then(|valid| self.rms(&valid.evaluation, i));
            let train = self.rms(&self.train, i);
            let name = output.name.to_string();
            rows.push([name, number(train), number(valid), output.unit.symbol.to_string()]);
        }
        push_table(&mut text, &rows);
        self.intervals.push_text(&mut text, self);
        self.left_out.push_text(&mut text);
        self.task.few.push_text(&mut text);
        for together in self.undetermined_names() {
            // Writing to a string cannot fail.
            let _ =
                writeln!(text, "the data does not determine {}", together.join(" together with "));
        }
        text
    }
}

/// An output of one recording: measured and predicted, and its innovations.
fn innovations(
    output: &Output,
    i: usize,
    recording: &Recording,
    rows: &[TrackedRow],
    file: &str,
) -> (PanelSubject, Panel) {
    let unit = &output.unit;
    let Unit { symbol, factor, .. } = unit;
    let samples = recording.measured[i].as_deref().unwrap_or_default();
    let measured = samples.iter().map(|value| unit.from_si(*value)).collect();
    // Of two rows at one time, the second has the innovation.
    let positions = (0..recording.times.len())
        .filter(|k| recording.times.get(k + 1) != Some(&recording.times[*k]));
    let of_row = |(k, row): (usize, &TrackedRow)| match row.innovations[i] {
        Some(innovation) => [
            unit.from_si(samples[k] - innovation.value),
            innovation.value / factor,
            innovation.std / factor.abs(),
        ],
        None => [f64::NAN; 3],
    };
    let values: Vec<[f64; 3]> = positions.zip(rows).map(of_row).collect();
    let times: Vec<f64> = rows.iter().map(|row| row.t).collect();
    let column = |of: usize| values.iter().map(|row| row[of]).collect::<Vec<f64>>();
    let title = |what: &str| {
        MathText::plain(what)
            .then(MathText::name(&output.name))
            .then(MathText::plain(&format!(", {file}")))
    };
    let subject = PanelSubject {
        title: title(""),
        unit: symbol.to_string(),
        lines: vec![
            PanelLine {
                name: MathText::plain("one row ahead"),
                times: times.clone(),
                values: column(0),
                meaning: SeriesMeaning::Simulated,
            },
            PanelLine {
                name: MathText::plain("measured"),
                times: recording.times.clone(),
                values: measured,
                meaning: SeriesMeaning::Measured,
            },
        ],
    };
    let panel = figure::differences(title("innovation of "), symbol, &times, column(1), &column(2));
    (subject, panel)
}

/// A noise level multiplied by `scale`, for programs.
fn level_entry(level: LevelEstimate, unit: &Unit, scale: f64) -> EstimateEntry {
    let value = level.value * scale / unit.factor.abs();
    EstimateEntry {
        value: Some(value),
        unit: unit.symbol.to_string(),
        std: level.log_std.map(|std| std * value),
        at_bound: level.at_bound.map(BoundEntry::from),
        std_model: None,
        regression: None,
    }
}

fn level_row(name: String, level: LevelEstimate, unit: &Unit, scale: f64) -> [String; 4] {
    let value = level.value * scale / unit.factor.abs();
    let std = match (level.log_std, level.at_bound) {
        (Some(std), _) => significant(std * value, 2),
        (None, Some(BoundReached::Lower)) => "none is needed".to_owned(),
        (None, Some(BoundReached::Upper)) => "at its upper bound".to_owned(),
        (None, None) => "-".to_owned(),
    };
    [name, significant(value, 3), std, unit.symbol.to_string()]
}
