//! Quantities known during recordings: inputs, readings, and the fitted model's unknowns.

use dgd_identify::Recording;
use dgd_runtime::{LimitSide, Problem, Solution, System, Unit, simulate};

use super::condition::{WindowCondition, condition, holds};
use super::known::{KnownKind, KnownQuantity};
use crate::fit::{FittedStructure, SearchData};
use crate::library::is_weight;

/// Maximum number of unknowns considered: models with more are grids, whose elements have no names of their own.
const MOST_UNKNOWNS: usize = 40;

/// The quantities known during recordings.
#[derive(Debug, Clone)]
pub(crate) struct Circumstances {
    times: Vec<Vec<f64>>,
    known: Vec<KnownQuantity>,
}

impl Circumstances {
    /// The known quantities of all training recordings.
    pub(crate) fn new(fitted: &FittedStructure, data: &SearchData<'_>) -> Circumstances {
        let times = data.train.iter().map(|recording| recording.times.clone()).collect();
        Circumstances { times, known: known_quantities(fitted, data) }
    }

    /// The condition that coincides with windows of each recording.
    pub(crate) fn condition(&self, windows: &[Vec<[f64; 2]>]) -> Option<WindowCondition> {
        condition(&self.times, windows, &self.known)
    }

    /// Whether a condition holds at each sample of each recording.
    pub(super) fn holds(&self, condition: &WindowCondition) -> Option<Vec<Vec<bool>>> {
        let known = self.known.iter().find(|known| known.name == condition.quantity)?;
        holds(&self.times, condition, known)
    }
}

/// Inputs, measured outputs, and unknowns and modes of the fitted model in all training recordings.
///
/// Unknowns with the name of a measured output are left out, as are unknowns of recordings that cannot be simulated.
fn known_quantities(fitted: &FittedStructure, data: &SearchData<'_>) -> Vec<KnownQuantity> {
    let system = &fitted.structure.system;
    let signature = system.signature();
    let mut quantities: Vec<KnownQuantity> = Vec::new();
    let empty = || vec![Vec::new(); data.train.len()];
    for input in signature.inputs.iter().filter(|input| !is_weight(&input.name)) {
        let (name, unit) = (input.name.to_string(), input.unit.clone());
        quantities.push(KnownQuantity { name, kind: KnownKind::Input, unit, values: empty() });
    }
    let n_inputs = quantities.len();
    let outputs: Vec<usize> =
        (0..signature.outputs.len()).filter(|i| data.noise[*i].is_some()).collect();
    for &i in &outputs {
        let output = &signature.outputs[i];
        let measured = |recording: &Recording| {
            let missing = || vec![f64::NAN; recording.times.len()];
            data.scales.readings(i, recording).unwrap_or_else(missing)
        };
        quantities.push(KnownQuantity {
            name: output.name.to_string(),
            kind: KnownKind::Output,
            unit: output.unit.clone(),
            values: data.train.iter().map(measured).collect(),
        });
    }
    let n_measured = quantities.len();
    let unknowns: Vec<usize> = (signature.unknowns.iter().enumerate())
        .filter(|(_, unknown)| quantities.iter().all(|other| other.name != unknown.name))
        .map(|(i, _)| i)
        .take(MOST_UNKNOWNS)
        .collect();
    for &i in &unknowns {
        let (name, unit) = (signature.unknowns.name(i).to_string(), signature.unknowns.unit(i));
        let unit = unit.clone();
        quantities.push(KnownQuantity { name, kind: KnownKind::Unknown, unit, values: empty() });
    }
    let n_unknown = quantities.len();
    let automata: Vec<usize> = (signature.discrete.automata.iter().enumerate())
        .filter(|(_, automaton)| automaton.modes.len() > 1)
        .map(|(i, _)| i)
        .collect();
    for &i in &automata {
        let automaton = &signature.discrete.automata[i];
        let modes = automaton.modes.iter().map(ToString::to_string).collect();
        quantities.push(KnownQuantity {
            name: automaton.name.to_string(),
            kind: KnownKind::Mode(modes),
            unit: Unit { symbol: "1".into(), factor: 1.0, offset: 0.0 },
            values: empty(),
        });
    }
    for (r, recording) in data.train.iter().enumerate() {
        let mut u = vec![0.0; recording.inputs.len()];
        for &t in &recording.times {
            recording.inputs.value(t, LimitSide::Right, &mut u);
            for (quantity, u) in quantities[..n_inputs].iter_mut().zip(&u) {
                quantity.values[r].push(*u);
            }
        }
        let start = fitted.values.starts(system, r);
        let problem = Problem { system, p: &fitted.p, inputs: &recording.inputs, start: &start };
        let run = simulate(&problem, &recording.times, &data.options).ok();
        let values = |of: &dyn Fn(&Solution, usize) -> f64| -> Vec<f64> {
            let value = |k| run.as_ref().map_or(f64::NAN, |run| of(run, k));
            (0..recording.times.len()).map(value).collect()
        };
        for (quantity, &i) in quantities[n_measured..n_unknown].iter_mut().zip(&unknowns) {
            quantity.values[r] = values(&|run, k| run.y(k)[i]);
        }
        for (quantity, &i) in quantities[n_unknown..].iter_mut().zip(&automata) {
            quantity.values[r] = values(&|run, k| run.z(k)[i]);
        }
    }
    quantities
}
