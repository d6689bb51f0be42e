//! Checks that the options of a request apply to its estimator.

use dgd_compiler::argument::Argument;

use crate::error::{UsageError, WorkError};
use crate::request::{EstimationApproach, Estimator, LinearizeAt, RegressionRequest};

impl RegressionRequest {
    /// Checks that a limit on evaluations applies to the estimator.
    pub(crate) fn verify_evaluations(&self, most: Option<usize>) -> Result<(), WorkError> {
        if most.is_none() || self.estimator.searches() {
            return Ok(());
        }
        Err(UsageError::NoSearch(self.estimator).into())
    }

    /// The operating point of linear models, if the estimator uses them.
    ///
    /// # Errors
    ///
    /// If an operating point is given for another estimator.
    pub(crate) fn place(&self) -> Result<Option<LinearizeAt>, WorkError> {
        match (self.estimator.approach(), self.at) {
            (EstimationApproach::LinearSimulation, at) => Ok(Some(at.unwrap_or(LinearizeAt::Mean))),
            (_, None) => Ok(None),
            (_, Some(_)) => Err(UsageError::NeedsEstimator {
                given: vec![Argument::At.into()],
                estimators: &[Estimator::Linearised],
            }
            .into()),
        }
    }
}
