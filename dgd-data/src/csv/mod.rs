//! CSV text to the columns of a table.
//!
//! ```text
//!   bytes ─ records ─► cells ─┬─ header, rename ─► names and units
//!                             └─ rows, time, clock ─► values and seconds
//! ```

pub(crate) mod clock;
pub(crate) mod header;
pub(crate) mod kept;
pub(crate) mod records;
pub(crate) mod rename;
pub(crate) mod rows;
pub(crate) mod time;
