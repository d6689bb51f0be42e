//! Wrong constants of the model and faults of the recordings, for programs and as text.

mod differing;

use std::fmt::Write;

use dgd_discover::{PlainCause, PlainCauses, PlainKind, RecordingsValue, StuckSince};

use super::result_json::number;
use crate::output::quantity::{UncertainValue, short, with_unit};
use crate::result::discover::{CauseEntry, GroupValue, PlainResult, StuckEntry};

/// For programs.
pub(super) fn entry(plain: &PlainCauses) -> PlainResult {
    let cause = |cause: &PlainCause| {
        let value = cause.value.as_ref();
        let shown = |x: Option<f64>| value.zip(x).and_then(|(of, x)| number(of.unit.from_si(x)));
        CauseEntry {
            kind: cause.kind.word().to_owned(),
            name: cause.name.clone(),
            with: cause.with.clone(),
            declared: shown(cause.declared),
            value: shown(value.map(|of| of.value)),
            std: value.and_then(|of| number(of.std? / of.unit.factor)),
            unit: cause.unit.clone(),
            meant_in: cause.meant_in.clone(),
            since: cause.since.iter().map(stuck).collect(),
            values: cause.values.iter().map(of_recordings).collect(),
        }
    };
    PlainResult { causes: plain.causes.iter().map(cause).collect(), effects: plain.effects.clone() }
}

fn stuck(own: &StuckSince) -> StuckEntry {
    let value = &own.value;
    StuckEntry {
        recording: own.recording.clone(),
        time: number(own.time),
        value: number(value.unit.from_si(value.value)),
    }
}

fn of_recordings(own: &RecordingsValue) -> GroupValue {
    let value = &own.value;
    GroupValue {
        recordings: own.recordings.clone(),
        held_out: own.held_out.clone(),
        value: number(value.unit.from_si(value.value)),
        std: value.std.and_then(|std| number(std / value.unit.factor)),
    }
}

/// The cause, and the causes that the recordings cannot tell from it; names are between backticks.
pub(super) fn sentence(plain: &PlainCauses) -> String {
    let Some((first, twins)) = plain.causes.split_first() else { return String::new() };
    let mut words = first_words(first);
    let twins = twins.iter().map(twin);
    let effects = plain.effects.iter().map(|effect| format!("there is `{effect}`"));
    let others: Vec<String> = twins.chain(effects).collect();
    if !others.is_empty() {
        let others = others.join(", or ");
        // Writing to a string cannot fail.
        let _ =
            write!(words, " Or {others}: one cannot be told from the other from these recordings.");
    }
    words
}

/// The next step.
pub(super) fn next(plain: &PlainCauses) -> String {
    let is_number = |one: &&PlainCause| one.value.is_some() && one.kind != PlainKind::Clock;
    let numbers = plain.causes.iter().filter(is_number).map(|one| format!("`{}`", one.name));
    let numbers: Vec<String> = numbers.collect();
    let look_up = match numbers.as_slice() {
        [] => String::new(),
        [one] => format!("Look up where the number of {one} comes from, or measure it."),
        all => format!(
            "Look up where the numbers of {} come from, or measure them.",
            all.join(" and ")
        ),
    };
    match plain.causes.first() {
        Some(first) if first.kind == PlainKind::Start => {
            format!("Leave out `fixed` in the line of `{}`, or start the recordings there.", first.name)
        }
        Some(first) if !first.values.is_empty() => differing::next(first),
        Some(first) if first.kind == PlainKind::Clock && first.value.is_some() => {
            let look_up = if look_up.is_empty() { look_up } else { format!(" {look_up}") };
            format!(
                "Compare the clock of the recorder with another one.{look_up} The corrected model is for true times."
            )
        }
        Some(first) if first.value.is_some() => {
            format!("{look_up} The corrected model has the value of `{}` that fits.", first.name)
        }
        Some(first) if first.kind == PlainKind::Stuck => {
            "Look up how the recordings were made, and leave out these rows. The corrected model is fitted to the others."
                .to_owned()
        }
        Some(first) if first.kind == PlainKind::Interpolation => {
            "Look up how the recorder fills the time between rows. The corrected model has the input as it fits."
                .to_owned()
        }
        _ => format!(
            "Look up how the recordings were made, and mend their header. The corrected model is for recordings without \
             the fault.{}",
            if look_up.is_empty() { String::new() } else { format!(" {look_up}") }
        ),
    }
}

fn first_words(cause: &PlainCause) -> String {
    let name = &cause.name;
    let unit = cause.unit.as_deref().unwrap_or_default();
    let meant_in = cause.meant_in.as_deref().unwrap_or_default();
    match cause.kind {
        PlainKind::Constant | PlainKind::Parameter => {
            let mut words = format!(
                "The {} `{name}` is off: the recordings fit {}, and the model has {}.",
                cause.kind.word(),
                fitted(cause),
                declared(cause)
            );
            if !meant_in.is_empty() {
                let _ = write!(
                    words,
                    " Its number is right in `{meant_in}`: was it meant in that unit, and not in `{unit}`?"
                );
            }
            words
        }
        PlainKind::Unit => format!(
            "The column `{name}` reads as if in `{meant_in}`, where the recordings or the model have `{unit}`."
        ),
        PlainKind::Exchanged => format!(
            "The columns `{name}` and `{}` read as if they were exchanged.",
            cause.with.as_deref().unwrap_or_default()
        ),
        PlainKind::Interpolation => {
            format!("The input `{name}` fits as `{meant_in}`: its line should end with that.")
        }
        PlainKind::Clock if cause.value.is_some() => {
            format!("The clock of the recordings runs {}.", differing::rate(cause.value.as_ref()))
        }
        PlainKind::Clock => {
            format!("The times of the recordings read as if in `{meant_in}`, not in `{unit}`.")
        }
        PlainKind::Start => differing::starts(cause),
        PlainKind::Stuck => format!(
            "The column `{name}` {}: it reads as if stuck. What was read after that is left out.",
            stays(cause)
        ),
        PlainKind::DiffersNumber | PlainKind::DiffersOffset | PlainKind::DiffersClock => {
            differing::first_words(cause)
        }
    }
}

/// The cause as one of several.
fn twin(cause: &PlainCause) -> String {
    let name = &cause.name;
    let meant_in = cause.meant_in.as_deref().unwrap_or_default();
    match cause.kind {
        PlainKind::Constant | PlainKind::Parameter => format!(
            "the {} `{name}` is off ({} in place of {})",
            cause.kind.word(),
            fitted(cause),
            declared(cause)
        ),
        PlainKind::Unit => format!("the column `{name}` is in `{meant_in}`"),
        PlainKind::Exchanged => format!(
            "the columns `{name}` and `{}` are exchanged",
            cause.with.as_deref().unwrap_or_default()
        ),
        PlainKind::Interpolation => format!("the input `{name}` is `{meant_in}`"),
        PlainKind::Clock if cause.value.is_some() => {
            format!("the clock runs {}", differing::rate(cause.value.as_ref()))
        }
        PlainKind::Clock => format!("the times are in `{meant_in}`"),
        PlainKind::Start => format!("`{name}` starts otherwise"),
        PlainKind::Stuck => format!("the column `{name}` {}", stays(cause)),
        PlainKind::DiffersNumber | PlainKind::DiffersOffset | PlainKind::DiffersClock => {
            differing::words(cause)
        }
    }
}

/// `stays at 0.31 V after 25 s in `b``.
fn stays(cause: &PlainCause) -> String {
    let sentence = |own: &StuckSince| {
        let unit = &own.value.unit;
        let value = with_unit(short(unit.from_si(own.value.value), 4), &unit.symbol);
        format!("stays at {value} after {} s in `{}`", short(own.time, 6), own.recording)
    };
    cause.since.iter().map(sentence).collect::<Vec<_>>().join(", and ")
}

fn fitted(cause: &PlainCause) -> String {
    let Some(value) = &cause.value else { return String::new() };
    with_unit(UncertainValue::from_parameter(value), &value.unit.symbol)
}

fn declared(cause: &PlainCause) -> String {
    let Some((value, declared)) = cause.value.as_ref().zip(cause.declared) else {
        return String::new();
    };
    with_unit(short(value.unit.from_si(declared), 6), &value.unit.symbol)
}
