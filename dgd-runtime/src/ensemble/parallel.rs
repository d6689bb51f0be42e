//! Work on several recordings at a time.

use crate::model::Model;

/// How many threads share so many pieces of work, where so many were asked for: one at least, and no more where
/// this was built without threads.
pub fn threads_for(asked: usize, pieces: usize) -> usize {
    if cfg!(feature = "threads") { asked.clamp(1, pieces.max(1)) } else { 1 }
}

/// Results of `work` for 0 … count − 1, in this order, by so many threads with a system each.
pub fn in_parallel<S: Clone + Send, T: Send>(
    system: &S,
    count: usize,
    threads: usize,
    work: impl Fn(&S, usize) -> T + Sync,
) -> Vec<T> {
    match threads_for(threads, count) {
        1 => (0..count).map(|i| work(system, i)).collect(),
        threads => with_copies(count, threads, || system.clone(), work),
    }
}

/// [`in_parallel`], with a model behind a pointer.
pub fn in_parallel_by_model<T: Send>(
    model: &dyn Model,
    count: usize,
    threads: usize,
    work: impl Fn(&dyn Model, usize) -> T + Sync,
) -> Vec<T> {
    match threads_for(threads, count) {
        1 => (0..count).map(|i| work(model, i)).collect(),
        threads => with_copies(count, threads, || model.copied(), |own, i| work(own.as_ref(), i)),
    }
}

fn with_copies<S: Send, T: Send>(
    count: usize,
    threads: usize,
    copy: impl Fn() -> S,
    work: impl Fn(&S, usize) -> T + Sync,
) -> Vec<T> {
    let mut results: Vec<Option<T>> = (0..count).map(|_| None).collect();
    let share = count.div_ceil(threads);
    std::thread::scope(|scope| {
        for (k, results) in results.chunks_mut(share).enumerate() {
            let (system, work) = (copy(), &work);
            scope.spawn(move || {
                for (i, result) in results.iter_mut().enumerate() {
                    *result = Some(work(&system, k * share + i));
                }
            });
        }
    });
    results.into_iter().flatten().collect()
}
