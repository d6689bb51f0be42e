//! Ensemble runs of a loaded model, compiled once in this crate.

use std::sync::{Mutex, PoisonError};

use dgd_runtime::ensemble::{self, Ensemble, EnsembleQuantities, Member, Trajectory};
use dgd_runtime::{Failure, Options};

use crate::loaded::LoadedSystem;

impl LoadedSystem {
    /// Like [`ensemble::reduce`], with unknowns and outputs.
    pub fn reduce_members<T: Send>(
        &self,
        members: &[Member<'_>],
        times: &[f64],
        options: &Options,
        threads: usize,
        reduce: impl Fn(usize, Result<Trajectory<'_>, Failure>) -> T + Sync,
    ) -> Vec<T> {
        let results: Vec<Mutex<Option<T>>> = members.iter().map(|_| Mutex::new(None)).collect();
        self.run_members(members, times, options, threads, &|i, outcome| {
            let result = reduce(i, outcome);
            *results[i].lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
        });
        let taken = |result: Mutex<Option<T>>| {
            let result = result.into_inner().unwrap_or_else(PoisonError::into_inner);
            result.expect("every member is handed on")
        };
        results.into_iter().map(taken).collect()
    }

    /// Passes on each member as it finishes, from any of the threads.
    fn run_members(
        &self,
        members: &[Member<'_>],
        times: &[f64],
        options: &Options,
        threads: usize,
        take: &(dyn Fn(usize, Result<Trajectory<'_>, Failure>) + Sync),
    ) {
        let ensemble = Ensemble { system: self, members };
        ensemble::reduce(&ensemble, times, options, EnsembleQuantities::Values, threads, take);
    }
}
