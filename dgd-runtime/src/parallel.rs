//! Work on several recordings at a time.

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
    let threads = threads_for(threads, count);
    if threads == 1 {
        return (0..count).map(|i| work(system, i)).collect();
    }
    let mut results: Vec<Option<T>> = (0..count).map(|_| None).collect();
    let share = count.div_ceil(threads);
    std::thread::scope(|scope| {
        for (k, results) in results.chunks_mut(share).enumerate() {
            let (system, work) = (system.clone(), &work);
            scope.spawn(move || {
                for (i, result) in results.iter_mut().enumerate() {
                    *result = Some(work(&system, k * share + i));
                }
            });
        }
    });
    results.into_iter().flatten().collect()
}
