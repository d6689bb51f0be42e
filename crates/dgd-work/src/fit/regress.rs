//! Estimation without simulation, by regression.

use std::path::PathBuf;

use dgd_compiler::argument::Argument;
use dgd_identify::regression::{
    FollowOptions, Forgetting, RegressionError, RegressionMethod, RegressionProblem, follow,
    regress, regression_profiles, traces,
};
use dgd_identify::{EstimateError, OutputErrorProblem, Recording};
use dgd_runtime::System;

use super::page::{self, traces::PageTrace};
use super::task::{FitSetup, flat};
use super::{EstimatorResult, FitFigure};
use crate::error::{ComputationError, UnusableFile, UsageError, WorkError};
use crate::fit::fitted_model::ESTIMATES;
use crate::fit::report::intervals::Intervals;
use crate::fit::report::left_out::IncompleteFit;
use crate::fit::report::outcome::ValidationResult;
use crate::fit::report::regression::RegressionOutcome;
use crate::request::{FitRequest, RegressionRequest};
use crate::run::recording::TimeColumnRule;

/// Estimates by this method or, without one, recursively.
pub(super) fn run(
    task: &FitSetup<'_>,
    request: &FitRequest,
    method: Option<RegressionMethod>,
) -> Result<EstimatorResult, WorkError> {
    let problem = regression_problem(task, request)?;
    let mut followed = None;
    let fit = match method {
        Some(method) => regress(&problem, method),
        None if task.clock == TimeColumnRule::Rows => Err(RegressionError::NotOverTime),
        None => follow(&problem, &follow_options(&request.regression)).map(|found| {
            let fit = found.fit.clone();
            followed = Some(found);
            fit
        }),
    };
    let mut fit = fit.map_err(|error| failed(task, request, error))?;
    if task.few.hide_stds() {
        fit.forget_uncertainty();
    }
    let fit = fit;
    let simulated =
        |recordings: &[Recording], paths: &[PathBuf]| simulated(task, &fit.p, recordings, paths);
    let mut left_out = if fit.is_stopped {
        IncompleteFit::stopped()
    } else if fit.is_converged {
        IncompleteFit::default()
    } else {
        let most = problem.stopping.evaluations;
        let words = if fit.is_flat {
            flat(&fit.estimates).spelled(task.session.spelling())
        } else {
            format!("no minimum was reached in {} evaluations of all rows", fit.evaluations)
        };
        IncompleteFit::unconverged(words, fit.evaluations >= most)
    };
    let profiled = request.intervals.profiled(&fit.estimates);
    let profiles = if profiled.is_empty() || !fit.is_converged {
        Vec::new()
    } else {
        let profiles = regression_profiles(&problem, &fit, &profiled);
        profiles.map_err(|error| failed(task, request, error))?
    };
    let intervals = Intervals::of_profiles(profiles, profiled);
    intervals.push_left_out(&mut left_out, |i| fit.estimates[i].name.clone());
    // This simulation fits initial values.
    let mut train = (!task.session.listener.is_stopped())
        .then(|| simulated(&task.train, &request.data))
        .flatten();
    if task.session.listener.is_stopped() {
        train = None;
        left_out.push("the recordings were not simulated with what was found");
    }
    let valid = task.tested_unless_stopped(request, &mut left_out, || {
        Ok(simulated(&task.valid, &request.valid))
    })?;
    task.session.listener.ends();
    let outcome = RegressionOutcome {
        estimator: request.regression.estimator,
        signature: task.system.signature(),
        variants: &task.compiled.model.variants,
        fit: &fit,
        followed: followed.as_ref(),
        train,
        valid,
        intervals,
        left_out: &left_out,
        few: &task.few,
    };
    let mut figures = Vec::new();
    if request.figures {
        let traces = traces(&problem, &fit).map_err(|error| failed(task, request, error))?;
        let figure = outcome.figure(&traces, &request.data, task.clock == TimeColumnRule::Rows);
        figures.push(FitFigure { of: None, figure });
        figures.extend(FitFigure::of_profiles(&outcome.intervals, &outcome));
    }
    let estimates = outcome.estimates_csv();
    let more = estimates.map(|csv| (ESTIMATES.to_owned(), csv.into_bytes()));
    let traces = simulated_traces(task, request, [&outcome.train, &outcome.valid]);
    Ok(EstimatorResult {
        result: outcome.result(task.provenance.clone()),
        text: outcome.to_text(),
        figures,
        estimates: fit.estimates.clone(),
        traces,
        more: more.into_iter().collect(),
        left_out,
    })
}

/// The recordings that could be simulated with the estimates.
fn simulated_traces(
    task: &FitSetup<'_>,
    request: &FitRequest,
    of: [&Option<Result<ValidationResult, String>>; 2],
) -> Vec<PageTrace> {
    let evaluated = of.map(|of| match of {
        Some(Ok(tested)) => Some((&*tested.recordings, &tested.evaluation)),
        Some(Err(_)) | None => None,
    });
    page::traces::traces(
        task.system.signature(),
        [&request.data, &request.valid],
        evaluated,
        |_, _, _, _| None,
    )
}

fn follow_options(request: &RegressionRequest) -> FollowOptions {
    let limit = request.most_variance.unwrap_or(f64::INFINITY);
    FollowOptions {
        time_constants: request.filter.clone(),
        start_variance: request.start_variance,
        forgetting: Forgetting {
            rate: request.forgetting,
            limit,
            normalisation: request.normalise,
        },
    }
}

fn regression_problem<'a>(
    task: &'a FitSetup<'_>,
    request: &FitRequest,
) -> Result<RegressionProblem<'a>, WorkError> {
    let defaults = RegressionProblem::new(task.system.as_model(), &task.p, &task.train);
    let (mut stopping, mut simplex) = (defaults.stopping, defaults.simplex);
    if let Some(most) = task.evaluations {
        (stopping.evaluations, simplex.evaluations) = (most, most);
    }
    Ok(RegressionProblem {
        stopping,
        simplex,
        noise: task.noise.clone(),
        priors: task.problem().priors,
        half_width: request.regression.smoothing,
        steady: request
            .regression
            .steady
            .iter()
            .map(|text| steady(task, text))
            .collect::<Result<_, WorkError>>()?,
        watch: task.session.listener,
        ..defaults
    })
}

/// Reads `STATE=RATE`: the index of the unknown, and its rate in SI.
fn steady(task: &FitSetup<'_>, text: &str) -> Result<(usize, f64), WorkError> {
    let unknowns = &task.system.signature().unknowns;
    let Some((name, rate)) = text.split_once('=') else {
        return Err(UsageError::form(Argument::Steady, text, "STATE=RATE", "h=0.01").into());
    };
    let names: Vec<String> = unknowns.iter().map(|unknown| unknown.name.to_string()).collect();
    let Some(i) = names.iter().position(|known| known == name.trim()) else {
        let unknown = UsageError::Unknown {
            given: Some(Argument::Steady.with(text)),
            kind: "state",
            name: name.trim().to_owned(),
            known: names,
        };
        return Err(unknown.into());
    };
    match rate.trim().parse::<f64>() {
        Ok(rate) if rate > 0.0 && rate.is_finite() => Ok((i, rate * unknowns.unit(i).factor.abs())),
        _ => Err(UsageError::Rate {
            given: Argument::Steady.with(text),
            unit: unknowns.unit(i).symbol.to_string(),
        }
        .into()),
    }
}

/// The model simulated with the estimates; `None` without recordings, or the reason why it cannot be simulated.
fn simulated(
    task: &FitSetup<'_>,
    p: &[f64],
    recordings: &[Recording],
    paths: &[PathBuf],
) -> Option<Result<ValidationResult, String>> {
    if recordings.is_empty() {
        return None;
    }
    let problem = OutputErrorProblem { p, recordings, ..task.problem() };
    Some(task.simulated(&problem, paths).map_err(|error| error.to_string()))
}

fn failed(task: &FitSetup<'_>, request: &FitRequest, error: RegressionError) -> WorkError {
    match error {
        RegressionError::NothingFree
        | RegressionError::Prior { .. }
        | RegressionError::Filter
        | RegressionError::StartVariance
        | RegressionError::Forgetting => UsageError::Regression(error).into(),
        RegressionError::NothingMeasured => {
            task.failed(EstimateError::NothingMeasured, &request.data)
        }
        RegressionError::NotRead { .. }
        | RegressionError::NotReconstructed { .. }
        | RegressionError::TooFewRows { .. }
        | RegressionError::NotLinear { .. }
        | RegressionError::ModesAndPast { .. }
        | RegressionError::FreeDelay { .. }
        | RegressionError::NeverTogether { .. }
        | RegressionError::NothingSteady { .. }
        | RegressionError::NotOverTime => UnusableFile::Regression(error).into(),
        RegressionError::NotFinite { row, recording, t } => {
            let path = request.data.get(recording).cloned();
            ComputationError::RowNotFinite { path, row, t }.into()
        }
        RegressionError::Inputs(_)
        | RegressionError::Variables(_)
        | RegressionError::ModesDoNotSettle { .. } => ComputationError::Regression(error).into(),
    }
}
