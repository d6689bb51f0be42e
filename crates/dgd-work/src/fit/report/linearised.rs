//! The additional report of a fit of linear models: operating points and range of validity.

use std::fmt::Write as _;

use dgd_identify::{NonlinearModel, OutputErrorEvaluation, Recording};
use dgd_runtime::Signature;
use dgd_runtime::linearize::OperatingPoint;

use crate::fit::report::outcome::{OutputErrorReport, rms_of};
use crate::fit::report::quality::FitQuality;
use crate::fit::report::standard::NoiseStandard;
use crate::linearize::modes;
use crate::output::table::{push_table, significant};
use crate::request::LinearizeAt;
use crate::result::ByName;
use crate::result::fit::{
    LinearisedAt, LinearisedPoint, LinearisedResult, NonlinearCheck, NonlinearOutput, ValueEntry,
};

/// Digits of the values at a point.
const DIGITS: usize = 6;

/// The operating points of the linear models, and the nonlinear model with their estimates.
pub(crate) struct LinearisedReport {
    place: LinearizeAt,
    /// By recording; `None` for a recording without samples.
    points: Vec<Option<OperatingPoint>>,
    model: Result<NonlinearReport, String>,
}

/// The nonlinear model with the estimates of its linear one.
struct NonlinearReport {
    evaluation: OutputErrorEvaluation,
    quality: FitQuality,
    /// Root-mean-square difference from the linear model by output, SI; `None` without samples.
    differences: Vec<Option<f64>>,
}

impl LinearisedReport {
    /// From the recordings, their linear simulations, and those of the nonlinear model, or the reason why there is
    /// none.
    pub(crate) fn new(
        signature: &Signature,
        place: LinearizeAt,
        points: Vec<Option<OperatingPoint>>,
        recordings: &[Recording],
        linear: &OutputErrorEvaluation,
        standard: NoiseStandard<'_>,
        model: Result<NonlinearModel, String>,
    ) -> Self {
        let model = model.map(|NonlinearModel { evaluation, .. }| NonlinearReport {
            quality: FitQuality::evaluate(signature, recordings, &evaluation, standard),
            differences: (0..signature.outputs.len())
                .map(|i| difference(recordings, linear, &evaluation, i))
                .collect(),
            evaluation,
        });
        Self { place, points, model }
    }

    /// The section of the result.
    pub(crate) fn entry(&self, outcome: &OutputErrorReport<'_>) -> LinearisedResult {
        let signature = outcome.signature;
        let entries = |all: Vec<DeclaredQuantity>| -> ByName<ValueEntry> {
            let entry = |DeclaredQuantity { name, value, unit }| {
                (name, ValueEntry { value: Some(value), unit })
            };
            all.into_iter().map(entry).collect()
        };
        let point = |(path, point): (&std::path::PathBuf, &Option<OperatingPoint>)| {
            let point = point.as_ref()?;
            let modes = modes(signature, point);
            Some(LinearisedPoint {
                data: path.display().to_string(),
                t: point.t,
                inputs: entries(inputs(signature, point)),
                unknowns: entries(unknowns(signature, point)),
                modes: modes.map(|(name, mode)| (name.to_owned(), mode.to_owned())).collect(),
            })
        };
        let model = match &self.model {
            Ok(model) => {
                let output = |(i, output): (usize, &dgd_runtime::Output)| {
                    let entry = NonlinearOutput {
                        unit: output.unit.symbol.to_string(),
                        rms: rms_of(&model.evaluation, i, &output.unit),
                        difference: model.differences[i].map(|value| value / output.unit.factor),
                        quality: model.quality.entry(i, signature),
                    };
                    (output.name.to_string(), entry)
                };
                let outputs = signature.outputs.iter().enumerate().map(output).collect();
                NonlinearCheck::Simulated { outputs }
            }
            Err(reason) => NonlinearCheck::NotSimulated { not_simulated: reason.clone() },
        };
        LinearisedResult {
            at: match self.place {
                LinearizeAt::Time(t) => LinearisedAt::Time(t),
                LinearizeAt::Steady | LinearizeAt::Mean => {
                    LinearisedAt::Name(self.place.to_string())
                }
            },
            points: outcome.data.iter().zip(&self.points).map(point).collect(),
            model,
        }
    }

    /// Operating points, the comparison with the nonlinear model, and the conclusion.
    pub(crate) fn push_text(&self, text: &mut String, outcome: &OutputErrorReport<'_>) {
        let signature = outcome.signature;
        // Writing to a string cannot fail.
        let _ = match self.place {
            LinearizeAt::Time(t) => writeln!(text, "linear close to where the run is at {t} s:"),
            LinearizeAt::Steady => {
                writeln!(
                    text,
                    "linear close to the steady state with the inputs of the first time:"
                )
            }
            LinearizeAt::Mean => {
                writeln!(text, "linear close to the steady state with the means of the inputs:")
            }
        };
        let points: Vec<(&String, &OperatingPoint)> = outcome
            .recording_names
            .iter()
            .zip(&self.points)
            .filter_map(|(name, point)| Some((name, point.as_ref()?)))
            .collect();
        let mut heads = vec!["at".to_owned()];
        heads.extend(points.iter().map(|(name, _)| (*name).clone()));
        heads.push("unit".to_owned());
        let mut table = vec![heads];
        let columns: Vec<Vec<DeclaredQuantity>> = points
            .iter()
            .map(|(_, point)| {
                inputs(signature, point).into_iter().chain(unknowns(signature, point)).collect()
            })
            .collect();
        for i in 0..columns.first().map_or(0, Vec::len) {
            let mut row = vec![columns[0][i].name.clone()];
            row.extend(columns.iter().map(|column| significant(column[i].value, DIGITS)));
            row.push(columns[0][i].unit.clone());
            table.push(row);
        }
        push_table(text, &table);
        for (name, point) in &points {
            let modes: Vec<String> =
                modes(signature, point).map(|(name, mode)| format!("{name}: {mode}")).collect();
            if !modes.is_empty() {
                let _ = writeln!(text, "{name} stays in these modes: {}", modes.join("; "));
            }
        }
        text.push('\n');
        match &self.model {
            Ok(model) => model.push_text(text, outcome),
            Err(reason) => {
                let _ = writeln!(
                    text,
                    "the model itself cannot be simulated with these estimates, so that how far the \
                     linear one holds is open: {reason}"
                );
            }
        }
    }
}

impl NonlinearReport {
    fn push_text(&self, text: &mut String, outcome: &OutputErrorReport<'_>) {
        let heads =
            ["output", "rms linear", "rms model", "apart", "unit", "fit linear %", "fit model %"];
        let mut table = vec![heads.map(str::to_owned)];
        let mut far = Vec::new();
        for (i, output) in outcome.signature.outputs.iter().enumerate() {
            let Some(apart) = self.differences[i] else { continue };
            let unit = &output.unit;
            let shown = |value: Option<f64>| {
                value.map_or_else(|| "-".to_owned(), |value| significant(value, 3))
            };
            table.push([
                output.name.to_string(),
                shown(rms_of(&outcome.train, i, unit)),
                shown(rms_of(&self.evaluation, i, unit)),
                significant(apart / unit.factor, 3),
                unit.symbol.to_string(),
                shown(outcome.quality.fit_percent(i)),
                shown(self.quality.fit_percent(i)),
            ]);
            if outcome.fit.noise[i].is_some_and(|noise| apart > noise) {
                far.push(format!("`{}`", output.name));
            }
        }
        push_table(text, &table);
        if !far.is_empty() {
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{} of the linear model {} from the model by more than the noise: what is measured goes \
                 too far from the point, and the estimates have to make up for it",
                far.join(", "),
                if far.len() == 1 { "differs" } else { "differ" }
            );
        }
        text.push('\n');
    }
}

/// A value in its declared unit.
struct DeclaredQuantity {
    name: String,
    value: f64,
    unit: String,
}

fn inputs(signature: &Signature, point: &OperatingPoint) -> Vec<DeclaredQuantity> {
    let inputs = signature.inputs.iter().zip(&point.u);
    let quantity = |(input, value): (&dgd_runtime::Input, &f64)| DeclaredQuantity {
        name: input.name.to_string(),
        value: input.unit.from_si(*value),
        unit: input.unit.symbol.to_string(),
    };
    inputs.map(quantity).collect()
}

fn unknowns(signature: &Signature, point: &OperatingPoint) -> Vec<DeclaredQuantity> {
    let quantity = |(i, value): (usize, &f64)| {
        let unit = signature.unknowns.unit(i);
        DeclaredQuantity {
            name: signature.unknowns.name(i).into_owned(),
            value: unit.from_si(*value),
            unit: unit.symbol.to_string(),
        }
    };
    point.y.iter().enumerate().map(quantity).collect()
}

/// Root-mean-square difference of two simulations of an output at the samples that count, SI.
fn difference(
    recordings: &[Recording],
    linear: &OutputErrorEvaluation,
    model: &OutputErrorEvaluation,
    output: usize,
) -> Option<f64> {
    let (mut squares, mut samples) = (0.0, 0_usize);
    let both = linear.observations.iter().zip(&model.observations);
    for (recording, (linear, model)) in recordings.iter().zip(both) {
        let Some(measured) = &recording.measured[output] else { continue };
        for (k, t) in recording.times.iter().enumerate() {
            if measured[k].is_finite() && *t >= recording.counts_from {
                squares += (linear.w(k)[output] - model.w(k)[output]).powi(2);
                samples += 1;
            }
        }
    }
    (samples > 0).then(|| (squares / samples as f64).sqrt())
}
