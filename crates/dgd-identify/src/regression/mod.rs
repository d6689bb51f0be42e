//! Regressions: parameters from equations and outputs whose other quantities are known.
//!
//! ```text
//!   residuals:   f(t, y, u, p) − M ẏ  and  w(t, y, u, p) − measured, at each sample
//!   y, ẏ:        from the measured outputs that have no parameter to be estimated
//!   minimise     Σ_rows Σ_samples (residual / σ_row)² + Σ_priors ((wᵀp − mean) / std)²
//! ```
//!
//! Nothing is simulated, so there is a single minimum if the parameters enter linearly, and there are no start values.
//! The price: noise in y and ẏ also affects the regressors, and an unknown without a sensor is not available.
//!
//! | file | contents |
//! |---|---|
//! | `known`, `slopes` | y and ẏ at each sample |
//! | `modes` | modes at the samples, and unknowns that follow without readings |
//! | `delayed` | delayed unknowns |
//! | `rows` | residuals and their derivatives, row by row |
//! | `structure` | finds the parameters that enter linearly |
//! | `triangle`, `least_squares` | linear least squares without squaring, free and within bounds |
//! | `separable` | linear parameters inside, the others outside |
//! | `finish` | the result and its uncertainty |
//! | `profile` | profiles of the estimates |
//! | `trace` | the rows at the estimates, sample by sample |
//! | `filters`, `recursive`, `follow` | recursive estimation as samples arrive |

mod error;
mod finish;
mod follow;
pub(crate) mod known;
mod least_squares;
mod prepare;
mod profile;
mod rows;
mod separable;
mod structure;
mod trace;

use crate::minimise::nelder_mead::SimplexRule;
use crate::minimise::trust_region::StoppingRule;
use crate::noise::NoiseSource;
use crate::output_error::prior::Prior;
use crate::progress::{Monitor, NoMonitor};
use crate::recording::Recording;
use crate::regression::finish::RegressionRound;
use crate::regression::known::RecordingSamples;
use crate::regression::prepare::PreparedRegression;
use dgd_runtime::model::Model;

pub use error::{RegressionError, UnsteadyUnknown};
pub use finish::{RegressionFit, RowQuality};
pub use follow::{FollowOptions, ParameterPath, follow};
pub use known::filters::LambdaFilter;
pub use least_squares::recursive::{
    ContinuousLeastSquares, Forgetting, Normalisation, RecursiveLeastSquares, RegressorSample,
};
pub use profile::regression_profiles;
pub use rows::{RowOf, RowsLeftOut};
pub use trace::{RowTrace, traces};

/// Limit on rounds of re-estimated noise.
const MOST_ROUNDS: usize = 12;
/// Limit on rounds in which modes and histories follow from estimates.
const MOST_MODE_ROUNDS: usize = 30;
/// Modes at up to this fraction of the samples may keep changing, as readings close to a threshold do.
const UNSETTLED: f64 = 0.01;
/// Noise that changes by less than this fraction is stable.
const STABLE: f64 = 0.01;

/// The method of a regression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RegressionMethod {
    /// Linear least squares without bounds. All parameters must enter linearly.
    LeastSquares,
    /// Linear least squares within the parameters' bounds. All parameters must enter linearly.
    Bounded,
    /// Variable projection: linear parameters by least squares, for each trial of the others, which a trust region
    /// method moves; all within their bounds.
    VariableProjection,
    /// Variable projection, with the others moved by the Nelder–Mead simplex method.
    NelderMead,
}

impl RegressionMethod {
    /// Whether estimates stay within the parameters' bounds.
    pub(crate) fn has_bounds(self) -> bool {
        match self {
            Self::LeastSquares => false,
            Self::Bounded | Self::VariableProjection | Self::NelderMead => true,
        }
    }

    /// Whether it searches for parameters that do not enter linearly.
    pub fn searches(self) -> bool {
        match self {
            Self::LeastSquares | Self::Bounded => false,
            Self::VariableProjection | Self::NelderMead => true,
        }
    }
}

/// A regression problem.
#[derive(Debug, Clone)]
pub struct RegressionProblem<'a> {
    /// The model.
    pub system: &'a dyn Model,
    /// All parameters, SI: values of fixed ones, first guesses of free ones.
    pub p: &'a [f64],
    /// Which of the model's directions are free; start values are ignored.
    pub free: Vec<bool>,
    /// The recordings.
    pub recordings: &'a [Recording],
    /// For each output of the model, its noise; `None` if it is not used at all.
    pub noise: Vec<Option<NoiseSource>>,
    /// The priors.
    pub priors: Vec<Prior>,
    /// Half the width of the windows for slopes, s; the default is five usual steps.
    pub half_width: Option<f64>,
    /// Limits on the rates of unknowns, SI per second: other samples do not count.
    pub steady: Vec<(usize, f64)>,
    /// The stopping rule of the search for parameters that do not enter linearly.
    pub stopping: StoppingRule,
    /// The stopping rule of the simplex method.
    pub simplex: SimplexRule,
    /// Progress and cancellation.
    pub watch: &'a dyn Monitor,
}

impl<'a> RegressionProblem<'a> {
    /// A problem in which all parameters among the directions are free, and all outputs used.
    pub fn new(system: &'a dyn Model, p: &'a [f64], recordings: &'a [Recording]) -> Self {
        let signature = system.signature();
        Self {
            system,
            p,
            free: vec![true; signature.directions.len()],
            recordings,
            noise: vec![Some(NoiseSource::Estimated); signature.outputs.len()],
            priors: Vec::new(),
            half_width: None,
            steady: Vec::new(),
            stopping: StoppingRule {
                gradient: 1e-12,
                reduction: 1e-18,
                step: 1e-12,
                evaluations: 2000,
                ..StoppingRule::default()
            },
            simplex: SimplexRule::default(),
            watch: &NoMonitor,
        }
    }
}

/// Estimates the free parameters. If the problem's watch cancels it, the result is the best so far
/// ([`RegressionFit::is_stopped`]), and so it is if the search does not reach a minimum
/// ([`RegressionFit::is_converged`]).
///
/// # Errors
///
/// [`RegressionError`]: nothing to estimate or to estimate from, an unknown that no output determines, a parameter that
/// does not enter as required by the method.
pub fn regress(
    problem: &RegressionProblem<'_>,
    method: RegressionMethod,
) -> Result<RegressionFit, RegressionError> {
    let mut prepared = PreparedRegression::new(problem)?;
    prepared.clamp(method);
    let mut known = prepared.known()?;
    let mut fit = regress_known(&prepared, &known, method)?;
    let signature = problem.system.signature();
    if known::modes::remembered(problem.system).is_none() && signature.delayed_unknowns.is_empty() {
        return Ok(fit);
    }
    // Conditions may depend on estimated parameters, directly or indirectly, and delays decide which samples have a
    // complete history.
    let mut samples = 0;
    for _ in 0..MOST_MODE_ROUNDS {
        prepared.p.clone_from(&fit.p);
        prepared.clamp(RegressionMethod::Bounded);
        let next = prepared.known()?;
        samples = differing(&known, &next);
        let pasts_differ = known.iter().zip(&next).any(|(known, next)| known.pasts_differ(next));
        if samples == 0 && !pasts_differ || !fit.is_converged {
            return Ok(fit);
        }
        known = next;
        fit = regress_known(&prepared, &known, method)?;
    }
    let total: usize = known.iter().map(|known| known.times.len()).sum();
    if samples as f64 <= UNSETTLED * total as f64 {
        Ok(fit)
    } else {
        Err(RegressionError::ModesDoNotSettle { samples })
    }
}

/// Number of samples whose modes differ.
fn differing(known: &[RecordingSamples], next: &[RecordingSamples]) -> usize {
    known.iter().zip(next).map(|(known, next)| known.modes_differ(next)).sum()
}

/// The regression, given the unknowns at each sample.
fn regress_known(
    prepared: &PreparedRegression<'_>,
    known: &[RecordingSamples],
    method: RegressionMethod,
) -> Result<RegressionFit, RegressionError> {
    let problem = prepared.problem;
    let mut rows = prepared.rows(known)?;
    let linear = structure::find_linear(problem.system, &mut rows, &prepared.p);
    let is_linear = linear.iter().all(|linear| *linear);
    if !is_linear && !method.searches() {
        return Err(prepare::not_linear(problem, &mut rows, &linear));
    }

    let mut round = RegressionRound::first(prepared, &mut rows)?;
    let mut is_stopped = false;
    let bounds = prepared.bounds(method);
    for _ in 0..MOST_ROUNDS {
        let next = separable::solve(prepared, &mut rows, &linear, &round, method, &bounds)?;
        // The weight of a single kind of rows, without priors, has no effect.
        let is_one = next.sigma.len() == 1 && problem.priors.is_empty();
        let is_stable = is_one || next.is_stable(&round, STABLE);
        round = next;
        is_stopped = problem.watch.is_stopped();
        if is_stable || is_stopped || !round.is_converged {
            break;
        }
    }
    let mut fit = finish::finish(prepared, &mut rows, &linear, round, method)?;
    fit.is_stopped = is_stopped;
    fit.is_converged &= !is_stopped;
    Ok(fit)
}
