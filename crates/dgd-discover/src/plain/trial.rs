//! Fits of suspects.

use dgd_runtime::System;
use dgd_runtime::parallel::in_parallel;

use super::model_number::{ModelNumber, SIGNIFICANT};
use super::own_values::RATE;
use super::search::PlainSearch;
use super::suspicion::{FittedSuspicion, SuspectModel, Suspicion};
use crate::fit::{FittedStructure, SearchData, StartPoint, cost_at};
use crate::library::{CarriedValues, ModelStructure, StructureId};
use crate::search::EffectSearch;

/// Maximum number of simulations of a fit that begins, and of one that is finished.
const BEGINNING: usize = 6;
pub(super) const EVALUATIONS: usize = 60;
/// Number of faults of columns that are fitted.
const LIKELIEST: usize = 12;
/// Number of causes that are simulated in the validation recordings.
const HELD_OUT: usize = 12;
/// A fit that begins is finished if it leaves at most this fraction of the base model's excess over noise.
const PROMISING: f64 = 0.5;
/// It must also leave at most this many times as much as the best one, or as noise.
const HOPEFUL: f64 = 10.0;
/// Number of slips from which a number is fitted.
const SLIPS: usize = 2;
impl PlainSearch<'_> {
    /// The suspects that come nearest to their recordings without a fit.
    pub(super) fn likeliest(&self, suspects: Vec<SuspectModel>) -> Vec<SuspectModel> {
        let PlainSearch { base, model, names, data, threads, .. } = *self;
        let costs = in_parallel(self.fitted, suspects.len(), threads, |fitted, k| {
            let plain = PlainSearch { base, model, fitted, names, data, threads };
            if data.is_over() { f64::INFINITY } else { plain.cost_without_fit(&suspects[k]) }
        });
        let mut ranked: Vec<(f64, SuspectModel)> = costs.into_iter().zip(suspects).collect();
        ranked.retain(|(cost, _)| cost.is_finite());
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        ranked.truncate(LIKELIEST);
        ranked.into_iter().map(|(_, suspect)| suspect).collect()
    }

    fn cost_without_fit(&self, suspect: &SuspectModel) -> f64 {
        let Some(structure) = self.structure(suspect) else { return f64::INFINITY };
        let data = suspect.data(self.data);
        let adapted = self.fitted.values.clone();
        let declared = CarriedValues { starts: adapted.starts.clone(), ..CarriedValues::default() };
        // A fault of the recordings may have moved start values, too.
        let without_starts = CarriedValues { starts: Vec::new(), ..adapted.clone() };
        let points = [adapted, declared, without_starts, CarriedValues::default()];
        points.iter().map(|of| cost_at(&structure, of, &data)).fold(f64::INFINITY, f64::min)
    }

    pub(super) fn structure(&self, suspect: &SuspectModel) -> Option<ModelStructure> {
        match &suspect.base {
            Some(base) => base.structure(&[], StructureId::BASE).ok(),
            None => Some(self.fitted.structure.clone()),
        }
    }

    /// Causes that leave only noise, the likeliest first.
    pub(super) fn explaining(
        &self,
        search: &EffectSearch<'_>,
        suspects: &[SuspectModel],
    ) -> Vec<FittedSuspicion> {
        let mut finished = self.finished(suspects, begun);
        finished.retain_mut(|one| {
            self.is_gain(search, one) && one.is_believable() && one.explains(search)
        });
        finished
    }

    /// Fits of suspects that have begun well, the likeliest first.
    pub(super) fn finished(
        &self,
        suspects: &[SuspectModel],
        begin: impl Fn(&PlainSearch<'_>, &SuspectModel) -> Option<FittedSuspicion> + Sync,
    ) -> Vec<FittedSuspicion> {
        let PlainSearch { base, model, names, data, threads, .. } = *self;
        let begun = in_parallel(self.fitted, suspects.len(), threads, |fitted, k| {
            let plain = PlainSearch { base, model, fitted, names, data, threads };
            (!data.is_over()).then(|| begin(&plain, &suspects[k])).flatten()
        });
        let mut begun: Vec<FittedSuspicion> = begun.into_iter().flatten().collect();
        let least = begun.iter().map(|one| one.fitted.mean_square()).fold(f64::INFINITY, f64::min);
        begun.retain(|one| {
            self.is_promising(one) && one.fitted.mean_square() <= HOPEFUL * least.max(1.0)
        });
        let mut finished = in_parallel(&begun, begun.len(), threads, |begun, k| {
            let fitted = begun[k].fitted.continued(&begun[k].data(data).not_kept(), EVALUATIONS);
            let fitted = fitted.unwrap_or_else(|_| begun[k].fitted.clone());
            FittedSuspicion { fitted, ..begun[k].clone() }
        });
        finished.sort_by(|a, b| a.fitted.error.0.total_cmp(&b.fitted.error.0));
        finished.truncate(HELD_OUT);
        finished
    }

    /// Whether it leaves at most half of the base model's excess over noise.
    fn is_promising(&self, one: &FittedSuspicion) -> bool {
        one.fitted.mean_square() - 1.0 <= PROMISING * (self.fitted.mean_square() - 1.0)
    }

    /// Whether it lowers the criterion enough.
    pub(super) fn is_gain(&self, search: &EffectSearch<'_>, one: &FittedSuspicion) -> bool {
        let gain = self.fitted.criterion() - one.criterion();
        gain > search.thresholds.least_gain && self.is_promising(one)
    }

    /// Where fits of a number start: at its value, and at the likeliest of those that it would have in another unit or
    /// with its decimal point elsewhere. The rest of the model has not adapted to these, so that the first may seem
    /// better.
    fn elsewhere(
        &self,
        structure: &ModelStructure,
        number: &ModelNumber,
        data: &SearchData<'_>,
    ) -> Vec<StartPoint> {
        let with = |point: &[(String, f64)], value: f64| {
            let others = point.iter().filter(|(name, _)| *name != number.name).cloned();
            others.chain([(number.name.clone(), value)]).collect::<Vec<_>>()
        };
        let points = self.known(structure);
        let likeliest = |value: f64| {
            let variants = points.each_ref().map(|point| with(point, value));
            self.likeliest_of(structure, variants.into_iter(), data)
        };
        let (_, as_declared) = likeliest(number.declared);
        let slips = number.in_other_units().chain(number.with_other_powers());
        let mut slips: Vec<(f64, StartPoint)> = slips.map(likeliest).collect();
        slips.retain(|(cost, _)| cost.is_finite());
        slips.sort_by(|a, b| a.0.total_cmp(&b.0));
        let slips = slips.into_iter().take(SLIPS).map(|(_, point)| point);
        std::iter::once(as_declared).chain(slips).collect()
    }

    /// Where fits of other recordings start.
    fn as_declared(&self, structure: &ModelStructure, data: &SearchData<'_>) -> Vec<StartPoint> {
        vec![self.likeliest_of(structure, self.known(structure).into_iter(), data).1]
    }

    /// Parameters of the fitted base model, and those of the text: the former have adapted to the fault.
    pub(super) fn known(&self, structure: &ModelStructure) -> [Vec<(String, f64)>; 2] {
        let signature = structure.system.signature();
        let declared = signature.parameters.iter().map(|own| (own.name.to_string(), own.value));
        let adapted = self.fitted.values.p.iter().map(|(name, value)| (name.clone(), *value));
        [adapted.collect(), declared.collect()]
    }

    fn likeliest_of(
        &self,
        structure: &ModelStructure,
        all: impl Iterator<Item = Vec<(String, f64)>>,
        data: &SearchData<'_>,
    ) -> (f64, StartPoint) {
        let cost = |point: Vec<(String, f64)>| {
            let starts = self.fitted.values.starts.clone();
            let values = CarriedValues { p: point.iter().cloned().collect(), starts };
            (cost_at(structure, &values, data), point)
        };
        let best = all.map(cost).min_by(|a, b| a.0.total_cmp(&b.0));
        let (cost, point) = best.unwrap_or((f64::INFINITY, Vec::new()));
        let mut start = StartPoint::default();
        start.set(point.into_iter());
        (cost, start)
    }
}

/// A fit of a suspect that begins; `None` if it cannot be fitted.
fn begun(plain: &PlainSearch<'_>, suspect: &SuspectModel) -> Option<FittedSuspicion> {
    let structure = plain.structure(suspect)?;
    let data = suspect.data(plain.data).not_kept();
    let points = match &suspect.suspicion {
        Suspicion::Number(number) => plain.elsewhere(&structure, number, &data),
        _ => plain.as_declared(&structure, &data),
    };
    suspect.fitted(structure, &plain.fitted.values, &points, &data)
}

impl SuspectModel {
    /// A fit to its recordings that begins; `None` if that fails.
    pub(super) fn fitted(
        &self,
        structure: ModelStructure,
        from: &CarriedValues,
        points: &[StartPoint],
        data: &SearchData<'_>,
    ) -> Option<FittedSuspicion> {
        let fitted = FittedStructure::new(structure, from, points, data, BEGINNING).ok()?;
        let SuspectModel { position, suspicion, changed, .. } = self.clone();
        Some(FittedSuspicion { position, suspicion, fitted, changed })
    }
}

impl FittedSuspicion {
    /// Simulates the validation recordings. Returns whether only noise is left.
    pub(super) fn explains(&mut self, search: &EffectSearch<'_>) -> bool {
        let changed = self.changed.clone();
        let data =
            changed.as_ref().map_or_else(|| search.data.clone(), |own| own.data(&search.data));
        let data = data.not_kept();
        self.fitted.know_correlations(&data);
        self.fitted.hold_out(&data, EVALUATIONS);
        EffectSearch::new(search.base, &[], data, 1, search.seed).leaves_nothing(&self.fitted)
    }

    /// Whether the recordings determine the suspected value, and it differs from the declared one.
    fn is_believable(&self) -> bool {
        let (name, declared) = match &self.suspicion {
            Suspicion::Start(_) | Suspicion::Column(_) | Suspicion::Recordings(_) => return true,
            Suspicion::Number(number) => (&*number.name, number.declared),
            Suspicion::Rate => (RATE, 1.0),
        };
        let estimates = self.fitted.estimates.iter();
        let mut named = estimates.filter(|e| e.recording.is_none() && e.name == name);
        named.any(|estimate| {
            let off = (estimate.value - declared).abs();
            estimate.std.is_some_and(|std| off > SIGNIFICANT * std)
                && !self.fitted.is_at_bound(estimate)
        })
    }
}
