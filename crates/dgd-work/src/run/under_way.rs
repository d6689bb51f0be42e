//! Progress of a single run while it goes on.

use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

use dgd_identify::{Progress, Total};
use dgd_runtime::{IntegrateError, RunMonitor};

use crate::output::quantity::moment;
use crate::session::TaskContext;

/// Interval between reports.
const BETWEEN: Duration = Duration::from_millis(100);

/// Runs work that proceeds once from one time to another, s, while another thread reports its progress to the listener.
/// Without a [`RunMonitor`], a second thread, or a listener, nothing is reported.
pub(crate) fn told<T>(
    session: TaskContext<'_>,
    [from, until]: [f64; 2],
    work: impl FnOnce() -> T,
) -> T {
    let hears = session.listener.hears_progress();
    let Some(watched) = session.listener.watched().filter(|_| hears) else { return work() };
    watched.tell(from);
    let end = EndSignal::default();
    std::thread::scope(|scope| {
        let tell = || {
            while !end.comes_within(BETWEEN) {
                session.listener.advanced(so_far(watched, from, until));
            }
        };
        let teller = std::thread::Builder::new().spawn_scoped(scope, tell);
        // This holds even if the work panics: the scope waits for its threads.
        let _ends = EndOnDrop(&end);
        drop(teller);
        work()
    })
}

/// Whether a run was cancelled, and why it did not reach its end.
pub(crate) fn stopped_by(
    error: Option<&IntegrateError>,
    [_, until]: [f64; 2],
) -> (bool, Option<String>) {
    match error {
        None => (false, None),
        Some(IntegrateError::Stopped { t }) => {
            let (t, until) = (moment(*t), moment(until));
            let words =
                format!("stopped by Ctrl-C at {t} of {until}: the result has the rows up to there");
            (true, Some(words))
        }
        Some(error) => (false, Some(error.to_string())),
    }
}

fn so_far(watched: &RunMonitor, from: f64, until: f64) -> Progress {
    let part = (watched.reached() - from) / (until - from);
    // A run without length has made no progress.
    let percent = (100.0 * part).clamp(0.0, 100.0) as usize;
    Progress { what: "percent simulated", done: percent, of: Total::Exactly(100) }
}

/// Signals the end of the work.
#[derive(Default)]
struct EndSignal {
    is_over: Mutex<bool>,
    comes: Condvar,
}

impl EndSignal {
    fn comes_within(&self, time: Duration) -> bool {
        let is_over = self.is_over.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.comes.wait_timeout_while(is_over, time, |is_over| !*is_over);
        *waited.unwrap_or_else(PoisonError::into_inner).0
    }
}

/// Signals the end of the work when dropped.
struct EndOnDrop<'a>(&'a EndSignal);

impl Drop for EndOnDrop<'_> {
    fn drop(&mut self) {
        *self.0.is_over.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.0.comes.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_told_in_percent() {
        static WATCHED: RunMonitor = RunMonitor::new();
        for (reached, percent) in [(10.0, 0), (12.0, 10), (29.9, 99), (30.0, 100), (31.0, 100)] {
            WATCHED.tell(reached);
            let Progress { done, of, .. } = so_far(&WATCHED, 10.0, 30.0);
            assert_eq!((done, of), (percent, Total::Exactly(100)));
        }
        // NaN counts as 0.
        assert_eq!(so_far(&WATCHED, 31.0, 31.0).done, 0);
    }
}
