//! What a search for laws answers.

use super::inserted::FittedTerms;

/// The result of the search for a law.
#[derive(Debug)]
pub(crate) struct LawSearchResult {
    pub(crate) answer: LawAnswer,
    /// Equations that lack something together, in a smoother with a free input in each equation.
    pub(crate) lacking: Vec<String>,
}

/// Whether a law explains the recordings.
#[derive(Debug)]
pub(crate) enum LawAnswer {
    /// No law: named effects keep their names, and a discrepancy without a name stays without one.
    Nothing,
    /// Laws in other equations explain the recordings as well as the effects that were named, or as the best law; none
    /// are given if the validation recordings confirm none.
    Doubt(Vec<FittedTerms>),
    /// A law.
    Law(Box<AnsweringLaw>),
}

impl LawSearchResult {
    /// No law, because none was sought.
    pub(crate) const NOTHING: LawSearchResult =
        LawSearchResult { answer: LawAnswer::Nothing, lacking: Vec::new() };
}

impl LawAnswer {
    /// Σ ε² + k ln N of the best law, infinite if the validation recordings confirm none.
    pub(crate) fn cost(&self) -> Option<f64> {
        match self {
            LawAnswer::Nothing => None,
            LawAnswer::Doubt(rivals) => {
                Some(rivals.first().map_or(f64::INFINITY, FittedTerms::cost))
            }
            LawAnswer::Law(law) => Some(law.inserted.cost()),
        }
    }
}

/// A law that is an answer.
#[derive(Debug)]
pub(crate) struct AnsweringLaw {
    pub(crate) inserted: FittedTerms,
    /// Other formulas that leave no more than noise, each with the ratio of its root-mean-square residual.
    pub(crate) near: Vec<(String, f64)>,
}
