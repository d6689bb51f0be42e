//! Checks recordings against a model before it is fitted: whether columns belong to it, and which of several sensors of
//! one output is off.
//!
//! At a steady state an output often follows from the others without any parameter to be estimated: p_in = p_r + ρ g
//! Δh. In that case (`prediction.rs`), sensors are compared with it.

use dgd_compiler::dae::Dae;
use dgd_compiler::diagnostics::Diagnostic;
use dgd_compiler::units::Unit;
use dgd_data::DataTable;
use dgd_data::select::{self, DeclaredColumn};
use dgd_execute::LoadedSystem;
use dgd_runtime::{Options, Signature, System};
use dgd_screen::redundant::stem;
use dgd_screen::{Estimate, RARE, Severity, TimeStretch, mean};

use super::notice::{Amount, Notice, difference_unit};
use super::{ScreenedRecording, balances, quoted};
use crate::output::quantity::stretches;

/// A model, and the recorded quantities it uses.
pub(crate) struct ScreenModel<'a> {
    pub system: &'a LoadedSystem,
    pub dae: &'a Dae,
    pub options: Options,
}

/// Columns of a recording in the order of the model, SI.
pub(super) struct ModelColumns {
    /// For each input of the model.
    pub inputs: Vec<Option<Vec<f64>>>,
    /// For each output of the model.
    pub outputs: Vec<Option<Vec<f64>>>,
}

/// Largest uncertainty of the model's prediction, as a share of the difference between sensors.
const DEPENDS: f64 = 0.1;
/// Sensors agree with the model within this share of the difference between them.
const AGREES: f64 = 0.2;
/// Disagreements up to this many standard deviations of one reading are harmless.
const HARMLESS: f64 = 0.5;

impl ScreenModel<'_> {
    pub(super) fn signature(&self) -> &Signature {
        self.system.signature()
    }

    pub(super) fn p(&self) -> Vec<f64> {
        self.signature().parameters.iter().map(|parameter| parameter.value).collect()
    }

    /// Indices of the parameters that a fit would estimate.
    pub(super) fn free(&self) -> Vec<usize> {
        let parameters = self.signature().parameters.iter().enumerate();
        parameters.filter(|(_, parameter)| !parameter.fixed).map(|(i, _)| i).collect()
    }

    /// Outputs that do not depend on free parameters.
    pub(super) fn known_outputs(&self) -> Vec<bool> {
        let free = self.free();
        let by_p = &self.signature().output_jacobians[2];
        let depends = |i: usize| by_p.positions().any(|(row, p)| row == i && free.contains(&p));
        (0..self.signature().outputs.len()).map(|i| !depends(i)).collect()
    }

    pub(super) fn noise(&self) -> Vec<f64> {
        let outputs = self.signature().outputs.iter();
        outputs.map(|output| output.noise.unwrap_or(output.unit.factor)).collect()
    }

    /// Adds the findings of the model to the notices of a recording.
    pub(crate) fn look_at(&self, one: &mut ScreenedRecording) {
        let columns = self.columns(one);
        self.of_roles(one);
        self.references(one, &columns);
        self.agreement(one, &columns);
        let imbalances = balances::notices(self, one, &columns);
        one.notices.extend(imbalances);
    }

    /// The columns of inputs and outputs; reports columns that cannot be read as declared, columns unknown to the
    /// model, and inputs without a column.
    fn columns(&self, one: &mut ScreenedRecording) -> ModelColumns {
        let mut notices = Vec::new();
        let mut read = |name: &str, unit: &Unit| -> Option<Vec<f64>> {
            let column = one.table.column(name)?;
            match select::converted(column, &DeclaredColumn { name, unit, place: None }) {
                Ok(values) => Some(values),
                Err(diagnostic) => {
                    // The contents of the cells were reported for the file.
                    if column.not_numbers.is_none() && column.fault.is_none() {
                        notices.push(of_diagnostic("unit", name, &diagnostic));
                    }
                    None
                }
            }
        };
        let declared =
            |d: &dgd_compiler::model::DeclarationHeader| (d.name.clone(), d.unit.clone());
        let input_names: Vec<_> = self.dae.inputs.iter().map(|i| declared(&i.declared)).collect();
        let output_names: Vec<_> = self.dae.outputs.iter().map(|o| declared(&o.declared)).collect();
        let inputs = input_names.iter().map(|(name, unit)| read(name, unit)).collect();
        let outputs: Vec<_> = output_names.iter().map(|(name, unit)| read(name, unit)).collect();
        // Arrays of outputs have no columns here.
        let n_outputs = self.signature().outputs.len();
        let outputs = outputs.into_iter().chain(std::iter::repeat(None)).take(n_outputs).collect();

        for (name, unit) in &input_names {
            if one.table.column(name).is_none() {
                notices.push(remark(
                    "no_column",
                    &[],
                    format!("there is no column for the input `{name}`"),
                    &format!("add `{name} [{}]`, or rename the column that it is", unit.symbol),
                ));
            }
        }
        let unknowns = self.dae.unknowns.iter().map(|unknown| unknown.name.clone());
        let elements =
            self.dae.output_arrays.iter().flat_map(dgd_compiler::dae::DaeOutputArray::names);
        let known: Vec<String> = input_names
            .iter()
            .chain(&output_names)
            .map(|(name, _)| name.clone())
            .chain(unknowns)
            .chain(elements)
            .collect();
        for column in &one.table.columns {
            if known.contains(&column.name) {
                continue;
            }
            let output = known.iter().find(|name| is_sensor_of(&column.name, name, &one.table));
            let names = [column.name.clone()];
            notices.push(match output {
                Some(output) => remark(
                    "sensor_of",
                    &names,
                    format!("`{}` is one of several sensors of `{output}`", column.name),
                    &format!("choose or average them, and call the result `{output}`"),
                ),
                None => remark(
                    "unknown_column",
                    &names,
                    format!("the model does not know `{}`", column.name),
                    "nothing, if it is not meant to be one of the model's; else rename it",
                ),
            });
        }
        one.notices.extend(notices);
        ModelColumns { inputs, outputs }
    }

    /// Frozen or constant values are a fault of a sensor, not of an input.
    fn of_roles(&self, one: &mut ScreenedRecording) {
        let outputs: Vec<&str> =
            self.dae.outputs.iter().map(|output| output.declared.name.as_str()).collect();
        let inputs: Vec<&str> =
            self.dae.inputs.iter().map(|input| input.declared.name.as_str()).collect();
        // An input may be constant or at its limit.
        let is_of_input = |notice: &Notice| {
            let [name] = notice.channels.as_slice() else { return false };
            matches!(notice.kind, "constant" | "frozen" | "saturated" | "quantised")
                && inputs.contains(&name.as_str())
        };
        one.notices.retain(|notice| !is_of_input(notice));
        for notice in &mut one.notices {
            let [name] = notice.channels.as_slice() else { continue };
            if notice.kind == "frozen" && outputs.contains(&name.as_str()) {
                notice.weight = Severity::Fault;
                "it is frozen: empty these cells, so that a fit leaves them out"
                    .clone_into(&mut notice.advice);
            }
            let is_input = inputs.contains(&name.as_str());
            if is_input && notice.kind == "missing" {
                notice.weight = Severity::Fault;
                "an input is needed at every time: fill the gaps, or cut the recording"
                    .clone_into(&mut notice.advice);
            }
        }
    }

    /// Reports which of two differing sensors is off.
    fn references(&self, one: &mut ScreenedRecording, columns: &ModelColumns) {
        let pairs: Vec<[usize; 2]> =
            one.screening.comparisons.iter().map(|pair| pair.channels).collect();
        for pair in pairs {
            let names = pair.map(|i| one.table.columns[i].name.clone());
            let Some(output) = self.output_of(&names) else { continue };
            let Some(at) = one
                .notices
                .iter()
                .position(|notice| notice.kind == "offset" && notice.channels == names)
            else {
                continue;
            };
            let judged = self.judge(one, columns, pair, output);
            let notice = &mut one.notices[at];
            match judged {
                Some(judged) => {
                    notice.text = format!("{}; {}", notice.text, judged.text);
                    notice.advice = judged.advice;
                }
                None => {
                    "average them; here the model's parameters decide what they should read, \
                     which a recording at rest without flow would not let them"
                        .clone_into(&mut notice.advice);
                }
            }
        }
    }

    /// Reports outputs that contradict each other in steady state, where one follows from the others.
    fn agreement(&self, one: &mut ScreenedRecording, columns: &ModelColumns) {
        let known = self.known_outputs();
        let mut off: Vec<(usize, Estimate, TimeStretch)> = Vec::new();
        for (output, values) in columns.outputs.iter().enumerate() {
            let Some(values) = values.as_ref().filter(|_| known[output]) else { continue };
            let prediction = self.best_prediction(one, columns, output, |(first, last)| {
                mean(&values[first..=last]).map(|mean| vec![mean])
            });
            let Some((predicted, means, steady)) = prediction else { continue };
            let std_error = means[0].std_error.hypot(predicted.doubt);
            let error = Estimate { value: means[0].value - predicted.value, std_error, ..means[0] };
            let harmless = HARMLESS * self.noise()[output];
            if error.p_value_beyond(harmless) < RARE {
                off.push((output, error, steady.stretch));
            }
        }
        let Some((output, error, stretch)) = off.first().copied() else { return };
        let signature = self.signature();
        let declared = &signature.outputs[output].unit;
        let unit = difference_unit(Some(&self.dae.outputs[output].declared.unit));
        let scaled = Estimate {
            value: error.value / declared.factor,
            std_error: error.std_error / declared.factor,
            ..error
        };
        let amount = Amount::from_estimate(&scaled, &unit);
        let than = if error.value > 0.0 { "more" } else { "less" };
        let names: Vec<String> =
            off.iter().map(|(i, ..)| signature.outputs[*i].name.to_string()).collect();
        let text = format!(
            "`{}` reads {} {than} at rest than the model makes of the other outputs{}",
            names[0],
            amount.size(),
            match names.len() {
                1 => String::new(),
                _ => format!("; {} contradict each other", quoted(&names)),
            }
        );
        one.notices.push(Notice {
            weight: Severity::Fault,
            stretches: vec![stretch],
            p_value: Some(error.p_value()),
            amount: Some(amount),
            ..remark(
                "disagrees",
                &names,
                text,
                "one of these sensors is off, or a constant of the model is wrong",
            )
        });
    }

    /// The output measured by two columns.
    fn output_of(&self, names: &[String; 2]) -> Option<usize> {
        let stem = stem(&names[0], &names[1]).map(|(stem, _)| stem);
        self.dae.outputs.iter().position(|output| Some(&output.declared.name) == stem.as_ref())
    }

    fn judge(
        &self,
        one: &ScreenedRecording,
        columns: &ModelColumns,
        pair: [usize; 2],
        output: usize,
    ) -> Option<SensorVerdict> {
        let declared = &self.dae.outputs[output].declared;
        let as_declared =
            DeclaredColumn { name: &declared.name, unit: &declared.unit, place: None };
        let sensors: Vec<Vec<f64>> = pair
            .iter()
            .map(|i| select::converted(&one.table.columns[*i], &as_declared).ok())
            .collect::<Option<_>>()?;
        let (predicted, means, steady) =
            self.best_prediction(one, columns, output, |(first, last)| {
                sensors.iter().map(|values| mean(&values[first..=last])).collect()
            })?;
        let apart = (means[0].value - means[1].value).abs();
        if predicted.doubt > DEPENDS * apart {
            return None;
        }
        let unit = difference_unit(Some(&declared.unit));
        let errors: Vec<f64> = means.iter().map(|mean| mean.value - predicted.value).collect();
        let shown = |k: usize| {
            let std_error = means[k].std_error.hypot(predicted.doubt) / declared.unit.factor;
            let value = errors[k] / declared.unit.factor;
            Amount::from_estimate(&Estimate { value, std_error, dof: means[k].dof }, &unit).signed()
        };
        let name = |k: usize| format!("`{}`", one.table.columns[pair[k]].name);
        let from = stretches([[steady.stretch.from, steady.stretch.until]]);
        let agrees = |error: f64| error.abs() <= AGREES * apart;
        Some(match (agrees(errors[0]), agrees(errors[1])) {
            (true, false) | (false, true) => {
                let (right, off) = if agrees(errors[0]) { (0, 1) } else { (1, 0) };
                SensorVerdict {
                    text: format!(
                        "at rest ({from}) {} agrees with the model, and {} is off by {}",
                        name(right),
                        name(off),
                        shown(off)
                    ),
                    advice: format!("drop {}, or take its offset off", name(off)),
                }
            }
            _ if agrees(0.5 * (errors[0] + errors[1])) => SensorVerdict {
                text: format!(
                    "at rest ({from}) their mean agrees with the model: {} is off by {}, {} by {}",
                    name(0),
                    shown(0),
                    name(1),
                    shown(1)
                ),
                advice: "average them".to_owned(),
            },
            _ => SensorVerdict {
                text: format!(
                    "at rest ({from}) both are off from the model, {} by {}, {} by {}",
                    name(0),
                    shown(0),
                    name(1),
                    shown(1)
                ),
                advice: "look at the other sensors and at the model's constants".to_owned(),
            },
        })
    }
}

/// The verdict on two sensors.
struct SensorVerdict {
    text: String,
    advice: String,
}

/// Whether a column is named `output` plus a letter or digit, and there is another such column.
fn is_sensor_of(column: &str, output: &str, table: &DataTable) -> bool {
    table
        .columns
        .iter()
        .any(|other| stem(column, &other.name).is_some_and(|(stem, _)| stem == output))
}

fn of_diagnostic(kind: &'static str, name: &str, diagnostic: &Diagnostic) -> Notice {
    let help = diagnostic.help.as_ref().map(ToString::to_string);
    Notice {
        weight: Severity::Fault,
        ..remark(
            kind,
            &[name.to_owned()],
            diagnostic.message.clone(),
            &help.unwrap_or_else(|| "write the unit that the values are in".to_owned()),
        )
    }
}

/// A notice about whole columns that is not a fault.
pub(super) fn remark(kind: &'static str, names: &[String], text: String, advice: &str) -> Notice {
    Notice {
        kind,
        weight: Severity::Remark,
        channels: names.to_vec(),
        stretches: Vec::new(),
        amount: None,
        p_value: None,
        text,
        advice: advice.to_owned(),
    }
}

/// Names in a sentence.
pub(super) fn listed(names: &[String]) -> String {
    if names.is_empty() { "nothing".to_owned() } else { quoted(names) }
}
