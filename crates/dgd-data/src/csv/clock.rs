//! The time column: numbers in a unit of time, or ISO 8601 timestamps.

use jiff::Timestamp;
use jiff::civil::DateTime;
use jiff::tz::Offset;

use crate::cell::number;

/// Converts the cells of a time column to seconds since the first.
#[derive(Debug)]
pub(crate) enum TimeColumnClock {
    /// Numbers; `factor` converts the unit to seconds.
    Counted { factor: f64, first: f64 },
    /// Timestamps with `Z` or an offset.
    Zoned { first: Timestamp },
    /// Timestamps without a zone. They are differences of one clock, which is assumed not to switch between summer and
    /// winter time.
    Local { first: Timestamp },
}

/// The timestamp of a file's first row, from which its times are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Epoch {
    first: Timestamp,
    is_zoned: bool,
}

impl Epoch {
    /// The timestamp this many seconds later, as ISO 8601 to the nanosecond: `2026-11-21T10:00:00.5Z`, without the `Z`
    /// if the file's timestamps have no zone. `None` beyond the calendar.
    pub fn stamp(&self, seconds: f64) -> Option<String> {
        let later = self.first.as_nanosecond() + (seconds * 1e9).round() as i128;
        let text = Timestamp::from_nanosecond(later).ok()?.to_string();
        Some(if self.is_zoned { text } else { text.trim_end_matches('Z').to_owned() })
    }
}

/// A fault of a cell in a time column.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum TimeFault {
    /// It is empty.
    Missing,
    /// It is neither a number nor a timestamp.
    NotATime,
    /// It is a number, but the header has no unit.
    NoUnit,
    /// It is a number in a column of timestamps, or the reverse.
    NotLikeTheFirst,
    /// Only one of this timestamp and the first has a zone.
    OneZone,
}

impl TimeFault {
    /// The message for the cell with this `text`.
    pub(crate) fn message(&self, text: &str) -> String {
        match self {
            TimeFault::Missing => "this row has no time".to_owned(),
            TimeFault::NotATime => {
                format!("`{text}` is neither a number nor an ISO 8601 stamp")
            }
            TimeFault::NoUnit => format!("`{text}` has no unit of time"),
            TimeFault::NotLikeTheFirst => {
                format!("`{text}` is not of the kind that the time column starts with")
            }
            TimeFault::OneZone => {
                "of this stamp and the first, one has a zone and the other has none".to_owned()
            }
        }
    }

    /// Advice.
    pub(crate) fn help(&self) -> Option<&'static str> {
        match self {
            TimeFault::Missing => None,
            TimeFault::NotATime => Some("a stamp looks like `2026-11-21T10:57:00Z`"),
            TimeFault::NoUnit => Some("write `time [s]` in the header"),
            TimeFault::NotLikeTheFirst => Some("write all of them as numbers, or all as stamps"),
            TimeFault::OneZone => Some("write `Z` or an offset behind all stamps, or behind none"),
        }
    }
}

/// A cell that may contain a time.
enum TimeCell {
    Missing,
    Number(f64),
    Zoned(Timestamp),
    Local(Timestamp),
}

impl TimeCell {
    fn parse(cell: &[u8]) -> Result<TimeCell, TimeFault> {
        match number(cell) {
            Some(value) if value.is_nan() => return Ok(TimeCell::Missing),
            Some(value) => return Ok(TimeCell::Number(value)),
            None => {}
        }
        let text = str::from_utf8(cell).map_err(|_| TimeFault::NotATime)?;
        if let Ok(stamp) = text.parse::<Timestamp>() {
            return Ok(TimeCell::Zoned(stamp));
        }
        let local: DateTime = text.parse().map_err(|_| TimeFault::NotATime)?;
        Offset::UTC.to_timestamp(local).map(TimeCell::Local).map_err(|_| TimeFault::NotATime)
    }
}

impl TimeColumnClock {
    /// A clock that starts at this cell; `factor` is that of the header's unit, if any.
    pub(crate) fn start(cell: &[u8], factor: Option<f64>) -> Result<TimeColumnClock, TimeFault> {
        match TimeCell::parse(cell)? {
            TimeCell::Missing => Err(TimeFault::Missing),
            TimeCell::Number(first) => {
                let factor = factor.ok_or(TimeFault::NoUnit)?;
                Ok(TimeColumnClock::Counted { factor, first })
            }
            TimeCell::Zoned(first) => Ok(TimeColumnClock::Zoned { first }),
            TimeCell::Local(first) => Ok(TimeColumnClock::Local { first }),
        }
    }

    /// Its first timestamp, if its times are timestamps.
    pub(crate) fn epoch(&self) -> Option<Epoch> {
        match self {
            TimeColumnClock::Counted { .. } => None,
            TimeColumnClock::Zoned { first } => Some(Epoch { first: *first, is_zoned: true }),
            TimeColumnClock::Local { first } => Some(Epoch { first: *first, is_zoned: false }),
        }
    }

    /// Seconds between the first time and this cell.
    pub(crate) fn seconds(&self, cell: &[u8]) -> Result<f64, TimeFault> {
        match (self, TimeCell::parse(cell)?) {
            (_, TimeCell::Missing) => Err(TimeFault::Missing),
            (TimeColumnClock::Counted { factor, first }, TimeCell::Number(time)) => {
                let seconds = (time - first) * factor;
                if seconds.is_finite() { Ok(seconds) } else { Err(TimeFault::NotATime) }
            }
            (TimeColumnClock::Zoned { first }, TimeCell::Zoned(stamp))
            | (TimeColumnClock::Local { first }, TimeCell::Local(stamp)) => {
                Ok((stamp.as_nanosecond() - first.as_nanosecond()) as f64 / 1e9)
            }
            (TimeColumnClock::Zoned { .. }, TimeCell::Local(_))
            | (TimeColumnClock::Local { .. }, TimeCell::Zoned(_)) => Err(TimeFault::OneZone),
            (TimeColumnClock::Counted { .. }, TimeCell::Zoned(_) | TimeCell::Local(_))
            | (
                TimeColumnClock::Zoned { .. } | TimeColumnClock::Local { .. },
                TimeCell::Number(_),
            ) => Err(TimeFault::NotLikeTheFirst),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_of_several_spellings_are_seconds_apart() {
        let clock = TimeColumnClock::start(b"2026-11-21T10:00:00Z", None).expect("a stamp");
        assert_eq!(clock.seconds(b"2026-11-21 10:00:01.25Z"), Ok(1.25));
        assert_eq!(clock.seconds(b"2026-11-21T12:00:00+01:00"), Ok(3600.0));
        assert_eq!(clock.seconds(b"2026-11-21T10:00:00"), Err(TimeFault::OneZone));
        assert_eq!(clock.seconds(b"7"), Err(TimeFault::NotLikeTheFirst));
        assert_eq!(clock.seconds(b""), Err(TimeFault::Missing));
        assert_eq!(clock.seconds(b"21.11.2026 10:57"), Err(TimeFault::NotATime));
        let clock = TimeColumnClock::start(b"2026-02-28", None).expect("a date");
        assert_eq!(clock.seconds(b"2026-03-01T00:00:00,5"), Ok(86_400.5));
    }

    #[test]
    fn stamps_are_written_again() {
        for (first, later) in [
            ("2026-11-21T10:00:00Z", "2026-11-21T11:00:00.25Z"),
            ("2026-11-21T12:00:00+02:00", "2026-11-21T11:00:00.25Z"),
            ("2026-11-21 10:00:00", "2026-11-21T11:00:00.25"),
        ] {
            let clock = TimeColumnClock::start(first.as_bytes(), None).expect("a stamp");
            let stamp = clock.epoch().and_then(|epoch| epoch.stamp(3600.25));
            assert_eq!(stamp.as_deref(), Some(later));
            assert_eq!(clock.seconds(later.as_bytes()), Ok(3600.25));
        }
        assert_eq!(TimeColumnClock::start(b"1", Some(1.0)).expect("a number").epoch(), None);
    }

    #[test]
    fn numbers_need_a_unit() {
        assert_eq!(TimeColumnClock::start(b"0", None).err(), Some(TimeFault::NoUnit));
        let clock = TimeColumnClock::start(b"0.5", Some(60.0)).expect("a number");
        assert_eq!(clock.seconds(b"2"), Ok(90.0));
        assert_eq!(clock.seconds(b"2026-11-21"), Err(TimeFault::NotLikeTheFirst));
    }
}
