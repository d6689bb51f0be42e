//! A growing recording: its rows one by one, as they arrive.
//!
//! The header is read as that of a file ([`read`](crate::read)), and a [`DataTable`] without rows describes the
//! columns. A row ends with its line, so that an unreadable one does not hide those after it.

use std::fmt;
use std::io::{self, BufRead, Cursor, Read};

use dgd_compiler::diagnostics::{Diagnostics, ErrorReported};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::units::{Unit, convert};

use crate::cell::number;
use crate::csv::clock::{Epoch, TimeColumnClock, TimeFault};
use crate::csv::header::{CsvHeader, take_as_time};
use crate::csv::kept::ShownText;
use crate::csv::records::CsvRecords;
use crate::csv::rename::Rename;
use crate::csv::rows::counted;
use crate::csv::time::TimeColumn;
use crate::encoding::not_text;
use crate::read::{decompressed, unreadable};
use crate::select::DeclaredColumn;
use crate::table::{DataColumn, DataTable, DisorderPolicy, TimeDisorder};

/// Rows as they arrive.
pub struct RowStream<'a> {
    records: CsvRecords<Box<dyn BufRead + 'a>>,
    name: String,
    n_cells: usize,
    /// Factor from the header's unit to seconds, if there is a unit.
    factor: Option<f64>,
    clock: Option<TimeColumnClock>,
    /// The last time, and the number of rows at it.
    last: Option<(f64, usize)>,
    /// The cells to read from each row.
    cells: Vec<Option<StreamColumn>>,
}

/// A column to read.
struct StreamColumn {
    position: usize,
    name: String,
    unit: Option<Unit>,
    si: Unit,
}

/// The reason why a row could not be read.
#[derive(Debug)]
pub struct RowFault {
    name: String,
    /// The line, from 1.
    pub line: usize,
    /// The fault.
    pub what: String,
    /// Whether nothing can be read after it.
    pub is_end: bool,
}

impl fmt::Display for RowFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, line {}: {}", self.name, self.line, self.what)
    }
}

impl<'a> RowStream<'a> {
    /// Reads down to the header; `name` is the stream's name in messages.
    ///
    /// # Errors
    ///
    /// There is no header, or a mistake invalidates the whole stream.
    pub fn open(
        name: &str,
        renames: &[Rename],
        input: impl Read + 'a,
        sources: &mut SourceMap,
        diagnostics: &mut Diagnostics,
    ) -> Result<(Self, DataTable), ErrorReported> {
        let read = decompressed(input).and_then(|mut input| {
            let head = head(&mut input)?;
            Ok((head, input))
        });
        let (head, rest) = match read {
            Ok(read) => read,
            Err(error) => {
                return Err(diagnostics.error(unreadable(name, "", sources, &error.to_string())));
            }
        };
        if let Some(why) = not_text(&head) {
            let diagnostic = unreadable(name, "", sources, why.message).help(why.help);
            return Err(diagnostics.error(diagnostic));
        }
        let Ok(head) = String::from_utf8(head) else {
            let diagnostic = unreadable(name, "", sources, "this is not UTF-8 text");
            return Err(diagnostics.error(diagnostic.help("save it as UTF-8")));
        };
        let head = head.strip_prefix('\u{feff}').unwrap_or(&head).to_owned();
        let start = head[..head.trim_end().len()].rfind('\n').map_or(0, |at| at + 1);
        let lines = head[..start].matches('\n').count();
        let mut line =
            CsvRecords::new(Cursor::new(head.as_bytes()[start..].to_vec()), start, lines);
        let mut header = match line.next() {
            Ok(Some(record)) => CsvHeader::from_record(&record),
            Ok(None) | Err(_) => {
                return Err(diagnostics.error(unreadable(name, &head, sources, "it is empty")));
            }
        };
        let (offset, lines) = (head.len(), head.matches('\n').count());
        let source = sources.add(SourceText { name: name.to_owned(), text: head });
        let kept = ShownText { source, whole: true };
        header.rename(renames, kept, sources, diagnostics)?;
        let mut columns = header.columns(kept, sources);
        let time_note = take_as_time(&mut columns);
        header.verify(&columns, kept, diagnostics)?;
        let n_cells = columns.len();
        let time = (columns[0].name == "time").then(|| columns.remove(0));
        let factor = match time {
            None => None,
            Some(column) => Some(
                TimeColumn::from_header(column, DisorderPolicy::Required, diagnostics)?.factor(),
            ),
        };
        let table = DataTable {
            digest: None,
            source,
            header: kept.span(&header.place),
            time: factor.is_some().then(Vec::new),
            time_note,
            epoch: None,
            columns,
            disorder: TimeDisorder::default(),
            replicates: Vec::new(),
            n_rows: 0,
        };
        let records = CsvRecords::new(rest, offset, lines).in_lines();
        let name = name.to_owned();
        let factor = factor.flatten();
        let (clock, last, cells) = (None, None, Vec::new());
        Ok((RowStream { records, name, n_cells, factor, clock, last, cells }, table))
    }

    /// The timestamp of the first row, once read, if times are timestamps.
    pub fn epoch(&self) -> Option<Epoch> {
        self.clock.as_ref().and_then(TimeColumnClock::epoch)
    }

    /// Sets the columns to read from each row, in SI in the model's convention. [`select`](crate::select) has checked
    /// them with the table.
    pub fn want(&mut self, table: &DataTable, declared: &[DeclaredColumn<'_>]) {
        let cell = |declared: &DeclaredColumn<'_>| {
            let position = table.columns.iter().position(|column| column.name == declared.name)?;
            let DataColumn { name, unit, .. } = &table.columns[position];
            let si = Unit { factor: 1.0, offset: 0.0, ..declared.unit.clone() };
            // The time comes first.
            Some(StreamColumn {
                position: position + 1,
                name: name.clone(),
                unit: unit.clone(),
                si,
            })
        };
        self.cells = declared.iter().map(cell).collect();
    }

    /// The next row: its time, s since the first, and the requested values, NaN for missing ones. After an unreadable
    /// row it is the following one, unless that was the end.
    ///
    /// # Errors
    ///
    /// [`RowFault`].
    pub fn next(&mut self, values: &mut Vec<f64>) -> Result<Option<f64>, RowFault> {
        let Self { records, name, n_cells, factor, clock, last, cells } = self;
        let name = &*name;
        let fault = |line, what| RowFault { name: name.clone(), line, what, is_end: false };
        let next = records.line() + 1;
        let record = match records.next() {
            Ok(None) => return Ok(None),
            Ok(Some(record)) => record,
            Err(error) => return Err(RowFault { is_end: true, ..fault(next, error.to_string()) }),
        };
        if record.open_quote {
            return Err(fault(record.line, "a quoted cell is not closed".to_owned()));
        }
        if record.len() != *n_cells {
            let what = format!("this row has {}, and the header {n_cells}", counted(record.len()));
            return Err(fault(record.line, what));
        }
        let read = match clock {
            Some(clock) => clock.seconds(record.cell(0)),
            None => TimeColumnClock::start(record.cell(0), *factor).map(|started| {
                *clock = Some(started);
                0.0
            }),
        };
        let t =
            read.map_err(|what: TimeFault| fault(record.line, what.message(&record.text(0))))?;
        values.clear();
        for cell in cells {
            let Some(StreamColumn { position, name, unit, si }) = cell else {
                values.push(f64::NAN);
                continue;
            };
            let Some(value) = number(record.cell(*position)) else {
                let what =
                    format!("`{}` in column `{name}` is not a number", record.text(*position));
                return Err(fault(record.line, what));
            };
            values.push(unit.as_ref().map_or(value, |unit| convert(value, unit, si)));
        }
        let same = match *last {
            Some((before, _)) if t < before => {
                let what =
                    format!("the time goes back, from {before} s to {t} s after the first row");
                return Err(fault(record.line, what));
            }
            Some((before, same)) if t == before => same + 1,
            _ => 1,
        };
        if same > 2 {
            let what = format!("a third row has the time {t} s after the first row");
            return Err(fault(record.line, what));
        }
        *last = Some((t, same));
        Ok(Some(t))
    }
}

/// Size limit of the text down to the header line, in bytes.
const LONGEST_HEAD: usize = 16 << 20;

/// The text down to the header line.
fn head(input: &mut impl BufRead) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    loop {
        let from = head.len();
        if input.take((LONGEST_HEAD - from) as u64).read_until(b'\n', &mut head)? == 0 {
            return Ok(head);
        }
        if head.len() == LONGEST_HEAD {
            return Err(io::Error::other("it has no header line, at least not soon"));
        }
        let line = head[from..].trim_ascii();
        let line = line.strip_prefix("\u{feff}".as_bytes()).unwrap_or(line);
        if !(line.trim_ascii().is_empty() || line.starts_with(b"#")) {
            return Ok(head);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dgd_compiler::units::parse_unit;

    fn open(text: &'static str) -> (RowStream<'static>, DataTable) {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        RowStream::open("-", &[], text.as_bytes(), &mut sources, &mut diagnostics)
            .expect("a header")
    }

    #[test]
    fn rows_come_in_si_whatever_stands_above_the_header() {
        let text = "# a remark\n\n\u{20}\ntime [min],p [bar],q [lpm]\n10,1,\n10.5,NaN,60\n";
        let (mut stream, table) = open(text);
        assert!(table.is_empty() && table.time.is_some());
        let (pascal, flow) = (parse_unit("bar").expect("bar"), parse_unit("m^3/s").expect("flow"));
        let declared = |name, unit| DeclaredColumn { name, unit, place: None };
        stream.want(&table, &[declared("q", &flow), declared("p", &pascal), declared("z", &flow)]);
        let mut values = Vec::new();
        assert_eq!(stream.next(&mut values).expect("a row"), Some(0.0));
        assert!(values[0].is_nan() && values[1] == 1e5 && values[2].is_nan());
        assert_eq!(stream.next(&mut values).expect("a row"), Some(30.0));
        assert!((values[0] - 1e-3).abs() < 1e-18 && values[1].is_nan());
        assert_eq!(stream.next(&mut values).expect("the end"), None);
    }

    #[test]
    fn rows_behind_one_that_cannot_be_read_are_read() {
        let (mut stream, _) =
            open("time [s],q [lpm]\n0,1\n5,\"1\n6,1\n2,1\n6,1\n6,1\nx,1\n7,1,1\n8,1\n");
        let (mut values, mut times, mut lines) = (Vec::new(), Vec::new(), Vec::new());
        loop {
            match stream.next(&mut values) {
                Ok(Some(t)) => times.push(t),
                Ok(None) => break,
                Err(fault) => lines.push((fault.line, fault.is_end)),
            }
        }
        assert_eq!(times, [0.0, 6.0, 6.0, 8.0]);
        assert_eq!(lines, [3, 5, 7, 8, 9].map(|line| (line, false)));
    }

    #[test]
    fn a_row_that_is_none_is_named() {
        let (mut stream, table) = open("time [s],q [lpm]\n0,1\n1,two\n");
        let flow = parse_unit("lpm").expect("a unit");
        stream.want(&table, &[DeclaredColumn { name: "q", unit: &flow, place: None }]);
        let mut values = Vec::new();
        stream.next(&mut values).expect("a row");
        let fault = stream.next(&mut values).expect_err("no number").to_string();
        assert_eq!(fault, "-, line 3: `two` in column `q` is not a number");
        assert_eq!(stream.next(&mut values).expect("the end"), None);
        let (mut stream, _) = open("time [s],q [lpm]\n0\n");
        let fault = stream.next(&mut values).expect_err("too short").to_string();
        assert_eq!(fault, "-, line 2: this row has 1 cell, and the header 2");
    }
}
