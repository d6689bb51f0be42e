//! Gains of candidates from resampled errors that are unrelated to them.
//!
//! ```text
//!   r⊥  = (I − QQᵀ) r                       errors without their part in the fitted directions
//!   u_b = (I − Q_b Q_bᵀ)^(−1/2) r⊥_b         of block b, with the variance restored that a fit removed
//!   as it is:  z  = φ⊥ᵀr⊥ / ‖φ⊥‖
//!   resampled: z* = Σ_b s_b φ⊥_bᵀu_b / ‖φ⊥‖   s_b = ±1 at random
//! ```
//!
//! For white errors of unit variance Cov(r⊥_b) = I − Q_b Q_bᵀ. So Cov(u_b) = I, and the mean of z* ψ* over signs and
//! errors is φ⊥ᵀψ⊥/‖φ⊥‖‖ψ⊥‖ for any two candidates, as it is for the original errors. Signs of whole blocks preserve
//! the size and correlation of errors that are not white. All grid points of all candidates take part, equally for
//! original and resampled errors: using the largest accounts for the search.
//!
//! Sources: Wu, Ann. Stat. 14 (1986) 1261 (random signs); White, Econometrica 68 (2000) 1097 (the
//! maximum over candidates); Bell, McCaffrey, Survey Methodology 28 (2002) 169 (u_b).

use dgd_identify::keep_by_fields;
use nalgebra::{DMatrix, SymmetricEigen};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use super::projection::OrthonormalBasis;

/// Number of resamples.
pub(crate) const RESAMPLES: usize = 999;

/// Number of resamples if fewer do not settle whether noise could gain as much.
pub(crate) const MANY_RESAMPLES: usize = 9999;

/// Total number of blocks in all recordings: long enough to contain correlations, and enough of them for resampling.
pub(crate) const BLOCKS: usize = 100;

/// Fraction of a direction left by the fit within a block below which the fit has absorbed all of it.
const ALL_TAKEN: f64 = 1e-6;

/// Errors in blocks of time, ready to be resampled.
#[derive(Debug, Clone)]
pub(crate) struct ErrorBlocks {
    /// The block of each sample.
    blocks: Vec<usize>,
    /// r⊥.
    as_they_are: Vec<f64>,
    /// u.
    restored: Vec<f64>,
}

/// The possible gain of one λ at one point of a candidate's grid.
#[derive(Debug, Clone)]
pub(crate) struct PointContrast {
    /// φ⊥ᵀr⊥ / ‖φ⊥‖.
    as_it_is: f64,
    /// φ⊥_bᵀu_b / ‖φ⊥‖ for each block.
    parts: Vec<f64>,
    /// ‖φ⊥‖: the reciprocal of the standard deviation of λ.
    length: f64,
    /// Bounds of λ relative to its null.
    bounds: [f64; 2],
}

/// The possible gain of a candidate at one point of its grid.
#[derive(Debug, Clone)]
pub(crate) struct PointTrial {
    /// Position of the candidate.
    pub candidate: usize,
    /// One for each λ, orthogonal to each other.
    pub contrasts: Vec<PointContrast>,
}

keep_by_fields!(PointContrast { as_it_is, parts, length, bounds });

keep_by_fields!(PointTrial { candidate, contrasts });

impl PointContrast {
    /// λ relative to its null.
    pub(crate) fn estimate(&self) -> f64 {
        let [lower, upper] = self.bounds;
        (self.as_it_is / self.length).clamp(lower, upper)
    }

    /// The reciprocal of the standard deviation of λ.
    pub(crate) fn length(&self) -> f64 {
        self.length
    }

    /// The largest reduction of Σ (e/σ)².
    pub(crate) fn gain(&self) -> f64 {
        self.gain_of(self.as_it_is)
    }

    /// −Δ Σ(e/σ)² = 2 λ φ⊥ᵀr − λ² φ⊥ᵀφ⊥ with λ within bounds.
    fn gain_of(&self, along: f64) -> f64 {
        let [lower, upper] = self.bounds.map(|bound| bound * self.length);
        let estimate = along.clamp(lower, upper);
        estimate * (2.0 * along - estimate)
    }
}

impl ErrorBlocks {
    /// Errors in units of their noise, the block of each, and the directions that were fitted to them.
    pub(crate) fn new(
        errors: &[f64],
        blocks: Vec<usize>,
        fitted: &OrthonormalBasis,
    ) -> ErrorBlocks {
        let as_they_are = fitted.project_out(errors).unwrap_or_else(|| vec![0.0; errors.len()]);
        let mut restored = as_they_are.clone();
        let mut members = vec![Vec::new(); BLOCKS];
        for (k, block) in blocks.iter().enumerate() {
            members[*block].push(k);
        }
        for members in &members {
            restore(&mut restored, members, fitted.columns());
        }
        ErrorBlocks { blocks, as_they_are, restored }
    }

    /// Σ r⊥².
    pub(crate) fn square(&self) -> f64 {
        self.as_they_are.iter().map(|e| e * e).sum()
    }

    /// The possible gain of a column that is orthogonal to the fitted directions, with λ within bounds relative to its
    /// null.
    pub(crate) fn contrast(&self, column: &[f64], bounds: [f64; 2]) -> PointContrast {
        let (mut parts, mut along, mut square) = (vec![0.0; BLOCKS], 0.0, 0.0);
        for (k, (phi, block)) in column.iter().zip(&self.blocks).enumerate() {
            parts[*block] += phi * self.restored[k];
            along += phi * self.as_they_are[k];
            square += phi * phi;
        }
        let length = square.sqrt();
        for part in &mut parts {
            *part /= length;
        }
        PointContrast { as_it_is: along / length, parts, length, bounds }
    }
}

/// Restores to the samples of one block the variance that a fit removed.
///
/// With QᵀQ = V Λ Vᵀ, where Q are the rows of the block, (I − QQᵀ)^(−1/2) = I + Q V diag(((1 − λ)^(−1/2) − 1)/λ) Vᵀ Qᵀ.
fn restore(errors: &mut [f64], block: &[usize], directions: &[Vec<f64>]) {
    let n = directions.len();
    if n == 0 || block.is_empty() {
        return;
    }
    let rows = DMatrix::from_fn(block.len(), n, |k, j| directions[j][block[k]]);
    let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(rows.tr_mul(&rows));
    let errors_here = nalgebra::DVector::from_fn(block.len(), |k, _| errors[block[k]]);
    let mut along = eigenvectors.tr_mul(&rows.tr_mul(&errors_here));
    for (along, taken) in along.iter_mut().zip(&eigenvalues) {
        let left = 1.0 - taken;
        let scale = if left > ALL_TAKEN { left.powf(-0.5) } else { 0.0 };
        // For small λ the series 1/2 + 3λ/8.
        *along *= if *taken > 1e-8 { (scale - 1.0) / taken } else { 0.5 };
    }
    let change = rows * (eigenvectors * along);
    for (k, change) in block.iter().zip(&change) {
        errors[*k] += change;
    }
}

impl PointTrial {
    /// The trial with the resampled errors of each block scaled by `sizes`.
    pub(crate) fn with_errors_of(mut self, sizes: &[f64; BLOCKS]) -> PointTrial {
        for contrast in &mut self.contrasts {
            for (part, size) in contrast.parts.iter_mut().zip(sizes) {
                *part *= size;
            }
        }
        self
    }

    /// Its gain from the original errors.
    fn gain(&self) -> f64 {
        self.contrasts.iter().map(PointContrast::gain).sum()
    }

    /// Its gain from errors with other signs.
    fn resampled_gain(&self, signs: &[f64; BLOCKS]) -> f64 {
        let along = |parts: &[f64]| parts.iter().zip(signs).map(|(part, sign)| part * sign).sum();
        self.contrasts.iter().map(|contrast| contrast.gain_of(along(&contrast.parts))).sum()
    }
}

/// The largest gain of candidates from the original errors.
pub(crate) fn gain<'a>(trials: impl IntoIterator<Item = &'a PointTrial>) -> f64 {
    trials.into_iter().map(PointTrial::gain).fold(0.0, f64::max)
}

/// Probability that the best of all candidates gains as much from resampled errors as observed; a multiple of 1/1000.
///
/// It is uniformly distributed if nothing is missing and `observed` is the best gain from the original errors: the rank
/// of that among the resamples, with ties broken at random.
pub(crate) fn p_value(trials: &[PointTrial], observed: f64, random: &mut Pcg64) -> f64 {
    resampled_p_value(trials, observed, RESAMPLES, random)
}

/// [`p_value`] from a given number of resamples.
pub(crate) fn resampled_p_value(
    trials: &[PointTrial],
    observed: f64,
    resamples: usize,
    random: &mut Pcg64,
) -> f64 {
    let (mut above, mut ties) = (0, 0);
    let mut signs = [0.0; BLOCKS];
    for _ in 0..resamples {
        for sign in &mut signs {
            *sign = if random.next_u64() >> 63 == 0 { 1.0 } else { -1.0 };
        }
        let best = trials.iter().map(|t| t.resampled_gain(&signs)).fold(0.0, f64::max);
        above += usize::from(best > observed);
        ties += usize::from(best == observed);
    }
    let above_of_ties = (random.next_u64() % (ties as u64 + 1)) as usize;
    (1 + above + above_of_ties) as f64 / (1 + resamples) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uniform::kolmogorov_smirnov;

    const SAMPLES: usize = 600;

    fn normal(random: &mut Pcg64) -> f64 {
        let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        (-2.0 * (1.0 - uniform()).ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
    }

    fn column(f: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..SAMPLES).map(|k| f(k as f64 / SAMPLES as f64)).collect()
    }

    /// p-values of white errors without any effect, whose size grows from one to `last`.
    fn p_values(last: f64, number: u128) -> Vec<f64> {
        // Directions like those of start values, over a few blocks, and of parameters, over all times.
        let mut directions: Vec<Vec<f64>> =
            [30.0, 60.0, 120.0].map(|rate| column(|t| (-rate * t).exp())).to_vec();
        directions
            .extend((0..9).map(|k| column(|t| (std::f64::consts::PI * f64::from(k) * t).cos())));
        let fitted = OrthonormalBasis::new(&directions);
        // Onsets, some of them near an end; a spike of a few blocks; a column of one sign.
        let steps = [0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.98];
        let mut columns: Vec<Vec<f64>> =
            steps.map(|since| column(|t| f64::from(u8::from(t > since)))).to_vec();
        columns.push(column(|t| (-((t - 0.4) / 0.01).powi(2)).exp()));
        columns.push(column(|t| t.powi(9)));
        let columns: Vec<Vec<f64>> =
            columns.iter().map(|column| fitted.project_out(column).unwrap()).collect();
        let blocks: Vec<usize> = (0..SAMPLES).map(|k| k * BLOCKS / SAMPLES).collect();
        let sizes = column(|t| 1.0 + (last - 1.0) * t);
        let of_seed = |seed: u128| {
            let mut random = Pcg64::new(seed, 7);
            let errors: Vec<f64> = sizes.iter().map(|size| size * normal(&mut random)).collect();
            let errors = ErrorBlocks::new(&errors, blocks.clone(), &fitted);
            let any = [f64::NEG_INFINITY, f64::INFINITY];
            let trials = columns.iter().enumerate().map(|(k, column)| {
                let bounds = if k + 1 == columns.len() { [0.0, f64::INFINITY] } else { any };
                // All steps are one candidate.
                let candidate = k.saturating_sub(steps.len() - 1);
                PointTrial { candidate, contrasts: vec![errors.contrast(column, bounds)] }
            });
            let trials: Vec<PointTrial> = trials.collect();
            p_value(&trials, gain(&trials), &mut random)
        };
        (0..number).map(of_seed).collect()
    }

    #[test]
    fn p_values_are_uniform_where_nothing_is_hidden() {
        for last in [1.0, 3.0] {
            let p = kolmogorov_smirnov(&p_values(last, 500));
            assert!(p > 0.01, "up to {last}: {p}");
        }
    }

    #[test]
    fn a_test_of_one_side_alone_is_uniform_too() {
        // Half of all errors then gain nothing: ties, whose ranks are drawn at random.
        let fitted = OrthonormalBasis::new(&[column(|_| 1.0)]);
        let line = fitted.project_out(&column(|t| t)).unwrap();
        let blocks: Vec<usize> = (0..SAMPLES).map(|k| k * BLOCKS / SAMPLES).collect();
        let of_seed = |seed: u128| {
            let mut random = Pcg64::new(seed, 8);
            let errors: Vec<f64> = (0..SAMPLES).map(|_| normal(&mut random)).collect();
            let contrast = ErrorBlocks::new(&errors, blocks.clone(), &fitted)
                .contrast(&line, [0.0, f64::INFINITY]);
            let trials = [PointTrial { candidate: 0, contrasts: vec![contrast] }];
            p_value(&trials, gain(&trials), &mut random)
        };
        let all: Vec<f64> = (0..500).map(of_seed).collect();
        let p = kolmogorov_smirnov(&all);
        assert!(p > 0.01, "{p}");
    }

    #[test]
    fn the_variance_that_a_fit_took_comes_back() {
        // Σ over blocks of (φ_bᵀu_b)² has the mean ‖φ‖², whatever was fitted.
        let directions: Vec<Vec<f64>> =
            [40.0, 80.0, 0.0, 3.0].map(|rate| column(|t| (-rate * t).exp())).to_vec();
        let fitted = OrthonormalBasis::new(&directions);
        let phi = fitted.project_out(&column(|t| (-((t - 0.02) / 0.02).powi(2)).exp())).unwrap();
        let blocks: Vec<usize> = (0..SAMPLES).map(|k| k * BLOCKS / SAMPLES).collect();
        let mut random = Pcg64::new(1, 1);
        let (mut sum, mut squares, n) = (0.0, 0.0, 2000);
        for _ in 0..n {
            let errors: Vec<f64> = (0..SAMPLES).map(|_| normal(&mut random)).collect();
            let errors = ErrorBlocks::new(&errors, blocks.clone(), &fitted);
            let contrast = errors.contrast(&phi, [f64::NEG_INFINITY, f64::INFINITY]);
            let square: f64 = contrast.parts.iter().map(|part| part * part).sum();
            sum += square;
            squares += square * square;
        }
        let mean = sum / f64::from(n);
        let std = (squares / f64::from(n) - mean * mean).sqrt() / f64::from(n).sqrt();
        assert!((mean - 1.0).abs() < 4.0 * std, "{mean} ± {std}");
    }

    #[test]
    fn a_large_effect_in_a_few_blocks_is_chance_among_its_own_errors_and_not_among_the_noise() {
        let mut random = Pcg64::new(5, 0);
        let column: Vec<f64> =
            (0..SAMPLES).map(|k| if k < SAMPLES / 25 { 1.0 } else { 0.0 }).collect();
        let errors: Vec<f64> = column.iter().map(|c| 10.0 * c + normal(&mut random)).collect();
        let blocks: Vec<usize> = (0..SAMPLES).map(|k| k * BLOCKS / SAMPLES).collect();
        let errors = ErrorBlocks::new(&errors, blocks, &OrthonormalBasis::new(&[]));
        let trial = PointTrial {
            candidate: 0,
            contrasts: vec![errors.contrast(&column, [f64::NEG_INFINITY, f64::INFINITY])],
        };
        let observed = trial.gain();
        let mut sizes = [1.0; BLOCKS];
        sizes[..BLOCKS / 25].fill(0.1);
        let mut p = |trial: PointTrial| p_value(&[trial], observed, &mut random);
        // Four blocks have the same sign in one of eight resamples.
        let among_errors = p(trial.clone());
        assert!((among_errors - 0.125 / 2.0).abs() < 0.07, "{among_errors}");
        assert_eq!(p(trial.with_errors_of(&sizes)), 0.001);
    }
}
