//! The time column: seconds since the first sample, in order.

use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use dgd_compiler::source::Span;
use dgd_compiler::units::Dimension;

use crate::cell::shown;
use crate::csv::clock::{Epoch, TimeColumnClock, TimeFault};
use crate::csv::kept::ShownText;
use crate::csv::records::CsvRecord;
use crate::table::{CellRange, DataColumn, DataLocation, DisorderPolicy, Replicate, TimeDisorder};

/// The time column while rows are read.
pub(crate) struct TimeColumn {
    header: Span,
    order: DisorderPolicy,
    /// Factor from the header's unit to seconds, if there is a unit.
    factor: Option<f64>,
    clock: Option<TimeColumnClock>,
    /// Number of rows read as numbers or texts without a location of their own.
    row: usize,
    seconds: Vec<f64>,
    last: Option<LastRow>,
    /// The first mistake of each kind, and their number.
    unreadable: Option<(CellRange, TimeFault)>,
    backwards: Option<(CellRange, EarlierRow)>,
    crowded: Option<CellRange>,
    /// Third and further rows at the same time.
    replicates: Vec<Replicate>,
}

/// Result of reading the time column.
pub(crate) struct TimeReading {
    /// Seconds since the first sample.
    pub(crate) seconds: Vec<f64>,
    /// The rows with these times, if some are left out.
    pub(crate) rows: Option<Vec<usize>>,
    pub(crate) disorder: TimeDisorder,
    /// Third and further rows at the same time, unless disorder is tolerated.
    pub(crate) replicates: Vec<Replicate>,
    /// The timestamp from which they are counted, if the file has timestamps.
    pub(crate) epoch: Option<Epoch>,
}

/// The row before one with an earlier time.
struct EarlierRow {
    row: usize,
    place: DataLocation,
    text: String,
}

/// The last row with a valid time.
struct LastRow {
    seconds: f64,
    place: DataLocation,
    text: Vec<u8>,
    /// Number of rows at this time.
    same: usize,
}

impl TimeColumn {
    /// The time column under this header.
    pub(crate) fn from_header(
        column: DataColumn,
        order: DisorderPolicy,
        diagnostics: &mut Diagnostics,
    ) -> Result<TimeColumn, ErrorReported> {
        if let Some(fault) = column.fault {
            return Err(diagnostics.error(fault));
        }
        let factor = match column.unit {
            None => None,
            Some(unit) if unit.dimension == Dimension::from_exponents([0, 0, 1, 0, 0, 0, 0]) => {
                Some(unit.factor)
            }
            Some(unit) => {
                let message =
                    format!("`time` is in `{}`, which is not a unit of time", unit.symbol);
                return Err(diagnostics.error(
                    Diagnostic::new(Code::IncompatibleColumnUnit, column.place, message)
                        .help("write `time [s]`, or `time` with ISO 8601 stamps"),
                ));
            }
        };
        Ok(TimeColumn {
            header: column.place,
            order,
            factor,
            clock: None,
            row: 0,
            seconds: Vec::new(),
            last: None,
            unreadable: None,
            backwards: None,
            crowded: None,
            replicates: Vec::new(),
        })
    }

    /// Factor from the header's unit to seconds, if there is a unit.
    pub(crate) fn factor(&self) -> Option<f64> {
        self.factor
    }

    /// Reads the time of a row.
    pub(crate) fn take(&mut self, record: &CsvRecord<'_>, kept: ShownText) {
        let place = kept.place(&record.place(0), record.line, self.header);
        self.take_cell(record.cell(0), place, || record.text(0));
    }

    /// Reserves space for this many times.
    #[cfg(feature = "parquet")]
    pub(crate) fn expect(&mut self, rows: usize) {
        self.seconds.reserve(rows);
    }

    /// Reads the times of the next rows.
    pub(crate) fn take_numbers(&mut self, times: &[f64]) {
        let Some(last) = times.last() else { return };
        let before = self.seconds.len();
        if let Some(same) = self.push_in_order(times) {
            let place = DataLocation::row(self.header, self.row + times.len() - 1);
            let (seconds, text) = (self.seconds[self.seconds.len() - 1], shown(*last).into_bytes());
            self.last = Some(LastRow { seconds, place, text, same });
            self.row += times.len();
            return;
        }
        // Mistakes are reported as for a text file.
        self.seconds.truncate(before);
        for time in times {
            self.take_text(&shown(*time));
        }
    }

    /// Reads the time of the next row.
    pub(crate) fn take_text(&mut self, text: &str) {
        let place = DataLocation::row(self.header, self.row);
        self.row += 1;
        self.take_cell(text.trim_ascii().as_bytes(), place, || text.to_owned());
    }

    /// Appends seconds since the first time if none of these times can be wrong; returns how many at the end are equal.
    fn push_in_order(&mut self, times: &[f64]) -> Option<usize> {
        let factor = self.factor?;
        let first = match &self.clock {
            None => *times.first()?,
            Some(TimeColumnClock::Counted { first, .. }) => *first,
            Some(TimeColumnClock::Zoned { .. } | TimeColumnClock::Local { .. }) => return None,
        };
        let last = self.last.as_ref();
        let (mut before, mut same) =
            last.map_or((f64::NEG_INFINITY, 0), |last| (last.seconds, last.same));
        for time in times {
            let seconds = (time - first) * factor;
            same = if seconds == before { same + 1 } else { 1 };
            if !seconds.is_finite() || seconds < before || same > 2 {
                return None;
            }
            self.seconds.push(seconds);
            before = seconds;
        }
        self.clock.get_or_insert(TimeColumnClock::Counted { factor, first });
        Some(same)
    }

    /// Reads the time of a row from its cell; `text` quotes the cell.
    fn take_cell(&mut self, cell: &[u8], place: DataLocation, text: impl Fn() -> String) {
        let read = match &self.clock {
            Some(clock) => clock.seconds(cell),
            None => TimeColumnClock::start(cell, self.factor).map(|clock| {
                self.clock = Some(clock);
                0.0
            }),
        };
        let seconds = match read {
            Ok(seconds) => seconds,
            Err(fault) => {
                match &mut self.unreadable {
                    Some((cells, _)) => cells.count += 1,
                    None => self.unreadable = Some((CellRange::one(place, text()), fault)),
                }
                return;
            }
        };
        let Some(last) = &mut self.last else {
            let text = cell.to_owned();
            self.last = Some(LastRow { seconds, place, text, same: 1 });
            self.seconds.push(seconds);
            return;
        };
        if seconds == last.seconds {
            last.same += 1;
        } else {
            last.same = 1;
        }
        if last.same > 2 && self.order == DisorderPolicy::Recorded {
            CellRange::count(&mut self.crowded, || (place, text()));
        } else if last.same > 2 {
            let row = self.seconds.len();
            let first = row + 1 - last.same;
            self.replicates.push(Replicate { row, first, time: CellRange::one(place, text()) });
        }
        if seconds < last.seconds {
            if let Some((cells, _)) = &mut self.backwards {
                cells.count += 1;
            } else {
                let earlier = String::from_utf8_lossy(&last.text).into_owned();
                let row = self.seconds.len() - 1;
                let before = EarlierRow { row, place: last.place, text: earlier };
                self.backwards = Some((CellRange::one(place, text()), before));
            }
        }
        self.seconds.push(seconds);
        last.seconds = seconds;
        last.place = place;
        last.text.clear();
        last.text.extend_from_slice(cell);
    }

    /// All times, unless mistakes invalidate the whole file.
    pub(crate) fn finish(
        self,
        diagnostics: &mut Diagnostics,
    ) -> Result<TimeReading, ErrorReported> {
        let mut reported = Ok(());
        if let Some((cells, fault)) = self.unreadable {
            let diagnostic = cells.diagnostic(Code::NotANumber, fault.message(&cells.text));
            reported = Err(diagnostics.error(match fault.help() {
                Some(help) => diagnostic.help(help),
                None => diagnostic,
            }));
        }
        let is_out_of_order = self.backwards.is_some() || self.crowded.is_some();
        let rows = (self.order == DisorderPolicy::Recorded && is_out_of_order)
            .then(|| rows_in_order(&self.seconds));
        let left_out = rows.as_ref().map_or(0, |rows| self.seconds.len() - rows.len());
        let mut disorder = TimeDisorder { left_out, ..TimeDisorder::default() };
        if let Some((cells, before)) = self.backwards {
            let EarlierRow { row, place, text } = before;
            if let Some(rows) = &rows {
                let has_its_time = |kept: &usize| self.seconds[*kept] == self.seconds[row];
                let ahead = if rows.iter().any(has_its_time) { "" } else { ", which is ahead" };
                disorder.backwards = Some(format!("`{}` comes after `{text}`{ahead}", cells.text));
            } else {
                let message = format!("time runs backwards: `{}` comes after `{text}`", cells.text);
                let diagnostic = cells.diagnostic(Code::TimeRunsBackwards, message);
                reported =
                    Err(diagnostics
                        .error(diagnostic.label(place.span, place.text("the row before"))));
            }
        }
        disorder.crowded = self.crowded.map(|cells| cells.text);
        reported?;
        // The first row may be among those left out.
        let epoch = self.clock.as_ref().and_then(TimeColumnClock::epoch).filter(|_| rows.is_none());
        let mut seconds = self.seconds;
        if let Some(rows) = &rows {
            // Even the first row may be left out.
            let first = rows.first().map_or(0.0, |row| seconds[*row]);
            seconds = rows.iter().map(|row| seconds[*row] - first).collect();
        }
        let replicates = self.replicates;
        Ok(TimeReading { seconds, rows, disorder, replicates, epoch })
    }
}

/// The longest list of rows whose times never decrease, with no three times equal.
///
/// A single time far ahead is thus left out alone, instead of all that follow. Among equally long lists, the earlier
/// rows stay: after a clock is set back, the repeated times are left out.
///
/// Source: Fredman, On computing the length of longest increasing subsequences, Discrete Math. 11
/// (1975) 29–35.
fn rows_in_order(seconds: &[f64]) -> Vec<usize> {
    // Built from the end: for each length, the row with the latest time that begins such a run, and for each row, its
    // successor.
    let mut beginnings: Vec<usize> = Vec::new();
    let mut behind: Vec<Option<usize>> = vec![None; seconds.len()];
    for (row, time) in seconds.iter().enumerate().rev() {
        let length = beginnings.partition_point(|first| seconds[*first] >= *time);
        behind[row] = length.checked_sub(1).map(|shorter| beginnings[shorter]);
        if length == beginnings.len() {
            beginnings.push(row);
        } else {
            beginnings[length] = row;
        }
    }
    let rows = std::iter::successors(beginnings.last().copied(), |row| behind[*row]);
    let mut kept: Vec<usize> = Vec::with_capacity(beginnings.len());
    for row in rows {
        let third = kept.len().checked_sub(2).map(|at| seconds[kept[at]]);
        if third != Some(seconds[row]) {
            kept.push(row);
        }
    }
    kept
}
