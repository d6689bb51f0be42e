//! Units that a number may have been meant in.

use super::catalogue::{CATALOGUE, Prefixes};
use super::{Unit, grammar, parse_unit};

/// Prefixes that are easily confused.
const PREFIXES: &[&str] = &["", "k", "m", "M", "c", "µ", "h"];

/// Units of the same dimension in which a number may have been meant, the simplest first, each once: one symbol is
/// replaced by another one of the catalogue, or a prefix and a unit of time are, as in km/h for m/s, or the whole unit
/// is replaced by one symbol of the catalogue.
pub fn mistaken(unit: &Unit) -> Vec<Unit> {
    let text = &unit.symbol;
    let Ok(factors) = grammar::parse(text) else { return Vec::new() };
    let exchanged = |text: &str, at: usize, by: &dyn Fn(&str) -> bool| -> Vec<String> {
        let Ok(factors) = grammar::parse(text) else { return Vec::new() };
        let factor = &factors[at];
        let Ok(own) = parse_unit(&factor.symbol) else { return Vec::new() };
        let start = factor.range.start;
        let end = start + factor.symbol.len();
        let others = symbols().into_iter().filter(|other| by(other));
        let is_alike =
            |other: &String| parse_unit(other).is_ok_and(|other| other.dimension == own.dimension);
        others
            .filter(is_alike)
            .map(|other| format!("{}{other}{}", &text[..start], &text[end..]))
            .collect()
    };
    let any = |_: &str| true;
    let mut texts: Vec<String> =
        (0..factors.len()).flat_map(|at| exchanged(text, at, &any)).collect();
    texts.extend(symbols());
    let is_of_time = |symbol: &str| matches!(symbol, "s" | "min" | "h" | "d");
    for at in 0..factors.len() {
        for once in exchanged(text, at, &is_of_time) {
            for other in (0..factors.len()).filter(|other| *other != at) {
                let symbol = &factors[other].symbol;
                let bare = symbol.strip_prefix(['k', 'm', 'c']).filter(|bare| !bare.is_empty());
                let is_prefixed = |other: &str| {
                    other.strip_prefix(['k', 'm', 'c']).is_some_and(|rest| rest == symbol)
                        || bare.is_some_and(|bare| bare == other)
                };
                texts.extend(exchanged(&once, other, &is_prefixed));
            }
        }
    }
    let mut units: Vec<Unit> = Vec::new();
    for text in texts {
        let Ok(other) = parse_unit(&text) else { continue };
        let is_same = |known: &Unit| {
            known.offset == other.offset && (known.factor / other.factor - 1.0).abs() < 1e-9
        };
        if other.dimension == unit.dimension && !is_same(unit) && !units.iter().any(is_same) {
            units.push(other);
        }
    }
    units
}

/// The symbols of the catalogue, those without a prefix first.
fn symbols() -> Vec<String> {
    let rows = || CATALOGUE.iter().filter(|row| row.datum.is_none());
    let with = |prefix: &'static str| {
        rows()
            .filter(move |row| prefix.is_empty() || row.prefixes == Prefixes::Allowed)
            // Kiloseconds are not used in practice.
            .filter(move |row| row.symbol != "s" || matches!(prefix, "" | "m" | "µ"))
            .map(move |row| format!("{prefix}{}", row.symbol))
    };
    PREFIXES.iter().flat_map(|prefix| with(prefix)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// SI values of these units, relative to one unit.
    fn ratios(text: &str) -> Vec<(String, f64)> {
        let unit = parse_unit(text).expect("a unit");
        let ratio = |other: Unit| (other.symbol.clone(), other.factor / unit.factor);
        mistaken(&unit).into_iter().map(ratio).collect()
    }

    #[test]
    fn units_that_are_taken_for_each_other_are_listed_by_size() {
        for (text, other, ratio) in [
            ("1/s", "1/min", 1.0 / 60.0),
            ("1/min", "1/s", 60.0),
            ("m/s", "km/h", 1.0 / 3.6),
            ("km/h", "m/s", 3.6),
            ("W", "kW", 1e3),
            ("kW", "W", 1e-3),
            ("J/(kg*K)", "kJ/(kg*K)", 1e3),
            ("m^3/s", "lpm", 1.0 / 60e3),
            ("deg", "rad", 180.0 / std::f64::consts::PI),
            ("m", "mm", 1e-3),
            ("K", "°C", 1.0),
        ] {
            let all = ratios(text);
            let found = all.iter().find(|(_, own)| (own / ratio - 1.0).abs() < 1e-9);
            assert_eq!(found.map(|(symbol, _)| symbol.as_str()), Some(other), "{text}: {all:?}");
        }
    }

    #[test]
    fn a_unit_is_not_mistaken_for_itself() {
        for text in ["1/s", "kg", "W/(m^2*K)", "bar"] {
            let all = ratios(text);
            assert!(!all.is_empty(), "{text}");
            assert!(all.iter().all(|(_, ratio)| (ratio - 1.0).abs() > 1e-9), "{text}: {all:?}");
        }
        assert!(ratios("1").iter().all(|(_, ratio)| *ratio != 1.0));
    }
}
