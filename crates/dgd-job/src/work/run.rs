//! Computes the pieces of a job that have no result.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::Serialize;

use super::child::WorkerProcess;
use super::{PieceTask, WorkerAnswer, WorkerQuestion};
use crate::identity::ProgramFile;
use crate::job::{Job, JobError};
use crate::name::PieceKeys;
use crate::store::{FleetStore, PieceState};

/// A piece that ends its process this many times is recorded as failed. Random terminations rarely hit one piece so
/// often.
const ATTEMPTS: usize = 3;

/// A share of the pieces of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JobShare {
    /// All of them.
    All,
    /// A single piece, by its number from 0.
    One(usize),
    /// Every `debug`-th piece, from number `first` on.
    Every {
        /// The first.
        first: usize,
        /// The stride.
        of: usize,
    },
}

/// Settings of a run.
#[derive(Debug)]
pub struct RunPlan<'a> {
    /// The job.
    pub job: &'a Job,
    /// The store of the results.
    pub store: &'a FleetStore,
    /// The folder of the store, as passed to children.
    pub into: &'a std::path::Path,
    /// Names of the pieces.
    pub names: &'a PieceKeys,
    /// The program that children run.
    pub program: &'a ProgramFile,
    /// Number of simultaneous children.
    pub workers: usize,
    /// Threads for each piece.
    pub threads: usize,
    /// Memory limit of each piece, bytes.
    pub memory: Option<u64>,
    /// Which pieces.
    pub share: JobShare,
    /// Whether to compute failed pieces again.
    pub retries: bool,
}

/// The statistics of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct RunTally {
    /// Requested pieces.
    pub pieces: usize,
    /// Pieces that had a result, or that another run finished first.
    pub had: usize,
    /// Pieces that it computed.
    pub computed: usize,
    /// Failed pieces among all of them.
    pub failed: usize,
}

/// Computes the pieces that have no result, and calls `heard` with the number done and the total after each.
///
/// # Errors
///
/// A child cannot be started, or a result cannot be written.
pub fn run(
    plan: &RunPlan<'_>,
    heard: &(dyn Fn(usize, usize) + Sync),
) -> Result<RunTally, JobError> {
    let numbers = asked(plan.job.len(), plan.share);
    let from = begin(numbers.len());
    let queue = PieceQueue {
        plan,
        asked: &numbers,
        from,
        next: AtomicUsize::new(0),
        tally: Mutex::new(RunTally { pieces: numbers.len(), ..RunTally::default() }),
        heard,
    };
    let workers = plan.workers.min(numbers.len()).max(1);
    let ends: Vec<Result<(), JobError>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(|| queue.work())).collect();
        threads
            .into_iter()
            .map(|thread| thread.join().unwrap_or_else(|_| Err(JobError::ThreadEnded)))
            .collect()
    });
    ends.into_iter().collect::<Result<Vec<()>, JobError>>()?;
    plan.store.tidy();
    queue.tally.into_inner().map_err(|_| JobError::ThreadEnded)
}

/// The numbers of the pieces.
fn asked(len: usize, share: JobShare) -> Vec<usize> {
    match share {
        JobShare::All => (0..len).collect(),
        JobShare::One(index) => (index..len).take(1).collect(),
        JobShare::Every { first, of } => (first..len).step_by(of.max(1)).collect(),
    }
}

/// The first piece of a run. Runs that share a folder begin at different pieces and wrap around, so that they meet
/// late.
fn begin(len: usize) -> usize {
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let digest = dgd_identify::journal::Digest::EMPTY.debug(&(host, std::process::id())).value();
    if len == 0 { 0 } else { (digest % len as u128) as usize }
}

struct PieceQueue<'a> {
    plan: &'a RunPlan<'a>,
    asked: &'a [usize],
    from: usize,
    next: AtomicUsize,
    tally: Mutex<RunTally>,
    heard: &'a (dyn Fn(usize, usize) + Sync),
}

/// The outcome of a piece in this run.
enum PieceEnd {
    Had(PieceState),
    Computed(PieceState),
}

impl PieceQueue<'_> {
    /// The loop of one thread, with one child at a time.
    fn work(&self) -> Result<(), JobError> {
        let mut worker = None;
        loop {
            let k = self.next.fetch_add(1, Ordering::Relaxed);
            if k >= self.asked.len() {
                break;
            }
            let became = self.one(self.asked[(self.from + k) % self.asked.len()], &mut worker);
            if became.is_err() {
                // Ends the other threads.
                self.next.store(self.asked.len(), Ordering::Relaxed);
            }
            self.count(&became?);
        }
        if let Some(worker) = worker {
            worker.dismiss();
        }
        Ok(())
    }

    fn one(&self, index: usize, worker: &mut Option<WorkerProcess>) -> Result<PieceEnd, JobError> {
        let RunPlan { job, store, names, .. } = *self.plan;
        let piece = job.piece(index).ok_or(JobError::NoPiece(index))?;
        let name = names.key(&piece);
        match store.state(&name)? {
            Some(PieceState::Failed) if self.plan.retries => {}
            Some(state) => return Ok(PieceEnd::Had(state)),
            None => {}
        }
        let mut task = PieceTask {
            name,
            piece,
            folder: job.folder.clone(),
            into: self.plan.into.to_owned(),
            threads: self.plan.threads,
            memory: self.plan.memory,
            given_up: None,
        };
        let mut last = String::new();
        for _ in 0..ATTEMPTS {
            match self.ask(&task, worker)? {
                Ok(state) => return Ok(PieceEnd::Computed(state)),
                Err(how) => last = how,
            }
            // The child may have been terminated just after it wrote the result.
            if store.state(&task.name)? == Some(PieceState::Done) {
                return Ok(PieceEnd::Computed(PieceState::Done));
            }
        }
        task.given_up = Some(format!(
            "each of {ATTEMPTS} times that it was tried, the process that computed it {last}"
        ));
        match self.ask(&task, worker)? {
            Ok(state) => Ok(PieceEnd::Computed(state)),
            Err(how) => Err(JobError::WorkerEnded(how)),
        }
    }

    /// Sends a piece to a child, a new one if necessary; returns how the child ended if it did not answer.
    fn ask(
        &self,
        task: &PieceTask,
        worker: &mut Option<WorkerProcess>,
    ) -> Result<Result<PieceState, String>, JobError> {
        let mut child = match worker.take() {
            Some(worker) => worker,
            None => WorkerProcess::start(self.plan.program).map_err(JobError::NoProcess)?,
        };
        let state = match child.ask(&WorkerQuestion::Perform(Box::new(task.clone()))) {
            Some(WorkerAnswer::Done(_)) => PieceState::Done,
            Some(WorkerAnswer::Failed(_)) => PieceState::Failed,
            Some(WorkerAnswer::Refused(words)) => return Err(JobError::WorkerRefused(words)),
            Some(WorkerAnswer::Identity(_)) | None => return Ok(Err(child.ended())),
        };
        *worker = Some(child);
        Ok(Ok(state))
    }

    fn count(&self, became: &PieceEnd) {
        let Ok(mut tally) = self.tally.lock() else { return };
        let state = match became {
            PieceEnd::Had(state) => {
                tally.had += 1;
                state
            }
            PieceEnd::Computed(state) => {
                tally.computed += 1;
                state
            }
        };
        tally.failed += usize::from(*state == PieceState::Failed);
        (self.heard)(tally.had + tally.computed, tally.pieces);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn shares_are_all_of_it_and_none_twice() {
        assert_eq!(asked(4, JobShare::All), [0, 1, 2, 3]);
        assert_eq!(asked(4, JobShare::One(2)), [2]);
        assert_eq!(asked(4, JobShare::One(4)), [0_usize; 0]);
        for of in [1, 3, 7, 50] {
            let shares = (0..of).flat_map(|first| asked(20, JobShare::Every { first, of }));
            let numbers: Vec<usize> = shares.collect();
            assert_eq!(numbers.len(), 20);
            assert_eq!(numbers.into_iter().collect::<BTreeSet<_>>(), (0..20).collect());
        }
        assert_eq!(begin(0), 0);
        assert!(begin(10) < 10);
    }
}
