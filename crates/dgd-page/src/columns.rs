//! The numbers of a page: each column once, with as many digits as are visible.

use std::collections::{BTreeSet, HashMap};
use std::fmt::Write;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Resolution of a column relative to its range, finer than anyone zooms.
const RESOLUTION: f64 = 1e-6;
/// Minimum number of significant digits, however small a number is relative to its column.
const DIGITS: i32 = 5;

/// Columns of numbers; equal ones are stored once.
#[derive(Debug, Default)]
pub(crate) struct StoredColumns {
    texts: Vec<String>,
    places: HashMap<Vec<u64>, usize>,
    /// Keys of columns that the reader already has, which are left out.
    known: Option<BTreeSet<String>>,
    keys: Vec<String>,
}

impl StoredColumns {
    /// Columns for a reader who already has those with these keys.
    pub(crate) fn beside(known: BTreeSet<String>) -> Self {
        StoredColumns { known: Some(known), ..StoredColumns::default() }
    }

    /// Adds a column of ordinates, or of abscissas, which keep all of their digits, and returns its position.
    pub(crate) fn add(&mut self, values: &[f64], is_exact: bool) -> usize {
        let mut key: Vec<u64> = values.iter().map(|value| value.to_bits()).collect();
        key.push(u64::from(is_exact));
        let next = self.texts.len();
        let place = *self.places.entry(key).or_insert(next);
        if place == next {
            let is_known = self.known.as_ref().is_some_and(|known| {
                self.keys.push(key_of(values, is_exact));
                known.contains(&self.keys[place])
            });
            self.texts.push(match (is_known, is_exact) {
                (true, _) => "null".to_owned(),
                (false, true) => exact(values),
                (false, false) => visible(values),
            });
        }
        place
    }

    /// The keys of all columns, as a JSON array.
    pub(crate) fn keys_to_json(&self) -> String {
        listed(self.keys.iter().map(|key| format!("\"{key}\"")))
    }

    /// All columns, as a JSON array of arrays.
    pub(crate) fn to_json(&self) -> String {
        format!("[{}]", self.texts.join(",\n"))
    }
}

/// A key of a column's numbers, with a collision probability of 1 in 10¹⁹.
fn key_of(values: &[f64], is_exact: bool) -> String {
    let mut hasher = DefaultHasher::new();
    is_exact.hash(&mut hasher);
    for value in values {
        value.to_bits().hash(&mut hasher);
    }
    format!("{:016x}", hasher.finish())
}

/// Numbers with all digits; null for values that are not finite.
fn exact(values: &[f64]) -> String {
    let shown = |value: &f64| shortest(*value);
    listed(values.iter().map(shown))
}

/// Numbers with as many decimals as the column's range needs.
fn visible(values: &[f64]) -> String {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    let of_range = decimals(high - low).map(|d| d - RESOLUTION.log10().round() as i32);
    let shown = |value: f64| {
        if !value.is_finite() {
            return "null".to_owned();
        }
        let needed = decimals(value.abs()).map_or(0, |decimals| decimals + DIGITS - 1);
        let decimals = needed.max(of_range.unwrap_or(needed));
        if (0..=15).contains(&decimals) && value.abs() < 1e15 {
            trimmed(&format!("{value:.*}", decimals.cast_unsigned() as usize))
        } else {
            // So large or so small that significant digits count.
            let digits = (DIGITS + decimals - needed).clamp(1, 17).cast_unsigned() as usize - 1;
            format!("{value:.digits$e}").parse().map_or_else(|_| "null".to_owned(), shortest)
        }
    };
    listed(values.iter().map(|value| shown(*value)))
}

/// Decimals that show the first digit of a number: 0 for 1 … 9, 2 for 0.01 … 0.09, −1 for 10 … 99.
fn decimals(size: f64) -> Option<i32> {
    (size > 0.0 && size.is_finite()).then(|| -(size.log10().floor() as i32))
}

/// Without trailing zeros.
fn trimmed(text: &str) -> String {
    let short =
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text };
    if short == "-0" { "0".to_owned() } else { short.to_owned() }
}

fn shortest(value: f64) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = match value.abs() {
        size if !size.is_finite() => write!(text, "null"),
        size if size != 0.0 && !(1e-5..1e15).contains(&size) => write!(text, "{value:e}"),
        _ => write!(text, "{value}"),
    };
    if text == "-0" { "0".to_owned() } else { text }
}

fn listed(numbers: impl Iterator<Item = String>) -> String {
    format!("[{}]", numbers.collect::<Vec<_>>().join(","))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_has_the_digits_that_can_be_seen() {
        assert_eq!(visible(&[0.0, 1.0 / 3.0, 1.0]), "[0,0.333333,1]");
        assert_eq!(visible(&[100_000.123_456_789, 100_000.25]), "[100000.1234568,100000.25]");
        // A number that is small relative to the rest keeps its own digits.
        assert_eq!(visible(&[1e3, 1.234_567e-5]), "[1000,0.000012346]");
        assert_eq!(visible(&[2e20, 1.234_567_891e20]), "[2e20,1.2345679e20]");
        assert_eq!(visible(&[f64::NAN, -0.0, f64::INFINITY]), "[null,0,null]");
        assert_eq!(exact(&[0.1, 1e-7, 1.5e300, f64::NAN]), "[0.1,1e-7,1.5e300,null]");
    }

    #[test]
    fn what_is_written_differs_by_less_than_a_pixel_of_a_thousandfold_zoom() {
        let values: Vec<f64> = (0..2000)
            .map(|i| 3e5 + 17.0 * (f64::from(i) * 0.7).sin() * 1.1f64.powi(i % 60))
            .collect();
        let range = 2.0 * 17.0 * 1.1f64.powi(59);
        let text = visible(&values);
        let read = text.trim_matches(['[', ']']).split(',').map(str::parse::<f64>);
        for (read, value) in read.zip(&values) {
            let read = read.expect("a number");
            assert!((read - value).abs() < range / (1000.0 * 1000.0), "{read} {value}");
        }
    }

    #[test]
    fn equal_columns_stand_once() {
        let mut columns = StoredColumns::default();
        let time = [0.0, 1.0, 2.0];
        let places = [&time[..], &[0.0, 5.0], &time].map(|values| columns.add(values, true));
        assert_eq!(places, [0, 1, 0]);
        assert_eq!(columns.to_json(), "[[0,1,2],\n[0,5]]");
        assert_eq!(columns.keys_to_json(), "[]");
    }

    #[test]
    fn what_a_reader_has_is_left_out() {
        let mut first = StoredColumns::beside(BTreeSet::new());
        first.add(&[0.0, 1.0], true);
        first.add(&[2.0], false);
        let keys = first.keys_to_json();
        let key = keys.trim_matches(['[', ']']).split(',').next().expect("two keys");
        let mut next = StoredColumns::beside(BTreeSet::from([key.trim_matches('"').to_owned()]));
        let places = [(&[0.0, 1.0][..], true), (&[3.0], false), (&[0.0, 1.0], false)]
            .map(|(values, is_exact)| next.add(values, is_exact));
        assert_eq!(places, [0, 1, 2]);
        // The same numbers with fewer digits are a different column.
        assert_eq!(next.to_json(), "[null,\n[3],\n[0,1]]");
        assert!(next.keys_to_json().starts_with(&format!("[{key},")));
    }
}
