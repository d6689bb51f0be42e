//! A language server for `.dgd` files.
//!
//! One thread reads and answers messages: a model compiles in a few milliseconds. A change is analysed when no newer
//! message is waiting, first with the chosen variants, then with the others after a pause. A request that crashes is
//! answered with an error, and no document is lost.

mod analysis;
mod answer;
mod dimensions;
mod failure;
mod files;
mod places;
mod server;
#[cfg(test)]
mod tests;
mod transport;

use std::error::Error;
use std::io::{BufReader, stdin, stdout};

use lsp_server::Connection;

/// Serves an editor on standard input and output until it disconnects.
///
/// # Errors
///
/// If the connection breaks, or the editor violates the protocol.
pub fn serve_stdio() -> Result<(), Box<dyn Error + Send + Sync>> {
    transport::serve_stream(BufReader::new(stdin()), stdout())
}

/// Serves an editor at the other end of a connection until it disconnects.
///
/// # Errors
///
/// If the connection breaks, or the editor violates the protocol.
pub fn serve(connection: &Connection) -> Result<(), Box<dyn Error + Send + Sync>> {
    server::run(connection)
}
