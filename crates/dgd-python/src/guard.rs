//! Runs the work of a call from Python: in a thread, with signals, and with panics caught.

use std::any::Any;
use std::panic::{self, AssertUnwindSafe};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use dgd_work::WorkError;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

use crate::errors::{self, RequestedTask};
use crate::observer::PyObserver;
use crate::workers;

/// Interval at which a waiting caller checks for signals and shows progress.
const BETWEEN: Duration = Duration::from_millis(50);

/// Place and message of the last panic.
static PANIC: Mutex<Option<String>> = Mutex::new(None);

/// Silences panics, unless `RUST_BACKTRACE` requests a backtrace.
pub(crate) fn hear_panics() {
    let speaks = std::env::var_os("RUST_BACKTRACE").is_some_and(|value| value != "0");
    let before = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        if !dgd_data::catches_panics() {
            let place = info.location().map(ToString::to_string).unwrap_or_default();
            let words = format!("{place}: {}", words(info.payload()));
            panicked().get_or_insert(words);
        }
        if speaks {
            before(info);
        }
    }));
}

fn panicked() -> std::sync::MutexGuard<'static, Option<String>> {
    PANIC.lock().unwrap_or_else(PoisonError::into_inner)
}

fn words(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("no message").split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The exception for a panic.
fn internal(py: Python<'_>, payload: &(dyn Any + Send)) -> PyErr {
    let words = panicked().take().unwrap_or_else(|| words(payload));
    errors::internal(py, &words)
}

/// A result, or a panic's message.
pub(crate) type CaughtPanic<T> = Result<Result<T, WorkError>, Box<dyn Any + Send>>;

/// Runs a function and catches its panics.
pub(crate) fn caught<T>(work: impl FnOnce() -> Result<T, WorkError>) -> CaughtPanic<T> {
    panic::catch_unwind(AssertUnwindSafe(work))
}

/// Converts a result for Python.
pub(crate) fn ended<T>(py: Python<'_>, task: RequestedTask, ended: CaughtPanic<T>) -> PyResult<T> {
    match ended {
        Ok(result) => result.map_err(|error| errors::of_work(py, &error, task)),
        Err(payload) => Err(internal(py, &*payload)),
    }
}

/// Runs a short function with the GIL.
pub(crate) fn guarded<T>(
    py: Python<'_>,
    task: RequestedTask,
    work: impl FnOnce() -> Result<T, WorkError>,
) -> PyResult<T> {
    ended(py, task, caught(work))
}

/// Runs a long function in a thread of its own, without the GIL. Ctrl-C cancels it and returns the best result so far;
/// a second Ctrl-C, or the first if there is no result so far, ends the call at once and abandons the thread.
pub(crate) fn supervised<T: Send + 'static>(
    py: Python<'_>,
    task: RequestedTask,
    observer: &Arc<PyObserver>,
    work: impl FnOnce(&PyObserver) -> Result<T, WorkError> + Send + 'static,
) -> PyResult<T> {
    let (send, mut receive) = mpsc::sync_channel(1);
    let for_worker = Arc::clone(observer);
    let spawned = workers::spawn(move || {
        // The receiver may be gone.
        let _ = send.send(caught(|| work(&for_worker)));
    });
    let worker = match spawned {
        Ok(worker) => worker,
        Err(error) => {
            return Err(errors::internal(py, &format!("no thread could be started: {error}")));
        }
    };
    loop {
        let waited;
        (waited, receive) = py.detach(move || (receive.recv_timeout(BETWEEN), receive));
        match waited {
            Ok(result) => {
                worker.rest();
                observer.show(py)?;
                return ended(py, task, result);
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(errors::internal(py, "a thread ended without a result"));
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        if let Err(signal) = py.check_signals() {
            let goes_on =
                signal.is_instance_of::<PyKeyboardInterrupt>(py) && task.has_best_so_far();
            if observer.stop() || !goes_on {
                return Err(signal);
            }
        }
        if let Err(error) = observer.show(py) {
            observer.stop();
            return Err(error);
        }
    }
}

/// Panics in a thread of its own, or in the caller's: for tests.
#[pyfunction]
pub(crate) fn panic_for_test(py: Python<'_>, in_thread: bool) -> PyResult<()> {
    let work = || -> Result<(), WorkError> { panic!("asked for\nby {}", "a test") };
    if in_thread {
        supervised(py, RequestedTask::Simulate, &Arc::new(PyObserver::new(None)), move |_| work())
    } else {
        guarded(py, RequestedTask::Simulate, work)
    }
}
