//! Faults of single channels, and the record without them.

use crate::finding::{ChannelFault, Finding, Severity};
use crate::frozen::{frozen, saturated};
use crate::record::{ScreenedRecord, TimeStretch, extremes, runs};
use crate::redundant::stem;
use crate::spikes::{Spike, spikes};
use crate::statistics::noise::{SensorNoise, white_noise};

/// Fraction of equal neighbours above which rounding hides the noise.
const HIDDEN: f64 = 0.5;
/// Number of changes of a partner channel that show that the quantity was changing.
const FEW: usize = 5;
/// Number of neighbours on either side with which a pulse is compared, and standard deviations outside them that make
/// it a pulse in another channel.
const AROUND: usize = 3;
const ALONG: f64 = 2.5;

/// Spikes, and whether other channels show them too.
type MarkedSpikes<'a> = Vec<(&'a Spike, bool)>;

/// A record without the faults of single channels.
pub(crate) struct CleanedRecord {
    /// Values; NaN for spikes and for frozen or saturated readings.
    pub(crate) values: Vec<Vec<f64>>,
    pub(crate) noise: Vec<Option<SensorNoise>>,
    pub(crate) findings: Vec<Finding>,
}

impl CleanedRecord {
    /// Checks every channel of a record.
    pub(crate) fn clean(record: &ScreenedRecord<'_>) -> CleanedRecord {
        let mut cleaned =
            CleanedRecord { values: Vec::new(), noise: Vec::new(), findings: Vec::new() };
        for channel in 0..record.channels.len() {
            cleaned.add_runs(record, channel);
        }
        let noise: Vec<Option<SensorNoise>> =
            cleaned.values.iter().map(|values| white_noise(record.times, values, values)).collect();
        let spikes: Vec<Vec<Spike>> =
            cleaned.values.iter().zip(&noise).map(|(x, noise)| spikes(x, noise.as_ref())).collect();
        let shared: Vec<Vec<bool>> = (0..spikes.len())
            .map(|i| {
                let is_shared = |spike: &Spike| {
                    let others = (0..spikes.len()).filter(|j| *j != i);
                    others.map(|j| (j, &noise[j])).any(|(j, noise)| {
                        noise.as_ref().is_some_and(|noise| {
                            let (first, last) = spike.samples;
                            stands_out(&cleaned.values[j], first, last, noise.std)
                        })
                    })
                };
                spikes[i].iter().map(is_shared).collect()
            })
            .collect();
        for (channel, (spikes, shared)) in spikes.iter().zip(&shared).enumerate() {
            cleaned.add_spikes(record, channel, spikes, shared);
        }
        cleaned.findings.sort_by_key(|finding| finding.channels.clone());
        cleaned
    }

    /// Adds findings about constant, frozen, saturated and missing values.
    fn add_runs(&mut self, record: &ScreenedRecord<'_>, channel: usize) {
        let (times, raw) = (record.times, record.channels[channel].values);
        let mut values = raw.to_vec();
        let mut find = |fault, stretches, p_value, weight| {
            let channels = vec![channel];
            self.findings.push(Finding { channels, stretches, fault, p_value, weight });
        };
        let Some((low, high)) = extremes(raw) else {
            find(ChannelFault::Empty, Vec::new(), None, Severity::Fault);
            self.values.push(values);
            return;
        };
        let missing = runs(raw.len(), |k| !raw[k].is_finite());
        if !missing.is_empty() {
            let count = missing.iter().map(|(first, last)| last - first + 1).sum();
            let stretches =
                missing.iter().map(|(a, b)| TimeStretch::from_samples(times, *a, *b)).collect();
            find(ChannelFault::Missing(count), stretches, None, Severity::Remark);
        }
        if low == high {
            find(ChannelFault::Constant(low), Vec::new(), None, Severity::Remark);
            self.values.push(values);
            return;
        }
        for pile in saturated(times, raw) {
            let fault = ChannelFault::Saturated {
                limit: pile.limit,
                is_upper: pile.is_upper,
                samples: pile.samples.len(),
            };
            find(fault, pile.stretches, Some(pile.p_value), Severity::Fault);
            pile.samples.iter().for_each(|k| values[*k] = f64::NAN);
        }
        let runs = frozen(times, &values);
        let mut pending: Option<Finding> = None;
        for run in runs {
            let (first, last) = run.samples;
            // A set value may be held, but not if another sensor of the same quantity shows it changing.
            let is_shown = partners(record, channel).any(|other| {
                let values = &record.channels[other].values[first..=last];
                values.windows(2).filter(|pair| pair[0] != pair[1]).count() > FEW
            });
            let fault =
                ChannelFault::Frozen { value: run.value, samples: last - first + 1, is_shown };
            match &mut pending {
                _ if is_shown => find(fault, vec![run.stretch], Some(run.p_value), Severity::Fault),
                // Repeatedly held values give a single remark.
                Some(Finding { stretches, .. }) => stretches.push(run.stretch),
                None => {
                    pending = Some(Finding {
                        channels: vec![channel],
                        stretches: vec![run.stretch],
                        fault,
                        p_value: Some(run.p_value),
                        weight: Severity::Remark,
                    });
                }
            }
            values[first..=last].fill(f64::NAN);
        }
        self.findings.extend(pending);
        self.values.push(values);
    }

    /// Adds spikes, and the noise of the rest. Pulses that other channels also show are kept, unless they leave the
    /// channel's range.
    fn add_spikes(
        &mut self,
        record: &ScreenedRecord<'_>,
        channel: usize,
        spikes: &[Spike],
        shared: &[bool],
    ) {
        let times = record.times;
        let values = &mut self.values[channel];
        let usual = usual_range(values, spikes);
        let (pulses, spikes): (MarkedSpikes<'_>, MarkedSpikes<'_>) = spikes
            .iter()
            .zip(shared.iter().copied())
            .partition(|(spike, shared)| *shared && spike.height.abs() < usual);
        for (is_spike, group) in [(false, &pulses), (true, &spikes)] {
            let heights = group.iter().map(|(spike, _)| spike.height);
            let larger = |a: f64, b: f64| if b.abs() > a.abs() { b } else { a };
            let (count, largest) = (group.len(), heights.fold(0.0, larger));
            if count == 0 {
                continue;
            }
            let stretch =
                |spike: &Spike| TimeStretch::from_samples(times, spike.samples.0, spike.samples.1);
            let (fault, weight) = if is_spike {
                (ChannelFault::Spikes { count, largest }, Severity::Fault)
            } else {
                (ChannelFault::Pulses { count, largest }, Severity::Remark)
            };
            self.findings.push(Finding {
                channels: vec![channel],
                stretches: group.iter().map(|(spike, _)| stretch(spike)).collect(),
                fault,
                p_value: None,
                weight,
            });
        }
        for (spike, _) in &spikes {
            values[spike.samples.0..=spike.samples.1].fill(f64::NAN);
        }
        let noise = white_noise(times, values, values);
        if let Some(step) = noise.and_then(|noise| noise.quantisation)
            && hides_noise(values, step)
        {
            self.findings.push(Finding {
                channels: vec![channel],
                stretches: Vec::new(),
                fault: ChannelFault::Coarse { step },
                p_value: None,
                weight: Severity::Remark,
            });
        }
        self.noise.push(noise);
    }
}

/// Whether rounding to this step makes most neighbours equal although they change.
fn hides_noise(values: &[f64], step: f64) -> bool {
    let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let (mut equal, mut single, mut all) = (0usize, 0usize, 0usize);
    for change in steps.filter(|change| change.is_finite()) {
        all += 1;
        equal += usize::from(change == 0.0);
        single += usize::from(change > 0.0 && change < 1.5 * step);
    }
    // A value that jumps by many steps at a time is set, not rounded.
    equal as f64 > HIDDEN * all as f64 && single as f64 > HIDDEN * (all - equal) as f64
}

/// Other channels whose names differ only in a last letter.
fn partners<'a>(
    record: &'a ScreenedRecord<'_>,
    channel: usize,
) -> impl Iterator<Item = usize> + 'a {
    let original = &record.channels[channel];
    (0..record.channels.len()).filter(move |other| {
        let other = &record.channels[*other];
        other.unit == original.unit
            && stem(original.name, other.name).is_some_and(|(_, letter)| letter)
    })
}

/// Whether this channel also stands out from its neighbours at these samples.
fn stands_out(values: &[f64], first: usize, last: usize, noise: f64) -> bool {
    let around = first.saturating_sub(AROUND)..first;
    let behind = last + 1..(last + 1 + AROUND).min(values.len());
    // Without values on both sides there is no comparison.
    let (Some(before), Some(after)) = (extremes(&values[around]), extremes(&values[behind])) else {
        return false;
    };
    let (low, high) = (before.0.min(after.0), before.1.max(after.1));
    let clear = ALONG * noise;
    (first..=last).map(|k| values[k]).any(|x| x > high + clear || x < low - clear)
}

/// Range of the samples that are not spikes.
fn usual_range(values: &[f64], spikes: &[Spike]) -> f64 {
    if spikes.is_empty() {
        return 0.0;
    }
    let mut rest = values.to_vec();
    for spike in spikes {
        rest[spike.samples.0..=spike.samples.1].fill(f64::NAN);
    }
    extremes(&rest).map_or(0.0, |(low, high)| high - low)
}
