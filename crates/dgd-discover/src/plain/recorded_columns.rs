//! Recorded columns and their values.

use dgd_compiler::units::{Unit, parse_unit};
use dgd_identify::Recording;
use dgd_runtime::{LimitSide, Signature};

use super::search::PlainSearch;

/// A recorded column: an input or an output, by its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RecordedColumn {
    Input(usize),
    Output(usize),
}

/// Recorded columns with their units.
pub(super) fn signals(
    plain: &PlainSearch<'_>,
    signature: &Signature,
) -> Vec<(RecordedColumn, String, Unit)> {
    let inputs = signature.inputs.iter().enumerate();
    let inputs = inputs.map(|(i, own)| (RecordedColumn::Input(i), &own.name, &own.unit));
    let outputs = signature.outputs.iter().enumerate().zip(&plain.data.noise);
    let outputs = outputs.filter(|(_, noise)| noise.is_some());
    let outputs = outputs.map(|((i, own), _)| (RecordedColumn::Output(i), &own.name, &own.unit));
    let read = |(signal, name, unit): (
        RecordedColumn,
        &dgd_runtime::signature::Text,
        &dgd_runtime::Unit,
    )| { Some((signal, name.to_string(), parse_unit(&unit.symbol).ok()?)) };
    inputs.chain(outputs).filter_map(read).collect()
}

/// Values of the inputs at the samples; of two samples at one time, the first is before a jump.
pub(super) fn columns(recording: &Recording, inputs: usize) -> Vec<Vec<f64>> {
    let mut columns = vec![Vec::with_capacity(recording.times.len()); inputs];
    let mut u = vec![0.0; inputs];
    for (k, t) in recording.times.iter().enumerate() {
        let is_before = recording.times.get(k + 1) == Some(t);
        let side = if is_before { LimitSide::Left } else { LimitSide::Right };
        recording.inputs.value(*t, side, &mut u);
        columns.iter_mut().zip(&u).for_each(|(column, u)| column.push(*u));
    }
    columns
}

/// The values of one of these columns, or the readings of an output.
pub(super) fn signal_of(
    recording: &Recording,
    signal: RecordedColumn,
    columns: &[Vec<f64>],
) -> Option<Vec<f64>> {
    match signal {
        RecordedColumn::Input(i) => columns.get(i).cloned(),
        RecordedColumn::Output(i) => recording.measured[i].clone(),
    }
}
