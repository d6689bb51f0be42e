//! Reads Parquet files into columns, and writes tables as Parquet, with the `parquet` crate.
//!
//! Only the needed columns of a file are read, by groups of rows, so that memory holds just a few pages of one column
//! in addition to the table.
//!
//! Without the feature `parquet`, files are only recognised.

#[cfg(feature = "parquet")]
mod read;
#[cfg(feature = "parquet")]
mod write;

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

#[cfg(feature = "parquet")]
pub(crate) use read::read;
#[cfg(feature = "parquet")]
pub(crate) use write::ParquetWriter;

/// Magic bytes at both ends of a Parquet file.
pub(crate) const MAGIC: &[u8] = b"PAR1";

/// A file with random access.
pub(crate) enum RandomAccess {
    Memory(Vec<u8>),
    File(File),
}

impl RandomAccess {
    /// Its length in bytes.
    pub(crate) fn len(&self) -> io::Result<u64> {
        match self {
            RandomAccess::Memory(bytes) => Ok(bytes.len() as u64),
            RandomAccess::File(file) => Ok(file.metadata()?.len()),
        }
    }

    /// A range of bytes within the file.
    pub(crate) fn bytes(&self, from: u64, length: usize) -> io::Result<Vec<u8>> {
        match self {
            RandomAccess::Memory(bytes) => {
                let from = usize::try_from(from).ok();
                let part = from.and_then(|from| bytes.get(from..from.checked_add(length)?));
                part.map(<[u8]>::to_vec).ok_or_else(|| io::ErrorKind::UnexpectedEof.into())
            }
            RandomAccess::File(file) => {
                let mut file: &File = file;
                file.seek(SeekFrom::Start(from))?;
                let mut bytes = Vec::new();
                file.take(length as u64).read_to_end(&mut bytes)?;
                if bytes.len() < length {
                    return Err(io::ErrorKind::UnexpectedEof.into());
                }
                Ok(bytes)
            }
        }
    }

    /// Whether it begins and ends like a Parquet file.
    pub(crate) fn is_parquet(&self) -> bool {
        let n = MAGIC.len();
        let is_magic = |from: u64| self.bytes(from, n).is_ok_and(|bytes| bytes == MAGIC);
        let end = self.len().ok().and_then(|length| length.checked_sub(n as u64));
        end.is_some_and(|end| end >= n as u64 && is_magic(0) && is_magic(end))
    }
}

/// Some rows of a column.
#[cfg(feature = "parquet")]
pub(crate) enum ColumnChunk {
    /// Numbers, NaN for missing ones.
    Numbers(Vec<f64>),
    /// Texts, empty for missing ones.
    Texts(Vec<String>),
    /// A text for each of this many rows of an unsupported type.
    Other(&'static str, usize),
}

/// Receives the columns of a file.
#[cfg(feature = "parquet")]
pub(crate) trait TakesColumns {
    /// Receives names, the number of rows, and the size in bytes; returns which columns are needed, or `None` to stop.
    fn begin(&mut self, names: &[String], n_rows: usize, bytes: u64) -> Option<Vec<bool>>;

    /// Receives the next rows of a column. Columns come one after the other.
    fn take(&mut self, column: usize, cells: ColumnChunk);
}

/// Whether a panic of this thread, in the library that reads Parquet, is caught and becomes a message, so that a panic
/// hook should stay silent.
pub fn catches_panics() -> bool {
    #[cfg(feature = "parquet")]
    return read::catches_panics();
    #[cfg(not(feature = "parquet"))]
    false
}

/// A CSV table as a Parquet file.
#[cfg(all(test, feature = "parquet"))]
pub(crate) fn written(csv: &str) -> Vec<u8> {
    use std::io::Write as _;

    let mut bytes = Vec::new();
    let mut writer = ParquetWriter::new(&mut bytes);
    writer.write_all(csv.as_bytes()).expect("to memory");
    writer.finish().expect("to memory");
    bytes
}

#[cfg(all(test, feature = "parquet"))]
#[derive(Default)]
pub(crate) struct ChunkText {
    names: Vec<String>,
    columns: Vec<Vec<String>>,
    n_rows: usize,
}

#[cfg(all(test, feature = "parquet"))]
impl TakesColumns for ChunkText {
    fn begin(&mut self, names: &[String], n_rows: usize, _: u64) -> Option<Vec<bool>> {
        self.names = names.to_vec();
        self.columns = vec![Vec::new(); names.len()];
        self.n_rows = n_rows;
        Some(vec![true; names.len()])
    }

    fn take(&mut self, column: usize, cells: ColumnChunk) {
        match cells {
            ColumnChunk::Numbers(numbers) => {
                self.columns[column].extend(numbers.into_iter().map(crate::cell::shown));
            }
            ColumnChunk::Texts(texts) => self.columns[column].extend(texts),
            ColumnChunk::Other(what, rows) => {
                self.columns[column].extend(vec![what.to_owned(); rows]);
            }
        }
    }
}

#[cfg(all(test, feature = "parquet"))]
impl ChunkText {
    /// The CSV text of the columns.
    pub(crate) fn to_csv(&self) -> String {
        let line = |cells: Vec<&String>| {
            let cells: Vec<String> =
                cells.into_iter().map(|cell| crate::cell::quoted(cell)).collect();
            cells.join(",") + "\n"
        };
        let row = |k: usize| line(self.columns.iter().map(|column| &column[k]).collect());
        line(self.names.iter().collect()) + &(0..self.n_rows).map(row).collect::<String>()
    }
}
