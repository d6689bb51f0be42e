//! The point at which a model is linearised.

use crate::error::{Failure, IntegrateError};
use crate::integrate::fixed_step::Steps;
use crate::problem::{Options, Problem, WantedResults};
use crate::signal::LimitSide;
use crate::solved::SolvableSystem;
use crate::system::EvaluationPoint;

/// All values that a model's equations read at a point, SI.
#[derive(Debug, Clone, PartialEq)]
pub struct OperatingPoint {
    /// Time, s.
    pub t: f64,
    /// Unknowns.
    pub y: Vec<f64>,
    /// Inputs as in [`EvaluationPoint::u`].
    pub u: Vec<f64>,
    /// Discrete numbers.
    pub z: Vec<f64>,
}

impl OperatingPoint {
    /// The point that a run from `from` reaches at `t`, just after any event at `t`.
    ///
    /// # Errors
    ///
    /// The error of the run if it does not reach `t`.
    pub fn reached<S: SolvableSystem>(
        problem: &Problem<'_, S>,
        from: f64,
        t: f64,
        options: &Options,
    ) -> Result<Self, IntegrateError> {
        let both = [from, t];
        let times = if from == t { &both[1..] } else { &both[..] };
        let (at, _) = Self::reached_with(problem, times, options, WantedResults::UnknownsAndPast)?;
        Ok(at)
    }

    /// The point with the sensitivities of its unknowns, in the order of [`System`].
    pub(crate) fn reached_with_sensitivities<S: SolvableSystem>(
        problem: &Problem<'_, S>,
        from: f64,
        t: f64,
        options: &Options,
    ) -> Result<(Self, Vec<f64>), IntegrateError> {
        let both = [from, t];
        let times = if from == t { &both[1..] } else { &both[..] };
        Self::reached_with(problem, times, options, WantedResults::Sensitivities)
    }

    fn reached_with<S: SolvableSystem>(
        problem: &Problem<'_, S>,
        times: &[f64],
        options: &Options,
        wanted: WantedResults<'_>,
    ) -> Result<(Self, Vec<f64>), IntegrateError> {
        // Fixed steps need rows of data, and there are none on the way.
        let options = Options { steps: Steps::Adaptive, ..*options };
        let solution = S::integrate(problem, times, &options, wanted)
            .map_err(|Failure { error, .. }| error)?;
        let last = times.len() - 1;
        let t = times[last];
        let inputs = problem.inputs_read().map_err(IntegrateError::Inputs)?;
        let mut u = vec![0.0; inputs.len()];
        inputs.value(t, LimitSide::Right, &mut u);
        let first = u.len() - solution.n_past;
        u[first..].copy_from_slice(solution.past(last));
        let point = Self { t, y: solution.y(last).to_vec(), u, z: solution.z(last).to_vec() };
        Ok((point, solution.s(last).to_vec()))
    }

    /// The point as an argument of the model's functions.
    pub fn point<'a>(&'a self, p: &'a [f64]) -> EvaluationPoint<'a> {
        EvaluationPoint { t: self.t, y: &self.y, u: &self.u, p, z: &self.z }
    }
}
