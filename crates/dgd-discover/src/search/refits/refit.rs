//! Fits structures from given starting points, several at a time.

use std::collections::BTreeMap;

use dgd_runtime::parallel::in_parallel_stateless;

use crate::fit::{FittedStructure, NoFit, StartPoint};
use crate::library::{CarriedValues, StructureId};
use crate::search::effort::EVALUATIONS;
use crate::search::tried::EffectSearch;

/// When to simulate validation recordings with a structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ValidationUse {
    /// Together with its fit.
    Now,
    /// Once it may be the best.
    Later,
}

/// A structure to fit, and its starting points.
#[derive(Debug, Clone)]
pub(crate) struct RefitRequest {
    pub(crate) structure: StructureId,
    /// Initial values.
    pub(crate) from: CarriedValues,
    pub(crate) points: Vec<StartPoint>,
}

/// Maximum numbers of simulations in the rounds of fits to the end. The first round is short: it shows which ones
/// approach the noise.
pub(super) const ROUNDS: [usize; 4] = [EVALUATIONS / 4, EVALUATIONS, EVALUATIONS, EVALUATIONS];

/// A fit that still leaves this multiple of the noise after the stages is abandoned.
pub(super) const HOPELESS: f64 = 10.0;

/// A fit continues while a round reduces the error to less than this fraction: one that gains hardly anything in that
/// many simulations will not improve much.
const GOES_ON: f64 = 0.99;

/// Factor by which fits approach the minimum faster later than at first.
const SPEEDS_UP: f64 = 2.0;

impl EffectSearch<'_> {
    /// Fits structures, several at a time.
    pub(crate) fn refit(
        &mut self,
        wanted: Vec<RefitRequest>,
        evaluations: usize,
        held_out: ValidationUse,
    ) {
        let (base, candidates, data) = (self.base, self.candidates, &self.data);
        let structures: Vec<StructureId> = wanted.iter().map(|wanted| wanted.structure).collect();
        let before = self.training_sums(&structures);
        let count = data.keeping.count("structures fitted", wanted.len());
        let results = in_parallel_stateless(wanted.len(), self.threads, |k| {
            let RefitRequest { structure, from, points } = &wanted[k];
            if data.is_spent() {
                return Err(NoFit::NotTried(data.not_tried()));
            }
            let structure = base.structure(candidates, *structure).map_err(NoFit::Invalid)?;
            let fitted = FittedStructure::new(structure, from, points, data, evaluations);
            count.more(1);
            let mut fitted = fitted?;
            if held_out == ValidationUse::Now {
                fitted.hold_out(data, evaluations);
            }
            Ok(fitted)
        });
        for (wanted, result) in wanted.into_iter().zip(results) {
            // If there is no time to continue, the earlier fit stands.
            if result.is_err() && data.is_spent() && self.fitted(wanted.structure).is_some() {
                continue;
            }
            self.tried.insert(wanted.structure, result);
        }
        for (structure, before) in before {
            if self.is_lost(structure, before, evaluations) {
                self.lost.insert(structure);
            } else {
                self.lost.remove(&structure);
            }
            let is_round = evaluations >= ROUNDS[0];
            if is_round && self.training_sum(structure) >= GOES_ON * before {
                self.at_rest.insert(structure);
            } else {
                self.at_rest.remove(&structure);
            }
        }
    }

    /// Simulates validation recordings with some structures.
    pub(crate) fn hold_out(&mut self, structures: &[StructureId]) {
        for structure in structures {
            if let Some(Ok(fitted)) = self.tried.get_mut(structure)
                && fitted.valid.is_none()
            {
                fitted.hold_out(&self.data, EVALUATIONS);
            }
        }
    }

    /// Σ ε² of the training recordings that structures leave; before their first fit, that of the base model.
    fn training_sums(&self, structures: &[StructureId]) -> BTreeMap<StructureId, f64> {
        let of_base = self.training_sum(StructureId::BASE);
        let sum_of = |one: &StructureId| {
            let error = self.training_error(*one).map(|(sum, _)| sum);
            (*one, error.unwrap_or(of_base))
        };
        structures.iter().map(sum_of).collect()
    }

    /// Whether a fit that left `before` ahead of a round of `evaluations` simulations would, at this rate, still be far
    /// from the noise after twice as many as a fit may take.
    fn is_lost(&self, structure: StructureId, before: f64, evaluations: usize) -> bool {
        self.training_error(structure).is_some_and(|(now, n)| {
            let rounds = SPEEDS_UP * EVALUATIONS as f64 / evaluations as f64;
            now * (now / before).powf(rounds) > HOPELESS * n as f64
        })
    }

    /// A structure to be fitted from the end point of its fit.
    pub(crate) fn continued(&self, structure: StructureId) -> RefitRequest {
        let points = vec![StartPoint::default()];
        RefitRequest { structure, from: self.values(structure), points }
    }
}
