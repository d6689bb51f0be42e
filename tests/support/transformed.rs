//! A model, its effects and its recordings said otherwise: in other units of time, with larger states, in another
//! order. What is true of the one is true of the other.

use super::examined::{Samples, Texts};
use super::renaming::Renaming;

/// A way to say the same otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Law {
    /// A minute for each second.
    Time,
    /// Everything has another name.
    Names,
    /// States are a thousand times as large.
    States,
    /// Items of the model stand the other way round.
    Order,
}

pub(crate) const LAWS: [Law; 4] = [Law::Time, Law::Names, Law::States, Law::Order];

/// Seconds for each second.
const SLOWER: f64 = 60.0;
/// What states are multiplied by.
const LARGER: f64 = 1000.0;
/// What is put behind the name of a state that is.
const MARK: &str = "_large";

/// What was said otherwise, and how names go back.
pub(crate) struct Transformed {
    pub(crate) texts: Texts,
    pub(crate) recordings: [Samples; 2],
    renaming: Option<Renaming>,
}

impl Transformed {
    /// `states` are those that may be scaled: no output that an effect replaces has the name of one.
    pub(crate) fn new(law: Law, texts: &Texts, pair: &[Samples; 2], states: &[&str]) -> Self {
        let (mut texts, mut recordings, mut renaming) = (texts.clone(), pair.clone(), None);
        match law {
            Law::Time => {
                texts = texts.map(&slower);
                for recording in &mut recordings {
                    recording.times.iter_mut().for_each(|t| *t *= SLOWER);
                }
            }
            Law::Names => {
                let all = texts.effects.iter().chain([&texts.model]);
                let new = Renaming::of(all.map(|(_, text)| text.as_str()));
                texts = texts.map(&|text| new.forth(text));
                for (name, _) in recordings.iter_mut().flat_map(|r| &mut r.columns) {
                    *name = new.forth(name);
                }
                renaming = Some(new);
            }
            Law::States => {
                let model = texts.model.1.clone();
                texts = texts.map(&|text| larger(text, &model, states));
            }
            Law::Order => texts.model.1 = reversed(&texts.model.1),
        }
        Transformed { texts, recordings, renaming }
    }

    /// A name of the answer as it was before.
    pub(crate) fn back(&self, name: &str) -> String {
        let name = name.replace(MARK, "");
        self.renaming.as_ref().map_or_else(|| name.clone(), |renaming| renaming.back(&name))
    }
}

/// The same for times that are a minute for each second: derivatives are so much smaller, parameters that time or a
/// delay is compared with so much longer, and rates that time is multiplied by so much slower.
fn slower(text: &str) -> String {
    let of_der: Vec<&str> = lags(text).collect();
    let has_time = text.split(|c: char| !c.is_alphanumeric()).any(|word| word == "time");
    let line = |line: &str| {
        let mut words = line.split_whitespace();
        let is_parameter = words.next() == Some("parameter");
        let name = words.next().unwrap_or_default();
        let factor = if line.contains("[s]") && !of_der.contains(&name) {
            SLOWER
        } else if has_time && line.contains("/h]") {
            1.0 / SLOWER
        } else {
            1.0
        };
        if is_parameter {
            scaled(line, factor)
        } else {
            line.replace("der(", &format!("{SLOWER}*der("))
        }
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n") + "\n"
}

/// Parameters that derivatives are multiplied by: with slower derivatives they stay.
fn lags(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter_map(|line| {
        let (before, _) = line.split_once("der(")?;
        before.split(|c: char| !(c.is_alphanumeric() || c == '_')).rfind(|word| !word.is_empty())
    })
}

/// A declaration with its numbers multiplied.
fn scaled(line: &str, factor: f64) -> String {
    let Some((name, rest)) = line.split_once('=') else { return line.to_owned() };
    let (numbers, doc) = rest.split_once("///").unwrap_or((rest, ""));
    let word = |word: &str| {
        let bare = word.trim_end_matches(',');
        let comma = &word[bare.len()..];
        bare.parse::<f64>().map_or_else(|_| word.to_owned(), |x| format!("{}{comma}", x * factor))
    };
    let numbers: Vec<String> = numbers.split_whitespace().map(word).collect();
    let doc = if doc.is_empty() { String::new() } else { format!("  ///{doc}") };
    format!("{name}= {}{doc}", numbers.join(" "))
}

/// The same with states that are a thousand times as large.
fn larger(text: &str, model: &str, states: &[&str]) -> String {
    let mut text = text.to_owned();
    for state in states {
        let new = format!("{state}{MARK}");
        let lines = text.lines().map(|line| {
            let code = line.split_once("///").map_or(line, |(code, _)| code);
            if code.trim_start().starts_with(&format!("state {state} ")) {
                let line = replaced(code, state, &new);
                return scaled(&line, LARGER);
            }
            let Some(rest) = declared_output(code, state) else {
                let large = replaced(code, state, &format!("({new}/{LARGER})"));
                return large
                    .replace(&format!("der(({new}/{LARGER}))"), &format!("der({new})/{LARGER}"));
            };
            let unit = unit_of(model, state);
            let noise = rest.find("noise").map_or("", |at| &rest[at..]);
            format!("output {state} [{unit}] = {new}/{LARGER} {noise}")
        });
        text = lines.collect::<Vec<_>>().join("\n") + "\n";
    }
    text
}

/// What stands behind the name of an output that shows a state of its name.
fn declared_output<'a>(line: &'a str, state: &str) -> Option<&'a str> {
    let rest = line.strip_prefix("output ")?.trim_start().strip_prefix(state)?;
    let is_name = rest.starts_with(|c: char| c.is_alphanumeric() || c == '_');
    (!is_name && !rest.contains('=')).then_some(rest)
}

/// The unit that a model declares a state in.
fn unit_of<'a>(model: &'a str, state: &str) -> &'a str {
    let declaration =
        model.lines().find(|line| line.split_whitespace().take(2).eq(["state", state]));
    let unit = declaration.and_then(|line| Some(line.split_once('[')?.1.split_once(']')?.0));
    unit.expect("a state has a unit")
}

/// A text with a name in the place of another.
fn replaced(text: &str, old: &str, new: &str) -> String {
    let is_of_a_name = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
    let (mut out, mut rest) = (String::new(), text);
    while let Some(at) = rest.find(old) {
        let (before, behind) = (&rest[..at], &rest[at + old.len()..]);
        let is_whole = !before.ends_with(is_of_a_name) && !behind.starts_with(is_of_a_name);
        out.push_str(before);
        out.push_str(if is_whole { new } else { old });
        rest = behind;
    }
    out + rest
}

/// A model with its items the other way round. An item begins in the first column.
fn reversed(text: &str) -> String {
    let (mut head, mut items, mut docs) = (String::new(), Vec::<String>::new(), String::new());
    for line in text.lines().filter(|line| !line.trim().is_empty()) {
        let is_model = line.starts_with("model ");
        if line.starts_with("///") {
            docs.extend([line, "\n"]);
        } else if is_model {
            head = format!("{}{line}\n", std::mem::take(&mut docs));
        } else if line.starts_with(|c: char| c.is_alphabetic()) {
            items.push(format!("{}{line}\n", std::mem::take(&mut docs)));
        } else if let Some(last) = items.last_mut() {
            last.extend([line, "\n"]);
        }
    }
    items.reverse();
    head + "\n" + &items.concat()
}
