//! All tests on one record.

use crate::clock::shift;
use crate::estimate::Estimate;
use crate::frozen::{frozen, saturated};
use crate::noise::{SensorNoise, white_noise};
use crate::operating_points::{OperatingPoint, operating_points};
use crate::record::{Record, Stretch, extremes, runs};
use crate::redundant::{Compared, Comparison, Kinship, compare, noise_of_each, odd_one, stem};
use crate::sampling::{Sampling, sampling};
use crate::spikes::{Spike, spikes};
use crate::steady::{Motion, motion};

/// A claim is made where chance makes it less often than this.
pub const RARE: f64 = 1e-6;

/// What is known besides the samples.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// Channels that measure the same.
    pub same: Vec<[usize; 2]>,
    /// Channels that are not compared although their names are alike.
    pub different: Vec<[usize; 2]>,
    /// Window for slopes, s; chosen by the spacing of the samples without it.
    pub window: Option<f64>,
    /// Largest slopes of channels at rest, per second.
    pub limits: Vec<(usize, f64)>,
}

/// What was found in a record.
#[derive(Debug, Clone)]
pub struct Screening {
    /// What is wrong or notable, in the order of channels.
    pub findings: Vec<Finding>,
    /// Each channel in numbers.
    pub channels: Vec<Summary>,
    /// The spacing of the samples.
    pub sampling: Sampling,
    /// Channels that measure the same, in pairs.
    pub comparisons: Vec<Comparison>,
    /// Steady stretches and transients.
    pub motion: Motion,
    /// Steady stretches, grouped.
    pub points: Vec<OperatingPoint>,
}

/// A channel in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Values that are numbers.
    pub samples: usize,
    /// Smallest and largest of them.
    pub range: Option<(f64, f64)>,
    /// Their mean.
    pub mean: f64,
    /// White noise, of what is not frozen, saturated or a spike.
    pub noise: Option<SensorNoise>,
}

/// Whether something is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weight {
    /// It misleads a fit.
    Fault,
    /// It is good to know.
    Remark,
}

/// Something that is wrong or notable.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The channels that it is about; none for the times.
    pub channels: Vec<usize>,
    /// When; empty where it is all of the record.
    pub stretches: Vec<Stretch>,
    /// What.
    pub fault: Fault,
    /// Bound of the probability that chance makes it; `None` where it is no matter of chance.
    pub p_value: Option<f64>,
    /// Whether it is a fault.
    pub weight: Weight,
}

/// What may be wrong with channels.
#[derive(Debug, Clone, PartialEq)]
pub enum Fault {
    /// There is no value at all.
    Empty,
    /// All values are this one.
    Constant(f64),
    /// So many values are missing.
    Missing(usize),
    /// Times between which nothing was recorded.
    Gaps,
    /// This share of the samples is not at the usual distance.
    Uneven(f64),
    /// So many readings of one value.
    Frozen {
        /// The value.
        value: f64,
        /// Number of readings.
        samples: usize,
        /// Whether the channel is shown to have gone on behind it: by a jump at its end, or by another
        /// that measures the same. Otherwise it may have been set.
        is_shown: bool,
    },
    /// Readings pile up at a limit.
    Saturated {
        /// The limit.
        limit: f64,
        /// Whether it is the upper one.
        is_upper: bool,
        /// Number of readings there.
        samples: usize,
    },
    /// Pulses that several channels show at once: an event rather than spikes.
    Pulses {
        /// Number of them.
        count: usize,
        /// The height of the largest, with its sign.
        largest: f64,
    },
    /// Readings that stand alone.
    Spikes {
        /// Number of them.
        count: usize,
        /// The height of the largest, with its sign.
        largest: f64,
    },
    /// Readings are rounded to steps that hide the noise.
    Coarse {
        /// The step.
        step: f64,
    },
    /// The second channel reads this much more than the first.
    Offset {
        /// Second − first.
        offset: Estimate,
        /// Why they are compared.
        kinship: Kinship,
    },
    /// The channel is the odd one of several; its offset from the middle one of the others.
    Odd(Estimate),
    /// The second channel's slope over the first, less one.
    Gain(Estimate),
    /// The second channel drifts from the first, per second.
    Drift(Estimate),
    /// The second channel's noise is this many times that of the first.
    Noisier(f64),
    /// The second channel is late by this, s.
    Late(Estimate),
}

/// Two channels with alike names, and what the record says of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Kin {
    /// Their positions.
    pub channels: [usize; 2],
    /// Whether their names differ in a letter.
    pub by_letter: bool,
    /// What they are.
    pub compared: Compared,
}

/// Neighbours that are equal: above this share rounding hides the noise.
const HIDDEN: f64 = 0.5;
/// Offsets up to this many standard deviations of one reading do no harm.
const HARMLESS: f64 = 0.25;
/// Ratio of noises of sensors of one quantity.
const NOISIER: f64 = 2.0;
/// Share of uneven spacings that is worth a remark.
const UNEVEN: f64 = 0.05;
/// Standard deviations by which the end of a frozen stretch jumps.
const JUMP: f64 = 6.0;
/// Changes of a partner that show that the quantity was alive.
const FEW: usize = 5;
/// Neighbours on either side that a pulse is compared with, and standard deviations outside of them
/// that make it one in another channel.
const AROUND: usize = 3;
const ALONG: f64 = 2.5;
/// Windows for slopes are at least so many samples, and so many seconds.
const WINDOW: (f64, f64) = (20.0, 30.0);

/// Compares all channels of one unit with alike names.
pub fn kin(record: &Record<'_>, request: &Request) -> Vec<Kin> {
    let cleaned = Cleaned::of(record);
    cleaned.kin(record, request)
}

/// Runs all tests on a record.
pub fn screen(record: &Record<'_>, request: &Request) -> Screening {
    let cleaned = Cleaned::of(record);
    let sampling = sampling(record.times);
    let mut findings = spacing_findings(&sampling);
    let comparisons: Vec<Comparison> = cleaned
        .kin(record, request)
        .into_iter()
        .filter_map(|kin| match kin.compared {
            Compared::Same(comparison) => Some(*comparison),
            Compared::Different | Compared::Unknown => None,
        })
        .collect();
    let channels: Vec<Summary> = (0..record.channels.len())
        .map(|i| {
            let valid = record.channels[i].values.iter().filter(|value| value.is_finite());
            let (sum, samples) = valid.fold((0.0, 0), |(sum, n), value| (sum + value, n + 1));
            Summary {
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

    let usual = sampling.usual.unwrap_or(1.0);
    let window = request.window.unwrap_or((WINDOW.0 * usual).max(WINDOW.1));
    let noise: Vec<Option<f64>> =
        cleaned.noise.iter().map(|noise| noise.map(|noise| noise.std)).collect();
    let values = record.channels.iter().zip(&cleaned.values);
    let without_faults = Record {
        times: record.times,
        channels: values.map(|(c, values)| crate::Channel { values, ..*c }).collect(),
    };
    let motion = motion(&without_faults, &noise, &[], window, &request.limits);
    let tolerances: Vec<f64> = noise.iter().map(|std| std.unwrap_or(0.0)).collect();
    let points = operating_points(&motion, &tolerances);
    Screening { findings, channels, sampling, comparisons, motion, points }
}

fn spacing_findings(sampling: &Sampling) -> Vec<Finding> {
    let whole = |fault, stretches| Finding {
        channels: Vec::new(),
        stretches,
        fault,
        p_value: None,
        weight: Weight::Remark,
    };
    let mut findings = Vec::new();
    if !sampling.gaps.is_empty() {
        let gaps = whole(Fault::Gaps, sampling.gaps.clone());
        findings.push(Finding { weight: Weight::Fault, ..gaps });
    }
    if sampling.uneven > UNEVEN {
        findings.push(whole(Fault::Uneven(sampling.uneven), Vec::new()));
    }
    findings
}

/// Spikes, and whether other channels show them, too.
type Marked<'a> = Vec<(&'a Spike, bool)>;

/// A record without what single channels have wrong.
struct Cleaned {
    /// Values; NaN for spikes and for what is frozen or saturated.
    values: Vec<Vec<f64>>,
    noise: Vec<Option<SensorNoise>>,
    findings: Vec<Finding>,
}

impl Cleaned {
    fn of(record: &Record<'_>) -> Cleaned {
        let mut cleaned = Cleaned { values: Vec::new(), noise: Vec::new(), findings: Vec::new() };
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
                            stands_out(&cleaned.values[j], spike.samples, noise.std)
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

    /// What stands still or is not there.
    fn add_runs(&mut self, record: &Record<'_>, channel: usize) {
        let (times, raw) = (record.times, record.channels[channel].values);
        let mut values = raw.to_vec();
        let mut find = |fault, stretches, p_value, weight| {
            let channels = vec![channel];
            self.findings.push(Finding { channels, stretches, fault, p_value, weight });
        };
        let Some((low, high)) = extremes(raw) else {
            find(Fault::Empty, Vec::new(), None, Weight::Fault);
            self.values.push(values);
            return;
        };
        let missing = runs(raw.len(), |k| !raw[k].is_finite());
        if !missing.is_empty() {
            let count = missing.iter().map(|(first, last)| last - first + 1).sum();
            let stretches = missing.iter().map(|(a, b)| Stretch::of(times, *a, *b)).collect();
            find(Fault::Missing(count), stretches, None, Weight::Remark);
        }
        if low == high {
            find(Fault::Constant(low), Vec::new(), None, Weight::Remark);
            self.values.push(values);
            return;
        }
        for pile in saturated(times, raw) {
            let fault = Fault::Saturated {
                limit: pile.limit,
                is_upper: pile.is_upper,
                samples: pile.samples.len(),
            };
            find(fault, pile.stretches, Some(pile.p_value), Weight::Fault);
            pile.samples.iter().for_each(|k| values[*k] = f64::NAN);
        }
        let runs = frozen(times, &values);
        let mut alive = values.clone();
        for run in &runs {
            alive[run.samples.0..=run.samples.1].fill(f64::NAN);
        }
        let noise = if runs.is_empty() { None } else { white_noise(times, &alive, &alive) };
        let mut held: Option<Finding> = None;
        for run in runs {
            let (first, last) = run.samples;
            // A set value goes on from where it was held.
            let clear = JUMP * noise.map_or(0.0, |noise| noise.std);
            let is_shown = run.release.is_some_and(|jump| jump > clear)
                || partners(record, channel).any(|other| {
                    let values = &record.channels[other].values[first..=last];
                    values.windows(2).filter(|pair| pair[0] != pair[1]).count() > FEW
                });
            let fault = Fault::Frozen { value: run.value, samples: last - first + 1, is_shown };
            match &mut held {
                _ if is_shown => find(fault, vec![run.stretch], Some(run.p_value), Weight::Fault),
                // What is held again and again is one remark.
                Some(Finding { stretches, .. }) => stretches.push(run.stretch),
                None => {
                    held = Some(Finding {
                        channels: vec![channel],
                        stretches: vec![run.stretch],
                        fault,
                        p_value: Some(run.p_value),
                        weight: Weight::Remark,
                    });
                }
            }
            values[first..=last].fill(f64::NAN);
        }
        self.findings.extend(held);
        self.values.push(values);
    }

    /// What stands alone, and the noise of the rest. Pulses that other channels show too are left in,
    /// unless they leave the channel's range.
    fn add_spikes(
        &mut self,
        record: &Record<'_>,
        channel: usize,
        spikes: &[Spike],
        shared: &[bool],
    ) {
        let times = record.times;
        let values = &mut self.values[channel];
        let usual = usual_range(values, spikes);
        let (pulses, spikes): (Marked<'_>, Marked<'_>) = spikes
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
            let stretch = |spike: &Spike| Stretch::of(times, spike.samples.0, spike.samples.1);
            let (fault, weight) = if is_spike {
                (Fault::Spikes { count, largest }, Weight::Fault)
            } else {
                (Fault::Pulses { count, largest }, Weight::Remark)
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
                fault: Fault::Coarse { step },
                p_value: None,
                weight: Weight::Remark,
            });
        }
        self.noise.push(noise);
    }

    fn kin(&self, record: &Record<'_>, request: &Request) -> Vec<Kin> {
        let n = record.channels.len();
        let mut all = Vec::new();
        for i in 0..n {
            for j in i + 1..n {
                let (a, b) = (&record.channels[i], &record.channels[j]);
                let is_same = request.same.contains(&[i, j]);
                let proposed = stem(a.name, b.name).filter(|_| a.unit == b.unit);
                let by_letter = proposed.as_ref().is_some_and(|(_, by_letter)| *by_letter);
                if !is_same && (proposed.is_none() || request.different.contains(&[i, j])) {
                    continue;
                }
                let values = [self.values[i].as_slice(), self.values[j].as_slice()];
                let is_known = is_same || by_letter;
                let compared = match compare(record.times, values, [i, j], is_known) {
                    Compared::Different if is_known => late_twin(record.times, values, [i, j]),
                    other => other,
                };
                all.push(Kin { channels: [i, j], by_letter, compared });
            }
        }
        all
    }
}

/// Whether rounding to this step leaves most neighbours equal although they move.
fn hides_noise(values: &[f64], step: f64) -> bool {
    let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let (mut equal, mut single, mut all) = (0usize, 0usize, 0usize);
    for change in steps.filter(|change| change.is_finite()) {
        all += 1;
        equal += usize::from(change == 0.0);
        single += usize::from(change > 0.0 && change < 1.5 * step);
    }
    // What jumps by many steps at a time is set, not rounded.
    equal as f64 > HIDDEN * all as f64 && single as f64 > HIDDEN * (all - equal) as f64
}

/// Compares two channels that move apart after putting their clocks together.
fn late_twin(times: &[f64], values: [&[f64]; 2], channels: [usize; 2]) -> Compared {
    let [a, b] = values;
    let (Some(late), Some(spacing)) = (shift(times, a, b), crate::usual_spacing(times)) else {
        return Compared::Different;
    };
    let samples = (late.value / spacing).round();
    let n = times.len();
    let lag = samples.abs() as usize;
    if lag == 0 || 2 * lag > n {
        return Compared::Different;
    }
    let (kept, behind) = (..n - lag, lag..);
    if samples > 0.0 {
        compare(&times[kept], [&a[kept], &b[behind]], channels, true)
    } else {
        compare(&times[kept], [&a[behind], &b[kept]], channels, true)
    }
}

/// Other channels whose names differ in a last letter.
fn partners<'a>(record: &'a Record<'_>, channel: usize) -> impl Iterator<Item = usize> + 'a {
    let own = &record.channels[channel];
    (0..record.channels.len()).filter(move |other| {
        let other = &record.channels[*other];
        other.unit == own.unit && stem(own.name, other.name).is_some_and(|(_, letter)| letter)
    })
}

/// Whether a channel stands out from its neighbours at these samples, too.
fn stands_out(values: &[f64], samples: (usize, usize), noise: f64) -> bool {
    let (first, last) = samples;
    let around = first.saturating_sub(AROUND)..first;
    let behind = last + 1..(last + 1 + AROUND).min(values.len());
    let neighbours = || around.clone().chain(behind.clone()).map(|k| values[k]);
    let low = neighbours().filter(|x| x.is_finite()).fold(f64::INFINITY, f64::min);
    let high = neighbours().filter(|x| x.is_finite()).fold(f64::NEG_INFINITY, f64::max);
    let clear = ALONG * noise;
    (first..=last).map(|k| values[k]).any(|x| x > high + clear || x < low - clear)
}

/// Range of what is no spike.
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

/// What pairs of channels say of each other.
fn pair_findings(times: &[f64], cleaned: &Cleaned, pairs: &[Comparison]) -> Vec<Finding> {
    let span = times.last().zip(times.first()).map_or(0.0, |(last, first)| last - first);
    let mut findings = Vec::new();
    for pair in pairs {
        let mut find = |fault, p_value| {
            findings.push(Finding {
                channels: pair.channels.to_vec(),
                stretches: Vec::new(),
                fault,
                p_value: Some(p_value),
                weight: Weight::Fault,
            });
        };
        let [a, b] = pair.noise.map(|noise| noise.map_or(0.0, |noise| noise.std));
        let harmless = HARMLESS * a.max(b);
        let step = pair.noise.iter().flatten().filter_map(|n| n.quantisation).fold(0.0, f64::max);
        // Rounding of channels that hardly move may put them a step apart.
        let rounding = if a.min(b) < 0.5 * step { step } else { 0.0 };
        let p = pair.offset.p_value_beyond(harmless.max(rounding));
        if p < RARE {
            find(Fault::Offset { offset: pair.offset, kinship: pair.kinship }, p);
        }
        if let Some(gain) = pair.gain {
            let [first, _] = pair.channels;
            let (low, high) = extremes(&cleaned.values[first]).unwrap_or_default();
            let p = gain.p_value_beyond(harmless / (high - low));
            if p < RARE {
                find(Fault::Gain(gain), p);
            }
        }
        if let Some(rate) = pair.rate {
            let p = rate.p_value_beyond(harmless / span);
            if p < RARE {
                find(Fault::Drift(rate), p);
            }
        }
        if let [Some(one), Some(other)] = pair.noise {
            let ratio = other.std / one.std;
            let doubt = 5.0 * (one.relative_error + other.relative_error);
            if ratio.max(1.0 / ratio) > NOISIER * (1.0 + doubt) {
                find(Fault::Noisier(ratio), RARE);
            }
        }
        if pair.kinship == Kinship::Moving {
            let [first, second] = pair.channels;
            let late = shift(times, &cleaned.values[first], &cleaned.values[second]);
            // A tenth of a sample is no clock.
            let spacing = crate::usual_spacing(times).unwrap_or(0.0);
            if let Some(late) = late {
                let p = late.p_value_beyond(0.1 * spacing);
                if p < RARE {
                    find(Fault::Late(late), p);
                }
            }
        }
    }
    findings
}

/// Which of three and more channels is the odd one.
fn odd_findings(pairs: &[Comparison]) -> Vec<Finding> {
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
        // Against the other one that is nearest to the middle of the others.
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
                fault: Fault::Odd(estimate),
                p_value: Some(p_value),
                weight: Weight::Fault,
            });
        }
    }
    findings
}

/// Channels that are joined by comparisons, in order.
pub(crate) fn groups(pairs: &[Comparison]) -> Vec<Vec<usize>> {
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

impl Screening {
    /// White noise of the members of each group of three and more channels that measure the same, from
    /// their differences: position and standard deviation.
    pub fn noise_of_groups(&self) -> Vec<Vec<(usize, f64)>> {
        groups(&self.comparisons)
            .into_iter()
            .filter(|group| group.len() > 2)
            .filter_map(|group| {
                let mut variances = Vec::new();
                for (at, i) in group.iter().enumerate() {
                    for j in &group[at + 1..] {
                        let pair = self.comparisons.iter().find(|p| p.channels == [*i, *j])?;
                        variances.push(pair.difference_noise?.std.powi(2));
                    }
                }
                let noise = noise_of_each(group.len(), &variances);
                Some(group.into_iter().zip(noise).collect())
            })
            .collect()
    }
}
