//! Compares redundant channels.
//!
//! Names suggest pairs: those that differ in one letter or digit at the end of a word, `p_in_A` and `p_in_B`. If the
//! recording changes, the readings decide: with block means s = (a + b)/2 and d = b − a,
//!
//! ```text
//!   d = offset + gain (s − s̄) + rate (t − t̄) + e
//! ```
//!
//! and they measure the same if e is small relative to the variation of s. The regressor is s rather than a, whose
//! noise is part of d, so that equal noise levels do not bias the gain. At rest there are only the names, and only
//! letters are trusted: digits also number items of one kind. s is also constant if a and b move in opposite
//! directions; at rest they at most drift apart linearly.
//!
//! Source: Haukanes 2015, §3.3.1, for the comparison.

use crate::statistics::estimate::{Estimate, mean, regression};
use crate::statistics::noise::{SensorNoise, white_noise};

/// How it is known that two channels measure the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kinship {
    /// They move together.
    Moving,
    /// They are constant, but their names suggest it.
    Named,
}

/// Two channels that measure the same.
#[derive(Debug, Clone, PartialEq)]
pub struct RedundantPair {
    /// Their positions in the record.
    pub channels: [usize; 2],
    /// Why they are compared.
    pub kinship: Kinship,
    /// Mean of second − first.
    pub offset: Estimate,
    /// Slope of second − first against their mean, if they move.
    pub gain: Option<Estimate>,
    /// Slope of second − first over time, per second.
    pub rate: Option<Estimate>,
    /// White noise of each.
    pub noise: [Option<SensorNoise>; 2],
}

/// Result of the comparison of two channels with similar names.
#[derive(Debug, Clone, PartialEq)]
pub enum PairComparison {
    /// They measure the same.
    Same(Box<RedundantPair>),
    /// They move, but not together.
    Different {
        /// Correlation of their block means.
        correlation: f64,
    },
    /// The recording does not show it.
    Unknown,
}

/// Maximum number of blocks.
const BLOCKS: usize = 256;
/// Minimum number of samples of a block.
const SHORTEST: usize = 4;
/// Minimum ratio of the variance of the motion to that of the noise in block means.
const MOTION: f64 = 25.0;
/// Maximum ratio of the residual variance of a difference to that of the motion.
const LEFT: f64 = 0.05;
/// Maximum difference in gain of sensors of one quantity.
const GAIN: f64 = 0.3;
/// Number of neighbouring blocks whose errors may be correlated.
const LAGS: usize = 4;
/// At rest, maximum difference as a fraction of the readings.
const AT_REST: f64 = 0.1;
/// Channels with a correlation below this move in opposite directions.
pub(crate) const OPPOSED: f64 = -0.9;

/// The stem of two names that differ in one letter or digit at the end of a word, and whether it is a letter: `p_in`
/// for `p_in_A` and `p_in_B`.
pub fn stem(one: &str, other: &str) -> Option<(String, bool)> {
    let (a, b): (Vec<char>, Vec<char>) = (one.chars().collect(), other.chars().collect());
    if a.len() != b.len() {
        return None;
    }
    let mut differing = (0..a.len()).filter(|k| a[*k] != b[*k]);
    let (at, None) = (differing.next()?, differing.next()) else { return None };
    let ends_word = a.get(at + 1).is_none_or(|c| !c.is_alphanumeric());
    let figures = a[at].is_ascii_digit() && b[at].is_ascii_digit();
    let before = at.checked_sub(1).map(|k| a[k]);
    // The x of `p_x` may be such a letter, that of `flux` not.
    let stands_alone = before.is_none_or(|c| !c.is_alphabetic());
    let capitals = a[at].is_ascii_uppercase() && b[at].is_ascii_uppercase();
    let lower = a[at].is_ascii_lowercase() && b[at].is_ascii_lowercase();
    let letters = (capitals && before.is_some_and(|c| !c.is_uppercase()))
        || ((capitals || lower) && stands_alone && before.is_some());
    if !ends_word || !(figures || letters) || (figures && before.is_some_and(char_is_figure)) {
        return None;
    }
    let rest: String = a[..at].iter().chain(&a[at + 1..]).collect();
    let stem = rest.trim_end_matches(|c: char| !c.is_alphanumeric()).to_owned();
    (!stem.is_empty()).then_some((stem, letters))
}

fn char_is_figure(c: char) -> bool {
    c.is_ascii_digit() || c == '.'
}

/// Compares two channels that may measure the same.
///
/// `is_known`: they do, according to the user or because their names differ in a letter.
///
/// # Panics
///
/// If the slices differ in length.
pub fn compare(
    times: &[f64],
    values: [&[f64]; 2],
    channels: [usize; 2],
    is_known: bool,
) -> PairComparison {
    let [a, b] = values;
    assert!(times.len() == a.len() && times.len() == b.len(), "values for each time");
    let both: Vec<usize> =
        (0..times.len()).filter(|k| a[*k].is_finite() && b[*k].is_finite()).collect();
    let pick = |values: &[f64]| -> Vec<f64> { both.iter().map(|k| values[*k]).collect() };
    let (t, a, b) = (pick(times), pick(a), pick(b));
    let difference: Vec<f64> = a.iter().zip(&b).map(|(a, b)| b - a).collect();
    let Some(offset) = mean(&difference) else { return PairComparison::Unknown };
    let noise = [white_noise(&t, &a, &a), white_noise(&t, &b, &b)];

    let length = (both.len() / BLOCKS).max(SHORTEST);
    let blocks = |values: &[f64]| -> Vec<f64> {
        values.chunks_exact(length).map(|c| c.iter().sum::<f64>() / length as f64).collect()
    };
    let (t, a, b) = (centred(blocks(&t)), blocks(&a), blocks(&b));
    let common = centred(a.iter().zip(&b).map(|(a, b)| f64::midpoint(*a, *b)).collect());
    let d = centred(a.iter().zip(&b).map(|(a, b)| b - a).collect());
    // A frozen or dead channel has neither noise nor motion of its own, so the larger of the two counts.
    let of_noise = noise.iter().flatten().map(|noise| noise.std.powi(2)).fold(0.0, f64::max);
    let motion = variance(&common);
    let [motion_of_a, motion_of_b] = [variance(&a), variance(&b)];
    let is_motion = |motion: f64| motion > MOTION * of_noise / length as f64;
    // var (a + b)/2 = (var a + var b + 2 cov)/4
    let covariance = 2.0 * motion - 0.5 * (motion_of_a + motion_of_b);
    let of_both = (motion_of_a * motion_of_b).sqrt();
    let correlation = if of_both > 0.0 { covariance / of_both } else { 0.0 };
    let different = PairComparison::Different { correlation };

    let scale = motion_of_b.max(motion_of_a).max(motion);
    let (gain, rate, kinship) = if is_motion(motion) && motion > 0.0 {
        let Some(fit) = regression(&[common, t], &d, LAGS) else { return PairComparison::Unknown };
        let [gain, rate] = [fit.coefficients[0], fit.coefficients[1]];
        if variance(&fit.residuals) > LEFT * scale || gain.value.abs() > GAIN {
            return different;
        }
        (Some(gain), Some(rate), Kinship::Moving)
    } else {
        let size = extent(&a).max(extent(&b));
        let is_near = is_known && offset.value.abs() <= AT_REST * size;
        let line = regression(&[t], &d, LAGS);
        let is_line =
            line.as_ref().is_some_and(|fit| variance(&fit.residuals) <= LEFT * variance(&d));
        let both_move = is_motion(motion_of_a) && is_motion(motion_of_b);
        if both_move && correlation < OPPOSED && !(is_near && is_line) {
            return different;
        }
        if !is_near {
            return PairComparison::Unknown;
        }
        (None, line.map(|fit| fit.coefficients[0]), Kinship::Named)
    };
    PairComparison::Same(Box::new(RedundantPair { channels, kinship, offset, gain, rate, noise }))
}

fn centred(mut values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    for value in &mut values {
        *value -= mean;
    }
    values
}

fn variance(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n
}

fn extent(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |extent, value| value.abs().max(extent))
}

/// The odd one of three or more channels that measure the same: its offset from the median of all is more than `CLEAR`
/// times the next largest. `offsets` are the channels' means minus any common value.
pub fn odd_one(offsets: &[f64]) -> Option<usize> {
    const CLEAR: f64 = 5.0;
    if offsets.len() < 3 {
        return None;
    }
    let mut sorted = offsets.to_vec();
    let middle = crate::statistics::noise::median(&mut sorted)?;
    let mut distances: Vec<(f64, usize)> =
        offsets.iter().enumerate().map(|(i, x)| ((x - middle).abs(), i)).collect();
    distances.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    (distances[0].0 > CLEAR * distances[1].0).then_some(distances[0].1)
}
