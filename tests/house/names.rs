//! A name leads to one thing: types have names of their own, and no function is named by a preposition alone.

use std::collections::{BTreeMap, BTreeSet};

use crate::source::{CRATES, product};

/// Types of the compiler's model that keep their names in the signature that they become.
const IN_SIGNATURE: [&str; 10] = [
    "Array",
    "Automaton",
    "Family",
    "Input",
    "Output",
    "OutputArray",
    "Parameter",
    "Transition",
    "Unit",
    "Unknown",
];
/// Other names that two crates share. Types of the root are the façade of those of another crate.
const PAIRS: [(&str, [&str; 2]); 4] = [
    ("Fit", ["dgd", "dgd-identify"]),
    ("Problem", ["dgd", "dgd-runtime"]),
    ("Recording", ["dgd", "dgd-identify"]),
    ("Solution", ["dgd", "dgd-runtime"]),
];
/// Largest share of types whose name another type has, %.
const MOST_SHARED: usize = 5;
/// Names that say nothing about a type.
const EMPTY: [&str; 16] = [
    "Along", "Asked", "At", "Done", "Found", "Given", "Held", "Kept", "Known", "Looked", "Of",
    "Own", "Part", "Seen", "Sought", "Wanted",
];
/// Words that are not names of functions; `from` is, of the conversion.
const PREPOSITIONS: [&str; 3] = ["at", "by", "of"];

/// The word behind one of these keywords at the start of a line, after its visibility.
fn declared<'a>(line: &'a str, keywords: &[&str]) -> Option<&'a str> {
    let line = match line.strip_prefix("pub") {
        Some(rest) if rest.starts_with('(') => rest.split_once(") ")?.1,
        Some(rest) => rest.trim_start(),
        None => line,
    };
    let line = ["const ", "unsafe "]
        .iter()
        .fold(line, |line, word| line.strip_prefix(word).unwrap_or(line));
    let rest = keywords.iter().find_map(|keyword| line.strip_prefix(keyword)?.strip_prefix(' '))?;
    rest.split(|c: char| !c.is_alphanumeric() && c != '_').next()
}

/// The crates and files that declare each type. Types within functions are known there only, and are left out, as are
/// those that macros declare.
fn types() -> BTreeMap<String, BTreeSet<(&'static str, String)>> {
    let mut types: BTreeMap<String, BTreeSet<_>> = BTreeMap::new();
    for name in CRATES {
        for (path, text) in product(name) {
            let keywords = ["struct", "enum", "trait", "type", "union"];
            for declared in text.lines().filter_map(|line| declared(line, &keywords)) {
                types.entry(declared.to_owned()).or_default().insert((name, path.clone()));
            }
        }
    }
    types
}

#[test]
fn types_share_no_names_but_those_of_listed_pairs() {
    let types = types();
    let pairs: BTreeMap<&str, [&str; 2]> = IN_SIGNATURE
        .into_iter()
        .map(|name| (name, ["dgd-compiler", "dgd-signature"]))
        .chain(PAIRS)
        .collect();
    let is_listed = |name: &str, places: &BTreeSet<(&str, String)>| {
        let mut crates: Vec<&str> = places.iter().map(|(of, _)| *of).collect();
        crates.sort_unstable();
        pairs.get(name).is_some_and(|pair| crates == pair)
    };
    let shared: Vec<_> = types.iter().filter(|(_, places)| places.len() > 1).collect();
    let unlisted: Vec<_> =
        shared.iter().filter(|(name, places)| !is_listed(name, places)).collect();
    assert!(unlisted.is_empty(), "names of several types: {unlisted:#?}");
    let unused: Vec<_> =
        pairs.keys().filter(|name| types.get(**name).is_none_or(|x| x.len() < 2)).collect();
    assert!(unused.is_empty(), "pairs that are listed and share no name: {unused:?}");
    let count = |types: &[(&String, &BTreeSet<_>)]| {
        types.iter().map(|(_, places)| places.len()).sum::<usize>()
    };
    let all = count(&types.iter().collect::<Vec<_>>());
    assert!(100 * count(&shared) <= MOST_SHARED * all, "{} of {all} types", count(&shared));
}

#[test]
fn names_of_types_say_something() {
    let types = types();
    let empty: Vec<_> = types.iter().filter(|(name, _)| EMPTY.contains(&name.as_str())).collect();
    assert!(empty.is_empty(), "{empty:#?}");
}

#[test]
fn no_function_is_named_by_a_preposition() {
    let mut found = Vec::new();
    for name in CRATES {
        for (path, text) in product(name) {
            let names = text.lines().filter_map(|line| declared(line.trim_start(), &["fn"]));
            let names = names.filter(|name| PREPOSITIONS.contains(name));
            found.extend(names.map(|name| format!("{path}: {name}")));
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}
