//! Columns that stay at one value from some moment on.
//!
//! ```text
//!   p = (1 + n₌)/(2 + n):   share of n earlier readings that are equal to the one before
//!   p^(m−1):                chance of m equal readings at the end
//! ```
//!
//! A schedule that has ended rests at zero, at an end of its range, at a value to which it jumps or at one where it has
//! rested before: none of these is suspected. Readings while an input is stuck are not evidence about the model, and
//! are left out.

use std::sync::Arc;

use dgd_identify::Recording;
use dgd_runtime::{Signature, System};

use super::column_fault::{ColumnFault, StuckColumn};
use super::recorded_columns::{RecordedColumn, columns, signal_of, signals};
use super::search::{CorrectedRecordings, PlainSearch};
use super::suspicion::{SuspectModel, Suspicion};
use crate::noise::{noise_of, readings};

/// Chance of equal readings below which a column may be stuck: that of other false alarms.
const CHANCE: f64 = 1e-4;

/// Columns that may be stuck.
pub(super) fn suspects(plain: &PlainSearch<'_>) -> Vec<SuspectModel> {
    let PlainSearch { fitted, data, .. } = *plain;
    let signature = fitted.structure.system.signature();
    let signals = signals(plain, signature);
    let tests = (signals.len() * (data.train.len() + data.valid.len())).max(1) as f64;
    signals
        .iter()
        .filter_map(|(signal, name, unit)| {
            let stuck_in = |recordings: &[Recording], is_held_out: bool| {
                let numbered = recordings.iter().enumerate();
                let stuck = numbered.filter_map(|(recording, own)| {
                    let (k, value) = since(own, *signal, signature, CHANCE / tests)?;
                    Some(StuckColumn { is_held_out, recording, time: own.times[k], value })
                });
                stuck.collect::<Vec<_>>()
            };
            let since = [stuck_in(data.train, false), stuck_in(data.valid, true)].concat();
            if since.iter().all(|one| one.is_held_out) {
                return None;
            }
            let (changed, lost) = without(plain, *signal, &since);
            let (name, unit) = (name.clone(), unit.clone());
            let fault = ColumnFault::Stuck { name, unit, since, lost };
            Some(SuspectModel {
                position: 0,
                suspicion: Suspicion::Column(fault),
                base: None,
                changed: Some(Arc::new(changed)),
            })
        })
        .collect()
}

/// The recordings without the readings while a column was stuck, and the number of those readings.
fn without(
    plain: &PlainSearch<'_>,
    signal: RecordedColumn,
    since: &[StuckColumn],
) -> (CorrectedRecordings, usize) {
    let data = plain.data;
    let mut lost = 0;
    let mut cleaned = |recordings: &[Recording], is_held_out: bool| -> Vec<Recording> {
        let mut changed = recordings.to_vec();
        for one in since.iter().filter(|one| one.is_held_out == is_held_out) {
            let Recording { times, measured, .. } = &mut changed[one.recording];
            let from = times.partition_point(|t| *t <= one.time);
            for (output, read) in measured.iter_mut().enumerate() {
                if matches!(signal, RecordedColumn::Output(own) if own != output) {
                    continue;
                }
                for value in read.iter_mut().flat_map(|read| &mut read[from..]) {
                    lost += usize::from(value.is_finite() && !is_held_out);
                    *value = f64::NAN;
                }
            }
        }
        changed
    };
    let (train, valid) = (cleaned(data.train, false), cleaned(data.valid, true));
    let mut noise = data.noise.clone();
    if let RecordedColumn::Output(own) = signal {
        noise[own] = noise_of(&train, &readings(&train))[own];
    }
    (CorrectedRecordings { train, valid, noise, counts_from: data.counts_from.clone() }, lost)
}

/// The sample from which a column is stuck, and its value.
fn since(
    recording: &Recording,
    signal: RecordedColumn,
    signature: &Signature,
    chance: f64,
) -> Option<(usize, f64)> {
    let column = signal_of(recording, signal, &columns(recording, signature.inputs.len()))?;
    let read: Vec<(usize, f64)> =
        column.into_iter().enumerate().filter(|(_, x)| x.is_finite()).collect();
    let value = read.last()?.1;
    let begin = read.iter().rposition(|(_, x)| *x != value)? + 1;
    let before: Vec<f64> = read[..begin].iter().map(|(_, x)| *x).collect();
    let steps: Vec<f64> = before.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let equal = steps.iter().filter(|step| **step == 0.0).count();
    let share = (1 + equal) as f64 / (2 + steps.len()) as f64;
    let again = (read.len() - begin - 1) as f64;
    let largest = steps.iter().fold(0.0, |most: f64, step| most.max(*step));
    let is_within = before.iter().any(|x| *x > value) && before.iter().any(|x| *x < value);
    let has_been_held = before.windows(2).any(|pair| pair[0] == value && pair[1] == value);
    let is_rest = value == 0.0 || !is_within || has_been_held;
    let has_jumped = (value - before[begin - 1]).abs() > largest;
    let is_sure = again * share.ln() < chance.ln();
    (is_sure && !is_rest && !has_jumped).then_some((read[begin].0, value))
}
