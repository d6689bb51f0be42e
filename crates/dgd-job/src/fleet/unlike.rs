//! Outliers among the wells: Mahalanobis distances of their parameters from the bulk.
//!
//! ```text
//!   x     parameters of a well at its last occasion, minus the median and over the median deviation of all wells
//!   m, V  centre and covariance of the bulk: orthogonalised pairwise estimates, then those of the wells near them
//!   d²  = (x − m)ᵀ (V + D)⁻¹ (x − m)      D: excess of the well's own uncertainty over that of most wells
//! ```
//!
//! Up to half of the wells may be outliers. If more than half are equal, in a parameter or in a combination of several,
//! V is their uncertainty in that direction ([`bulk`](super::bulk)). For a well like the others, d² is distributed
//! about as p(n² − 1)/(n(n − p)) times an F with p and n − p degrees of freedom, where n wells determine V. The nominal
//! rate is one false outlier in a hundred fleets; in simulated fleets of 7 to 200 wells with 1 to 6 parameters it is
//! two to five.
//!
//! # Sources
//!
//! R. Maronna, R. Zamar, Robust estimates of location and dispersion for high-dimensional datasets, Technometrics 44
//! (2002) 307, with medians and median deviations; J. Hardin, D. Rocke, The distribution of robust distances, J.
//! Comput. Graph. Stat. 14 (2005) 928; the factor for covariances of a truncated normal as in C. Croux, G. Haesbroeck,
//! Influence function and efficiency of the minimum covariance determinant scatter matrix estimator, J. Multivar. Anal.
//! 71 (1999) 161.

use nalgebra::DVector;

use super::bulk::{BulkDistribution, centre_and_scale, extent, median};
use super::{AssetResults, CHANCE};

/// The comparison of the wells.
#[derive(Debug, Default)]
pub(super) struct FleetComparison {
    /// Indices of the compared parameters of the fleet.
    pub(super) parameters: Vec<usize>,
    /// Parameters that are not compared, with the reason.
    pub(super) left_out: Vec<(usize, &'static str)>,
    /// Number of wells with all compared parameters.
    pub(super) wells: usize,
    /// Why there is no comparison.
    pub(super) without: Option<String>,
    /// Distance of each well of the fleet; `None` if a parameter is missing.
    pub(super) distances: Vec<Option<AssetDistance>>,
    /// Median of each compared parameter, in its unit.
    pub(super) medians: Vec<f64>,
}

/// Distance of a well from the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AssetDistance {
    /// In standard deviations of the bulk.
    pub(super) value: f64,
    /// Probability of a larger distance for a well like the others.
    pub(super) p_value: f64,
    /// Whether it is significant, given the number of wells.
    pub(super) is_unlike: bool,
    /// The parameter of the fleet that contributes most to it.
    pub(super) most: usize,
}

/// Compares the last estimates of all wells.
pub(super) fn compare(wells: &[AssetResults], parameters: &[(String, String)]) -> FleetComparison {
    let mut compared =
        FleetComparison { distances: vec![None; wells.len()], ..FleetComparison::default() };
    let value = |well: &AssetResults, name: &str| {
        let estimate = well.latest()?.estimate(name)?;
        estimate.value.is_finite().then_some((estimate.value, estimate.std.unwrap_or(0.0)))
    };
    let known = wells.iter().filter(|well| well.latest().is_some()).count();
    if known < least_wells(1) {
        compared.without = Some(format!(
            "{known} of them have estimates, and {} are needed at the least",
            least_wells(1)
        ));
        return compared;
    }
    let (mut scales, mut known_to) = (Vec::new(), Vec::new());
    for (j, (name, _)) in parameters.iter().enumerate() {
        let mut values: Vec<f64> =
            wells.iter().filter_map(|well| Some(value(well, name)?.0)).collect();
        if 2 * values.len() <= known {
            compared.left_out.push((j, "most wells do not have it"));
            continue;
        }
        // Most wells may be equal up to their uncertainty; an estimate at a bound has no uncertainty.
        let stds = wells.iter().filter_map(|well| Some(value(well, name)?.1));
        let known =
            median(&mut stds.filter(|std| *std > 0.0 && std.is_finite()).collect::<Vec<f64>>());
        let (centre, scale) = centre_and_scale(&mut values);
        if let Some(scale) = extent(scale, known) {
            compared.parameters.push(j);
            compared.medians.push(centre);
            scales.push(scale);
            known_to.push((known / scale).powi(2));
        } else {
            compared
                .left_out
                .push((j, "it is the same in most wells, and none says how well it is known"));
        }
    }
    let p = compared.parameters.len();
    let mut rows: Vec<(usize, DVector<f64>, DVector<f64>)> = Vec::new();
    for (w, well) in wells.iter().enumerate() {
        let pairs = compared.parameters.iter().map(|j| value(well, &parameters[*j].0));
        if let Some(pairs) = pairs.collect::<Option<Vec<(f64, f64)>>>() {
            let x = pairs.iter().zip(compared.medians.iter().zip(&scales));
            let x = x.map(|((value, _), (centre, scale))| (value - centre) / scale);
            let variances =
                pairs.iter().zip(&scales).map(|((_, std), scale)| (std / scale).powi(2));
            rows.push((w, DVector::from_iterator(p, x), DVector::from_iterator(p, variances)));
        }
    }
    compared.wells = rows.len();
    // The bulk is nine tenths of at least half of the wells, and has to determine a covariance.
    if p == 0 || rows.len() < least_wells(p) {
        compared.without = Some(match p {
            0 => "no parameter differs from well to well".to_owned(),
            _ => format!(
                "{} wells have estimates of all {p} parameters, of which {} are needed",
                rows.len(),
                least_wells(p)
            ),
        });
        return compared;
    }
    let x: Vec<&DVector<f64>> = rows.iter().map(|(_, x, _)| x).collect();
    let Some(bulk) = BulkDistribution::estimate(&x, &DVector::from_vec(known_to)) else {
        compared.without = Some("parameters of most wells depend on each other exactly".to_owned());
        return compared;
    };
    let usual = DVector::from_fn(p, |j, _| {
        median(&mut rows.iter().map(|(.., own)| own[j]).collect::<Vec<f64>>())
    });
    for (w, x, own) in &rows {
        let more = (own - &usual).map(|more| more.max(0.0));
        compared.distances[*w] = bulk.distance(x, &more).map(|(squared, most)| {
            let p_value = bulk.tail(squared);
            let is_unlike = p_value < CHANCE / rows.len() as f64;
            AssetDistance {
                value: squared.sqrt(),
                p_value,
                is_unlike,
                most: compared.parameters[most],
            }
        });
    }
    compared
}

/// Fewest wells for a comparison in p parameters.
fn least_wells(p: usize) -> usize {
    2 * p + 5
}

#[cfg(test)]
mod tests {
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::Rng;

    use super::super::reading::{FleetEstimate, IntervalSource, PeriodResults};
    use super::*;

    /// Normal numbers by the polar method.
    struct Normal(Pcg64);

    impl Normal {
        fn next(&mut self) -> f64 {
            loop {
                let mut uniform = || (self.0.next_u64() >> 11) as f64 / 2_f64.powi(52) - 1.0;
                let (a, b) = (uniform(), uniform());
                let s: f64 = a * a + b * b;
                if s > 0.0 && s < 1.0 {
                    return a * (-2.0 * s.ln() / s).sqrt();
                }
            }
        }
    }

    fn named(p: usize) -> Vec<(String, String)> {
        (0..p).map(|j| (format!("p{j}"), "m".to_owned())).collect()
    }

    fn well(values: &[f64], std: f64) -> AssetResults {
        let estimate = |(j, value): (usize, &f64)| {
            let unit = "m".to_owned();
            let estimate = FleetEstimate {
                value: *value,
                std: Some(std),
                band: None,
                by: IntervalSource::Std,
                unit,
            };
            (format!("p{j}"), estimate)
        };
        let estimates = values.iter().enumerate().map(estimate).collect();
        let occasions = vec![PeriodResults { estimates, ..PeriodResults::default() }];
        AssetResults { name: String::new(), occasions, lacks: Vec::new(), changes: Vec::new() }
    }

    /// Wells with two correlated parameters, in units of different magnitude.
    fn fleet(n: usize, seed: u64) -> Vec<AssetResults> {
        let mut normal = Normal(Pcg64::new(u128::from(seed), 7));
        let one = |_| {
            let (a, b, c) = (normal.next(), normal.next(), normal.next());
            well(&[1e8 + 1e6 * a, 3.0 + 0.1 * (0.95 * a + 0.31 * b), 200.0 + c], 0.0)
        };
        (0..n).map(one).collect()
    }

    fn unlike(wells: &[AssetResults]) -> Vec<usize> {
        let compared = compare(wells, &named(3));
        assert_eq!(compared.without, None);
        let is_unlike = |d: &Option<AssetDistance>| d.is_some_and(|d| d.is_unlike);
        (0..wells.len()).filter(|w| is_unlike(&compared.distances[*w])).collect()
    }

    #[test]
    fn a_well_that_breaks_a_correlation_is_unlike_though_each_number_is_usual() {
        let mut wells = fleet(60, 1);
        // Two standard deviations up in one and down in the other.
        wells[17] = well(&[1e8 + 2e6, 3.0 - 0.2, 200.0], 0.0);
        assert_eq!(unlike(&wells), [17]);
        let compared = compare(&wells, &named(3));
        assert!(compared.distances[17].expect("it has all").most < 2, "not the third");
    }

    #[test]
    fn a_third_that_is_something_else_does_not_hide_itself() {
        let mut wells = fleet(90, 2);
        for (w, one) in wells.iter_mut().enumerate().take(30) {
            *one = well(&[1e8 + 2e7 + 1e4 * w as f64, 3.0, 200.0 + 0.1 * w as f64], 0.0);
        }
        assert_eq!(unlike(&wells), (0..30).collect::<Vec<usize>>());
    }

    #[test]
    fn what_is_little_known_is_not_unlike_for_that() {
        let mut wells = fleet(40, 3);
        wells[5] = well(&[1.1e8, 3.0, 200.0], 0.0);
        assert_eq!(unlike(&wells), [5]);
        wells[5] = well(&[1.1e8, 3.0, 200.0], 5e6);
        assert!(unlike(&wells).is_empty());
    }

    #[test]
    fn alike_wells_are_called_unlike_in_few_fleets() {
        for n in [15, 40, 200] {
            let fleets = 300;
            let with = (0..fleets).filter(|seed| !unlike(&fleet(n, 1000 + seed)).is_empty());
            let share = with.count() as f64 / fleets as f64;
            assert!(share < 0.07, "{share} of the fleets of {n} wells");
        }
    }

    #[test]
    fn units_do_not_matter() {
        let wells = fleet(50, 4);
        let scaled: Vec<AssetResults> = wells
            .iter()
            .map(|well| {
                let estimates = &well.occasions[0].estimates;
                let value = |j: usize| estimates[j].1.value;
                super::tests::well(&[value(0) * 1e-9, value(1) * 7.0 + 4.0, -value(2)], 0.0)
            })
            .collect();
        let (a, b) = (compare(&wells, &named(3)), compare(&scaled, &named(3)));
        for (a, b) in a.distances.iter().zip(&b.distances) {
            let (a, b) = (a.expect("all known").value, b.expect("all known").value);
            assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
        }
    }

    /// A fleet in which uncertainties are a tenth of the scatter.
    fn known(n: usize, seed: u64) -> Vec<AssetResults> {
        let with_std = |well: &AssetResults| {
            let value = |j: usize| well.occasions[0].estimates[j].1.value;
            let mut with_stds = super::tests::well(&[value(0), value(1), value(2)], 0.0);
            let estimates = &mut with_stds.occasions[0].estimates;
            for ((_, estimate), std) in estimates.iter_mut().zip([1e5, 0.01, 0.1]) {
                estimate.std = Some(std);
            }
            with_stds
        };
        fleet(n, seed).iter().map(with_std).collect()
    }

    fn set(well: &mut AssetResults, j: usize, value: f64) {
        well.occasions[0].estimates[j].1.value = value;
    }

    #[test]
    fn where_most_wells_are_the_same_others_are_unlike_by_their_uncertainty() {
        let value = |well: &AssetResults, j: usize| well.occasions[0].estimates[j].1.value;
        // In one parameter, perhaps at a bound, bitwise or up to rounding; one well is off by ten of its standard
        // deviations.
        for noise in [0.0, 1e-16] {
            let mut wells = known(40, 8);
            for (w, well) in wells.iter_mut().enumerate() {
                set(well, 2, 200.0 * (1.0 + noise * (w % 7) as f64));
            }
            set(&mut wells[4], 2, 201.0);
            set(&mut wells[9], 2, 200.1);
            assert_eq!(unlike(&wells), [4]);
        }
        // In all of them: copies of one well.
        let mut wells = known(40, 9);
        let copied: Vec<f64> = (0..3).map(|j| value(&wells[0], j)).collect();
        for well in wells.iter_mut().skip(1).take(24) {
            (0..3).for_each(|j| set(well, j, copied[j]));
        }
        for (w, well) in wells.iter_mut().enumerate().skip(25) {
            (0..3).for_each(|j| set(well, j, copied[j] + [1e3, 1e-4, 1e-3][j] * (w % 3) as f64));
        }
        set(&mut wells[30], 1, copied[1] + 0.2);
        assert_eq!(unlike(&wells), [30]);
        let copies: Vec<AssetResults> = (0..20).map(|_| well(&copied, 0.1)).collect();
        assert!(unlike(&copies).is_empty());
        // In a combination: the third is twice the second, except for one well, with usual values of both.
        let mut wells = known(40, 10);
        for well in &mut wells {
            let twice = 2.0 * value(well, 1);
            set(well, 2, twice);
        }
        let off = value(&wells[6], 2) + 2.0;
        set(&mut wells[6], 2, off);
        assert_eq!(unlike(&wells), [6]);
    }

    #[test]
    fn what_cannot_be_compared_is_said() {
        let few = compare(&fleet(10, 5), &named(3));
        assert!(few.without.is_some_and(|words| words.contains("11 are needed")));
        let mut wells = fleet(30, 6);
        for well in &mut wells {
            well.occasions[0].estimates[2].1.value = 7.0;
        }
        let compared = compare(&wells, &named(3));
        assert_eq!((compared.parameters.as_slice(), compared.left_out[0].0), (&[0, 1][..], 2));
        assert!(compare(&[], &named(0)).without.is_some());
    }
}
