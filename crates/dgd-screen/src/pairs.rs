//! Compares channels that measure the same quantity.

use crate::cleaned::CleanedRecord;
use crate::clock::shift;
use crate::finding::{ChannelFault, Finding, Severity};
use crate::record::{ScreenedRecord, extremes, usual_spacing};
use crate::redundant::{Kinship, OPPOSED, PairComparison, RedundantPair, compare, odd_one, stem};
use crate::screen::{RARE, ScreenOptions};
use crate::statistics::estimate::Estimate;

/// Offsets up to this many standard deviations of one reading are harmless.
const HARMLESS: f64 = 0.25;
/// Noise ratio of two sensors of one quantity above which one is noisier.
const NOISIER: f64 = 2.0;

/// Two channels with similar names, and their comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct SimilarChannels {
    /// Their positions.
    pub channels: [usize; 2],
    /// Whether their names differ in a letter.
    pub by_letter: bool,
    /// The result of the comparison.
    pub compared: PairComparison,
}

/// Compares all channels of one unit with similar names, without the faults of single channels.
pub(crate) fn compared(
    cleaned: &CleanedRecord,
    record: &ScreenedRecord<'_>,
    request: &ScreenOptions,
) -> Vec<SimilarChannels> {
    let n = record.channels.len();
    let mut pairs = Vec::new();
    for i in 0..n {
        for j in i + 1..n {
            let (a, b) = (&record.channels[i], &record.channels[j]);
            let is_same = request.same.contains(&[i, j]) || request.alike.contains(&[i, j]);
            let proposed = stem(a.name, b.name).filter(|_| a.unit == b.unit);
            let by_letter = proposed.as_ref().is_some_and(|(_, by_letter)| *by_letter);
            if !is_same && (proposed.is_none() || request.different.contains(&[i, j])) {
                continue;
            }
            let values = [cleaned.values[i].as_slice(), cleaned.values[j].as_slice()];
            let is_known = is_same || by_letter;
            let compared = match compare(record.times, values, [i, j], is_known) {
                // Either half a period late, or with opposite sign, which is more common.
                PairComparison::Different { correlation } if is_known && correlation > OPPOSED => {
                    lagging_twin(record.times, values, [i, j])
                        .unwrap_or(PairComparison::Different { correlation })
                }
                other => other,
            };
            pairs.push(SimilarChannels { channels: [i, j], by_letter, compared });
        }
    }
    pairs
}

/// Compares two channels that disagree after aligning their clocks; `None` if they still disagree.
fn lagging_twin(
    times: &[f64],
    values: [&[f64]; 2],
    channels: [usize; 2],
) -> Option<PairComparison> {
    let [a, b] = values;
    let (late, spacing) = (shift(times, a, b)?, usual_spacing(times)?);
    let samples = (late.value / spacing).round();
    let n = times.len();
    let lag = samples.abs() as usize;
    if lag == 0 || 2 * lag > n {
        return None;
    }
    let (kept, behind) = (..n - lag, lag..);
    let compared = if samples > 0.0 {
        compare(&times[kept], [&a[kept], &b[behind]], channels, true)
    } else {
        compare(&times[kept], [&a[behind], &b[kept]], channels, true)
    };
    (!matches!(compared, PairComparison::Different { .. })).then_some(compared)
}

/// Findings from pairs of channels.
pub(crate) fn pair_findings(
    times: &[f64],
    cleaned: &CleanedRecord,
    pairs: &[RedundantPair],
) -> Vec<Finding> {
    let span = times.last().zip(times.first()).map_or(0.0, |(last, first)| last - first);
    let mut findings = Vec::new();
    for pair in pairs {
        let mut find = |fault, p_value| {
            findings.push(Finding {
                channels: pair.channels.to_vec(),
                stretches: Vec::new(),
                fault,
                p_value: Some(p_value),
                weight: Severity::Fault,
            });
        };
        let [a, b] = pair.noise.map(|noise| noise.map_or(0.0, |noise| noise.std));
        let harmless = HARMLESS * a.max(b);
        let step = pair.noise.iter().flatten().filter_map(|n| n.quantisation).fold(0.0, f64::max);
        // Rounding may put channels that hardly change a step apart.
        let rounding = if a.min(b) < 0.5 * step { step } else { 0.0 };
        let p = pair.offset.p_value_beyond(harmless.max(rounding));
        if p < RARE {
            find(ChannelFault::Offset { offset: pair.offset, kinship: pair.kinship }, p);
        }
        if let Some(gain) = pair.gain {
            let [first, _] = pair.channels;
            let (low, high) = extremes(&cleaned.values[first]).unwrap_or_default();
            let p = gain.p_value_beyond(harmless / (high - low));
            if p < RARE {
                find(ChannelFault::Gain(over_first(gain)), p);
            }
        }
        if let Some(rate) = pair.rate {
            let p = rate.p_value_beyond(harmless / span);
            if p < RARE {
                find(ChannelFault::Drift(rate), p);
            }
        }
        if let [Some(one), Some(other)] = pair.noise {
            let ratio = other.std / one.std;
            let doubt = 5.0 * (one.relative_error + other.relative_error);
            if ratio.max(1.0 / ratio) > NOISIER * (1.0 + doubt) {
                find(ChannelFault::Noisier(ratio), RARE);
            }
        }
        if pair.kinship == Kinship::Moving {
            let [first, second] = pair.channels;
            let late = shift(times, &cleaned.values[first], &cleaned.values[second]);
            // A tenth of a sample is not a clock error.
            let spacing = usual_spacing(times).unwrap_or(0.0);
            if let Some(late) = late {
                let p = late.p_value_beyond(0.1 * spacing);
                if p < RARE {
                    find(ChannelFault::Lag(late), p);
                }
            }
        }
    }
    findings
}

/// The slope of the second channel against the first, minus one, from the slope g of b − a against (a + b)/2:
///
/// ```text
///   b/a = (2 + g)/(2 − g),   d(b/a)/dg = 4/(2 − g)²
/// ```
fn over_first(gain: Estimate) -> Estimate {
    let g = gain.value;
    Estimate {
        value: 2.0 * g / (2.0 - g),
        std_error: 4.0 / (2.0 - g).powi(2) * gain.std_error,
        ..gain
    }
}

/// Findings about the odd one of three or more channels.
pub(crate) fn odd_findings(pairs: &[RedundantPair]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for group in groups(pairs) {
        let first = group[0];
        let between =
            |i: usize, j: usize| pairs.iter().find(|pair| pair.channels == [i.min(j), i.max(j)]);
        let complete =
            group.iter().all(|i| group.iter().all(|j| i == j || between(*i, *j).is_some()));
        if group.len() < 3 || !complete {
            continue;
        }
        let offset = |i: usize| {
            if i == first { 0.0 } else { between(first, i).map_or(0.0, |pair| pair.offset.value) }
        };
        let offsets: Vec<f64> = group.iter().map(|i| offset(*i)).collect();
        let Some(odd) = odd_one(&offsets).map(|at| group[at]) else { continue };
        // Compared with the channel closest to the median of the others.
        let mut others: Vec<usize> = group.iter().copied().filter(|i| *i != odd).collect();
        others.sort_by(|i, j| offset(*i).total_cmp(&offset(*j)));
        let middle = others[others.len() / 2];
        let Some(pair) = between(odd, middle) else { continue };
        let sign = if odd > middle { 1.0 } else { -1.0 };
        let estimate = Estimate { value: sign * pair.offset.value, ..pair.offset };
        let p_value = estimate.p_value();
        if p_value < RARE {
            findings.push(Finding {
                channels: vec![odd],
                stretches: Vec::new(),
                fault: ChannelFault::Odd(estimate),
                p_value: Some(p_value),
                weight: Severity::Fault,
            });
        }
    }
    findings
}

/// Groups of channels that are connected by comparisons, in order.
fn groups(pairs: &[RedundantPair]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for pair in pairs {
        let (mut joined, rest): (Vec<Vec<usize>>, Vec<Vec<usize>>) =
            groups.into_iter().partition(|group| pair.channels.iter().any(|c| group.contains(c)));
        joined.push(pair.channels.to_vec());
        let mut one: Vec<usize> = joined.concat();
        one.sort_unstable();
        one.dedup();
        groups = rest;
        groups.push(one);
    }
    groups.sort();
    groups
}
