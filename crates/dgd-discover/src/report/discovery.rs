//! The result of a discovery.

use dgd_runtime::Unit;

use super::power::DetectionPower;
use crate::conditions::WindowCondition;
use crate::guess::{CorrelatedQuantity, FormulaGuess, LawRange};
use crate::law::LawTerm;
use crate::missing_input::{ClosedPlace, MissingInput};
use crate::noise::SignalWindow;
use crate::search::{Alternative, Evidence, Verdict};

/// The result of a discovery, with everything that a report shows.
#[derive(Debug, Clone)]
pub struct Discovery {
    /// The verdict.
    pub verdict: Verdict,
    /// The reason for the verdict, in a sentence or two.
    pub reason: String,
    /// Probability that, with nothing missing, the best of the library promises as much as it does in the base model:
    /// uniformly distributed if nothing is missing. That of the templates if there is no library; `None` if nothing
    /// could be tried.
    pub p_value: Option<f64>,
    /// Effects of the library that cannot be tried: names and reasons.
    pub left_out: Vec<(String, String)>,
    /// Single candidates whose fits were abandoned, and the reason.
    pub given_up: Option<(Vec<String>, String)>,
    /// Number of isolated outliers of each output that were left out.
    pub lonely: Vec<usize>,
    /// Outputs whose noise grows with them, or differs between readings or recordings: their errors are weighted, and
    /// mean squares, noise and gaps are those at a usual reading.
    pub uneven: Vec<String>,
    /// Whether the time budget ran out before everything was tried.
    pub is_cut_short: bool,
    /// Templates that were not tried: names and reasons.
    pub not_tried: Vec<(String, String)>,
    /// Identified effects, in the order in which they were found.
    pub effects: Vec<FoundEffect>,
    /// The terms that were missing, with the verdict [`Verdict::Law`].
    pub law: Option<FoundLaw>,
    /// Laws in different equations that explain the recordings equally well, with the verdict
    /// [`Verdict::Unexplained`].
    pub rivals: Vec<RivalLaw>,
    /// The condition outside which the base model explains the recordings, with the verdict
    /// [`Verdict::Unexplained`].
    pub regime: Option<FoundRegime>,
    /// Wrong numbers of the model's text and faults of the recordings, with the verdict [`Verdict::Plain`].
    pub plain: Option<PlainCauses>,
    /// Effects that resemble the discrepancy but did not pass the tests.
    pub described: Vec<ResemblingEffect>,
    /// Discrepancies that no known effect removes: places, the most likely first.
    pub unexplained: Vec<UnexplainedError>,
    /// If nothing is missing: the smallest effects of the library that would have been detected.
    pub power: Vec<DetectionPower>,
    /// For each output, the simulation error before and after.
    pub gap: Vec<OutputGap>,
    /// For each recording, measured and simulated outputs.
    pub traces: Vec<RecordingTrace>,
    /// The missing input at each place of the base model, in the first training recording, the most likely first.
    pub missing: Vec<MissingInput>,
    /// Places that could not be examined.
    pub closed: Vec<ClosedPlace>,
    /// Why no place could be examined.
    pub nowhere: Option<String>,
    /// All structures that were refitted, the best first.
    pub ranking: Vec<RankedStructure>,
    /// The promise of each candidate alone before it was refitted, the best first.
    pub screened: Vec<ScreenedCandidate>,
    /// Parameters of the base model, refitted.
    pub base_parameters: Vec<ParameterValue>,
    /// Parameters of the corrected model, those of the base model first.
    pub corrected_parameters: Vec<ParameterValue>,
    /// The corrected model's text; that of the base model with refitted parameters if nothing was found.
    pub corrected: String,
}

impl Discovery {
    /// Whether the corrected model differs from the base model.
    pub fn is_corrected(&self) -> bool {
        !self.effects.is_empty() || self.law.is_some() || self.plain.is_some()
    }
}

/// An identified effect.
#[derive(Debug, Clone)]
pub struct FoundEffect {
    /// Its family.
    pub name: String,
    /// `plant`, `sensor` or `input`.
    pub kind: &'static str,
    /// Its realisation, if the family has several.
    pub form: Option<String>,
    /// Its doc comment.
    pub doc: Vec<String>,
    /// The equation, output or input that it changes.
    pub target: String,
    /// Effects that the data cannot distinguish from it.
    pub alternatives: Vec<Alternative>,
    /// Other realisations of it that were fitted, the best first.
    pub other_forms: Vec<Alternative>,
    /// The measurement or test that would distinguish it from its alternatives; `None` without any.
    pub told_apart_by: Option<String>,
    /// Its onset, s, if it has one.
    pub onset: Option<f64>,
    /// Windows in which it is active in the first training recording, s.
    pub windows: Vec<[f64; 2]>,
    /// The condition under which it is active, in all training recordings.
    pub condition: Option<WindowCondition>,
    /// The parameters it brings.
    pub parameters: Vec<ParameterValue>,
    /// The evidence for it.
    pub evidence: Evidence,
}

/// Terms that equations lacked, found without a library.
#[derive(Debug, Clone)]
pub struct FoundLaw {
    /// The terms.
    pub terms: Vec<LawTerm>,
    /// Recorded ranges of the quantities that they read, SI.
    pub ranges: Vec<LawRange>,
    /// Other formulas that leave no more than noise.
    pub near: Vec<NearForm>,
}

/// A formula that explains the recordings about as well as a law.
#[derive(Debug, Clone)]
pub struct NearForm {
    /// The formula, with its equations.
    pub formula: String,
    /// Its root-mean-square residual relative to that of the law.
    pub ratio: f64,
}

/// A base model that explains the recordings except while a condition holds.
#[derive(Debug, Clone)]
pub struct FoundRegime {
    /// The condition.
    pub condition: WindowCondition,
    /// Mean square of the residuals relative to the noise where it does not hold, of the output that stands out most …
    pub outside: f64,
    /// … and where it holds, with the same parameters.
    pub inside: f64,
    /// Parameters of the base model from where it does not hold.
    pub parameters: Vec<ParameterValue>,
}

/// A law, or effects, that explain the recordings as well as a law in other equations does.
#[derive(Debug, Clone)]
pub struct RivalLaw {
    /// The terms.
    pub terms: Vec<LawTerm>,
    /// Names of the effects, if it has no terms.
    pub effects: Vec<String>,
    /// Mean square of the residuals relative to the noise: of training data, and of validation data.
    pub left: (f64, Option<f64>),
    /// The measurement that separates it from the first; `None` for the first.
    pub told_apart_by: Option<String>,
}

/// Wrong numbers of the model's text and faults of the recordings; no effect is missing.
#[derive(Debug, Clone)]
pub struct PlainCauses {
    /// The cause, then those that the recordings cannot distinguish from it.
    pub causes: Vec<PlainCause>,
    /// Effects that the recordings cannot distinguish from it.
    pub effects: Vec<String>,
}

/// Something that is wrong.
#[derive(Debug, Clone)]
pub struct PlainCause {
    /// Its kind.
    pub kind: PlainKind,
    /// Its name.
    pub name: String,
    /// The column that it is exchanged with.
    pub with: Option<String>,
    /// A number's value in the text, SI.
    pub declared: Option<f64>,
    /// The value of a number that fits the recordings; of a clock, recorded seconds per true second.
    pub value: Option<ParameterValue>,
    /// The unit that is declared for the numbers of a column.
    pub unit: Option<String>,
    /// The unit in which the number of the text, or the numbers of a column, would be right, if there is one; for an
    /// input, the interpolation that would be right.
    pub meant_in: Option<String>,
    /// The values of the recordings, if these differ or begin elsewhere.
    pub values: Vec<RecordingsValue>,
    /// The recordings in which a column is stuck; readings from then on are left out.
    pub since: Vec<StuckSince>,
}

/// A recording in which a column stays at one value to the end.
#[derive(Debug, Clone)]
pub struct StuckSince {
    /// Name of the recording.
    pub recording: String,
    /// The last time at which the column was read, s.
    pub time: f64,
    /// The value at which it stays.
    pub value: ParameterValue,
}

/// A value that some recordings have, and others do not.
#[derive(Debug, Clone)]
pub struct RecordingsValue {
    /// Names of the training recordings.
    pub recordings: Vec<String>,
    /// Names of the validation recordings that it explains best.
    pub held_out: Vec<String>,
    /// The value, with the unit of differences for an offset; a declared value has no standard deviation.
    pub value: ParameterValue,
}

/// The kind of a [`PlainCause`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlainKind {
    /// A constant.
    Constant,
    /// A parameter that is not estimated.
    Parameter,
    /// The unit of a recorded column.
    Unit,
    /// Two recorded columns, which are exchanged.
    Exchanged,
    /// The interpolation of an input.
    Interpolation,
    /// The unit of time, or the rate of the clock.
    Clock,
    /// A start value that is held where recordings begin elsewhere.
    Start,
    /// A column that stays at one value from some moment on.
    Stuck,
    /// A number of the model that differs between recordings.
    DiffersNumber,
    /// The offset of a sensor that differs between recordings.
    DiffersOffset,
    /// The rate of the clock that differs between recordings.
    DiffersClock,
}

impl PlainKind {
    /// The word in `result.json`.
    pub fn word(self) -> &'static str {
        match self {
            PlainKind::Constant => "constant",
            PlainKind::Parameter => "parameter",
            PlainKind::Unit => "unit",
            PlainKind::Exchanged => "exchanged",
            PlainKind::Interpolation => "interpolation",
            PlainKind::Clock => "clock",
            PlainKind::Start => "start",
            PlainKind::Stuck => "stuck",
            PlainKind::DiffersNumber => "number_differs",
            PlainKind::DiffersOffset => "offset_differs",
            PlainKind::DiffersClock => "clock_differs",
        }
    }
}

/// An effect that resembles the discrepancy without explaining it.
#[derive(Debug, Clone)]
pub struct ResemblingEffect {
    /// Its name, with its arguments.
    pub name: String,
    /// `plant`, `sensor` or `input`.
    pub kind: &'static str,
    /// Its realisation, if there are several.
    pub form: Option<String>,
    /// The equation, parameter, output or input that it changes.
    pub target: String,
    /// Its parameters in the fit.
    pub parameters: Vec<ParameterValue>,
    /// Mean square of the residuals relative to the noise with all described effects: of training data, and of
    /// validation data if there is any.
    pub left: (f64, Option<f64>),
    /// Its text with the fitted values, as `--apply` accepts it.
    pub file: String,
    /// The arguments to which it is applied.
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
    /// Standard deviation, SI; `None` if the data does not determine it.
    pub std: Option<f64>,
    /// Standard deviation due to remaining model error, SI: the spread over parts of the training recordings and over
    /// structures that do nearly as well. `None` if nothing remains, or if it is unknown.
    pub std_model: Option<f64>,
}

/// A discrepancy without a name.
#[derive(Debug, Clone)]
pub struct UnexplainedError {
    /// The place: an equation's label, a parameter, an input or `sensor NAME`.
    pub target: String,
    /// Whether its likelihood is tied with that of the best place.
    pub is_tied: bool,
    /// Whether it lacks something together with the other places for which this is true.
    pub is_joint: bool,
    /// Mean square of the residuals relative to the noise with a free input there, in simulations of the training
    /// recordings, where no output counts as more than its readings vary; `None` for a remainder.
    pub left: Option<f64>,
    /// The reason why it is implausible.
    pub objection: Option<String>,
    /// The measurement that separates it from the best place, if the two are tied.
    pub told_apart_by: Option<String>,
    /// Gain in the log-likelihood of the readings.
    pub gain: f64,
    /// Windows in the first training recording.
    pub windows: Vec<[f64; 2]>,
    /// The condition that coincides with these windows, in all training recordings.
    pub condition: Option<WindowCondition>,
    /// A description in words.
    pub description: String,
    /// The missing input.
    pub trace: MissingInput,
    /// Quantities that correlate with it, the closest first: where to look.
    pub together: Vec<CorrelatedQuantity>,
    /// A formula that resembles it, if the verdict is `unexplained` and there is a simple one.
    pub guess: Option<FormulaGuess>,
}

/// Root-mean-square simulation errors of an output, SI.
#[derive(Debug, Clone)]
pub struct OutputGap {
    /// The output.
    pub output: String,
    /// Its unit.
    pub unit: Unit,
    /// Standard deviation of its white noise, from the data.
    pub noise: f64,
    /// Refitted base model on training data.
    pub train_before: f64,
    /// Corrected model on training data.
    pub train_after: f64,
    /// Base model on validation data.
    pub valid_before: f64,
    /// Corrected model on validation data.
    pub valid_after: f64,
    /// The condition that coincides with the windows in which errors of the base model stand out, in all training
    /// recordings.
    pub condition: Option<WindowCondition>,
}

/// Measured and simulated outputs of a recording.
#[derive(Debug, Clone)]
pub struct RecordingTrace {
    /// Name of the recording.
    pub name: String,
    /// Whether it is a validation recording.
    pub held_out: bool,
    /// Time from which its readings count in the errors of validation data, s; `None` if all do, and for training
    /// recordings.
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
    /// Simulated by the refitted base model.
    pub before: Vec<f64>,
    /// Simulated by the corrected model.
    pub after: Vec<f64>,
    /// Windows in which the base model's misfit stands out from the noise.
    pub windows: Vec<SignalWindow>,
}

/// A structure that was refitted.
#[derive(Debug, Clone)]
pub struct RankedStructure {
    /// Names of its effects.
    pub effects: Vec<String>,
    /// Mean square of the training errors relative to the noise; 1 is perfect.
    pub train: f64,
    /// Mean square of the validation errors relative to the noise; `None` if they cannot be simulated.
    pub valid: Option<f64>,
    /// Bayesian information criterion relative to the base model; negative is better.
    pub bic: f64,
    /// A remark about it.
    pub note: String,
}

impl RankedStructure {
    /// The entry of an effect that could not be tried.
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

/// The promise of a candidate in the screen.
#[derive(Debug, Clone)]
pub struct ScreenedCandidate {
    /// Its name.
    pub name: String,
    /// Fraction of the base model's excess error that it would remove, to first order.
    pub share: f64,
}
