//! Recordings and tables: reads data files into columns of numbers, and writes them; writes results atomically.
//!
//! ```text
//!   CSV, CSV in gzip, Parquet ─► read ─► Table ─► select ─► columns in SI units, as a model declares them
//!                       a pipe ─► stream ─► one row after the other
//!      a program's columns ─► columns ─► Table
//!   columns in SI units ─► write ─► files ─► CSV, CSV in gzip, Parquet
//! ```
//!
//! The first line that is not a comment names the columns, `name [unit]`, and every further line is a row. If the first
//! column is `time`, in a unit of time or as ISO 8601 timestamps, the file is a recording; without one its rows are
//! independent of each other. Lines above the header that start with `#` are comments. A cell that is empty, `NaN` or
//! `NA` is a missing value.
//!
//! Reading refuses files that are invalid as a whole: rows of another length, time that runs backwards. A fault of one
//! column (an unknown unit, a cell that is not a number) is reported when a model reads it ([`select`]), because
//! recordings have unused columns.

pub mod cell;
mod columns;
mod csv;
mod encoding;
pub mod files;
mod in_memory;
pub mod open;
mod parquet;
mod read;
pub mod select;
mod sha256;
pub mod stream;
mod table;
#[cfg(test)]
mod tests;
pub mod write;

pub use columns::DataColumns;
pub use csv::clock::Epoch;
pub use csv::rename::Rename;
pub use in_memory::{InMemory, LayeredFiles};
pub use open::{DiskFiles, FileSystem};
pub use parquet::catches_panics;
pub use read::{ReadOptions, cannot_read, decompressed, read, read_from};
pub use sha256::Sha256Digest;
pub use table::{CellRange, DataColumn, DataLocation, DataTable, TimeDisorder};
