//! The linear model at a point of a run, or at a steady state.

mod figure;
mod page;
mod report;

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_runtime::linearize::{OperatingPoint, SteadyState, rest};
use dgd_runtime::{Inputs, Problem};

use crate::error::{ComputationError, UsageError, WorkError};
use crate::model::load;
use crate::output::conserved;
use crate::request::{LinearizeAt, LinearizeRequest, RunRequest, SolverOptions};
use crate::run::ModelRun;
use crate::run::under_way::told;
use crate::session::TaskContext;

pub use report::{LinearModelReport, modes};

/// Linearises the model at a point.
///
/// # Errors
///
/// [`WorkError`]: there is no such point, or the model cannot be differentiated there.
pub fn linearize(
    request: &LinearizeRequest,
    session: TaskContext<'_>,
) -> Result<LinearModelReport, WorkError> {
    if request.solve.until.is_some() {
        return Err(UsageError::EndOfLinearisation.into());
    }
    if let LinearizeAt::Time(t) = request.at
        && t < request.solve.from.unwrap_or(0.0)
    {
        let from = request.solve.from.unwrap_or(0.0);
        return Err(UsageError::PointBeforeRun { t, from }.into());
    }
    let choices = request.choices.starting(&request.solve);
    let loaded = load(&request.model, &choices, &SensitivityDirections::None, session)?;
    let run = ModelRun::prepare(&run_request(request), loaded, session)?;
    let from = run.times[0];
    session.listener.begins(false);
    let SteadyState { at, conserved } = match request.at {
        LinearizeAt::Time(t) => {
            let reach = || OperatingPoint::reached(&run.problem(), from, t, &run.options);
            let reached = told(session, [from, t], reach);
            SteadyState { at: reached.map_err(failed)?, conserved: Vec::new() }
        }
        LinearizeAt::Steady => rest(&run.problem(), from, &run.options).map_err(failed)?,
        LinearizeAt::Mean if request.data.is_none() => {
            return Err(UsageError::MeanWithoutData.into());
        }
        LinearizeAt::Mean => {
            let until = run.times.last().map_or(from, |last| *last);
            run.inputs.cover(from, until).map_err(failed)?;
            let mean = Inputs::constant(&run.inputs.mean(from, until));
            let problem = Problem { inputs: &mean, ..run.problem() };
            rest(&problem, from, &run.options).map_err(failed)?
        }
    };
    session.listener.ends();
    let system = dgd_runtime::linearize::linearize(&run.problem(), &at).map_err(failed)?;
    let poles = system.poles_beside(&conserved).map_err(failed)?;
    let signature = run.signature().clone();
    let conserved = conserved::described(&signature, &system, &conserved);
    let linear = LinearModelReport::new(signature, request.at, at, system, poles, run.provenance);
    Ok(linear.holding(conserved))
}

fn failed(error: impl Into<ComputationError>) -> WorkError {
    error.into().into()
}

/// The request of a run that ends at the point.
fn run_request(request: &LinearizeRequest) -> RunRequest {
    let LinearizeRequest { model, choices, data, at, solve } = request;
    let until = match at {
        LinearizeAt::Time(t) => Some(*t),
        // Without data the start time would be unknown; only that matters here.
        LinearizeAt::Steady | LinearizeAt::Mean => {
            data.is_none().then(|| solve.from.unwrap_or(0.0))
        }
    };
    RunRequest {
        choices: choices.clone(),
        data: data.clone(),
        solve: SolverOptions { until, ..solve.clone() },
        ..RunRequest::new(model)
    }
}
