//! Options of the requests, in Python and in the manual.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use clap::{Arg, Command, CommandFactory};

use super::Cli;

/// Commands that are methods of a model in Python, with their options that Python has in another form, or not at all.
const METHODS: [(&str, &[&str]); 5] = [
    // Python gives variants and effects when it loads a model, and draws its results itself.
    ("simulate", &["variant", "apply", "plot", "ensemble", "over", "label", "mark"]),
    ("sensitivity", &["variant", "apply", "plot", "verify-sensitivities"]),
    // Only folders of results have journals.
    ("fit", &["variant", "apply", "plot", "resume"]),
    ("discover", &["variant", "apply", "plot", "resume"]),
    // The rows come from the program, which handles those that cannot be read.
    ("track", &["variant", "apply", "plot", "data", "strict"]),
];

/// Options that have another name in Python.
const RENAMED: [(&str, &str); 2] = [("set", "params"), ("from", "from_")];

fn read(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The options of a command, by their long names.
fn options(command: &Command) -> BTreeMap<String, Arg> {
    let named = command.get_arguments().filter_map(|arg| Some((arg.get_long()?, arg)));
    named.map(|(name, arg)| (name.to_owned(), arg.clone())).collect()
}

/// Names and default values of declarations in Python, each on a line as `name: type = value,`.
fn declared(lines: &str) -> BTreeMap<String, Option<String>> {
    let one = |line: &str| {
        let (name, rest) = line.trim().split_once(": ")?;
        let is_name = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let value = rest.split_once(" = ").map(|(_, value)| value.trim_end_matches(',').to_owned());
        is_name.then(|| (name.to_owned(), value))
    };
    lines.lines().filter_map(one).collect()
}

fn between<'t>(text: &'t str, start: &str, end: &str) -> &'t str {
    let from = text.find(start).unwrap_or_else(|| panic!("no `{start}`")) + start.len();
    let len = text[from..].find(end).unwrap_or_else(|| panic!("no `{end}` after `{start}`"));
    &text[from..from + len]
}

#[test]
fn python_has_every_option_of_a_request() {
    let model = read("crates/dgd-python/python/dgd/_model/model.py");
    let shared = read("crates/dgd-python/python/dgd/_options.py");
    let shared = declared(between(&shared, "    units: ", "\n\n\n"));
    let cli = Cli::command();
    let mut wrong = Vec::new();
    for (method, missing) in METHODS {
        let command = cli.find_subcommand(method).expect("a command");
        let arguments = declared(between(&model, &format!("    def {method}("), ") ->"));
        let options = options(command);
        for name in missing.iter().filter(|name| !options.contains_key(**name)) {
            wrong.push(format!("`{method}` has no option `{name}`"));
        }
        for (name, option) in options {
            if missing.contains(&&*name) {
                continue;
            }
            let renamed = RENAMED.iter().find(|(known, _)| *known == name);
            let argument =
                renamed.map_or_else(|| name.replace('-', "_"), |(_, name)| (*name).to_owned());
            match arguments.get(&argument).or_else(|| shared.get(&argument)) {
                None => wrong.push(format!("`Model.{method}` has no argument `{argument}`")),
                Some(Some(value)) if !is_default(value, &option) => {
                    let message =
                        format!("`Model.{method}`: the default of `{argument}` is not {value}");
                    wrong.push(message);
                }
                Some(_) => {}
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Whether a value in Python is that which the command uses if the option is not given.
fn is_default(value: &str, option: &Arg) -> bool {
    if ["None", "()", "False"].contains(&value) {
        // The argument is passed on only if it is given.
        return true;
    }
    let defaults = option.get_default_values();
    let [default] = defaults else { return false };
    let (default, value) = (default.to_string_lossy(), value.trim_matches('"'));
    let number = |text: &str| text.parse::<f64>().ok();
    *default == *value || number(&default).is_some() && number(&default) == number(value)
}

#[test]
fn the_manual_has_every_option_of_a_request_and_every_choice() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
    let files = fs::read_dir(folder).expect("the manual").flatten().map(|entry| entry.path());
    let mut files: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|extension| extension == "md")).collect();
    files.sort();
    let pages: Vec<String> =
        files.iter().map(|path| fs::read_to_string(path).expect("a page")).collect();
    let has_word = |page: &str, word: &str| {
        let is_part = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
        page.match_indices(word).any(|(at, _)| {
            !page[..at].ends_with(is_part) && !page[at + word.len()..].starts_with(is_part)
        })
    };
    let requests = [
        "simulate",
        "sensitivity",
        "linearize",
        "invert",
        "fit",
        "compare",
        "track",
        "discover",
        "screen",
    ];
    let cli = Cli::command();
    let mut missing = Vec::new();
    for request in requests {
        let command = cli.find_subcommand(request).expect("a command");
        for (name, option) in options(command) {
            let option_word = format!("--{name}");
            let known = || pages.iter().filter(|page| has_word(page, &option_word));
            if known().next().is_none() {
                missing.push(format!("`{option_word}` of `{request}`"));
            }
            // Flags have the values `true` and `false`.
            if !option.get_action().takes_values() {
                continue;
            }
            for value in option.get_possible_values() {
                if !known().any(|page| has_word(page, value.get_name())) {
                    missing.push(format!("`{option_word} {}`", value.get_name()));
                }
            }
        }
    }
    missing.dedup();
    assert!(missing.is_empty(), "not in docs/*.md:\n{}", missing.join("\n"));
}

#[test]
fn requests_are_valid_arguments() {
    Cli::command().debug_assert();
}
