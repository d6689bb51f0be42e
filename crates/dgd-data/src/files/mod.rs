//! Atomic files: single, together in a folder, or shared with other machines; and the journal of a run.

mod draft;
mod folder;
pub mod journal;
mod once;
mod whole;

pub use draft::abandon;
pub use folder::{ResultFolder, try_folder, write_folder};
pub use once::{make_folder, remove_left_over, write_first, write_shared};
pub use whole::{WriteError, try_whole, write_whole};
