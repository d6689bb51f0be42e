//! Recordings that differ: the model explains each of them, with its own value of a number, offset of a sensor or rate
//! of the clock, but not all of them together.
//!
//! ```text
//!   the base model fitted to each recording alone: which does it explain?
//!     ─► all:   each parameter that is estimated, with its own value in each recording
//!     ─► one:   each value that is not estimated, as declared in that recording, and estimated in each of the others
//!     ─► values that are alike become one, and the fit is repeated
//! ```

use std::sync::Arc;

use dgd_runtime::parallel::in_parallel;

use super::groups::{DifferingValue, RecordingGroups};
use super::numbers;
use super::own_values::with_own;
use super::search::PlainSearch;
use super::suspicion::{FittedSuspicion, SuspectModel, Suspicion};
use super::trial::EVALUATIONS;
use crate::fit::{FittedStructure, SearchData, StartPoint, cost_at, whitened_square};
use crate::library::{CarriedValues, StructureId};
use crate::search::EffectSearch;

/// Number of recordings that are tried as the one with the declared value: at most one of two is unlike all others.
const REFERENCES: usize = 2;

impl PlainSearch<'_> {
    /// Differences between recordings that leave only noise, the likeliest first.
    pub(super) fn differing(&self, search: &EffectSearch<'_>) -> Vec<FittedSuspicion> {
        if self.data.train.len() < 2 || self.data.is_over() {
            return Vec::new();
        }
        let alone = self.alone(search);
        let suspects = self.differences(&alone);
        let finished =
            self.finished(&suspects, |plain, suspect| plain.begun_apart(suspect, &alone));
        let mut causes: Vec<FittedSuspicion> =
            finished.iter().filter_map(|cause| self.with_groups(cause)).collect();
        causes.retain_mut(|one| {
            self.is_gain(search, one) && self.is_told_apart(one) && validates(search, one)
        });
        causes
    }

    /// Whether the recordings distinguish all groups.
    fn is_told_apart(&self, cause: &FittedSuspicion) -> bool {
        let Suspicion::Recordings(difference) = &cause.suspicion else { return false };
        let data = cause.data(self.data).not_kept();
        let is_apart = |(_, apart): (Vec<usize>, Vec<bool>)| apart.iter().all(|apart| *apart);
        !difference.is_at_bound(&cause.fitted)
            && difference.ranked(&cause.fitted, &data).is_some_and(is_apart)
    }

    /// The base model fitted to each recording alone; `None` if it does not explain the recording.
    fn alone(&self, search: &EffectSearch<'_>) -> Vec<Option<CarriedValues>> {
        let PlainSearch { base, model, fitted, names, data, threads } = *self;
        let (of, seed) = (search.base, search.seed);
        in_parallel(fitted, data.train.len(), threads, |fitted, r| {
            let plain = PlainSearch { base, model, fitted, names, data, threads };
            if data.is_over() {
                return None;
            }
            let data_alone = SearchData {
                train: &data.train[r..=r],
                valid: &[],
                counts_from: Vec::new(),
                ..data.not_kept()
            };
            let starts = fitted.values.starts.get(r).cloned().into_iter().collect();
            let from = CarriedValues { p: fitted.values.p.clone(), starts };
            let points: Vec<StartPoint> = (plain.known(&fitted.structure).into_iter())
                .map(|point| {
                    let mut start = StartPoint::default();
                    start.set(point.into_iter());
                    start
                })
                .collect();
            let alone = FittedStructure::new(
                fitted.structure.clone(),
                &from,
                &points,
                &data_alone,
                EVALUATIONS,
            );
            let alone = alone.ok()?;
            let explains = EffectSearch::new(of, &[], data_alone, 1, seed).leaves_nothing(&alone);
            explains.then_some(alone.values)
        })
    }

    fn differences(&self, alone: &[Option<CarriedValues>]) -> Vec<SuspectModel> {
        let PlainSearch { base, model, fitted, data, .. } = *self;
        let count = data.train.len();
        let mut differences = Vec::new();
        let (estimated, held): (Vec<_>, Vec<_>) =
            numbers::all(base, model).into_iter().partition(|number| number.is_estimated(fitted));
        if alone.iter().all(Option::is_some) {
            let differing = |number| (DifferingValue::Number(number, true), (0..count).collect());
            differences.extend(estimated.into_iter().map(differing));
        }
        let outputs = model.outputs.iter().zip(&data.noise);
        let offsets = outputs.filter(|(_, noise)| noise.is_some()).map(|(own, _)| {
            DifferingValue::Offset(own.declared.name.clone(), own.declared.unit.clone())
        });
        let held_numbers = held.into_iter().map(|number| DifferingValue::Number(number, false));
        let unestimated: Vec<DifferingValue> =
            held_numbers.chain(offsets).chain(std::iter::once(DifferingValue::Clock)).collect();
        for reference in (0..count.min(REFERENCES)).filter(|r| alone[*r].is_some()) {
            let groups = |r: usize| match r {
                r if r == reference => 0,
                r if r < reference => r + 1,
                r => r,
            };
            differences.extend(
                unestimated.iter().map(|own| (own.clone(), (0..count).map(groups).collect())),
            );
        }
        let suspects = differences.into_iter().filter_map(|(own, train)| self.apart(own, train));
        suspects.enumerate().map(|(position, one)| SuspectModel { position, ..one }).collect()
    }

    /// Recordings in these groups, each group with its own value.
    fn apart(&self, own: DifferingValue, train: Vec<usize>) -> Option<SuspectModel> {
        let PlainSearch { base, data, names: [called, _], .. } = *self;
        let groups = train.iter().max()? + 1;
        let name = |group: usize| {
            let of_group = train.iter().zip(called).filter(|(own, _)| **own == group);
            let members: Vec<&str> = of_group.map(|(_, name)| &**name).collect();
            own.called(&members.join(", "))
        };
        let names: Vec<String> = (1..groups).map(name).collect();
        let base = with_own(base, &own, &names)?;
        let valid = vec![0; data.valid.len()];
        let difference = RecordingGroups { own, train, valid, names };
        let structure = base.structure(&[], StructureId::BASE).ok()?;
        let changed = difference.changed(&structure, data)?;
        Some(SuspectModel {
            position: 0,
            suspicion: Suspicion::Recordings(difference),
            base: Some(base),
            changed: Some(Arc::new(changed)),
        })
    }

    /// A fit that begins at the fit of the base model to all recordings, or at those to each alone, whichever is
    /// better.
    fn begun_apart(
        &self,
        suspect: &SuspectModel,
        alone: &[Option<CarriedValues>],
    ) -> Option<FittedSuspicion> {
        let Suspicion::Recordings(difference) = &suspect.suspicion else { return None };
        let structure = self.structure(suspect)?;
        let data = suspect.data(self.data).not_kept();
        let reference = difference.train.iter().position(|group| *group == 0)?;
        let together = self.fitted.values.clone();
        let mut apart = alone[reference].clone().unwrap_or_default();
        apart.starts.clone_from(&together.starts);
        for (starts, own) in apart.starts.iter_mut().zip(alone) {
            if let Some(own) = own.as_ref().and_then(|own| own.starts.first()) {
                starts.clone_from(own);
            }
        }
        let mut points = [together, apart];
        for (group, name) in difference.parameters().enumerate() {
            let (Some(name), Some(number)) = (name, difference.own.of_first()) else { continue };
            let first = difference.train.iter().position(|own| *own == group)?;
            let value = alone[first].as_ref().and_then(|own| own.p.get(number)).copied();
            let adapted = points[0].p.get(number).copied();
            points[0].p.extend(adapted.map(|value| (name.to_owned(), value)));
            points[1].p.extend(value.map(|value| (name.to_owned(), value)));
        }
        let costs = points.each_ref().map(|point| cost_at(&structure, point, &data));
        let from = &points[usize::from(costs[1] < costs[0])];
        let points = [StartPoint::default()];
        suspect.fitted(structure, from, &points, &data)
    }

    /// The cause with one value for recordings that are alike in it; `None` if all are.
    fn with_groups(&self, cause: &FittedSuspicion) -> Option<FittedSuspicion> {
        let Suspicion::Recordings(difference) = &cause.suspicion else { return None };
        let data = cause.data(self.data).not_kept();
        let (order, apart) = difference.ranked(&cause.fitted, &data)?;
        let mut clusters = vec![0; order.len()];
        for (k, group) in order.iter().enumerate() {
            clusters[*group] = apart[..k].iter().filter(|apart| **apart).count();
        }
        let count = 1 + apart.iter().filter(|apart| **apart).count();
        if count == 1 {
            return None;
        }
        if count == order.len() {
            return Some(cause.clone());
        }
        // The first group stays the first, and the others are in the order of the recordings.
        let mut known = vec![clusters[0]];
        for group in &difference.train {
            if !known.contains(&clusters[*group]) {
                known.push(clusters[*group]);
            }
        }
        let place = |group: &usize| known.iter().position(|cluster| *cluster == clusters[*group]);
        let train = difference.train.iter().map(place).collect::<Option<Vec<usize>>>()?;
        let suspect = self.apart(difference.own.clone(), train)?;
        let Suspicion::Recordings(grouped) = &suspect.suspicion else { return None };
        let mut from = cause.fitted.values.clone();
        let values = difference.values(&cause.fitted);
        for (new, name) in grouped.parameters().enumerate() {
            let old = (0..clusters.len()).find(|old| clusters[*old] == known[new])?;
            from.p.extend(name.map(|name| (name.to_owned(), values[old].0)));
        }
        let data = suspect.data(self.data).not_kept();
        let structure = self.structure(&suspect)?;
        let begun = suspect.fitted(structure, &from, &[StartPoint::default()], &data)?;
        let fitted = begun.fitted.continued(&data, EVALUATIONS).unwrap_or(begun.fitted);
        Some(FittedSuspicion { position: cause.position, fitted, ..begun })
    }
}

/// Finds the group that each validation recording resembles. Returns whether only noise is left there, too.
fn validates(search: &EffectSearch<'_>, cause: &mut FittedSuspicion) -> bool {
    let Suspicion::Recordings(difference) = &cause.suspicion else { return false };
    let count = search.data.valid.len();
    let mut best = vec![(f64::INFINITY, 0); count];
    if count > 0 {
        for group in 0..=difference.names.len() {
            let one = RecordingGroups { valid: vec![group; count], ..difference.clone() };
            let Some(changed) = one.changed(&cause.fitted.structure, &search.data) else {
                return false;
            };
            let data = changed.data(&search.data).not_kept();
            let mut fitted = cause.fitted.clone();
            fitted.hold_out(&data, EVALUATIONS);
            let Some(left) = fitted.held_out_residuals(&data) else { continue };
            for (r, best) in best.iter_mut().enumerate() {
                let only_this = r..=r;
                let left =
                    whitened_square(&data.valid[only_this.clone()], &left[only_this], &data.noise)
                        .0;
                if left < best.0 {
                    *best = (left, group);
                }
            }
        }
    }
    let valid = best.into_iter().map(|(_, group)| group).collect();
    let difference = RecordingGroups { valid, ..difference.clone() };
    let Some(changed) = difference.changed(&cause.fitted.structure, &search.data) else {
        return false;
    };
    cause.changed = Some(Arc::new(changed));
    cause.suspicion = Suspicion::Recordings(difference);
    cause.explains(search)
}
