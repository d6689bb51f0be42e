//! Writes a table as Parquet, with the same names, units and numbers as in CSV.
//!
//! Columns are doubles, or UTF-8 if any cell is not a number; an empty cell is a null. Pages are plain and
//! uncompressed, so that every reader can read them.

use std::io::{self, Write};
use std::mem::take;
use std::sync::Arc;

use bytes::Bytes;
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::Result;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::Type;

/// Cells in a row group, over all columns.
const GROUP: usize = 1 << 21;

/// Converts CSV text in the format of [`write_table`](crate::write::write_table) to Parquet.
pub(crate) struct ParquetWriter<'a> {
    out: &'a mut dyn Write,
    /// The current, incomplete line.
    line: Vec<u8>,
    in_quotes: bool,
    columns: Vec<ChunkColumn>,
    /// Rows in the current group.
    rows: usize,
    /// Begun with the first group, whose cells determine the types of the columns. Its bytes are moved to `out`.
    file: Option<SerializedFileWriter<Vec<u8>>>,
}

#[derive(Default)]
struct ChunkColumn {
    name: String,
    is_text: bool,
    /// The group's cells, concatenated, and the end of each.
    cells: Vec<u8>,
    ends: Vec<usize>,
}

impl<'a> ParquetWriter<'a> {
    pub(crate) fn new(out: &'a mut dyn Write) -> Self {
        ParquetWriter {
            out,
            line: Vec::new(),
            in_quotes: false,
            columns: Vec::new(),
            rows: 0,
            file: None,
        }
    }

    /// Writes the last group and the metadata of the file.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        self.end_group()?;
        let file = match self.file.take() {
            Some(file) => Ok(file),
            None => begin(&self.columns),
        };
        let rest = file.and_then(SerializedFileWriter::into_inner).map_err(io::Error::other)?;
        self.out.write_all(&rest)
    }

    /// Processes a complete line.
    fn end_line(&mut self) -> io::Result<()> {
        let line = take(&mut self.line);
        let cells = cells(&line);
        if self.columns.is_empty() {
            let column = |cell: Vec<u8>| {
                let name = String::from_utf8_lossy(&cell).into_owned();
                ChunkColumn { name, ..ChunkColumn::default() }
            };
            self.columns = cells.into_iter().map(column).collect();
            return Ok(());
        }
        if cells.len() != self.columns.len() {
            return Err(io::Error::other("a row does not have the cells of the header"));
        }
        for (column, cell) in self.columns.iter_mut().zip(cells) {
            column.cells.extend_from_slice(&cell);
            column.ends.push(column.cells.len());
        }
        self.rows += 1;
        if self.rows * self.columns.len() >= GROUP { self.end_group() } else { Ok(()) }
    }

    fn end_group(&mut self) -> io::Result<()> {
        if take(&mut self.rows) == 0 {
            return Ok(());
        }
        let file = match &mut self.file {
            Some(file) => {
                if let Some(mixed) = self.columns.iter().find(|one| !one.is_text && one.has_text())
                {
                    let message = format!("column `{}` holds numbers, and then a text", mixed.name);
                    return Err(io::Error::other(message));
                }
                file
            }
            none => {
                self.columns.iter_mut().for_each(|column| column.is_text = column.has_text());
                none.insert(begin(&self.columns).map_err(io::Error::other)?)
            }
        };
        write_group(file, &mut self.columns).map_err(io::Error::other)?;
        file.flush()?;
        self.out.write_all(&take(file.inner_mut()))
    }
}

/// Begins a file with these columns.
fn begin(columns: &[ChunkColumn]) -> Result<SerializedFileWriter<Vec<u8>>> {
    let field = |column: &ChunkColumn| {
        let (kind, logical) = if column.is_text {
            (Physical::BYTE_ARRAY, Some(LogicalType::String))
        } else {
            (Physical::DOUBLE, None)
        };
        let field = Type::primitive_type_builder(&column.name, kind);
        field.with_repetition(Repetition::OPTIONAL).with_logical_type(logical).build().map(Arc::new)
    };
    let fields = columns.iter().map(field).collect::<Result<_>>()?;
    let schema = Type::group_type_builder("table").with_fields(fields).build()?;
    let properties = WriterProperties::builder()
        .set_created_by(concat!("dgd ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_compression(Compression::UNCOMPRESSED)
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::None)
        .build();
    SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))
}

/// Moves the cells of the columns to a group of rows.
fn write_group(
    file: &mut SerializedFileWriter<Vec<u8>>,
    columns: &mut [ChunkColumn],
) -> Result<()> {
    let mut group = file.next_row_group()?;
    for column in columns {
        let chunk = group.next_column()?;
        column.write(chunk.unwrap_or_else(|| unreachable!("the schema has all columns")))?;
    }
    group.close()?;
    Ok(())
}

impl Write for ParquetWriter<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        for byte in bytes {
            self.in_quotes ^= *byte == b'"';
            if *byte == b'\n' && !self.in_quotes {
                self.end_line()?;
            } else {
                self.line.push(*byte);
            }
        }
        Ok(bytes.len())
    }

    /// Rows wait until their group is complete.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl ChunkColumn {
    fn cells(&self) -> impl Iterator<Item = &[u8]> {
        ranges(&self.ends).map(|(start, end)| &self.cells[start..end])
    }

    fn has_text(&self) -> bool {
        self.cells().any(|cell| number(cell).is_none())
    }

    /// Moves the cells of the group to the file.
    fn write(&mut self, mut chunk: SerializedColumnWriter<'_>) -> Result<()> {
        if self.is_text {
            // An empty text is a text.
            let there = vec![1; self.ends.len()];
            let (cells, ends) = (Bytes::from(take(&mut self.cells)), take(&mut self.ends));
            let texts: Vec<ByteArray> =
                ranges(&ends).map(|(start, end)| cells.slice(start..end).into()).collect();
            chunk.typed::<ByteArrayType>().write_batch(&texts, Some(&there), None)?;
        } else {
            // An empty cell and `NaN` are missing numbers.
            let mut numbers: Vec<f64> = self.cells().filter_map(number).collect();
            let there: Vec<i16> = numbers.iter().map(|one| i16::from(!one.is_nan())).collect();
            numbers.retain(|one| !one.is_nan());
            chunk.typed::<DoubleType>().write_batch(&numbers, Some(&there), None)?;
            self.cells.clear();
            self.ends.clear();
        }
        chunk.close()
    }
}

/// The ranges of cells that follow each other, from their ends.
fn ranges(ends: &[usize]) -> impl Iterator<Item = (usize, usize)> {
    let starts = std::iter::once(0).chain(ends.iter().copied());
    starts.zip(ends.iter().copied())
}

/// A cell's number, NaN if it is empty; `None` for a text.
fn number(cell: &[u8]) -> Option<f64> {
    if cell.is_empty() { Some(f64::NAN) } else { str::from_utf8(cell).ok()?.parse().ok() }
}

/// The cells of a line, without their quotes.
fn cells(line: &[u8]) -> Vec<Vec<u8>> {
    let (mut cells, mut cell) = (Vec::new(), Vec::new());
    let (mut in_quotes, mut was_quote) = (false, false);
    for byte in line {
        match byte {
            b'"' => {
                // Two quotes stand for one.
                if was_quote && !in_quotes {
                    cell.push(b'"');
                }
                in_quotes = !in_quotes;
            }
            b',' if !in_quotes => cells.push(take(&mut cell)),
            _ => cell.push(*byte),
        }
        was_quote = *byte == b'"';
    }
    cells.push(cell);
    cells
}
