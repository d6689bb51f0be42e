//! Recursive least squares on a model's equations and outputs, along recordings.
//!
//! ```text
//!   a row that is linear in the free parameters p:   v̇ = z₀ + …  as   z = φᵀp
//!   both sides filtered by 1/Λ(s):   z = s/Λ v + 1/Λ z₀,  φ = 1/Λ φ₀  (and s/Λ where p multiplies ẏ)
//! ```
//!
//! so that no reading is differentiated. Between samples z₀, φ₀ and readings are linear, and they jump where held
//! inputs do. After a sample at which a row is unknown the filters are reinitialised.
//!
//! θ is p in units of its sizes, and P in units of their squares. With rows of several equations and outputs, each is
//! divided by the scatter of its residuals at the start, relative to that of the first.

use dgd_runtime::EvaluationPoint;
use nalgebra::DMatrix;

use crate::regression::error::RegressionError;
use crate::regression::finish::{RegressionFit, RegressionRound, finish};
use crate::regression::known::RecordingSamples;
use crate::regression::known::filters::LambdaFilter;
use crate::regression::least_squares::recursive::{
    ContinuousLeastSquares, Forgetting, RegressorSample,
};
use crate::regression::prepare::{self, PreparedRegression};
use crate::regression::rows::{RegressionRows, RowOf};
use crate::regression::separable::SeparableEnd;
use crate::regression::{RegressionMethod, RegressionProblem, structure};

/// Limit on the steps between two samples.
const MOST_STEPS: f64 = 1000.0;

/// Options of recursive estimation.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowOptions {
    /// Time constants τ of Λ(s) = Π (τ s + 1), s.
    pub time_constants: Vec<f64>,
    /// P₀, in squares of each parameter's size.
    pub start_variance: f64,
    /// β, R₀ in squares of the parameters' sizes, and n_s.
    pub forgetting: Forgetting,
}

/// Estimates over time.
#[derive(Debug, Clone)]
pub struct ParameterPath {
    /// The last estimates, and their fit of all rows; without standard deviations, which depend on the autocorrelation
    /// of the filtered errors.
    pub fit: RegressionFit,
    /// P at the end, SI.
    pub covariance: DMatrix<f64>,
    /// Recording, from 0, and time of each sample processed, s.
    pub times: Vec<(usize, f64)>,
    /// The estimates at these times, SI.
    pub estimates: Vec<Vec<f64>>,
    /// Time during which P was kept from growing, s.
    pub frozen: f64,
}

/// Tracks the free parameters along the recordings, one after the other.
///
/// # Errors
///
/// [`RegressionError`]: as [`regress`](super::regress) by linear least squares;
/// [`RegressionError::Filter`] for time constants that are not positive.
pub fn follow(
    problem: &RegressionProblem<'_>,
    options: &FollowOptions,
) -> Result<ParameterPath, RegressionError> {
    let Forgetting { rate, limit, .. } = options.forgetting;
    if !(rate >= 0.0 && rate.is_finite() && limit > 0.0) {
        return Err(RegressionError::Forgetting);
    }
    let prepared = PreparedRegression::new(problem)?;
    let known = prepared.known()?;
    let mut rows = prepared.rows(&known)?;
    let linear = structure::find_linear(problem.system, &mut rows, problem.p);
    if linear.contains(&false) {
        return Err(prepare::not_linear(problem, &mut rows, &linear));
    }
    let first = RegressionRound::first(&prepared, &mut rows)?;
    let n = prepared.free.len();
    let theta: Vec<f64> =
        prepared.free.iter().zip(&prepared.sizes).map(|(i, size)| prepared.p[*i] / size).collect();
    let p0 = DMatrix::from_diagonal_element(n, n, options.start_variance);
    let estimator = ContinuousLeastSquares::new(&theta, &p0, options.forgetting);
    let estimator = estimator.ok_or(RegressionError::StartVariance)?;
    let channels = rows.kinds.len() * 2 * (n + 1);
    let filter = LambdaFilter::with_time_constants(&options.time_constants, channels);
    let filter = filter.ok_or(RegressionError::Filter)?;
    let weights = first.sigma.iter().map(|sigma| first.sigma[0] / sigma).collect();

    let step = options.time_constants.iter().copied().fold(f64::INFINITY, f64::min);
    let mut following = PathEstimator { prepared: &prepared, weights, filter, estimator, step };
    let (mut times, mut estimates) = (Vec::new(), Vec::new());
    for (recording, known) in known.iter().enumerate() {
        following.along(&mut rows, recording, known, &mut |t, theta| {
            times.push((recording, t));
            estimates.push(theta.iter().zip(&prepared.sizes).map(|(z, size)| z * size).collect());
        });
    }
    let Some(last) = estimates.last() else {
        let rows = rows.kinds.iter().map(|kind| kind.name.clone()).collect();
        return Err(RegressionError::NeverTogether { rows });
    };
    let mut p = prepared.p.clone();
    for (i, value) in prepared.free.iter().zip(last as &Vec<f64>) {
        p[*i] = *value;
    }
    let bounds = prepared.bounds(RegressionMethod::LeastSquares);
    let first_round = RegressionRound::new(
        &prepared,
        &mut rows,
        &first,
        p.clone(),
        p,
        &bounds,
        &SeparableEnd::without_variables(2),
    )?;
    let mut fit =
        finish(&prepared, &mut rows, &linear, first_round, RegressionMethod::LeastSquares)?;
    fit.forget_uncertainty();
    let covariance = following.estimator.covariance();
    let sizes = &prepared.sizes;
    Ok(ParameterPath {
        fit,
        covariance: DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] * sizes[i] * sizes[j]),
        times,
        estimates,
        frozen: following.estimator.frozen(),
    })
}

struct PathEstimator<'a> {
    prepared: &'a PreparedRegression<'a>,
    weights: Vec<f64>,
    filter: LambdaFilter,
    estimator: ContinuousLeastSquares,
    /// The longest step, s.
    step: f64,
}

impl PathEstimator<'_> {
    fn along(
        &mut self,
        rows: &mut RegressionRows<'_>,
        recording: usize,
        known: &RecordingSamples,
        visit: &mut dyn FnMut(f64, &[f64]),
    ) {
        let n = self.prepared.free.len();
        let mut last: Option<(f64, Vec<f64>)> = None;
        for sample in known.first..known.times.len() {
            let t = known.times[sample];
            if known.is_cut(sample) && resets_a_row(rows) {
                // A value that jumps has no rate.
                last = None;
            }
            let now = self.signals(rows, recording, sample, known.point(sample, &self.prepared.p));
            let Some(now) = now else {
                last = None;
                continue;
            };
            match last.as_ref().filter(|(before, _)| t > *before) {
                None if last.is_none() => self.filter.settle(&now),
                // A jump of the inputs: rates start there.
                None => {}
                Some((before, from)) => {
                    let h = t - before;
                    let point = known.point_before(sample, &self.prepared.p);
                    let signals = self.signals(rows, recording, sample, point);
                    let next = signals.unwrap_or_else(|| now.clone());
                    self.filter.lead(from, &next, h);
                    let (filter, weights) = (&mut self.filter, &self.weights);
                    let (mut smoothed, mut rates) = (vec![0.0; next.len()], vec![0.0; next.len()]);
                    // Steps in which the filtered signals are nearly polynomial.
                    let steps = (h / self.step).ceil().clamp(1.0, MOST_STEPS);
                    for _ in 0..steps as usize {
                        self.estimator.advance(h / steps, &mut |tau| {
                            filter.after(tau, &mut smoothed, &mut rates);
                            let block = 2 * (n + 1);
                            let rows = smoothed.chunks_exact(block).zip(rates.chunks_exact(block));
                            rows.zip(weights)
                                .map(|((smoothed, rates), weight)| {
                                    sample_of(smoothed, rates, n, *weight)
                                })
                                .collect()
                        });
                        filter.advance(h / steps);
                    }
                }
            }
            visit(t, self.estimator.theta());
            last = Some((t, now));
        }
    }

    /// The signals to filter, row by row: z₀, φ₀ in sizes, and the signals that enter z and φ by their rates.
    fn signals(
        &self,
        rows: &mut RegressionRows<'_>,
        recording: usize,
        sample: usize,
        at: EvaluationPoint<'_>,
    ) -> Option<Vec<f64>> {
        let PreparedRegression { free, sizes, p, .. } = self.prepared;
        let n = free.len();
        let mut signals = vec![0.0; rows.kinds.len() * 2 * (n + 1)];
        let blocks = signals.chunks_exact_mut(2 * (n + 1)).enumerate();
        for (kind, block) in blocks {
            let (plain, by_rate) = block.split_at_mut(n + 1);
            let subject = rows.kinds[kind].of;
            let moved = match subject {
                // Only unknowns determined by readings have moved by themselves.
                RowOf::Equation(i) if rows.is_differential(kind, at) => {
                    if !rows.known[recording].is_given(sample, i) {
                        return None;
                    }
                    at.y[i]
                }
                RowOf::Equation(_) | RowOf::Output(_) => 0.0,
            };
            let measured = match subject {
                RowOf::Output(i) => rows.recordings[recording].measured[i].as_ref()?[sample],
                RowOf::Equation(_) => 0.0,
            };
            if !rows.kinds[kind].delayed.is_empty() && !rows.known[recording].has_past(sample) {
                return None;
            }
            let multiplier = rows.kinds[kind].multiplier;
            let multiplier = multiplier.filter(|_| rows.is_multiplied(kind, at));
            let (value, slopes) = rows.with_late(recording, at, |rows, at| {
                let (predicted, by_p) = rows.predict(at);
                (predicted[kind], by_p[kind * n..(kind + 1) * n].to_vec())
            });
            let factor = multiplier.map_or(1.0, |k| p[free[k]]);
            // g(p) = g(p̂) + Σ gⱼ (pⱼ − p̂ⱼ),  g = f or p_k f
            let mut constant = factor * value;
            for (j, i) in free.iter().enumerate() {
                let extra = if multiplier == Some(j) { value } else { 0.0 };
                let slope = factor * slopes[j] + extra;
                constant -= slope * p[*i];
                plain[1 + j] = slope * sizes[j];
            }
            plain[0] = measured - constant;
            match multiplier {
                None => by_rate[0] = moved,
                Some(k) => by_rate[1 + k] = -moved * sizes[k],
            }
        }
        signals.iter().all(|signal| signal.is_finite()).then_some(signals)
    }
}

/// Whether some transition resets an unknown whose equation has rows.
fn resets_a_row(rows: &RegressionRows<'_>) -> bool {
    let discrete = &rows.system().signature().discrete;
    let mut resets = discrete.transitions().flat_map(|(_, transition)| transition.resets.iter());
    resets.any(|i| rows.kinds.iter().any(|kind| kind.of == RowOf::Equation(*i)))
}

/// The row of filtered signals: smoothed signals, and rates of those that enter by their rates.
fn sample_of(smoothed: &[f64], rates: &[f64], n: usize, weight: f64) -> RegressorSample {
    let entry = |j: usize| weight * (smoothed[j] + rates[n + 1 + j]);
    RegressorSample { z: entry(0), phi: (1..=n).map(entry).collect() }
}
