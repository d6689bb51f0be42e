//! Reads the rows of a file into the columns of a [`DataTable`].

use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use dgd_compiler::source::{SourceMap, Span};

use crate::cell::{number, shown};
use crate::csv::header::{CsvHeader, take_as_time};
use crate::csv::kept::ShownText;
use crate::csv::records::CsvRecord;
use crate::csv::time::{TimeColumn, TimeReading};
use crate::read::ReadOptions;
use crate::table::{CellRange, DataColumn, DataLocation, DataTable, TimeDisorder};

/// Collects the rows of a file one by one.
pub(crate) struct CsvRows {
    kept: ShownText,
    header: Span,
    n_cells: usize,
    taken: usize,
    time: Option<TimeColumn>,
    time_note: Option<Diagnostic>,
    columns: Vec<DataColumn>,
    /// Whether each column is read.
    wanted: Vec<bool>,
    /// Rows with another number of cells than the header.
    ragged: Option<CellRange>,
    open_quote: Option<DataLocation>,
}

impl CsvRows {
    /// Starts after the header.
    pub(crate) fn below(
        header: &CsvHeader,
        reading: ReadOptions<'_>,
        kept: ShownText,
        sources: &SourceMap,
        diagnostics: &mut Diagnostics,
    ) -> Result<CsvRows, ErrorReported> {
        let mut columns = header.columns(kept, sources);
        let time_note = take_as_time(&mut columns);
        header.verify(&columns, kept, diagnostics)?;
        let time = if columns[0].name == "time" {
            Some(TimeColumn::from_header(columns.remove(0), reading.order, diagnostics)?)
        } else {
            None
        };
        let wanted = columns.iter().map(|column| reading.wants(&column.name)).collect();
        Ok(CsvRows {
            kept,
            header: kept.span(&header.place),
            n_cells: header.cells.len(),
            taken: 0,
            time,
            time_note,
            columns,
            wanted,
            ragged: None,
            open_quote: None,
        })
    }

    /// The header line.
    pub(crate) fn header(&self) -> Span {
        self.header
    }

    /// Number of rows read.
    pub(crate) fn len(&self) -> usize {
        self.taken
    }

    /// Reads a row.
    pub(crate) fn take(&mut self, record: &CsvRecord<'_>) {
        if record.open_quote {
            let quoted = record.place_from(record.len() - 1);
            self.open_quote = Some(self.kept.place(&quoted, record.line, self.header));
            return;
        }
        if record.len() != self.n_cells {
            // The location is that of the excess cells, or of all cells if there are too few.
            let first = if record.len() > self.n_cells { self.n_cells } else { 0 };
            let place = self.kept.place(&record.place_from(first), record.line, self.header);
            CellRange::count(&mut self.ragged, || (place, counted(record.len())));
            return;
        }
        if let Some(time) = &mut self.time {
            time.take(record, self.kept);
        }
        self.taken += 1;
        let first = usize::from(self.time.is_some());
        let columns = (first..).zip(self.columns.iter_mut().zip(&self.wanted));
        for (cell, (column, _)) in columns.filter(|(_, (_, wanted))| **wanted) {
            let value = number(record.cell(cell));
            column.values.push(value.unwrap_or(f64::NAN));
            let cells = match value {
                None => &mut column.not_numbers,
                Some(value) if value.is_nan() => &mut column.missing,
                Some(_) => continue,
            };
            let header = column.place;
            CellRange::count(cells, || {
                (self.kept.place(&record.place(cell), record.line, header), record.text(cell))
            });
        }
    }

    /// Reads all rows at once, from columns of equal lengths with the same headers, including the time.
    pub(crate) fn take_columns(&mut self, all: &[(String, Vec<f64>)]) {
        self.taken = all.first().map_or(0, |(_, values)| values.len());
        for (at, (_, values)) in all.iter().enumerate() {
            if self.wants(at) {
                self.take_numbers(at, values);
            }
        }
    }

    /// Prepares for `n_rows` rows by columns, from a file of this many bytes.
    #[cfg(feature = "parquet")]
    pub(crate) fn expect(&mut self, n_rows: usize, bytes: u64) {
        self.taken = n_rows;
        // A damaged file may claim more rows than it can hold; a row takes at least one bit.
        let likely = n_rows.min(usize::try_from(bytes.saturating_mul(8)).unwrap_or(usize::MAX));
        for (column, _) in self.columns.iter_mut().zip(&self.wanted).filter(|(_, wanted)| **wanted)
        {
            column.values.reserve(likely);
        }
        if let Some(time) = &mut self.time {
            time.expect(likely);
        }
    }

    /// Whether the column at this header index is read.
    pub(crate) fn wants(&self, at: usize) -> bool {
        at.checked_sub(usize::from(self.time.is_some())).is_none_or(|at| self.wanted[at])
    }

    /// Reads the next numbers of the column at this header index, which may be the time.
    pub(crate) fn take_numbers(&mut self, at: usize, values: &[f64]) {
        let Some(column) = self.column(at) else {
            return self.time.iter_mut().for_each(|time| time.take_numbers(values));
        };
        let before = column.values.len();
        for (row, value) in (before..).zip(values) {
            column.values.push(if value.is_finite() { *value } else { f64::NAN });
            let cells = match value {
                value if value.is_nan() => &mut column.missing,
                value if value.is_infinite() => &mut column.not_numbers,
                _ => continue,
            };
            let place = DataLocation::row(column.place, row);
            CellRange::count(cells, || (place, shown(*value)));
        }
    }

    /// The same for text cells.
    #[cfg(feature = "parquet")]
    pub(crate) fn take_texts<'t>(&mut self, at: usize, texts: impl Iterator<Item = &'t str>) {
        let Some(column) = self.column(at) else {
            if let Some(time) = &mut self.time {
                texts.for_each(|text| time.take_text(text));
            }
            return;
        };
        for text in texts {
            let place = DataLocation::row(column.place, column.values.len());
            let value = number(text.trim_ascii().as_bytes());
            column.values.push(value.unwrap_or(f64::NAN));
            let cells = match value {
                None => &mut column.not_numbers,
                Some(value) if value.is_nan() => &mut column.missing,
                Some(_) => continue,
            };
            CellRange::count(cells, || (place, text.to_owned()));
        }
    }

    /// The column at this header index; `None` for the time.
    fn column(&mut self, at: usize) -> Option<&mut DataColumn> {
        self.columns.get_mut(at.checked_sub(usize::from(self.time.is_some()))?)
    }

    /// The table, unless a mistake invalidates it as a whole.
    pub(crate) fn finish(self, diagnostics: &mut Diagnostics) -> Result<DataTable, ErrorReported> {
        let mut reported = Ok(());
        if let Some(place) = self.open_quote {
            let message = "a quoted cell is not closed";
            reported = Err(diagnostics.error(place.diagnostic(Code::RowLength, message)));
        }
        if let Some(cells) = self.ragged {
            let message =
                format!("this row has {}, and the header {}", cells.text, counted(self.n_cells));
            reported = Err(diagnostics.error(cells.diagnostic(Code::RowLength, message)));
        } else if self.taken == 0 && reported.is_ok() {
            let message = "the table has no rows";
            let place = self.header;
            reported = Err(diagnostics.error(Diagnostic::new(Code::NoRows, place, message)));
        }
        let time = self.time.map(|time| time.finish(diagnostics)).transpose();
        reported?;
        let CsvRows { mut columns, taken: mut n_rows, .. } = self;
        let (time, disorder, replicates, epoch) = match time? {
            None => (None, TimeDisorder::default(), Vec::new(), None),
            Some(TimeReading { seconds, rows, disorder, replicates, epoch }) => {
                if let Some(rows) = rows {
                    for column in columns.iter_mut().filter(|column| !column.values.is_empty()) {
                        column.values = rows.iter().map(|row| column.values[*row]).collect();
                    }
                    n_rows = rows.len();
                }
                (Some(seconds), disorder, replicates, epoch)
            }
        };
        Ok(DataTable {
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
