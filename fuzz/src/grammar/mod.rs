//! Generates random valid models: [`table`](table::TABLE) has a row with a weight for each form of the language.
//!
//! Models are valid by construction. Expressions are dimensionless, made of quantities divided by their sizes, or
//! quantities of one dimension; equations are bounded, so that solutions stay of order one; an unknown's equation is
//! monotone in it and reads only earlier ones, so that the structure is regular.

mod known;
mod quantity;
mod table;

use std::collections::BTreeMap;
use std::fmt::{self, Write};

use crate::case::Case;
use crate::prepared::EFFECT;
use crate::random::Random;
pub use known::{FAMILIES, Family};
use quantity::{Kind, Known, SCALES, Scale};
pub use table::{Place, TABLE};

/// The random model of a seed, without the named rows of the table.
pub fn case(seed: u64, without: &[String]) -> Case {
    let mut writer = Writer::new(seed, without);
    writer.model(seed)
}

/// Source of a random model.
#[derive(Clone, Copy)]
pub struct Origin {
    /// Its family, if it is not generated from the table.
    pub family: Option<&'static Family>,
    /// Its seed.
    pub seed: u64,
}

impl Origin {
    /// The model, without the named rows of the table.
    pub fn case(&self, without: &[String]) -> Case {
        match self.family {
            Some(family) => family.case(self.seed),
            None => case(self.seed, without),
        }
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.family {
            Some(family) => write!(f, "{}/{}", family.name, self.seed),
            None => write!(f, "{}", self.seed),
        }
    }
}

/// Which quantities an expression may read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reads {
    /// Constants and parameters.
    Parameters,
    /// These and inputs, at the start.
    Start,
    /// Everything.
    All,
    /// The quantities allowed in a loop.
    Loop,
}

/// A declared function.
struct Function {
    name: String,
    /// Units of its arguments.
    arguments: Vec<&'static Scale>,
}

/// Writes one model.
pub(crate) struct Writer {
    pub(crate) random: Random,
    weights: Vec<u32>,
    known: Vec<Known>,
    /// Inputs that only some expressions may read and that the recording contains.
    columns: Vec<Known>,
    functions: Vec<Function>,
    lines: Vec<String>,
    files: BTreeMap<String, String>,
    reads: Reads,
    /// Name of the loop's index, if an expression is in a loop.
    index: Option<String>,
    /// Expressions for the arguments within a function.
    arguments: Vec<String>,
    /// The unit of the wanted quantity.
    wanted: &'static Scale,
    /// Counter for names.
    numbered: u32,
    /// Whether the model starts in its steady state, if possible.
    steady: bool,
}

impl Writer {
    fn new(seed: u64, without: &[String]) -> Self {
        let weight = |row: &table::Row| {
            if without.iter().any(|name| row.what.contains(name.as_str())) { 0 } else { row.weight }
        };
        Self {
            random: Random::new(seed),
            weights: TABLE.iter().map(weight).collect(),
            known: Vec::new(),
            columns: Vec::new(),
            functions: Vec::new(),
            lines: Vec::new(),
            files: BTreeMap::new(),
            reads: Reads::All,
            index: None,
            arguments: Vec::new(),
            wanted: &SCALES[0],
            numbered: 0,
            steady: false,
        }
    }

    /// A name that is not used by another item.
    fn name(&mut self, of: &str) -> String {
        self.numbered += 1;
        format!("{of}{}", self.numbered)
    }

    fn line(&mut self, line: String) {
        self.lines.push(line);
    }

    /// The text of a row for a place, chosen by weight; `None` if no row applies.
    fn write(&mut self, place: Place, depth: u32) -> Option<String> {
        let weight = |k: usize| if TABLE[k].place == place { self.weights[k] } else { 0 };
        let total: u32 = (0..TABLE.len()).map(weight).sum();
        if total == 0 {
            return None;
        }
        let mut chosen = self.random.below(total as usize) as u32;
        for (k, row) in TABLE.iter().enumerate() {
            let weight = if row.place == place { self.weights[k] } else { 0 };
            if chosen < weight {
                return Some((row.write)(self, depth));
            }
            chosen -= weight;
        }
        None
    }

    /// A dimensionless expression of order one.
    pub(crate) fn scalar(&mut self, depth: u32) -> String {
        let place = if depth == 0 { Place::Leaf } else { Place::Scalar };
        let written = self.write(place, depth.saturating_sub(1));
        written.unwrap_or_else(|| self.number())
    }

    /// An expression of the wanted dimension, of the order of its scale.
    pub(crate) fn quantity(&mut self, scale: &'static Scale, depth: u32) -> String {
        let outer = std::mem::replace(&mut self.wanted, scale);
        let written = if depth == 0 { None } else { self.write(Place::Quantity, depth - 1) };
        let written = written.unwrap_or_else(|| {
            let same =
                |known: &&Known| known.scale.dimension == scale.dimension && !known.scale.offset;
            let of_scale: Vec<String> = (self.readable())
                .filter(same)
                .filter_map(|known| known.text(self.index.as_deref()))
                .collect();
            if of_scale.is_empty() || self.random.chance(0.3) {
                format!("{}{}", self.number(), scale.over("*"))
            } else {
                self.random.pick(&of_scale).clone()
            }
        });
        self.wanted = outer;
        written
    }

    /// A condition.
    pub(crate) fn condition(&mut self, depth: u32) -> String {
        let written = self.write(Place::Condition, depth.saturating_sub(1));
        written.unwrap_or_else(|| "time > 1 [s]".to_owned())
    }

    /// A number of order one, in parentheses if negative.
    pub(crate) fn number(&mut self) -> String {
        let digits = 1 + self.random.below(3);
        let x = self.random.between(-2.0, 2.0);
        let text = format!("{x:.digits$}");
        if text.starts_with('-') { format!("({text})") } else { text }
    }

    /// A positive number.
    pub(crate) fn positive(&mut self) -> String {
        format!("{:.2}", self.random.between(0.2, 2.0))
    }

    fn readable(&self) -> impl Iterator<Item = &Known> {
        let reads = self.reads;
        self.known.iter().filter(move |known| match reads {
            Reads::Parameters => matches!(known.kind, Kind::Constant | Kind::Parameter),
            Reads::Start => {
                matches!(known.kind, Kind::Constant | Kind::Parameter | Kind::Input)
            }
            Reads::All => !matches!(known.kind, Kind::Hidden),
            Reads::Loop => matches!(
                known.kind,
                Kind::Constant | Kind::Parameter | Kind::Input | Kind::State | Kind::Array(_)
            ),
        })
    }

    /// A readable quantity divided by its size.
    pub(crate) fn read(&mut self) -> String {
        if !self.arguments.is_empty() && self.random.chance(0.7) {
            return self.random.pick(&self.arguments).clone();
        }
        let index = self.index.clone();
        let texts: Vec<(String, &'static Scale)> = (self.readable())
            .filter_map(|known| known.text(index.as_deref()).map(|text| (text, known.scale)))
            .collect();
        if texts.is_empty() {
            return self.number();
        }
        let (text, scale) = self.random.pick(&texts).clone();
        let other = if scale.others.is_empty() || self.random.chance(0.8) {
            None
        } else {
            Some(*self.random.pick(scale.others))
        };
        scale.over_size(&text, other)
    }

    /// Names of one kind.
    pub(crate) fn of_kind(&self, kind: Kind) -> Vec<Known> {
        self.known.iter().filter(|known| known.kind == kind).cloned().collect()
    }

    fn model(&mut self, seed: u64) -> Case {
        self.line(format!("model m{seed}"));
        self.several(Place::Value, 1, 5);
        if self.random.chance(0.7) {
            self.several(Place::Input, 1, 2);
        }
        self.several(Place::State, 1, 3);
        if self.random.chance(0.15) {
            self.several(Place::Whole, 1, 1);
        }
        if self.random.chance(0.6) {
            self.several(Place::Between, 1, 3);
        }
        // Equations come after all declarations, so that they can read all states.
        self.several(Place::Unknown, 0, 2);
        let states: Vec<Known> = self.of_kind(Kind::State);
        for state in states {
            self.own(&state);
            if let Some(line) = self.write(Place::Equation, 3) {
                self.line(line);
            }
            self.known.retain(|known| known.kind != Kind::Hidden);
        }
        if self.random.chance(0.4) {
            self.several(Place::Beside, 1, 2);
        }
        self.several(Place::Output, 1, 3);
        if self.random.chance(0.08)
            && let Some(text) = self.write(Place::Effect, 1)
        {
            let head = format!("effect applied on m{seed}\n");
            self.files.insert(EFFECT.to_owned(), head + &text);
        }
        let (data, until) = self.recording();
        let model = self.lines.join("\n") + "\n";
        let model = if self.steady { steady(&model).unwrap_or(model) } else { model };
        Case {
            model,
            files: std::mem::take(&mut self.files),
            data,
            until,
            facts: Vec::new(),
            is_ordered: false,
        }
    }

    /// Makes a state the one that the next equation determines.
    fn own(&mut self, state: &Known) {
        self.known.push(Known { kind: Kind::Hidden, ..state.clone() });
    }

    /// The state that the current equation determines.
    pub(crate) fn determined(&self) -> Known {
        let hidden = self.known.iter().rev().find(|known| known.kind == Kind::Hidden);
        hidden.cloned().unwrap_or_else(|| Known::new("x", &SCALES[0], Kind::State))
    }

    fn several(&mut self, place: Place, least: usize, most: usize) {
        let count = least + self.random.below(most - least + 1);
        for _ in 0..count {
            if let Some(line) = self.write(place, 3)
                && !line.is_empty()
            {
                self.line(line);
            }
        }
    }

    /// A recording of the inputs, and the length of the run.
    fn recording(&mut self) -> (String, f64) {
        let mut inputs = self.of_kind(Kind::Input);
        inputs.append(&mut self.columns);
        let until = self.random.between(0.8, 4.0);
        let until = (until * 1000.0).round() / 1000.0;
        if inputs.is_empty() {
            return (String::new(), 2.0);
        }
        let rows = 2 + self.random.below(6);
        let mut text = String::from("time [s]");
        for input in &inputs {
            let _ = write!(text, ",{} [{}]", input.name, input.scale.symbol);
        }
        text.push('\n');
        let mut t = 0.0;
        for row in 0..rows {
            let twice = row > 0 && row + 1 < rows && self.random.chance(0.15);
            for _ in 0..=usize::from(twice) {
                let _ = write!(text, "{t}");
                for input in &inputs {
                    let value = input.scale.value(self.random.between(-1.0, 1.0));
                    let _ = write!(text, ",{}", (value * 1e4).round() / 1e4);
                }
                text.push('\n');
            }
            let left = (rows - 1 - row).max(1) as f64;
            t += (until - t) / left * self.random.between(0.3, 1.7).min(left);
            t = (t.min(until) * 1000.0).round() / 1000.0;
            if row + 2 == rows {
                t = until;
            }
        }
        (text, until)
    }
}

/// The same model with a parameter instead of the time, started in its steady state; `None` if that is not possible.
fn steady(model: &str) -> Option<String> {
    if ["modes ", "history ", "every ", "start ", "import "].iter().any(|word| model.contains(word))
    {
        return None;
    }
    let (head, rest) = model.split_once('\n')?;
    let is_word = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    let mut text = format!("{head}\nparameter when_it_is [s] = 0.7\nstart steady\n");
    let mut parts = rest.split("time").peekable();
    while let Some(part) = parts.next() {
        text += part;
        if let Some(next) = parts.peek() {
            let alone = !is_word(part.chars().last()) && !is_word(next.chars().next());
            text += if alone { "when_it_is" } else { "time" };
        }
    }
    Some(text)
}
