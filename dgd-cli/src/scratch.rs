//! `--memory`: data beyond it lie in a file, by the allocator of this program.

use dgd_scratch::{Limits, Trouble, begin, default_folder};

use crate::args::{Command, Global};
use crate::console;
use crate::failure::CommandError;

/// Limits the memory of this process, where the command line says so. `job run` has others compute.
pub(crate) fn limit(command: &Command, global: &Global) -> Result<(), CommandError> {
    let Some(memory) = global.memory.filter(|_| !matches!(command, Command::Job(_))) else {
        return Ok(());
    };
    let folder = global.scratch.clone().unwrap_or_else(default_folder);
    begin(&Limits { memory, folder }, end)
        .map_err(|refusal| CommandError::Usage(format!("`--memory`: {refusal}")))
}

/// Limits the memory of a process that computes pieces. Where no file can be had for what is beyond, a piece
/// that needs more fails.
pub(crate) fn limit_pieces(memory: u64) {
    let _ = begin(&Limits { memory, folder: default_folder() }, end);
}

/// Ends the program where its data find no room.
fn end(trouble: Trouble) -> ! {
    let help = match trouble {
        Trouble::Full(_) => "`--scratch` names a folder on another disk",
        Trouble::Beyond(_) => "give `--memory` more",
    };
    console::last_words(&format!("{trouble}: {help}"));
    // What is half written is removed by the next run.
    std::process::exit(3)
}
