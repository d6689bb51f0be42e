//! Limits of memory, and errors of a process that exceeds them.

use std::fmt;
use std::path::PathBuf;

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
    /// The program has another allocator than [`Scratch`](crate::Scratch).
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
