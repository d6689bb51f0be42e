//! What JavaScript calls: no glue, only numbers and two buffers of text.
#![expect(unsafe_code, reason = "only an unsafe attribute gives a function a name outside of Rust")]

use std::panic;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::room::Room;

/// What JavaScript wrote.
static ASKED: Mutex<Vec<u8>> = Mutex::new(Vec::new());

/// The answer, or why there is none.
static ANSWER: Mutex<String> = Mutex::new(String::new());

/// What is open.
static ROOM: Mutex<Option<Room>> = Mutex::new(None);

fn held<T>(one: &'static Mutex<T>) -> MutexGuard<'static, T> {
    one.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes room for a text of so many bytes, and says where.
#[unsafe(no_mangle)]
pub extern "C" fn room(length: usize) -> *mut u8 {
    let mut asked = held(&ASKED);
    asked.clear();
    asked.resize(length, 0);
    asked.as_mut_ptr()
}

/// Answers the text that was written. Where it panics, which ends the instance, the reason is the answer.
#[unsafe(no_mangle)]
pub extern "C" fn answer() {
    panic::set_hook(Box::new(|why| *held(&ANSWER) = why.to_string()));
    let asked = std::mem::take(&mut *held(&ASKED));
    let answer = held(&ROOM).get_or_insert_with(Room::default).answer(&asked);
    *held(&ANSWER) = answer;
}

/// Where the answer begins.
#[unsafe(no_mangle)]
pub extern "C" fn buffer() -> *const u8 {
    held(&ANSWER).as_ptr()
}

/// Number of bytes of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn length() -> usize {
    held(&ANSWER).len()
}
