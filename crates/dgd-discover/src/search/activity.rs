//! Finds when an effect is active: where it changes the values of equations or outputs.
//!
//! Along the trajectory of the structure with the effect, the rows with and without it are compared,
//!
//! ```text
//!   d(t) = f_with(t, y) − f_without(t, y)
//! ```
//!
//! and if no row differs, because the effect belongs to a sensor, so are the outputs.

use dgd_execute::LoadedSystem;
use dgd_identify::Recording;
use dgd_runtime::{
    EvaluationPoint, Options, Problem, Signature, Solution, System, Unit, discrete_numbers,
    observe, simulate,
};

use crate::fit::FittedStructure;
use crate::library::{CarriedValues, ModelStructure};

/// An effect is active where it exceeds this fraction of its maximum.
pub(crate) const AT_WORK: f64 = 0.05;

/// It must also change a value by more than this fraction of it.
const ROUNDING: f64 = 1e-9;

/// Windows in which an effect is active in each recording, s.
pub(crate) fn windows(
    with: &ModelStructure,
    without: &ModelStructure,
    values: &CarriedValues,
    recordings: &[Recording],
    options: &Options,
) -> Vec<Vec<[f64; 2]>> {
    let changes = changes(with, without, values, recordings, options);
    let samples = recordings.iter().map(|recording| recording.times.len()).sum();
    let mut activity = vec![0.0_f64; samples];
    for EffectChange { by, .. } in &changes {
        let largest = by.iter().fold(0.0, |most: f64, d| most.max(d.abs()));
        for (activity, d) in activity.iter_mut().zip(by) {
            *activity = activity.max(d.abs() / largest);
        }
    }
    let mut rest = activity.as_slice();
    let of_recording = |recording: &Recording| {
        let (own, others) = rest.split_at(recording.times.len());
        rest = others;
        stretches(&recording.times, own)
    };
    recordings.iter().map(of_recording).collect()
}

/// The place of a change. An output may have the name of an unknown, and a sensor's reading is not the equation of its
/// unknown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum ChangedPlace {
    /// The equation of an unknown.
    Equation(String),
    /// The reading of an output.
    Reading(String),
}

/// A change by an effect.
#[derive(Debug, Clone)]
pub(crate) struct EffectChange {
    /// Its place.
    pub what: ChangedPlace,
    /// d at each sample of all recordings.
    pub by: Vec<f64>,
}

/// All rows that an effect changes along the trajectories of the structure with it, or all outputs if it changes no row
/// in any recording. Differences by rounding do not count.
pub(crate) fn changes(
    with: &ModelStructure,
    without: &ModelStructure,
    values: &CarriedValues,
    recordings: &[Recording],
    options: &Options,
) -> Vec<EffectChange> {
    let runs = |system: &LoadedSystem| -> Option<Vec<(Solution, Vec<f64>)>> {
        let recordings = recordings.iter().enumerate();
        recordings.map(|(r, recording)| run(system, values, r, recording, options)).collect()
    };
    let Some(own) = runs(&with.system) else { return Vec::new() };
    let changes_of = |names: Vec<ChangedPlace>, a: &[f64], b: &[f64]| -> Vec<EffectChange> {
        let n = names.len();
        let change = |(i, what): (usize, ChangedPlace)| {
            let pairs = a.iter().skip(i).step_by(n).zip(b.iter().skip(i).step_by(n));
            let differences: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
            let largest = |values: &mut dyn Iterator<Item = f64>| {
                values.fold(0.0, |most: f64, value| most.max(value.abs()))
            };
            let size = largest(&mut a.iter().skip(i).step_by(n).copied());
            (largest(&mut differences.iter().copied()) > ROUNDING * size)
                .then_some(EffectChange { what, by: differences })
        };
        names.into_iter().enumerate().filter_map(change).collect()
    };
    let in_rows = recordings.iter().enumerate().zip(&own);
    let in_rows: Option<Vec<(Vec<f64>, Vec<f64>)>> = in_rows
        .map(|((r, recording), (solution, _))| rows(with, without, values, r, recording, solution))
        .collect();
    if let Some(in_rows) = in_rows {
        let (a, b): (Vec<Vec<f64>>, Vec<Vec<f64>>) = in_rows.into_iter().unzip();
        let unknowns = without.system.signature().unknowns.iter();
        let names =
            unknowns.map(|unknown| ChangedPlace::Equation(unknown.name.to_string())).collect();
        let changed = changes_of(names, &a.concat(), &b.concat());
        if !changed.is_empty() {
            return changed;
        }
    }
    let Some(others) = runs(&without.system) else { return Vec::new() };
    let outputs = |runs: Vec<(Solution, Vec<f64>)>| -> Vec<f64> {
        runs.into_iter().flat_map(|(_, outputs)| outputs).collect()
    };
    let names = with.system.signature().outputs.iter();
    let names = names.map(|output| ChangedPlace::Reading(output.name.to_string()));
    changes_of(names.collect(), &outputs(own), &outputs(others))
}

/// A run of one of the recordings, by its position among them, and its outputs.
fn run(
    system: &LoadedSystem,
    values: &CarriedValues,
    position: usize,
    recording: &Recording,
    options: &Options,
) -> Option<(Solution, Vec<f64>)> {
    let (p, start) = (values.parameters(system), values.starts(system, position));
    let problem = Problem { system, p: &p, inputs: &recording.inputs, start: &start };
    let solution = simulate(&problem, &recording.times, options).ok()?;
    let w = observe(&problem, &solution).w;
    Some((solution, w))
}

/// Values of the rows of the second structure in both structures, along a trajectory of the first.
fn rows(
    with: &ModelStructure,
    without: &ModelStructure,
    values: &CarriedValues,
    position: usize,
    recording: &Recording,
    solution: &Solution,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let (a, b) = (&with.system, &without.system);
    let (sa, sb) = (a.signature(), b.signature());
    // Position in one structure of each unknown of the other.
    let place = |name: &str| sa.unknowns.iter().position(|unknown| unknown.name == name);
    let places = sb.unknowns.iter().map(|u| place(&u.name)).collect::<Option<Vec<_>>>()?;
    let (pa, pb) = (values.parameters(a), values.parameters(b));
    let (mut fa, mut fb) = (vec![0.0; sa.unknowns.len()], vec![0.0; sb.unknowns.len()]);
    let start = values.starts(a, position);
    let inputs_of = |system: &LoadedSystem, p: &[f64]| {
        let problem = Problem { system, p, inputs: &recording.inputs, start: &start };
        problem.inputs_read().ok().map(std::borrow::Cow::into_owned)
    };
    let (ia, ib) = (inputs_of(a, &pa)?, inputs_of(b, &pb)?);
    let (mut ua, mut ub) = (vec![0.0; ia.len()], vec![0.0; ib.len()]);
    let (mut with_effect, mut without_effect) = (Vec::new(), Vec::new());
    for (k, &t) in solution.times.iter().enumerate() {
        ia.value(t, solution.side(k), &mut ua);
        ib.value(t, solution.side(k), &mut ub);
        let y = solution.y(k);
        let common: Vec<f64> = places.iter().map(|place| y[*place]).collect();
        let za = solution.z(k);
        let zb = discrete(b, &pb, t, sa, za);
        a.rhs(EvaluationPoint { t, y, u: &ua, p: &pa, z: za }, &mut fa);
        b.rhs(EvaluationPoint { t, y: &common, u: &ub, p: &pb, z: &zb }, &mut fb);
        with_effect.extend(places.iter().map(|place| fa[*place]));
        without_effect.extend_from_slice(&fb);
    }
    Some((with_effect, without_effect))
}

/// The discrete numbers of a system, with the modes of its automata from another one, whose numbers are `known`.
fn discrete(
    system: &LoadedSystem,
    p: &[f64],
    t: f64,
    other: &Signature,
    known: &[f64],
) -> Vec<f64> {
    let automata = &system.signature().discrete.automata;
    let mut z = discrete_numbers(system, p, t);
    for (z, automaton) in z.iter_mut().zip(automata.iter()) {
        let mut others = other.discrete.automata.iter().zip(known);
        if let Some((_, mode)) = others.find(|(other, _)| other.name == automaton.name) {
            *z = *mode;
        }
    }
    z
}

/// Windows of neighbouring samples with activity.
fn stretches(times: &[f64], activity: &[f64]) -> Vec<[f64; 2]> {
    let mut windows: Vec<[f64; 2]> = Vec::new();
    let mut is_open = false;
    for (t, value) in times.iter().zip(activity) {
        let at_work = *value > AT_WORK;
        match windows.last_mut() {
            Some(last) if at_work && is_open => last[1] = *t,
            _ if at_work => windows.push([*t, *t]),
            _ => {}
        }
        is_open = at_work;
    }
    windows
}

/// The unknown in which two fits differ most in a recording, in units of its size.
pub(crate) fn largest_disagreement(
    a: &FittedStructure,
    b: &FittedStructure,
    recording: &Recording,
    options: &Options,
) -> Option<DivergentUnknown> {
    let (sa, sb) = (&a.structure.system, &b.structure.system);
    let (ya, _) = run(sa, &a.values, 0, recording, options)?;
    let (yb, _) = run(sb, &b.values, 0, recording, options)?;
    farthest_apart([sa, sb], [&ya, &yb])
}

/// An unknown in which two courses differ.
#[derive(Debug, Clone)]
pub(crate) struct DivergentUnknown {
    pub(crate) name: String,
    /// Largest difference, SI.
    pub(crate) difference: f64,
    pub(crate) unit: Unit,
}

/// Smallest difference, in units of the unknown's size, that is worth a measurement.
const APART: f64 = 0.01;

/// The unknown in which two courses at the same times differ most, in units of its size.
pub(crate) fn farthest_apart<S: System>(
    systems: [&S; 2],
    [a, b]: [&Solution; 2],
) -> Option<DivergentUnknown> {
    let [unknowns, others] = systems.map(|system| &system.signature().unknowns);
    let mut worst: Option<(f64, DivergentUnknown)> = None;
    for (i, unknown) in unknowns.iter().enumerate() {
        let Some(j) = others.iter().position(|other| other.name == unknown.name) else { continue };
        let (mut size, mut difference) = (0.0_f64, 0.0_f64);
        for k in 0..a.len().min(b.len()) {
            size = size.max(a.y(k)[i].abs());
            difference = difference.max((a.y(k)[i] - b.y(k)[j]).abs());
        }
        let share = difference / size;
        if share > APART && worst.as_ref().is_none_or(|(most, _)| share > *most) {
            let (name, unit) = (unknown.name.to_string(), unknown.unit.clone());
            worst = Some((share, DivergentUnknown { name, difference, unit }));
        }
    }
    worst.map(|(_, apart)| apart)
}
