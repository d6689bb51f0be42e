//! Fits moments at which readings jump.
//!
//! A sensor that jumps when something sets in has no derivative with respect to the moment: the misfit is constant
//! while the moment moves between two samples, and jumps when it passes one. So such a moment is not fitted with the
//! rest, but moved from one sample interval to another as long as that reduces the misfit, and the rest is refitted.
//!
//! ```text
//!   the data cannot locate t within (t_k, t_k+1): t̂ = (t_k + t_k+1)/2, σ = (t_k+1 − t_k)/√12
//! ```

use dgd_execute::LoadedSystem;
use dgd_identify::{
    Fit, NoiseSource, OutputErrorProblem, ParameterEstimate, Recording, Starts, TrialFailed,
    evaluate,
};
use dgd_runtime::Direction;
use dgd_runtime::System;

/// Change of a reading, in standard deviations of its noise, as a moment moves by one sample, above which it jumps with
/// the moment.
const JUMP: f64 = 4.0;

/// Moments that are moved sample by sample.
#[derive(Debug, Clone)]
pub(crate) struct MovingMoments {
    /// Sample times of all recordings, ascending.
    samples: Vec<f64>,
    /// Positions of the parameters.
    pub parameters: Vec<usize>,
}

impl MovingMoments {
    /// Those onsets, by position of the parameter, with which readings jump; each is moved to the middle of its
    /// interval.
    pub(crate) fn jumping(
        problem: &OutputErrorProblem<'_>,
        onsets: &[usize],
        p: &mut [f64],
        starts: &[Starts],
    ) -> MovingMoments {
        let mut samples: Vec<f64> =
            problem.recordings.iter().flat_map(|recording| recording.times.clone()).collect();
        samples.sort_by(f64::total_cmp);
        samples.dedup();
        let mut moments = MovingMoments { samples, parameters: Vec::new() };
        for &parameter in onsets {
            if moments.jumps(problem, parameter, p, starts).unwrap_or(false) {
                p[parameter] = moments.moved(p[parameter], 0);
                moments.parameters.push(parameter);
            }
        }
        moments
    }

    fn jumps(
        &self,
        problem: &OutputErrorProblem<'_>,
        parameter: usize,
        p: &[f64],
        starts: &[Starts],
    ) -> Result<bool, TrialFailed> {
        let mut later = p.to_vec();
        later[parameter] = self.moved(p[parameter], 1);
        let (here, there) = (evaluate(problem, p, starts)?, evaluate(problem, &later, starts)?);
        let runs = here.observations.iter().zip(&there.observations).zip(problem.recordings);
        Ok(runs.into_iter().any(|((here, there), recording)| {
            (0..recording.times.len()).any(|k| {
                let readings = here.w(k).iter().zip(there.w(k)).zip(&problem.noise);
                readings.into_iter().any(|((here, there), noise)| match noise {
                    Some(NoiseSource::Known(sigma)) => (here - there).abs() > JUMP * sigma,
                    _ => false,
                })
            })
        }))
    }

    /// The middle of the interval `by` samples later.
    fn moved(&self, t: f64, by: isize) -> f64 {
        let last = self.samples.len().saturating_sub(2);
        let k = self.samples.partition_point(|sample| *sample <= t).saturating_sub(1).min(last);
        let k = k.saturating_add_signed(by).min(last);
        match self.samples.get(k..k + 2) {
            Some([a, b]) => 0.5 * (a + b),
            _ => t,
        }
    }

    /// Moves the moments to where the misfit is least, with everything else unchanged. Returns whether one moved.
    pub(crate) fn settle(
        &self,
        problem: &OutputErrorProblem<'_>,
        p: &mut [f64],
        starts: &[Starts],
    ) -> Result<bool, TrialFailed> {
        let before = p.to_vec();
        let mut least = evaluate(problem, p, starts)?.cost;
        for &parameter in &self.parameters {
            for direction in [1, -1] {
                let mut stride = direction;
                while stride != 0 {
                    let mut trial = p.to_vec();
                    trial[parameter] = self.moved(p[parameter], stride);
                    let bounds = &problem.system.signature().parameters[parameter];
                    let is_within = (bounds.lower..=bounds.upper).contains(&trial[parameter]);
                    let cost = evaluate(problem, &trial, starts).map(|trial| trial.cost);
                    match cost {
                        Ok(cost) if is_within && cost < least => {
                            least = cost;
                            p.copy_from_slice(&trial);
                            stride *= 2;
                        }
                        // Shorter strides, ending after single samples.
                        _ => stride /= 2,
                    }
                }
            }
        }
        Ok(p != before)
    }

    /// For each direction of a problem, whether it stays free while the moments are held.
    pub(crate) fn held(&self, problem: &OutputErrorProblem<'_>) -> Vec<bool> {
        let directions = problem.system.signature().directions.iter().zip(&problem.free);
        let is_moment = |direction: &Direction| match direction {
            Direction::Parameter(i) => self.parameters.contains(i),
            Direction::Start(_) => false,
        };
        directions.map(|(direction, free)| *free && !is_moment(direction)).collect()
    }

    /// The estimates of a fit and the moments, in the order of the model's parameters.
    pub(crate) fn estimates(&self, system: &LoadedSystem, fit: &Fit) -> Vec<ParameterEstimate> {
        let mut estimates = fit.estimates.clone();
        for &parameter in &self.parameters {
            let value = fit.p[parameter];
            let (before, after) = (self.last_before(value, 0), self.last_before(value, 1));
            let estimate = ParameterEstimate {
                name: system.signature().parameters[parameter].name.to_string(),
                of: Direction::Parameter(parameter),
                recording: None,
                value,
                std: Some((after - before) / 12.0_f64.sqrt()),
                at_bound: None,
            };
            let comes_before = |other: &ParameterEstimate| match other.of {
                Direction::Parameter(i) => i < parameter,
                Direction::Start(_) => false,
            };
            estimates.insert(estimates.partition_point(comes_before), estimate);
        }
        estimates
    }

    /// The last sample before a time, or the one `later` samples after it.
    fn last_before(&self, t: f64, later: usize) -> f64 {
        let k = self.samples.partition_point(|sample| *sample <= t).saturating_sub(1) + later;
        self.samples.get(k).or(self.samples.last()).copied().unwrap_or(t)
    }
}

/// Number of points over the recordings at which a fitted moment is tried again, and fractions of the recordings, from
/// 2⁻³ to 2⁻⁸, by which it is moved.
const AGAIN: usize = 24;
const NEAREST: i32 = 8;
const FARTHEST: i32 = 3;

/// Moves onsets to where the misfit is less, however far away, with everything else unchanged. Returns whether one
/// moved.
///
/// While nothing happens on which an effect acts, its onset makes no difference, and a fit cannot cross such a time.
pub(crate) fn relocate_onsets(
    problem: &OutputErrorProblem<'_>,
    onsets: &[usize],
    moments: &MovingMoments,
    p: &mut [f64],
    starts: &[Starts],
) -> Result<bool, TrialFailed> {
    let (Some(first), Some(last)) = (moments.samples.first(), moments.samples.last()) else {
        return Ok(false);
    };
    let before = p.to_vec();
    if onsets.is_empty() {
        return Ok(false);
    }
    let mut least = evaluate(problem, p, starts)?.cost;
    for &parameter in onsets {
        let bounds = &problem.system.signature().parameters[parameter];
        let length = last - first;
        let over_all = (0..AGAIN).map(|k| first + (k as f64 + 0.5) / AGAIN as f64 * length);
        let about = (FARTHEST..=NEAREST).flat_map(|j| {
            let distance = length * 0.5_f64.powi(j);
            [before[parameter] - distance, before[parameter] + distance]
        });
        for value in over_all.chain(about) {
            let is_jump = moments.parameters.contains(&parameter);
            let value = if is_jump { moments.moved(value, 0) } else { value };
            if !(bounds.lower.max(*first)..=bounds.upper.min(*last)).contains(&value) {
                continue;
            }
            let mut trial = p.to_vec();
            trial[parameter] = value;
            // Moments at which the model cannot be simulated are skipped.
            if let Ok(found) = evaluate(problem, &trial, starts)
                && found.cost < least
            {
                least = found.cost;
                p.copy_from_slice(&trial);
            }
        }
    }
    Ok(p != before)
}

/// Fraction of a sample interval beyond its boundary at which a delay is tried.
const BEYOND: f64 = 0.05;

/// Moves delays from one sample interval to the next as long as that reduces the misfit, with everything else
/// unchanged. Returns whether one moved.
///
/// Delayed quantities may jump at samples, as held inputs do. When a delay passes a multiple of the sample interval,
/// all those jumps fall on other samples, which the derivative with respect to the delay cannot show.
pub(crate) fn cross(
    problem: &OutputErrorProblem<'_>,
    delays: &[usize],
    p: &mut [f64],
    starts: &[Starts],
) -> Result<bool, TrialFailed> {
    let spacing = problem.recordings.iter().filter_map(|recording| {
        let (first, last) = (recording.times.first()?, recording.times.last()?);
        (last > first).then(|| (last - first) / (recording.times.len() - 1) as f64)
    });
    let spacing = spacing.fold(f64::INFINITY, f64::min);
    if delays.is_empty() || !spacing.is_finite() {
        return Ok(false);
    }
    let before = p.to_vec();
    let mut least = evaluate(problem, p, starts)?.cost;
    for &parameter in delays {
        let bounds = &problem.system.signature().parameters[parameter];
        for direction in [1.0, -1.0] {
            loop {
                // The end of the interval in the direction of travel, and a little beyond.
                let intervals = (direction * p[parameter] / spacing).floor() + 1.0 + BEYOND;
                let value = direction * intervals * spacing;
                let mut trial = p.to_vec();
                trial[parameter] = value;
                let is_within = (bounds.lower..=bounds.upper).contains(&value);
                match evaluate(problem, &trial, starts) {
                    Ok(found) if is_within && found.cost < least => {
                        least = found.cost;
                        p.copy_from_slice(&trial);
                    }
                    _ => break,
                }
            }
        }
    }
    Ok(p != before)
}

/// The recordings with start values found by a fit.
pub(crate) fn with_found_starts(recordings: &[Recording], starts: &[Starts]) -> Vec<Recording> {
    let recordings = recordings.iter().zip(starts);
    recordings
        .map(|(recording, starts)| Recording { start: starts.clone(), ..recording.clone() })
        .collect()
}
