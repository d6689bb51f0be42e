//! Operating points: groups of steady periods in which all channels have the same values.
//!
//! Hartigan's leader algorithm: in order of time, a steady period joins the nearest point whose centre is within the
//! tolerance in every channel, or starts a new one; then each is assigned to the nearest centre once more. The result
//! depends only on the data.
//!
//! Source: Hartigan, Clustering Algorithms (1975), §3.2. Haukanes 2015, §3.5.1, counts such points to choose the speeds
//! for fitting a pump curve.

use crate::steady::Motion;

/// An operating point.
#[derive(Debug, Clone, PartialEq)]
pub struct SteadyPoint {
    /// Positions of its steady periods.
    pub stretches: Vec<usize>,
    /// Mean of each channel over them, weighted by their lengths; NaN where there is none.
    pub means: Vec<f64>,
    /// Total time spent at it, s.
    pub seconds: f64,
}

/// Fraction of the range of a channel's steady means within which values count as equal.
const SAME: f64 = 0.03;

/// Groups the steady periods of a record.
///
/// `tolerances` has for each channel the difference that is negligible, for instance its noise.
pub fn operating_points(motion: &Motion, tolerances: &[f64]) -> Vec<SteadyPoint> {
    let steady = &motion.steady;
    let value = |stretch: usize, channel: usize| {
        steady[stretch].means[channel].map_or(f64::NAN, |mean| mean.value)
    };
    let moved: Vec<usize> = motion.rests.iter().map(|rest| rest.channel).collect();
    let reach: Vec<f64> = moved
        .iter()
        .map(|&channel| {
            let values = (0..steady.len()).map(|k| value(k, channel)).filter(|x| x.is_finite());
            let (low, high) =
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            // Differences up to the change that a window at rest allows do not count either.
            let change = motion.rests.iter().find(|rest| rest.channel == channel);
            let change = change.map_or(0.0, |rest| rest.change);
            (SAME * (high - low)).max(tolerances[channel]).max(change)
        })
        .collect();
    // Largest difference over all channels, in tolerances.
    let distance = |stretch: usize, centre: &[f64]| {
        let each = moved.iter().zip(&reach).map(|(&channel, reach)| {
            let difference = (value(stretch, channel) - centre[channel]).abs();
            if difference.is_finite() && *reach > 0.0 { difference / reach } else { 0.0 }
        });
        each.fold(0.0, f64::max)
    };
    let nearest = |stretch: usize, centres: &[Vec<f64>]| {
        let distances =
            centres.iter().enumerate().map(|(c, centre)| (distance(stretch, centre), c));
        distances.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let n_channels = steady.first().map_or(0, |stretch| stretch.means.len());
    let centre = |stretches: &[usize]| -> Vec<f64> {
        (0..n_channels)
            .map(|channel| {
                let (mut sum, mut weight) = (0.0, 0.0);
                for &stretch in stretches {
                    let x = value(stretch, channel);
                    if x.is_finite() {
                        let w = length(motion, stretch);
                        sum += w * x;
                        weight += w;
                    }
                }
                sum / weight
            })
            .collect()
    };
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut centres: Vec<Vec<f64>> = Vec::new();
    for stretch in 0..steady.len() {
        match nearest(stretch, &centres) {
            Some((near, group)) if near <= 1.0 => {
                groups[group].push(stretch);
                centres[group] = centre(&groups[group]);
            }
            _ => {
                groups.push(vec![stretch]);
                centres.push(centre(&[stretch]));
            }
        }
    }
    let mut settled = vec![Vec::new(); centres.len()];
    for stretch in 0..steady.len() {
        if let Some((_, group)) = nearest(stretch, &centres) {
            settled[group].push(stretch);
        }
    }
    let point = |stretches: Vec<usize>| SteadyPoint {
        means: centre(&stretches),
        seconds: stretches.iter().map(|stretch| length(motion, *stretch)).sum(),
        stretches,
    };
    settled.into_iter().filter(|stretches| !stretches.is_empty()).map(point).collect()
}

fn length(motion: &Motion, stretch: usize) -> f64 {
    let stretch = motion.steady[stretch].stretch;
    stretch.until - stretch.from
}
