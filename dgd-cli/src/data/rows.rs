//! From the rows of a file to the columns of a [`Table`].

use std::ops::Range;

use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use dgd_compiler::source::{SourceId, Sources, Span};

use super::header::Header;
use super::records::Record;
use super::time::{Time, Timed};
use super::{Cells, Column, Disorder, Order, Place, Table};

/// What of the text diagnostics can show.
#[derive(Clone, Copy)]
pub(super) struct Kept {
    /// The text that is kept.
    pub(super) source: SourceId,
    /// Whether that is all of it, or only the lines down to the header.
    pub(super) whole: bool,
}

impl Kept {
    pub(super) fn span(self, range: &Range<usize>) -> Span {
        let byte = |at| u32::try_from(at).unwrap_or(u32::MAX);
        Span { source: self.source, start: byte(range.start), end: byte(range.end) }
    }

    /// A place in a row; `header` stands for it where the row is not kept.
    pub(super) fn place(self, range: &Range<usize>, line: usize, header: Span) -> Place {
        if self.whole {
            Place { span: self.span(range), line: None }
        } else {
            Place { span: header, line: Some(line) }
        }
    }
}

/// Takes in the rows of a file, one after the other.
pub(super) struct Rows {
    kept: Kept,
    header: Span,
    n_cells: usize,
    taken: usize,
    time: Option<Time>,
    columns: Vec<Column>,
    /// Rows of another length than the header.
    ragged: Option<Cells>,
    open_quote: Option<Place>,
}

impl Rows {
    /// Starts below the header.
    pub(super) fn below(
        header: &Header,
        order: Order,
        kept: Kept,
        sources: &Sources,
        diagnostics: &mut Diagnostics,
    ) -> Result<Rows, Reported> {
        let mut columns = header.columns(kept, sources);
        header.verify(&columns, kept, diagnostics)?;
        let time = if columns[0].name == "time" {
            Some(Time::of(columns.remove(0), order, diagnostics)?)
        } else {
            None
        };
        Ok(Rows {
            kept,
            header: kept.span(&header.place),
            n_cells: header.cells.len(),
            taken: 0,
            time,
            columns,
            ragged: None,
            open_quote: None,
        })
    }

    /// The header line.
    pub(super) fn header(&self) -> Span {
        self.header
    }

    /// Number of rows taken in.
    pub(super) fn len(&self) -> usize {
        self.taken
    }

    /// Takes in a row.
    pub(super) fn take(&mut self, record: &Record<'_>) {
        if record.open_quote {
            let quoted = record.place_from(record.len() - 1);
            self.open_quote = Some(self.kept.place(&quoted, record.line, self.header));
            return;
        }
        if record.len() != self.n_cells {
            // Pointed at are the cells that are too many, or else all there are.
            let first = if record.len() > self.n_cells { self.n_cells } else { 0 };
            let place = self.kept.place(&record.place_from(first), record.line, self.header);
            Cells::count(&mut self.ragged, || (place, counted(record.len())));
            return;
        }
        if let Some(time) = &mut self.time {
            time.take(record, self.kept);
        }
        self.taken += 1;
        let first = usize::from(self.time.is_some());
        for (cell, column) in (first..).zip(&mut self.columns) {
            let value = number(record.cell(cell));
            column.values.push(value.unwrap_or(f64::NAN));
            let found = match value {
                None => &mut column.not_numbers,
                Some(value) if value.is_nan() => &mut column.missing,
                Some(_) => continue,
            };
            let header = column.place;
            Cells::count(found, || {
                (self.kept.place(&record.place(cell), record.line, header), record.text(cell))
            });
        }
    }

    /// The table, unless something is wrong with all of it.
    pub(super) fn finish(self, diagnostics: &mut Diagnostics) -> Result<Table, Reported> {
        let mut reported = Ok(());
        if let Some(place) = self.open_quote {
            let message = "a quoted cell is not closed";
            reported = Err(diagnostics.error(place.diagnostic(Code::E610, message)));
        }
        if let Some(cells) = self.ragged {
            let message =
                format!("this row has {}, and the header {}", cells.text, counted(self.n_cells));
            reported = Err(diagnostics.error(cells.diagnostic(Code::E610, message)));
        } else if self.taken == 0 && reported.is_ok() {
            let message = "the table has no rows";
            let place = self.header;
            reported = Err(diagnostics.error(Diagnostic::new(Code::E612, place, message)));
        }
        let time = self.time.map(|time| time.finish(diagnostics)).transpose();
        reported?;
        let Rows { mut columns, taken: mut n_rows, .. } = self;
        let (time, disorder) = match time? {
            None => (None, Disorder::default()),
            Some(Timed { seconds, rows, disorder }) => {
                if let Some(rows) = rows {
                    for column in &mut columns {
                        column.values = rows.iter().map(|row| column.values[*row]).collect();
                    }
                    n_rows = rows.len();
                }
                (Some(seconds), disorder)
            }
        };
        Ok(Table { source: self.kept.source, header: self.header, time, disorder, columns, n_rows })
    }
}

/// The number in a cell; NaN where a value is missing, `None` where there is something else.
pub(super) fn number(cell: &[u8]) -> Option<f64> {
    if cell.is_empty() || cell.eq_ignore_ascii_case(b"na") {
        return Some(f64::NAN);
    }
    let value: f64 = str::from_utf8(cell).ok()?.parse().ok()?;
    (!value.is_infinite()).then_some(value)
}

pub(super) fn counted(n_cells: usize) -> String {
    if n_cells == 1 { "1 cell".to_owned() } else { format!("{n_cells} cells") }
}
