//! Where the information on each parameter comes from: steady operating points or transients.

use std::fmt::Write as _;

use dgd_identify::{
    EstimateError, Fit, Information, OutputErrorEvaluation, OutputErrorProblem, Recording,
    information,
};
use dgd_runtime::model::Model;
use dgd_runtime::{LimitSide, Signature, Unit};
use dgd_screen::{
    Channel, Motion, ScreenedRecord, SteadyPoint, motion, operating_points, slope_window,
};

use crate::fit::report::intervals::IntervalEstimates;
use crate::fit::report::outcome::OutputErrorReport;
use crate::output::quantity::short;
use crate::output::table::{push_table, significant};
use crate::result::ByName;
use crate::result::fit::{
    BestSample, InformationEntry, OperatingPointEntry, RecordingShare, StdWithMore, ValueEntry,
};

/// Index of the transient kind, which precedes the operating points.
const TRANSIENT: usize = 0;

/// A kind of samples with more than this share of the information on a parameter determines it.
const MUCH: f64 = 0.1;

/// Kinds with fewer samples than this are not considered for further tests.
const ENOUGH: usize = 20;

/// Below this share, steady samples carry no information on a parameter; above its complement, all of it.
const NOTHING: f64 = 0.01;

/// The sources of information on each estimate, if requested.
pub(crate) struct InformationSources {
    all: Vec<Information>,
    /// Share of each kind in all samples.
    shares: Vec<f64>,
    /// Samples of each kind.
    counts: Vec<usize>,
    /// The operating points: the kinds after the first.
    points: Vec<InformationPoint>,
}

/// An operating point.
struct InformationPoint {
    /// Means of the inputs, SI.
    inputs: Vec<f64>,
    /// Means of the simulated outputs, SI.
    outputs: Vec<f64>,
}

impl InformationSources {
    /// Computes them at the end of a fit.
    pub(crate) fn find(
        problem: &OutputErrorProblem<'_>,
        fit: &Fit,
        evaluation: &OutputErrorEvaluation,
    ) -> Result<Self, EstimateError> {
        let (kinds, points) = kinds(problem.system, problem.recordings, evaluation);
        let count = |kind: usize| kinds.iter().flatten().filter(|found| **found == kind).count();
        let counts: Vec<usize> = (0..=points.len()).map(count).collect();
        let samples = kinds.iter().flatten().count().max(1) as f64;
        let shares = counts.iter().map(|count| *count as f64 / samples).collect();
        let origins = information(problem, fit, &kinds, counts.len())?;
        Ok(Self { all: origins, shares, counts, points })
    }

    /// The kind of samples of which more would help most.
    fn best_test(&self, found: &Information) -> Option<(usize, f64)> {
        let candidates =
            found.again.iter().enumerate().filter(|(kind, _)| self.counts[*kind] >= ENOUGH);
        let candidates = candidates.filter_map(|(kind, again)| Some((kind, (*again)?)));
        candidates.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// An operating point by its inputs; for a model without inputs, by its outputs.
    fn place(&self, point: usize, signature: &Signature) -> String {
        let InformationPoint { inputs, outputs } = &self.points[point];
        let named = |name: &str, value: f64, unit: &Unit| {
            format!("`{name}` = {} {}", short(unit.from_si(value), 3), unit.symbol)
        };
        let quantities: Vec<String> = if inputs.is_empty() {
            let outputs = signature.outputs.iter().zip(outputs);
            outputs.map(|(output, value)| named(&output.name, *value, &output.unit)).collect()
        } else {
            let inputs = signature.inputs.iter().zip(inputs);
            inputs.map(|(input, value)| named(&input.name, *value, &input.unit)).collect()
        };
        quantities.join(", ")
    }

    /// The entry of each estimate in the result.
    pub(crate) fn entries(&self, outcome: &OutputErrorReport<'_>) -> ByName<InformationEntry> {
        let entry = |found: &Information| {
            let outputs = outcome.signature.outputs.iter().zip(&found.outputs);
            let outputs = outputs.zip(&outcome.fit.noise).filter(|(_, noise)| noise.is_some());
            let outputs = outputs.map(|((output, part), _)| (output.name.to_string(), Some(*part)));
            let recordings = outcome.data.iter().zip(&found.recordings).map(|(path, part)| {
                RecordingShare { data: path.display().to_string(), part: Some(*part) }
            });
            let best = found.best.map(|(r, output, k)| BestSample {
                data: outcome.data[r].display().to_string(),
                output: outcome.signature.outputs[output].name.to_string(),
                time: outcome.recordings[r].times[k],
            });
            InformationEntry {
                outputs: outputs.collect(),
                recordings: recordings.collect(),
                steady: Some(steady(&found.kinds)),
                transient: Some(found.kinds[TRANSIENT]),
                operating_points: found.kinds[TRANSIENT + 1..].iter().copied().map(Some).collect(),
                std_with_as_much_again: StdWithMore {
                    all: Some(found.all_again),
                    transient: found.again[TRANSIENT],
                    operating_points: found.again[TRANSIENT + 1..].to_vec(),
                },
                best,
            }
        };
        self.all.iter().map(|found| (outcome.name(found.estimate), entry(found))).collect()
    }

    /// The operating points in the result.
    pub(crate) fn point_entries(&self, signature: &Signature) -> Vec<OperatingPointEntry> {
        let entry = |(point, share): (&InformationPoint, &f64)| {
            let inputs = signature.inputs.iter().zip(&point.inputs);
            let outputs = signature.outputs.iter().zip(&point.outputs);
            OperatingPointEntry {
                share: Some(*share),
                inputs: inputs
                    .map(|(input, value)| {
                        (input.name.to_string(), ValueEntry::new(*value, &input.unit))
                    })
                    .collect(),
                outputs: outputs
                    .map(|(output, value)| {
                        (output.name.to_string(), ValueEntry::new(*value, &output.unit))
                    })
                    .collect(),
            }
        };
        self.points.iter().zip(&self.shares[TRANSIENT + 1..]).map(entry).collect()
    }

    /// A line for each parameter.
    pub(crate) fn push_text(&self, text: &mut String, outcome: &OutputErrorReport<'_>) {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "\nwhat determines each parameter ({} of the samples are steady{}):",
            percent(steady(&self.shares)),
            match self.points.len() {
                0 => String::new(),
                1 => ", at one operating point".to_owned(),
                n => format!(", at {n} operating points"),
            }
        );
        let is_parameter =
            |found: &&Information| outcome.fit.estimates[found.estimate].recording.is_none();
        for found in self.all.iter().filter(is_parameter) {
            let names = outcome.signature.outputs.iter().map(|output| output.name.to_string());
            let mut outputs: Vec<(String, f64)> =
                names.zip(found.outputs.iter().copied()).collect();
            outputs.sort_by(|a, b| b.1.total_cmp(&a.1));
            let outputs: Vec<String> = outputs
                .iter()
                .filter(|(_, part)| *part >= 0.1)
                .map(|(name, part)| format!("{} `{name}`", percent(*part)))
                .collect();
            let verdict = match steady(&found.kinds) {
                _ if self.points.is_empty() => "",
                steady if steady < NOTHING => "; what is steady says nothing of it",
                _ if found.kinds[TRANSIENT] < NOTHING => "; what changes says nothing of it",
                _ => "",
            };
            let points = (0..self.points.len())
                .map(|point| (point, found.kinds[TRANSIENT + 1 + point]))
                .filter(|(_, part)| *part >= MUCH && self.points.len() > 1)
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .map_or_else(String::new, |(point, part)| {
                    let place = self.place(point, outcome.signature);
                    format!("; {} from rest at {place}", percent(part))
                });
            let best = found.best.map_or_else(String::new, |(r, output, k)| {
                let file = match outcome.recording_names.as_slice() {
                    [_] => String::new(),
                    names => format!(" of {}", names[r]),
                };
                format!(
                    "; most by `{}` at {} s{file}",
                    outcome.signature.outputs[output].name,
                    short(outcome.recordings[r].times[k], 4)
                )
            });
            let _ = writeln!(
                text,
                "`{}`: {} from transients; {}{verdict}{points}{best}",
                outcome.name(found.estimate),
                percent(found.kinds[TRANSIENT]),
                outputs.join(", ")
            );
        }
        self.push_tests(text, outcome);
    }

    /// The best effect of doubling the samples of one kind, for each parameter.
    fn push_tests(&self, text: &mut String, outcome: &OutputErrorReport<'_>) {
        let mut table = vec![
            [
                "a test as long again",
                "std now",
                "the same again",
                "the best",
                "unit",
                "of which kind",
            ]
            .map(str::to_owned),
        ];
        for found in &self.all {
            let estimate = &outcome.fit.estimates[found.estimate];
            let (Some(std), None) = (estimate.std, estimate.recording) else { continue };
            let Some((kind, again)) = self.best_test(found) else { continue };
            let unit = outcome.unit(found.estimate);
            let shown = |std: f64| significant(std / unit.factor, 2);
            let what = match kind.checked_sub(TRANSIENT + 1) {
                None => "transients".to_owned(),
                Some(point) => format!("rest at {}", self.place(point, outcome.signature)),
            };
            table.push([
                outcome.name(found.estimate),
                shown(std),
                shown(std * found.all_again),
                shown(std * again),
                unit.symbol.to_string(),
                what,
            ]);
        }
        if table.len() > 1 {
            text.push('\n');
            push_table(text, &table);
        }
    }
}

fn percent(part: f64) -> String {
    format!("{:.0} %", 100.0 * part)
}

/// Information from steady samples of all operating points.
fn steady(kinds: &[f64]) -> f64 {
    kinds.iter().enumerate().filter(|(kind, _)| *kind != TRANSIENT).map(|(_, part)| part).sum()
}

/// For each sample of each recording, whether it is transient or at which operating point, and the points. Samples are
/// classified by inputs and simulated outputs, which have no noise.
fn kinds(
    system: &dyn Model,
    recordings: &[Recording],
    evaluation: &OutputErrorEvaluation,
) -> (Vec<Vec<usize>>, Vec<InformationPoint>) {
    let signature = system.signature();
    let mut kinds: Vec<Vec<usize>> =
        recordings.iter().map(|recording| vec![TRANSIENT; recording.times.len()]).collect();
    // Segments of all recordings, and their positions.
    let mut motions: Option<Motion> = None;
    let mut places: Vec<(usize, (usize, usize))> = Vec::new();
    for (r, (recording, observations)) in
        recordings.iter().zip(&evaluation.observations).enumerate()
    {
        let motion = motion_of(signature, recording, |k, i| observations.w(k)[i]);
        places.extend(motion.steady.iter().map(|steady| (r, steady.samples)));
        match &mut motions {
            None => motions = Some(motion),
            Some(all) => {
                for rest in motion.rests {
                    match all.rests.iter_mut().find(|other| other.channel == rest.channel) {
                        Some(other) => other.change = other.change.max(rest.change),
                        None => all.rests.push(rest),
                    }
                }
                all.steady.extend(motion.steady);
            }
        }
    }
    let Some(motion) = motions else { return (kinds, Vec::new()) };
    let n_w = signature.outputs.len();
    let operating = operating_points(&motion, &vec![0.0; n_w + signature.inputs.len()]);
    let mut points = Vec::with_capacity(operating.len());
    for (point, SteadyPoint { stretches, means, .. }) in operating.into_iter().enumerate() {
        for stretch in stretches {
            let (r, (first, last)) = places[stretch];
            kinds[r][first..=last].fill(TRANSIENT + 1 + point);
        }
        points.push(InformationPoint {
            inputs: means[n_w..].to_vec(),
            outputs: means[..n_w].to_vec(),
        });
    }
    (kinds, points)
}

/// The steady intervals of a recording's inputs and simulated outputs.
fn motion_of(
    signature: &Signature,
    recording: &Recording,
    simulated: impl Fn(usize, usize) -> f64,
) -> Motion {
    let n = recording.times.len();
    let mut values: Vec<Vec<f64>> =
        (0..signature.outputs.len()).map(|i| (0..n).map(|k| simulated(k, i)).collect()).collect();
    let mut inputs = vec![Vec::with_capacity(n); signature.inputs.len()];
    let mut u = vec![0.0; recording.inputs.len()];
    for t in &recording.times {
        recording.inputs.value(*t, LimitSide::Right, &mut u);
        inputs.iter_mut().zip(&u).for_each(|(values, u)| values.push(*u));
    }
    values.extend(inputs);
    let channel = |values| Channel { name: "", unit: "", values };
    let channels: Vec<Channel<'_>> =
        values.iter().map(|values| channel(values.as_slice())).collect();
    let window = slope_window(&recording.times).unwrap_or(1.0);
    let noise = vec![None; channels.len()];
    motion(&ScreenedRecord { times: &recording.times, channels }, &noise, window, &[])
}
