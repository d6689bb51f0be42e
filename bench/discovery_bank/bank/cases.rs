//! Which cases a seed has.

use super::noise::Noise;
use super::random::Random;
use super::twin::{Change, Twin};
use super::{Case, Domain, Hidden, Kind, Part, Plan, Truth};

/// Cases of a domain for each kind with every seed; the next seed goes on where this one ends.
const LIBRARY: usize = 3;
const TEMPLATE: usize = 3;
const PARAMETER: usize = 1;
const NOTHING: usize = 2;

/// Nothing, as something to be hidden.
static NOTHING_HIDDEN: Hidden = Hidden { name: "", truth: Truth::Nothing, effect: "" };

/// A case that is still to be recorded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Planned {
    pub(crate) domain: &'static Domain,
    pub(crate) hidden: &'static Hidden,
    pub(crate) kind: Kind,
    pub(crate) noise: Noise,
    pub(crate) twin: Option<Change>,
    seed: u64,
}

/// All cases of a seed: those of each domain in the order of [`Kind::ALL`].
pub(crate) fn planned(domains: &[&'static Domain], seed: u64) -> Vec<Planned> {
    domains.iter().flat_map(|domain| of_domain(domain, seed)).collect()
}

/// Everything that any seed may hide in these domains, once.
pub(crate) fn everything(domains: &[&'static Domain], seed: u64) -> Vec<Planned> {
    let all = domains
        .iter()
        .flat_map(|domain| domain.hidden.iter().map(|hidden| Planned::new(domain, hidden, seed)));
    all.collect()
}

/// Cases of a domain under white noise in which nothing is hidden.
pub(crate) fn nulls(
    domain: &'static Domain,
    seed: u64,
    number: usize,
) -> impl Iterator<Item = Planned> {
    let seeds = (0..number as u64).map(move |k| seed.wrapping_add(k.wrapping_mul(104_729)));
    seeds.map(move |seed| Planned::new(domain, &NOTHING_HIDDEN, seed))
}

fn of_domain(domain: &'static Domain, seed: u64) -> Vec<Planned> {
    // Each domain begins elsewhere in the lists, whichever others are chosen.
    let at = digest(0, &[domain.name]) as usize % 1000;
    let of = |kind: Kind, number: usize| -> Vec<Planned> {
        let all: Vec<&Hidden> =
            domain.hidden.iter().filter(|hidden| hidden.truth.kind() == kind).collect();
        let number = number.min(all.len());
        let drawn = (0..number).map(|k| all[(seed as usize * number + k) % all.len()]);
        drawn.map(|hidden| Planned::new(domain, hidden, seed)).collect()
    };
    let library = of(Kind::Library, LIBRARY);
    let template = of(Kind::Template, TEMPLATE);
    let nothing = (0..NOTHING).map(|k| {
        let noise = Noise::ALL[(seed as usize * NOTHING + at * 3 + k) % Noise::ALL.len()];
        Planned {
            noise,
            ..Planned::new(domain, &NOTHING_HIDDEN, seed.wrapping_add(k as u64 * 7919))
        }
    });
    let twin = |original: &Planned, k: usize| {
        let change = Change::ALL[(seed as usize + 2 * at + k) % Change::ALL.len()];
        original.again(change)
    };
    let twins = library.iter().take(1).chain(template.iter().take(1)).enumerate();
    let twins: Vec<Planned> = twins.map(|(k, original)| twin(original, k)).collect();
    let parameter = of(Kind::Parameter, PARAMETER);
    [library, template, parameter, nothing.collect(), twins].concat()
}

impl Planned {
    fn new(domain: &'static Domain, hidden: &'static Hidden, seed: u64) -> Self {
        Planned {
            domain,
            hidden,
            kind: hidden.truth.kind(),
            noise: Noise::White,
            twin: None,
            seed: digest(seed, &[domain.name, hidden.name]),
        }
    }

    /// The name of the case's folder.
    pub(crate) fn name(&self) -> String {
        let what = if self.hidden.name.is_empty() { self.noise.word() } else { self.hidden.name };
        let original = format!("{}.{}.{what}", self.domain.name, self.hidden.truth.kind().word());
        match self.twin {
            None => original,
            Some(change) => format!("{original}.{}", change.word()),
        }
    }

    /// The same as a twin.
    pub(crate) fn again(&self, change: Change) -> Planned {
        Planned { kind: Kind::Twin, twin: Some(change), ..*self }
    }

    /// The case that this is a twin of, or itself.
    pub(crate) fn original(&self) -> Planned {
        Planned { kind: self.hidden.truth.kind(), twin: None, ..*self }
    }

    /// Simulates both recordings.
    pub(crate) fn recorded(&self) -> Case {
        let domain = self.domain;
        let record = |part: Part| {
            let plan = Plan { hidden: self.hidden.name, part, seed: self.seed };
            self.noise.add(&(domain.record)(&plan), &plan)
        };
        let is_withheld = matches!(self.kind, Kind::Template | Kind::Parameter)
            || (self.kind == Kind::Twin && self.hidden.truth.kind() != Kind::Library);
        let effects = domain.effects.iter().filter(|_| !is_withheld);
        let case = Case {
            name: self.name(),
            domain: domain.name,
            kind: self.kind,
            model: domain.model.to_owned(),
            effects: effects.map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect(),
            train: record(Part::Train),
            valid: record(Part::Valid),
            hidden: self.hidden.name,
            truth: self.hidden.truth,
            effect: self.hidden.effect.to_owned(),
            noise: self.noise,
            twin: None,
        };
        match self.twin {
            None => case,
            Some(change) => {
                let mut random = Random::new(self.seed, 6);
                Twin::of(&case, self.original().name(), change, &mut random)
            }
        }
    }
}

/// A seed for a name, by Fowler, Noll and Vo's FNV-1a: cases do not depend on one another.
fn digest(seed: u64, names: &[&str]) -> u64 {
    let bytes = names.iter().flat_map(|name| name.bytes().chain([0]));
    seed.to_le_bytes().into_iter().chain(bytes).fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
    })
}
