//! Differences between recordings, in words.

use dgd_discover::{ParameterValue, PlainCause, PlainKind, RecordingsValue};

use crate::output::quantity::{UncertainValue, with_unit};

/// One or two sentences.
pub(super) fn first_words(cause: &PlainCause) -> String {
    let like: Vec<String> = cause
        .values
        .iter()
        .filter(|own| !own.held_out.is_empty())
        .map(|own| {
            let verb = if own.held_out.len() == 1 { "is" } else { "are" };
            format!("{} {verb} like {}", named(&own.held_out), named(&own.recordings))
        })
        .collect();
    let held_out = if like.is_empty() {
        String::new()
    } else {
        format!(" Of the validation data, {}.", like.join(", and "))
    };
    format!("The recordings differ: {}.{held_out}", words(cause))
}

/// The difference.
pub(super) fn words(cause: &PlainCause) -> String {
    let name = &cause.name;
    let Some((first, others)) = cause.values.split_first() else { return String::new() };
    match cause.kind {
        PlainKind::DiffersOffset => {
            let comparison = |own: &RecordingsValue| {
                let (size, more) = (size(&own.value), own.value.value > 0.0);
                let than = if more { "more" } else { "less" };
                let unit = &own.value.unit.symbol;
                format!("{} {than} in {}", with_unit(size, unit), named(&own.recordings))
            };
            let comparisons: Vec<String> = others.iter().map(comparison).collect();
            format!("`{name}` reads {} than in {}", listed(&comparisons), named(&first.recordings))
        }
        PlainKind::DiffersClock => {
            let clock_rate = |own: &RecordingsValue| {
                format!("that of {} runs {}", named(&own.recordings), rate(Some(&own.value)))
            };
            let rates: Vec<String> = others.iter().map(clock_rate).collect();
            format!("beside the clock of {}, {}", named(&first.recordings), listed(&rates))
        }
        _ => {
            let value_in = |own: &RecordingsValue| {
                let value =
                    with_unit(UncertainValue::from_parameter(&own.value), &own.value.unit.symbol);
                format!("{value} in {}", named(&own.recordings))
            };
            let values: Vec<String> = cause.values.iter().map(value_in).collect();
            format!("`{name}` is {}", listed(&values))
        }
    }
}

/// Initial values of the recordings.
pub(super) fn starts(cause: &PlainCause) -> String {
    let value_in = |own: &RecordingsValue| {
        let value = with_unit(UncertainValue::from_parameter(&own.value), &own.value.unit.symbol);
        format!("{value} in {}", named(&own.recordings))
    };
    let values: Vec<String> = cause.values.iter().map(value_in).collect();
    let name = &cause.name;
    format!(
        "The recordings do not begin where the model has the start of `{name}`: it is {}.",
        listed(&values)
    )
}

/// The next step.
pub(super) fn next(cause: &PlainCause) -> String {
    let Some(first) = cause.values.first() else { return String::new() };
    let what = match cause.kind {
        PlainKind::DiffersOffset => format!("the zero of `{}`", cause.name),
        PlainKind::DiffersClock => "the clock of the recorder".to_owned(),
        _ => format!("`{}`", cause.name),
    };
    format!(
        "Look up what happened to {what} between the recordings, and fit what differs apart. The corrected model is for \
         {}.",
        named(&first.recordings)
    )
}

/// The rate of a clock: `fast by 0.100 ± 0.002 %`.
pub(super) fn rate(value: Option<&ParameterValue>) -> String {
    let Some(value) = value else { return String::new() };
    let std = value.std.map(|std| 100.0 * std);
    let rate = ParameterValue { value: 100.0 * (value.value - 1.0), std, ..value.clone() };
    let way = if rate.value > 0.0 { "fast" } else { "slow" };
    format!("{way} by {} %", size(&rate))
}

/// A magnitude with its standard deviation, if any.
fn size(value: &ParameterValue) -> String {
    let positive = ParameterValue { value: value.value.abs(), ..value.clone() };
    UncertainValue::from_parameter(&positive).to_string()
}

fn named(names: &[String]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    listed(&quoted)
}

fn listed(all: &[String]) -> String {
    match all {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
