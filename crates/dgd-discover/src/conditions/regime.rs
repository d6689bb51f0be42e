//! A base model that holds outside a condition.
//!
//! ```text
//!   the condition of a place ─► pieces of the recordings in which it does not hold, and those in which it does
//!     ─► the base model fitted to the former: only noise? ─► with these parameters, more than noise in the latter?
//! ```
//!
//! Each piece has its own start values, because the missing term moves the states while the condition holds. The idea
//! of locating errors of the physics regime by regime is Wang's (arXiv 2606.23215, 2026).

use std::collections::BTreeMap;

use dgd_identify::Recording;
use dgd_runtime::{Direction, System};

use super::circumstances::Circumstances;
use super::condition::WindowCondition;
use crate::fit::{FittedStructure, SearchData, StartPoint, chi_square};
use crate::library::CarriedValues;

/// Fewest readings of a piece for each start value.
const FEWEST: usize = 8;
/// Maximum number of simulations of a fit.
const EVALUATIONS: usize = 60;

/// A base model that explains the recordings except while a condition holds.
#[derive(Debug, Clone)]
pub(crate) struct ConditionRegime {
    pub(crate) condition: WindowCondition,
    /// Mean squares of the residuals relative to the noise where the condition does not hold, and where it does.
    pub(crate) left: [f64; 2],
    /// The base model fitted to the pieces in which the condition does not hold.
    pub(crate) outside: FittedStructure,
}

impl ConditionRegime {
    /// The regime that a condition divides, if the base model explains the recordings outside it, but not inside, to
    /// within `explained` times the noise variance.
    pub(crate) fn find(
        condition: &WindowCondition,
        circumstances: &Circumstances,
        fitted: &FittedStructure,
        data: &SearchData<'_>,
        explained: f64,
    ) -> Option<ConditionRegime> {
        let holds = circumstances.holds(condition)?;
        let system = &fitted.structure.system;
        let unknowns = &system.signature().unknowns;
        let is_free = |state: usize| {
            let free = |direction: &Direction| *direction == Direction::Start(state);
            system.signature().directions.iter().any(free)
        };
        // A state that is held at a start value cannot begin in the middle of a recording.
        if !unknowns.differential().all(is_free) {
            return None;
        }
        let fewest = FEWEST * unknowns.differential().count();
        let pieces = |within: bool| -> Vec<Recording> {
            let of_recording = |(recording, holds): (&Recording, &Vec<bool>)| {
                pieces(recording, holds, within, fewest)
            };
            data.train.iter().zip(&holds).flat_map(of_recording).collect()
        };
        let (outside, inside) = (pieces(false), pieces(true));
        if outside.is_empty() || inside.is_empty() {
            return None;
        }
        let fit = |train: &[Recording], valid: &[Recording], from: &CarriedValues| {
            let counts_from = vec![f64::NEG_INFINITY; valid.len()];
            let data = SearchData { train, valid, counts_from, ..data.not_kept() };
            let structure = fitted.structure.clone();
            let mut refitted =
                FittedStructure::new(structure, from, &[StartPoint::default()], &data, EVALUATIONS)
                    .ok()?;
            refitted.hold_out(&data, EVALUATIONS);
            let squares = |residuals: Vec<Vec<Vec<f64>>>| {
                let by_output = chi_square(&residuals, &data.noise);
                let of_output =
                    by_output.iter().filter(|(_, n)| *n > 0).map(|(sum, n)| sum / *n as f64);
                of_output.fold(0.0, f64::max)
            };
            let left = squares(refitted.residuals(&data));
            let held_out = refitted.held_out_residuals(&data).map_or(f64::INFINITY, squares);
            Some((refitted, [left, held_out]))
        };
        let from = CarriedValues {
            starts: vec![BTreeMap::default(); outside.len()],
            ..fitted.values.clone()
        };
        let (outside, left) = fit(&outside, &inside, &from)?;
        let divides = left[0] <= explained && left[1] > explained.powi(2);
        divides.then(|| ConditionRegime { condition: condition.clone(), left, outside })
    }
}

/// Runs of samples of a recording within a condition, or outside it, with at least `fewest` readings.
fn pieces(recording: &Recording, holds: &[bool], within: bool, fewest: usize) -> Vec<Recording> {
    let mut pieces = Vec::new();
    let mut begin = 0;
    for end in 1..=holds.len() {
        if end < holds.len() && holds[end] == holds[begin] {
            continue;
        }
        let read = |values: &Option<Vec<f64>>| {
            values.iter().flat_map(|values| &values[begin..end]).filter(|x| x.is_finite()).count()
        };
        let readings: usize = recording.measured.iter().map(read).sum();
        if holds[begin] == within && readings >= fewest {
            let cut = |outputs: &[Option<Vec<f64>>]| -> Vec<Option<Vec<f64>>> {
                outputs
                    .iter()
                    .map(|values| values.as_ref().map(|values| values[begin..end].to_vec()))
                    .collect()
            };
            pieces.push(Recording {
                times: recording.times[begin..end].to_vec(),
                measured: cut(&recording.measured),
                deviations: cut(&recording.deviations),
                start: Vec::new(),
                ..recording.clone()
            });
        }
        begin = end;
    }
    pieces
}
