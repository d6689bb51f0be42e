//! `dgd lsp`: the language server, on standard input and output.

use crate::failure::CommandError;

pub(crate) fn run() -> Result<(), CommandError> {
    dgd_lsp::serve_stdio()
        .map_err(|error| CommandError::Found(format!("the editor's connection broke: {error}")))
}
