//! What JavaScript calls: no glue, only numbers and a buffer of text.
#![expect(unsafe_code, reason = "only an unsafe attribute gives a function a name outside of Rust")]

use std::panic;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::cases::CASES;

/// What the last case gave, or why it panicked.
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

/// Runs a case, whose lines are then in the buffer. Where it panics, which ends the instance, the reason is.
#[unsafe(no_mangle)]
pub extern "C" fn run(case: u32) {
    panic::set_hook(Box::new(|why| *text() = why.to_string()));
    let lines = CASES[case as usize].lines();
    *text() = lines;
}

/// Where the buffer begins.
#[unsafe(no_mangle)]
pub extern "C" fn buffer() -> *const u8 {
    text().as_ptr()
}

/// Number of bytes in the buffer.
#[unsafe(no_mangle)]
pub extern "C" fn length() -> usize {
    text().len()
}
