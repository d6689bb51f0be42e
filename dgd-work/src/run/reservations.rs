//! Reasons why recordings cannot answer: they rest, are too short, or are there twice.

use std::collections::BTreeSet;

use dgd_discover::FEWEST;
use dgd_identify::Recording;
use dgd_runtime::{Point, Side, Signature, System, Text};

use crate::output::quantity::short;

/// A validation recording that shares at least this part of its rows with the training counts as trained on.
const SAME: f64 = 0.5;

/// A sentence for each reason why recordings may not determine a model with these parameters, SI.
pub(crate) fn of_recordings<S: System>(
    system: &S,
    p: &[f64],
    recordings: &[Recording],
) -> Vec<String> {
    let mut all = Vec::new();
    if is_at_rest(system.signature(), recordings) {
        all.push(
            "no input moves in any recording: all there is to go by is how the model settles from its start \
             values, and recordings in which inputs move would say more"
                .to_owned(),
        );
    }
    all.extend(delays_that_are_longer(system, p, recordings));
    all
}

/// Whether there are inputs, and all stay constant in all recordings.
fn is_at_rest(signature: &Signature, recordings: &[Recording]) -> bool {
    let mut first: Option<Vec<f64>> = None;
    let mut u = vec![0.0; signature.inputs.len()];
    let moments = recordings.iter().flat_map(|one| one.times.iter().map(move |t| (one, *t)));
    let mut stays = |(recording, t): (&Recording, f64)| {
        recording.inputs.value(t, Side::Right, &mut u);
        first.get_or_insert_with(|| u.clone()) == &u
    };
    !signature.inputs.is_empty() && moments.into_iter().all(&mut stays)
}

/// A sentence where no output has samples enough in any recording to test more of its errors than their size.
pub(crate) fn of_few_samples(signature: &Signature, recordings: &[Recording]) -> Option<String> {
    let is_valid = |value: &&f64| value.is_finite();
    let most = |i: usize| {
        let samples = recordings.iter().filter_map(|one| one.measured[i].as_ref());
        samples.map(|samples| samples.iter().filter(is_valid).count()).max().unwrap_or(0)
    };
    let measured = (0..signature.outputs.len()).map(most).filter(|samples| *samples > 0);
    let most = measured.max().filter(|most| *most < FEWEST)?;
    Some(format!(
        "no recording has more than {most} samples of an output, and with fewer than {FEWEST} only what is large is \
         told from noise"
    ))
}

/// Delays that no recording is as long as.
fn delays_that_are_longer<S: System>(
    system: &S,
    p: &[f64],
    recordings: &[Recording],
) -> Vec<String> {
    let names = &system.signature().delays;
    let mut tau = vec![0.0; names.len()];
    if tau.is_empty() {
        return Vec::new();
    }
    system.delays(Point { t: 0.0, y: &[], u: &[], p, z: &[] }, &mut tau);
    let duration = |recording: &Recording| match recording.times.as_slice() {
        [first, .., last] => last - first,
        _ => 0.0,
    };
    let longest = recordings.iter().map(duration).fold(0.0, f64::max);
    let late = names.iter().zip(&tau).filter(|(_, tau)| **tau >= longest);
    let said = |(name, tau): (&Text, &f64)| {
        format!(
            "the delay `{name}` is {} s, and the longest recording lasts {} s: what comes so late is never \
             seen",
            short(*tau, 3),
            short(longest, 3)
        )
    };
    late.map(said).collect()
}

/// Of each validation recording, the position of the training recording that has most of its rows, if one has:
/// the same times with the same values.
pub(crate) fn trained_on(train: &[Recording], valid: &[Recording]) -> Vec<Option<usize>> {
    let rows: Vec<BTreeSet<Vec<u64>>> = train.iter().map(|one| rows(one).collect()).collect();
    let of = |recording: &Recording| {
        let own: Vec<Vec<u64>> = self::rows(recording).collect();
        let is_same = |rows: &BTreeSet<Vec<u64>>| {
            let both = own.iter().filter(|row| rows.contains(*row)).count();
            !own.is_empty() && both as f64 >= SAME * own.len() as f64
        };
        rows.iter().position(is_same)
    };
    valid.iter().map(of).collect()
}

/// Time and measured values, to the bit, of each row with a value.
fn rows(recording: &Recording) -> impl Iterator<Item = Vec<u64>> + '_ {
    recording.times.iter().enumerate().filter_map(|(k, t)| {
        let values = recording
            .measured
            .iter()
            .map(|samples| samples.as_ref().map_or(f64::NAN, |samples| samples[k]).to_bits());
        let is_missing = |value: &u64| !f64::from_bits(*value).is_finite();
        let row: Vec<u64> = std::iter::once(t.to_bits()).chain(values).collect();
        (!row[1..].iter().all(is_missing)).then_some(row)
    })
}
