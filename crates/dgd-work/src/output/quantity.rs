//! Numbers rounded to their accuracy.
//!
//! A standard deviation has two digits, and its value as many decimals; a number without one has the digits that the
//! caller requests.

use std::fmt;

use dgd_compiler::units::parse_unit;
use dgd_discover::ParameterValue;
use dgd_runtime::Unit;
pub use dgd_runtime::signature::number::with_unit;
use dgd_runtime::signature::number::{decade, fixed, is_written_out, times_ten_to};
pub(crate) use dgd_runtime::signature::number::{rounded, short};

/// Digits of a value whose standard deviation is unknown.
const DIGITS: i32 = 4;

/// The unit of differences of values in a unit, which has no offset.
pub(crate) fn of_differences(unit: &Unit) -> Unit {
    let symbol = match parse_unit(&unit.symbol) {
        Ok(parsed) => parsed.of_differences().symbol.into(),
        Err(_) => unit.symbol.clone(),
    };
    Unit { symbol, factor: unit.factor, offset: 0.0 }
}

/// A value and its standard deviation, `275.0 ± 1.2` or `(1.752 ± 0.031)·10⁸`; if the model lacks something, also the
/// possible bias: `275.0 ± 1.2, model ± 4.1`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct UncertainValue {
    value: f64,
    std: Option<f64>,
    std_model: Option<f64>,
}

impl UncertainValue {
    /// A value and its standard deviation.
    pub(crate) fn new(value: f64, std: f64) -> UncertainValue {
        UncertainValue { value, std: Some(std), std_model: None }
    }

    /// A value, with its standard deviation if that is a positive number.
    pub(crate) fn with(value: f64, std: f64) -> UncertainValue {
        let std = Some(std).filter(|std| std.is_finite() && *std > 0.0);
        UncertainValue { value, std, std_model: None }
    }

    /// The value alone.
    pub(crate) fn value(&self) -> f64 {
        self.value
    }

    /// A parameter in its declared unit.
    pub(crate) fn from_parameter(parameter: &ParameterValue) -> UncertainValue {
        let unit = &parameter.unit;
        let value = unit.from_si(parameter.value);
        let shown = |std: Option<f64>| {
            std.map(|std| std / unit.factor).filter(|std| std.is_finite() && *std > 0.0)
        };
        UncertainValue { value, std: shown(parameter.std), std_model: shown(parameter.std_model) }
    }
}

/// A value and its standard deviation as in tables: `275.0 ± 1.2` or `(1.752 ± 0.031)·10⁸`.
pub fn shown(value: f64, std: Option<f64>) -> String {
    UncertainValue::with(value, std.unwrap_or(f64::NAN)).to_string()
}

/// A value with the digits that a standard deviation warrants, without the deviation.
pub fn shown_like(value: f64, std: f64) -> String {
    let text = UncertainValue::with(value, std).to_string();
    let power = text.split_once(')').map_or("", |(_, power)| power);
    match text.split_once(" ± ") {
        Some((value, _)) => format!("{}{power}", value.trim_start_matches('(')),
        None => text,
    }
}

impl fmt::Display for UncertainValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let UncertainValue { value, std, std_model } = *self;
        if !value.is_finite() {
            return f.write_str("–");
        }
        let size = decade(value.abs().max(std.unwrap_or(0.0)));
        let power = if is_written_out(size) { 0 } else { size };
        let scale = 10_f64.powi(power);
        let Some(std) = std else {
            let digits = fixed(value / scale, DIGITS - 1 - (size - power));
            return write!(f, "{digits}{}", times_ten_to(power));
        };
        // Two digits for the standard deviation.
        let decimals = 1 - decade(std / scale);
        let (value, std) = (fixed(value / scale, decimals), fixed(std / scale, decimals));
        let model = std_model.map_or_else(String::new, |std| {
            format!(", model ± {}", fixed(std / scale, 1 - decade(std / scale)))
        });
        if power == 0 {
            write!(f, "{value} ± {std}{model}")
        } else {
            write!(f, "({value} ± {std}{model}){}", times_ten_to(power))
        }
    }
}

/// A probability from `resamples` resamplings; the smallest they can resolve is a bound.
pub(crate) fn probability(p: f64, resamples: usize) -> String {
    let least = 1.0 / (resamples as f64 + 1.0);
    if p <= least * (1.0 + 1e-9) {
        format!("p ≤ {}", rounded(least, 2))
    } else {
        format!("p = {}", rounded(p, 2))
    }
}

/// A share as a percentage.
pub(crate) fn percent(share: f64) -> String {
    if share.is_finite() { format!("{} %", fixed(100.0 * share, 0)) } else { "–".to_owned() }
}

/// Most intervals listed.
const LISTED: usize = 10;

/// Intervals in seconds, `612–1034 s, 2100–2230 s`; the last of them has three digits or more. Of many intervals the
/// ten longest are listed, and the others summed up.
pub(crate) fn stretches(windows: impl IntoIterator<Item = [f64; 2]>) -> String {
    let mut windows: Vec<[f64; 2]> = windows.into_iter().collect();
    let duration = |[from, until]: &[f64; 2]| until - from;
    let summary = (windows.len() > LISTED).then(|| {
        let total: f64 = windows.iter().map(duration).sum();
        let n = windows.len();
        let mut sizes: Vec<f64> = windows.iter().map(duration).collect();
        sizes.sort_by(|a, b| b.total_cmp(a));
        let least = sizes[LISTED - 1];
        // Of equally long ones the first are kept.
        let mut equal = LISTED - sizes.iter().filter(|size| **size > least).count();
        windows.retain(|window| {
            let is_equal = duration(window) == least && equal > 0;
            equal -= usize::from(is_equal);
            duration(window) > least || is_equal
        });
        format!(" and {} shorter ones; {n} in all, together {}", n - LISTED, moment(total))
    });
    let decimals = decimals(windows.iter().map(|[_, until]| *until).fold(0.0, f64::max));
    let listed: Vec<String> = windows
        .iter()
        .map(|[from, until]| {
            let [from, until] = [from, until].map(|t| fixed(*t, decimals));
            if from == until { format!("{from} s") } else { format!("{from}–{until} s") }
        })
        .collect();
    listed.join(", ") + summary.as_deref().unwrap_or_default()
}

/// A time in seconds, with three digits or more.
pub(crate) fn moment(t: f64) -> String {
    format!("{} s", fixed(t, decimals(t)))
}

/// Decimals with which a time has three digits: none for minutes, more for milliseconds.
fn decimals(t: f64) -> i32 {
    let size = t.abs().log10().floor();
    if size.is_finite() { (2.0 - size).clamp(0.0, 12.0) as i32 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_has_the_decimals_of_its_standard_deviation() {
        for (value, std, shown) in [
            (275.04, Some(1.23), "275.0 ± 1.2"),
            (1.7521e8, Some(3.1e6), "(1.752 ± 0.031)·10⁸"),
            (9012.3, Some(204.0), "9010 ± 200"),
            (-0.000_412, Some(1.5e-5), "(−4.12 ± 0.15)·10⁻⁴"),
            (0.001, Some(2.0), "0.0 ± 2.0"),
            (0.951_2, None, "0.9512"),
            (1.1e8, None, "1.100·10⁸"),
            (0.0, None, "0.000"),
            (f64::NAN, None, "–"),
        ] {
            assert_eq!(
                UncertainValue { value, std, std_model: None }.to_string(),
                shown,
                "{value}"
            );
        }
        for (value, std, std_model, shown) in [
            (1.047_18, 1.7e-4, 0.005_04, "1.04718 ± 0.00017, model ± 0.0050"),
            (2.1352e9, 3.2e6, 8.6e7, "(2.1352 ± 0.0032, model ± 0.086)·10⁹"),
        ] {
            let quantity = UncertainValue { value, std: Some(std), std_model: Some(std_model) };
            assert_eq!(quantity.to_string(), shown);
        }
    }

    #[test]
    fn probabilities_shares_and_times_are_in_words() {
        assert_eq!(probability(0.001, 999), "p ≤ 0.0010");
        assert_eq!(probability(0.034, 999), "p = 0.034");
        assert_eq!(percent(0.987), "99 %");
        assert_eq!(stretches([[612.0, 1034.4], [2.0, 3.0]]), "612–1034 s, 2–3 s");
        let many = (0..14).map(|k| [f64::from(100 * k), f64::from(100 * k + 20 + k % 5)]);
        assert_eq!(
            stretches(many),
            "100–121 s, 200–222 s, 300–323 s, 400–424 s, 600–621 s, 700–722 s, 800–823 s, 900–924 s, 1200–1222 s, \
             1300–1323 s and 4 shorter ones; 14 in all, together 306 s"
        );
        assert_eq!(stretches([[5.0, 5.0], [7.0, 900.0]]), "5 s, 7–900 s");
        assert_eq!(stretches([[0.01, 0.0402], [1.0, 1.2]]), "0.01–0.04 s, 1.00–1.20 s");
        assert_eq!(
            ["118.4", "0.01184"].map(|t| moment(t.parse().expect("a number"))),
            ["118 s", "0.0118 s"]
        );
    }
}
