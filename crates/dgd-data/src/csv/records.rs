//! Splits CSV text into records, with the range of every cell.
//!
//! A cell may be quoted; then `""` stands for a quote, and the cell may contain commas and line ends. Lines end in LF
//! or CRLF; blank ones are skipped. Ranges are bytes of the text, so that a diagnostic can point to them.

use std::io::{self, BufRead, Read};
use std::ops::Range;

/// Bytes of the longest record. Anything longer is not a table, and may never end.
const LONGEST: usize = 16 << 20;

/// Splits a text into records.
pub(crate) struct CsvRecords<R> {
    reader: R,
    /// Whether a record ends with its line even inside a quoted cell.
    in_lines: bool,
    /// Bytes before the next record.
    offset: usize,
    /// Line ends before the next record.
    line: usize,
    /// The last record, including its line end.
    bytes: Vec<u8>,
    cells: Vec<Range<usize>>,
}

/// A line of a table.
#[derive(Clone, Copy)]
pub(crate) struct CsvRecord<'a> {
    /// First byte in the text.
    pub(crate) offset: usize,
    /// Line in the text, from 1.
    pub(crate) line: usize,
    /// Whether a quoted cell is still open at the end of the text.
    pub(crate) open_quote: bool,
    bytes: &'a [u8],
    cells: &'a [Range<usize>],
}

impl<R: BufRead> CsvRecords<R> {
    /// Records of the rest of `reader`, which starts `offset` bytes and `line` lines into the text.
    pub(crate) fn new(reader: R, offset: usize, line: usize) -> Self {
        CsvRecords { reader, in_lines: false, offset, line, bytes: Vec::new(), cells: Vec::new() }
    }

    /// The same with one record per line, so that a growing text is never read beyond the next line.
    pub(crate) fn in_lines(self) -> Self {
        CsvRecords { in_lines: true, ..self }
    }

    /// The number of the last line.
    pub(crate) fn line(&self) -> usize {
        self.line
    }

    /// The next record that is not blank.
    pub(crate) fn next(&mut self) -> io::Result<Option<CsvRecord<'_>>> {
        loop {
            let (offset, line) = (self.offset, self.line + 1);
            self.bytes.clear();
            self.cells.clear();
            let mut splitter = CellSplitter::default();
            loop {
                let old = self.bytes.len();
                let room = (LONGEST - old) as u64;
                if (&mut self.reader).take(room).read_until(b'\n', &mut self.bytes)? == 0 {
                    break;
                }
                if self.bytes.len() == LONGEST {
                    return Err(too_long(line));
                }
                self.line += usize::from(self.bytes.ends_with(b"\n"));
                splitter.split(&self.bytes, old, &mut self.cells);
                if !splitter.in_quotes || self.in_lines {
                    break;
                }
            }
            if self.bytes.is_empty() {
                return Ok(None);
            }
            self.offset += self.bytes.len();
            self.cells.push(trim(&self.bytes, splitter.start..self.bytes.len()));
            if self.cells.len() > 1 || !self.cells[0].is_empty() {
                return Ok(Some(CsvRecord {
                    offset,
                    line,
                    open_quote: splitter.in_quotes,
                    bytes: &self.bytes,
                    cells: &self.cells,
                }));
            }
        }
    }
}

fn too_long(line: usize) -> io::Error {
    io::Error::other(format!(
        "line {line} begins a row of more than {} MB: this is not a table, or a quoted cell is not closed",
        LONGEST >> 20
    ))
}

impl<'a> CsvRecord<'a> {
    /// Number of cells.
    pub(crate) fn len(&self) -> usize {
        self.cells.len()
    }

    /// The content of a cell without its quotes; doubled quotes stay doubled.
    pub(crate) fn cell(&self, column: usize) -> &'a [u8] {
        let raw = &self.bytes[self.cells[column].clone()];
        match raw {
            [b'"', inner @ .., b'"'] => inner.trim_ascii(),
            _ => raw,
        }
    }

    /// A cell as text, with doubled quotes merged and invalid UTF-8 shown as `�`.
    pub(crate) fn text(&self, column: usize) -> String {
        let text = String::from_utf8_lossy(self.cell(column));
        if self.bytes[self.cells[column].clone()].starts_with(b"\"") {
            text.replace("\"\"", "\"")
        } else {
            text.into_owned()
        }
    }

    /// The range of a cell in the text, including quotes.
    pub(crate) fn place(&self, column: usize) -> Range<usize> {
        let cell = &self.cells[column];
        self.offset + cell.start..self.offset + cell.end
    }

    /// The end of the record in the text, including the line end.
    pub(crate) fn end(&self) -> usize {
        self.offset + self.bytes.len()
    }

    /// The range of the cells from `column` on.
    pub(crate) fn place_from(&self, column: usize) -> Range<usize> {
        self.place(column).start..self.place(self.len() - 1).end
    }
}

/// Finds the commas between cells; keeps its state from line to line.
#[derive(Default)]
struct CellSplitter {
    /// First byte of the current cell.
    start: usize,
    /// Whether that cell began with a quote.
    quoted: bool,
    /// Whether it has contained anything but blanks so far.
    begun: bool,
    in_quotes: bool,
}

impl CellSplitter {
    /// Processes `bytes[from..]`; each cell is added to `cells` at its comma.
    fn split(&mut self, bytes: &[u8], from: usize, cells: &mut Vec<Range<usize>>) {
        for (at, byte) in bytes.iter().enumerate().skip(from) {
            match byte {
                b',' if !self.in_quotes => {
                    cells.push(trim(bytes, self.start..at));
                    *self = CellSplitter { start: at + 1, ..CellSplitter::default() };
                }
                // In a quoted cell each quote closes or opens: `""` does both.
                b'"' if self.quoted => self.in_quotes = !self.in_quotes,
                b'"' if !self.begun => {
                    *self = CellSplitter { quoted: true, begun: true, in_quotes: true, ..*self };
                }
                byte => self.begun |= !byte.is_ascii_whitespace(),
            }
        }
    }
}

/// The range without blanks at its ends; the start of an all-blank range.
fn trim(bytes: &[u8], range: Range<usize>) -> Range<usize> {
    let cell = &bytes[range.clone()];
    let length = cell.trim_ascii().len();
    let blanks = if length == 0 { 0 } else { cell.len() - cell.trim_ascii_start().len() };
    range.start + blanks..range.start + blanks + length
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Line and cells of every record; checks that the ranges match the cells.
    fn split(text: &str) -> Vec<(usize, Vec<String>)> {
        let mut records = CsvRecords::new(text.as_bytes(), 0, 0);
        let mut lines = Vec::new();
        while let Some(record) = records.next().expect("a slice can be read") {
            let cells = (0..record.len()).map(|column| record.text(column)).collect();
            for column in 0..record.len() {
                let shown = &text[record.place(column)];
                assert_eq!(shown.trim_matches('"').replace("\"\"", "\""), record.text(column));
            }
            lines.push((record.line, cells));
        }
        assert_eq!(records.offset, text.len());
        lines
    }

    fn cells(list: &[&str]) -> Vec<String> {
        list.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn lines_are_counted_whatever_ends_them() {
        let expected = vec![(1, cells(&["a", "b"])), (4, cells(&["1", ""])), (5, cells(&["2"]))];
        assert_eq!(split("a, b\n\n  \n1,\n2"), expected);
        assert_eq!(split("a ,b\r\n\r\n\r\n1,\r\n2\r\n"), expected);
    }

    #[test]
    fn quoted_cells_hold_commas_quotes_and_line_ends() {
        assert_eq!(
            split("\"a,b\",\"c \"\"d\"\"e\"\n\"1\n2\", \"\"\n5\" pipe,6\n"),
            vec![
                (1, cells(&["a,b", "c \"d\"e"])),
                (2, cells(&["1\n2", ""])),
                (4, cells(&["5\" pipe", "6"])),
            ]
        );
    }

    #[test]
    fn what_never_ends_is_given_up() {
        let mut records = CsvRecords::new(io::BufReader::new(io::repeat(b'0')), 0, 0);
        let error = records.next().map(|_| ()).expect_err("no row is that long").to_string();
        assert!(error.contains("line 1 begins a row of more than 16 MB"), "{error}");
        let open = io::Cursor::new(b"\"a\n").chain(io::repeat(b'0'));
        let mut records = CsvRecords::new(io::BufReader::new(open), 0, 6);
        let error = records.next().map(|_| ()).expect_err("no row is that long").to_string();
        assert!(error.contains("line 7"), "{error}");
    }

    #[test]
    fn in_lines_a_quote_ends_with_its_line() {
        let mut records = CsvRecords::new(b"1,\"b\n2,3\n".as_slice(), 0, 0).in_lines();
        assert!(
            records.next().expect("a slice can be read").is_some_and(|record| record.open_quote)
        );
        let second = records.next().expect("a slice can be read").map(|record| record.text(0));
        assert_eq!(second.as_deref(), Some("2"));
    }

    #[test]
    fn a_quote_that_is_never_closed_is_known() {
        let mut records = CsvRecords::new(b"a,\"b\nc,d\n".as_slice(), 0, 0);
        let record = records.next().expect("a slice can be read").expect("there is a record");
        assert!(record.open_quote);
        assert_eq!(record.text(1), "\"b\nc,d");
        assert!(records.next().expect("a slice can be read").is_none());
    }
}
