//! Which of the fitted laws is an answer.

use std::collections::BTreeSet;

use super::answer::{AnsweringLaw, LawAnswer};
use super::inserted::{EVALUATIONS, FittedTerms};
use super::search::LawSearch;
use crate::fit::{FittedStructure, SearchData, VERY_STRONG};
use crate::search::EffectSearch;

/// Laws whose costs differ by less are rivals.
const RIVAL: f64 = VERY_STRONG;
/// A law replaces templates of the plant that explain the recordings if its cost is lower by this: the threshold of a
/// further effect.
const BETTER: f64 = 3.0 * VERY_STRONG;
/// Fraction of the mean square of the residuals that a less plain law has to explain: the noise is not known better.
const RESOLVED: f64 = 0.01;
/// Least size of a coefficient, in standard deviations.
const SIGNIFICANT: f64 = 4.0;
/// Largest number of terms of a plain law.
const PLAIN: usize = 2;
/// Number of laws that are simulated in the validation recordings.
const HELD_OUT: usize = 8;
/// Number of near forms that are reported.
const NEAR: usize = 5;

/// Templates that were named.
pub(crate) struct NamedTemplates<'a> {
    pub(crate) fitted: &'a FittedStructure,
    /// Equations and names that they change.
    pub(crate) targets: BTreeSet<String>,
    /// Their number.
    pub(crate) effects: usize,
    /// Whether all are faults of sensors.
    pub(crate) are_sensors: bool,
    /// Whether they leave white noise in the training recordings.
    pub(crate) is_noise: bool,
}

impl NamedTemplates<'_> {
    /// Whether a law of a model with these equations may be a better answer or a rival, see [`answer`]. If only noise
    /// is left, a law cannot be much better.
    pub(super) fn is_open(&self, equations: &[&str], is_hidden: bool) -> bool {
        let may_tie = self.are_sensors || self.effects > 1;
        !self.is_noise || may_tie || (is_hidden && self.are_terms(equations))
    }

    /// Whether all change one of these equations.
    fn are_terms(&self, equations: &[&str]) -> bool {
        self.targets.iter().all(|target| equations.contains(&&**target))
    }

    /// Σ ε² + k ln N of the training recordings, after a fit as long as that of a law.
    fn cost(&self, data: &SearchData<'_>) -> f64 {
        let finished = self.fitted.continued(&data.not_kept(), EVALUATIONS);
        finished.map_or(f64::INFINITY, |one| one.criterion()).min(self.fitted.criterion())
    }
}

/// Laws that leave only noise.
pub(super) struct SufficientLaws {
    /// Those that the validation recordings confirm, the best first.
    pub(super) laws: Vec<FittedTerms>,
    /// Whether there is a plain one that they do not confirm.
    pub(super) is_unconfirmed: bool,
}

impl LawSearch<'_> {
    /// The laws that leave only noise, the best first.
    pub(super) fn leaving_noise(
        &self,
        mut all: Vec<FittedTerms>,
        search: &EffectSearch<'_>,
    ) -> SufficientLaws {
        all.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
        all.retain(|one| one.is_significant() && search.fits(&one.fitted));
        let mut distinct: Vec<FittedTerms> = Vec::new();
        for one in all {
            if !distinct.iter().any(|better| one.has_terms_of(better)) {
                distinct.push(one);
            }
        }
        distinct.truncate(HELD_OUT);
        for one in &mut distinct {
            one.fitted.know_correlations(self.data);
            one.fitted.hold_out(self.data, EVALUATIONS);
        }
        let (mut kept, lost): (Vec<FittedTerms>, Vec<FittedTerms>) =
            distinct.into_iter().partition(|one| search.validates(&one.fitted));
        // A rejected law that does better in both kinds of recordings leaves a worse one unproved.
        let held_out = |one: &FittedTerms| one.fitted.held_out_error(self.data);
        kept.retain(|one| {
            let is_better = |other: &FittedTerms| {
                other.cost() + RIVAL < one.cost() && held_out(other) < held_out(one)
            };
            !lost.iter().any(is_better)
        });
        let is_unconfirmed = lost.iter().any(FittedTerms::is_plain);
        SufficientLaws { laws: kept, is_unconfirmed }
    }
}

/// The answer, from laws that explain the recordings, the best first, for a model with these equations. `is_hidden`:
/// there are more equations than outputs, so that one may replace another.
///
/// If all states are read, a plant cannot be distinguished from its sensor, and the plant comes first. Otherwise a law
/// that explains the recordings as well as a sensor does is a rival of it.
pub(super) fn answer(
    laws: Vec<FittedTerms>,
    named: Option<&NamedTemplates<'_>>,
    data: &SearchData<'_>,
    equations: &[&str],
    is_hidden: bool,
) -> LawAnswer {
    let Some(least) = laws.first().map(FittedTerms::cost) else { return LawAnswer::Nothing };
    let mut rest = plainest_first(laws, data);
    let best = rest.remove(0);
    let named = named.map(|named| (named, named.cost(data)));
    let beats = |(named, cost): &(&NamedTemplates<'_>, f64)| {
        let is_tied = named.are_sensors && !is_hidden;
        let is_plainer = best.targets().len() < named.effects;
        least
            < cost
                + if is_tied {
                    RIVAL
                } else if is_plainer {
                    0.0
                } else {
                    -BETTER
                }
    };
    if let Some((named, cost)) = named.filter(|named| !beats(named)) {
        let is_elsewhere = |law: &FittedTerms| {
            law.cost() < cost + RIVAL
                && law.targets().iter().any(|target| !named.targets.contains(*target))
        };
        let laws = || std::iter::once(&best).chain(&rest);
        let may_be_elsewhere = is_hidden && (named.are_terms(equations) || named.are_sensors);
        let is_doubted = may_be_elsewhere && laws().any(is_elsewhere);
        return if is_doubted {
            LawAnswer::Doubt(rivals(laws(), cost))
        } else {
            LawAnswer::Nothing
        };
    }
    let is_rival = |other: &FittedTerms| {
        other.cost() - least < RIVAL && !best.targets().is_subset(&other.targets())
    };
    if rest.iter().any(is_rival) {
        return LawAnswer::Doubt(rivals(std::iter::once(&best).chain(&rest), least));
    }
    let error = |one: &FittedTerms| one.fitted.error.0;
    let near = rest.iter().take(NEAR);
    let near = near.map(|other| (other.formula(), (error(other) / error(&best)).sqrt())).collect();
    LawAnswer::Law(Box::new(AnsweringLaw { inserted: best, near }))
}

/// Laws, the best first; of those of the same equations that the recordings hardly distinguish, the plainest comes
/// first. Validation recordings count as well, because a superfluous factor of a law follows the training recordings.
fn plainest_first(laws: Vec<FittedTerms>, data: &SearchData<'_>) -> Vec<FittedTerms> {
    // The criterion with the validation recordings, and all squares.
    let weighed = |law: FittedTerms| {
        let held_out = law.fitted.held_out_error(data);
        (law.cost() + held_out, law.fitted.error.0 + held_out, law)
    };
    let mut left: Vec<(f64, f64, FittedTerms)> = laws.into_iter().map(weighed).collect();
    let mut ordered = Vec::new();
    while !left.is_empty() {
        let targets: BTreeSet<String> =
            left[0].2.targets().into_iter().map(ToOwned::to_owned).collect();
        let is_there =
            |law: &FittedTerms| law.targets().into_iter().eq(targets.iter().map(String::as_str));
        let (mut own, others): (Vec<_>, Vec<_>) =
            left.into_iter().partition(|(_, _, law)| is_there(law));
        let least = own.iter().map(|one| one.0).fold(f64::INFINITY, f64::min);
        let alike = |one: &(f64, f64, FittedTerms)| one.0 <= least + RIVAL.max(RESOLVED * one.1);
        let alike = own.iter().enumerate().filter(|(_, one)| alike(one));
        let plainest = alike.min_by_key(|(_, (_, _, law))| law.complexity());
        let plainest = plainest.map_or(0, |(position, _)| position);
        ordered.push(own.remove(plainest).2);
        ordered.extend(own.into_iter().map(|(_, _, law)| law));
        left = others;
    }
    ordered
}

/// The best law in each set of equations, of those that explain the recordings as well as the best answer does.
fn rivals<'a>(laws: impl Iterator<Item = &'a FittedTerms>, cost: f64) -> Vec<FittedTerms> {
    let mut rivals: Vec<FittedTerms> = Vec::new();
    for law in laws.filter(|law| law.cost() < cost + RIVAL) {
        if !rivals.iter().any(|better| better.targets().is_subset(&law.targets())) {
            rivals.push(law.clone());
        }
    }
    rivals
}

impl FittedTerms {
    /// Whether no equation lacks more than one term.
    pub(super) fn has_one_term_each(&self) -> bool {
        self.terms(&self.fitted).len() == self.targets().len()
    }

    /// Whether it has few enough terms not to follow just any recording.
    pub(super) fn is_plain(&self) -> bool {
        self.terms(&self.fitted).len() <= PLAIN
    }

    /// Whether the recordings determine all coefficients.
    fn is_significant(&self) -> bool {
        self.terms(&self.fitted).iter().all(|term| {
            let coefficient = &term.coefficients[0];
            coefficient.std.is_some_and(|std| coefficient.value.abs() > SIGNIFICANT * std)
        })
    }
}
