//! Runs all tests on a record.

use crate::cleaned::CleanedRecord;
use crate::finding::{ChannelFault, Finding, Severity};
use crate::operating_points::{SteadyPoint, operating_points};
use crate::pairs::{SimilarChannels, compared, odd_findings, pair_findings};
use crate::record::{Channel, ScreenedRecord, extremes, usual_spacing};
use crate::redundant::{OPPOSED, PairComparison, RedundantPair};
use crate::sampling::{SampleSpacing, sampling};
use crate::statistics::noise::SensorNoise;
use crate::steady::{Motion, motion};

/// Probability by chance below which a finding is reported.
pub const RARE: f64 = 1e-6;

/// Information besides the samples.
#[derive(Debug, Clone, Default)]
pub struct ScreenOptions {
    /// Channels declared to measure the same, in one unit; if they do not, that is a finding.
    pub same: Vec<[usize; 2]>,
    /// Channels that measured the same in another record.
    pub alike: Vec<[usize; 2]>,
    /// Channels that are not compared although their names are similar.
    pub different: Vec<[usize; 2]>,
    /// Window for slopes, s; [`slope_window`] if `None`.
    pub window: Option<f64>,
    /// Largest slopes of channels at rest, per second.
    pub limits: Vec<(usize, f64)>,
}

/// The results for a record.
#[derive(Debug, Clone)]
pub struct Screening {
    /// Findings, in the order of channels.
    pub findings: Vec<Finding>,
    /// Summary of each channel.
    pub channels: Vec<ChannelSummary>,
    /// The spacing of the samples.
    pub sampling: SampleSpacing,
    /// Channels that measure the same, in pairs.
    pub comparisons: Vec<RedundantPair>,
    /// Steady periods and transients.
    pub motion: Motion,
    /// Steady periods, grouped.
    pub points: Vec<SteadyPoint>,
}

/// Summary of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelSummary {
    /// Number of values that are not NaN.
    pub samples: usize,
    /// Their minimum and maximum.
    pub range: Option<(f64, f64)>,
    /// Their mean.
    pub mean: f64,
    /// White noise, without frozen or saturated readings and spikes.
    pub noise: Option<SensorNoise>,
}

/// Fraction of uneven spacings that is worth a remark.
const UNEVEN: f64 = 0.05;
/// Length of windows for slopes, in median sample spacings.
const WINDOW: f64 = 30.0;

/// The default window for slopes, s: 30 median sample spacings. `None` with fewer than two samples.
pub fn slope_window(times: &[f64]) -> Option<f64> {
    usual_spacing(times).map(|usual| WINDOW * usual)
}

/// Compares all channels of one unit with similar names.
pub fn kin(record: &ScreenedRecord<'_>, request: &ScreenOptions) -> Vec<SimilarChannels> {
    compared(&CleanedRecord::clean(record), record, request)
}

/// Runs all tests on a record.
pub fn screen(record: &ScreenedRecord<'_>, request: &ScreenOptions) -> Screening {
    let cleaned = CleanedRecord::clean(record);
    let sampling = sampling(record.times);
    let mut findings = spacing_findings(&sampling);
    let mut comparisons: Vec<RedundantPair> = Vec::new();
    for kin in compared(&cleaned, record, request) {
        let (fault, weight) = match kin.compared {
            PairComparison::Same(comparison) => {
                comparisons.push(*comparison);
                continue;
            }
            PairComparison::Different { correlation } if correlation < OPPOSED => {
                (ChannelFault::Opposed(correlation), Severity::Fault)
            }
            PairComparison::Different { .. } => (ChannelFault::Unlike, Severity::Fault),
            PairComparison::Unknown => (ChannelFault::Untold, Severity::Remark),
        };
        if request.same.contains(&kin.channels) {
            let channels = kin.channels.to_vec();
            findings.push(Finding {
                channels,
                stretches: Vec::new(),
                fault,
                p_value: None,
                weight,
            });
        }
    }
    let channels: Vec<ChannelSummary> = (0..record.channels.len())
        .map(|i| {
            let valid = record.channels[i].values.iter().filter(|value| value.is_finite());
            let (sum, samples) = valid.fold((0.0, 0), |(sum, n), value| (sum + value, n + 1));
            ChannelSummary {
                samples,
                range: extremes(record.channels[i].values),
                mean: sum / samples as f64,
                noise: cleaned.noise[i],
            }
        })
        .collect();
    findings.extend(cleaned.findings.iter().cloned());
    findings.extend(pair_findings(record.times, &cleaned, &comparisons));
    findings.extend(odd_findings(&comparisons));

    // One sample has no slope over any window.
    let window = request.window.or_else(|| slope_window(record.times)).unwrap_or(1.0);
    let noise: Vec<Option<f64>> =
        cleaned.noise.iter().map(|noise| noise.map(|noise| noise.std)).collect();
    let values = record.channels.iter().zip(&cleaned.values);
    let without_faults = ScreenedRecord {
        times: record.times,
        channels: values.map(|(c, values)| Channel { values, ..*c }).collect(),
    };
    let motion = motion(&without_faults, &noise, window, &request.limits);
    let tolerances: Vec<f64> = noise.iter().map(|std| std.unwrap_or(0.0)).collect();
    let points = operating_points(&motion, &tolerances);
    Screening { findings, channels, sampling, comparisons, motion, points }
}

fn spacing_findings(sampling: &SampleSpacing) -> Vec<Finding> {
    let whole = |fault, stretches| Finding {
        channels: Vec::new(),
        stretches,
        fault,
        p_value: None,
        weight: Severity::Remark,
    };
    let mut findings = Vec::new();
    if !sampling.gaps.is_empty() {
        let gaps = whole(ChannelFault::Gaps, sampling.gaps.clone());
        findings.push(Finding { weight: Severity::Fault, ..gaps });
    }
    if sampling.uneven > UNEVEN {
        findings.push(whole(ChannelFault::Uneven(sampling.uneven), Vec::new()));
    }
    findings
}
