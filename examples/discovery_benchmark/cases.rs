//! What is hidden in which case.

use crate::drilling_rig::Scenario;
use crate::drilling_rig::effects::{LIBRARY, OUTSIDE, PAIRS};
use crate::drilling_rig::random::Random;

/// A rig to be recorded, and what is to be found in it.
#[derive(Debug, Clone)]
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) scenario: Scenario,
}

/// What kind of truth it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Nothing,
    One,
    Two,
    Outside,
}

/// Pairs of a round, and cases with nothing hidden.
const PAIRS_PER_ROUND: usize = 4;
const NOTHING_PER_ROUND: usize = 3;

/// So many cases, in rounds of each effect once, some pairs, nothing and what has no name.
pub(crate) fn cases(
    number: usize,
    seed: u64,
    hard: bool,
    only: Option<&str>,
) -> Result<Vec<Case>, String> {
    let hidden = |k: usize| match only {
        None => Ok(of_a_round(k)),
        Some("none") => Ok(Vec::new()),
        Some("outside") => Ok(vec![OUTSIDE[k % OUTSIDE.len()]]),
        Some(names) => names.split('+').map(known).collect(),
    };
    let case = |k: usize| {
        let names = hidden(k)?;
        let seed = seed.wrapping_mul(1000).wrapping_add(k as u64);
        let minutes = Random::new(seed, 0).between(70.0, 110.0);
        let scenario = Scenario::drawn(seed, minutes, &names)
            .ok_or_else(|| format!("there is no effect {}", names.join("+")))?;
        let scenario = if hard { scenario.hardened() } else { scenario };
        let kind = match names.as_slice() {
            [] => Kind::Nothing,
            [name] if OUTSIDE.contains(name) => Kind::Outside,
            [_] => Kind::One,
            _ => Kind::Two,
        };
        let name = if names.is_empty() { "none".to_owned() } else { names.join("+") };
        Ok(Case { name: format!("{k:03}_{name}"), kind, scenario })
    };
    (0..number).map(case).collect()
}

fn known(name: &str) -> Result<&'static str, String> {
    let found = LIBRARY.iter().chain(&OUTSIDE).find(|known| **known == name);
    found.copied().ok_or_else(|| format!("there is no effect `{name}`"))
}

/// What the kth of all cases hides.
fn of_a_round(k: usize) -> Vec<&'static str> {
    let of_round = LIBRARY.len() + PAIRS_PER_ROUND + NOTHING_PER_ROUND + OUTSIDE.len();
    let (round, mut at) = (k / of_round, k % of_round);
    if let Some(name) = LIBRARY.get(at) {
        return vec![name];
    }
    at -= LIBRARY.len();
    if at < PAIRS_PER_ROUND {
        return PAIRS[(round * PAIRS_PER_ROUND + at) % PAIRS.len()].to_vec();
    }
    at -= PAIRS_PER_ROUND;
    OUTSIDE.get(at).map(|name| vec![*name]).unwrap_or_default()
}
