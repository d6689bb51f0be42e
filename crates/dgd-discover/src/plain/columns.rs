//! Possible faults of recorded columns.

use std::sync::Arc;

use dgd_compiler::source::Span;
use dgd_compiler::syntax::ast::{Attribute, AttributeKind, ItemKind};
use dgd_compiler::syntax::visit;
use dgd_compiler::units::{mistaken, parse_unit};
use dgd_identify::Recording;
use dgd_runtime::signature::Interpolation;
use dgd_runtime::{InputColumn, Inputs, LimitSide, Signature, System};
use dgd_screen::noise::{NoiseColour, SensorNoise};

use super::column_fault::ColumnFault;
use super::recorded_columns::{RecordedColumn, columns, signal_of, signals};
use super::search::{CorrectedRecordings, PlainSearch};
use super::stuck;
use super::suspicion::{SuspectModel, Suspicion};
use crate::library::BaseModel;
use crate::noise::{noise_of, readings};

/// How a fault changes a recording.
#[derive(Debug, Clone, Copy)]
enum ColumnChange {
    /// x becomes factor x + offset, SI.
    Scaled {
        signal: RecordedColumn,
        factor: f64,
        offset: f64,
    },
    Exchanged(RecordedColumn, RecordedColumn),
    Between {
        input: usize,
        is: Interpolation,
    },
    Clock {
        factor: f64,
    },
}

/// Minimum ratio of units that are mistaken for each other.
const APART: f64 = 1.5;

/// All possible faults of columns.
pub(super) fn suspects(plain: &PlainSearch<'_>) -> Vec<SuspectModel> {
    let signature = plain.fitted.structure.system.signature();
    let signals = signals(plain, signature);
    let mut faults: Vec<(ColumnFault, ColumnChange)> = Vec::new();
    for (signal, name, unit) in &signals {
        for meant_in in mistaken(unit) {
            // number → the SI value that it would have.
            let factor = meant_in.factor / unit.factor;
            let offset = meant_in.offset - factor * unit.offset;
            if offset == 0.0 && (1.0 / APART..APART).contains(&factor) {
                continue;
            }
            let change = ColumnChange::Scaled { signal: *signal, factor, offset };
            let (name, unit) = (name.clone(), unit.clone());
            faults.push((ColumnFault::Unit { name, unit, meant_in }, change));
        }
    }
    for (k, (one, name, unit)) in signals.iter().enumerate() {
        for (other, other_name, _) in
            signals[k + 1..].iter().filter(|(_, _, other)| other.dimension == unit.dimension)
        {
            let names = [name.clone(), other_name.clone()];
            faults.push((ColumnFault::Exchanged(names), ColumnChange::Exchanged(*one, *other)));
        }
    }
    for (input, declared) in signature.inputs.iter().enumerate() {
        let is = match declared.interpolation {
            Interpolation::Hold => Interpolation::Linear,
            Interpolation::Linear => Interpolation::Hold,
        };
        let name = declared.name.to_string();
        faults.push((ColumnFault::Between { name, is }, ColumnChange::Between { input, is }));
    }
    let second = parse_unit("s").expect("a unit");
    for meant_in in mistaken(&second) {
        let change = ColumnChange::Clock { factor: meant_in.factor };
        faults.push((ColumnFault::Clock { meant_in }, change));
    }
    let changed =
        faults.into_iter().filter_map(|(fault, change)| suspect(plain, signature, fault, change));
    changed.chain(stuck::suspects(plain)).collect()
}

fn suspect(
    plain: &PlainSearch<'_>,
    signature: &Signature,
    fault: ColumnFault,
    change: ColumnChange,
) -> Option<SuspectModel> {
    let PlainSearch { base, data, .. } = *plain;
    let all_changed = |recordings: &[Recording]| -> Option<Vec<Recording>> {
        recordings.iter().map(|one| change.applied(one, signature)).collect()
    };
    let (train, valid) = (all_changed(data.train)?, all_changed(data.valid)?);
    let noise = change.noise(&data.noise, &train);
    let clock = if let ColumnChange::Clock { factor } = change { factor } else { 1.0 };
    let counts_from = data.counts_from.iter().map(|from| clock * from).collect();
    let changed = CorrectedRecordings { train, valid, noise, counts_from };
    let base = match &fault {
        ColumnFault::Between { name, is } => Some(with_interpolation(base, name, *is)),
        _ => None,
    };
    Some(SuspectModel {
        position: 0,
        suspicion: Suspicion::Column(fault),
        base,
        changed: Some(Arc::new(changed)),
    })
}

impl ColumnChange {
    /// The recording without the fault; `None` if it cannot be derived.
    fn applied(self, recording: &Recording, signature: &Signature) -> Option<Recording> {
        let mut columns = columns(recording, signature.inputs.len());
        let mut between: Vec<Interpolation> =
            signature.inputs.iter().map(|input| input.interpolation).collect();
        // Inputs must follow from their values at the samples.
        let rebuilt_inputs = rebuilt(signature, &recording.times, &columns, &between)?;
        if !are_alike(&rebuilt_inputs, &recording.inputs, &recording.times, &columns) {
            return None;
        }
        let mut changed = recording.clone();
        match self {
            ColumnChange::Scaled { signal, factor, offset } => {
                let scaled = |x: &mut f64| *x = factor * *x + offset;
                match signal {
                    RecordedColumn::Input(i) => columns[i].iter_mut().for_each(scaled),
                    RecordedColumn::Output(i) => {
                        changed.measured[i].iter_mut().flatten().for_each(scaled);
                    }
                }
            }
            ColumnChange::Exchanged(one, other) => {
                let value = |of: RecordedColumn| signal_of(recording, of, &columns);
                for (to, from) in [(one, value(other)?), (other, value(one)?)] {
                    match to {
                        RecordedColumn::Input(i) => columns[i] = from,
                        RecordedColumn::Output(i) => changed.measured[i] = Some(from),
                    }
                }
            }
            ColumnChange::Between { input, is } => between[input] = is,
            ColumnChange::Clock { factor } => changed.times.iter_mut().for_each(|t| *t *= factor),
        }
        if columns.iter().flatten().any(|value| !value.is_finite()) {
            return None;
        }
        changed.inputs = rebuilt(signature, &changed.times, &columns, &between)?;
        Some(changed)
    }

    /// The noise of each output of the changed recordings.
    fn noise(self, noise: &[Option<SensorNoise>], train: &[Recording]) -> Vec<Option<SensorNoise>> {
        let mut changed = noise.to_vec();
        match self {
            ColumnChange::Scaled { signal: RecordedColumn::Output(i), factor, .. } => {
                changed[i] = noise[i].map(|noise| SensorNoise {
                    std: noise.std * factor.abs(),
                    quantisation: noise.quantisation.map(|step| step * factor.abs()),
                    colour: noise
                        .colour
                        .map(|colour| NoiseColour { std: colour.std * factor.abs(), ..colour }),
                    ..noise
                });
            }
            ColumnChange::Exchanged(RecordedColumn::Output(i), RecordedColumn::Output(k)) => {
                changed.swap(i, k);
            }
            ColumnChange::Exchanged(RecordedColumn::Input(_), RecordedColumn::Output(i)) => {
                changed[i] = noise_of(train, &readings(train))[i];
            }
            ColumnChange::Clock { factor } => {
                for colour in changed.iter_mut().flatten().filter_map(|one| one.colour.as_mut()) {
                    colour.memory *= factor;
                }
            }
            _ => {}
        }
        changed
    }
}

/// Whether inputs are the same between samples, except for rounding.
fn are_alike(one: &Inputs, other: &Inputs, times: &[f64], columns: &[Vec<f64>]) -> bool {
    const ROUNDING: f64 = 1e-9;
    let sizes: Vec<f64> =
        columns.iter().map(|all| all.iter().fold(0.0, |most: f64, x| most.max(x.abs()))).collect();
    let (mut a, mut b) = (vec![0.0; columns.len()], vec![0.0; columns.len()]);
    times.windows(2).filter(|pair| pair[0] < pair[1]).all(|pair| {
        let t = f64::midpoint(pair[0], pair[1]);
        one.value(t, LimitSide::Right, &mut a);
        other.value(t, LimitSide::Right, &mut b);
        a.iter().zip(&b).zip(&sizes).all(|((a, b), size)| (a - b).abs() <= ROUNDING * size)
    })
}

fn rebuilt(
    signature: &Signature,
    times: &[f64],
    columns: &[Vec<f64>],
    between: &[Interpolation],
) -> Option<Inputs> {
    let declared = signature.inputs.iter().zip(columns).zip(between);
    let columns: Vec<InputColumn<'_>> = declared
        .map(|((input, values), interpolation)| InputColumn {
            name: &input.name,
            interpolation: *interpolation,
            values,
        })
        .collect();
    Inputs::recorded(times, &columns).ok()
}

/// The model with another interpolation of an input.
fn with_interpolation(base: &BaseModel, input: &str, is: Interpolation) -> BaseModel {
    let mut base = base.clone();
    visit::items_mut(&mut base.asts[0].items, &mut |item| {
        if let ItemKind::Input { name, attributes, .. } = &mut item.kind
            && name.text == input
        {
            let declares =
                |one: &Attribute| matches!(one.kind, AttributeKind::Hold | AttributeKind::Linear);
            let written = attributes.iter().find(|one| declares(one)).map(|one| one.span);
            attributes.retain(|one| !declares(one));
            let kind = match is {
                Interpolation::Hold => AttributeKind::Hold,
                Interpolation::Linear => AttributeKind::Linear,
            };
            let end = Span { start: item.span.end, ..item.span };
            attributes.push(Attribute { span: written.unwrap_or(end), kind });
        }
    });
    base
}
