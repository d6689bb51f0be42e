//! `dgd man`: man pages, generated from the command-line definitions.

#[cfg(feature = "man")]
mod pages;
#[cfg(feature = "man")]
pub(crate) use pages::run;

#[cfg(not(feature = "man"))]
use crate::{args::ManArgs, console::Console, failure::CommandError};

/// Refuses: this build writes no man pages.
#[cfg(not(feature = "man"))]
pub(crate) fn run(_: &ManArgs, _: Console<'_>) -> Result<(), CommandError> {
    Err(CommandError::not_built("man pages", "`dgd help` prints the same text"))
}
