//! Ctrl-C: it ends the program with nothing half written, unless a computation minds it by itself.

use std::sync::{Mutex, PoisonError};

use dgd_data::files;

use crate::failure::INTERRUPTED;

type Act = Box<dyn FnMut() + Send>;

/// What Ctrl-C does at present; none ends the program.
static ACT: Mutex<Option<Act>> = Mutex::new(None);

/// Minds Ctrl-C from now on. Where that cannot be had, Ctrl-C does what it does without.
pub(crate) fn mind() {
    let _ =
        ctrlc::set_handler(|| match ACT.lock().unwrap_or_else(PoisonError::into_inner).as_mut() {
            Some(act) => act(),
            None => end(),
        });
}

/// Has Ctrl-C do this.
pub(crate) fn on_interrupt(act: impl FnMut() + Send + 'static) {
    *ACT.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(act));
    mind();
}

/// Removes what is half written, and ends the program.
pub(crate) fn end() -> ! {
    // Held to the end, so that nothing new is begun.
    let _held = files::abandon();
    std::process::exit(INTERRUPTED.into())
}
