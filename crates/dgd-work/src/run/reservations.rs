//! Reasons why recordings cannot answer: they are steady, too short, or repeated.

use dgd_discover::FEWEST;
use dgd_identify::Recording;
use dgd_runtime::{EvaluationPoint, LimitSide, Signature, System, Text};

use crate::output::quantity::short;

/// A validation recording that shares at least this share of its rows with the training recordings counts as trained
/// on.
const SAME: f64 = 0.5;

/// A sentence for each reason why recordings may not determine a model with these parameters, SI.
pub(crate) fn of_recordings<S: System>(
    system: &S,
    p: &[f64],
    recordings: &[Recording],
) -> Vec<String> {
    let mut reasons = Vec::new();
    if is_at_rest(system.signature(), recordings) {
        reasons.push(
            "no input moves in any recording: all there is to go by is how the model settles from its start \
             values, and recordings in which inputs move would say more"
                .to_owned(),
        );
    }
    reasons.extend(delays_that_are_longer(system, p, recordings));
    reasons
}

/// Whether there are inputs, and all stay constant in all recordings.
fn is_at_rest(signature: &Signature, recordings: &[Recording]) -> bool {
    let mut first: Option<Vec<f64>> = None;
    let mut u = vec![0.0; signature.inputs.len()];
    let moments = recordings.iter().flat_map(|one| one.times.iter().map(move |t| (one, *t)));
    let mut stays = |(recording, t): (&Recording, f64)| {
        recording.inputs.value(t, LimitSide::Right, &mut u);
        first.get_or_insert_with(|| u.clone()) == &u
    };
    !signature.inputs.is_empty() && moments.into_iter().all(&mut stays)
}

/// A sentence if no recording has enough samples of any output for tests of its residuals beyond their size.
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

/// Delays longer than every recording.
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
    system.delays(EvaluationPoint { t: 0.0, y: &[], u: &[], p, z: &[] }, &mut tau);
    let duration = |recording: &Recording| match recording.times.as_slice() {
        [first, .., last] => last - first,
        _ => 0.0,
    };
    let longest = recordings.iter().map(duration).fold(0.0, f64::max);
    let late = names.iter().zip(&tau).filter(|(_, tau)| **tau >= longest);
    let sentence = |(name, tau): (&Text, &f64)| {
        format!(
            "the delay `{name}` is {} s, and the longest recording lasts {} s: what comes so late is never \
             seen",
            short(*tau, 3),
            short(longest, 3)
        )
    };
    late.map(sentence).collect()
}

/// For each validation recording, the index of the training recording that contains most of its rows, if any: the same
/// times with the same values.
pub(crate) fn trained_on(train: &[Recording], valid: &[Recording]) -> Vec<Option<usize>> {
    let is_same = |own: &Recording, other: &Recording| {
        let rows = rows(own).count();
        rows > 0 && shared(own, other) as f64 >= SAME * rows as f64
    };
    valid.iter().map(|own| train.iter().position(|other| is_same(own, other))).collect()
}

/// The rows of a recording with a value.
fn rows(recording: &Recording) -> impl Iterator<Item = usize> + '_ {
    let has_value = |k: usize| {
        let mut measured = recording.measured.iter().flatten();
        measured.any(|samples| samples[k].is_finite())
    };
    (0..recording.times.len()).filter(move |k| has_value(*k))
}

/// Number of rows with a value that are bitwise equal in another recording.
fn shared(own: &Recording, other: &Recording) -> usize {
    let value = |recording: &Recording, k: usize, i: usize| {
        recording.measured[i].as_ref().map_or(f64::NAN, |samples| samples[k]).to_bits()
    };
    let is_same = |k: usize, j: usize| {
        own.times[k].to_bits() == other.times[j].to_bits()
            && (0..own.measured.len()).all(|i| value(own, k, i) == value(other, j, i))
    };
    // Times ascend in both.
    let mut begin = 0;
    let mut is_there = |k: &usize| {
        let t = own.times[*k];
        begin += other.times[begin..].iter().take_while(|time| **time < t).count();
        let at_once = other.times[begin..].iter().take_while(|time| **time == t).count();
        (begin..begin + at_once).any(|j| is_same(*k, j))
    };
    rows(own).filter(|k| is_there(k)).count()
}

#[cfg(test)]
mod tests {
    use dgd_runtime::Inputs;

    use super::*;

    fn recording(times: &[f64], values: &[f64]) -> Recording {
        Recording::new(times.to_vec(), Inputs::none(), vec![None, Some(values.to_vec())])
    }

    #[test]
    fn rows_that_were_trained_on_are_known_again() {
        let nan = f64::NAN;
        let train = [
            recording(&[0.0, 1.0], &[7.0, 8.0]),
            recording(&[0.0, 1.0, 1.0, 1.0, 2.0, 5.0], &[1.0, 2.0, 3.0, 4.0, nan, 6.0]),
        ];
        let source =
            |times: &[f64], values: &[f64]| trained_on(&train, &[recording(times, values)])[0];
        assert_eq!(
            source(&[1.0, 1.0, 3.0, 5.0], &[4.0, 2.0, 9.0, 9.0]),
            Some(1),
            "half of the rows"
        );
        assert_eq!(source(&[1.0, 1.0, 3.0], &[4.0, 9.0, 9.0]), None, "a third of them");
        assert_eq!(source(&[2.0, 3.0], &[nan, nan]), None, "rows without a value are none");
        assert_eq!(source(&[0.0, 1.0], &[7.0, 3.0]), Some(0), "the first that has them");
        assert_eq!(source(&[0.5, 1.5], &[7.0, 8.0]), None, "at other times");
        assert_eq!(trained_on(&train, &[]), []);
    }
}
