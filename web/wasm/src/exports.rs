//! Functions called by JavaScript: no glue code, only numbers and a text buffer.
#![expect(unsafe_code, reason = "only an unsafe attribute gives a function a name outside of Rust")]

use std::panic;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::cases::CASES;

/// The lines of the last case, or the message of its panic.
static TEXT: Mutex<String> = Mutex::new(String::new());

fn text() -> MutexGuard<'static, String> {
    TEXT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Number of cases.
#[unsafe(no_mangle)]
pub extern "C" fn cases() -> u32 {
    CASES.len() as u32
}

/// Whether a case takes minutes: 0 or 1.
#[unsafe(no_mangle)]
pub extern "C" fn is_long(case: u32) -> u32 {
    u32::from(CASES[case as usize].is_long)
}

/// Runs a case and puts its lines into the buffer. A panic ends the instance, and its message is in the buffer.
#[unsafe(no_mangle)]
pub extern "C" fn run(case: u32) {
    panic::set_hook(Box::new(|why| *text() = why.to_string()));
    let lines = CASES[case as usize].lines();
    *text() = lines;
}

/// Address of the buffer.
#[unsafe(no_mangle)]
pub extern "C" fn buffer() -> *const u8 {
    text().as_ptr()
}

/// Number of bytes in the buffer.
#[unsafe(no_mangle)]
pub extern "C" fn length() -> usize {
    text().len()
}
