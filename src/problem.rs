//! A model with numbers, and its runs.

use dgd_runtime::{
    InputColumn, Inputs, Options, Signature, SolvableSystem, observe, simulate as run,
    simulate_with_sensitivities as run_with_sensitivities,
};

use crate::{Error, Solution};

/// A model with parameters, inputs and initial values, all in SI units.
#[derive(Debug)]
#[non_exhaustive]
pub struct Problem<'a, M> {
    /// The model.
    pub model: &'a M,
    /// All its parameters, in the model's order.
    pub parameters: Vec<f64>,
    /// Its inputs.
    pub inputs: &'a Inputs,
    /// Initial values that replace the model's, by index of the unknown ([`Problem::start`] takes a name).
    pub start: Vec<(usize, f64)>,
}

impl<M> Clone for Problem<'_, M> {
    fn clone(&self) -> Self {
        let Self { model, parameters, inputs, start } = self;
        Self { model, parameters: parameters.clone(), inputs, start: start.clone() }
    }
}

impl<'a, M: SolvableSystem> Problem<'a, M> {
    /// The model with these parameters and inputs, and its own initial values. Parameters are a reference to the
    /// model's `Parameters`, or a slice of all of them in the model's order.
    pub fn new(model: &'a M, parameters: impl Into<Vec<f64>>, inputs: &'a Inputs) -> Self {
        Self { model, parameters: parameters.into(), inputs, start: Vec::new() }
    }

    /// Sets the initial value of an unknown, SI; for an algebraic unknown it is a guess.
    ///
    /// # Errors
    ///
    /// [`Error::NoSuchName`].
    pub fn start(mut self, unknown: &str, value: f64) -> Result<Self, Error> {
        let unknowns = &self.model.signature().unknowns;
        let position = unknowns.iter().position(|own| own.name == unknown).ok_or_else(|| {
            Error::no_such_name("state", unknown, unknowns.iter().map(|own| own.name.to_string()))
        })?;
        self.start.retain(|(own, _)| *own != position);
        self.start.push((position, value));
        Ok(self)
    }

    /// The problem in the form of the solvers.
    pub(crate) fn as_run(&self) -> Result<dgd_runtime::Problem<'_, M>, Error> {
        let signature = self.model.signature();
        verify_parameters(signature, self.parameters.len())?;
        let (found, expected) = (self.inputs.len(), signature.inputs.len());
        if found != expected {
            return Err(Error::Length { of: "inputs".to_owned(), found, expected });
        }
        let n = signature.unknowns.len();
        if let Some((unknown, _)) = self.start.iter().find(|(unknown, _)| *unknown >= n) {
            let name = format!("the start value of unknown {unknown}");
            return Err(Error::Length { of: name, found: *unknown, expected: n });
        }
        let Self { model, parameters, inputs, start } = self;
        Ok(dgd_runtime::Problem { system: *model, p: parameters, inputs, start })
    }
}

pub(crate) fn verify_parameters(signature: &Signature, found: usize) -> Result<(), Error> {
    let expected = signature.parameters.len();
    if found == expected {
        return Ok(());
    }
    Err(Error::Length { of: "parameters".to_owned(), found, expected })
}

/// Inputs of a model from samples at `times`, s, by name and in any order; SI units. Between samples they are held or
/// interpolated linearly, as the model declares them. Two samples at one time are the values before and after a jump.
///
/// # Errors
///
/// [`Error::NoSuchName`], [`Error::MissingInput`], [`Error::Inputs`].
pub fn inputs<M: SolvableSystem>(
    model: &M,
    times: &[f64],
    samples: &[(&str, &[f64])],
) -> Result<Inputs, Error> {
    let declared = &model.signature().inputs;
    if let Some((name, _)) =
        samples.iter().find(|(name, _)| declared.iter().all(|own| own.name != *name))
    {
        return Err(Error::no_such_name(
            "input",
            name,
            declared.iter().map(|own| own.name.to_string()),
        ));
    }
    let mut columns = Vec::with_capacity(declared.len());
    for own in declared.iter() {
        let name: &str = &own.name;
        let (_, values) = samples
            .iter()
            .find(|(sampled, _)| *sampled == name)
            .ok_or_else(|| Error::MissingInput { name: name.to_owned() })?;
        columns.push(InputColumn { name, interpolation: own.interpolation, values });
    }
    Ok(Inputs::recorded(times, &columns)?)
}

/// Runs from the first to the last of `times`, s, and returns the unknowns and outputs at each.
///
/// Times ascend; a repeated time means just before and just after a jump of the inputs.
///
/// # Errors
///
/// [`Error::Length`]; [`Error::Run`] with the solution up to there.
pub fn simulate<M: SolvableSystem>(
    problem: &Problem<'_, M>,
    times: &[f64],
    options: &Options,
) -> Result<Solution, Error> {
    let problem_run = problem.as_run()?;
    ended(&problem_run, run(&problem_run, times, options))
}

/// [`simulate`] with the derivatives of all unknowns and outputs with respect to the directions of the model: all
/// parameters, unless [`model!`](crate::model) names others.
///
/// # Errors
///
/// Those of [`simulate`].
pub fn sensitivities<M: SolvableSystem>(
    problem: &Problem<'_, M>,
    times: &[f64],
    options: &Options,
) -> Result<Solution, Error> {
    let problem_run = problem.as_run()?;
    ended(&problem_run, run_with_sensitivities(&problem_run, times, options))
}

fn ended<M: SolvableSystem>(
    problem: &dgd_runtime::Problem<'_, M>,
    outcome: Result<dgd_runtime::Solution, dgd_runtime::Failure>,
) -> Result<Solution, Error> {
    let signature = problem.system.signature();
    let with_outputs = |run: dgd_runtime::Solution| {
        let outputs = observe(problem, &run);
        Solution::new(signature, run, &outputs)
    };
    match outcome {
        Ok(run) => Ok(with_outputs(run)),
        Err(failure) => {
            let reached = Box::new(match failure.error {
                // Without inputs, outputs cannot be evaluated.
                dgd_runtime::IntegrateError::Inputs(_) => Solution::default(),
                _ => with_outputs(*failure.partial),
            });
            Err(Error::Run { error: failure.error, reached })
        }
    }
}
