//! `--memory`: the allocator of this program moves data beyond the limit to a file.

use dgd_scratch::{Limits, Trouble, begin, default_folder};

use crate::args::{Command, GlobalArgs};
use crate::console;
use crate::failure::CommandError;

/// Limits the memory of this process, if the command line requests it. `job run` computes in other processes.
pub(crate) fn limit(command: &Command, global: &GlobalArgs) -> Result<(), CommandError> {
    let Some(memory) = global.memory.filter(|_| !matches!(command, Command::Job(_))) else {
        return Ok(());
    };
    let folder = global.scratch.clone().unwrap_or_else(default_folder);
    begin(&Limits { memory, folder }, end)
        .map_err(|refusal| CommandError::Usage(format!("`--memory`: {refusal}")))
}

/// Limits the memory of a process that computes pieces. If there is no room for a scratch file, a piece that needs more
/// memory fails.
pub(crate) fn limit_pieces(memory: u64) {
    let _ = begin(&Limits { memory, folder: default_folder() }, end);
}

/// Ends the program when there is no room for its data.
fn end(trouble: Trouble) -> ! {
    let help = match trouble {
        Trouble::Full(_) => "`--scratch` names a folder on another disk",
        Trouble::Beyond(_) => "give `--memory` more",
    };
    console::last_words(&format!("{trouble}: {help}"));
    // The next run removes incomplete files.
    std::process::exit(3)
}
