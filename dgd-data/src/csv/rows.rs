//! From the rows of a file to the columns of a [`Table`].

use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use dgd_compiler::source::{Sources, Span};

use crate::cell::{number, shown};
use crate::csv::header::{Header, take_as_time};
use crate::csv::kept::Kept;
use crate::csv::records::Record;
use crate::csv::time::{Time, Timed};
use crate::table::{Cells, Column, Disorder, Location, Order, Table};

/// Takes in the rows of a file, one after the other.
pub(crate) struct Rows {
    kept: Kept,
    header: Span,
    n_cells: usize,
    taken: usize,
    time: Option<Time>,
    time_note: Option<Diagnostic>,
    columns: Vec<Column>,
    /// Rows of another length than the header.
    ragged: Option<Cells>,
    open_quote: Option<Location>,
}

impl Rows {
    /// Starts below the header.
    pub(crate) fn below(
        header: &Header,
        order: Order,
        kept: Kept,
        sources: &Sources,
        diagnostics: &mut Diagnostics,
    ) -> Result<Rows, Reported> {
        let mut columns = header.columns(kept, sources);
        let time_note = take_as_time(&mut columns);
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
            time_note,
            columns,
            ragged: None,
            open_quote: None,
        })
    }

    /// The header line.
    pub(crate) fn header(&self) -> Span {
        self.header
    }

    /// Number of rows taken in.
    pub(crate) fn len(&self) -> usize {
        self.taken
    }

    /// Takes in a row.
    pub(crate) fn take(&mut self, record: &Record<'_>) {
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

    /// Takes in all rows at once, from columns of one length with the headers of these, the time included.
    pub(crate) fn take_columns(&mut self, all: &[(String, Vec<f64>)]) {
        self.taken = all.first().map_or(0, |(_, values)| values.len());
        let (of_time, rest) = all.split_at(usize::from(self.time.is_some()));
        if let (Some(time), [(_, values)]) = (&mut self.time, of_time) {
            time.take_numbers(values);
        }
        for (column, (_, values)) in self.columns.iter_mut().zip(rest) {
            column.values.reserve(values.len());
            for (row, value) in values.iter().enumerate() {
                column.values.push(if value.is_finite() { *value } else { f64::NAN });
                let found = match value {
                    value if value.is_nan() => &mut column.missing,
                    value if value.is_infinite() => &mut column.not_numbers,
                    _ => continue,
                };
                let place = Location::row(column.place, row);
                Cells::count(found, || (place, shown(*value)));
            }
        }
    }

    /// The table, unless something is wrong with all of it.
    pub(crate) fn finish(self, diagnostics: &mut Diagnostics) -> Result<Table, Reported> {
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
        let (time, disorder, replicates, epoch) = match time? {
            None => (None, Disorder::default(), Vec::new(), None),
            Some(Timed { seconds, rows, disorder, replicates, epoch }) => {
                if let Some(rows) = rows {
                    for column in &mut columns {
                        column.values = rows.iter().map(|row| column.values[*row]).collect();
                    }
                    n_rows = rows.len();
                }
                (Some(seconds), disorder, replicates, epoch)
            }
        };
        Ok(Table {
            source: self.kept.source,
            digest: None,
            header: self.header,
            time,
            time_note: self.time_note,
            epoch,
            disorder,
            replicates,
            columns,
            n_rows,
        })
    }
}

pub(crate) fn counted(n_cells: usize) -> String {
    if n_cells == 1 { "1 cell".to_owned() } else { format!("{n_cells} cells") }
}
