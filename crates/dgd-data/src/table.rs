//! A data file after reading: columns of numbers, and a report on cells that are not numbers.

use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use dgd_compiler::source::{SourceId, Span};
use dgd_compiler::units::Unit;

use crate::csv::clock::Epoch;
use crate::sha256::Sha256Digest;

/// A data file.
///
/// Every column has [`DataTable::len`] values. Times never decrease.
#[derive(Debug, Clone)]
pub struct DataTable {
    /// The file, as far as it is kept for diagnostics: the whole of a short one, or the head of a long one.
    pub source: SourceId,
    /// Digest of the stored bytes, compressed or not; none for a file that is read row by row.
    pub digest: Option<Sha256Digest>,
    /// Its header line.
    pub header: Span,
    /// Seconds since the first sample, if the file has a time column. Two equal ones are the left and right side of a
    /// jump, three or more are replicates.
    pub time: Option<Vec<f64>>,
    /// A note for the user if the time column has another name.
    pub time_note: Option<Diagnostic>,
    /// The timestamp of the first sample, if times are timestamps.
    pub epoch: Option<Epoch>,
    /// Disorder of the times, if it was tolerated.
    pub disorder: TimeDisorder,
    /// Third and further rows at the same time.
    pub replicates: Vec<Replicate>,
    /// The columns other than time, in the order of the file.
    pub columns: Vec<DataColumn>,
    pub(crate) n_rows: usize,
}

/// A third or further row at the same time.
#[derive(Debug, Clone, PartialEq)]
pub struct Replicate {
    /// Its index.
    pub row: usize,
    /// The first row at its time.
    pub first: usize,
    /// The cell with the time.
    pub time: CellRange,
}

/// Disorder of times, in a file read with tolerance for it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TimeDisorder {
    /// The first time that comes after a later one, in words, and whether the later one is left out.
    pub backwards: Option<String>,
    /// The first time shared by more than two rows.
    pub crowded: Option<String>,
    /// Rows left out because of either.
    pub left_out: usize,
}

/// Treatment of rows whose time runs backwards. As few as possible are left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum DisorderPolicy {
    /// The file is refused.
    Required,
    /// They are left out and counted.
    Recorded,
}

/// A column of a [`DataTable`].
#[derive(Debug, Clone)]
pub struct DataColumn {
    /// Name, without the unit.
    pub name: String,
    /// Unit of the values; `None` if the header has none, or an unknown one.
    pub unit: Option<Unit>,
    /// Values in that unit; NaN marks a missing one.
    pub values: Vec<f64>,
    /// The header cell.
    pub place: Span,
    /// The fault of the header cell.
    pub fault: Option<Diagnostic>,
    /// Cells of the file without a value, if any.
    pub missing: Option<CellRange>,
    /// Cells of the file that are not numbers, if any; their values are NaN.
    pub not_numbers: Option<CellRange>,
}

/// Share of repeated rows above which a column counts as held.
const HELD: f64 = 0.5;

impl DataColumn {
    /// Whether values are held from row to row, as for commands but not for measurements.
    pub fn is_held(&self) -> bool {
        let same = self.values.windows(2).filter(|pair| pair[0] == pair[1]).count();
        same as f64 >= HELD * (self.values.len() as f64 - 1.0).max(1.0)
    }
}

/// The first of some cells, and their number.
#[derive(Debug, Clone, PartialEq)]
pub struct CellRange {
    /// Location of the first.
    pub first: DataLocation,
    /// Its text.
    pub text: String,
    /// Their number.
    pub count: usize,
}

/// A place in a data file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DataLocation {
    /// The span to point to: the place itself, or the header of its column.
    pub span: Span,
    /// The line, from 1, if its text is not kept.
    pub line: Option<usize>,
    /// The row, from 0, of data that is not text.
    pub row: Option<usize>,
}

/// Characters of a cell quoted in a message.
pub(crate) const SHOWN: usize = 40;

impl DataTable {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.n_rows
    }

    /// Whether there are no rows; a table read from a file has some.
    pub fn is_empty(&self) -> bool {
        self.n_rows == 0
    }

    /// The column of this name.
    pub fn column(&self, name: &str) -> Option<&DataColumn> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// Seconds since the first sample, for a table that must be a recording.
    pub fn recording(&self, diagnostics: &mut Diagnostics) -> Result<&[f64], ErrorReported> {
        self.time.as_deref().ok_or_else(|| {
            let span = self.columns.first().map_or(self.header, |column| column.place);
            diagnostics.error(
                Diagnostic::new(Code::NoTimeColumn, span, "the file has no time column")
                    .here("the first column")
                    .help("its first column should be `time [s]`, or `time` with ISO 8601 stamps"),
            )
        })
    }
}

impl CellRange {
    /// A single cell, with a long text truncated.
    pub(crate) fn one(first: DataLocation, text: String) -> CellRange {
        let text = match text.char_indices().nth(SHOWN) {
            Some((end, _)) => format!("{}…", &text[..end]),
            None => text,
        };
        CellRange { first, text, count: 1 }
    }

    /// Counts a cell; only the first is evaluated.
    pub(crate) fn count(
        cells: &mut Option<CellRange>,
        cell: impl FnOnce() -> (DataLocation, String),
    ) {
        if let Some(cells) = cells {
            cells.count += 1;
        } else {
            let (first, text) = cell();
            *cells = Some(CellRange::one(first, text));
        }
    }

    /// A diagnostic at the first cell.
    pub(crate) fn diagnostic(&self, code: Code, message: String) -> Diagnostic {
        let others = match self.count - 1 {
            0 => String::new(),
            1 => "and one more row".to_owned(),
            n => format!("and {n} more rows"),
        };
        let diagnostic = self.first.diagnostic(code, message);
        let text = [diagnostic.labels[0].text.as_str(), &others]
            .into_iter()
            .filter(|part| !part.is_empty())
            .collect::<Vec<_>>()
            .join(", ");
        diagnostic.here(text)
    }
}

impl DataLocation {
    /// A row, from 0, of the column with this header.
    pub(crate) fn row(header: Span, row: usize) -> DataLocation {
        DataLocation { span: header, line: None, row: Some(row) }
    }

    /// A diagnostic at this place.
    pub(crate) fn diagnostic(self, code: Code, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(code, self.span, message).here(self.text(""))
    }

    /// A text for a label here.
    pub(crate) fn text(self, text: &str) -> String {
        let line = self.line.map(|line| format!("line {line}"));
        match line.or_else(|| Some(format!("row {}", self.row?))) {
            Some(place) if text.is_empty() => place,
            Some(place) => format!("{place}: {text}"),
            None => text.to_owned(),
        }
    }
}
