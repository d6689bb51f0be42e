//! Runs filters with several sets of numbers along one recording, row by row.
//!
//! Each thread takes some of the filters through a stretch of rows; then the innovations of all filters are processed
//! together, row by row, and dropped. The results do not depend on the number of threads.

use std::sync::mpsc::sync_channel;

use dgd_runtime::Options;
use dgd_runtime::model::Model;
use dgd_runtime::parallel::threads_for;

use super::{LikelihoodFailure, counting_rows};
use crate::error::TrialFailed;
use crate::filter::estimator::{RowInnovations, RunningFilter};
use crate::filter::problem::{FilterAlgorithm, FilterProblem, FilterTuning};
use crate::output_error::Starts;
use crate::recording::Recording;

/// Rows in a stretch.
const STRETCH: usize = 256;

/// The parameters of one filter.
pub(in crate::filter) struct FilterParameters {
    pub p: Vec<f64>,
    pub start: Starts,
    pub tuning: FilterTuning,
}

/// A recording, its position, and the integrator options.
#[derive(Clone, Copy)]
pub(in crate::filter) struct RecordingCursor<'a> {
    pub recording: &'a Recording,
    pub position: usize,
    pub options: Options,
}

/// Innovations of some filters over a stretch: for each filter, row by row. The first row in which a filter failed ends
/// it, with the position of the filter.
struct InnovationStretch {
    innovated: Vec<Vec<RowInnovations>>,
    failed: Option<(usize, usize, LikelihoodFailure)>,
}

/// Passes the innovations of all filters to `take`, row by row.
///
/// # Errors
///
/// The first row that cannot be filtered; if several filters fail there, the error of the first.
pub(in crate::filter) fn filter_side_by_side(
    system: &dyn Model,
    along: RecordingCursor<'_>,
    all: &[FilterParameters],
    threads: usize,
    mut take: impl FnMut(&[&RowInnovations]),
) -> Result<(), LikelihoodFailure> {
    let share = all.len().div_ceil(threads_for(threads, all.len()));
    if share >= all.len() {
        let mut outcome = Ok(());
        filter_some(system, along, 0, all, |stretch| {
            outcome = look(vec![stretch], &mut take);
            outcome.is_ok()
        });
        return outcome;
    }
    std::thread::scope(|scope| {
        let stretches: Vec<_> = (all.chunks(share).enumerate())
            .map(|(k, some)| {
                // No thread runs ahead by more than one stretch.
                let (send, receive) = sync_channel(1);
                let system = system.copied();
                scope.spawn(move || {
                    filter_some(system.as_ref(), along, k * share, some, |stretch| {
                        send.send(stretch).is_ok()
                    });
                });
                receive
            })
            .collect();
        loop {
            let together: Vec<InnovationStretch> =
                stretches.iter().filter_map(|stretch| stretch.recv().ok()).collect();
            if together.is_empty() {
                return Ok(());
            }
            look(together, &mut take)?;
        }
    })
}

/// Processes a stretch of all filters.
fn look(
    stretches: Vec<InnovationStretch>,
    take: &mut impl FnMut(&[&RowInnovations]),
) -> Result<(), LikelihoodFailure> {
    let (mut of_all, mut first) = (Vec::new(), None);
    for InnovationStretch { innovated, failed } in stretches {
        of_all.extend(innovated);
        let Some((row, filter, failed)) = failed else { continue };
        if first.as_ref().is_none_or(|(least, _, _)| row < *least) {
            first = Some((row, filter, failed));
        }
    }
    if let Some((_, _, failed)) = first {
        return Err(failed);
    }
    let rows = of_all.first().map_or(0, Vec::len);
    for k in 0..rows {
        let row: Vec<&RowInnovations> = of_all.iter().map(|innovated| &innovated[k]).collect();
        take(&row);
    }
    Ok(())
}

/// Runs filters through a recording and sends each stretch until the receiver is gone.
fn filter_some(
    system: &dyn Model,
    along: RecordingCursor<'_>,
    first: usize,
    some: &[FilterParameters],
    mut tell: impl FnMut(InnovationStretch) -> bool,
) {
    let RecordingCursor { recording, position, options } = along;
    let n_directions = system.signature().directions.len();
    let problems: Vec<FilterProblem<'_>> = some
        .iter()
        .map(|numbers| FilterProblem {
            system,
            p: &numbers.p,
            free: vec![false; n_directions],
            start: numbers.start.clone(),
            estimator: FilterAlgorithm::ExtendedKalman,
            gate: None,
            options,
        })
        .collect();
    let mut filters: Vec<Option<RunningFilter<'_>>> = some.iter().map(|_| None).collect();
    let mut rows = counting_rows(recording);
    loop {
        let stretch: Vec<(usize, Vec<f64>)> = rows.by_ref().take(STRETCH).collect();
        if stretch.is_empty() {
            return;
        }
        let mut result =
            InnovationStretch { innovated: Vec::with_capacity(some.len()), failed: None };
        for (i, filter) in filters.iter_mut().enumerate() {
            // Rows after a failure are ignored.
            let until = result.failed.as_ref().map_or(stretch.len(), |(row, _, _)| *row);
            let mut innovated = Vec::with_capacity(until);
            for (row, (k, measured)) in stretch[..until].iter().enumerate() {
                let (t, inputs) = (recording.times[*k], &recording.inputs);
                let moved = if let Some(filter) = filter {
                    filter.advance(inputs, t, measured)
                } else {
                    let (problem, tuning) = (&problems[i], &some[i].tuning);
                    let begun = RunningFilter::begin_recorded(problem, tuning, inputs, t, measured);
                    begun.map(|(begun, row)| {
                        *filter = Some(begun);
                        row
                    })
                };
                // A row in which the model could not be evaluated invalidates the likelihood.
                let failure = match moved {
                    Err(error) => Some(LikelihoodFailure::from_error(error, position)),
                    Ok(row) => row.failure.map(|reason| {
                        LikelihoodFailure::Trial(TrialFailed { recording: position, reason })
                    }),
                };
                if let Some(failure) = failure {
                    result.failed = Some((row, first + i, failure));
                    break;
                }
                innovated.extend(filter.as_mut().map(RunningFilter::take_innovated));
            }
            result.innovated.push(innovated);
        }
        let has_failed = result.failed.is_some();
        if !tell(result) || has_failed {
            return;
        }
    }
}
