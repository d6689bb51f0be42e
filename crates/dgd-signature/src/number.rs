//! Numbers in sentences, in one style: `935`, `0.012`, `9.4·10⁷`.
//!
//! In tables, from which users copy, numbers are in the notation of models: `9.4e7`.

use std::fmt;

/// Powers of ten for which a number is written out.
const WRITTEN_OUT: std::ops::Range<i32> = -3..6;

/// A number and its unit, `9.81 m/s^2`; a quantity without one is the number alone.
pub fn with_unit(number: impl fmt::Display, unit: &str) -> String {
    if matches!(unit, "" | "1") { number.to_string() } else { format!("{number} {unit}") }
}

/// A number with this many significant digits; integers keep all of theirs.
pub fn rounded(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let size = decade(value.abs());
    // 9.96 is 10 to two digits, of which the leading one is in the next decade.
    let is_next = |digits| fixed(value.abs() / 10_f64.powi(size), digits).starts_with("10");
    let is_written = WRITTEN_OUT.contains(&size);
    let size = if !is_written && is_next(digits - 1) { size + 1 } else { size };
    if WRITTEN_OUT.contains(&size) {
        fixed(value, (digits - 1 - size).max(0))
    } else {
        let mantissa = fixed(value / 10_f64.powi(size), digits - 1);
        format!("{mantissa}{}", times_ten_to(size))
    }
}

/// A number with at most this many significant digits, without trailing zeros: `0.05`, `10⁻⁹`.
pub fn short(value: f64, digits: i32) -> String {
    let text = rounded(value, digits);
    let (mantissa, power) = without_zeros(&text, '·');
    match (mantissa, power.strip_prefix('·')) {
        ("1", Some(power)) => power.to_owned(),
        ("−1", Some(power)) => format!("−{power}"),
        _ => format!("{mantissa}{power}"),
    }
}

/// A formatted number without trailing zeros after the decimal point, and its power of ten, which begins with `mark`.
pub fn without_zeros(text: &str, mark: char) -> (&str, &str) {
    let (mantissa, power) = text.split_at(text.find(mark).unwrap_or(text.len()));
    if mantissa.contains('.') {
        (mantissa.trim_end_matches('0').trim_end_matches('.'), power)
    } else {
        (mantissa, power)
    }
}

/// A number with this many decimals; a negative count rounds to tens, hundreds and so on.
pub fn fixed(value: f64, decimals: i32) -> String {
    let text = if decimals >= 0 {
        format!("{value:.*}", decimals.cast_unsigned() as usize)
    } else {
        let unit = 10_f64.powi(-decimals);
        format!("{:.0}", (value / unit).round() * unit)
    };
    match text.strip_prefix('-') {
        // Avoids −0.00.
        Some(digits) if digits.bytes().all(|b| matches!(b, b'0' | b'.')) => digits.to_owned(),
        Some(digits) => format!("−{digits}"),
        None => text,
    }
}

/// The power of ten of the leading digit, 0 for zero.
pub fn decade(x: f64) -> i32 {
    if x > 0.0 { x.log10().floor() as i32 } else { 0 }
}

/// `·10⁸`; empty for the power 0.
pub fn times_ten_to(power: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    if power == 0 {
        return String::new();
    }
    let raised = |c: char| c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize]);
    let exponent: String = power.to_string().chars().map(raised).collect();
    format!("·10{exponent}")
}

/// Whether a number is written out, without a power of ten.
pub fn is_written_out(size: i32) -> bool {
    WRITTEN_OUT.contains(&size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_without_a_unit_show_none() {
        let shown = ["m/s", "1", ""].map(|unit| with_unit(rounded(1.14, 3), unit));
        assert_eq!(shown, ["1.14 m/s", "1.14", "1.14"]);
    }

    #[test]
    fn numbers_are_rounded_to_their_digits() {
        for (value, digits, shown) in [
            (0.012_34, 2, "0.012"),
            (4821.3, 2, "4821"),
            (-0.000_01, 2, "−1.0·10⁻⁵"),
            (1.0, 2, "1.0"),
            (f64::INFINITY, 2, "–"),
        ] {
            assert_eq!(rounded(value, digits), shown);
        }
    }

    #[test]
    fn short_numbers_have_no_zeros_behind_them() {
        for (value, digits, shown) in [
            (935.04, 3, "935"),
            (1200.0, 2, "1200"),
            (0.05, 6, "0.05"),
            (-0.0, 3, "0"),
            (1e-9, 2, "10⁻⁹"),
            (-1e10, 2, "−10¹⁰"),
            (9.379_770_62e7, 2, "9.4·10⁷"),
            (2.50e-7, 3, "2.5·10⁻⁷"),
            (9.96e-32, 2, "10⁻³¹"),
            (-9.9996e7, 3, "−10⁸"),
            (9.996e-4, 3, "0.001"),
            (999_999.0, 3, "999999"),
        ] {
            assert_eq!(short(value, digits), shown);
        }
    }
}
