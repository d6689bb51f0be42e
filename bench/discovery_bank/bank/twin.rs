//! Twins: a case again that says the same in other words. The answer has to be the same.

use super::random::Random;
use super::units;
use super::{Case, Column, Kind, Recording};

/// What is changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Change {
    /// Columns of the recordings are in other units of the same quantities.
    Units,
    /// Everything that the model and the effects declare has another name.
    Names,
    /// Items of the model and the effects, and columns, are in another order.
    Order,
    /// Everything happens a thousand times as slowly.
    Time,
    /// Time, lengths, masses and currents are all on other scales.
    Scales,
    /// Names, order, time and scales at once.
    All,
}

/// A twin.
#[derive(Debug, Clone)]
pub(crate) struct Twin {
    /// Name of the case that it is again.
    pub(crate) of: String,
    pub(crate) change: Change,
    /// Names before and after.
    pub(crate) renamed: Vec<(String, String)>,
}

impl Change {
    pub(crate) const ALL: [Change; 6] =
        [Change::Units, Change::Names, Change::Order, Change::Time, Change::Scales, Change::All];

    pub(crate) fn word(self) -> &'static str {
        match self {
            Change::Units => "units",
            Change::Names => "names",
            Change::Order => "order",
            Change::Time => "time",
            Change::Scales => "scales",
            Change::All => "all",
        }
    }
}

/// How much slower time runs in a scaled twin; [`units::scaled`] has the same factor.
const SLOWER: f64 = 1000.0;

impl Twin {
    /// A case again with this changed.
    pub(crate) fn of(case: &Case, of: String, change: Change, random: &mut Random) -> Case {
        let mut twin = Case {
            name: format!("{of}.{}", change.word()),
            kind: Kind::Twin,
            twin: None,
            ..case.clone()
        };
        let mut renamed = Vec::new();
        match change {
            Change::Units => in_other_units(&mut twin),
            Change::Names => renamed = rename(&mut twin, random),
            Change::Order => reorder(&mut twin, random),
            Change::Time => scale(&mut twin, true),
            Change::Scales => scale(&mut twin, false),
            Change::All => {
                scale(&mut twin, false);
                reorder(&mut twin, random);
                renamed = rename(&mut twin, random);
            }
        }
        twin.twin = Some(Twin { of, change, renamed });
        twin
    }

    /// A text of the twin's answer with the names of the original.
    pub(crate) fn in_the_names_of_the_original(&self, text: &str) -> String {
        let back: Vec<(String, String)> =
            self.renamed.iter().map(|(old, new)| (new.clone(), old.clone())).collect();
        replaced(text, &back)
    }
}

impl Case {
    /// Changes all texts.
    fn change_texts(&mut self, f: &mut dyn FnMut(&str) -> String) {
        self.model = f(&self.model);
        for (_, text) in &mut self.effects {
            *text = f(text);
        }
        self.effect = f(&self.effect);
    }
}

fn in_other_units(case: &mut Case) {
    let other = |column: &mut Column| {
        if let Some((unit, factor, offset)) = units::other(&column.unit) {
            unit.clone_into(&mut column.unit);
            column.values.iter_mut().for_each(|x| *x = (*x - offset) / factor);
            column.noise = column.noise.map(|noise| noise / factor);
        }
    };
    case.train.columns.iter_mut().for_each(other);
    case.valid.columns.iter_mut().for_each(other);
    for recording in [&mut case.train, &mut case.valid] {
        let (unit, factor) = match recording.time_unit {
            "s" => ("ms", 1e3),
            "ms" => ("s", 1e-3),
            "min" => ("s", 60.0),
            "h" => ("min", 60.0),
            _ => continue,
        };
        recording.time_unit = unit;
        recording.times.iter_mut().for_each(|t| *t *= factor);
    }
}

/// Declared numbers stay; their units are others.
fn scale(case: &mut Case, only_time: bool) {
    let unit = |unit: &str| {
        units::scaled(unit, only_time).unwrap_or_else(|why| panic!("a unit of the bank: {why}"))
    };
    case.change_texts(&mut |text| with_units(text, &unit));
    let slower = |recording: &mut Recording| {
        recording.times.iter_mut().for_each(|t| *t *= SLOWER);
        for column in &mut recording.columns {
            column.unit = unit(&column.unit);
        }
    };
    slower(&mut case.train);
    slower(&mut case.valid);
}

/// A text with other units between brackets; `unit(y)` of templates stays.
fn with_units(text: &str, unit: &dyn Fn(&str) -> String) -> String {
    let mut changed = String::new();
    for line in text.lines() {
        let (mut code, comment) = parts(line);
        while let Some((before, after)) = code.split_once('[') {
            let (inside, rest) = after.split_once(']').unwrap_or((after, ""));
            changed.push_str(before);
            changed.push('[');
            changed.push_str(&if inside.contains("unit(") {
                inside.to_owned()
            } else {
                unit(inside)
            });
            changed.push(']');
            code = rest;
        }
        changed.push_str(code);
        changed.push_str(comment);
        changed.push('\n');
    }
    changed
}

/// A line before its remark or doc comment, and these.
fn parts(line: &str) -> (&str, &str) {
    let end = line.find("///").or_else(|| line.find('#')).unwrap_or(line.len());
    line.split_at(end)
}

/// Words that begin an item which declares the name behind them.
const DECLARES: [&str; 9] =
    ["constant", "parameter", "input", "state", "unknown", "let", "function", "equation", "output"];

/// Items of the model, and of each effect what follows its header.
fn reorder(case: &mut Case, random: &mut Random) {
    case.change_texts(&mut |text| reordered(text, random));
    // The same order of columns would be the same file.
    case.train.columns.reverse();
    case.valid.columns.reverse();
}

fn reordered(text: &str, random: &mut Random) -> String {
    let items = items(text);
    let is_header = |item: &String| {
        let code = item.lines().find(|line| !line.trim_start().starts_with("///"));
        let first = code.and_then(|line| line.split_whitespace().next());
        matches!(first, Some("model" | "effect" | "kind" | "form" | "import"))
    };
    let (mut all, mut others): (Vec<String>, Vec<String>) = items.into_iter().partition(is_header);
    while !others.is_empty() {
        all.push(others.swap_remove(random.whole(0, others.len() - 1)));
    }
    all.concat()
}

/// A text cut into items, each with the doc comment above it and the lines on which it goes on.
fn items(text: &str) -> Vec<String> {
    let mut items = Vec::new();
    let mut item = String::new();
    let mut depth = 0i32;
    for line in text.lines() {
        let (code, _) = parts(line);
        let code = code.trim_end();
        if code.trim().is_empty() && !line.trim_start().starts_with("///") && item.is_empty() {
            continue;
        }
        item.push_str(line);
        item.push('\n');
        if code.trim().is_empty() {
            continue;
        }
        for c in code.chars() {
            depth += i32::from(c == '(' || c == '{') - i32::from(c == ')' || c == '}');
        }
        let goes_on = code.ends_with(['=', ':', ',', '+', '-', '*', '/'])
            || code.ends_with(" then")
            || code.ends_with(" else");
        if depth == 0 && !goes_on {
            items.push(std::mem::take(&mut item));
        }
    }
    if !item.is_empty() {
        items.push(item);
    }
    items
}

/// Gives everything that is declared another name, which is the name of nothing else.
fn rename(case: &mut Case, random: &mut Random) -> Vec<(String, String)> {
    let texts: Vec<&str> = std::iter::once(case.model.as_str())
        .chain(case.effects.iter().map(|(_, text)| text.as_str()))
        .chain([case.effect.as_str()])
        .collect();
    let mut names: Vec<String> = Vec::new();
    for name in texts.iter().flat_map(|text| declared(text)) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let mut renamed: Vec<(String, String)> = Vec::new();
    for name in names {
        let letter = |random: &mut Random| char::from(b'a' + random.whole(0, 25) as u8);
        let new = (0..4).map(|_| letter(random)).collect::<String>();
        // A number behind the letters keeps it from being a word of the language or another name.
        renamed.push((name, format!("{new}_{}", renamed.len() + 10)));
    }
    case.change_texts(&mut |text| replaced(text, &renamed));
    for column in case.train.columns.iter_mut().chain(&mut case.valid.columns) {
        column.name = replaced(&column.name, &renamed);
    }
    renamed
}

/// Names that items of a text declare; outputs and labels that are named like something else go with it.
fn declared(text: &str) -> Vec<String> {
    let name = |item: &String| {
        let code: Vec<&str> = item.lines().map(|line| parts(line).0).collect();
        let code = code.join(" ");
        let mut words = code.split_whitespace();
        let is_declaration = words.next().is_some_and(|word| DECLARES.contains(&word));
        let name = words.next()?.split(['(', ':', '=', '[']).next()?.to_owned();
        (is_declaration && !name.is_empty()).then_some(name)
    };
    items(text).iter().filter_map(name).collect()
}

/// A text with whole words replaced, but not between brackets, where units are, nor in comments.
fn replaced(text: &str, renamed: &[(String, String)]) -> String {
    let mut changed = String::new();
    for (n, line) in text.lines().enumerate() {
        if n > 0 {
            changed.push('\n');
        }
        let (code, comment) = parts(line);
        let mut word = String::new();
        let mut in_brackets = false;
        let flush = |word: &mut String, changed: &mut String| {
            let new = renamed.iter().find(|(old, _)| old == word).map(|(_, new)| new.as_str());
            changed.push_str(new.unwrap_or(word));
            word.clear();
        };
        for c in code.chars() {
            if !in_brackets && (c.is_alphanumeric() || c == '_') {
                word.push(c);
                continue;
            }
            flush(&mut word, &mut changed);
            in_brackets = (in_brackets || c == '[') && c != ']';
            changed.push(c);
        }
        flush(&mut word, &mut changed);
        changed.push_str(comment);
    }
    if text.ends_with('\n') {
        changed.push('\n');
    }
    changed
}
