//! Functions called by JavaScript: no glue code, only numbers and two text buffers.
#![expect(unsafe_code, reason = "only an unsafe attribute gives a function a name outside of Rust")]

use std::panic;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::room::Room;

/// The request, written by JavaScript.
static ASKED: Mutex<Vec<u8>> = Mutex::new(Vec::new());

/// The answer, or the reason why there is none.
static ANSWER: Mutex<String> = Mutex::new(String::new());

/// The open files.
static ROOM: Mutex<Option<Room>> = Mutex::new(None);

fn held<T>(one: &'static Mutex<T>) -> MutexGuard<'static, T> {
    one.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Allocates the request buffer with this many bytes, and returns its address.
#[unsafe(no_mangle)]
pub extern "C" fn room(length: usize) -> *mut u8 {
    let mut request = held(&ASKED);
    request.clear();
    request.resize(length, 0);
    request.as_mut_ptr()
}

/// Answers the request. A panic ends the instance, and its message is the answer.
#[unsafe(no_mangle)]
pub extern "C" fn answer() {
    panic::set_hook(Box::new(|why| *held(&ANSWER) = why.to_string()));
    let request = std::mem::take(&mut *held(&ASKED));
    let answer = held(&ROOM).get_or_insert_with(Room::default).answer(&request);
    *held(&ANSWER) = answer;
}

/// Address of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn buffer() -> *const u8 {
    held(&ANSWER).as_ptr()
}

/// Length of the answer in bytes.
#[unsafe(no_mangle)]
pub extern "C" fn length() -> usize {
    held(&ANSWER).len()
}
