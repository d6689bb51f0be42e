//! Cells of CSV text: numbers and quoted names.

use std::fmt::Write as _;

/// A header cell, quoted if CSV requires it.
pub fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}

/// Appends a number with the fewest digits that read back to it, with an exponent where it would otherwise have many
/// zeros.
pub fn push_number(text: &mut String, value: f64) {
    let size = value.abs();
    // Writing to a string cannot fail.
    let _ = if size == 0.0 || (1e-5..1e16).contains(&size) || !size.is_finite() {
        write!(text, "{value}")
    } else {
        write!(text, "{value:e}")
    };
}

/// A number as a single cell.
pub(crate) fn shown(value: f64) -> String {
    let mut text = String::new();
    push_number(&mut text, value);
    text
}

/// The number in a cell; NaN for a missing value, `None` for anything else.
pub(crate) fn number(cell: &[u8]) -> Option<f64> {
    if cell.is_empty() || cell.eq_ignore_ascii_case(b"na") {
        return Some(f64::NAN);
    }
    let value: f64 = str::from_utf8(cell).ok()?.parse().ok()?;
    (!value.is_infinite()).then_some(value)
}
