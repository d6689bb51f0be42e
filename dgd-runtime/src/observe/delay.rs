//! Outputs with delays: the times that a run must reach for them, and its values there.
//!
//! An output with the delay τ is w(t) = E(t − τ). Before the first requested time, y, u and the discrete numbers have
//! their values at it. For τ < 0 the run continues beyond the last requested time, as far as inputs are known; from
//! there on y and u keep their values.

use crate::error::{BadRequest, IntegrateError};
use crate::problem::Problem;
use crate::signal::LimitSide;
use crate::solution::{DelayedOutputValues, Solution, side};
use crate::system::{EvaluationPoint, System};

/// The times of a run with delayed outputs.
pub struct DelayedOutputTimes {
    /// All times needed, ascending; twice where a left limit is needed.
    pub all: Vec<f64>,
    /// Positions of the requested times in `all`.
    asked: Vec<usize>,
    clocks: Vec<DelayClock>,
}

/// Times at which the outputs with one delay are read.
struct DelayClock {
    delay: usize,
    tau: f64,
    /// Their positions in `all`.
    rows: Vec<usize>,
}

/// τ of each delay, at the parameters of a problem.
pub fn delays<S: System>(problem: &Problem<'_, S>) -> Vec<f64> {
    let mut tau = vec![0.0; problem.system.signature().delays.len()];
    if !tau.is_empty() {
        problem
            .system
            .delays(EvaluationPoint { t: 0.0, y: &[], u: &[], p: problem.p, z: &[] }, &mut tau);
    }
    tau
}

/// ∂τ/∂θ, delays × n_s dense by columns.
pub fn delay_sensitivities<S: System>(problem: &Problem<'_, S>) -> Vec<f64> {
    let signature = problem.system.signature();
    let mut dtau = vec![0.0; signature.delays.len() * signature.directions.len()];
    if !dtau.is_empty() {
        let point = EvaluationPoint { t: 0.0, y: &[], u: &[], p: problem.p, z: &[] };
        problem.system.delay_sensitivities(point, &mut dtau);
    }
    dtau
}

impl DelayedOutputTimes {
    /// The times that a run needs for outputs at all requested `times`, which ascend; `None` if no output has a delay.
    pub fn new<S: System>(
        problem: &Problem<'_, S>,
        times: &[f64],
    ) -> Result<Option<DelayedOutputTimes>, IntegrateError> {
        let signature = problem.system.signature();
        let mut used: Vec<usize> = signature.outputs.iter().filter_map(|w| w.delay).collect();
        used.sort_unstable();
        used.dedup();
        let (Some(&from), Some(&until)) = (times.first(), times.last()) else {
            return Ok(None);
        };
        if used.is_empty() {
            return Ok(None);
        }

        let tau = delays(problem);
        let reach = problem.inputs.last_known().max(until);
        let mut needed: Vec<(f64, LimitSide)> =
            (0..times.len()).map(|k| (times[k], side(times, k))).collect();
        for &delay in &used {
            let tau = tau[delay];
            if !tau.is_finite() {
                let delay = signature.delays[delay].to_string();
                return Err(IntegrateError::BadRequest(BadRequest::Delay { delay, value: tau }));
            }
            for k in 0..times.len() {
                let (t, side) = needed[k];
                let s = (t - tau).clamp(from, reach);
                needed.push((s, if s > from { side } else { LimitSide::Right }));
            }
        }
        let readings = needed.clone();
        needed.sort_by(|(a, a_side), (b, b_side)| {
            a.total_cmp(b).then((*a_side == LimitSide::Right).cmp(&(*b_side == LimitSide::Right)))
        });
        let mut all_times: Vec<f64> = Vec::with_capacity(needed.len());
        for (i, (t, side)) in needed.iter().enumerate() {
            let is_new = i == 0 || needed[i - 1].0 != *t;
            if is_new {
                all_times.push(*t);
                // A left limit is recorded together with the right one.
                if *side == LimitSide::Left {
                    all_times.push(*t);
                }
            }
        }

        let row = |(t, side): &(f64, LimitSide)| match side {
            LimitSide::Left => all_times.partition_point(|other| other < t),
            LimitSide::Right => all_times.partition_point(|other| other <= t) - 1,
        };
        let mut rows = readings.chunks_exact(times.len()).map(|chunk| chunk.iter().map(row));
        let first = rows.next().map(Iterator::collect).unwrap_or_default();
        let clocks = used
            .iter()
            .zip(rows)
            .map(|(&delay, rows)| DelayClock { delay, tau: tau[delay], rows: rows.collect() })
            .collect();
        Ok(Some(DelayedOutputTimes { all: all_times, asked: first, clocks }))
    }

    /// The solution at the requested `times`, from that at all times or at the first of them.
    pub fn split(&self, times: &[f64], all: Solution) -> Solution {
        let reached = self.asked.iter().take_while(|row| **row < all.len()).count();
        let (y, s, z) = pick(&all, &self.asked[..reached]);
        let past = self.asked[..reached].iter().flat_map(|row| all.past(*row));
        let past = past.copied().collect();
        let delayed = self
            .clocks
            .iter()
            .map(|DelayClock { delay, tau, rows }| {
                let rows = &rows[..reached];
                let (y, s, z) = pick(&all, rows);
                let times = rows.iter().map(|row| self.all[*row]).collect();
                let past = rows.iter().flat_map(|row| all.past(*row)).copied().collect();
                DelayedOutputValues { delay: *delay, tau: *tau, times, y, s, z, past }
            })
            .collect();
        Solution {
            times: times[..reached].to_vec(),
            y,
            s,
            z,
            past,
            delayed_outputs: delayed,
            ..all
        }
    }
}

/// y, S and z at some rows of a solution; NaN at rows that it did not reach.
fn pick(all: &Solution, rows: &[usize]) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let mut y = Vec::with_capacity(rows.len() * all.n);
    let mut s = Vec::with_capacity(rows.len() * all.n * all.n_s);
    let mut z = Vec::with_capacity(rows.len() * all.n_z);
    for &row in rows {
        if row < all.len() {
            y.extend_from_slice(all.y(row));
            s.extend_from_slice(all.s(row));
            z.extend_from_slice(all.z(row));
        } else {
            y.resize(y.len() + all.n, f64::NAN);
            s.resize(s.len() + all.n * all.n_s, f64::NAN);
            z.resize(z.len() + all.n_z, f64::NAN);
        }
    }
    (y, s, z)
}
