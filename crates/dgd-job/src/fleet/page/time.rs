//! Positions of occasions on a time axis.

use std::collections::BTreeMap;

use super::super::Fleet;

/// A time axis: years if all occasions are dates or numbers, and otherwise their order.
pub(super) enum TimeAxis {
    /// Years, or the numbers of the job file.
    Numbers,
    /// The index of an occasion's name, in order of appearance.
    Order(BTreeMap<String, usize>),
}

impl TimeAxis {
    /// The axis for all occasions of a fleet.
    pub(super) fn from_fleet(fleet: &Fleet) -> TimeAxis {
        let dates = || fleet.wells.iter().flat_map(|well| &well.occasions).map(|found| &found.when);
        if dates().all(|when| number(when).is_some()) {
            return TimeAxis::Numbers;
        }
        let mut places = BTreeMap::new();
        for when in dates() {
            let next = places.len();
            places.entry(when.clone()).or_insert(next);
        }
        TimeAxis::Order(places)
    }

    /// The position of an occasion.
    pub(super) fn position(&self, when: &str) -> f64 {
        match self {
            TimeAxis::Numbers => number(when).unwrap_or(f64::NAN),
            TimeAxis::Order(places) => places.get(when).map_or(f64::NAN, |place| *place as f64),
        }
    }

    /// The axis label.
    pub(super) fn label(&self) -> &'static str {
        match self {
            TimeAxis::Numbers => "When",
            TimeAxis::Order(_) => "Occasion, in the order of the job",
        }
    }
}

/// A number, or a date as a year: `2024-07` is 2024.5, `2024-07-15T12:00` a bit more.
fn number(when: &str) -> Option<f64> {
    if let Ok(number) = when.parse::<f64>() {
        return Some(number).filter(|number| number.is_finite());
    }
    let (date, clock) = when.split_once(['T', ' ']).unwrap_or((when, ""));
    let mut parts = date.split('-');
    let year = parts.next().filter(|year| year.len() == 4)?.parse::<u32>().ok()?;
    let mut part = |most: u32| match parts.next() {
        None => Some(1),
        Some(text) => text.parse::<u32>().ok().filter(|n| (1..=most).contains(n)),
    };
    let (month, day) = (part(12)?, part(31)?);
    let hours =
        clock.get(..2).and_then(|hours| hours.parse::<u32>().ok()).filter(|hours| *hours < 24);
    let is_sound = parts.next().is_none() && (clock.is_empty() || hours.is_some());
    let is_leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let before: u32 = (1..month)
        .map(|month| match month {
            2 => 28 + u32::from(is_leap),
            4 | 6 | 9 | 11 => 30,
            _ => 31,
        })
        .sum();
    let days = f64::from(before + day - 1) + f64::from(hours.unwrap_or(0)) / 24.0;
    is_sound.then(|| f64::from(year) + days / (365.0 + f64::from(u32::from(is_leap))))
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn dates_are_years() {
        let near = |text: &str, year: f64| {
            let parsed = number(text).expect(text);
            assert!((parsed - year).abs() < 1e-9, "{text}: {parsed}");
        };
        near("2024", 2024.0);
        near("2023-07-02", 2023.0 + 182.0 / 365.0);
        near("2024-12-31T12:00", 2024.0 + 365.5 / 366.0);
        near("17.5", 17.5);
        for text in ["march", "2024-13", "2024-1-1-1", "24-01-01", "2024-01-01Tx", "inf"] {
            assert_eq!(number(text), None, "{text}");
        }
    }
}
