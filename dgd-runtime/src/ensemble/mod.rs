//! Runs one model many times with different parameters, start values or inputs.
//!
//! Several members run side by side, one in each lane of the machine's vector registers ([`lanes`]), on several
//! threads. A member's result does not depend on its neighbours, its place, or the number of threads. It equals that of
//! [`simulate`](crate::simulate) up to the rounding of step sizes.
//!
//! Lanes are for models without events, delays and sensitivities, with up to a few dozen unknowns, and for Rosenbrock
//! and explicit methods. Everything else, and any member that fails in a lane, is run by `simulate` itself.

mod control;
mod dense;
mod elimination;
mod explicit;
mod first_step;
pub mod lanes;
mod observer;
mod pack;
pub mod parallel;
mod power;
mod rosenbrock;
mod single;
mod stage;
mod times;

pub use lanes::{LANES, LanePoint, LaneStorage, Lanes};

use crate::ensemble::parallel::{in_parallel, threads_for};
use crate::error::Failure;
use crate::problem::{Options, Problem};
use crate::signal::Inputs;
use crate::solution::Statistics;
use crate::solved::SolvableSystem;
use crate::system::Signature;
use pack::LaneEngine;

/// A model and its members.
#[derive(Debug)]
pub struct Ensemble<'a, S> {
    /// The model.
    pub system: &'a S,
    /// The members.
    pub members: &'a [Member<'a>],
}

/// One member of an ensemble.
#[derive(Debug, Clone, Copy)]
pub struct Member<'a> {
    /// All parameters, SI.
    pub p: &'a [f64],
    /// Inputs, in the order of the signature.
    pub inputs: &'a Inputs,
    /// Start values that replace the model's, by position of the unknown, SI.
    pub start: &'a [(usize, f64)],
}

impl<'a> Member<'a> {
    /// The member as a problem of its own.
    pub fn to_problem<S>(&self, system: &'a S) -> Problem<'a, S> {
        Problem { system, p: self.p, inputs: self.inputs, start: self.start }
    }
}

/// The results of a member, quantity by quantity: the unknowns y, the outputs w and, if requested, the sensitivities of
/// both, in the order of [`System`](crate::system::System).
#[derive(Debug, Clone, Copy)]
pub struct Trajectory<'a> {
    /// The requested times, s.
    pub times: &'a [f64],
    /// Counts of the work done.
    pub statistics: Statistics,
    /// y, w, ∂y/∂θ and ∂w/∂θ.
    values: [&'a [f64]; 4],
    /// Distance from one quantity to the next in `values`.
    stride: usize,
}

impl<'a> Trajectory<'a> {
    /// The i-th unknown at all times.
    ///
    /// # Panics
    ///
    /// If there is no such unknown.
    pub fn unknown(&self, i: usize) -> &'a [f64] {
        self.quantity(0, i)
    }

    /// The i-th output at all times.
    ///
    /// # Panics
    ///
    /// If there is no such output.
    pub fn output(&self, i: usize) -> &'a [f64] {
        self.quantity(1, i)
    }

    /// The i-th sensitivity of the unknowns, ∂yₖ/∂θⱼ with i = j n + k, at all times.
    ///
    /// # Panics
    ///
    /// If there is none, or sensitivities were not requested.
    pub fn sensitivity(&self, i: usize) -> &'a [f64] {
        self.quantity(2, i)
    }

    /// The i-th sensitivity of the outputs, ∂wₖ/∂θⱼ with i = j n_w + k, at all times.
    ///
    /// # Panics
    ///
    /// If there is none, or sensitivities were not requested.
    pub fn output_sensitivity(&self, i: usize) -> &'a [f64] {
        self.quantity(3, i)
    }

    fn quantity(&self, kind: usize, i: usize) -> &'a [f64] {
        let values = &self.values[kind][i * self.stride..(i + 1) * self.stride];
        &values[..self.times.len()]
    }

    /// An owned copy.
    pub fn to_kept(&self) -> OwnedTrajectory {
        let results = |kind: usize| {
            let count = self.values[kind].len() / self.stride.max(1);
            (0..count).flat_map(|i| self.quantity(kind, i)).copied().collect()
        };
        OwnedTrajectory {
            values: [results(0), results(1), results(2), results(3)],
            statistics: self.statistics,
        }
    }
}

/// The owned results of a member.
#[derive(Debug, Clone, PartialEq)]
pub struct OwnedTrajectory {
    /// Counts of the work done.
    pub statistics: Statistics,
    /// As in [`Trajectory`], without gaps.
    values: [Vec<f64>; 4],
}

impl OwnedTrajectory {
    /// Values from another source: unknowns and outputs, each at all times.
    pub fn new(unknowns: Vec<f64>, outputs: Vec<f64>, statistics: Statistics) -> Self {
        Self { statistics, values: [unknowns, outputs, Vec::new(), Vec::new()] }
    }

    /// The results as a trajectory at the requested times.
    ///
    /// # Panics
    ///
    /// If quantities are read with a different number of times.
    pub fn to_trajectory<'a>(&'a self, times: &'a [f64]) -> Trajectory<'a> {
        let values = self.values.each_ref().map(Vec::as_slice);
        Trajectory { times, statistics: self.statistics, values, stride: times.len() }
    }
}

/// The quantities to compute for each member.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EnsembleQuantities {
    /// Only unknowns.
    Unknowns,
    /// Unknowns and outputs.
    #[default]
    Values,
    /// Also sensitivities to the model's directions.
    Sensitivities,
}

/// Runs all members to all requested `times` on up to `threads` threads, and returns their results in order; a failure
/// concerns only its own member.
pub fn simulate<S: SolvableSystem + Clone + Send>(
    ensemble: &Ensemble<'_, S>,
    times: &[f64],
    options: &Options,
    threads: usize,
) -> Vec<Result<OwnedTrajectory, Failure>> {
    reduce(ensemble, times, options, EnsembleQuantities::Values, threads, |_, outcome| {
        outcome.map(|trajectory| trajectory.to_kept())
    })
}

/// Number of members that a thread runs at a time.
pub fn members_at_a_time(signature: &Signature) -> usize {
    if lanes::suit(signature) { LANES } else { 1 }
}

/// Like [`simulate`], but returns what `reduce` makes of each member instead of all its values; `reduce` receives the
/// member's number.
pub fn reduce<S: SolvableSystem + Clone + Send, T: Send>(
    ensemble: &Ensemble<'_, S>,
    times: &[f64],
    options: &Options,
    wanted: EnsembleQuantities,
    threads: usize,
    reduce: impl Fn(usize, Result<Trajectory<'_>, Failure>) -> T + Sync,
) -> Vec<T> {
    let count = ensemble.members.len();
    let threads = threads_for(threads, count.div_ceil(LANES));
    // Whole packs, so that no thread has empty lanes.
    let share = count.div_ceil(threads).next_multiple_of(LANES);
    let parts = in_parallel(ensemble.system, threads, threads, |system, part| {
        let range = (part * share).min(count)..((part + 1) * share).min(count);
        let members = &ensemble.members[range.clone()];
        run_part(system, members, times, options, wanted, |i, outcome| {
            reduce(range.start + i, outcome)
        })
    });
    parts.into_iter().flatten().collect()
}

/// Runs the members of one thread.
fn run_part<'a, S: SolvableSystem, T>(
    system: &'a S,
    members: &'a [Member<'a>],
    times: &'a [f64],
    options: &'a Options,
    wanted: EnsembleQuantities,
    reduce: impl Fn(usize, Result<Trajectory<'_>, Failure>) -> T,
) -> Vec<T> {
    let mut results: Vec<Option<T>> = members.iter().map(|_| None).collect();
    let has_lanes = wanted != EnsembleQuantities::Sensitivities && lanes::suit(system.signature());
    if has_lanes && let Some(mut pack) = LaneEngine::new(system, times, options, wanted) {
        let mut waiting = members.iter().enumerate();
        let next = || waiting.next().map(|(i, member)| (i, member.to_problem(system)));
        pack.run(next, |done| {
            // Missing members are run below.
            if let Ok(done) = done {
                let trajectory = Trajectory {
                    times,
                    statistics: done.statistics,
                    values: [done.unknowns, done.outputs, &[], &[]],
                    stride: done.stride,
                };
                results[done.member] = Some(reduce(done.member, Ok(trajectory)));
            }
        });
    }
    let singly = |(i, result): (usize, Option<T>)| {
        result.unwrap_or_else(|| {
            let outcome = single::run(&members[i].to_problem(system), times, options, wanted);
            let outcome = outcome.as_ref().map_err(Failure::clone);
            reduce(i, outcome.map(|kept| kept.to_trajectory(times)))
        })
    };
    results.into_iter().enumerate().map(singly).collect()
}

#[cfg(test)]
mod tests;
