//! How strongly the data speaks for an effect.
//!
//! Residuals are correlated in time, so that resampling keeps blocks of them together.
//!
//! - p-value: the signs of blocks of the residual before the effect came in are drawn at random,
//!   which leaves their size and correlation and destroys what they have in common with any
//!   candidate; how often does the *best* of all candidates then gain as much? (Wild bootstrap: Wu,
//!   Ann. Stat. 14 (1986) 1261; the maximum over candidates: White, Econometrica 68 (2000) 1097.)
//! - inclusion: blocks are drawn with replacement; how often has the structure with the least
//!   criterion the effect?

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use crate::discovery::Evidence;
use crate::fitted::Data;
use crate::screen::{Score, weighted};
use crate::search::Search;

/// Resamples.
const RESAMPLES: usize = 999;

/// Blocks in all recordings together: long enough to hold a correlation, many enough to be drawn.
const BLOCKS: usize = 100;

/// Evidence for one effect of a structure.
pub(crate) fn evidence(
    search: &mut Search<'_>,
    chosen: &[usize],
    effect: usize,
    seed: u64,
) -> Evidence {
    let rest: Vec<usize> = chosen.iter().copied().filter(|c| *c != effect).collect();
    let bic_gain = search.bic(&rest).zip(search.bic(chosen)).map_or(0.0, |(a, b)| a - b);
    let mut random = Pcg64::new(u128::from(seed), 1 + effect as u128);
    let scores = search.screened(&rest);
    Evidence {
        p_value: p_value(search, &rest, &scores, effect, &mut random),
        resamples: RESAMPLES,
        bic_gain,
        inclusion: inclusion(search, effect, &mut random),
    }
}

/// The block of each weighted residual, in their order.
fn blocks(data: &Data<'_>, residuals: &[Vec<Vec<f64>>]) -> Vec<usize> {
    let samples: usize = data.train.iter().map(|recording| recording.times.len()).sum();
    let (mut all, mut before) = (Vec::new(), 0);
    for (recording, outputs) in data.train.iter().zip(residuals) {
        for (values, noise) in outputs.iter().zip(&data.noise) {
            let measured =
                values.iter().enumerate().filter(|(_, e)| noise.is_some() && e.is_finite());
            all.extend(measured.map(|(k, _)| (before + k) * BLOCKS / samples.max(1)));
        }
        before += recording.times.len();
    }
    all
}

fn p_value(
    search: &Search<'_>,
    rest: &[usize],
    scores: &[Score],
    effect: usize,
    random: &mut Pcg64,
) -> f64 {
    let Some(fitted) = search.fitted(rest) else { return 1.0 };
    let residuals = fitted.residuals(&search.data);
    let residual = weighted(&search.data, &residuals);
    let blocks = blocks(&search.data, &residuals);
    // φ⊥ᵀr of each block, in units of ‖φ⊥‖.
    let parts = |column: &Vec<f64>| {
        let mut parts = vec![0.0; BLOCKS];
        for ((a, r), block) in column.iter().zip(&residual).zip(&blocks) {
            parts[*block] += a * r;
        }
        let length = column.iter().map(|a| a * a).sum::<f64>().sqrt();
        for part in &mut parts {
            *part /= length;
        }
        parts
    };
    let columns: Vec<(usize, Vec<Vec<f64>>)> = scores
        .iter()
        .map(|score| (score.candidate, score.columns.iter().map(parts).collect()))
        .collect();
    let gain = |columns: &[Vec<f64>], signs: &[f64]| -> f64 {
        let along = |parts: &Vec<f64>| parts.iter().zip(signs).map(|(p, s)| p * s).sum::<f64>();
        columns.iter().map(|parts| along(parts).powi(2)).sum()
    };
    let as_it_is = [1.0; BLOCKS];
    let Some((_, own)) = columns.iter().find(|(candidate, _)| *candidate == effect) else {
        return 1.0;
    };
    let observed = gain(own, &as_it_is);
    let mut as_good = 0;
    let mut signs = [0.0; BLOCKS];
    for _ in 0..RESAMPLES {
        for sign in &mut signs {
            *sign = if random.next_u64() >> 63 == 0 { 1.0 } else { -1.0 };
        }
        let best = columns.iter().map(|(_, parts)| gain(parts, &signs)).fold(0.0, f64::max);
        as_good += usize::from(best >= observed);
    }
    (1 + as_good) as f64 / (1 + RESAMPLES) as f64
}

fn inclusion(search: &Search<'_>, effect: usize, random: &mut Pcg64) -> f64 {
    // Σ (e/σ)² of each block, for each structure.
    let structures: Vec<(bool, f64, Vec<f64>)> = search
        .ranked()
        .iter()
        .filter_map(|chosen| {
            let fitted = search.fitted(chosen)?;
            let residuals = fitted.residuals(&search.data);
            let residual = weighted(&search.data, &residuals);
            let mut sums = vec![0.0; BLOCKS];
            for (e, block) in residual.iter().zip(blocks(&search.data, &residuals)) {
                sums[block] += e * e;
            }
            let penalty = fitted.free() as f64 * (residual.len() as f64).ln();
            Some((chosen.contains(&effect), penalty, sums))
        })
        .collect();
    let mut included = 0;
    let mut counts = [0.0; BLOCKS];
    for _ in 0..RESAMPLES {
        counts.fill(0.0);
        for _ in 0..BLOCKS {
            counts[(random.next_u64() % BLOCKS as u64) as usize] += 1.0;
        }
        let criterion = |(_, penalty, sums): &(bool, f64, Vec<f64>)| {
            penalty + sums.iter().zip(&counts).map(|(sum, count)| sum * count).sum::<f64>()
        };
        let best = structures.iter().min_by(|a, b| criterion(a).total_cmp(&criterion(b)));
        included += usize::from(best.is_some_and(|(has, ..)| *has));
    }
    included as f64 / RESAMPLES as f64
}
