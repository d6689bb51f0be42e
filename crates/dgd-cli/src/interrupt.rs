//! Ctrl-C: ends the program without incomplete files, unless a computation handles it.

use std::sync::{Mutex, PoisonError};

use dgd_data::files;

use crate::failure::INTERRUPTED;

type InterruptAction = Box<dyn FnMut() + Send>;

/// The current action on Ctrl-C; without one, the program ends.
static ACT: Mutex<Option<InterruptAction>> = Mutex::new(None);

/// Handles Ctrl-C from now on. If the handler cannot be installed, Ctrl-C keeps its default action.
pub(crate) fn mind() {
    let _ =
        ctrlc::set_handler(|| match ACT.lock().unwrap_or_else(PoisonError::into_inner).as_mut() {
            Some(act) => act(),
            None => end(),
        });
}

/// Sets the action on Ctrl-C.
pub(crate) fn on_interrupt(act: impl FnMut() + Send + 'static) {
    *ACT.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(act));
    mind();
}

/// Removes incomplete files, and ends the program.
pub(crate) fn end() -> ! {
    // Held to the end, so that no new file is begun.
    let _held = files::abandon();
    std::process::exit(INTERRUPTED.into())
}
