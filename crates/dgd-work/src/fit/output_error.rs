//! Output-error estimation: each recording is simulated from its start, by the model or by a linear one.

use dgd_identify::OutputErrorProblem;
use dgd_plot::{MathText, SeriesMeaning};
use dgd_runtime::System;

use super::multi_start::Minima;
use super::page::traces::traces;
use super::refit::options_of_refit;
use super::report::bad_fit::BadFit;
use super::report::excess::ResidualExcess;
use super::report::information::InformationSources;
use super::report::intervals::Intervals;
use super::report::left_out::IncompleteFit;
use super::report::left_over::ModelErrorSpread;
use super::report::outcome::{OutputErrorReport, name_of};
use super::report::quality::FitQuality;
use super::report::standard::NoiseStandard;
use super::task::FitSetup;
use super::{EstimatorResult, FitFigure};
use crate::error::{UsageError, WorkError};
use crate::output::figure::{self, PanelLine, PanelSubject};
use crate::request::{FitRequest, LinearizeAt};
use crate::run::{recording, reservations};

pub(super) fn run(
    task: &FitSetup<'_>,
    request: &FitRequest,
    place: Option<LinearizeAt>,
) -> Result<EstimatorResult, WorkError> {
    let signature = task.system.signature();
    let problem = OutputErrorProblem { loss: request.search.loss, ..task.problem() };
    if request.intervals.bootstrap > 0
        && let Some(prior) = problem.priors.iter().find(|prior| prior.as_normal().is_none())
    {
        let (names, density) = (prior.names(signature), prior.density.name());
        return Err(UsageError::PriorNotDrawn { names, density }.into());
    }
    let fitted = |problem: &OutputErrorProblem<'_>| {
        let outcome = request.search.fit(problem, task.session.seed);
        outcome.map_err(|error| task.failed(error, &request.data))
    };
    let fits = fitted(&problem)?;
    let (problem, fits) = match options_of_refit(
        &problem.options,
        &request.solve,
        &fits.all,
        &task.train,
        task.session,
    ) {
        None => (problem, fits),
        Some(options) => {
            let problem = OutputErrorProblem { options, ..problem };
            let fits = fitted(&problem)?;
            (problem, fits)
        }
    };
    let (mut fit, minima) = (fits.all.fit.clone(), Minima::from_fits(fits));
    let is_converged = fit.termination.is_converged();
    // The result of the best values so far is computed even after a cancelled search.
    let result = problem.unwatched().as_fitted(&fit);
    let train = task.evaluated(&result, &fit, &request.data)?;
    let mut left_out =
        IncompleteFit::from_termination(fit.termination, || task.unconverged(&fit, &request.data));
    if let Some(minima) = &minima {
        minima.push_left_out(&mut left_out);
    }
    let valid = task.tested_unless_stopped(request, &mut left_out, || {
        task.tested(&problem.as_fitted(&fit), &fit, request)
    });
    let valid = match valid {
        // The result so far is kept.
        Err(error) if !is_converged => {
            left_out.push(format!("validation recordings were not simulated: {error}"));
            None
        }
        valid => valid?,
    };
    // Builds without the other estimators leave this out.
    let has_all = cfg!(feature = "estimators");
    let place = place.filter(|_| has_all);
    let linearised = place.map(|place| task.linearised(place, &result, &fit, &train, request));
    let intervals = Intervals::find(&request.intervals, &problem, &fit, task.session.seed)
        .map_err(|error| task.failed(error, &request.data))?;
    let recording_names = recording::names(&request.data);
    intervals.push_left_out(&mut left_out, |i| name_of(&fit.estimates[i], &recording_names));
    task.session.listener.ends();
    let information = (request.intervals.information && has_all)
        .then(|| InformationSources::find(&result, &fit, &train))
        .transpose()
        .map_err(|error| task.failed(error, &request.data))?;
    let mut reservations = reservations::of_recordings(&task.system, &fit.p, &task.train);
    reservations.extend(task.repeated(request));
    if task.few.hide_stds() {
        fit.forget_uncertainty();
    }
    let standard = NoiseStandard { noise: &problem.noise, fit: &fit };
    let quality = FitQuality::evaluate(signature, &task.train, &train, standard);
    let excess = ResidualExcess::all(signature, &task.train, &train, standard);
    let ended = is_converged && !task.few.hide_stds() && !task.session.listener.is_stopped();
    let left_over = ModelErrorSpread::find(&result, &fit, &quality, ended)
        .map_err(|error| task.failed(error, &request.data))?;
    let outcome = OutputErrorReport {
        signature,
        spelling: task.session.spelling(),
        variants: &task.compiled.model.variants,
        fit: &fit,
        data: &request.data,
        recording_names,
        recordings: &task.train,
        information,
        intervals,
        reservations,
        minima,
        few: &task.few,
        left_out: &left_out,
        left_over,
        quality,
        excess,
        quality_valid: valid.as_ref().map(|tested| {
            FitQuality::evaluate(signature, &tested.recordings, &tested.evaluation, standard)
        }),
        train,
        valid,
        linearised: linearised.transpose()?,
    };
    let mut figures = Vec::new();
    if request.figures {
        let figure = figure::panels(&subjects(&outcome, task, request));
        figures.push(FitFigure { of: None, figure });
        figures.extend(FitFigure::of_profiles(&outcome.intervals, &outcome));
    }
    let traces = traces(
        signature,
        [&request.data, &request.valid],
        [
            Some((&task.train, &outcome.train)),
            outcome.valid.as_ref().map(|tested| (&*tested.recordings, &tested.evaluation)),
        ],
        |recording, i, k, w| standard.standardise(recording, i, k, w),
    );
    let result = outcome.result(task.provenance.clone());
    let bad = BadFit::find(&result).filter(|_| is_converged);
    let headline = bad.map_or_else(String::new, |reason| format!("The fit is bad: {reason}.\n\n"));
    Ok(EstimatorResult {
        text: headline + &outcome.to_text(),
        result,
        figures,
        estimates: fit.estimates.clone(),
        traces,
        more: Vec::new(),
        left_out,
    })
}

/// Each output of each recording, simulated and measured.
fn subjects(
    outcome: &OutputErrorReport<'_>,
    task: &FitSetup<'_>,
    request: &FitRequest,
) -> Vec<PanelSubject> {
    let names = recording::names(&[request.data.as_slice(), &request.valid].concat());
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
            let line = |name: &str, values: Vec<f64>, meaning| PanelLine {
                name: MathText::plain(name),
                times: recording.times.clone(),
                values,
                meaning,
            };
            subjects.push(PanelSubject {
                title: MathText::name(&output.name).then(MathText::plain(&format!(", {file}"))),
                unit: unit.symbol.to_string(),
                lines: vec![
                    line("fitted", simulated.collect(), SeriesMeaning::Simulated),
                    line(
                        "measured",
                        measured.iter().copied().map(in_unit).collect(),
                        SeriesMeaning::Measured,
                    ),
                ],
            });
        }
    }
    subjects
}
