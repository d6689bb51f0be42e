//! Work shared among threads, with results that do not depend on their number.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::model::Model;

/// Number of threads that share `pieces` pieces of work if `asked` were requested: at least one, and only one in a
/// build without threads.
pub fn threads_for(asked: usize, pieces: usize) -> usize {
    if cfg!(feature = "threads") { asked.clamp(1, pieces.max(1)) } else { 1 }
}

/// Results of `work` for 0 … count − 1, in this order, computed by several threads with a system each.
pub fn in_parallel<S: Clone + Send, T: Send>(
    system: &S,
    count: usize,
    threads: usize,
    work: impl Fn(&S, usize) -> T + Sync,
) -> Vec<T> {
    match threads_for(threads, count) {
        1 => (0..count).map(|i| work(system, i)).collect(),
        threads => shared_out(count, threads, || system.clone(), work),
    }
}

/// Like [`in_parallel`], with a model behind a pointer.
pub fn in_parallel_by_model<T: Send>(
    model: &dyn Model,
    count: usize,
    threads: usize,
    work: impl Fn(&dyn Model, usize) -> T + Sync,
) -> Vec<T> {
    match threads_for(threads, count) {
        1 => (0..count).map(|i| work(model, i)).collect(),
        threads => shared_out(count, threads, || model.copied(), |own, i| work(own.as_ref(), i)),
    }
}

/// Like [`in_parallel`], for work that does not need a system.
pub fn in_parallel_stateless<T: Send>(
    count: usize,
    threads: usize,
    work: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    in_parallel(&(), count, threads, |(), i| work(i))
}

/// Each thread takes the next piece when it has finished its last, since pieces take very different times.
fn shared_out<S: Send, T: Send>(
    count: usize,
    threads: usize,
    copy: impl Fn() -> S,
    work: impl Fn(&S, usize) -> T + Sync,
) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let take_turns = |system: S| {
        let mut done = Vec::new();
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= count {
                return done;
            }
            done.push((i, work(&system, i)));
        }
    };
    let mut results: Vec<(usize, T)> = std::thread::scope(|scope| {
        let take_turns = &take_turns;
        let others: Vec<_> = (1..threads)
            .map(|_| {
                let system = copy();
                scope.spawn(move || take_turns(system))
            })
            .collect();
        let mut results = take_turns(copy());
        for other in others {
            match other.join() {
                Ok(done) => results.extend(done),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        results
    });
    results.sort_by_key(|(i, _)| *i);
    results.into_iter().map(|(_, result)| result).collect()
}
