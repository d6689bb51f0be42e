//! Fits the best structures again from other values of the constants of their effects.
//!
//! If an effect has a kink, a jump or a moment, the misfit has several minima over its constants, and a fit ends in the
//! nearest. Each constant is moved over its range, the rest of the model adapts to it, and then everything is fitted.

use dgd_runtime::System;
use dgd_screen::usual_spacing;

use super::refit::{RefitRequest, ValidationUse};
use crate::fit::{FittedStructure, StartPoint, cost_at};
use crate::library::{CarriedValues, EffectCandidate, StructureId};
use crate::search::tried::EffectSearch;

/// Number of values of a constant, and of a moment, from which fits may begin.
const VALUES: usize = 6;
const MOMENTS: usize = 24;

/// Number of structures with one effect from which near forms are fitted.
const DONORS: usize = 3;

/// Number of multiples of half a sample interval to either side of a time between readings.
const TICKS: usize = 32;

/// Number of values that are worth a fit: those that leave least before it.
const WORTH_A_FIT: usize = 4;

/// Maximum number of simulations of a fit from elsewhere; half as many before it while the constant is held.
const EVALUATIONS: usize = 20;

/// Factor by which a constant without bounds is lowered and raised.
const FACTOR: f64 = 5.0;

/// Fraction of the misfit to which a fit from elsewhere must come for it to count as another minimum.
const ANOTHER: f64 = 0.999;

impl EffectSearch<'_> {
    /// Fits the best structure, and the best with one effect, from other values of their constants.
    pub(crate) fn try_elsewhere(&mut self) {
        let mut best = self.ranked();
        best.retain(|one| !one.is_base() && self.may_be_said(*one));
        let first = best.first().copied();
        let alone = best.iter().copied().find(|one| one.len() == 1);
        for one in [alone, first].into_iter().flatten() {
            // A structure is its own part here: it has been fitted from elsewhere.
            if self.settled.insert((one, one)) && !self.data.is_spent() {
                self.fit_from_elsewhere(one);
            }
        }
    }

    /// Fits near forms of the templates that do best, but leave more than noise, from where those ended, if they share
    /// a constant: a reading that is refreshed at intervals is late by half an interval on average, so the fit of such
    /// a form begins at that of a delay.
    pub(crate) fn try_forms_from_the_best(&mut self) {
        let mut best = self.ranked();
        best.retain(|one| !one.is_base() && self.may_be_said(*one));
        let Some(first) = best.first().copied().filter(|first| !self.explains(*first)) else {
            return;
        };
        // A form that does worse at the place of the best may have the constant.
        let alone = best.into_iter().filter(|one| one.len() == 1).take(DONORS);
        let alone: Vec<StructureId> = alone.collect();
        for whole in alone.into_iter().chain((first.len() > 1).then_some(first)) {
            for effect in whole.effects() {
                for near in self.range(self.open) {
                    let form = whole.without_candidate(effect).with_candidate(near);
                    let is_new = !whole.contains(near) && self.fitted(form).is_some();
                    if is_new && self.are_near(near, effect) && self.share_a_constant(near, effect)
                    {
                        self.settle(form, whole);
                        let candidate = &self.candidates[near];
                        let has_clock = candidate
                            .free_constants()
                            .iter()
                            .any(|own_name| candidate.is_clock(own_name));
                        if has_clock && self.settled.insert((form, form)) {
                            self.fit_from_elsewhere(form);
                        }
                    }
                }
            }
        }
    }

    /// Whether two candidates with the same arguments have a constant of the same name.
    fn share_a_constant(&self, one: usize, other: usize) -> bool {
        let [one_names, other_names] = [one, other].map(|c| self.candidates[c].free_constants());
        self.have_one_place(one, other) && one_names.iter().any(|name| other_names.contains(name))
    }

    fn fit_from_elsewhere(&mut self, structure: StructureId) {
        let points = self.points_elsewhere(structure);
        let Some(before) = self.tried.get(&structure).cloned().filter(|_| !points.is_empty())
        else {
            return;
        };
        let least = self.training_sum(structure);
        let wanted = RefitRequest { structure, from: self.values(structure), points };
        self.refit(vec![wanted], EVALUATIONS, ValidationUse::Later);
        let is_better =
            self.fitted(structure).is_some() && self.training_sum(structure) < ANOTHER * least;
        if !is_better {
            self.tried.insert(structure, before);
            return;
        }
        self.screens.retain(|(_, known), _| *known != structure);
        self.finish(&[structure]);
    }

    /// Values of the constants of its effects that may lead to another minimum: those at which the misfit has one while
    /// the rest stays, then others, the better ones first.
    fn points_elsewhere(&self, structure: StructureId) -> Vec<StartPoint> {
        let Some(fitted) = self.fitted(structure) else { return Vec::new() };
        let mut points: Vec<(bool, f64, StartPoint)> = Vec::new();
        for (effect, brought) in structure.effects().zip(&fitted.structure.brought) {
            let candidate = &self.candidates[effect];
            if !(candidate.has_kink() || candidate.has_inner || candidate.brings_unknowns) {
                continue;
            }
            for name in &brought.parameters {
                let of_effect = brought.names.iter().find(|(_, new)| new == name);
                let of_effect = of_effect.map_or("", |(of_effect, _)| of_effect.as_str());
                let grid = self.grid(candidate, of_effect, fitted, name);
                let cost = |at: &f64| {
                    let mut values: CarriedValues = fitted.values.clone();
                    values.p.insert(name.clone(), *at);
                    cost_at(&fitted.structure, &values, &self.data)
                };
                let costs: Vec<f64> = grid.iter().map(cost).collect();
                let is_less = |k: usize, other: Option<usize>| {
                    other.and_then(|other| costs.get(other)).is_none_or(|other| costs[k] < *other)
                };
                for (k, at) in grid.iter().enumerate().filter(|(k, _)| costs[*k].is_finite()) {
                    let is_least = is_less(k, k.checked_sub(1)) && is_less(k, Some(k + 1));
                    let values = vec![(name.clone(), *at)];
                    let (at_nothing, held) = (values.clone(), vec![name.clone()]);
                    let point = StartPoint { values, at_nothing, held, ..StartPoint::default() };
                    points.push((!is_least, costs[k], point));
                }
            }
        }
        points.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        points.truncate(WORTH_A_FIT);
        points.into_iter().map(|(.., point)| point).collect()
    }

    /// Values of a constant, which the effect's file calls `own_name`, over its range; none if it has no range.
    fn grid(
        &self,
        own: &EffectCandidate<'_>,
        own_name: &str,
        fitted: &FittedStructure,
        name: &str,
    ) -> Vec<f64> {
        let mut parameters = fitted.structure.system.signature().parameters.iter();
        let declared = parameters.find(|known| *known.name == *name && !known.fixed);
        let Some(declared) = declared else { return Vec::new() };
        let is_onset = own.onsets.iter().any(|onset| onset == own_name);
        let value = fitted.values.p.get(name).copied().unwrap_or(declared.value);
        let mut ends = [value / FACTOR, value * FACTOR];
        if is_onset {
            let times = self.data.train.iter().flat_map(|recording| &recording.times);
            ends = [0.0, times.fold(0.0, |last: f64, t| last.max(*t))];
        }
        ends.sort_by(f64::total_cmp);
        let [mut lower, mut upper] = [declared.lower, declared.upper];
        lower = if lower.is_finite() && !is_onset { lower } else { lower.max(ends[0]) };
        upper = if upper.is_finite() && !is_onset { upper } else { upper.min(ends[1]) };
        if lower >= upper {
            return Vec::new();
        }
        if own.is_clock(own_name) {
            return ticks(value, [lower, upper], &self.data.train[0].times);
        }
        let is_log = declared.log && lower > 0.0;
        spread([lower, upper], is_log, if is_onset { MOMENTS } else { VALUES })
    }
}

/// Values over a range.
fn spread([lower, upper]: [f64; 2], is_log: bool, n: usize) -> Vec<f64> {
    let share = |k: usize| (k as f64 + 0.5) / n as f64;
    let value = |k: usize| {
        if is_log {
            lower * (upper / lower).powf(share(k))
        } else {
            lower + share(k) * (upper - lower)
        }
    };
    (0..n).map(value).collect()
}

/// Multiples of half the usual time between samples that are closest to a value: a reading that is refreshed by the
/// clock of a recording is refreshed at its samples.
fn ticks(value: f64, [lower, upper]: [f64; 2], times: &[f64]) -> Vec<f64> {
    let Some(step) = usual_spacing(times).map(|interval| 0.5 * interval) else { return Vec::new() };
    let middle = (value / step).round();
    let first = (middle - TICKS as f64).max((lower / step).ceil()).max(1.0);
    let multiples = (0..=2 * TICKS).map(|k| step * (first + k as f64));
    multiples.take_while(|at| *at <= upper).collect()
}
