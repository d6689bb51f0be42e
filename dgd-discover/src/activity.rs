//! When an effect is at work: where it changes what equations or outputs say.
//!
//! Along the trajectory of the structure that has the effect, the rows of the structure with and
//! without it are compared,
//!
//! ```text
//!   d(t) = f_with(t, y) − f_without(t, y)
//! ```
//!
//! and where no row differs, the effect being a sensor's, so are the outputs.

use dgd_execute::Loaded;
use dgd_runtime::identify::Recording;
use dgd_runtime::{
    Options, Point, Problem, Signature, Solution, System, Unit, discrete_numbers, observe, simulate,
};

use crate::fitted::Fitted;
use crate::structure::{Structure, Values};

/// An effect is at work where it is more than this share of its largest.
const AT_WORK: f64 = 0.05;

/// Stretches of time in which an effect is at work in a recording, s.
pub(crate) fn windows(
    with: &Structure,
    without: &Structure,
    values: &Values,
    recording: &Recording,
    options: &Options,
) -> Vec<[f64; 2]> {
    let Some((solution, outputs)) = run(&with.system, values, recording, options) else {
        return Vec::new();
    };
    let mut activity = rows(with, without, values, recording, &solution);
    if activity.iter().all(|value| *value == 0.0)
        && let Some((_, others)) = run(&without.system, values, recording, options)
    {
        let n_w = with.system.signature().outputs.len();
        activity = joined(&outputs, &others, n_w);
    }
    stretches(&solution.times, &activity)
}

fn run(
    system: &Loaded,
    values: &Values,
    recording: &Recording,
    options: &Options,
) -> Option<(Solution, Vec<f64>)> {
    let (p, start) = (values.parameters(system), values.starts(system, 0));
    let problem = Problem { system, p: &p, inputs: &recording.inputs, start: &start };
    let solution = simulate(&problem, &recording.times, options).ok()?;
    let w = observe(&problem, &solution).w;
    Some((solution, w))
}

/// The largest difference of rows that both structures have, each over its largest in time.
fn rows(
    with: &Structure,
    without: &Structure,
    values: &Values,
    recording: &Recording,
    solution: &Solution,
) -> Vec<f64> {
    let (a, b) = (&with.system, &without.system);
    let (sa, sb) = (a.signature(), b.signature());
    // Position in the one of each unknown of the other.
    let place = |name: &str| sa.unknowns.iter().position(|unknown| unknown.name == name);
    let Some(places) = sb.unknowns.iter().map(|u| place(&u.name)).collect::<Option<Vec<_>>>()
    else {
        return vec![0.0; solution.len()];
    };
    let (pa, pb) = (values.parameters(a), values.parameters(b));
    let (mut fa, mut fb) = (vec![0.0; sa.unknowns.len()], vec![0.0; sb.unknowns.len()]);
    let start = values.starts(a, 0);
    let inputs_of = |system: &Loaded, p: &[f64]| {
        let problem = Problem { system, p, inputs: &recording.inputs, start: &start };
        problem.inputs_read().ok().map(std::borrow::Cow::into_owned)
    };
    let (Some(ia), Some(ib)) = (inputs_of(a, &pa), inputs_of(b, &pb)) else {
        return vec![0.0; solution.len()];
    };
    let (mut ua, mut ub) = (vec![0.0; ia.len()], vec![0.0; ib.len()]);
    let n = places.len();
    let (mut with_effect, mut without_effect) = (Vec::new(), Vec::new());
    for (k, &t) in solution.times.iter().enumerate() {
        ia.value(t, solution.side(k), &mut ua);
        ib.value(t, solution.side(k), &mut ub);
        let y = solution.y(k);
        let common: Vec<f64> = places.iter().map(|place| y[*place]).collect();
        let za = solution.z(k);
        let zb = discrete(b, &pb, t, sa, za);
        a.rhs(Point { t, y, u: &ua, p: &pa, z: za }, &mut fa);
        b.rhs(Point { t, y: &common, u: &ub, p: &pb, z: &zb }, &mut fb);
        with_effect.extend(places.iter().map(|place| fa[*place]));
        without_effect.extend_from_slice(&fb);
    }
    joined(&with_effect, &without_effect, n)
}

/// The discrete numbers of one system where another, which has its automata too, has `known`.
fn discrete(system: &Loaded, p: &[f64], t: f64, other: &Signature, known: &[f64]) -> Vec<f64> {
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

/// For each row of n numbers, the largest difference, each column in units of its largest. Columns
/// that differ by rounding only do not count.
fn joined(a: &[f64], b: &[f64], n: usize) -> Vec<f64> {
    if n == 0 {
        return Vec::new();
    }
    let largest = |i: usize, f: &dyn Fn(usize) -> f64| {
        (i..a.len()).step_by(n).map(f).fold(0.0, |most: f64, value| most.max(value.abs()))
    };
    let scales: Vec<f64> = (0..n)
        .map(|i| {
            let difference = largest(i, &|at| a[at] - b[at]);
            let rounding = 1e-9 * largest(i, &|at| a[at]);
            if difference > rounding { difference } else { f64::INFINITY }
        })
        .collect();
    let rows = a.chunks_exact(n).zip(b.chunks_exact(n));
    let of_row = |(a, b): (&[f64], &[f64])| {
        let parts = a.iter().zip(b).zip(&scales);
        parts.map(|((a, b), scale)| (a - b).abs() / scale).fold(0.0, f64::max)
    };
    rows.map(of_row).collect()
}

/// Stretches of neighbouring samples at which something is at work.
fn stretches(times: &[f64], activity: &[f64]) -> Vec<[f64; 2]> {
    let mut all: Vec<[f64; 2]> = Vec::new();
    let mut is_open = false;
    for (t, value) in times.iter().zip(activity) {
        let at_work = *value > AT_WORK;
        match all.last_mut() {
            Some(last) if at_work && is_open => last[1] = *t,
            _ if at_work => all.push([*t, *t]),
            _ => {}
        }
        is_open = at_work;
    }
    all
}

/// The unknown on which two fitted structures disagree most in a recording, in units of its size:
/// its name, the largest difference in SI and its unit. `None` where they agree on all to a
/// hundredth.
pub(crate) fn largest_disagreement(
    a: &Fitted,
    b: &Fitted,
    recording: &Recording,
    options: &Options,
) -> Option<(String, f64, Unit)> {
    let (sa, sb) = (&a.structure.system, &b.structure.system);
    let (ya, _) = run(sa, &a.values, recording, options)?;
    let (yb, _) = run(sb, &b.values, recording, options)?;
    let mut worst: Option<(f64, (String, f64, Unit))> = None;
    for (i, unknown) in sa.signature().unknowns.iter().enumerate() {
        let other = sb.signature().unknowns.iter().position(|other| other.name == unknown.name);
        let Some(j) = other else { continue };
        let (mut size, mut difference) = (0.0_f64, 0.0_f64);
        for k in 0..ya.len().min(yb.len()) {
            size = size.max(ya.y(k)[i].abs());
            difference = difference.max((ya.y(k)[i] - yb.y(k)[j]).abs());
        }
        let share = difference / size;
        if share > 0.01 && worst.as_ref().is_none_or(|(most, _)| share > *most) {
            worst = Some((share, (unknown.name.to_string(), difference, unknown.unit.clone())));
        }
    }
    worst.map(|(_, found)| found)
}
