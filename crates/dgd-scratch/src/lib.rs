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
#[cfg(target_os = "linux")]
mod watch;

use std::fmt;
use std::path::{Path, PathBuf};

#[cfg(target_os = "linux")]
pub use arena::Scratch;

/// How much is held, and where the rest lies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limits {
    /// Bytes that the process may hold.
    pub memory: u64,
    /// The folder of the file, on a disk.
    pub folder: PathBuf,
}

/// Why memory cannot lie in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Refusal {
    /// It already does.
    Twice,
    /// The system is not Linux.
    System,
    /// The program has another allocator than [`Scratch`].
    Allocator,
    /// Files of this folder are held in memory themselves.
    InMemory(PathBuf),
    /// The process holds so many bytes before it has begun, and may hold no more than so many.
    Little {
        /// Bytes that it holds.
        held: u64,
        /// Bytes that it may hold.
        memory: u64,
    },
    /// The system refused the file.
    File(PathBuf, String),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::Twice => f.write_str("memory is limited already"),
            Refusal::System => f.write_str("memory is limited on Linux only"),
            Refusal::Allocator => f.write_str("this program's memory cannot be limited"),
            Refusal::InMemory(folder) => {
                write!(
                    f,
                    "files in `{}` are held in memory: name a folder on a disk",
                    folder.display()
                )
            }
            Refusal::Little { held, memory } => write!(
                f,
                "{} are too little: the program alone holds {}, and needs twice that to work with",
                shown(*memory),
                shown(*held)
            ),
            Refusal::File(folder, why) => {
                write!(f, "no file can lie in `{}`: {why}", folder.display())
            }
        }
    }
}

/// What ends a program that works this way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trouble {
    /// The disk has no room for so many bytes more.
    Full(u64),
    /// So many bytes are held in pieces too small to lie in the file.
    Beyond(u64),
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Trouble::Full(bytes) => {
                write!(f, "the disk has no room for {} more of scratch data", shown(*bytes))
            }
            Trouble::Beyond(held) => write!(
                f,
                "{} are held in pieces too small to lie on the disk, which is more than was allowed",
                shown(*held)
            ),
        }
    }
}

/// A number of bytes as people write it.
fn shown(bytes: u64) -> String {
    let bytes = bytes as f64;
    if bytes >= 1e9 { format!("{:.1} GB", bytes / 1e9) } else { format!("{:.0} MB", bytes / 1e6) }
}

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
