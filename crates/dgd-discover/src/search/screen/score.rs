//! The result of a screen for each candidate.

use dgd_identify::journal::Journaled;
use dgd_identify::keep_by_fields;

use super::projection::dot;
use super::resampled::PointTrial;
use crate::fit::StartPoint;

/// The promise of a candidate.
#[derive(Debug, Clone)]
pub(crate) struct CandidateScore {
    /// Position of the candidate.
    pub candidate: usize,
    /// The largest reduction of Σ (e/σ)² over the grid.
    pub gain: f64,
    /// Starting points of a fit, the best first.
    pub points: Vec<StartPoint>,
    /// φ⊥ at the best point of the grid, one column for each λ.
    pub columns: Vec<Vec<f64>>,
}

/// The result of a screen.
#[derive(Debug, Clone, Default)]
pub(crate) struct Screen {
    /// Candidates with a gain, the best first.
    pub scores: Vec<CandidateScore>,
    /// The possible gain of each candidate at each point of its grid, whether realised or not.
    pub trials: Vec<PointTrial>,
    /// Candidates whose score is not informative.
    pub silent: Vec<SilentCandidate>,
}

/// A candidate whose score is not informative.
#[derive(Debug, Clone)]
pub(crate) struct SilentCandidate {
    /// Position of the candidate.
    pub candidate: usize,
    /// The reason, as the continuation of a sentence after its name.
    pub why: String,
    /// The remedy.
    pub remedy: ScoreRemedy,
}

/// The remedy for a candidate whose score is not informative.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ScoreRemedy {
    /// Nothing: its score is zero.
    ScoreIsZero,
    /// It can be fitted from the values in its file.
    Fit,
    /// It can also be fitted, since its score is zero for a reason that does not apply to a fit.
    FitAnyway,
    /// Nothing: it is left out.
    LeaveOut,
}

/// Squared cosine above which the columns of two candidates are parallel: the difference is solver error.
const PARALLEL: f64 = 1.0 - 1e-6;

/// Sorts the best first.
pub(crate) fn best_first(scores: &mut [CandidateScore]) {
    scores.sort_by(|a, b| b.gain.total_cmp(&a.gain).then(a.candidate.cmp(&b.candidate)));
}

/// Whether two candidates have the same effect on the outputs, to first order and up to a factor.
pub(crate) fn are_parallel(a: &CandidateScore, b: &CandidateScore) -> bool {
    let ([a], [b]) = (a.columns.as_slice(), b.columns.as_slice()) else { return false };
    a.len() == b.len() && dot(a, b).powi(2) > PARALLEL * dot(a, a) * dot(b, b)
}

keep_by_fields!(Screen { scores, trials, silent });

keep_by_fields!(SilentCandidate { candidate, why, remedy });

impl Journaled for ScoreRemedy {
    fn write(&self, bytes: &mut Vec<u8>) {
        let fits = matches!(self, ScoreRemedy::Fit | ScoreRemedy::FitAnyway);
        [matches!(self, ScoreRemedy::ScoreIsZero | ScoreRemedy::FitAnyway), fits].write(bytes);
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        match <[bool; 2]>::read(bytes)? {
            [true, false] => Some(ScoreRemedy::ScoreIsZero),
            [false, true] => Some(ScoreRemedy::Fit),
            [false, false] => Some(ScoreRemedy::LeaveOut),
            [true, true] => Some(ScoreRemedy::FitAnyway),
        }
    }
}

keep_by_fields!(CandidateScore { candidate, gain, points, columns });
