//! Outputs whose noise is more than a number: which tasks accept them.

use std::path::PathBuf;

use dgd_compiler::argument::{Argument, ArgumentUse};
use dgd_compiler::expr::{Node, Symbol};
use dgd_compiler::model::Model;
use dgd_identify::{NoiseSource, Recording};
use dgd_runtime::Signature;
use dgd_runtime::signature::{Density, Distribution};

use crate::error::{UsageError, WorkError};
use crate::request::{FitRequest, NoiseFrom};
use crate::session::TaskContext;

/// Refuses a model with noise other than a number, for tasks that need a single standard deviation.
///
/// # Errors
///
/// [`WorkError::Usage`] with the name of the output.
pub(crate) fn refuse(signature: &Signature, task: &'static str) -> Result<(), WorkError> {
    let Some(density) = signature.densities.first() else { return Ok(()) };
    let output = signature.outputs[density.output].name.to_string();
    Err(UsageError::DensityNotTaken { output, task }.into())
}

/// Remarks that standard deviations of readings are ignored, and what is used instead.
pub(crate) fn remark_unused(output: &str, instead: &str, session: TaskContext<'_>) {
    session.remark(format!("the column `std({output})` is not used: {instead}"));
}

/// The noise of each used and measured output.
///
/// # Errors
///
/// [`WorkError::Usage`]: a recording lacks the standard deviations that others have, or the requested options do not
/// support variable ones.
pub(crate) fn of_outputs(
    signature: &Signature,
    model: &Model,
    request: &FitRequest,
    used: &[bool],
    train: &[Recording],
    valid: &[Recording],
) -> Result<Vec<Option<NoiseSource>>, WorkError> {
    let is_measured = |i: usize| train.iter().any(|recording| recording.measured[i].is_some());
    let mut noises = Vec::with_capacity(signature.outputs.len());
    for (i, output) in signature.outputs.iter().enumerate() {
        if !used[i] || !is_measured(i) || signature.is_deviation(i) {
            noises.push(None);
            continue;
        }
        let has_column =
            train.iter().chain(valid).any(|recording| recording.deviations_of(i).is_some());
        noises.push(Some(match (signature.density(i), output.noise, request.noise) {
            (Some(density), ..) => {
                // The filter of a prediction error supports one σ per output, whether given or a parameter.
                let is_level = request.regression.estimator.is_filter()
                    && parameter_of(model, density).is_some();
                if !is_level {
                    verify_takes_densities(request, &output.name, false)?;
                }
                NoiseSource::Density(density)
            }
            _ if has_column => {
                verify_takes_densities(request, &output.name, true)?;
                verify_columns(i, &output.name, (&request.data, train))?;
                verify_columns(i, &output.name, (&request.valid, valid))?;
                NoiseSource::Recorded
            }
            (None, Some(sigma), NoiseFrom::Declared) => NoiseSource::Known(sigma),
            (None, None, _) | (None, Some(_), NoiseFrom::Estimated) => NoiseSource::Estimated,
        }));
    }
    Ok(noises)
}

/// The parameter that directly is the standard deviation of a normal density.
pub(crate) fn parameter_of(model: &Model, density: Density) -> Option<usize> {
    let is_normal = density.distribution == Distribution::Normal;
    match model.graph.node(model.outputs[density.deviation].value) {
        Node::Symbol(Symbol::Parameter(i)) if is_normal => Some(i as usize),
        _ => None,
    }
}

/// Whether the requested options support likelihoods of single readings.
fn verify_takes_densities(
    request: &FitRequest,
    output: &str,
    is_column: bool,
) -> Result<(), WorkError> {
    let refused = |by: ArgumentUse| {
        Err(UsageError::NoiseNotTaken { output: output.to_owned(), is_column, by }.into())
    };
    let estimator = request.regression.estimator;
    if !estimator.simulates_model() {
        return refused(Argument::Estimator.with(estimator.name()));
    }
    if request.intervals.bootstrap > 0 {
        return refused(Argument::Bootstrap.into());
    }
    if request.intervals.information {
        return refused(Argument::Information.into());
    }
    Ok(())
}

/// Whether all recordings that measure an output have its standard deviations.
fn verify_columns(
    output: usize,
    name: &str,
    (paths, recordings): (&[PathBuf], &[Recording]),
) -> Result<(), WorkError> {
    let lacks = |recording: &Recording| {
        recording.measured[output].is_some() && recording.deviations_of(output).is_none()
    };
    let Some(r) = recordings.iter().position(lacks) else { return Ok(()) };
    Err(UsageError::NoDeviations { path: paths[r].clone(), output: name.to_owned() }.into())
}
