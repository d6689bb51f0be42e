//! Whether plain causes are the answer.

use super::column_fault::{ColumnFault, between};
use super::search::PlainSearch;
use super::suspicion::{FittedSuspicion, Suspicion};
use super::trial::EVALUATIONS;
use super::{columns, numbers, own_values, starts};
use crate::fit::{FittedStructure, SearchData, VERY_STRONG, chi_square, mean};
use crate::library::StructureId;
use crate::search::{Alternative, EffectSearch, JudgedOutcome};
use dgd_runtime::signature::number::{short, with_unit};

/// Causes whose criteria differ by less cannot be distinguished.
const RIVAL: f64 = VERY_STRONG;
/// A cause comes before an effect of the library only if its criterion is lower by this: the threshold of a further
/// effect.
const BETTER: f64 = 3.0 * VERY_STRONG;

/// Whether plain causes are the answer.
#[derive(Debug)]
pub(crate) enum PlainAnswer {
    /// No plain cause.
    Nothing,
    /// An effect of the library keeps its name, and these explain the recordings as well.
    Beside(Vec<Alternative>),
    /// They come first.
    First(Box<AnsweringCauses>),
}

/// Plain causes that are an answer.
#[derive(Debug)]
pub(crate) struct AnsweringCauses {
    /// The cause, then its twins, which the recordings cannot distinguish from it.
    pub(crate) all: Vec<FittedSuspicion>,
    /// Effects that the recordings cannot distinguish from it either.
    pub(crate) effects: Vec<String>,
    /// Whether it leaves nothing that tests distinguish from noise.
    pub(crate) is_white: bool,
    /// Σ ε² + k ln N of the training recordings.
    pub(crate) cost: f64,
}

impl AnsweringCauses {
    /// Whether it remains the answer if there is a law with this cost.
    pub(crate) fn holds_against(&self, law: f64) -> bool {
        if self.are_of_recordings() { self.cost + RIVAL < law } else { self.cost < law + RIVAL }
    }

    /// Whether recordings differ, which a law may explain with one value for all.
    pub(crate) fn are_of_recordings(&self) -> bool {
        self.all.iter().all(|one| matches!(one.suspicion, Suspicion::Recordings(_)))
    }
}

impl PlainSearch<'_> {
    /// The answer, given the outcome of the search for effects.
    pub(crate) fn answer(&self, search: &EffectSearch<'_>, outcome: JudgedOutcome) -> PlainAnswer {
        let named = outcome.structure();
        let is_generic = named.effects().all(|effect| search.candidates[effect].is_generic);
        match self.one_for_all(search, named, is_generic) {
            PlainAnswer::Nothing if is_generic => self.one_for_each(search, named),
            answer => answer,
        }
    }

    /// Causes that leave only noise, the likeliest first. Beside an effect of the library that explains the recordings,
    /// only numbers are tried: they may be its twins.
    fn search(&self, search: &EffectSearch<'_>, is_explained: bool) -> Vec<FittedSuspicion> {
        let mut suspects = numbers::suspects(self.base, self.model, self.fitted);
        if !is_explained {
            suspects.extend(starts::suspects(self.base, self.model, self.fitted));
            suspects.extend(own_values::rate(self.base));
            suspects.extend(self.likeliest(columns::suspects(self)));
        }
        for (position, suspect) in suspects.iter_mut().enumerate() {
            suspect.position = position;
        }
        self.explaining(search, &suspects)
    }

    /// Recordings that differ, if templates do not explain them about as well with one value for all.
    fn one_for_each(&self, search: &EffectSearch<'_>, named: StructureId) -> PlainAnswer {
        let mut causes = self.differing(search);
        let criterion = FittedSuspicion::criterion;
        let Some(best) = causes.iter().map(criterion).reduce(f64::min) else {
            return PlainAnswer::Nothing;
        };
        causes.retain(|one| criterion(one) < best + RIVAL);
        causes.sort_by_key(|one| (criterion(one) > best + search.thresholds.even, one.position));
        let of_named = self.cost_of(search, named).filter(|(_, explains)| *explains);
        if of_named.is_some_and(|(cost, _)| cost <= best + RIVAL) {
            return PlainAnswer::Nothing;
        }
        self.first(search, causes, Vec::new(), best)
    }

    /// The criterion of named effects after a fit as long as that of a cause, and whether they explain the recordings.
    fn cost_of(&self, search: &EffectSearch<'_>, named: StructureId) -> Option<(f64, bool)> {
        let fitted = search.fitted(named).filter(|_| !named.is_base())?;
        let finished = fitted.continued(&self.data.not_kept(), EVALUATIONS);
        let cost = finished.map_or(f64::INFINITY, |one| one.criterion());
        Some((cost.min(fitted.criterion()), search.leaves_nothing(fitted)))
    }

    /// Causes with one value for all recordings.
    fn one_for_all(
        &self,
        search: &EffectSearch<'_>,
        named: StructureId,
        is_generic: bool,
    ) -> PlainAnswer {
        let is_explained = !is_generic && search.explains(named);
        let mut causes = self.search(search, is_explained);
        let criterion = FittedSuspicion::criterion;
        let Some(best) = causes.iter().map(criterion).reduce(f64::min) else {
            return PlainAnswer::Nothing;
        };
        causes.retain(|one| criterion(one) < best + RIVAL);
        // In the order of the text if only rounding distinguishes them.
        causes.sort_by_key(|one| {
            (one.rank(criterion(one) > best + search.thresholds.even), one.position)
        });
        let explained =
            self.cost_of(search, named).filter(|(_, explains)| *explains).map(|(cost, _)| cost);
        match explained {
            Some(of_named) if !is_generic && best >= of_named - BETTER => {
                causes.retain(|one| criterion(one) < of_named + RIVAL);
                let is_one = named.len() == 1 && !causes.is_empty();
                if is_one {
                    PlainAnswer::Beside(self.beside(search, named, &causes))
                } else {
                    PlainAnswer::Nothing
                }
            }
            Some(of_named) if is_generic && best >= of_named + RIVAL => PlainAnswer::Nothing,
            // A sensor is wrong more often than a constant of nature.
            Some(_) if is_generic && causes.iter().all(FittedSuspicion::is_well_known) => {
                PlainAnswer::Nothing
            }
            _ => {
                let is_tied = explained.is_some_and(|of_named| of_named < best + RIVAL);
                let effects = if is_tied { effects(search, named) } else { Vec::new() };
                self.first(search, causes, effects, best)
            }
        }
    }

    fn first(
        &self,
        search: &EffectSearch<'_>,
        all: Vec<FittedSuspicion>,
        effects: Vec<String>,
        cost: f64,
    ) -> PlainAnswer {
        let first = &all[0];
        let data = first.data(self.data).not_kept();
        let residuals = first.fitted.residuals(&data);
        let changed_search = EffectSearch::new(search.base, &[], data.clone(), 1, search.seed);
        let is_white = changed_search.leaves_noise(&residuals, &data.noise);
        PlainAnswer::First(Box::new(AnsweringCauses { all, effects, is_white, cost }))
    }

    /// Causes as alternatives to an effect.
    fn beside(
        &self,
        search: &EffectSearch<'_>,
        named: StructureId,
        all: &[FittedSuspicion],
    ) -> Vec<Alternative> {
        let square = |fitted: &FittedStructure, data: &SearchData<'_>| {
            let sum = |all: Vec<Vec<Vec<f64>>>| mean(&chi_square(&all, &data.noise));
            let held_out = fitted.held_out_residuals(data).and_then(sum);
            held_out.or_else(|| sum(fitted.residuals(data)))
        };
        let named_square = search.fitted(named).and_then(|fitted| square(fitted, self.data));
        let alternative = |one: &FittedSuspicion| {
            let ratio = square(&one.fitted, &one.data(self.data))
                .zip(named_square)
                .map_or(f64::NAN, |(square, named_square)| square / named_square);
            Alternative { name: one.words(), form: None, valid_ratio: ratio.sqrt() }
        };
        all.iter().map(alternative).collect()
    }
}

impl FittedSuspicion {
    /// Its rank: well-known constants come last, then less likely causes.
    fn rank(&self, is_less_likely: bool) -> (bool, bool) {
        match &self.suspicion {
            Suspicion::Number(number) => (number.is_well_known(), is_less_likely),
            _ => (false, is_less_likely),
        }
    }

    fn is_well_known(&self) -> bool {
        matches!(&self.suspicion, Suspicion::Number(number) if number.is_well_known())
    }

    /// Its description with its value.
    fn words(&self) -> String {
        match &self.suspicion {
            Suspicion::Number(number) => {
                let value = self.fitted.values.p.get(&number.name).copied().unwrap_or(f64::NAN);
                let shown = short(number.unit.from_si(value), 4);
                format!("`{}` of {}", number.name, with_unit(shown, &number.unit.symbol))
            }
            Suspicion::Column(ColumnFault::Unit { name, meant_in, .. }) => {
                format!("column `{name}` in {}", meant_in.symbol)
            }
            Suspicion::Column(ColumnFault::Exchanged([one, other])) => {
                format!("columns `{one}` and `{other}` exchanged")
            }
            Suspicion::Column(ColumnFault::Between { name, is }) => {
                format!("`{name}` as {}", between(*is))
            }
            Suspicion::Column(ColumnFault::Stuck { name, .. }) => format!("column `{name}` stuck"),
            Suspicion::Column(ColumnFault::Clock { meant_in }) => {
                format!("times in {}", meant_in.symbol)
            }
            Suspicion::Start(held) => format!("another start of `{}`", held.state),
            Suspicion::Rate => "another rate of the clock".to_owned(),
            // Never an alternative to an effect of the library.
            Suspicion::Recordings(_) => "recordings that differ".to_owned(),
        }
    }
}

/// The effects of a structure, each with its alternatives.
fn effects(search: &EffectSearch<'_>, named: StructureId) -> Vec<String> {
    if named.len() != 1 {
        return Vec::new();
    }
    let names_of = |effect: usize| {
        let others = search.replacements(named, effect).others.into_iter();
        std::iter::once(search.called(effect)).chain(others.map(|other| other.alternative.name))
    };
    named.effects().flat_map(names_of).collect()
}
