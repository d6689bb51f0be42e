//! Parsers for the values of options, which check them before anything is read.

use std::str::FromStr;

use dgd_compiler::units::parse_unit;
use dgd_runtime::integrate::catalogue::AUTOMATIC;
use dgd_runtime::{PerSample, Steps};

use super::LinearizeAt;

fn number(text: &str) -> Option<f64> {
    f64::from_str(text).ok().filter(|value| value.is_finite())
}

fn accepted(text: &str, is_allowed: impl Fn(f64) -> bool, what: &str) -> Result<f64, String> {
    number(text).filter(|value| is_allowed(*value)).ok_or_else(|| what.to_owned())
}

/// A relative tolerance. Values above 1 control nothing, and values below this limit cannot be resolved.
pub fn tolerance(text: &str) -> Result<f64, String> {
    const LEAST: f64 = 1e-15;
    accepted(
        text,
        |value| (LEAST..=1.0).contains(&value),
        "this must be a number above 0: from 1e-15 to 1",
    )
}

/// A time span or a variance.
pub fn positive(text: &str) -> Result<f64, String> {
    accepted(text, |value| value > 0.0, "this must be a number above 0")
}

/// A rate that may be zero.
pub fn not_negative(text: &str) -> Result<f64, String> {
    accepted(text, |value| value >= 0.0, "this must be 0 or a number above it")
}

/// A time on the axis of the data.
pub fn moment(text: &str) -> Result<f64, String> {
    seconds(text).ok_or_else(|| "this must be a time: 90, which is in s, or 1.5min, 24h".to_owned())
}

/// A forgetting factor, or an absolute tolerance as a fraction.
pub fn factor(text: &str) -> Result<f64, String> {
    accepted(text, |value| value > 0.0 && value <= 1.0, "this must be a number above 0 and up to 1")
}

/// A seed, or an upper bound of a count.
pub fn whole<T: FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| "this must be a whole number, 0 or more".to_owned())
}

/// A count of at least 1.
pub fn count(text: &str) -> Result<usize, String> {
    let count = text.parse().ok().filter(|count| (1..=MOST).contains(count));
    count.ok_or_else(|| format!("this must be a whole number, 1 or more, up to {MOST}"))
}

/// A count of at least 0, or an index.
pub fn count_or_none(text: &str) -> Result<usize, String> {
    let count = text.parse().ok().filter(|count| *count <= MOST);
    count.ok_or_else(|| format!("this must be a whole number, 0 or more, up to {MOST}"))
}

/// The largest count of fits, data sets, threads.
const MOST: usize = 1_000_000;

/// A length of time: `60s`, `5min`, `2 [h]`, or a number of seconds.
pub fn time(text: &str) -> Result<f64, String> {
    let length = seconds(text).filter(|length| *length > 0.0);
    length.ok_or_else(|| "this must be a length of time: 60, which is in s, or 5min, 2h".to_owned())
}

/// How step sizes are chosen.
pub fn steps(text: &str) -> Result<Steps, String> {
    match text {
        AUTOMATIC => Ok(Steps::Automatic),
        "adaptive" => Ok(Steps::Adaptive),
        "per-sample" => Ok(Steps::PerSample(PerSample::Automatic)),
        _ => match text.strip_prefix("per-sample=").map(str::parse) {
            Some(Ok(n)) => Ok(Steps::PerSample(PerSample::Exactly(n))),
            Some(Err(_)) => {
                Err("the number of steps per sample must be a whole number, 1 or more".to_owned())
            }
            None => Err(format!(
                "this must be `{AUTOMATIC}`, `adaptive`, `per-sample` or `per-sample=N`"
            )),
        },
    }
}

/// The point of a linearisation.
pub fn point(text: &str) -> Result<LinearizeAt, String> {
    match text.parse::<f64>() {
        _ if text == "steady" => Ok(LinearizeAt::Steady),
        _ if text == "mean" => Ok(LinearizeAt::Mean),
        Ok(t) if t.is_finite() => Ok(LinearizeAt::Time(t)),
        _ => Err("this must be a time in s, `steady` or `mean`".to_owned()),
    }
}

/// `head=speed`: curves, and the labels at their ends.
pub fn label(text: &str) -> Result<(String, String), String> {
    pair(text, '=', "this must be two names, as in `head=speed`")
}

/// `q_op,h_op`: the coordinates of points.
pub fn mark(text: &str) -> Result<(String, String), String> {
    pair(text, ',', "this must be two names, as in `q_op,h_op`")
}

fn pair(text: &str, between: char, what: &str) -> Result<(String, String), String> {
    let (first, second) = text.split_once(between).ok_or(what)?;
    let (first, second) = (first.trim(), second.trim());
    if first.is_empty() || second.is_empty() || second.contains(between) {
        return Err(what.to_owned());
    }
    Ok((first.to_owned(), second.to_owned()))
}

fn seconds(text: &str) -> Option<f64> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic() || " []".contains(c));
    let unit = text[digits.len()..].trim_matches([' ', '[', ']']);
    let second = parse_unit("s").ok()?;
    let unit = if unit.is_empty() { "s" } else { unit };
    let unit = parse_unit(unit).ok().filter(|unit| unit.dimension == second.dimension)?;
    Some(number(digits)? * unit.factor)
}

#[cfg(test)]
mod tests {
    use super::{count, count_or_none, label, mark, moment, time, tolerance};

    #[test]
    fn numbers_without_measure_are_refused() {
        for text in ["1e300", "1.1", "1e-300", "1e-16", "0", "-1", "NaN", "inf", ""] {
            assert!(tolerance(text).is_err(), "{text}");
        }
        assert_eq!(tolerance("1e-13"), Ok(1e-13));
        for text in ["18446744073709551615", "18446744073709551616", "1e12", "1000001", "-1"] {
            assert!(count(text).is_err() && count_or_none(text).is_err(), "{text}");
        }
        assert_eq!((count("0").is_err(), count_or_none("0")), (true, Ok(0)));
        assert_eq!(count("1000000"), Ok(1_000_000));
    }

    #[test]
    fn times_are_read_as_people_write_them() {
        let read = ["60s", "60", "1.5 min", "2h", "1e2s"].map(|text| time(text).ok());
        assert_eq!(read, [Some(60.0), Some(60.0), Some(90.0), Some(7200.0), Some(100.0)]);
        for text in ["", "s", "-3s", "0", "3 weeks", "inf", "NaN s", "2 m", "5 °C"] {
            assert!(time(text).is_err(), "{text}");
        }
        let read = ["-3s", "0", "24 [h]", "1 week"].map(|text| moment(text).ok());
        assert_eq!(read, [Some(-3.0), Some(0.0), Some(86_400.0), Some(604_800.0)]);
    }

    #[test]
    fn pairs_are_two_names() {
        assert_eq!(label("head = speed"), Ok(("head".to_owned(), "speed".to_owned())));
        assert_eq!(mark("q,h"), Ok(("q".to_owned(), "h".to_owned())));
        for wrong in ["", "q", "q,", ",h", "q,h,x"] {
            assert!(mark(wrong).is_err(), "{wrong}");
        }
        assert!(label("q,h").is_err());
    }
}
