//! Reports a bug in dgd itself: one sentence, with the information to report.

use std::any::Any;
use std::fmt;
use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::sync::{Mutex, PoisonError};

/// The exit code for a bug in dgd: `EX_SOFTWARE` of sysexits.h.
pub(crate) const CRASHED: u8 = 70;

/// The first panic, which causes those of other threads.
static FIRST: Mutex<Option<Crash>> = Mutex::new(None);

/// A panic: its place and message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Crash {
    place: String,
    words: String,
}

impl fmt::Display for Crash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "dgd has stopped because of a mistake of its own, and has written no result; please report it with \
             the command line, the model, the data and this line: dgd {}, {}, {}: {}",
            env!("CARGO_PKG_VERSION"),
            std::env::consts::OS,
            self.place,
            self.words
        )
    }
}

/// Runs a function; a panic in it, or in threads that it waits for, becomes a [`Crash`].
///
/// Panics print nothing by themselves, unless `RUST_BACKTRACE` requests a backtrace.
pub(crate) fn caught<T>(run: impl FnOnce() -> T) -> Result<T, Crash> {
    let speaks = std::env::var_os("RUST_BACKTRACE").is_some_and(|value| value != "0");
    let before = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        if !dgd_data::catches_panics() {
            first().get_or_insert_with(|| Crash::from_panic(info));
        }
        if speaks {
            before(info);
        }
    }));
    let result = panic::catch_unwind(AssertUnwindSafe(run));
    drop(panic::take_hook());
    result.map_err(|payload| {
        first().take().unwrap_or_else(|| Crash { place: String::new(), words: words(&*payload) })
    })
}

fn first() -> std::sync::MutexGuard<'static, Option<Crash>> {
    FIRST.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Crash {
    fn from_panic(info: &PanicHookInfo<'_>) -> Self {
        let place = info.location().map(ToString::to_string).unwrap_or_default();
        Crash { place, words: words(info.payload()) }
    }
}

fn words(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    // A single line, whatever the message contains.
    text.unwrap_or("no message").split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_in_a_thread_is_one_sentence_with_its_place() {
        let crashed = caught(|| {
            std::thread::scope(|scope| {
                scope.spawn(|| panic!("two\nlines {}", 3));
            });
        });
        let crash = crashed.expect_err("it panicked");
        assert_eq!(crash.words, "two lines 3");
        let text = crash.to_string();
        assert!(text.contains("crash.rs:") && text.contains("please report"), "{text}");
        assert_eq!(text.lines().count(), 1);
        assert_eq!(caught(|| 1), Ok(1));
    }
}
