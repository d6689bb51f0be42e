//! Solves a fit's problem again near the estimates, with the final noise and steps of the fit.

use dgd_runtime::Options;
use dgd_runtime::model::Model;

use crate::error::{EstimateError, TrialFailed};
use crate::journal::{Digest, Journal, Journaled, kept_success};
use crate::minimise::trust_region::{Minimum, StoppingRule, VariableRegion, minimise_watched};
use crate::noise::NoiseSource;
use crate::noise::loss::Loss;
use crate::output_error::OutputErrorProblem;
use crate::output_error::fit::Fit;
use crate::output_error::prior::Prior;
use crate::output_error::weighing::{WeightedSums, simulate_all, weigh};
use crate::progress::Monitor;
use crate::recording::Recording;
use crate::variables::{FitVariable, FitVariables};

/// Accuracy of a rise of Σ ρ, in units of the residual variance per degree of freedom: its 95 % threshold is 3.8.
const KNOWN: f64 = 1e-3;

/// The problem to solve around a fit.
///
/// It does not contain the system, so that threads can share it and have one each.
pub(crate) struct FitNeighbourhood<'a> {
    p: &'a [f64],
    free: Vec<bool>,
    recordings: &'a [Recording],
    noise: Vec<Option<NoiseSource>>,
    priors: Vec<Prior>,
    loss: Loss,
    options: Options,
    pub variables: FitVariables,
    /// Estimates of the fit as variables.
    pub z: Vec<f64>,
    /// Bounds of the variables.
    pub bounds: Vec<(f64, f64)>,
    sigma: Vec<Option<f64>>,
    rule: StoppingRule,
    pub watch: &'a dyn Monitor,
    pub journal: &'a dyn Journal,
    /// Digest of the problem, if a journal is used.
    pub of: Option<Digest>,
}

impl<'a> FitNeighbourhood<'a> {
    /// With at most this many simulations for each solution.
    pub(crate) fn new(
        problem: &OutputErrorProblem<'a>,
        fit: &Fit,
        evaluations: usize,
    ) -> Result<Self, EstimateError> {
        let (variables, _) =
            FitVariables::new(problem.system, problem.p, problem.recordings, &problem.free)?;
        assert_eq!(variables.len(), fit.estimates.len(), "the fit is that of the problem");
        let bounds: Vec<(f64, f64)> = variables.all.iter().map(FitVariable::bounds).collect();
        let z = variables.all.iter().zip(&fit.estimates).zip(&bounds);
        let z = z.map(|((variable, estimate), (low, high))| {
            variable.variable(estimate.value).clamp(*low, *high)
        });
        let z = z.collect();
        let freedom = fit.degrees_of_freedom.max(1) as f64;
        let reduction = problem.stopping.reduction.max(problem.negligible_reduction / freedom);
        Ok(Self {
            p: problem.p,
            free: problem.free.clone(),
            recordings: problem.recordings,
            noise: problem.noise.clone(),
            priors: problem.priors.clone(),
            loss: problem.loss,
            options: fit.simulated(&problem.options),
            variables,
            z,
            bounds,
            sigma: fit.noise.clone(),
            // Away from a minimum outputs may well be flat.
            rule: StoppingRule {
                reduction,
                evaluations,
                flat: 0.0,
                accuracy: problem.stopping.accuracy.max(KNOWN / freedom),
                ..problem.stopping
            },
            watch: problem.watch,
            journal: problem.keeping.journal,
            of: problem.keeping.digest(|digest| {
                let loss = problem.loss;
                let problem = (problem.p, &problem.free, problem.recordings, &problem.priors);
                let fit = (&fit.estimates, &fit.noise, fit.stepping, &fit.starts);
                digest.debug(&problem).debug(&loss).debug(&fit).debug(&evaluations)
            }),
        })
    }

    /// A result around the fit, from the journal or computed.
    pub(crate) fn kept<T: Journaled, E>(
        &self,
        arguments: impl FnOnce(Digest) -> Digest,
        compute: impl FnOnce() -> Result<T, E>,
    ) -> Result<T, E> {
        match self.of {
            None => compute(),
            Some(of) => kept_success(self.journal, arguments(of).value(), compute),
        }
    }

    /// The problem for one thread.
    pub(crate) fn problem<'s>(&'s self, system: &'s dyn Model) -> OutputErrorProblem<'s> {
        OutputErrorProblem {
            free: self.free.clone(),
            noise: self.noise.clone(),
            priors: self.priors.clone(),
            loss: self.loss,
            options: self.options,
            watch: self.watch,
            ..OutputErrorProblem::new(system, self.p, self.recordings)
        }
    }

    /// The sum of squares at z.
    pub(crate) fn evaluated(
        &self,
        problem: &OutputErrorProblem<'_>,
        z: &[f64],
    ) -> Result<WeightedSums, TrialFailed> {
        let sums = simulate_all(problem, &self.variables, z, &self.sigma)?;
        Ok(weigh(problem, &self.variables, z, &self.sigma, sums))
    }

    /// The minimum found from z, within bounds that may be narrower than the model's, with the recordings and priors of
    /// `problem`.
    pub(crate) fn minimum(
        &self,
        problem: &OutputErrorProblem<'_>,
        z: Vec<f64>,
        bounds: &[(f64, f64)],
    ) -> Result<Minimum<WeightedSums, TrialFailed>, TrialFailed> {
        let evaluated = self.evaluated(problem, &z)?;
        let reach = self.variables.reach();
        let region = VariableRegion { bounds, reach: &reach, leading: self.variables.n_shared };
        Ok(minimise_watched(z, evaluated, region, &self.rule, self.watch, |z| {
            self.evaluated(problem, z)
        }))
    }
}
