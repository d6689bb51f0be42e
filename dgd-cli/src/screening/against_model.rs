//! What a model says of recordings before it is fitted: whether columns are its own, and which of
//! several sensors of one output is off.
//!
//! At rest an output often follows from the others without any parameter that is yet to be
//! estimated: p_in = p_r + ρ g Δh. Where it does, sensors are compared with it. Whether it does is
//! tried: free parameters and start values are moved by a tenth, and the output must not follow.

use dgd_compiler::dae::Dae;
use dgd_compiler::diagnostics::Diagnostic;
use dgd_compiler::units::Unit;
use dgd_execute::Loaded;
use dgd_runtime::{
    Inputs, Options, Parameter, Point, Problem, Signature, System, start_from_outputs,
};
use dgd_screen::redundant::stem;
use dgd_screen::{Estimate, RARE, Steady, Stretch, Weight, mean};

use super::notice::{Amount, Notice, difference_unit};
use super::{Screened, balances, quoted};
use crate::data::Table;
use crate::data::select::{self, Declared};

/// A model, and what of it recordings hold.
pub(crate) struct Model<'a> {
    pub system: &'a Loaded,
    pub dae: &'a Dae,
    pub options: Options,
}

/// Columns of a recording as the model counts them, SI.
pub(super) struct Columns {
    /// For each input of the model.
    pub inputs: Vec<Option<Vec<f64>>>,
    /// For each output of the model.
    pub outputs: Vec<Option<Vec<f64>>>,
}

/// Parameters are moved by this share to see what depends on them.
const MOVED: f64 = 0.1;
/// What the model's output may depend on them, as a share of the difference between sensors.
const DEPENDS: f64 = 0.1;
/// Sensors agree with the model within this share of the difference between them.
const AGREES: f64 = 0.2;
/// Disagreements up to this many standard deviations of one reading do no harm.
const HARMLESS: f64 = 0.5;
/// An output that follows from the others moves by less of its noise with start values.
const UNDETERMINED: f64 = 0.01;
/// Steady stretches that are tried.
const TRIED: usize = 8;

impl Model<'_> {
    pub(super) fn signature(&self) -> &Signature {
        self.system.signature()
    }

    pub(super) fn p(&self) -> Vec<f64> {
        self.signature().parameters.iter().map(|parameter| parameter.value).collect()
    }

    /// Positions of the parameters that a fit would estimate.
    pub(super) fn free(&self) -> Vec<usize> {
        let parameters = self.signature().parameters.iter().enumerate();
        parameters.filter(|(_, parameter)| !parameter.fixed).map(|(i, _)| i).collect()
    }

    /// Outputs that no free parameter is in.
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

    /// Adds what the model says to the notices of a recording.
    pub(crate) fn look_at(&self, one: &mut Screened) {
        let columns = self.columns(one);
        self.of_roles(one);
        self.references(one, &columns);
        self.agreement(one, &columns);
        let found = balances::notices(self, one, &columns);
        one.notices.extend(found);
    }

    /// The columns of inputs and outputs; reports columns that cannot be read as declared, that the
    /// model does not know, and inputs without a column.
    fn columns(&self, one: &mut Screened) -> Columns {
        let mut notices = Vec::new();
        let mut read = |name: &str, unit: &Unit| -> Option<Vec<f64>> {
            let column = one.table.column(name)?;
            match select::converted(column, &Declared { name, unit, place: None }) {
                Ok(values) => Some(values),
                Err(diagnostic) => {
                    // What the cells hold was reported for the file.
                    if column.not_numbers.is_none() && column.fault.is_none() {
                        notices.push(of_diagnostic("unit", name, &diagnostic));
                    }
                    None
                }
            }
        };
        let declared = |d: &dgd_compiler::model::Declared| (d.name.clone(), d.unit.clone());
        let input_names: Vec<_> = self.dae.inputs.iter().map(|i| declared(&i.declared)).collect();
        let output_names: Vec<_> = self.dae.outputs.iter().map(|o| declared(&o.declared)).collect();
        let inputs = input_names.iter().map(|(name, unit)| read(name, unit)).collect();
        let outputs: Vec<_> = output_names.iter().map(|(name, unit)| read(name, unit)).collect();
        // Arrays of outputs have no columns of their own here.
        let n_outputs = self.signature().outputs.len();
        let outputs = outputs.into_iter().chain(std::iter::repeat(None)).take(n_outputs).collect();

        for (name, unit) in &input_names {
            if one.table.column(name).is_none() {
                notices.push(remark(
                    "no_column",
                    &[],
                    format!("there is no column for the input `{name}`"),
                    &format!("add `{name} [{}]`, or `--rename` the column that it is", unit.symbol),
                ));
            }
        }
        let unknowns = self.dae.unknowns.iter().map(|unknown| unknown.name.clone());
        let elements = self.dae.output_arrays.iter().flat_map(|array| array.names());
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
            let of = known.iter().find(|name| is_sensor_of(&column.name, name, &one.table));
            let names = [column.name.clone()];
            notices.push(match of {
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
                    "nothing, if it is not meant to be one of the model's; else `--rename` it",
                ),
            });
        }
        one.notices.extend(notices);
        Columns { inputs, outputs }
    }

    /// What is held or constant is a fault of a sensor, and none of an input.
    fn of_roles(&self, one: &mut Screened) {
        let outputs: Vec<&str> =
            self.dae.outputs.iter().map(|output| output.declared.name.as_str()).collect();
        let inputs: Vec<&str> =
            self.dae.inputs.iter().map(|input| input.declared.name.as_str()).collect();
        // An input that is held, or at its limit, is what it is.
        let is_of_input = |notice: &Notice| {
            let [name] = notice.channels.as_slice() else { return false };
            matches!(notice.kind, "constant" | "frozen" | "saturated" | "quantised")
                && inputs.contains(&name.as_str())
        };
        one.notices.retain(|notice| !is_of_input(notice));
        for notice in &mut one.notices {
            let [name] = notice.channels.as_slice() else { continue };
            if notice.kind == "frozen" && outputs.contains(&name.as_str()) {
                notice.weight = Weight::Fault;
                "it is frozen: empty these cells, so that a fit leaves them out"
                    .clone_into(&mut notice.advice);
            }
            let is_input = inputs.contains(&name.as_str());
            if is_input && notice.kind == "missing" {
                notice.weight = Weight::Fault;
                "an input is needed at every time: fill the gaps, or cut the recording"
                    .clone_into(&mut notice.advice);
            }
        }
    }

    /// Says of sensors that differ which is off.
    fn references(&self, one: &mut Screened, columns: &Columns) {
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

    /// Says which outputs contradict each other at rest, where one follows from the others.
    fn agreement(&self, one: &mut Screened, columns: &Columns) {
        let known = self.known_outputs();
        let mut off: Vec<(usize, Estimate, Stretch)> = Vec::new();
        for (output, values) in columns.outputs.iter().enumerate() {
            let Some(values) = values.as_ref().filter(|_| known[output]) else { continue };
            let found = self.best_prediction(one, columns, output, |(first, last)| {
                mean(&values[first..=last]).map(|mean| vec![mean])
            });
            let Some((predicted, means, steady)) = found else { continue };
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
        let amount = Amount::of(&scaled, &unit);
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
            weight: Weight::Fault,
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

    /// What an output should read, where that is surest: with the means that `means` makes of the
    /// same samples.
    fn best_prediction<'s>(
        &self,
        one: &'s Screened,
        columns: &Columns,
        output: usize,
        means: impl Fn((usize, usize)) -> Option<Vec<Estimate>>,
    ) -> Option<(Predicted, Vec<Estimate>, &'s Steady)> {
        let mut stretches: Vec<&Steady> = one.screening.motion.steady.iter().collect();
        let length = |s: &Steady| s.stretch.until - s.stretch.from;
        stretches.sort_by(|a, b| length(b).total_cmp(&length(a)));
        let mut best: Option<(Predicted, Vec<Estimate>, &Steady)> = None;
        for steady in stretches.into_iter().take(TRIED) {
            let (Some(means), Some(predicted)) =
                (means(steady.samples), self.predicted(columns, steady.samples, output))
            else {
                continue;
            };
            if best.as_ref().is_none_or(|(other, ..)| predicted.doubt < other.doubt) {
                best = Some((predicted, means, steady));
            }
        }
        best
    }

    /// The output that two columns measure.
    fn output_of(&self, names: &[String; 2]) -> Option<usize> {
        let stem = stem(&names[0], &names[1]).map(|(stem, _)| stem);
        self.dae.outputs.iter().position(|output| Some(&output.declared.name) == stem.as_ref())
    }

    fn judge(
        &self,
        one: &Screened,
        columns: &Columns,
        pair: [usize; 2],
        output: usize,
    ) -> Option<Judged> {
        let declared = &self.dae.outputs[output].declared;
        let as_declared = Declared { name: &declared.name, unit: &declared.unit, place: None };
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
            Amount::of(&Estimate { value, std_error, dof: means[k].dof }, &unit).signed()
        };
        let name = |k: usize| format!("`{}`", one.table.columns[pair[k]].name);
        let from = format!("{:.0}–{:.0} s", steady.stretch.from, steady.stretch.until);
        let agrees = |error: f64| error.abs() <= AGREES * apart;
        Some(match (agrees(errors[0]), agrees(errors[1])) {
            (true, false) | (false, true) => {
                let (right, off) = if agrees(errors[0]) { (0, 1) } else { (1, 0) };
                Judged {
                    text: format!(
                        "at rest ({from}) {} agrees with the model, and {} is off by {}",
                        name(right),
                        name(off),
                        shown(off)
                    ),
                    advice: format!("drop {}, or take its offset off", name(off)),
                }
            }
            _ if agrees(0.5 * (errors[0] + errors[1])) => Judged {
                text: format!(
                    "at rest ({from}) their mean agrees with the model: {} is off by {}, {} by {}",
                    name(0),
                    shown(0),
                    name(1),
                    shown(1)
                ),
                advice: "average them".to_owned(),
            },
            _ => Judged {
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

    /// What an output should read in a steady stretch by the other outputs, SI.
    fn predicted(
        &self,
        columns: &Columns,
        (first, last): (usize, usize),
        output: usize,
    ) -> Option<Predicted> {
        let known = self.known_outputs();
        let u: Vec<f64> = columns
            .inputs
            .iter()
            .map(|values| mean_of(&values.as_ref()?[first..=last]))
            .collect::<Option<_>>()?;
        let estimates: Vec<Option<Estimate>> = columns
            .outputs
            .iter()
            .enumerate()
            .map(|(i, values)| {
                let values = values.as_ref().filter(|_| i != output && known[i])?;
                mean(&values[first..=last])
            })
            .collect();
        let measured: Vec<Option<f64>> =
            estimates.iter().map(|estimate| estimate.map(|e| e.value)).collect();
        let p = self.p();
        let value = self.output_at(&u, &p, &measured, None, output)?;
        // What noise of the others, free parameters and start values make of it.
        let mut squares = 0.0;
        for (i, estimate) in estimates.iter().enumerate() {
            let Some(estimate) = estimate.filter(|estimate| estimate.std_error > 0.0) else {
                continue;
            };
            let mut moved = measured.clone();
            moved[i] = Some(estimate.value + estimate.std_error);
            squares += (self.output_at(&u, &p, &moved, None, output)? - value).powi(2);
        }
        let mut doubt = squares.sqrt();
        for i in self.free() {
            let mut moved = p.clone();
            moved[i] += MOVED * size(&self.signature().parameters[i]);
            doubt += (self.output_at(&u, &moved, &measured, None, output)? - value).abs();
        }
        // What start values decide, the other outputs do not.
        let moved = self.output_at(&u, &p, &measured, Some(MOVED), output)?;
        ((moved - value).abs() <= UNDETERMINED * self.noise()[output])
            .then_some(Predicted { value, doubt })
    }

    /// An output where the model's outputs are those measured; start values are moved by a share of
    /// themselves first.
    fn output_at(
        &self,
        u: &[f64],
        p: &[f64],
        measured: &[Option<f64>],
        moved: Option<f64>,
        output: usize,
    ) -> Option<f64> {
        let y = self.state_at(u, p, measured, &[], moved)?;
        let mut w = vec![0.0; self.signature().outputs.len()];
        self.system.outputs(Point { t: 0.0, y: &y, u, p, z: &[] }, &mut w);
        Some(w[output]).filter(|w| w.is_finite())
    }

    /// Unknowns where the model's outputs are those measured, SI; `start` is where to begin.
    pub(super) fn state_at(
        &self,
        u: &[f64],
        p: &[f64],
        measured: &[Option<f64>],
        start: &[(usize, f64)],
        moved: Option<f64>,
    ) -> Option<Vec<f64>> {
        let signature = self.signature();
        // Models that remember or switch are not at rest by their unknowns alone.
        if !signature.discrete.is_empty() || signature.n_u() != signature.inputs.len() {
            return None;
        }
        let inputs = Inputs::constant(u);
        let problem = Problem { system: self.system, p, inputs: &inputs, start };
        let first = match moved {
            None => start.to_vec(),
            Some(share) => {
                let mut y = vec![0.0; signature.unknowns.len()];
                self.system.start(Point { t: 0.0, y: &[], u, p, z: &[] }, &mut y);
                let differential = (0..y.len()).filter(|i| signature.unknowns.is_differential(*i));
                let nominal =
                    |i: usize| signature.unknowns.nominal(i).unwrap_or(y[i].abs().max(1e-3));
                differential.map(|i| (i, y[i] + share * nominal(i))).collect()
            }
        };
        let problem = Problem { start: &first, ..problem };
        let start = if measured.iter().any(Option::is_some) {
            start_from_outputs(&problem, 0.0, measured, &self.noise(), &self.options).ok()?
        } else {
            first.clone()
        };
        let problem = Problem { start: &start, ..problem };
        dgd_runtime::consistent_start(&problem, 0.0, &self.options).ok().map(|found| found.y)
    }
}

/// What an output should read, and how far that may be off.
struct Predicted {
    value: f64,
    doubt: f64,
}

/// Which of two sensors is off.
struct Judged {
    text: String,
    advice: String,
}

/// Size of a parameter for moving it.
fn size(parameter: &Parameter) -> f64 {
    let declared = if parameter.value == 0.0 { parameter.unit.factor } else { parameter.value };
    parameter.nominal.unwrap_or(declared.abs())
}

fn mean_of(values: &[f64]) -> Option<f64> {
    let valid = values.iter().filter(|value| value.is_finite());
    let (sum, count) = valid.fold((0.0, 0), |(sum, n), value| (sum + value, n + 1));
    (count > 0).then(|| sum / f64::from(count))
}

/// Whether a column is `output` and a letter or figure, and another such column is there.
fn is_sensor_of(column: &str, output: &str, table: &Table) -> bool {
    table
        .columns
        .iter()
        .any(|other| stem(column, &other.name).is_some_and(|(stem, _)| stem == output))
}

fn of_diagnostic(kind: &'static str, name: &str, diagnostic: &Diagnostic) -> Notice {
    Notice {
        weight: Weight::Fault,
        ..remark(
            kind,
            &[name.to_owned()],
            diagnostic.message.clone(),
            diagnostic.help.as_deref().unwrap_or("write the unit that the values are in"),
        )
    }
}

/// A notice about columns as a whole that is no fault.
pub(super) fn remark(kind: &'static str, names: &[String], text: String, advice: &str) -> Notice {
    Notice {
        kind,
        weight: Weight::Remark,
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
