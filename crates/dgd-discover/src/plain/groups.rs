//! Groups of recordings, each with its own value of a number, offset of a sensor or rate of the clock.

use dgd_compiler::units::Unit;
use dgd_identify::Recording;
use dgd_runtime::System;

use super::model_number::{ModelNumber, SIGNIFICANT};
use super::search::CorrectedRecordings;
use crate::fit::{FittedStructure, SearchData};
use crate::library::{ModelStructure, with_constant_inputs};

/// Groups of recordings, each with its own value of something.
#[derive(Debug, Clone)]
pub(crate) struct RecordingGroups {
    pub(crate) own: DifferingValue,
    /// The group of each training recording, from 0 …
    pub(crate) train: Vec<usize>,
    /// … and of each validation recording.
    pub(crate) valid: Vec<usize>,
    /// The parameter that is estimated in each group after the first.
    pub(super) names: Vec<String>,
}

/// A value of a group with its standard deviation, SI; a declared value has none.
type OwnValue = (f64, Option<f64>);

impl RecordingGroups {
    /// The value of each group.
    pub(crate) fn values(&self, fitted: &FittedStructure) -> Vec<OwnValue> {
        let nothing = (self.own.nothing(), None);
        let value_of = |name: Option<&str>| match name {
            None => nothing,
            Some(name) => {
                let mut shared_estimates =
                    fitted.estimates.iter().filter(|e| e.recording.is_none());
                let matching = shared_estimates.find(|estimate| estimate.name == name);
                matching.map_or(nothing, |estimate| (estimate.value, estimate.std))
            }
        };
        self.parameters().map(value_of).collect()
    }

    /// The parameter of each group; `None` for a first group with the declared value.
    pub(super) fn parameters(&self) -> impl Iterator<Item = Option<&str>> {
        std::iter::once(self.own.of_first()).chain(self.names.iter().map(|name| Some(&**name)))
    }

    /// Whether a group's value is at a bound.
    pub(super) fn is_at_bound(&self, fitted: &FittedStructure) -> bool {
        let mut shared = fitted.estimates.iter().filter(|e| e.recording.is_none());
        shared.any(|estimate| {
            self.parameters().flatten().any(|name| name == estimate.name)
                && fitted.is_at_bound(estimate)
        })
    }

    /// Groups by ascending value, and whether the recordings distinguish each from the next.
    pub(super) fn ranked(
        &self,
        fitted: &FittedStructure,
        data: &SearchData<'_>,
    ) -> Option<(Vec<usize>, Vec<bool>)> {
        let covariance = fitted.covariance(data)?;
        let places = fitted.fitted_directions();
        let place = |name: &str| {
            places.iter().position(|e| {
                fitted.estimates[*e].recording.is_none() && fitted.estimates[*e].name == name
            })
        };
        let group_places: Vec<Option<Option<usize>>> = self
            .parameters()
            .map(|name| match name {
                None => Some(None),
                Some(name) => place(name).map(Some),
            })
            .collect();
        let group_places: Vec<Option<usize>> = group_places.into_iter().collect::<Option<_>>()?;
        let values: Vec<f64> = self.values(fitted).into_iter().map(|(value, _)| value).collect();
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
        let shared = |a: Option<usize>, b: Option<usize>| match (a, b) {
            (Some(a), Some(b)) => covariance[(a, b)],
            _ => 0.0,
        };
        let is_apart = |pair: &[usize]| {
            let [a, b] = [group_places[pair[0]], group_places[pair[1]]];
            let variance = shared(a, a) + shared(b, b) - 2.0 * shared(a, b);
            values[pair[1]] - values[pair[0]] > SIGNIFICANT * variance.max(0.0).sqrt()
        };
        let apart = order.windows(2).map(is_apart).collect();
        Some((order, apart))
    }

    /// The recordings with an input for each group after the first, which is one in that group.
    pub(super) fn changed(
        &self,
        structure: &ModelStructure,
        data: &SearchData<'_>,
    ) -> Option<CorrectedRecordings> {
        let inputs = &structure.system.signature().inputs;
        let place = |group: usize| inputs.iter().position(|input| *input.name == *selector(group));
        let places: Vec<usize> =
            (1..=self.names.len()).map(place).collect::<Option<Vec<usize>>>()?;
        let with_selectors =
            |recordings: &[Recording], groups: &[usize]| -> Option<Vec<Recording>> {
                let both = recordings.iter().zip(groups);
                both.map(|(recording, own)| {
                    let further = places.iter().enumerate();
                    let further: Vec<(usize, f64)> = further
                        .map(|(k, place)| (*place, if *own == k + 1 { 1.0 } else { 0.0 }))
                        .collect();
                    let Recording { inputs, times, .. } = recording;
                    let inputs = with_constant_inputs(inputs, times, &further).ok()?;
                    Some(Recording { inputs, ..recording.clone() })
                })
                .collect()
            };
        Some(CorrectedRecordings {
            train: with_selectors(data.train, &self.train)?,
            valid: with_selectors(data.valid, &self.valid)?,
            noise: data.noise.clone(),
            counts_from: data.counts_from.clone(),
        })
    }
}

/// A value that may differ between recordings.
#[derive(Debug, Clone)]
pub(crate) enum DifferingValue {
    /// A number of the model's text, and whether it is estimated.
    Number(ModelNumber, bool),
    /// The offset of a sensor, whose readings have this unit.
    Offset(String, Unit),
    /// The rate of the clock.
    Clock,
}

impl DifferingValue {
    /// The parameter of the first group of recordings; `None` if it has the declared value.
    pub(super) fn of_first(&self) -> Option<&str> {
        match self {
            DifferingValue::Number(number, true) => Some(&number.name),
            _ => None,
        }
    }

    /// Its declared value, SI.
    pub(super) fn nothing(&self) -> f64 {
        match self {
            DifferingValue::Number(number, _) => number.declared,
            DifferingValue::Offset(..) => 0.0,
            DifferingValue::Clock => 1.0,
        }
    }

    /// Its name in a group of recordings.
    pub(super) fn called(&self, recordings: &str) -> String {
        let subject = match self {
            DifferingValue::Number(number, _) => number.name.clone(),
            DifferingValue::Offset(output, _) => format!("offset of {output}"),
            DifferingValue::Clock => "clock".to_owned(),
        };
        format!("{subject} in {recordings}")
    }
}

/// The input that is one in the recordings of a group.
pub(super) fn selector(group: usize) -> String {
    format!("group {group}")
}
