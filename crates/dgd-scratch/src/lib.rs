//! Memory that lies in a file, so that a program works on more data than it may hold.
//!
//! ```text
//!   Vec ─► Scratch ─┬─ small, or nothing has begun ─► the system's allocator
//!                   └─ large ─► blocks of a file that is mapped into memory (arena, blocks)
//!                                ▲
//!                  watch ────────┘ lets go of its pages as the process holds more than it may
//! ```
//!
//! [`Scratch`] is the allocator of a program. A vector in the file is a vector like any other: what computes with it is the
//! same code, in the same order, and gives the same bytes, however much is held. Pages that are let go are in the file, and
//! come back as they are read; the system keeps them in memory that nobody else needs, so that a machine with enough of it reads
//! no disk. The file has no name, and ends with the process, however that ends.
//!
//! For Linux. Elsewhere [`begin`] refuses.

#[cfg(target_os = "linux")]
mod arena;
#[cfg(any(target_os = "linux", test))]
mod blocks;
mod limits;
#[cfg(target_os = "linux")]
mod watch;

use std::path::{Path, PathBuf};

#[cfg(target_os = "linux")]
pub use arena::Scratch;
pub use limits::{Limits, Refusal, Trouble};

/// Has large vectors lie in a file from now on, where [`Scratch`] is the program's allocator. `ends` says what the trouble
/// is, and ends the process.
///
/// # Errors
///
/// [`Refusal`]; then nothing has changed.
pub fn begin(limits: &Limits, ends: fn(Trouble) -> !) -> Result<(), Refusal> {
    #[cfg(target_os = "linux")]
    return watch::begin(limits, ends);
    #[cfg(not(target_os = "linux"))]
    {
        let _ = (limits, ends);
        Err(Refusal::System)
    }
}

/// Bytes that can still lie in the file; nothing where there is none.
pub fn room() -> Option<u64> {
    #[cfg(target_os = "linux")]
    return arena::Arena::of_process().map(arena::Arena::room);
    #[cfg(not(target_os = "linux"))]
    None
}

/// The system's allocator, where nothing lies in a file.
#[cfg(not(target_os = "linux"))]
pub use std::alloc::System as Scratch;

/// A folder for the file where none is named: `/var/tmp`, which systems keep on a disk, or the one for temporary files.
pub fn default_folder() -> PathBuf {
    let named = std::env::var_os("TMPDIR").map(PathBuf::from);
    named.unwrap_or_else(|| {
        let var = Path::new("/var/tmp");
        if var.is_dir() { var.to_owned() } else { std::env::temp_dir() }
    })
}
