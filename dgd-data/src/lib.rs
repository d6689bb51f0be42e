//! Recordings and tables: files of data to columns of numbers, and back; results to files that appear whole or not at all.
//!
//! ```text
//!   CSV, CSV in gzip, Parquet ─► read ─► Table ─► select ─► columns in SI units, as a model declares them
//!                       a pipe ─► stream ─► one row after the other
//!      a program's columns ─► columns ─► Table
//!   columns in SI units ─► write ─► files ─► CSV, CSV in gzip, Parquet
//! ```
//!
//! The first line that is not a comment names the columns, `name [unit]`, and every further line
//! is a row. Where the first column is `time`, in a unit of time or as ISO 8601 stamps, the file
//! is a recording; without one its rows are independent of each other. Lines above the header
//! that start with `#` are comments. A cell that is empty, `NaN` or `NA` is a missing value.
//!
//! Reading refuses what makes the whole file doubtful: rows of another length, time that runs
//! backwards. What is wrong with one column (an unknown unit, a cell that is not a number) is told
//! when a model asks for it ([`select`]), because a recording has columns that nobody asks for.

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
pub mod stream;
mod table;
#[cfg(test)]
mod tests;
pub mod write;

pub use columns::Columns;
pub use csv::clock::Epoch;
pub use csv::rename::Rename;
pub use in_memory::{InMemory, Layers};
pub use open::{Disk, FileSystem};
pub use parquet::catches_panics;
pub use read::{Reading, cannot_read, decompressed, digest, read, read_from};
pub use table::{Cells, Column, Disorder, Location, Table};
