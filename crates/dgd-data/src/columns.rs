//! Tables of numeric columns from a program.

use crate::cell::shown;
use crate::csv::header::CsvHeader;

/// A table of numbers, by columns.
///
/// It is read like the CSV text with the same headers and numbers, to the last bit: `time` comes first, units are in
/// brackets, NaN marks a missing value. Mistakes name rows, counted from 0, instead of lines.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DataColumns {
    /// Headers, `name [unit]`, and values. The columns of a valid table have equal lengths.
    pub all: Vec<(String, Vec<f64>)>,
}

impl DataColumns {
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.all.iter().map(|(header, _)| header.as_str())
    }

    /// The header line.
    pub(crate) fn headers(&self) -> String {
        CsvHeader::line(self.names())
    }

    /// The CSV text of the same table.
    pub(crate) fn to_csv(&self) -> String {
        let mut text = self.headers();
        text.push('\n');
        let n_rows = self.all.iter().map(|(_, values)| values.len()).max().unwrap_or(0);
        for row in 0..n_rows {
            let cell = |(_, values): &(String, Vec<f64>)| values.get(row).copied().map(shown);
            let cells: Vec<String> = self.all.iter().map(|c| cell(c).unwrap_or_default()).collect();
            text.push_str(&cells.join(","));
            text.push('\n');
        }
        text
    }
}
