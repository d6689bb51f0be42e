//! Findings in the user's words.

use dgd_compiler::units::{Unit, parse_unit};
use dgd_data::DataTable;
use dgd_runtime::signature::number::short;
use dgd_screen::redundant::Kinship;
use dgd_screen::{ChannelFault, Estimate, Finding, Severity, TimeStretch};

use crate::output::quantity::{UncertainValue, with_unit};
use crate::output::table::significant;

/// A finding in words.
#[derive(Debug, Clone)]
pub struct Notice {
    /// Its kind, for programs.
    pub kind: &'static str,
    /// Its importance.
    pub weight: Severity,
    /// The affected columns.
    pub channels: Vec<String>,
    /// Affected intervals; empty if the whole recording is affected.
    pub stretches: Vec<TimeStretch>,
    /// Its size, if that is a number.
    pub amount: Option<Amount>,
    /// Upper bound of the probability under the null hypothesis.
    pub p_value: Option<f64>,
    /// The finding, as a sentence.
    pub text: String,
    /// Advice, as a sentence; may be empty.
    pub advice: String,
}

/// A number with its unit.
#[derive(Debug, Clone)]
pub struct Amount {
    /// The number, in its unit.
    pub value: f64,
    /// Half width of its 95 % interval.
    pub half_width: Option<f64>,
    /// Its unit.
    pub unit: String,
}

impl Amount {
    pub(super) fn from_estimate(estimate: &Estimate, unit: &str) -> Amount {
        let half_width = Some(estimate.half_width());
        Amount { value: estimate.value, half_width, unit: unit.to_owned() }
    }

    fn exact(value: f64, unit: &str) -> Amount {
        Amount { value, half_width: None, unit: unit.to_owned() }
    }

    /// The magnitude, for sentences that give the direction.
    pub(super) fn size(&self) -> String {
        self.shown(self.value.abs())
    }

    /// The signed value as text.
    pub(super) fn signed(&self) -> String {
        self.shown(self.value)
    }

    fn shown(&self, value: f64) -> String {
        let number = match self.half_width {
            Some(half) if half > 0.0 => UncertainValue::new(value, half).to_string(),
            _ => reading(value),
        };
        format!("{number} {}", self.unit).trim_end().to_owned()
    }
}

/// A reading with as many digits as needed, at most six.
pub(crate) fn reading(value: f64) -> String {
    let text = significant(value, 6);
    match text.split_once('e') {
        None if text.contains('.') => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        _ => text,
    }
}

/// The unit of a column, as text.
pub(crate) fn unit_of(unit: Option<&Unit>) -> String {
    unit.map_or_else(String::new, |unit| match unit.symbol.as_str() {
        "1" => String::new(),
        symbol => symbol.to_owned(),
    })
}

/// The unit of differences of a column.
pub(crate) fn difference_unit(unit: Option<&Unit>) -> String {
    let plain = unit.map(|unit| match parse_unit(&unit.symbol) {
        Ok(unit) => unit.of_differences(),
        Err(_) => unit.clone(),
    });
    unit_of(plain.as_ref())
}

/// A finding of `dgd-screen` about the columns of a table.
pub(super) fn notice(table: &DataTable, finding: &Finding) -> Notice {
    let columns: Vec<_> = finding.channels.iter().map(|i| &table.columns[*i]).collect();
    let name = |i: usize| columns.get(i).map_or("", |column| column.name.as_str());
    let unit = columns.first().and_then(|column| column.unit.as_ref());
    let (unit, apart) = (unit_of(unit), difference_unit(unit));
    let rows = table.len();
    let NoticeText { kind, mut text, advice, amount } =
        said(&finding.fault, [name(0), name(1)], &unit, &apart, rows);
    if kind == "frozen" && finding.stretches.len() > 1 {
        let times = finding.stretches.len();
        text = format!("`{}` reads one value for long, {times} times", name(0));
    }
    Notice {
        kind,
        weight: finding.weight,
        channels: columns.iter().map(|column| column.name.clone()).collect(),
        stretches: finding.stretches.clone(),
        amount,
        p_value: finding.p_value,
        text,
        advice,
    }
}

struct NoticeText {
    kind: &'static str,
    text: String,
    advice: String,
    amount: Option<Amount>,
}

fn said(
    fault: &ChannelFault,
    [one, other]: [&str; 2],
    unit: &str,
    apart: &str,
    rows: usize,
) -> NoticeText {
    let say = |kind, text: String, advice: &str, amount: Option<Amount>| NoticeText {
        kind,
        text,
        advice: advice.to_owned(),
        amount,
    };
    let value_text = |value: f64| with_unit(reading(value), unit);
    let share = |count: usize| format!("{} %", short(100.0 * count as f64 / rows as f64, 2));
    match fault {
        ChannelFault::Empty => say(
            "empty",
            format!("`{one}` has no value in any of {rows} rows"),
            "leave the column out, or look for it at its source",
            None,
        ),
        ChannelFault::Constant(value) => say(
            "constant",
            format!("`{one}` is {} throughout", value_text(*value)),
            "a set value may be; a sensor would be dead, or at the end of its range",
            Some(Amount::exact(*value, unit)),
        ),
        ChannelFault::Missing(count) => say(
            "missing",
            format!("`{one}` has no value in {count} rows, {} of all", share(*count)),
            "measured outputs may have gaps; those of an input have to be filled",
            Some(Amount::exact(*count as f64, "rows")),
        ),
        ChannelFault::Gaps => say(
            "gap",
            "nothing was recorded for more than three samples".to_owned(),
            "an input is taken to go on as declared: cut the recording there if it did not",
            None,
        ),
        ChannelFault::Uneven(uneven) => say(
            "uneven",
            format!("{} % of the samples are not at the usual distance", short(100.0 * uneven, 2)),
            "nothing: fits take samples at any times",
            Some(Amount::exact(*uneven, "")),
        ),
        ChannelFault::Frozen { value, samples, is_shown } => say(
            "frozen",
            format!("`{one}` reads {} in {samples} rows on end", value_text(*value)),
            if *is_shown {
                "it is frozen: empty these cells, so that a fit leaves them out"
            } else {
                "a set value may be held; a sensor would be frozen: then empty these cells"
            },
            Some(Amount::exact(*value, unit)),
        ),
        ChannelFault::Pulses { count, largest } => {
            let size = format!("{} {apart}", short(*largest, 3)).trim_end().to_owned();
            let number = if *count == 1 {
                "a pulse, of".to_owned()
            } else {
                format!("{count} pulses, the largest of")
            };
            say(
                "pulses",
                format!("`{one}` has {number} {size}, when other columns have them, too"),
                "an event, which samples do not resolve: nothing, or sample faster",
                Some(Amount::exact(*largest, apart)),
            )
        }
        ChannelFault::Saturated { limit, is_upper, samples } => {
            let (side, reaches) = if *is_upper { ("upper", "above") } else { ("lower", "below") };
            say(
                "saturated",
                format!(
                    "`{one}` piles up at {}, its {side} limit, in {samples} rows",
                    value_text(*limit)
                ),
                &format!("what was {reaches} is not known: empty these cells"),
                Some(Amount::exact(*limit, unit)),
            )
        }
        ChannelFault::Spikes { count, largest } => {
            let spikes = if *count == 1 { "a spike" } else { "spikes" };
            let largest_is = if *count == 1 { "of" } else { "the largest of" };
            let number = if *count == 1 { String::new() } else { format!("{count} ") };
            let size = format!("{} {apart}", short(*largest, 3)).trim_end().to_owned();
            say(
                "spikes",
                format!("`{one}` has {number}{spikes}, {largest_is} {size}"),
                "empty these cells: least squares would follow them",
                Some(Amount::exact(*largest, apart)),
            )
        }
        ChannelFault::Coarse { step } => say(
            "quantised",
            format!(
                "`{one}` is rounded to steps of {} {apart}, which hides its noise",
                short(*step, 3)
            ),
            "log more digits if the sensor has them",
            Some(Amount::exact(*step, apart)),
        ),
        ChannelFault::Unlike => say(
            "unlike",
            format!("`{one}` and `{other}` do not move alike, and are said to measure the same"),
            "one of them is wrong, or they do not measure the same",
            None,
        ),
        ChannelFault::Opposed(correlation) => say(
            "opposed",
            format!(
                "`{one}` and `{other}` move in opposite directions, correlation {correlation:.2}, and are \
                 said to measure the same"
            ),
            "is the sign of one of them wrong?",
            Some(Amount::exact(*correlation, "")),
        ),
        ChannelFault::Untold => say(
            "untold",
            format!(
                "whether `{one}` and `{other}` measure the same is not to be seen: they rest, too \
                 far apart, or have too few rows in common"
            ),
            "screen a recording in which they move",
            None,
        ),
        ChannelFault::Offset { offset, kinship } => {
            let amount = Amount::from_estimate(offset, apart);
            let than = if offset.value > 0.0 { "more" } else { "less" };
            let (why, advice) = match kinship {
                Kinship::Moving => ("", "give a MODEL to see which is off; else average them"),
                Kinship::Named => (
                    ", at rest; by their names they measure the same",
                    "give a MODEL to see which is off; else average them",
                ),
            };
            let text = format!("`{other}` reads {} {than} than `{one}`{why}", amount.size());
            say("offset", text, advice, Some(amount))
        }
        ChannelFault::Odd(offset) => {
            let amount = Amount::from_estimate(offset, apart);
            let than = if offset.value > 0.0 { "more" } else { "less" };
            say(
                "odd_one",
                format!("`{one}` reads {} {than} than the others, which agree", amount.size()),
                &format!("drop `{one}`, or take its offset off"),
                Some(amount),
            )
        }
        ChannelFault::Gain(gain) => {
            let factor = Amount {
                value: 1.0 + gain.value,
                half_width: Some(gain.half_width()),
                unit: String::new(),
            };
            say(
                "gain",
                format!("`{other}` changes by {} times what `{one}` does", factor.size()),
                "one of them needs calibration",
                Some(factor),
            )
        }
        ChannelFault::Drift(rate) => {
            let hourly = Estimate {
                value: 3600.0 * rate.value,
                std_error: 3600.0 * rate.std_error,
                ..*rate
            };
            let amount = Amount::from_estimate(&hourly, &format!("{apart}/h"));
            say(
                "drift",
                format!("`{other}` drifts by {} from `{one}`", amount.signed()),
                "one of them is not to be trusted over this time",
                Some(amount),
            )
        }
        ChannelFault::Noisier(ratio) => {
            let (more, less, ratio) =
                if *ratio > 1.0 { (other, one, *ratio) } else { (one, other, 1.0 / ratio) };
            say(
                "noisier",
                format!("`{more}` has {} times the noise of `{less}`", short(ratio, 2)),
                &format!("prefer `{less}`"),
                Some(Amount::exact(ratio, "")),
            )
        }
        ChannelFault::Lag(late) => {
            let (late_one, early, value) =
                if late.value > 0.0 { (other, one, late.value) } else { (one, other, -late.value) };
            let amount = Amount::from_estimate(&Estimate { value, ..*late }, "s");
            say(
                "late",
                format!("`{late_one}` is {} late behind `{early}`", amount.size()),
                "the clocks of two loggers differ, or one reading is filtered",
                Some(amount),
            )
        }
    }
}

impl Notice {
    /// Its significance, in words.
    pub(crate) fn certainty(&self) -> String {
        match self.p_value {
            None => "counted".to_owned(),
            Some(p) if p < 1e-12 => "chance below 10⁻¹²".to_owned(),
            Some(p) => format!("chance {}", short(p, 1)),
        }
    }

    /// Its intervals in words, of which at most this many are listed.
    pub(crate) fn when(&self, most: usize) -> String {
        if self.stretches.is_empty() {
            return "throughout".to_owned();
        }
        let one = |stretch: &TimeStretch| {
            if stretch.from == stretch.until {
                format!("{} s", reading(stretch.from))
            } else {
                format!("{}–{} s", reading(stretch.from), reading(stretch.until))
            }
        };
        let mut text: Vec<String> = self.stretches.iter().take(most).map(one).collect();
        let more = self.stretches.len().saturating_sub(most);
        if more > 0 {
            text.push(format!("and {more} more"));
        }
        text.join(", ")
    }
}
