//! Wrong numbers of the model's text and faults of the recordings, in words and for programs.

use std::fmt::Write;

use dgd_discover::{PlainCause, PlainCauses, PlainKind};
use serde_json::{Value, json};

use super::result_json::tidy;
use crate::output::quantity::{Quantity, short, with_unit};

/// For programs.
pub(super) fn value(plain: &PlainCauses) -> Value {
    let cause = |cause: &PlainCause| {
        let value = cause.value.as_ref();
        let shown = |x: Option<f64>| value.zip(x).map(|(of, x)| tidy(of.unit.from_si(x)));
        let std = value.and_then(|of| of.std.map(|std| tidy(std / of.unit.factor)));
        json!({
            "kind": cause.kind.word(),
            "name": cause.name,
            "with": cause.with,
            "declared": shown(cause.declared),
            "value": shown(value.map(|of| of.value)),
            "std": std,
            "unit": cause.unit,
            "meant_in": cause.meant_in,
        })
    };
    json!({
        "causes": plain.causes.iter().map(cause).collect::<Vec<_>>(),
        "effects": plain.effects,
    })
}

/// The cause, and what the recordings cannot tell from it; names are between backticks.
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

/// What to do next.
pub(super) fn next(plain: &PlainCauses) -> String {
    let is_number = |one: &&PlainCause| one.value.is_some();
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
        Some(first) if first.value.is_some() => {
            format!("{look_up} The corrected model has the value of `{}` that fits.", first.name)
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
        PlainKind::Clock => {
            format!("The times of the recordings read as if in `{meant_in}`, not in `{unit}`.")
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
        PlainKind::Clock => format!("the times are in `{meant_in}`"),
    }
}

fn fitted(cause: &PlainCause) -> String {
    let Some(value) = &cause.value else { return String::new() };
    with_unit(Quantity::of(value), &value.unit.symbol)
}

fn declared(cause: &PlainCause) -> String {
    let Some((value, declared)) = cause.value.as_ref().zip(cause.declared) else {
        return String::new();
    };
    with_unit(short(value.unit.from_si(declared), 6), &value.unit.symbol)
}
