//! Writes a table as Parquet, with the same names, units and numbers as in CSV.
//!
//! Columns are doubles, or UTF-8 if any cell is not a number; an empty cell is a null. Pages are plain and
//! uncompressed, one for each column of a row group, so that every reader can read them.

use std::io::{self, Write};
use std::mem::take;

use super::MAGIC;
use super::thrift::Encoder;

/// Cells in a row group, over all columns.
const GROUP: usize = 1 << 21;

// Constants of the format.
pub(super) const DOUBLE: i32 = 5;
pub(super) const BYTE_ARRAY: i32 = 6;
pub(super) const OPTIONAL: i32 = 1;
pub(super) const PLAIN: i32 = 0;
pub(super) const RLE: i32 = 3;
pub(super) const DATA_PAGE: i32 = 0;
pub(super) const UNCOMPRESSED: i32 = 0;
const UTF8: i32 = 0;

/// Converts CSV text in the format of [`write_table`](crate::write::write_table) to Parquet.
pub(crate) struct ParquetWriter<'a> {
    out: &'a mut dyn Write,
    /// Bytes written.
    offset: usize,
    /// The current, incomplete line.
    line: Vec<u8>,
    in_quotes: bool,
    columns: Vec<Column>,
    /// Rows in the current group.
    rows: usize,
    all_rows: usize,
    groups: Vec<Group>,
}

#[derive(Default)]
struct Column {
    name: String,
    /// Determined when the first group is written.
    kind: Option<i32>,
    /// The group's cells, concatenated, and the end of each.
    cells: Vec<u8>,
    ends: Vec<usize>,
}

struct Group {
    rows: usize,
    chunks: Vec<Chunk>,
}

struct Chunk {
    offset: usize,
    size: usize,
}

impl<'a> ParquetWriter<'a> {
    pub(crate) fn new(out: &'a mut dyn Write) -> Self {
        ParquetWriter {
            out,
            offset: 0,
            line: Vec::new(),
            in_quotes: false,
            columns: Vec::new(),
            rows: 0,
            all_rows: 0,
            groups: Vec::new(),
        }
    }

    /// Writes the last group and the metadata of the file.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        self.end_group()?;
        self.begin()?;
        let description = self.description();
        self.put(&description)?;
        self.put(&length(description.len())?.to_le_bytes())?;
        self.put(MAGIC)
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.offset += bytes.len();
        self.out.write_all(bytes)
    }

    fn begin(&mut self) -> io::Result<()> {
        if self.offset == 0 { self.put(MAGIC) } else { Ok(()) }
    }

    /// Processes a complete line.
    fn end_line(&mut self) -> io::Result<()> {
        let line = take(&mut self.line);
        let cells = cells(&line);
        if self.columns.is_empty() {
            let column = |cell: Vec<u8>| {
                let name = String::from_utf8_lossy(&cell).into_owned();
                Column { name, ..Column::default() }
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
        let rows = take(&mut self.rows);
        if rows == 0 {
            return Ok(());
        }
        self.begin()?;
        let mut chunks = Vec::new();
        for at in 0..self.columns.len() {
            let page = self.columns[at].page()?;
            let size = length(page.len())?;
            let mut header = Encoder::default();
            header.whole(|header| {
                header.i32(1, DATA_PAGE);
                header.i32(2, size);
                header.i32(3, size);
                header.structure(5, |page| {
                    page.i32(1, short(rows));
                    page.i32(2, PLAIN);
                    // Encodings of definition levels and, unused here, of repetition levels.
                    page.i32(3, RLE);
                    page.i32(4, RLE);
                });
            });
            chunks.push(Chunk { offset: self.offset, size: header.bytes.len() + page.len() });
            self.put(&header.bytes)?;
            self.put(&page)?;
        }
        self.groups.push(Group { rows, chunks });
        self.all_rows += rows;
        Ok(())
    }

    /// The metadata at the end of the file.
    fn description(&self) -> Vec<u8> {
        let kind = |column: &Column| column.kind.unwrap_or(DOUBLE);
        let mut encoder = Encoder::default();
        encoder.whole(|file| {
            file.i32(1, 1);
            let root = std::iter::once(None);
            let schema: Vec<_> = root.chain(self.columns.iter().map(Some)).collect();
            file.structs(2, &schema, |element, column| match column {
                None => {
                    element.text(4, "table");
                    element.i32(5, short(self.columns.len()));
                }
                Some(column) => {
                    element.i32(1, kind(column));
                    element.i32(3, OPTIONAL);
                    element.text(4, &column.name);
                    if kind(column) == BYTE_ARRAY {
                        element.i32(6, UTF8);
                    }
                }
            });
            file.i64(3, long(self.all_rows));
            file.structs(4, &self.groups, |group, Group { rows, chunks }| {
                let columns: Vec<_> = self.columns.iter().zip(chunks).collect();
                group.structs(1, &columns, |chunk, (column, Chunk { offset, size })| {
                    chunk.i64(2, long(*offset));
                    chunk.structure(3, |data| {
                        data.i32(1, kind(column));
                        data.integers(2, &[PLAIN, RLE]);
                        data.texts(3, &[&column.name]);
                        data.i32(4, UNCOMPRESSED);
                        data.i64(5, long(*rows));
                        data.i64(6, long(*size));
                        data.i64(7, long(*size));
                        data.i64(9, long(*offset));
                    });
                });
                group.i64(2, chunks.iter().map(|chunk| long(chunk.size)).sum());
                group.i64(3, long(*rows));
            });
            file.text(6, concat!("dgd ", env!("CARGO_PKG_VERSION")));
        });
        encoder.bytes
    }
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

impl Column {
    /// Takes the cells of the group as a page.
    fn page(&mut self) -> io::Result<Vec<u8>> {
        let (bytes, ends) = (take(&mut self.cells), take(&mut self.ends));
        let starts = std::iter::once(0).chain(ends.iter().copied());
        let cells: Vec<&[u8]> = starts.zip(&ends).map(|(start, end)| &bytes[start..*end]).collect();
        // An empty cell and `NaN` are missing numbers; an empty text is a text.
        let numbers: Option<Vec<f64>> = cells.iter().map(|cell| number(cell)).collect();
        match (self.kind, numbers) {
            (None | Some(DOUBLE), Some(numbers)) => {
                self.kind = Some(DOUBLE);
                let mut page = levels(numbers.iter().map(|number| !number.is_nan()))?;
                for number in numbers.iter().filter(|number| !number.is_nan()) {
                    page.extend_from_slice(&number.to_le_bytes());
                }
                Ok(page)
            }
            (None | Some(BYTE_ARRAY), _) => {
                self.kind = Some(BYTE_ARRAY);
                let mut page = levels(cells.iter().map(|_| true))?;
                for cell in cells {
                    page.extend_from_slice(&length(cell.len())?.to_le_bytes());
                    page.extend_from_slice(cell);
                }
                Ok(page)
            }
            _ => {
                let name = &self.name;
                Err(io::Error::other(format!("column `{name}` holds numbers, and then a text")))
            }
        }
    }
}

/// A cell's number, NaN if it is empty; `None` for a text.
fn number(cell: &[u8]) -> Option<f64> {
    if cell.is_empty() { Some(f64::NAN) } else { str::from_utf8(cell).ok()?.parse().ok() }
}

/// Presence of values, as run lengths.
fn levels(there: impl Iterator<Item = bool>) -> io::Result<Vec<u8>> {
    let mut runs: Vec<(bool, u64)> = Vec::new();
    for there in there {
        match runs.last_mut() {
            Some((last, count)) if *last == there => *count += 1,
            _ => runs.push((there, 1)),
        }
    }
    let mut bytes = vec![0; 4];
    for (there, count) in runs {
        let mut header = count << 1;
        while header >= 0x80 {
            bytes.push(header as u8 | 0x80);
            header >>= 7;
        }
        bytes.push(header as u8);
        bytes.push(there.into());
    }
    let size = length(bytes.len() - 4)?;
    bytes[..4].copy_from_slice(&size.to_le_bytes());
    Ok(bytes)
}

/// A length in the type of the format.
fn length(bytes: usize) -> io::Result<i32> {
    i32::try_from(bytes).map_err(|_| io::Error::other("a page is longer than Parquet allows"))
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

/// A count in the type of the format; no table is too long for it.
fn long(count: usize) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}

/// A count within a page or a file's list of columns.
fn short(count: usize) -> i32 {
    i32::try_from(count).unwrap_or(i32::MAX)
}
