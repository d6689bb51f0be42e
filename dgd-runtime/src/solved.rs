//! The trait of models that can be solved: their matrices, runs, and functions for ensembles.

use crate::ensemble::lanes::{self, LanePoint, Lanes};
use crate::error::{Failure, InitialError};
use crate::linalg::Factorisation;
use crate::problem::{Options, Problem, WantedResults};
use crate::solution::Solution;
use crate::system::System;

/// A [`System`] that the solvers of this crate accept.
pub trait SolvableSystem: System {
    /// The factorisation of W = M c − ∂f/∂y.
    type Factorisation: Factorisation;

    /// Integrates the system, for [`simulate`](crate::simulate) and
    /// [`simulate_with_sensitivities`](crate::simulate_with_sensitivities), by default with
    /// [`integrate::integrate`](crate::integrate::integrate). A system whose sizes are known only at run time may pass
    /// the problem to an equivalent one that has its sizes as constants.
    ///
    /// # Errors
    ///
    /// [`Failure`], with the part of the solution that was reached.
    fn integrate(
        problem: &Problem<'_, Self>,
        times: &[f64],
        options: &Options,
        wanted: WantedResults<'_>,
    ) -> Result<Solution, Failure>
    where
        Self: Sized;

    /// Replaces start values, and their sensitivities, by those found if the model starts at rest or has start
    /// equations ([`find_start`](crate::linearize::find_start)); a model without these need not implement it.
    ///
    /// # Errors
    ///
    /// [`InitialError`] if there are none.
    #[inline]
    fn find_start(
        _problem: &Problem<'_, Self>,
        _t: f64,
        _options: &Options,
        _y: &mut [f64],
        _s: Option<&mut [f64]>,
    ) -> Result<(), InitialError>
    where
        Self: Sized,
    {
        Ok(())
    }

    /// [`System::rhs`] for several members of an ensemble, equal to it bit for bit. Called only for models that have no
    /// discrete numbers and are small enough for lanes.
    #[inline]
    fn rhs_lanes(&self, at: LanePoint<'_>, f: &mut [Lanes]) {
        lanes::rhs_of_any(self, at, f);
    }

    /// [`System::linearize`] for several members of an ensemble.
    #[inline]
    fn linearize_lanes(
        &self,
        at: LanePoint<'_>,
        udot: &[Lanes],
        f: &mut [Lanes],
        jacobian: &mut [Lanes],
        dfdt: &mut [Lanes],
    ) {
        lanes::linearize_any(self, at, udot, f, jacobian, dfdt);
    }

    /// [`System::outputs`] for several members of an ensemble, or several times of one.
    #[inline]
    fn outputs_lanes(&self, at: LanePoint<'_>, w: &mut [Lanes]) {
        lanes::outputs_of_any(self, at, w);
    }
}
