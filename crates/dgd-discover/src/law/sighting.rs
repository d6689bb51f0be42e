//! Recordings followed by a smoother, with the values of all names along them.

use std::collections::BTreeMap;
use std::ops::Range;

use dgd_identify::Recording;
use dgd_runtime::{Direction, System};

use super::search::LawSearch;
use crate::guess::{FormulaFactor, FormulaShape, names, with_differences};
use crate::library::CarriedValues;
use crate::missing_input::{
    JointModel, JointRecording, MissingTerms, SmoothedRecording, free_places,
};

/// Largest number of states and unknown inputs of the smoother, whose time grows with the cube of it.
const MOST_STATES: usize = 60;
/// Largest number of readings of all recordings together …
const READINGS: usize = 1500;
/// … and the number of times that each recording has in any case: between them the model is linear.
const FEWEST: usize = 100;

/// The training recordings, followed with unknown inputs at some places.
pub(super) struct FollowedRecordings {
    pub(super) paths: Vec<SmoothedRecording>,
    /// Places at which something was missing, each with the intensity of its walk …
    pub(super) walks: Vec<(usize, f64)>,
    /// … and those of them that stand out.
    pub(super) places: Vec<usize>,
    pub(super) names: Vec<FormulaFactor>,
    /// Values of each name at the samples of each path.
    values: Vec<Vec<Vec<f64>>>,
    /// Start values of each of its recordings, by name.
    pub(super) starts: Vec<BTreeMap<String, f64>>,
    /// Places of free parameters, each with the size of its prior error.
    pub(super) free: Vec<(usize, f64)>,
}

impl FollowedRecordings {
    /// Follows training recordings with unknown inputs at these places; `None` if one cannot be followed.
    pub(super) fn new(
        laws: &LawSearch<'_>,
        terms: &MissingTerms,
        places: &[usize],
        recordings: Range<usize>,
    ) -> Option<Self> {
        let LawSearch { fitted, data, model, .. } = laws;
        let system = &fitted.structure.system;
        let unknowns = &system.signature().unknowns;
        let states = unknowns.differential().count();
        if states + places.len() > MOST_STATES {
            return None;
        }
        let train = &data.train[recordings.clone()];
        let outputs = data.noise.iter().flatten().count() * train.len();
        let most = (READINGS / outputs.max(1)).max(FEWEST);
        let samples: Vec<(Vec<f64>, Vec<f64>)> =
            train.iter().map(|recording| sampled(recording, most)).collect();
        let starts: Vec<_> = recordings.map(|r| fitted.values.starts(system, r)).collect();
        let recorded: Vec<JointRecording<'_>> = (train.iter().zip(&samples).zip(&starts))
            .map(|((recording, (times, measured)), start)| JointRecording {
                inputs: &recording.inputs,
                times,
                measured,
                start,
            })
            .collect();
        let p = if fitted.runs_away(data) {
            CarriedValues::default().parameters(system)
        } else {
            fitted.p.clone()
        };
        let directions = system.signature().directions.iter();
        let free_starts: Vec<usize> = directions
            .filter_map(|direction| match direction {
                Direction::Start(unknown) => Some(*unknown),
                Direction::Parameter(_) => None,
            })
            .collect();
        let free_starts = &free_starts;
        let (noise, options) = (&data.noise, &data.options);
        let joint = JointModel { terms, places, free_starts, p: &p, noise, options };
        let (paths, q) = joint.paths(&recorded)?;
        let stand_out = joint.standing_out(&paths, &q);
        let walks = places.iter().copied().zip(q).collect();
        let places = stand_out;

        let names = names(model);
        let n_inputs = model.inputs.len();
        let along = |path: &SmoothedRecording, i: usize| -> Vec<f64> {
            let solution = &path.trajectory;
            // Weights of readings are inputs that follow the model's own.
            let stride = path.u.len() / solution.times.len().max(1);
            let position = unknowns.iter().position(|unknown| *unknown.name == *names[i].name);
            let value = |k: usize| match (i, position) {
                (i, _) if i < n_inputs => path.u[k * stride + i],
                (i, _) if i == n_inputs => solution.times[k],
                (_, Some(position)) => solution.y(k)[position],
                (_, None) => f64::NAN,
            };
            (0..solution.times.len()).map(value).collect()
        };
        let plain = names.iter().filter(|name| name.difference.is_none()).count();
        let values_along = |path: &SmoothedRecording| {
            let mut values = (0..plain).map(|i| along(path, i)).collect();
            with_differences(&names, &mut values);
            values
        };
        let values = paths.iter().map(values_along).collect();
        let starts = (paths.iter())
            .map(|path| {
                let y = path.trajectory.y(0);
                unknowns.differential().map(|i| (unknowns.name(i).to_string(), y[i])).collect()
            })
            .collect();
        let free = free_places(terms, fitted);
        let free = free.into_iter().map(|free| (free.place, free.size)).collect();
        Some(FollowedRecordings { paths, walks, places, names, values, starts, free })
    }

    /// Least and largest value of each name.
    pub(super) fn ranges(&self) -> Vec<[f64; 2]> {
        let range = |values: &Vec<f64>| {
            let finite = values.iter().copied().filter(|x| x.is_finite());
            finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
        };
        self.all_values().iter().map(range).collect()
    }

    /// All values of each name.
    pub(super) fn all_values(&self) -> Vec<Vec<f64>> {
        let of_name = |i: usize| -> Vec<f64> {
            self.values.iter().flat_map(|of_path| of_path[i].iter().copied()).collect()
        };
        (0..self.names.len()).map(of_name).collect()
    }

    /// Values of a shape along each path.
    pub(super) fn formed(&self, shape: &FormulaShape) -> Vec<Vec<f64>> {
        let of_path = |values: &Vec<Vec<f64>>| {
            let count = values.first().map_or(0, Vec::len);
            (0..count).map(|k| shape.value(|name| values[name][k])).collect()
        };
        self.values.iter().map(of_path).collect()
    }

    /// Values of a shape between the samples of each path: means of those at both ends, with the mean of each input.
    pub(super) fn formed_between(&self, shape: &FormulaShape) -> Vec<Vec<f64>> {
        let of_path = |(path, values): (&SmoothedRecording, &Vec<Vec<f64>>)| {
            let count = path.trajectory.times.len();
            let stride = path.u.len() / count.max(1);
            // Inputs come before time; in `u_between`, weights of readings follow them.
            let n_inputs = self.names.iter().position(|name| name.name == "time").unwrap_or(0);
            let plain = |name: usize, k: usize, at: usize| match name {
                _ if name < n_inputs => path.u_between[k * stride + name],
                _ => values[name][at],
            };
            let end = |k: usize, at: usize| {
                shape.value(|name| match self.names[name].difference {
                    Some([a, b]) => plain(a, k, at) - plain(b, k, at),
                    None => plain(name, k, at),
                })
            };
            (0..count.saturating_sub(1)).map(|k| f64::midpoint(end(k, k), end(k, k + 1))).collect()
        };
        self.paths.iter().zip(&self.values).map(of_path).collect()
    }

    /// Number of readings.
    pub(super) fn readings(&self) -> usize {
        self.paths.iter().map(|path| path.chain.len()).sum()
    }
}

/// A recording at about `most` times: some of its samples, or additional times between them without readings.
fn sampled(recording: &Recording, most: usize) -> (Vec<f64>, Vec<f64>) {
    let count = recording.times.len();
    let stride = count.div_ceil(most).max(1);
    let samples: Vec<usize> = (0..count).step_by(stride).collect();
    let between = FEWEST.div_ceil(count);
    let (mut times, mut readings) = (Vec::new(), Vec::new());
    for (i, &k) in samples.iter().enumerate() {
        let t = recording.times[k];
        times.push(t);
        let read = |of: &Option<Vec<f64>>| of.as_ref().map_or(f64::NAN, |all| all[k]);
        readings.extend(recording.measured.iter().map(read));
        let Some(&next) = samples.get(i + 1) else { break };
        let interval = recording.times[next] - t;
        for part in 1..between {
            times.push(t + interval * part as f64 / between as f64);
            readings.extend(std::iter::repeat_n(f64::NAN, recording.measured.len()));
        }
    }
    (times, readings)
}
