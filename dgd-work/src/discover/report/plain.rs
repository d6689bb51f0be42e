//! What is wrong in the model's text or in the recordings, in words and for programs.

use dgd_discover::{PlainCause, PlainCauses, PlainKind};
use serde_json::{Value, json};

use super::result_json::tidy;
use crate::output::quantity::{Quantity, short, with_unit};

/// For programs.
pub(super) fn value(plain: &PlainCauses) -> Value {
    let cause = |cause: &PlainCause| {
        let unit = &cause.value.unit;
        json!({
            "kind": cause.kind.word(),
            "name": cause.name,
            "declared": tidy(unit.from_si(cause.declared)),
            "value": tidy(unit.from_si(cause.value.value)),
            "std": cause.value.std.map(|std| tidy(std / unit.factor)),
            "unit": unit.symbol,
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
    let unit = &first.value.unit;
    let mut words = format!(
        "The {} `{}` is off: the recordings fit {}, and the model has {}.",
        kind(first),
        first.name,
        with_unit(Quantity::of(&first.value), &unit.symbol),
        declared(first)
    );
    if let Some(meant_in) = &first.meant_in {
        words += &format!(
            " Its number is right in `{meant_in}`: was it meant in that unit, and not in `{}`?",
            unit.symbol
        );
    }
    let twins = twins.iter().map(|twin| {
        let value = with_unit(Quantity::of(&twin.value), &twin.value.unit.symbol);
        format!(
            "the {} `{}` is off ({value} in place of {})",
            kind(twin),
            twin.name,
            declared(twin)
        )
    });
    let effects = plain.effects.iter().map(|effect| format!("there is `{effect}`"));
    let others: Vec<String> = twins.chain(effects).collect();
    if !others.is_empty() {
        words += &format!(
            " Or {}: one cannot be told from the other from these recordings.",
            others.join(", or ")
        );
    }
    words
}

/// What to do next.
pub(super) fn next(plain: &PlainCauses) -> String {
    let names: Vec<String> = plain.causes.iter().map(|one| format!("`{}`", one.name)).collect();
    let first = names.first().map_or("", String::as_str);
    format!(
        "Look up {} where {} from, or measure {}. The corrected model has the value of {first} that fits.",
        names.join(" and "),
        if names.len() == 1 { "its number comes" } else { "their numbers come" },
        if names.len() == 1 { "it" } else { "them" },
    )
}

fn kind(cause: &PlainCause) -> &'static str {
    match cause.kind {
        PlainKind::Constant => "constant",
        PlainKind::Parameter => "parameter",
    }
}

fn declared(cause: &PlainCause) -> String {
    let unit = &cause.value.unit;
    with_unit(short(unit.from_si(cause.declared), 6), &unit.symbol)
}
