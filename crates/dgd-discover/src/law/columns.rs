//! The effect of each term in each equation on the readings, as one column of numbers.

use std::collections::BTreeSet;

use dgd_runtime::parallel::in_parallel_stateless;

use super::beam::{ColumnSet, WhitenedLevel};
use super::sighting::FollowedRecordings;
use super::terms::{self, TermVocabulary};
use crate::guess::FormulaShape;

/// Largest number of terms.
pub(super) const MOST_TERMS: usize = 4;
/// Fractions of the walks' intensities at which columns are whitened: with all of it, terms that a set lacks do no
/// harm; with next to nothing, only the whole law fits.
const SHARES: [f64; 3] = [1.0, 1e-3, 1e-7];
/// Largest number of columns times readings, which are in memory at once.
const MOST_NUMBERS: usize = 20_000_000;
/// Minimum effective number of samples at which a term acts, as for the time before and after an onset.
const FEWEST: f64 = 8.0;
/// Difference of −2 ln of likelihoods below which two drafts are twins.
const TWINS: f64 = 0.5;
/// Number of plainer forms that are tried in place of one …
const PLAINER: usize = 2;
/// … and the fraction of its square that each of them has to explain along the recordings.
const ALIKE: f64 = 0.9;
/// Relative difference below which two columns are the same.
const SAME: f64 = 1e-9;

/// Terms with their equations and coefficients.
#[derive(Debug, Clone)]
pub(super) struct LawDraft {
    /// The place, the term and its coefficient.
    pub(super) terms: Vec<(usize, FormulaShape, f64)>,
    /// −2 ln of its likelihood …
    pub(super) left: f64,
    /// … plus twice the price.
    pub(super) cost: f64,
}

impl LawDraft {
    /// Whether all its terms are among those of another.
    pub(super) fn is_part_of(&self, other: &LawDraft) -> bool {
        let has = |place: usize, shape: &FormulaShape| {
            other.terms.iter().any(|(own, of, _)| *own == place && of == shape)
        };
        self.terms.iter().all(|(place, shape, _)| has(*place, shape))
    }

    /// Whether the readings cannot distinguish it from another draft of the same equations, as x from |x| where x is
    /// positive.
    pub(super) fn is_twin_of(&self, other: &LawDraft) -> bool {
        let places =
            |draft: &LawDraft| -> Vec<usize> { draft.terms.iter().map(|term| term.0).collect() };
        (self.left - other.left).abs() < TWINS && places(self) == places(other)
    }

    /// The drafts that lack one of its terms, or have a plainer one in its place, with the coefficient that comes
    /// closest to it: a factor may make up for its mean, and a bend outside the recorded range for a straight line.
    pub(super) fn simpler(&self, sighting: &FollowedRecordings) -> Vec<LawDraft> {
        let values = sighting.all_values();
        let mut drafts = Vec::new();
        for (i, (place, shape, coefficient)) in self.terms.iter().enumerate() {
            if self.terms.len() > 1 {
                let mut less = self.clone();
                less.terms.remove(i);
                drafts.push(less);
            }
            let whole = sighting.formed(shape).concat();
            let simpler = |simpler: FormulaShape| {
                let is_there =
                    |(own, of, _): &(usize, FormulaShape, f64)| own == place && *of == simpler;
                if self.terms.iter().any(is_there) {
                    return None;
                }
                let CourseProjection { share, explained } =
                    along(&whole, &sighting.formed(&simpler).concat());
                let mut less = self.clone();
                (less.terms[i].1, less.terms[i].2) = (simpler, share * coefficient);
                (share != 0.0 && share.is_finite()).then_some((explained, less))
            };
            let without = (0..shape.factors.len()).filter_map(|k| shape.without(k));
            drafts.extend(without.filter_map(simpler).map(|(_, less)| less));
            let plainer = shape.plainer().into_iter();
            let plainer = plainer.filter(|one| terms::is_defined(one, &sighting.names, &values));
            let mut plainer: Vec<(f64, LawDraft)> = plainer.filter_map(simpler).collect();
            plainer.retain(|(explained, _)| *explained > ALIKE);
            plainer.sort_by(|a, b| b.0.total_cmp(&a.0));
            drafts.extend(plainer.into_iter().take(PLAINER).map(|(_, less)| less));
        }
        drafts
    }
}

/// The projection of one course on another.
struct CourseProjection {
    /// The factor of the other that comes closest.
    share: f64,
    /// The fraction of the square that it explains.
    explained: f64,
}

fn along(whole: &[f64], part: &[f64]) -> CourseProjection {
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (both, square) = (product(whole, part), product(part, part));
    CourseProjection {
        share: both / square,
        explained: both * both / (square * product(whole, whole)),
    }
}

/// A term in an equation.
struct TermColumn {
    place: usize,
    shape: FormulaShape,
    /// ln of the prior odds against it.
    price: f64,
}

/// Sets of terms that explain the readings, the best first.
pub(super) fn drafts(
    sighting: &FollowedRecordings,
    vocabulary: TermVocabulary,
    threads: usize,
) -> Vec<LawDraft> {
    let columns = columns(sighting, vocabulary);
    // One level at a time: all columns of one may take much memory.
    let mut kept: Option<Vec<usize>> = None;
    let mut sets: Vec<Vec<usize>> = Vec::new();
    for share in SHARES {
        let candidates: Vec<usize> = kept.clone().unwrap_or_else(|| (0..columns.len()).collect());
        let mut level = level(sighting, &columns, &candidates, share, threads);
        let distinct = kept.get_or_insert_with(|| {
            let distinct = distinct(&columns, &level.columns);
            level.keep(&distinct);
            distinct
        });
        let price: Vec<f64> = distinct.iter().map(|i| columns[*i].price).collect();
        let best_sets = level.search(MOST_TERMS, &price, threads);
        let positions =
            |ColumnSet { columns, .. }: ColumnSet| columns.iter().map(|i| distinct[*i]).collect();
        sets.extend(best_sets.into_iter().map(positions));
    }
    sets.sort();
    sets.dedup();
    let used: BTreeSet<usize> = sets.iter().flatten().copied().collect();
    let used: Vec<usize> = used.into_iter().collect();
    let levels = SHARES.map(|share| level(sighting, &columns, &used, share, threads));
    let draft = |set: &Vec<usize>| {
        let price: f64 = set.iter().map(|i| columns[*i].price).sum();
        let places: Vec<usize> =
            set.iter().map(|i| used.binary_search(i).unwrap_or_default()).collect();
        let of_level = |level: &WhitenedLevel| {
            let (coefficients, left) = level.fit(&places)?;
            Some((left + level.log_determinant, coefficients))
        };
        let numbered_levels = levels.iter().enumerate();
        let fits = numbered_levels.filter_map(|(k, level)| Some((k, of_level(level)?)));
        let (level, (left, coefficients)) = fits.min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0))?;
        // With a law in the model, less is missing than without it.
        if level == 0 {
            return None;
        }
        let terms = set.iter().zip(coefficients);
        let terms = terms.map(|(i, c)| (columns[*i].place, columns[*i].shape.clone(), c));
        Some(LawDraft { terms: terms.collect(), left, cost: left + 2.0 * price })
    };
    let mut drafts: Vec<LawDraft> = sets.iter().filter_map(draft).collect();
    drafts.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    drafts
}

/// All terms at all places.
fn columns(sighting: &FollowedRecordings, vocabulary: TermVocabulary) -> Vec<TermColumn> {
    let values = sighting.all_values();
    let names = &sighting.names;
    let is_of_many = |shape: &FormulaShape| is_of_many(&sighting.formed(shape));
    let mut shapes = terms::single(names, &values, vocabulary);
    shapes.retain(is_of_many);
    let mut products =
        terms::products(names, &values, &in_products(sighting, &shapes, vocabulary), vocabulary);
    products.retain(is_of_many);
    shapes.extend(products);
    let number = (shapes.len() * sighting.places.len()) as f64;
    let readings = (sighting.readings() as f64).ln();
    let mut columns = Vec::new();
    for place in &sighting.places {
        for shape in &shapes {
            let constants = if shape.inner.is_some() { 2.0 } else { 1.0 };
            let price = 0.5 * constants * readings + number.ln() + f64::from(shape.complexity());
            columns.push(TermColumn { place: *place, shape: shape.clone(), price });
        }
    }
    // A model of many equations keeps only the plainest terms.
    columns.sort_by(|a, b| a.price.total_cmp(&b.price));
    columns.truncate(MOST_NUMBERS / sighting.readings().max(1));
    columns
}

/// The names and differences that enter products: those that explain most on their own.
fn in_products(
    sighting: &FollowedRecordings,
    single: &[FormulaShape],
    vocabulary: TermVocabulary,
) -> Vec<usize> {
    let names = &sighting.names;
    let (differences, mut all): (Vec<usize>, Vec<usize>) = (0..names.len())
        .filter(|i| names[*i].name != "time" && vocabulary.reads(&names[*i]))
        .partition(|i| names[*i].difference.is_some());
    if all.len() <= terms::IN_PRODUCTS && differences.len() <= terms::DIFFERENCES {
        all.extend(differences);
        return all;
    }
    let plain: Vec<&FormulaShape> = single.iter().filter(|shape| shape.complexity() == 1).collect();
    let columns: Vec<TermColumn> = (sighting.places.iter())
        .flat_map(|place| plain.iter().map(|shape| (*place, (*shape).clone())))
        .map(|(place, shape)| TermColumn { place, shape, price: 0.0 })
        .collect();
    let level = level(sighting, &columns, &(0..columns.len()).collect::<Vec<_>>(), 1.0, 1);
    let left = |name: usize| {
        let with_name =
            (0..columns.len()).filter(|i| columns[*i].shape.factors.iter().any(|f| f.0 == name));
        let left = with_name.filter_map(|i| Some(level.fit(&[i])?.1));
        left.fold(f64::INFINITY, f64::min)
    };
    let best = |of: &[usize], most: usize| -> Vec<usize> {
        let mut by_name: Vec<(f64, usize)> = of.iter().map(|name| (left(*name), *name)).collect();
        by_name.sort_by(|a, b| a.0.total_cmp(&b.0));
        by_name.into_iter().take(most).map(|(_, name)| name).collect()
    };
    all = best(&all, terms::IN_PRODUCTS);
    all.extend(best(&differences, terms::DIFFERENCES));
    all.sort_unstable();
    all
}

/// Whether a term is finite and acts at more than a few samples: (Σ x²)²/Σ x⁴.
fn is_of_many(formed: &[Vec<f64>]) -> bool {
    let largest = formed.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let power = |n: i32| formed.iter().flatten().map(|x| (x / largest).powi(n)).sum::<f64>();
    let (square, fourth) = (power(2), power(4));
    largest > 0.0 && largest.is_finite() && square * square >= FEWEST * fourth
}

/// Residuals and some of the columns, whitened with a fraction of what else is missing.
fn level(
    sighting: &FollowedRecordings,
    columns: &[TermColumn],
    chosen: &[usize],
    share: f64,
    threads: usize,
) -> WhitenedLevel {
    let FollowedRecordings { paths, walks, free, .. } = sighting;
    let (places, q): (Vec<usize>, Vec<f64>) =
        walks.iter().map(|(place, q)| (*place, q * share)).unzip();
    let whitenings: Vec<_> = paths.iter().map(|path| path.chain.whitening(&places, &q)).collect();
    let along = |place: usize, at: &[Vec<f64>], between: &[Vec<f64>]| -> Vec<f64> {
        let each = paths.iter().zip(&whitenings).zip(at.iter().zip(between));
        each.flat_map(|((path, with), (at, between))| path.chain.whitened(with, place, between, at))
            .collect()
    };
    // Each parameter's prior is one more reading, of zero.
    let with_priors = |mut column: Vec<f64>, own: Option<usize>| {
        let n = column.len();
        column.resize(n + free.len(), 0.0);
        if let Some(i) = own {
            column[n + i] = 1.0;
        }
        column
    };
    let residuals = whitenings.iter().flat_map(|with| with.residuals.iter().copied()).collect();
    let constant = |size: f64| -> Vec<Vec<f64>> {
        paths.iter().map(|path| vec![size; path.trajectory.times.len()]).collect()
    };
    let of_free = |(place, size): &(usize, f64)| {
        let (at, between) = (constant(*size), constant(*size));
        along(*place, &at, &between)
    };
    let always =
        free.iter().enumerate().map(|(i, free)| with_priors(of_free(free), Some(i))).collect();
    let whitened = in_parallel_stateless(chosen.len(), threads, |k| {
        let column = &columns[chosen[k]];
        let shape = &column.shape;
        let (at, between) = (sighting.formed(shape), sighting.formed_between(shape));
        with_priors(along(column.place, &at, &between), None)
    });
    WhitenedLevel {
        residuals: with_priors(residuals, None),
        columns: whitened,
        always,
        log_determinant: whitenings.iter().map(|with| with.log_determinant).sum(),
    }
}

/// Positions of columns that are not zero; of equal ones at a place, the plainest.
fn distinct(columns: &[TermColumn], whitened: &[Vec<f64>]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..columns.len()).collect();
    order.sort_by(|a, b| columns[*a].price.total_cmp(&columns[*b].price).then(a.cmp(b)));
    // Equal columns have equal products with any vector.
    let weight = |k: usize| (k as f64 * 1.618_034).fract() - 0.4;
    let mut marks: Vec<(usize, f64)> = Vec::new();
    order.retain(|i| {
        let (column, place) = (&whitened[*i], columns[*i].place);
        let size = column.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !(size > 0.0 && size.is_finite()) {
            return false;
        }
        let mark = column.iter().enumerate().map(|(k, x)| weight(k) * x).sum::<f64>().abs() / size;
        let is_new = !marks.iter().any(|(own, other)| *own == place && (other - mark).abs() < SAME);
        marks.push((place, mark));
        is_new
    });
    order.sort_unstable();
    order
}
