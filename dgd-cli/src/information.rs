//! Which data determines which parameter, and where there is most of it.

use std::fmt::Write as _;

use dgd_execute::Loaded;
use dgd_runtime::identify::{
    EstimateError, Evaluation, Fit, Information, OutputErrorProblem, Recording, information,
};
use dgd_runtime::{Side, System};
use dgd_screen::{Channel, Record, motion, usual_spacing};
use serde_json::{Map, Value, json};

use crate::fit_report::Outcome;
use crate::intervals::Estimated;
use crate::table::significant;

/// Windows in which a sample is at rest or not: so many samples and so many seconds, at least; as `dgd screen`.
const WINDOW: (f64, f64) = (20.0, 30.0);

/// Kinds of samples.
const KINDS: [&str; 2] = ["steady", "transient"];
const STEADY: usize = 0;
const TRANSIENT: usize = 1;

/// Below this part, what is steady says nothing of a parameter; above one less this, it says all.
const NOTHING: f64 = 0.01;

/// Where the information about each estimate comes from, if that was asked for.
pub(crate) struct Origins {
    all: Vec<Information>,
    /// Parts of all samples that are of each kind.
    shares: [f64; 2],
}

impl Origins {
    /// At the end of a fit.
    pub(crate) fn find(
        problem: &OutputErrorProblem<'_, Loaded>,
        fit: &Fit,
        evaluation: &Evaluation,
    ) -> Result<Self, EstimateError> {
        let recordings = problem.recordings.iter().zip(&evaluation.observations);
        let kinds: Vec<Vec<usize>> = recordings
            .map(|(recording, observations)| {
                kinds(problem.system, recording, |k, i| observations.w(k)[i])
            })
            .collect();
        let samples = kinds.iter().flatten().count().max(1) as f64;
        let shares = [STEADY, TRANSIENT].map(|kind| {
            kinds.iter().flatten().filter(|found| **found == kind).count() as f64 / samples
        });
        Ok(Self { all: information(problem, fit, &kinds, KINDS.len())?, shares })
    }

    /// `information` of `result.json`.
    pub(crate) fn to_json(&self, outcome: &Outcome<'_>) -> Value {
        let entry = |found: &Information| {
            let outputs: Map<String, Value> = outcome
                .signature
                .outputs
                .iter()
                .zip(&found.outputs)
                .zip(&outcome.fit.noise)
                .filter(|(_, noise)| noise.is_some())
                .map(|((output, part), _)| (output.name.to_string(), json!(part)))
                .collect();
            let recordings: Vec<Value> = outcome
                .data
                .iter()
                .zip(&found.recordings)
                .map(|(path, part)| json!({ "data": path.display().to_string(), "part": part }))
                .collect();
            let best = found.best.map(|(r, output, k)| {
                json!({
                    "data": outcome.data[r].display().to_string(),
                    "output": outcome.signature.outputs[output].name.to_string(),
                    "time": outcome.recordings[r].times[k],
                })
            });
            json!({
                "outputs": outputs,
                "recordings": recordings,
                "steady": found.kinds[STEADY],
                "transient": found.kinds[TRANSIENT],
                "best": best,
            })
        };
        Value::Object(self.all.iter().map(|f| (outcome.name(f.estimate), entry(f))).collect())
    }

    /// A line for each parameter.
    pub(crate) fn push_text(&self, text: &mut String, outcome: &Outcome<'_>) {
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "\nwhat determines each parameter ({} of the samples are steady):",
            percent(self.shares[STEADY])
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
            let verdict = match found.kinds[STEADY] {
                _ if self.shares[STEADY] == 0.0 => "",
                steady if steady < NOTHING => "; what is steady says nothing of it",
                _ if found.kinds[TRANSIENT] < NOTHING => "; what changes says nothing of it",
                _ => "",
            };
            let best = found.best.map_or_else(String::new, |(r, output, k)| {
                let file = match outcome.recording_names.as_slice() {
                    [_] => String::new(),
                    names => format!(" of {}", names[r]),
                };
                format!(
                    "; most by `{}` at {} s{file}, of which more would do better",
                    outcome.signature.outputs[output].name,
                    significant(outcome.recordings[r].times[k], 4)
                )
            });
            let _ = writeln!(
                text,
                "`{}`: {} from transients; {}{verdict}{best}",
                outcome.name(found.estimate),
                percent(found.kinds[TRANSIENT]),
                outputs.join(", ")
            );
        }
    }
}

fn percent(part: f64) -> String {
    format!("{:.0} %", 100.0 * part)
}

/// Which samples are steady, by inputs and by outputs as they are simulated, without noise.
fn kinds(
    system: &Loaded,
    recording: &Recording,
    simulated: impl Fn(usize, usize) -> f64,
) -> Vec<usize> {
    let n = recording.times.len();
    let signature = system.signature();
    let mut values: Vec<Vec<f64>> =
        (0..signature.outputs.len()).map(|i| (0..n).map(|k| simulated(k, i)).collect()).collect();
    let mut inputs = vec![Vec::with_capacity(n); signature.inputs.len()];
    let mut u = vec![0.0; recording.inputs.len()];
    for t in &recording.times {
        recording.inputs.value(*t, Side::Right, &mut u);
        inputs.iter_mut().zip(&u).for_each(|(values, u)| values.push(*u));
    }
    values.extend(inputs);
    let channel = |values| Channel { name: "", unit: "", values };
    let channels: Vec<Channel<'_>> =
        values.iter().map(|values| channel(values.as_slice())).collect();
    let window = usual_spacing(&recording.times).map_or(WINDOW.1, |h| (WINDOW.0 * h).max(WINDOW.1));
    let noise = vec![None; channels.len()];
    let found = motion(&Record { times: &recording.times, channels }, &noise, window, &[]);
    let mut kinds = vec![TRANSIENT; n];
    for steady in found.steady {
        let (first, last) = steady.samples;
        kinds[first..=last].fill(STEADY);
    }
    kinds
}
