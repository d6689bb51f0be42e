//! Equations and outputs along recordings, at the estimates of a regression.

use crate::regression::error::RegressionError;
use crate::regression::finish::RegressionFit;
use crate::regression::prepare::PreparedRegression;
use crate::regression::{RegressionMethod, RegressionProblem};

/// One equation or output along one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct RowTrace {
    /// Position among [`RegressionFit::rows`].
    pub row: usize,
    /// Position of the recording.
    pub recording: usize,
    /// Times of all samples, s.
    pub times: Vec<f64>,
    /// The target, SI: a slope, zero for an algebraic equation, or a reading; NaN at samples without the row.
    pub target: Vec<f64>,
    /// The prediction at the estimates, SI.
    pub predicted: Vec<f64>,
}

/// All rows of a regression at its estimates, recording by recording.
///
/// # Errors
///
/// [`RegressionError`], as [`regress`](super::regress).
///
/// # Panics
///
/// If the fit belongs to another problem.
pub fn traces(
    problem: &RegressionProblem<'_>,
    fit: &RegressionFit,
) -> Result<Vec<RowTrace>, RegressionError> {
    let mut prepared = PreparedRegression::new(problem)?;
    prepared.p.clone_from(&fit.p);
    prepared.clamp(RegressionMethod::Bounded);
    let known = prepared.known()?;
    let mut rows = prepared.rows(&known)?;
    let n_kinds = rows.kinds.len();
    let position = |kind: usize| fit.rows.iter().position(|row| row.of == rows.kinds[kind].of);
    let positions: Vec<usize> = (0..n_kinds).filter_map(position).collect();
    assert_eq!(positions.len(), n_kinds, "rows of the fit");
    let mut traces: Vec<RowTrace> = Vec::with_capacity(known.len() * n_kinds);
    for (recording, known) in known.iter().enumerate() {
        let nothing = vec![f64::NAN; known.times.len()];
        traces.extend(positions.iter().map(|row| RowTrace {
            row: *row,
            recording,
            times: known.times.clone(),
            target: nothing.clone(),
            predicted: nothing.clone(),
        }));
    }
    rows.visit(&fit.p, &mut |row| {
        let trace = &mut traces[row.recording * n_kinds + row.kind];
        trace.target[row.sample] = row.target;
        trace.predicted[row.sample] = row.predicted;
    })?;
    Ok(traces)
}
