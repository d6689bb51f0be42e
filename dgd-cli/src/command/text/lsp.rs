//! `dgd lsp`: an editor asks, on standard input.

use crate::failure::CommandError;

pub(crate) fn run() -> Result<(), CommandError> {
    dgd_lsp::serve_stdio()
        .map_err(|error| CommandError::Found(format!("the editor's connection broke: {error}")))
}
