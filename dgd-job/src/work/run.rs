//! A run over the pieces of a job that have no result.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::Serialize;

use super::child::Worker;
use super::{Answer, Ask, Task};
use crate::identity::Program;
use crate::job::{Job, JobError};
use crate::name::Names;
use crate::store::{State, Store};

/// A piece whose process is ended so often is given up. Whoever ends processes at random does not end those of one piece.
const ATTEMPTS: usize = 3;

/// Which pieces of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Share {
    /// All of them.
    All,
    /// One, by its number from 0.
    One(usize),
    /// One in `of`, from number `first` on.
    Every {
        /// The first.
        first: usize,
        /// One in so many.
        of: usize,
    },
}

/// What is run, and by how many.
#[derive(Debug)]
pub struct Plan<'a> {
    /// The job.
    pub job: &'a Job,
    /// Where results belong.
    pub store: &'a Store,
    /// The folder of the store as children find it.
    pub into: &'a std::path::Path,
    /// Names of its pieces.
    pub names: &'a Names,
    /// How children are started.
    pub program: &'a Program,
    /// So many children at a time.
    pub workers: usize,
    /// Threads for each piece.
    pub threads: usize,
    /// Most memory for each piece, bytes.
    pub memory: Option<u64>,
    /// Which pieces.
    pub share: Share,
    /// Whether pieces that failed are done again.
    pub retries: bool,
}

/// What a run did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// Pieces that it was asked for.
    pub pieces: usize,
    /// Those that had a result, or that another run finished first.
    pub had: usize,
    /// Those that it computed.
    pub computed: usize,
    /// Those of all that have failed.
    pub failed: usize,
}

/// Computes the pieces that have no result. `heard` is told how many of how many are done, as they are.
///
/// # Errors
///
/// A child cannot be started, or a result cannot be written.
pub fn run(plan: &Plan<'_>, heard: &(dyn Fn(usize, usize) + Sync)) -> Result<Tally, JobError> {
    let asked = asked(plan.job.len(), plan.share);
    let from = begin(asked.len());
    let queue = Queue {
        plan,
        asked: &asked,
        from,
        next: AtomicUsize::new(0),
        tally: Mutex::new(Tally { pieces: asked.len(), ..Tally::default() }),
        heard,
    };
    let workers = plan.workers.min(asked.len()).max(1);
    let ends: Vec<Result<(), JobError>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(|| queue.work())).collect();
        threads
            .into_iter()
            .map(|thread| thread.join().unwrap_or_else(|_| Err(JobError("a thread ended".into()))))
            .collect()
    });
    ends.into_iter().collect::<Result<Vec<()>, JobError>>()?;
    plan.store.tidy();
    queue.tally.into_inner().map_err(|_| JobError("a thread ended".to_owned()))
}

/// The numbers of the pieces.
fn asked(len: usize, share: Share) -> Vec<usize> {
    match share {
        Share::All => (0..len).collect(),
        Share::One(index) => (index..len).take(1).collect(),
        Share::Every { first, of } => (first..len).step_by(of.max(1)).collect(),
    }
}

/// Where a run begins. Runs that share a folder begin at different places and go round, so that they meet late.
fn begin(len: usize) -> usize {
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let digest = dgd_identify::journal::Digest::EMPTY.of(&(host, std::process::id())).value();
    if len == 0 { 0 } else { (digest % len as u128) as usize }
}

struct Queue<'a> {
    plan: &'a Plan<'a>,
    asked: &'a [usize],
    from: usize,
    next: AtomicUsize,
    tally: Mutex<Tally>,
    heard: &'a (dyn Fn(usize, usize) + Sync),
}

/// What became of a piece in this run.
enum Became {
    Had(State),
    Computed(State),
}

impl Queue<'_> {
    /// What one thread does, with one child at a time.
    fn work(&self) -> Result<(), JobError> {
        let mut worker = None;
        loop {
            let k = self.next.fetch_add(1, Ordering::Relaxed);
            if k >= self.asked.len() {
                break;
            }
            let became = self.one(self.asked[(self.from + k) % self.asked.len()], &mut worker);
            if became.is_err() {
                // The others end, too.
                self.next.store(self.asked.len(), Ordering::Relaxed);
            }
            self.count(&became?);
        }
        if let Some(worker) = worker {
            worker.dismiss();
        }
        Ok(())
    }

    fn one(&self, index: usize, worker: &mut Option<Worker>) -> Result<Became, JobError> {
        let Plan { job, store, names, .. } = *self.plan;
        let piece =
            job.piece(index).ok_or_else(|| JobError(format!("there is no piece {index}")))?;
        let name = names.of(&piece);
        match store.state(&name)? {
            Some(State::Failed) if self.plan.retries => {}
            Some(state) => return Ok(Became::Had(state)),
            None => {}
        }
        let mut task = Task {
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
                Ok(state) => return Ok(Became::Computed(state)),
                Err(how) => last = how,
            }
            // It may have been ended just behind its result.
            if store.state(&task.name)? == Some(State::Done) {
                return Ok(Became::Computed(State::Done));
            }
        }
        task.given_up = Some(format!(
            "each of {ATTEMPTS} times that it was tried, the process that computed it {last}"
        ));
        match self.ask(&task, worker)? {
            Ok(state) => Ok(Became::Computed(state)),
            Err(how) => Err(JobError(format!("the process that was to write a result {how}"))),
        }
    }

    /// Has a child do it, a new one where there is none; how the child ended, where it did instead.
    fn ask(
        &self,
        task: &Task,
        worker: &mut Option<Worker>,
    ) -> Result<Result<State, String>, JobError> {
        let mut asked = match worker.take() {
            Some(worker) => worker,
            None => Worker::start(self.plan.program)
                .map_err(|error| JobError(format!("no process can be started: {error}")))?,
        };
        let state = match asked.ask(&Ask::Perform(Box::new(task.clone()))) {
            Some(Answer::Done(_)) => State::Done,
            Some(Answer::Failed(_)) => State::Failed,
            Some(Answer::Refused(words)) => return Err(JobError(words)),
            Some(Answer::Identity(_)) | None => return Ok(Err(asked.ended())),
        };
        *worker = Some(asked);
        Ok(Ok(state))
    }

    fn count(&self, became: &Became) {
        let Ok(mut tally) = self.tally.lock() else { return };
        let state = match became {
            Became::Had(state) => {
                tally.had += 1;
                state
            }
            Became::Computed(state) => {
                tally.computed += 1;
                state
            }
        };
        tally.failed += usize::from(*state == State::Failed);
        (self.heard)(tally.had + tally.computed, tally.pieces);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn shares_are_all_of_it_and_none_twice() {
        assert_eq!(asked(4, Share::All), [0, 1, 2, 3]);
        assert_eq!(asked(4, Share::One(2)), [2]);
        assert_eq!(asked(4, Share::One(4)), [0_usize; 0]);
        for of in [1, 3, 7, 50] {
            let shares = (0..of).flat_map(|first| asked(20, Share::Every { first, of }));
            let all: Vec<usize> = shares.collect();
            assert_eq!(all.len(), 20);
            assert_eq!(all.into_iter().collect::<BTreeSet<_>>(), (0..20).collect());
        }
        assert_eq!(begin(0), 0);
        assert!(begin(10) < 10);
    }
}
