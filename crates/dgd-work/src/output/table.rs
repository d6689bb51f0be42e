//! Plain-text tables of numbers.

use std::fmt::Write as _;

use dgd_runtime::signature::number::without_zeros;

/// Columns as wide as their widest cell, numbers right-aligned.
pub(crate) fn push_table<R: AsRef<[String]>>(text: &mut String, rows: &[R]) {
    let columns = rows.first().map_or(0, |row| row.as_ref().len());
    let width =
        |j: usize| rows.iter().map(|row| row.as_ref()[j].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    for row in rows {
        let mut line = String::new();
        for (j, (cell, width)) in row.as_ref().iter().zip(&widths).enumerate() {
            let is_number = |cell: &str| cell == "-" || cell.parse::<f64>().is_ok();
            let right = rows.iter().skip(1).any(|row| is_number(&row.as_ref()[j]));
            let gap = if j == 0 { "" } else { "  " };
            // Writing to a string cannot fail.
            let _ = if right {
                write!(line, "{gap}{cell:>width$}")
            } else {
                write!(line, "{gap}{cell:<width$}")
            };
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
}

/// A number with this many significant digits, with an exponent where it would have many zeros.
pub(crate) fn significant(value: f64, digits: usize) -> String {
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    let exponent = scientific.rsplit_once('e').and_then(|(_, e)| e.parse::<i32>().ok());
    match exponent {
        Some(exponent) if value != 0.0 && (-4..6).contains(&exponent) => {
            let decimals = (digits as f64 - 1.0 - f64::from(exponent)).max(0.0) as usize;
            format!("{value:.decimals$}")
        }
        _ if value == 0.0 => "0".to_owned(),
        _ => scientific,
    }
}

/// The same for an exact number, without trailing zeros: `52.75` and `200`.
pub(crate) fn exact(value: f64, digits: usize) -> String {
    let text = significant(value, digits);
    let (mantissa, exponent) = without_zeros(&text, 'e');
    format!("{mantissa}{exponent}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_numbers_end_where_they_end() {
        for (value, shown) in [
            (200.0, "200"),
            (-0.5, "-0.5"),
            (0.0, "0"),
            (52.75, "52.75"),
            (1.5e8, "1.5e8"),
            (2e-9, "2e-9"),
            (-0.002_892_45, "-0.00289245"),
        ] {
            assert_eq!(exact(value, 6), shown);
        }
    }
}
