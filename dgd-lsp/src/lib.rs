//! What an editor asks about `.dgd` files, by the Language Server Protocol.
//!
//! One thread reads messages and answers them: a model compiles in a few milliseconds. A change is looked at
//! when no newer message waits, first the chosen variants, and the others after a pause. A request that
//! crashes is answered with an error, and no document is lost.

mod analysis;
mod answer;
mod dimensions;
mod files;
mod places;
mod server;
#[cfg(test)]
mod tests;

use std::error::Error;

use lsp_server::Connection;

/// Serves an editor on standard input and output until it says goodbye.
///
/// # Errors
///
/// Where the connection breaks, or the editor does not speak the protocol.
pub fn serve_stdio() -> Result<(), Box<dyn Error + Send + Sync>> {
    let (connection, threads) = Connection::stdio();
    serve(&connection)?;
    // The writing thread ends when nothing can be sent any more.
    drop(connection);
    threads.join()?;
    Ok(())
}

/// Serves an editor at the other end of a connection until it says goodbye.
///
/// # Errors
///
/// Where the connection breaks, or the editor does not speak the protocol.
pub fn serve(connection: &Connection) -> Result<(), Box<dyn Error + Send + Sync>> {
    server::run(connection)
}
