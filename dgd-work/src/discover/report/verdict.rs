//! What was found, in a sentence.

use dgd_discover::{Discovery, FoundEffect, Unexplained};

/// One plain sentence, or two where something is left over.
pub(super) fn sentence(discovery: &Discovery) -> String {
    let names: Vec<String> = discovery.effects.iter().map(name).collect();
    let found = match names.as_slice() {
        [] => None,
        [only] => Some(format!("Missing from the model: {only}.")),
        [one, other] if discovery.effects.iter().all(|effect| effect.alternatives.is_empty()) => {
            Some(format!("Missing from the model: {one} and {other}."))
        }
        [first @ .., last] => {
            Some(format!("Missing from the model: {}, and {last}.", first.join(", ")))
        }
    };
    let targets: Vec<&str> = discovery.unexplained.iter().map(target).collect();
    match (found, targets.is_empty()) {
        (None, true) => "The model explains the data: no effect is missing.".to_owned(),
        (None, false) => format!(
            "Something is missing in {} that no known effect explains.",
            targets.join(" and ")
        ),
        (Some(found), true) => found,
        (Some(found), false) => {
            format!("{found} Something without a name is left in {}.", targets.join(" and "))
        }
    }
}

/// An effect with what the data cannot tell it from.
pub(super) fn name(effect: &FoundEffect) -> String {
    let others = effect.alternatives.iter().map(|other| other.name.as_str());
    let all: Vec<&str> = std::iter::once(effect.name.as_str()).chain(others).collect();
    all.join(" or ")
}

/// How an effect enters the model.
pub(super) fn place(effect: &FoundEffect) -> String {
    let what = match effect.kind {
        "sensor" => "a fault of the sensor",
        "input" => "a fault of the input",
        _ => "missing physics in",
    };
    match &effect.form {
        Some(form) => format!("{what} {}, as {form}", effect.target),
        None => format!("{what} {}", effect.target),
    }
}

fn target(unexplained: &Unexplained) -> &str {
    &unexplained.target
}
