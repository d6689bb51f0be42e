//! What ends a session before the editor disconnects.

use std::error::Error;

pub(crate) type ServerFailure = Box<dyn Error + Send + Sync>;
