//! Arguments of requests, and how each face writes them.

use std::fmt;

/// An argument of a request: an option of the command line, a keyword of Python, a key of a job file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Argument {
    /// Effects to apply.
    Apply,
    /// An operating point.
    At,
    /// Width of a filter in time.
    Bandwidth,
    /// Number of resampled fits.
    Bootstrap,
    /// Number of the first resampled fit.
    BootstrapFrom,
    /// Time for a search.
    Budget,
    /// Training recordings.
    Data,
    /// Folders of effects.
    Effects,
    /// The estimator.
    Estimator,
    /// Limit on simulations.
    Evaluations,
    /// Distance of rows.
    Every,
    /// Parameters that are held.
    Fix,
    /// An equation.
    For,
    /// Forgetting of old samples.
    Forgetting,
    /// Format of the result.
    Format,
    /// Parameters that are estimated.
    Free,
    /// First time.
    From,
    /// Whether the information of recordings is reported.
    Information,
    /// Folder of a job's results.
    Into,
    /// Labels of curves.
    Label,
    /// The loss function.
    Loss,
    /// Marked points.
    Mark,
    /// Limit on memory.
    Memory,
    /// Noise of outputs.
    Noise,
    /// Seed of simulated noise.
    NoiseSeed,
    /// Quantities to differentiate.
    Of,
    /// Path of the result.
    Out,
    /// Outputs in use.
    Outputs,
    /// The quantity of an abscissa.
    Over,
    /// Path of a figure.
    Plot,
    /// Process noise of states.
    ProcessNoise,
    /// Estimates with a profile.
    Profile,
    /// Other names of columns.
    Rename,
    /// Rates at rest.
    Rest,
    /// Whether an earlier run is resumed.
    Resume,
    /// Whether failed pieces are repeated.
    Retry,
    /// Relative tolerance.
    Rtol,
    /// Columns that measure the same.
    Same,
    /// Folder for data beyond the memory.
    Scratch,
    /// Seed of everything random.
    Seed,
    /// Values of parameters and initial states.
    Set,
    /// Distribution of starting points.
    Spread,
    /// Source of initial values.
    Start,
    /// Number of one starting point.
    StartPoint,
    /// Uncertainty of initial values.
    StartStd,
    /// Number of starting points.
    Starts,
    /// States that are steady.
    Steady,
    /// How steps are chosen.
    Steps,
    /// Number of threads.
    Threads,
    /// Directions of sensitivities.
    To,
    /// The unit of a result.
    Unit,
    /// Last time.
    Until,
    /// Validation recordings.
    Valid,
    /// Choices of variants.
    Variant,
}

/// Every argument with its name, in the order of [`Argument`].
const NAMES: [(Argument, &str); 54] = [
    (Argument::Apply, "apply"),
    (Argument::At, "at"),
    (Argument::Bandwidth, "bandwidth"),
    (Argument::Bootstrap, "bootstrap"),
    (Argument::BootstrapFrom, "bootstrap-from"),
    (Argument::Budget, "budget"),
    (Argument::Data, "data"),
    (Argument::Effects, "effects"),
    (Argument::Estimator, "estimator"),
    (Argument::Evaluations, "evaluations"),
    (Argument::Every, "every"),
    (Argument::Fix, "fix"),
    (Argument::For, "for"),
    (Argument::Forgetting, "forgetting"),
    (Argument::Format, "format"),
    (Argument::Free, "free"),
    (Argument::From, "from"),
    (Argument::Information, "information"),
    (Argument::Into, "into"),
    (Argument::Label, "label"),
    (Argument::Loss, "loss"),
    (Argument::Mark, "mark"),
    (Argument::Memory, "memory"),
    (Argument::Noise, "noise"),
    (Argument::NoiseSeed, "noise-seed"),
    (Argument::Of, "of"),
    (Argument::Out, "out"),
    (Argument::Outputs, "outputs"),
    (Argument::Over, "over"),
    (Argument::Plot, "plot"),
    (Argument::ProcessNoise, "process-noise"),
    (Argument::Profile, "profile"),
    (Argument::Rename, "rename"),
    (Argument::Rest, "rest"),
    (Argument::Resume, "resume"),
    (Argument::Retry, "retry"),
    (Argument::Rtol, "rtol"),
    (Argument::Same, "same"),
    (Argument::Scratch, "scratch"),
    (Argument::Seed, "seed"),
    (Argument::Set, "set"),
    (Argument::Spread, "spread"),
    (Argument::Start, "start"),
    (Argument::StartPoint, "start-point"),
    (Argument::StartStd, "start-std"),
    (Argument::Starts, "starts"),
    (Argument::Steady, "steady"),
    (Argument::Steps, "steps"),
    (Argument::Threads, "threads"),
    (Argument::To, "to"),
    (Argument::Unit, "unit"),
    (Argument::Until, "until"),
    (Argument::Valid, "valid"),
    (Argument::Variant, "variant"),
];

impl Argument {
    /// All arguments.
    pub fn all() -> impl Iterator<Item = Argument> {
        NAMES.iter().map(|(argument, _)| *argument)
    }

    /// Its name, words separated by hyphens.
    pub fn name(self) -> &'static str {
        NAMES[self as usize].1
    }

    /// The argument with a value, such as one that was given or one to give.
    pub fn with(self, value: impl fmt::Display) -> ArgumentUse {
        ArgumentUse { argument: self, value: Some(ArgumentValue::Literal(value.to_string())) }
    }

    /// The argument with a word in capitals that stands for its value.
    pub fn taking(self, placeholder: &'static str) -> ArgumentUse {
        ArgumentUse { argument: self, value: Some(ArgumentValue::Placeholder(placeholder)) }
    }
}

/// An argument as it occurs in a sentence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArgumentUse {
    /// The argument.
    pub argument: Argument,
    /// Its value, if the sentence gives one.
    pub value: Option<ArgumentValue>,
}

/// The value of an argument in a sentence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ArgumentValue {
    /// The value itself, as one writes it.
    Literal(String),
    /// A word that stands for any value.
    Placeholder(&'static str),
}

impl ArgumentUse {
    /// The text of its value.
    pub fn value(&self) -> Option<&str> {
        self.value.as_ref().map(|value| match value {
            ArgumentValue::Literal(text) => text.as_str(),
            ArgumentValue::Placeholder(word) => word,
        })
    }
}

impl From<Argument> for ArgumentUse {
    fn from(argument: Argument) -> Self {
        ArgumentUse { argument, value: None }
    }
}

/// How a face writes an argument, as the user of that face would give it.
pub type Spelling = fn(&ArgumentUse) -> String;

/// The spelling of a library: the name, and `name = value`.
pub fn neutral(given: &ArgumentUse) -> String {
    match given.value() {
        Some(value) => format!("{} = {value}", given.argument.name()),
        None => given.argument.name().to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_in_the_order_of_the_arguments() {
        for (k, argument) in Argument::all().enumerate() {
            assert_eq!(argument as usize, k, "{argument:?}");
        }
        assert_eq!(Argument::StartStd.name(), "start-std");
        assert_eq!(neutral(&Argument::Start.with("measured")), "start = measured");
    }
}
