//! What a screen says of each candidate.

use dgd_identify::journal::Kept;
use dgd_identify::keep_by_fields;

use super::projection::dot;
use super::resampled::Trial;
use crate::fit::StartPoint;

/// What a candidate promises.
#[derive(Debug, Clone)]
pub(crate) struct Score {
    /// Position of the candidate.
    pub candidate: usize,
    /// The most that it takes from Σ (e/σ)², over the grid.
    pub gain: f64,
    /// Where to begin a fit, the best first.
    pub points: Vec<StartPoint>,
    /// φ⊥ at the best point of the grid, one column for each λ.
    pub columns: Vec<Vec<f64>>,
}

/// What a screen says.
#[derive(Debug, Clone, Default)]
pub(crate) struct Screen {
    /// Candidates that promise something, the best first.
    pub scores: Vec<Score>,
    /// What each candidate could gain at each place of its grid, whether it does or not.
    pub trials: Vec<Trial>,
    /// Candidates whose score says little or nothing.
    pub silent: Vec<Silent>,
}

/// A candidate whose score says little or nothing.
#[derive(Debug, Clone)]
pub(crate) struct Silent {
    /// Position of the candidate.
    pub candidate: usize,
    /// Why, as what follows its name.
    pub why: String,
    /// What may be done about it.
    pub remedy: Remedy,
}

/// What may be done about a candidate whose score says little.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Remedy {
    /// Its score is that it takes nothing away.
    ScoreIsZero,
    /// It can be fitted from the values in its file.
    Fit,
    /// That, too, since its score is nothing for a reason that a fit does not have.
    FitAnyway,
    /// Nothing.
    LeaveOut,
}

/// Squared cosine between the columns of candidates that are the same equations: the solver's error
/// is what is left of it.
const PARALLEL: f64 = 1.0 - 1e-6;

/// Puts the best first.
pub(crate) fn best_first(scores: &mut [Score]) {
    scores.sort_by(|a, b| b.gain.total_cmp(&a.gain).then(a.candidate.cmp(&b.candidate)));
}

/// Whether two candidates do the same to the outputs, to first order and but for a factor.
pub(crate) fn are_parallel(a: &Score, b: &Score) -> bool {
    let ([a], [b]) = (a.columns.as_slice(), b.columns.as_slice()) else { return false };
    a.len() == b.len() && dot(a, b).powi(2) > PARALLEL * dot(a, a) * dot(b, b)
}

keep_by_fields!(Screen { scores, trials, silent });

keep_by_fields!(Silent { candidate, why, remedy });

impl Kept for Remedy {
    fn write(&self, bytes: &mut Vec<u8>) {
        let fits = matches!(self, Remedy::Fit | Remedy::FitAnyway);
        [matches!(self, Remedy::ScoreIsZero | Remedy::FitAnyway), fits].write(bytes);
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        match <[bool; 2]>::read(bytes)? {
            [true, false] => Some(Remedy::ScoreIsZero),
            [false, true] => Some(Remedy::Fit),
            [false, false] => Some(Remedy::LeaveOut),
            [true, true] => Some(Remedy::FitAnyway),
        }
    }
}

keep_by_fields!(Score { candidate, gain, points, columns });
