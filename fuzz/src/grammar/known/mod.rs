//! Families of models with solutions known by construction: each case has [facts](crate::facts).

mod clocks;
mod curve;
mod joined;
mod late;
mod networks;
mod quadrature;
mod scatter;
mod schedules;
mod stepped;
mod tables;

use std::collections::BTreeMap;

use crate::case::Case;
use crate::facts::Fact;
use crate::random::Random;

/// A family of models.
pub struct Family {
    /// Its name, for `--family`.
    pub name: &'static str,
    /// A description of its models.
    pub what: &'static str,
    write: fn(&mut Draft),
}

/// All families.
pub const FAMILIES: &[Family] = &[
    Family {
        name: "clocks",
        what: "`every` of periods in rational proportions, whose ticks coincide",
        write: clocks::write,
    },
    Family {
        name: "joined",
        what: "modes that join states, and sums that are conserved",
        write: joined::write,
    },
    Family { name: "late", what: "delays that jump, and delays by states", write: late::write },
    Family {
        name: "networks",
        what: "resistors, capacitors and diodes by pieces, with one solution",
        write: networks::write,
    },
    Family { name: "scatter", what: "noise in proportion", write: scatter::write },
    Family {
        name: "schedules",
        what: "conditions on periodic functions of time, counted and integrated",
        write: schedules::write,
    },
    Family { name: "stepped", what: "rows of loops that step", write: stepped::write },
    Family { name: "tables", what: "tables that time or a clock drives", write: tables::write },
];

impl Family {
    /// The family of this name.
    pub fn named(name: &str) -> Option<&'static Family> {
        FAMILIES.iter().find(|family| family.name == name)
    }

    /// The random model of a seed.
    pub fn case(&self, seed: u64) -> Case {
        // A stream of its own for each family.
        let stream = self.name.bytes().fold(0, |stream, byte| 131 * stream + u128::from(byte));
        let random = Random::in_stream(seed, stream);
        let mut draft = Draft { random, ..Draft::default() };
        (self.write)(&mut draft);
        draft.case(self.name, seed)
    }
}

/// A model under construction.
#[derive(Default)]
struct Draft {
    random: Random,
    items: Vec<String>,
    facts: Vec<Fact>,
    data: String,
    until: f64,
    /// Whether the order of items matters, because coinciding resets read each other.
    is_ordered: bool,
}

impl Draft {
    /// A random number with this many decimals, exact in decimal notation.
    fn number(&mut self, low: f64, high: f64, decimals: usize) -> f64 {
        let x = self.random.between(low, high);
        format!("{x:.decimals$}").parse().unwrap_or(low)
    }

    /// A random whole number within these bounds.
    fn whole(&mut self, low: usize, high: usize) -> usize {
        low + self.random.below(high - low + 1)
    }

    fn chance(&mut self, probability: f64) -> bool {
        self.random.chance(probability)
    }

    /// A random one of these texts.
    fn one_of(&mut self, texts: &[&'static str]) -> &'static str {
        self.random.pick::<&str>(texts)
    }

    fn item(&mut self, text: impl Into<String>) {
        self.items.push(text.into());
    }

    /// Adds a fact at a time.
    fn at(&mut self, of: &str, at: f64, value: f64, size: f64) {
        self.facts.push(Fact { of: of.to_owned(), at: Some(at), value, size });
    }

    /// Adds a fact for all times.
    fn always(&mut self, of: &str, value: f64, size: f64) {
        self.facts.push(Fact { of: of.to_owned(), at: None, value, size });
    }

    /// The case, with shuffled items unless their order matters.
    fn case(mut self, name: &str, seed: u64) -> Case {
        if !self.is_ordered {
            for k in (1..self.items.len()).rev() {
                let other = self.random.below(k + 1);
                self.items.swap(k, other);
            }
        }
        Case {
            model: format!("model {name}_{seed}\n{}\n", self.items.join("\n")),
            files: BTreeMap::new(),
            data: self.data,
            until: self.until,
            facts: self.facts,
            is_ordered: self.is_ordered,
        }
    }
}
