//! `dgd lsp`: the language server, on standard input and output.

use crate::failure::CommandError;

/// Serves until the editor ends it.
#[cfg(feature = "lsp")]
pub(crate) fn run() -> Result<(), CommandError> {
    dgd_lsp::serve_stdio()
        .map_err(|error| CommandError::Found(format!("the editor's connection broke: {error}")))
}

/// Refuses: this build has no language server.
#[cfg(not(feature = "lsp"))]
pub(crate) fn run() -> Result<(), CommandError> {
    Err(CommandError::not_built("language server", ""))
}
