//! What a discovery says.

use dgd_runtime::Unit;

use super::power::Power;
use crate::conditions::Condition;
use crate::guess::{Guess, Together};
use crate::missing_input::{ClosedPlace, MissingInput};
use crate::noise::Window;
use crate::search::{Alternative, Evidence, Verdict};

/// What was found, with everything that a report shows.
#[derive(Debug, Clone)]
pub struct Discovery {
    /// The short of it.
    pub verdict: Verdict,
    /// Why this verdict, in a sentence or two.
    pub reason: String,
    /// Probability that, with nothing hidden, the best of the library promises as much as it does in the
    /// base model: uniform where nothing is hidden. Of the templates where there is no library, `None`
    /// where nothing could be tried.
    pub p_value: Option<f64>,
    /// Effects of the library that cannot be tried: their names, and why not.
    pub left_out: Vec<(String, String)>,
    /// What was fitted alone and given up on the way, and why.
    pub given_up: Option<(Vec<String>, String)>,
    /// How many readings of each output stand alone far outside their neighbours, and were left out.
    pub lonely: Vec<usize>,
    /// Whether the time that it was given had passed before everything was tried.
    pub is_cut_short: bool,
    /// Templates that were not tried: their names, and why not.
    pub not_tried: Vec<(String, String)>,
    /// Effects that the data shows, in the order in which they were found.
    pub effects: Vec<FoundEffect>,
    /// Effects that the recordings look like without passing for them.
    pub described: Vec<Described>,
    /// Discrepancies that no known effect removes: places, the most likely first.
    pub unexplained: Vec<Unexplained>,
    /// Where nothing is missing: how small an effect of the library would have been seen.
    pub power: Vec<Power>,
    /// For each output, how large the simulation error is before and after.
    pub gap: Vec<Gap>,
    /// For each recording, measured and simulated outputs.
    pub traces: Vec<RecordingTrace>,
    /// What each place of the base model would have needed, on the first training recording, the most likely first.
    pub missing: Vec<MissingInput>,
    /// Places at which nothing could be looked for.
    pub closed: Vec<ClosedPlace>,
    /// Why nothing could be looked for at any place.
    pub nowhere: Option<String>,
    /// All structures that were refitted, the best first.
    pub ranking: Vec<Ranked>,
    /// What each candidate alone promised before it was refitted, the best first.
    pub screened: Vec<Screened>,
    /// Parameters of the base model, refitted.
    pub base_parameters: Vec<ParameterValue>,
    /// Parameters of the corrected model, those of the base model first.
    pub corrected_parameters: Vec<ParameterValue>,
    /// The corrected model's text; that of the base model with refitted parameters where no effect
    /// was found.
    pub corrected: String,
}

/// An effect that the data shows.
#[derive(Debug, Clone)]
pub struct FoundEffect {
    /// Its family.
    pub name: String,
    /// `plant`, `sensor` or `input`.
    pub kind: &'static str,
    /// Which realisation, where the family has several.
    pub form: Option<String>,
    /// Its doc comment.
    pub doc: Vec<String>,
    /// The equation, output or input that it changes.
    pub target: String,
    /// Effects that the data cannot tell it from.
    pub alternatives: Vec<Alternative>,
    /// Other realisations of it that were fitted, the best first.
    pub other_forms: Vec<Alternative>,
    /// What would tell it from its alternatives; empty without any.
    pub told_apart_by: Option<String>,
    /// Since when, s, where it has an onset.
    pub onset: Option<f64>,
    /// When it is active in the first training recording, s.
    pub windows: Vec<[f64; 2]>,
    /// The condition under which it is active, in all training recordings.
    pub condition: Option<Condition>,
    /// The parameters it brings.
    pub parameters: Vec<ParameterValue>,
    /// Why it is believed.
    pub evidence: Evidence,
}

/// An effect that bends to the recordings without explaining them.
#[derive(Debug, Clone)]
pub struct Described {
    /// Its name, with what it is applied to.
    pub name: String,
    /// `plant`, `sensor` or `input`.
    pub kind: &'static str,
    /// Which realisation, where there are several.
    pub form: Option<String>,
    /// The equation, parameter, output or input that it changes.
    pub target: String,
    /// Its parameters in the fit.
    pub parameters: Vec<ParameterValue>,
    /// Mean square of the residuals over the noise, with all that is described: of training data, and of validation
    /// data where there is any.
    pub left: (f64, Option<f64>),
    /// Its text, with the values of the fit, as `--apply` takes it, and the arguments that it is applied to.
    pub file: String,
    /// The arguments.
    pub arguments: Vec<String>,
}

/// A parameter with its standard deviation, SI.
#[derive(Debug, Clone)]
pub struct ParameterValue {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: Unit,
    /// Value, SI.
    pub value: f64,
    /// Standard deviation, SI; `None` where the data does not determine it.
    pub std: Option<f64>,
    /// How far it may be off for what the model still misses, SI: the spread over parts of the training recordings and
    /// over structures that do nearly as well. `None` where nothing is left over, and where it is not known.
    pub std_model: Option<f64>,
}

/// A discrepancy without a name.
#[derive(Debug, Clone)]
pub struct Unexplained {
    /// The place: an equation's label, a parameter, an input or `sensor NAME`.
    pub target: String,
    /// Whether it makes the readings nearly as likely as the best place does.
    pub is_tied: bool,
    /// By how much it makes the log-likelihood of the readings larger.
    pub gain: f64,
    /// When, in the first training recording.
    pub windows: Vec<[f64; 2]>,
    /// The condition that coincides with these windows, in all training recordings.
    pub condition: Option<Condition>,
    /// In words.
    pub description: String,
    /// What the equation would have needed.
    pub trace: MissingInput,
    /// Quantities that it goes together with, the closest first: what to look at.
    pub together: Vec<Together>,
    /// A formula that looks like it, where the verdict is `unexplained` and there is a simple one.
    pub guess: Option<Guess>,
}

/// Root-mean-square simulation errors of an output, SI.
#[derive(Debug, Clone)]
pub struct Gap {
    /// The output.
    pub output: String,
    /// Its unit.
    pub unit: Unit,
    /// Standard deviation of its white noise, from the data.
    pub noise: f64,
    /// Base model, refitted, on the data it was fitted to.
    pub train_before: f64,
    /// Corrected model on the same.
    pub train_after: f64,
    /// Base model on validation data.
    pub valid_before: f64,
    /// Corrected model on validation data.
    pub valid_after: f64,
    /// The condition that coincides with the windows in which errors of the base model stand out, in all training
    /// recordings.
    pub condition: Option<Condition>,
}

/// Measured and simulated outputs of a recording.
#[derive(Debug, Clone)]
pub struct RecordingTrace {
    /// What the recording is called.
    pub name: String,
    /// Whether it was kept out of the fits.
    pub held_out: bool,
    /// The time from which its readings count in the errors of validation data, s; `None` where all do, and of
    /// training recordings.
    pub counts_from: Option<f64>,
    /// Times, s.
    pub times: Vec<f64>,
    /// The measured outputs.
    pub outputs: Vec<OutputTrace>,
}

/// One output of a recording, SI.
#[derive(Debug, Clone)]
pub struct OutputTrace {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: Unit,
    /// Standard deviation of its white noise.
    pub noise: f64,
    /// Measured; NaN where missing.
    pub measured: Vec<f64>,
    /// Simulated by the base model, refitted.
    pub before: Vec<f64>,
    /// Simulated by the corrected model.
    pub after: Vec<f64>,
    /// Where the base model's misfit stands out from the noise.
    pub windows: Vec<Window>,
}

/// A structure that was refitted.
#[derive(Debug, Clone)]
pub struct Ranked {
    /// Names of its effects.
    pub effects: Vec<String>,
    /// Mean square of the training errors over the noise; 1 is perfect.
    pub train: f64,
    /// The same of validation data; `None` where it cannot be simulated.
    pub valid: Option<f64>,
    /// Bayesian information criterion relative to the base model; negative is better.
    pub bic: f64,
    /// What there is to say about it.
    pub note: String,
}

impl Ranked {
    /// An effect that could not be tried.
    pub(crate) fn refused(name: &str, why: &str) -> Self {
        Self {
            effects: vec![name.to_owned()],
            train: f64::NAN,
            valid: None,
            bic: f64::NAN,
            note: why.to_owned(),
        }
    }
}

/// What a candidate promised.
#[derive(Debug, Clone)]
pub struct Screened {
    /// Its name.
    pub name: String,
    /// Share of the base model's excess error that it would take away, to first order.
    pub share: f64,
}
