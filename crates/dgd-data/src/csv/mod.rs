//! Reads CSV text into the columns of a table.
//!
//! ```text
//!   bytes ─ records ─► cells ─┬─ header, rename ─► names and units
//!                             └─ rows, time, clock ─► values and seconds
//!   columns of numbers ─ numbers ─► the same, without cells
//!   columns of a Parquet file ─ groups ─► the same, some rows at a time
//! ```

pub(crate) mod clock;
#[cfg(feature = "parquet")]
pub(crate) mod groups;
pub(crate) mod header;
pub(crate) mod kept;
pub(crate) mod numbers;
pub(crate) mod records;
pub(crate) mod rename;
pub(crate) mod rows;
pub(crate) mod time;
