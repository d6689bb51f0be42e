//! The verdict, in a sentence.

use dgd_discover::{Discovery, FoundEffect, Verdict};

use super::{law, plain};

/// One plain sentence, or two if something is left over.
pub(super) fn sentence(discovery: &Discovery) -> String {
    let names: Vec<String> = discovery.effects.iter().map(name).collect();
    let missing = match names.as_slice() {
        [] => None,
        [only] => Some(format!("Missing from the model: {only}.")),
        [one, other] if discovery.effects.iter().all(|effect| effect.alternatives.is_empty()) => {
            Some(format!("Missing from the model: {one} and {other}."))
        }
        [first @ .., last] => {
            Some(format!("Missing from the model: {}, and {last}.", first.join(", ")))
        }
    };
    if let Some(causes) = &discovery.plain {
        return plain::sentence(causes);
    }
    if let Some(law) = &discovery.law {
        return format!("Missing from the model: {}.", law::formula(&law.terms));
    }
    if !discovery.rivals.is_empty() {
        let rivals: Vec<String> = discovery.rivals.iter().map(law::rival_name).collect();
        return format!("Missing from the model: {}.", rivals.join(", or "));
    }
    let places = places(discovery);
    match (missing, places.is_empty()) {
        (None, true) if discovery.verdict == Verdict::Unexplained => {
            "Something is missing that no known effect explains, and the recordings do not show where.".to_owned()
        }
        (None, true) => "The model explains the data: no effect is missing.".to_owned(),
        (None, false) => format!("Something is missing in {places} that no known effect explains."),
        (Some(missing), true) => missing,
        (Some(missing), false) => format!("{missing} Something without a name is left in {places}."),
    }
}

/// The equations with an unexplained missing term: those that lack a term together, or the best one with those that are
/// about as likely.
fn places(discovery: &Discovery) -> String {
    let unexplained = &discovery.unexplained;
    let is_joint = unexplained.first().is_some_and(|first| first.is_joint);
    let chosen = unexplained
        .iter()
        .enumerate()
        .filter(|(k, one)| *k == 0 || if is_joint { one.is_joint } else { one.is_tied });
    let targets: Vec<&str> = chosen.map(|(_, one)| one.target.as_str()).collect();
    targets.join(if is_joint { " and " } else { " or " })
}

/// The next step, in a sentence.
pub(super) fn next(discovery: &Discovery) -> String {
    if let Some(causes) = &discovery.plain {
        return plain::next(causes);
    }
    let untold = discovery.effects.iter().find_map(|effect| effect.told_apart_by.as_ref());
    match (discovery.verdict, untold) {
        (Verdict::Sufficient, _) => {
            "Keep the model. Whether it holds where these recordings do not go, only another recording shows.".to_owned()
        }
        (Verdict::Effects, Some(test)) => format!("To tell the effects apart, take {test}."),
        (Verdict::Effects, None) | (Verdict::Law | Verdict::Plain, _) => {
            "Check the corrected model on a recording that it has not seen, then use it in the place of the old one."
                .to_owned()
        }
        (Verdict::Unexplained, _) if !discovery.rivals.is_empty() => {
            let test = discovery.rivals.iter().find_map(|law| law.told_apart_by.as_ref());
            let test = test.map_or("a test with other inputs", String::as_str);
            format!("Each of these explains the recordings. To tell them apart, take {test}.")
        }
        (Verdict::Unexplained, _) => match discovery.unexplained.first() {
            None => "Record more, with inputs that move, or measure another quantity.".to_owned(),
            Some(first) if first.guess.is_some() => format!(
                "Look at `{}` first: `dgd adopt` takes the formula below into the library, and another recording \
                 confirms it or does not.",
                first.target
            ),
            Some(first) => format!(
                "Look at `{}` first: the trace below shows when it is off, and by how much.",
                first.target
            ),
        },
    }
}

/// An effect with its indistinguishable alternatives.
pub(super) fn name(effect: &FoundEffect) -> String {
    let others = effect.alternatives.iter().map(|other| other.name.as_str());
    let names: Vec<&str> = std::iter::once(effect.name.as_str()).chain(others).collect();
    names.join(" or ")
}

/// The way an effect enters the model.
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
