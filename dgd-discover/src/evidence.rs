//! How strongly the data speaks for an effect.
//!
//! Residuals are correlated in time, so that resampling keeps blocks of them together.
//!
//! - p-value: the signs of blocks of the residual before the effect came in are drawn at random,
//!   which leaves their size and correlation and destroys what they have in common with any
//!   candidate; how often does the *best* of all candidates then gain as much (`resampled.rs`)?
//! - inclusion: blocks are drawn with replacement; how often has the structure with the least
//!   criterion the effect?

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use crate::discovery::Evidence;
use crate::resampled::{
    BLOCKS, MANY_RESAMPLES, RESAMPLES, Trial, gain, p_value, resampled_p_value,
};
use crate::screen::{blocks, weighted};
use crate::search::Search;

/// Evidence for one effect of a structure, and its inclusion where other forms of it and its alternatives count
/// as well.
pub(crate) fn evidence(
    search: &mut Search<'_>,
    chosen: &[usize],
    effect: usize,
) -> (Evidence, f64) {
    let rest: Vec<usize> = chosen.iter().copied().filter(|c| *c != effect).collect();
    let bic_gain = search.bic(&rest).zip(search.bic(chosen)).map_or(0.0, |(a, b)| a - b);
    let mut random = Pcg64::new(u128::from(search.seed), 1 + effect as u128);
    let trials = search.trials(&rest);
    let own = trials.iter().filter(|trial| trial.candidate == effect);
    // To first order an effect that is large, or jumps, promises far less than its refit gains.
    let left = |chosen: &[usize]| search.training_error(chosen).map_or(0.0, |(sum, _)| sum);
    let observed = gain(own).max(left(&rest) - left(chosen));
    let p_value = p_value(&trials, observed, &mut random);
    let alternatives = search.alternatives(chosen, effect).into_iter().map(|other| other.candidate);
    let forms = (0..search.candidates.len()).filter(|form| search.are_forms(*form, effect));
    let alike: Vec<usize> = alternatives.chain(forms).collect();
    let [own, with_alike] = inclusion(search, effect, &alike, &mut random);
    (Evidence { p_value, resamples: RESAMPLES, bic_gain, inclusion: own }, with_alike)
}

/// Whether the best candidate gains more in the base model than in any of ten thousand resamples of its errors.
pub(crate) fn is_no_chance(trials: &[Trial], seed: u64) -> bool {
    let p_value = p_value_of_the_base(trials, seed, true);
    p_value.is_some_and(|p| p <= 1.0 / (1 + MANY_RESAMPLES) as f64)
}

/// Probability that, with nothing hidden, the best candidate promises as much as it does in the base
/// model, from many resamples where few say that it does not. `None` where there is nothing to try.
pub(crate) fn p_value_of_the_base(trials: &[Trial], seed: u64, many: bool) -> Option<f64> {
    let mut random = Pcg64::new(u128::from(seed), 0);
    let p = (!trials.is_empty()).then(|| p_value(trials, gain(trials), &mut random))?;
    if !many || p > 1.0 / (1 + RESAMPLES) as f64 {
        return Some(p);
    }
    Some(resampled_p_value(trials, gain(trials), MANY_RESAMPLES, &mut random))
}

/// Share of resamples whose best structure has an effect, and share in which it has that or one that is alike.
fn inclusion(search: &Search<'_>, effect: usize, alike: &[usize], random: &mut Pcg64) -> [f64; 2] {
    // Σ (e/σ)² of each block, for each structure.
    let structures: Vec<([bool; 2], f64, Vec<f64>)> = search
        .ranked()
        .iter()
        .filter_map(|chosen| {
            let fitted = search.fitted(chosen)?;
            let residuals = fitted.residuals(&search.data);
            let residual = weighted(&search.data, &residuals);
            let mut sums = vec![0.0; BLOCKS];
            for (e, block) in residual.iter().zip(blocks(&search.data, &residuals, BLOCKS)) {
                sums[block] += e * e;
            }
            let penalty = fitted.free() as f64 * (residual.len() as f64).ln();
            let own = chosen.contains(&effect);
            let either = own || alike.iter().any(|other| chosen.contains(other));
            Some(([own, either], penalty, sums))
        })
        .collect();
    let unit = search.unit();
    let mut included = [0; 2];
    let mut counts = [0.0; BLOCKS];
    for _ in 0..RESAMPLES {
        counts.fill(0.0);
        for _ in 0..BLOCKS {
            counts[(random.next_u64() % BLOCKS as u64) as usize] += 1.0;
        }
        let criterion = |(_, penalty, sums): &([bool; 2], f64, Vec<f64>)| {
            penalty + sums.iter().zip(&counts).map(|(sum, count)| sum * count).sum::<f64>() / unit
        };
        let best = structures.iter().min_by(|a, b| criterion(a).total_cmp(&criterion(b)));
        let has = best.map_or([false; 2], |(has, ..)| *has);
        for (included, has) in included.iter_mut().zip(has) {
            *included += usize::from(has);
        }
    }
    included.map(|included| included as f64 / RESAMPLES as f64)
}
