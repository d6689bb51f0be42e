//! The spread of estimates between parts of the recordings and between outputs: uncertainty due to model errors.
//!
//! A covariance shrinks with every sample, but a bias does not. A bias shows when parts of the recordings require
//! different parameters. Each part b of B is left out once, with one Gauss–Newton step from the estimate, and its own
//! value is the pseudo-value
//!
//! ```text
//!   θ̂₍b₎ = θ̂ − (H − H_b)⁻¹ (g − g_b)             H, g: information and gradient of all samples and priors
//!   θ̃_b  = θ̂ + (B − 1)(θ̂ − θ̂₍b₎)                 estimate from b alone, if it were as good as the others
//!   s²   = Σ_b (θ̃_b − mean θ̃)²/(B − 1)
//! ```
//!
//! The outputs are left out one by one, too: if sensors disagree about a parameter, the error of the estimate is about
//! as large as its shift, and
//!
//! ```text
//!   s_model² = s² + max_o (θ̂₍o₎ − θ̂)²             o: outputs without which θ is still determined
//! ```
//!
//! s is the spread of estimates from single parts about their mean, and not s/√B, the standard error of that mean:
//! model errors do not average out like noise. For a right model with white noise, s is √B times the standard
//! deviation. It misses errors that all parts and outputs have in common.
//!
//! Sources: Tukey, Ann. Math. Stat. 29 (1958) 614, pseudo-values; Fox, Hinkley, Larntz, Technometrics 22 (1980)
//! 29, one step for each in nonlinear regression; Wu, Ann. Stat. 14 (1986) 1261, deleting more than one.

use dgd_runtime::parallel::in_parallel_by_model;
use dgd_runtime::{Direction, Options};
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use crate::error::{EstimateError, TrialFailed};
use crate::intervals::cells::{
    CellSums, SampleCell, SampleWeights, SimulatedAt, cells, cells_of, parts,
};
use crate::noise::NoiseSource;
use crate::output_error::OutputErrorProblem;
use crate::output_error::fit::{Fit, unseen};
use crate::uncertainty::ParameterEstimate;
use crate::variables::FitVariables;

/// Minimum number of parts for a meaningful spread.
const LEAST_PARTS: usize = 4;

/// An estimate depends on one part if the others alone would determine it this many times less well.
const RESTS: f64 = 10.0;

/// Keeps a factorisation from failing if the other parts contain no information; in variances.
const RIDGE: f64 = 1e-9;

/// A part of the recordings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JackknifeBlock {
    /// The first and the last recording with samples in it.
    pub recordings: [usize; 2],
    /// Start time in the first recording and end time in the last, s.
    pub from: f64,
    /// See `from`.
    pub until: f64,
}

/// The spread of estimates between parts of the recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct Jackknife {
    /// The parts, in order.
    pub parts: Vec<JackknifeBlock>,
    /// For each estimate, the standard deviation between single parts combined with its shift without one of the
    /// outputs, SI; `None` for start values, at a bound, and if it is not determined, or depends on one part.
    pub std: Vec<Option<f64>>,
    /// For each estimate that depends on one part, that part.
    pub rests_on: Vec<Option<usize>>,
}

/// The point at which parts are compared: estimates, and weights of samples.
#[derive(Debug, Clone, Copy)]
pub struct SpreadAt<'a> {
    /// All parameters, SI.
    pub p: &'a [f64],
    /// The estimates. Parameters without derivatives are not among them.
    pub estimates: &'a [ParameterEstimate],
    /// σ of each output, SI; `None` if it was not fitted.
    pub sigma: &'a [Option<f64>],
}

impl Fit {
    /// The spread of estimates between parts of the recordings; `None` if these have too few samples to be divided.
    ///
    /// # Errors
    ///
    /// If the problem cannot be simulated at the estimates of the fit.
    pub fn spread(
        &self,
        problem: &OutputErrorProblem<'_>,
    ) -> Result<Option<Jackknife>, EstimateError> {
        // Parts are weighted by σ of outputs, but single samples may have their own.
        let is_likelihood =
            |noise: &Option<NoiseSource>| noise.is_some_and(NoiseSource::is_likelihood);
        if problem.noise.iter().any(is_likelihood) {
            return Ok(None);
        }
        let options = self.simulated(&problem.options);
        let point = SpreadAt { p: &self.p, estimates: &self.estimates, sigma: &self.noise };
        spread(&OutputErrorProblem { options, ..problem.clone() }, point)
    }
}

/// The spread of estimates between parts of the recordings; `None` if these have too few samples to be divided.
///
/// # Errors
///
/// If the problem cannot be simulated there.
pub fn spread(
    problem: &OutputErrorProblem<'_>,
    at: SpreadAt<'_>,
) -> Result<Option<Jackknife>, EstimateError> {
    let SpreadAt { p, estimates, sigma } = at;
    let directions = &problem.system.signature().directions;
    let is_estimated = |of: &Direction| estimates.iter().any(|estimate| estimate.of == *of);
    let free: Vec<bool> = directions.iter().map(is_estimated).collect();
    let (variables, mut z) = FitVariables::new(problem.system, p, problem.recordings, &free)?;
    let estimate_of = |i: usize| {
        let variable = &variables.all[i];
        let is_own =
            |e: &ParameterEstimate| e.of == variable.of && e.recording == variable.recording;
        estimates.iter().position(is_own)
    };
    let places: Vec<Option<usize>> = (0..variables.len()).map(estimate_of).collect();
    let mut is_fixed = vec![true; variables.len()];
    for (i, place) in places.iter().enumerate() {
        let Some(estimate) = place.map(|place| &estimates[place]) else { continue };
        is_fixed[i] = estimate.at_bound.is_some();
        z[i] = variables.all[i].variable(estimate.value);
    }

    let differentiated = DifferentiatedVariables { variables: &variables, z: &z };
    let [cells, by_output] = all_cells(problem, &differentiated, p, sigma)?;
    let Some(seen) =
        Whitening::new(&differentiated.priors(problem, p, &cells), &is_fixed, problem.options)
    else {
        return Ok(None);
    };
    let shares = seen.shares(&differentiated, &cells);
    let recordings: Vec<usize> = cells.iter().map(|cell| cell.recording).collect();
    let known: f64 = shares.iter().sum();
    if known.is_nan() || known <= 0.0 {
        return Ok(None);
    }
    let runs = parts(&recordings, &shares);
    if runs.len() < LEAST_PARTS {
        return Ok(None);
    }
    let without: Vec<LeaveOneOut> =
        runs.iter().map(|run| seen.without(&differentiated, &cells[run.clone()])).collect();
    // Cells of one output each, in the order of recordings and outputs.
    let without_output = |output: usize| {
        let cells_of_output: Vec<SampleCell> =
            by_output.iter().skip(output).step_by(sigma.len()).cloned().collect();
        seen.without(&differentiated, &cells_of_output)
    };
    let fitted = (0..sigma.len()).filter(|output| sigma[*output].is_some());
    let without_outputs: Vec<LeaveOneOut> = fitted.map(without_output).collect();
    let mut spread = Jackknife {
        parts: runs.iter().map(|run| JackknifeBlock::from_cells(&cells[run.clone()])).collect(),
        std: vec![None; estimates.len()],
        rests_on: vec![None; estimates.len()],
    };
    for (i, place) in places.iter().enumerate().take(variables.n_shared) {
        let Some(place) = place.filter(|place| estimates[*place].std.is_some()) else { continue };
        let most = (0..without.len())
            .max_by(|a, b| without[*a].inflation[i].total_cmp(&without[*b].inflation[i]));
        spread.rests_on[place] = most.filter(|part| without[*part].inflation[i] > RESTS);
        if spread.rests_on[place].is_none() {
            let moved = without.iter().map(|without| without.moved[i]);
            let known = without_outputs.iter().filter(|without| without.inflation[i] <= RESTS);
            let furthest = known.map(|without| without.moved[i].abs()).fold(0.0, f64::max);
            let std = of_pseudo_values(moved).hypot(furthest) * variables.all[i].slope(z[i]);
            spread.std[place] = std.is_finite().then_some(std);
        }
    }
    Ok(Some(spread))
}

/// The standard deviation of pseudo-values, from the shifts of an estimate when each part is left out.
fn of_pseudo_values(moved: impl ExactSizeIterator<Item = f64> + Clone) -> f64 {
    let n = moved.len() as f64;
    let mean = moved.clone().sum::<f64>() / n;
    let squares: f64 = moved.map(|moved| ((n - 1.0) * (moved - mean)).powi(2)).sum();
    (squares / (n - 1.0)).sqrt()
}

impl JackknifeBlock {
    /// A part of consecutive cells.
    fn from_cells(cells: &[SampleCell]) -> JackknifeBlock {
        let (first, last) = (&cells[0], &cells[cells.len() - 1]);
        JackknifeBlock {
            recordings: [first.recording, last.recording],
            from: first.from,
            until: last.until,
        }
    }
}

/// Variables with their values.
struct DifferentiatedVariables<'a> {
    variables: &'a FitVariables,
    z: &'a [f64],
}

/// Information and gradient over all variables.
struct JackknifeEquations {
    information: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl DifferentiatedVariables<'_> {
    /// The sum over some cells.
    fn sum(&self, cells: &[SampleCell]) -> JackknifeEquations {
        let n = self.variables.len();
        let mut sum =
            JackknifeEquations { information: DMatrix::zeros(n, n), gradient: DVector::zeros(n) };
        for cell in cells {
            let position = |i: usize| self.variables.position(cell.recording, i);
            let mut place = cell.information.iter();
            for (i, gradient) in cell.gradient.iter().enumerate() {
                let row = position(i);
                sum.gradient[row] += gradient;
                for (j, term) in place.by_ref().take(i + 1).enumerate() {
                    sum.information[(row, position(j))] += term;
                }
            }
        }
        sum.information.fill_upper_triangle_with_lower_triangle();
        sum
    }

    /// The sum over all cells and priors.
    fn priors(
        &self,
        problem: &OutputErrorProblem<'_>,
        p: &[f64],
        cells: &[SampleCell],
    ) -> JackknifeEquations {
        let mut sum = self.sum(cells);
        let p = self.variables.parameters(p, self.z);
        let terms =
            problem.priors.iter().filter_map(|prior| prior.term(self.variables, &p, self.z));
        for term in terms {
            term.add_gradient(&mut sum.gradient);
            term.add_information(&mut sum.information);
        }
        sum
    }
}

/// Cells of all recordings, and contributions of each output of each recording.
fn all_cells(
    problem: &OutputErrorProblem<'_>,
    of: &DifferentiatedVariables<'_>,
    p: &[f64],
    sigma: &[Option<f64>],
) -> Result<[Vec<SampleCell>; 2], EstimateError> {
    let OutputErrorProblem { system, recordings, options, threads, .. } = problem;
    let DifferentiatedVariables { variables, z, .. } = of;
    let numbers = cells_of(recordings, variables.n_shared + variables.n_start);
    let weights = SampleWeights { sigma, loss: problem.loss };
    let results = in_parallel_by_model(*system, recordings.len(), *threads, |system, r| {
        let start = variables.starts(r, &recordings[r].start, z);
        let point = SimulatedAt { p, start: &start, options };
        cells(system, (r, &recordings[r]), point, &variables.columns(r, z), weights, numbers[r])
    });
    let mut divided = [Vec::new(), Vec::new()];
    for (recording, result) in results.into_iter().enumerate() {
        let failed = |reason| EstimateError::Start(TrialFailed { recording, reason });
        let CellSums { cells, outputs } = result.map_err(failed)?;
        divided[0].extend(cells);
        divided[1].extend(outputs);
    }
    Ok(divided)
}

/// Coordinates y in which the information of all samples is the identity: z = Tᵀy.
struct Whitening {
    /// T, of the combinations that outputs determine.
    t: DMatrix<f64>,
    /// T g.
    gradient: DVector<f64>,
}

/// The estimates without a part.
struct LeaveOneOut {
    /// Shift of each variable.
    moved: Vec<f64>,
    /// Relative increase of its standard deviation.
    inflation: Vec<f64>,
}

impl Whitening {
    /// `None` if no combination is determined.
    fn new(normal: &JackknifeEquations, held: &[bool], options: Options) -> Option<Whitening> {
        let (h, n) = (&normal.information, held.len());
        let size = DVector::from_fn(n, |i, _| match h[(i, i)] {
            own if own > 0.0 && own.is_finite() && !held[i] => own.sqrt().recip(),
            _ => 0.0,
        });
        if size.iter().all(|size| *size == 0.0) {
            return None;
        }
        let scaled = DMatrix::from_fn(n, n, |i, j| size[i] * size[j] * h[(i, j)]);
        let eigen = SymmetricEigen::try_new(scaled, f64::EPSILON, 1000)?;
        let least = unseen(options.rtol) * eigen.eigenvalues.max();
        let kept: Vec<usize> = (0..n).filter(|k| eigen.eigenvalues[*k] > least).collect();
        let t = DMatrix::from_fn(kept.len(), n, |k, i| {
            size[i] * eigen.eigenvectors[(i, kept[k])] / eigen.eigenvalues[kept[k]].sqrt()
        });
        let gradient = &t * &normal.gradient;
        Some(Whitening { t, gradient })
    }

    /// For each cell, the sum over parameters of its share of their information: (C H_c C)ᵢᵢ/Cᵢᵢ with C = TᵀT, the
    /// squares of sensitivities without the components that the other parameters could mimic.
    fn shares(&self, of: &DifferentiatedVariables<'_>, cells: &[SampleCell]) -> Vec<f64> {
        let parameters = (0..of.variables.n_shared).filter(|i| self.t.column(*i).norm() > 0.0);
        let alone: Vec<DVector<f64>> = parameters
            .map(|i| self.t.tr_mul(&self.t.column(i)) / self.t.column(i).norm())
            .collect();
        let share = |cell: &SampleCell| -> f64 {
            let squares = alone.iter().map(|along| {
                let position = |i: usize| along[of.variables.position(cell.recording, i)];
                let positions: Vec<f64> = (0..cell.gradient.len()).map(position).collect();
                cell.square(&positions)
            });
            squares.sum()
        };
        cells.iter().map(share).collect()
    }

    /// One step to the minimum without some cells.
    fn without(&self, of: &DifferentiatedVariables<'_>, cells: &[SampleCell]) -> LeaveOneOut {
        let part = of.sum(cells);
        let m = self.t.nrows();
        let mut rest = DMatrix::identity(m, m) * (1.0 + RIDGE);
        rest -= &self.t * part.information * self.t.transpose();
        let n = of.variables.len();
        let Some(rest) = Cholesky::new(rest) else {
            return LeaveOneOut { moved: vec![f64::NAN; n], inflation: vec![f64::INFINITY; n] };
        };
        let step = rest.solve(&(&self.gradient - &self.t * part.gradient));
        // Less the remaining step to the minimum of all cells.
        let moved = self.t.tr_mul(&(&self.gradient - step));
        let spread = rest.l().solve_lower_triangular(&self.t);
        let inflation = |i: usize| {
            let norm = self.t.column(i).norm();
            spread.as_ref().map_or(f64::INFINITY, |spread| spread.column(i).norm() / norm)
        };
        LeaveOneOut {
            moved: moved.iter().copied().collect(),
            inflation: (0..n).map(inflation).collect(),
        }
    }
}
