//! Parquet files, as the CSV text they stand for, and tables to Parquet.
//!
//! What dgd writes, every build reads ([`plain`]). Compressed files, dates and the rest need the `parquet`
//! crate ([`library`]), which takes longer to build than all of dgd's other file formats together.

#[cfg(feature = "parquet")]
mod library;
#[cfg_attr(feature = "parquet", allow(dead_code, reason = "the library reads all files"))]
mod plain;
mod thrift;
mod write;

pub(crate) use write::ParquetWriter;

/// What a Parquet file begins and ends with.
pub(crate) const MAGIC: &[u8] = b"PAR1";

/// Why a file was not read.
#[derive(Debug)]
pub(crate) struct Unread {
    pub(crate) why: String,
    pub(crate) help: Option<&'static str>,
}

impl From<String> for Unread {
    fn from(why: String) -> Self {
        Unread { why, help: None }
    }
}

/// The CSV text of a Parquet file.
#[cfg(feature = "parquet")]
pub(crate) fn to_csv(file: Vec<u8>) -> Result<String, Unread> {
    library::to_csv(file).map_err(|error| error.to_string().into())
}

/// The CSV text of a Parquet file that dgd wrote, or one that is as simple.
#[cfg(not(feature = "parquet"))]
#[allow(clippy::needless_pass_by_value, reason = "the library needs the bytes as its own")]
pub(crate) fn to_csv(file: Vec<u8>) -> Result<String, Unread> {
    plain::to_csv(&file)
}

/// Whether a panic of this thread, in the library that reads Parquet, is caught and becomes a message: a hook
/// for panics has nothing to say of it.
pub fn catches_panics() -> bool {
    #[cfg(feature = "parquet")]
    return library::catches_panics();
    #[cfg(not(feature = "parquet"))]
    false
}
