//! The time column: seconds since the first sample, in order.

use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use dgd_compiler::source::Span;
use dgd_compiler::units::Dimension;

use super::clock::{Clock, TimeFault};
use super::records::Record;
use super::rows::Kept;
use super::{Cells, Column, Disorder, Order, Place};

/// The time column, while rows come in.
pub(super) struct Time {
    header: Span,
    order: Order,
    left_out: usize,
    /// Seconds in the header's unit, if it has one.
    factor: Option<f64>,
    clock: Option<Clock>,
    seconds: Vec<f64>,
    last: Option<Last>,
    /// The first of each kind of mistake, and how many there are.
    unreadable: Option<(Cells, TimeFault)>,
    backwards: Option<(Cells, Place, String)>,
    crowded: Option<(Cells, Place)>,
}

/// What the time column says.
pub(super) struct Timed {
    /// Seconds since the first sample.
    pub(super) seconds: Vec<f64>,
    /// What the file calls the time of that, s.
    pub(super) first: f64,
    pub(super) disorder: Disorder,
}

/// The last row that had a time.
struct Last {
    seconds: f64,
    place: Place,
    text: Vec<u8>,
    /// The first of the rows with this time, and how many there are.
    same_from: Place,
    same: usize,
}

impl Time {
    /// The time column under this header.
    pub(super) fn of(
        column: Column,
        order: Order,
        diagnostics: &mut Diagnostics,
    ) -> Result<Time, Reported> {
        if let Some(fault) = column.fault {
            return Err(diagnostics.error(fault));
        }
        let factor = match column.unit {
            None => None,
            Some(unit) if unit.dimension == Dimension::of([0, 0, 1, 0, 0, 0, 0]) => {
                Some(unit.factor)
            }
            Some(unit) => {
                let message = format!("`time` is in `{}`, which is no unit of time", unit.symbol);
                return Err(diagnostics.error(
                    Diagnostic::new(Code::E604, column.place, message)
                        .help("write `time [s]`, or `time` with ISO 8601 stamps"),
                ));
            }
        };
        Ok(Time {
            header: column.place,
            order,
            left_out: 0,
            factor,
            clock: None,
            seconds: Vec::new(),
            last: None,
            unreadable: None,
            backwards: None,
            crowded: None,
        })
    }

    /// Seconds in the header's unit, if it has one.
    pub(super) fn factor(&self) -> Option<f64> {
        self.factor
    }

    /// Takes in the time of a row; false for one that is to be left out.
    pub(super) fn take(&mut self, record: &Record<'_>, kept: Kept) -> bool {
        let cell = record.cell(0);
        let place = kept.place(&record.place(0), record.line, self.header);
        let read = match &self.clock {
            Some(clock) => clock.seconds(cell),
            None => Clock::start(cell, self.factor).map(|clock| {
                self.clock = Some(clock);
                0.0
            }),
        };
        let seconds = match read {
            Ok(seconds) => seconds,
            Err(fault) => {
                match &mut self.unreadable {
                    Some((cells, _)) => cells.count += 1,
                    None => self.unreadable = Some((Cells::one(place, record.text(0)), fault)),
                }
                return true;
            }
        };
        let Some(last) = &mut self.last else {
            let text = cell.to_owned();
            self.last = Some(Last { seconds, place, text, same_from: place, same: 1 });
            self.seconds.push(seconds);
            return true;
        };
        let before = (last.same, last.same_from);
        if seconds == last.seconds {
            last.same += 1;
        } else {
            last.same = 1;
            last.same_from = place;
        }
        if last.same > 2 {
            match &mut self.crowded {
                Some((cells, _)) => cells.count += 1,
                None => self.crowded = Some((Cells::one(place, record.text(0)), last.same_from)),
            }
        }
        if seconds < last.seconds {
            if let Some((cells, ..)) = &mut self.backwards {
                cells.count += 1;
            } else {
                let text = String::from_utf8_lossy(&last.text).into_owned();
                self.backwards = Some((Cells::one(place, record.text(0)), last.place, text));
            }
        }
        if self.order == Order::Recorded && (seconds < last.seconds || last.same > 2) {
            // The latest time so far stays what the next ones are compared with.
            self.left_out += 1;
            if seconds < last.seconds {
                (last.same, last.same_from) = before;
            }
            return false;
        }
        self.seconds.push(seconds);
        last.seconds = seconds;
        last.place = place;
        last.text.clear();
        last.text.extend_from_slice(cell);
        true
    }

    /// All times, unless they make the whole file doubtful.
    pub(super) fn finish(self, diagnostics: &mut Diagnostics) -> Result<Timed, Reported> {
        let mut reported = Ok(());
        if let Some((cells, fault)) = self.unreadable {
            let diagnostic = cells.diagnostic(Code::E607, fault.message(&cells.text));
            reported = Err(diagnostics.error(match fault.help() {
                Some(help) => diagnostic.help(help),
                None => diagnostic,
            }));
        }
        let mut disorder = Disorder { left_out: self.left_out, ..Disorder::default() };
        if let Some((cells, before, text)) = self.backwards {
            if self.order == Order::Recorded {
                disorder.backwards = Some(format!("`{}` comes after `{text}`", cells.text));
            } else {
                let message = format!("time runs backwards: `{}` comes after `{text}`", cells.text);
                let diagnostic = cells.diagnostic(Code::E605, message);
                reported =
                    Err(diagnostics
                        .error(diagnostic.label(before.span, before.text("the row before"))));
            }
        }
        if let Some((cells, first)) = self.crowded {
            if self.order == Order::Recorded {
                disorder.crowded = Some(cells.text);
            } else {
                let message = format!("more than two rows have the time `{}`", cells.text);
                let diagnostic = cells.diagnostic(Code::E606, message);
                reported = Err(diagnostics.error(
                    diagnostic
                        .label(first.span, first.text("the first of them"))
                        .help("two rows with one time are the left and right values of a jump"),
                ));
            }
        }
        reported?;
        let first = self.clock.map_or(0.0, |clock| clock.first_time());
        Ok(Timed { seconds: self.seconds, first, disorder })
    }
}
