//! `dgd fit` by the estimators that do not simulate.

use std::path::PathBuf;

use dgd_execute::Loaded;
use dgd_runtime::System;
use dgd_runtime::identify::regression::{
    FollowOptions, Forgetting, Normalisation, RegressionError, RegressionMethod, RegressionProblem,
    follow, regress, regression_profiles, traces,
};
use dgd_runtime::identify::{EstimateError, OutputErrorProblem, Recording, Watch};

use crate::args::FitArgs;
use crate::command::fit::{Task, flat};
use crate::console::{Console, print};
use crate::estimator::{Estimator, Normalise, RegressionArgs};
use crate::failure::{CommandError, meant};
use crate::figure;
use crate::fit_report::Tested;
use crate::fitted_model::ESTIMATES;
use crate::intervals::Intervals;
use crate::left_out::LeftOut;
use crate::recording::Clock;
use crate::regression_report::RegressionOutcome;

pub(super) fn run(task: &Task, args: &FitArgs, console: Console<'_>) -> Result<(), CommandError> {
    let problem = regression_problem(task, args, console)?;
    let by = |method| regress(&problem, method);
    let mut followed = None;
    let fit = match args.regression.estimator {
        Estimator::LeastSquares => by(RegressionMethod::LeastSquares),
        Estimator::Bounded => by(RegressionMethod::Bounded),
        Estimator::NelderMead => by(RegressionMethod::NelderMead),
        Estimator::Separable
        | Estimator::OutputError
        | Estimator::Linearised
        | Estimator::PredictionError => by(RegressionMethod::VariableProjection),
        Estimator::Recursive if task.clock == Clock::Rows => Err(RegressionError::NotOverTime),
        Estimator::Recursive => follow(&problem, &follow_options(&args.regression)).map(|found| {
            let fit = found.fit.clone();
            followed = Some(found);
            fit
        }),
    };
    let mut fit = fit.map_err(|error| failed(task, args, error))?;
    if task.few.hide_stds() {
        fit.forget_uncertainty();
    }
    let fit = fit;
    let simulated = |recordings: &[Recording], paths: &[PathBuf]| {
        simulated(task, console, &fit.p, recordings, paths)
    };
    let mut left_out = if fit.is_stopped {
        LeftOut::stopped()
    } else if fit.is_converged {
        LeftOut::default()
    } else {
        let most = problem.stopping.evaluations;
        let words = if fit.is_flat {
            flat(&fit.estimates)
        } else {
            format!("no minimum was reached in {} evaluations of all rows", fit.evaluations)
        };
        LeftOut::unconverged(words, fit.evaluations >= most)
    };
    let profiled = args.intervals.profiled(&fit.estimates);
    let profiles = if profiled.is_empty() || !fit.is_converged {
        Vec::new()
    } else {
        let profiles = regression_profiles(&problem, &fit, &profiled);
        profiles.map_err(|error| failed(task, args, error))?
    };
    let intervals = Intervals::of_profiles(profiles, profiled);
    intervals.push_left_out(&mut left_out, |i| fit.estimates[i].name.clone());
    // Start values are fitted for it.
    let mut train =
        (!task.watch.is_stopped()).then(|| simulated(&task.train, &args.data)).flatten();
    if task.watch.is_stopped() {
        train = None;
        left_out.push("the recordings were not simulated with what was found");
    }
    let valid = task
        .tested_unless_stopped(args, &mut left_out, || Ok(simulated(&task.valid, &args.valid)))?;
    task.watch.write();
    let outcome = RegressionOutcome {
        estimator: args.regression.estimator,
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
    let json = outcome.to_json();
    if let Some(folder) = console.out() {
        let estimates = outcome.estimates_csv();
        let more = estimates.map(|csv| (ESTIMATES.to_owned(), csv.into_bytes()));
        task.save(folder, args, &fit.estimates, &json, more.into_iter().collect())?;
        console.remark(&format!("wrote {}", folder.display()));
    }
    if !args.solve.plot.is_empty() {
        let traces = traces(&problem, &fit).map_err(|error| failed(task, args, error))?;
        let figure = outcome.figure(&traces, &args.data, task.clock == Clock::Rows);
        for path in &args.solve.plot {
            figure::save(&figure, path, console)?;
            for (path, figure) in outcome.intervals.figures(&outcome, path) {
                figure::save(&figure, &path, console)?;
            }
        }
    }
    if console.is_json() { print(&format!("{json:#}\n")) } else { print(&outcome.to_text()) }?;
    left_out.ended(None, console)
}

fn follow_options(args: &RegressionArgs) -> FollowOptions {
    let normalisation = match args.normalise {
        Normalise::None => Normalisation::None,
        Normalise::Regressors => Normalisation::Regressors,
        Normalise::Covariance => Normalisation::Covariance,
    };
    let limit = args.most_variance.unwrap_or(f64::INFINITY);
    FollowOptions {
        time_constants: args.filter.clone(),
        start_variance: args.start_variance,
        forgetting: Forgetting { rate: args.forgetting, limit, normalisation },
    }
}

fn regression_problem<'a>(
    task: &'a Task,
    args: &FitArgs,
    console: Console<'_>,
) -> Result<RegressionProblem<'a, Loaded>, CommandError> {
    let defaults = RegressionProblem::new(&task.system, &task.p, &task.train);
    let (mut stopping, mut simplex) = (defaults.stopping, defaults.simplex);
    if let Some(most) = task.evaluations {
        (stopping.evaluations, simplex.evaluations) = (most, most);
    }
    Ok(RegressionProblem {
        stopping,
        simplex,
        noise: task.noise.clone(),
        priors: task.problem(console).priors,
        half_width: args.regression.smoothing,
        steady: args
            .regression
            .steady
            .iter()
            .map(|text| steady(task, text))
            .collect::<Result<_, CommandError>>()?,
        watch: &task.watch,
        ..defaults
    })
}

/// Reads `STATE=RATE`: the position of the unknown, and its rate in SI.
fn steady(task: &Task, text: &str) -> Result<(usize, f64), CommandError> {
    let unknowns = &task.system.signature().unknowns;
    let Some((name, rate)) = text.split_once('=') else {
        return Err(CommandError::Usage(format!("`--steady {text}` is not `STATE=RATE`")));
    };
    let names: Vec<String> = unknowns.iter().map(|unknown| unknown.name.to_string()).collect();
    let Some(i) = names.iter().position(|known| known == name.trim()) else {
        let known: Vec<&str> = names.iter().map(String::as_str).collect();
        let hint = meant(name.trim(), &known);
        return Err(CommandError::Usage(format!(
            "`--steady {text}`: no state is called `{name}`; {hint}"
        )));
    };
    match rate.trim().parse::<f64>() {
        Ok(rate) if rate > 0.0 && rate.is_finite() => Ok((i, rate * unknowns.unit(i).factor.abs())),
        _ => Err(CommandError::Usage(format!(
            "`--steady {text}`: the rate is a positive number, in {} per second",
            unknowns.unit(i).symbol
        ))),
    }
}

/// The model with the estimates, simulated; `None` without recordings, or why it cannot be.
fn simulated(
    task: &Task,
    console: Console<'_>,
    p: &[f64],
    recordings: &[Recording],
    paths: &[PathBuf],
) -> Option<Result<Tested, String>> {
    if recordings.is_empty() {
        return None;
    }
    let at = OutputErrorProblem { p, recordings, ..task.problem(console) };
    Some(task.simulated(&at, paths).map_err(|error| error.to_string()))
}

fn failed(task: &Task, args: &FitArgs, error: RegressionError) -> CommandError {
    match error {
        RegressionError::NothingFree
        | RegressionError::Filter
        | RegressionError::StartVariance
        | RegressionError::Forgetting => CommandError::Usage(error.to_string()),
        RegressionError::NothingMeasured => task.failed(EstimateError::NothingMeasured, &args.data),
        RegressionError::NotRead { .. }
        | RegressionError::NotReconstructed { .. }
        | RegressionError::TooFewRows { .. }
        | RegressionError::NotLinear { .. }
        | RegressionError::ModesAndPast { .. }
        | RegressionError::FreeDelay { .. }
        | RegressionError::NeverTogether { .. }
        | RegressionError::NothingSteady { .. }
        | RegressionError::NotOverTime => CommandError::Found(error.to_string()),
        RegressionError::NotFinite { row, recording, t } => {
            let file = args.data.get(recording).map(|path| path.display().to_string());
            CommandError::Computation(format!(
                "{}: `{row}` has no finite value at t = {t} s",
                file.unwrap_or_default()
            ))
        }
        RegressionError::Inputs(_)
        | RegressionError::Variables(_)
        | RegressionError::ModesDoNotSettle { .. } => CommandError::Computation(error.to_string()),
    }
}
