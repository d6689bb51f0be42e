//! The fitted structures, with the data for a verdict.

use std::cell::LazyCell;
use std::collections::BTreeSet;

use crate::fit::mean;
use crate::library::StructureId;

/// An expensive value that is computed on demand.
pub(crate) type LazyValue<'a, T> = LazyCell<T, Box<dyn FnOnce() -> T + 'a>>;

/// Fitted structures, the best first, and the question about them.
pub(crate) struct Ranking<'a> {
    pub standings: Vec<RankedStanding<'a>>,
    pub question: VerdictQuestion,
    /// Mean squares of the base model's residuals in training and validation recordings, but at most the variance of
    /// the readings if it diverges: otherwise any effect would pass in comparison.
    pub discrepancy: LazyValue<'a, Option<[f64; 2]>>,
}

/// The question that a verdict answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum VerdictQuestion {
    /// Whether the base model leaves only noise.
    IsSufficient,
    /// Which structure explains the data.
    WhatExplains,
    /// Whether to name a structure of library effects although it leaves more than noise.
    IsNearlyAll(StructureId),
    /// Which templates explain most of the discrepancy.
    WhatIsMost,
}

/// A structure, and how it compares with the recordings.
pub(crate) struct RankedStanding<'a> {
    pub structure: StructureId,
    /// Subjects of its effects: names of library effects, shared by the forms of an effect, and places of templates,
    /// shared by near forms.
    pub names: BTreeSet<String>,
    /// Its templates.
    pub generic: Vec<usize>,
    /// If it is a single template, its rank by plainness.
    pub template: Option<(bool, usize)>,
    /// Whether its templates are few enough and at different places.
    pub is_sayable: bool,
    /// Number of estimated parameters.
    pub numbers: usize,
    /// The Bayesian information criterion.
    pub criterion: f64,
    /// Σ ε² of the training recordings, and the number of samples; ε is white if the errors are noise.
    pub error: (f64, usize),
    /// Its misfit in each output.
    pub misfit: LazyValue<'a, StructureMisfit>,
    /// Whether tests cannot distinguish its residuals from noise.
    pub is_noise: LazyValue<'a, bool>,
    /// Whether no parameter of an effect is at a bound.
    pub is_sound: bool,
    /// Whether its own evidence contradicts it.
    pub is_doubted: bool,
    /// Whether one of its effects only cancels another.
    pub is_cancelling: LazyValue<'a, bool>,
}

impl RankedStanding<'_> {
    /// Whether it has an effect of the library.
    pub(crate) fn is_specific(&self) -> bool {
        self.generic.len() < self.structure.len()
    }
}

/// The misfit of a structure in each output: Σ (e/σ)², and the number of samples.
#[derive(Debug, Clone)]
pub(crate) struct StructureMisfit {
    /// In the training recordings.
    pub trained: Vec<(f64, usize)>,
    /// Factor by which limits are raised for each output, for the uncertainty of noise and mean square.
    pub slack: Vec<f64>,
    /// In the validation recordings.
    pub held_out: HeldOutMisfit,
}

/// The misfit of a structure in validation recordings.
#[derive(Debug, Clone)]
pub(crate) enum HeldOutMisfit {
    /// There are none.
    NoRecording,
    /// They cannot be simulated.
    NoSimulation,
    /// The misfit in each output, and Σ ε² with the number of samples.
    Left {
        by_output: Vec<(f64, usize)>,
        error: (f64, usize),
        /// Factor by which limits are raised for each output, for the uncertainty of parameters and start values.
        slack: Vec<f64>,
    },
}

impl StructureMisfit {
    /// Whether the mean square of each output's errors is within these limits, in training and in validation data.
    pub(crate) fn is_at_most(&self, training: f64, held_out: f64) -> bool {
        self.is_at_most_in_training(training)
            && match &self.held_out {
                HeldOutMisfit::NoRecording => true,
                HeldOutMisfit::NoSimulation => false,
                HeldOutMisfit::Left { by_output, slack, .. } => {
                    self.all_within(by_output, slack, held_out)
                }
            }
    }

    /// [`Self::is_at_most`] for training data alone.
    pub(crate) fn is_at_most_in_training(&self, limit: f64) -> bool {
        self.all_within(&self.trained, &[], limit)
    }

    fn all_within(&self, by_output: &[(f64, usize)], more: &[f64], limit: f64) -> bool {
        let or_one = |slack: &[f64], i: usize| slack.get(i).copied().unwrap_or(1.0);
        let mut outputs = by_output.iter().enumerate();
        outputs.all(|(i, (sum, n))| {
            let slack = or_one(&self.slack, i) * or_one(more, i);
            *n == 0 || *sum <= slack * limit * *n as f64
        })
    }

    /// Mean square of the errors in the training recordings.
    pub(crate) fn training_square(&self) -> Option<f64> {
        mean(&self.trained)
    }

    /// Mean squares of the errors in training and in validation recordings. If no validation sample counts, both are
    /// that of training.
    pub(crate) fn squares(&self) -> Option<[f64; 2]> {
        let trained = self.training_square()?;
        match &self.held_out {
            HeldOutMisfit::NoRecording => Some([trained, trained]),
            HeldOutMisfit::NoSimulation => None,
            HeldOutMisfit::Left { by_output, .. } => {
                Some([trained, mean(by_output).unwrap_or(trained)])
            }
        }
    }
}

impl<'a> Ranking<'a> {
    /// A structure, if it was fitted.
    pub(crate) fn get(&self, structure: StructureId) -> Option<&RankedStanding<'a>> {
        self.standings.iter().find(|standing| standing.structure == structure)
    }
}
