//! The structures that could be fitted, with all that a verdict is decided by.

use std::cell::LazyCell;
use std::collections::BTreeSet;

use crate::fit::mean;
use crate::library::StructureId;

/// What takes a while to find, and is found when it is asked for.
pub(crate) type Asked<'a, T> = LazyCell<T, Box<dyn FnOnce() -> T + 'a>>;

/// Structures that could be fitted, the best first, and what is asked about them.
pub(crate) struct Ranking<'a> {
    pub standings: Vec<Standing<'a>>,
    pub question: Question,
    /// Mean squares of what the base model leaves of training and validation recordings, but no more than readings
    /// stray by themselves where it runs away from them: a name that is judged by that would pass whatever it leaves.
    pub discrepancy: Asked<'a, Option<[f64; 2]>>,
}

/// What a verdict is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Question {
    /// Whether the base model leaves nothing but noise.
    IsSufficient,
    /// Which structure explains the data.
    WhatExplains,
    /// Whether a structure of the library's effects is to be named although it leaves more than noise.
    IsNearlyAll(StructureId),
    /// Which templates take most of the discrepancy away.
    WhatIsMost,
}

/// A structure, and how it compares with the recordings.
pub(crate) struct Standing<'a> {
    pub structure: StructureId,
    /// What its effects are about: names of the library's, which forms of an effect share, and places of templates,
    /// which near forms share.
    pub names: BTreeSet<String>,
    /// Its templates.
    pub generic: Vec<usize>,
    /// Where it is one template alone, that file's position among all.
    pub template: Option<usize>,
    /// Whether its templates are few enough, and at different places.
    pub is_sayable: bool,
    /// Numbers that were estimated.
    pub numbers: usize,
    /// The Bayesian information criterion.
    pub criterion: f64,
    /// Σ ε² of the training recordings, and how many samples; ε is white if the errors are noise.
    pub error: (f64, usize),
    /// What it leaves of each output.
    pub misfit: Asked<'a, Misfit>,
    /// Whether tests cannot tell that from noise.
    pub is_noise: Asked<'a, bool>,
    /// Whether no parameter of an effect has run into a bound.
    pub is_sound: bool,
    /// Whether its own evidence contradicts it.
    pub is_doubted: bool,
    /// Whether one of its effects does nothing but take back what another does.
    pub is_cancelling: Asked<'a, bool>,
}

impl Standing<'_> {
    /// Whether it has an effect of the library.
    pub(crate) fn is_specific(&self) -> bool {
        self.generic.len() < self.structure.len()
    }
}

/// What a structure leaves of each output: Σ (e/σ)², and how many samples.
#[derive(Debug, Clone)]
pub(crate) struct Misfit {
    /// Of the training recordings.
    pub trained: Vec<(f64, usize)>,
    /// By what factor limits are raised for each output: noise and mean square are not known better.
    pub slack: Vec<f64>,
    /// Of the validation recordings.
    pub held_out: HeldOutMisfit,
}

/// What a structure leaves of validation recordings.
#[derive(Debug, Clone)]
pub(crate) enum HeldOutMisfit {
    /// There are none.
    NoRecording,
    /// They cannot be simulated.
    NoSimulation,
    /// Of each output, and Σ ε² with the number of samples.
    Left { by_output: Vec<(f64, usize)>, error: (f64, usize) },
}

impl Misfit {
    /// Whether the mean square of each output's errors is at most that, in training and in validation data.
    pub(crate) fn is_at_most(&self, training: f64, held_out: f64) -> bool {
        let all_within = |by_output: &[(f64, usize)], limit: f64| {
            let slack = self.slack.iter().copied().chain(std::iter::repeat(1.0));
            let mut all = by_output.iter().zip(slack);
            all.all(|((sum, n), slack)| *n == 0 || *sum <= slack * limit * *n as f64)
        };
        all_within(&self.trained, training)
            && match &self.held_out {
                HeldOutMisfit::NoRecording => true,
                HeldOutMisfit::NoSimulation => false,
                HeldOutMisfit::Left { by_output, .. } => all_within(by_output, held_out),
            }
    }

    /// Mean square of the errors in the training recordings.
    pub(crate) fn training_square(&self) -> Option<f64> {
        mean(&self.trained)
    }

    /// Mean squares of the errors in training and in validation recordings. Where no validation sample counts,
    /// the first stands for both.
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
    /// A structure, if it could be fitted.
    pub(crate) fn get(&self, structure: StructureId) -> Option<&Standing<'a>> {
        self.standings.iter().find(|standing| standing.structure == structure)
    }
}
