//! Estimates parameters from recordings.

use dgd_identify::{OutputErrorProblem, Termination};
use dgd_runtime::model::Model;
use dgd_runtime::{Direction, Inputs, Options};

use crate::Error;
use crate::problem::verify_parameters;

/// The recording of one experiment.
#[derive(Debug, Clone)]
pub struct Recording {
    times: Vec<f64>,
    inputs: Inputs,
    measured: Vec<(String, Vec<f64>)>,
}

impl Recording {
    /// An experiment with samples at `times`, s, ascending, and its inputs.
    pub fn new(times: &[f64], inputs: &Inputs) -> Self {
        Self { times: times.to_vec(), inputs: inputs.clone(), measured: Vec::new() }
    }

    /// Adds the samples of an output, SI, one for each time, NaN for missing ones.
    #[must_use]
    pub fn measured(mut self, output: &str, samples: &[f64]) -> Self {
        self.measured.push((output.to_owned(), samples.to_vec()));
        self
    }

    fn resolved(&self, model: &dyn Model) -> Result<dgd_identify::Recording, Error> {
        let outputs = &model.signature().outputs;
        let mut samples = vec![None; outputs.len()];
        for (name, values) in &self.measured {
            let output =
                outputs.iter().position(|output| output.name == *name).ok_or_else(|| {
                    Error::no_such_name(
                        "output",
                        name,
                        outputs.iter().map(|own| own.name.to_string()),
                    )
                })?;
            let (found, expected) = (values.len(), self.times.len());
            if found != expected {
                return Err(Error::Length { of: format!("samples of `{name}`"), found, expected });
            }
            samples[output] = Some(values.clone());
        }
        Ok(dgd_identify::Recording::new(self.times.clone(), self.inputs.clone(), samples))
    }
}

/// An estimated parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct EstimatedParameter {
    /// Its value, SI.
    pub value: f64,
    /// Its standard deviation, SI; `None` if the data do not determine it, and at a bound.
    pub std: Option<f64>,
}

/// The result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    found: dgd_identify::Fit,
    outputs: Vec<String>,
}

impl Fit {
    /// An estimate by the parameter's name.
    ///
    /// # Errors
    ///
    /// [`Error::NoSuchName`].
    pub fn get(&self, parameter: &str) -> Result<EstimatedParameter, Error> {
        let estimates = &self.found.estimates;
        let matching = estimates.iter().find(|estimate| estimate.name == parameter);
        matching
            .map(|estimate| EstimatedParameter { value: estimate.value, std: estimate.std })
            .ok_or_else(|| {
                Error::no_such_name(
                    "estimate of",
                    parameter,
                    estimates.iter().map(|estimate| &estimate.name),
                )
            })
    }

    /// All parameters of the model with the estimates substituted, SI, for another [`Problem`](crate::Problem).
    pub fn parameters(&self) -> &[f64] {
        &self.found.p
    }

    /// Whether the fit converged.
    pub fn is_converged(&self) -> bool {
        self.found.termination.is_converged()
    }

    /// Why the fit ended.
    pub fn termination(&self) -> Termination {
        self.found.termination
    }

    /// The root-mean-square residual of an output in a recording, SI; `None` without samples.
    ///
    /// # Errors
    ///
    /// [`Error::NoSuchName`], [`Error::Length`] if there are fewer recordings.
    pub fn rms(&self, output: &str, recording: usize) -> Result<Option<f64>, Error> {
        let position = self.outputs.iter().position(|own| own == output);
        let position =
            position.ok_or_else(|| Error::no_such_name("output", output, &self.outputs))?;
        let expected = self.found.misfits.len();
        let misfits = self.found.misfits.get(recording).ok_or_else(|| Error::Length {
            of: "recordings".to_owned(),
            found: recording,
            expected,
        })?;
        Ok(misfits[position].rms())
    }
}

/// Estimates the `free` parameters by simulating the recordings; all others keep their values. Noise is estimated from
/// the residuals; bounds are the model's.
///
/// # Errors
///
/// [`Error::NoSuchName`], [`Error::Length`], [`Error::Fit`].
pub fn fit(
    model: &dyn Model,
    parameters: impl Into<Vec<f64>>,
    recordings: &[Recording],
    free: &[&str],
    options: &Options,
) -> Result<Fit, Error> {
    let signature = model.signature();
    let p = parameters.into();
    verify_parameters(signature, p.len())?;
    let is_parameter = |direction: &Direction| matches!(direction, Direction::Parameter(_));
    let names: Vec<Option<String>> = signature
        .directions
        .iter()
        .enumerate()
        .map(|(j, direction)| {
            is_parameter(direction).then(|| signature.direction_name(j).to_string())
        })
        .collect();
    for name in free {
        if !names.iter().flatten().any(|own| own == name) {
            return Err(Error::no_such_name("parameter to fit", name, names.iter().flatten()));
        }
    }
    let recordings: Vec<_> =
        recordings.iter().map(|recording| recording.resolved(model)).collect::<Result<_, _>>()?;
    let is_measured =
        |output: usize| recordings.iter().any(|recording| recording.measured[output].is_some());
    let mut problem = OutputErrorProblem::new(model, &p, &recordings);
    problem.free =
        names.iter().map(|own| own.as_deref().is_some_and(|own| free.contains(&own))).collect();
    for (output, noise) in problem.noise.iter_mut().enumerate() {
        if !is_measured(output) {
            *noise = None;
        }
    }
    problem.options = *options;
    let fitted = dgd_identify::fit(&problem).map_err(Error::Fit)?;
    let outputs = signature.outputs.iter().map(|output| output.name.to_string()).collect();
    Ok(Fit { found: fitted, outputs })
}
