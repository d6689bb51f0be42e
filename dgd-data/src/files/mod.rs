//! Files that appear whole or not at all, alone or together in a folder, and the journal of a run.

mod draft;
mod folder;
pub mod journal;
mod whole;

pub use draft::abandon;
pub use folder::{Files, try_folder, write_folder};
pub use whole::{WriteError, try_whole, write_whole};
