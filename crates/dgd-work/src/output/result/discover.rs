//! A discovery. Residuals and noise are differences, whose units have no offset: `bar` for an output in `bara`, `K` for
//! one in `°C`.

use serde::{Deserialize, Serialize};

use super::ByName;
use crate::output::provenance::Provenance;

/// `dgd discover`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "discover"))]
#[non_exhaustive]
pub struct DiscoverDocument {
    /// `sufficient`, `plain`, `effects`, `law` or `unexplained`.
    pub verdict: String,
    /// The reason for the verdict.
    pub reason: String,
    /// Probability of the discrepancy by chance.
    pub p_value: Option<f64>,
    /// Reasons to doubt that the recordings can answer.
    pub reservations: Vec<String>,
    /// Name of the model.
    pub model: String,
    /// The file of the model, as given.
    pub model_file: String,
    /// Named effects.
    pub effects: Vec<EffectEntry>,
    /// The terms that equations lack, with the verdict `law`; they belong to the right-hand sides.
    pub law: Option<LawEntry>,
    /// A condition outside which the model holds.
    pub regime: Option<RegimeEntry>,
    /// Other laws and effects that explain the recordings as well.
    pub rivals: Vec<RivalEntry>,
    /// Wrong constants of the model and faults of the recordings, with the verdict `plain`.
    pub plain: Option<PlainResult>,
    /// Effects that only describe the discrepancy.
    pub described: Vec<DescribedEntry>,
    /// Places that lack something without a name.
    pub unexplained: Vec<UnexplainedEntry>,
    /// Places that were not tried.
    pub places_not_tried: Vec<UntriedPlace>,
    /// The smallest effects that the recordings would have shown.
    pub power: Vec<PowerEntry>,
    /// Errors of each output before and after the correction.
    pub gap: ByName<GapEntry>,
    /// Parameters of the corrected model.
    pub parameters: ByName<FoundParameter>,
    /// Parameters of the base model.
    pub base_parameters: ByName<FoundParameter>,
    /// All recordings.
    pub recordings: Vec<UsedRecording>,
    /// The time from which readings of each validation recording count, s; null if all count.
    pub counts_from: Vec<Option<f64>>,
    /// Sets of effects, the best first.
    pub ranking: Vec<RankedEntry>,
    /// All effects, with the share of the discrepancy that they can take.
    pub screened: Vec<ScreenedEntry>,
    /// Effects that were not tried.
    pub not_tried: Vec<UntriedEffect>,
    /// Inputs, seed and versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub provenance: Option<Provenance>,
}

/// A named effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct EffectEntry {
    /// Name with arguments.
    pub name: String,
    /// `plant`, `sensor` or `input`.
    pub kind: String,
    /// The choice of its form.
    pub form: Option<String>,
    /// The equation, output or input.
    pub target: String,
    /// Effects that explain the recordings nearly as well.
    pub alternatives: Vec<AlternativeEntry>,
    /// Other forms of the effect.
    pub other_forms: Vec<FormEntry>,
    /// A test that would separate it from the alternatives.
    pub told_apart_by: Option<String>,
    /// Its onset, s.
    pub onset: Option<f64>,
    /// Times at which it acts, s.
    pub windows: Vec<[f64; 2]>,
    /// The condition that coincides with the windows.
    pub condition: Option<ConditionEntry>,
    /// Its parameters.
    pub parameters: ByName<FoundParameter>,
    /// The evidence for it.
    pub evidence: EvidenceEntry,
}

/// An effect that explains the recordings nearly as well.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct AlternativeEntry {
    /// Name with arguments.
    pub name: String,
    /// The choice of its form.
    pub form: Option<String>,
    /// Its validation error relative to that of the named effect.
    pub valid_ratio: Option<f64>,
}

/// Another form of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct FormEntry {
    /// The choice.
    pub form: Option<String>,
    /// Its validation error relative to that of the named form.
    pub valid_ratio: Option<f64>,
}

/// The evidence for an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct EvidenceEntry {
    /// Probability that the best of the library gains as much if nothing is missing.
    pub p_value: Option<f64>,
    /// Number of resamples behind it.
    pub resamples: usize,
    /// Decrease of the Bayesian information criterion.
    pub bic_gain: Option<f64>,
    /// Share of resamples whose best structure has the effect.
    pub inclusion: Option<f64>,
}

/// A condition that coincides with windows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ConditionEntry {
    /// The quantity.
    pub quantity: String,
    /// `above`, `below`, `rising`, `falling`, `changing` or `mode`.
    pub kind: String,
    /// The mode of an automaton.
    pub mode: Option<String>,
    /// In the unit.
    pub threshold: Option<f64>,
    /// Of the quantity, or of its slope.
    pub unit: String,
    /// The interval over which the slope is taken, s.
    pub over: Option<f64>,
    /// Share of the windows in which it holds.
    pub share_inside: Option<f64>,
    /// Share of the rest in which it holds.
    pub share_outside: Option<f64>,
    /// Probability that windows at random times coincide as well.
    pub p_value: Option<f64>,
}

/// A parameter in its unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct FoundParameter {
    /// In the unit.
    pub value: Option<f64>,
    /// Symbol of the unit.
    pub unit: String,
    /// Standard deviation.
    pub std: Option<f64>,
    /// How far model error may have moved it: the spread over parts of the recordings and over models that do nearly as well; null without model error.
    pub std_model: Option<f64>,
}

/// A law in the language of models.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LawEntry {
    /// Its terms.
    pub terms: Vec<LawTermEntry>,
    /// The recorded range of each quantity.
    pub range: ByName<RangeEntry>,
    /// Forms that nearly coincide over this range.
    pub near: Vec<NearEntry>,
}

/// A term of a law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LawTermEntry {
    /// The equation or parameter.
    pub target: String,
    /// Its formula.
    pub formula: String,
    /// Its constants.
    pub coefficients: Vec<CoefficientEntry>,
}

/// A constant of a formula.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct CoefficientEntry {
    /// In the formula.
    pub name: String,
    /// In the unit.
    pub value: Option<f64>,
    /// Symbol of the unit.
    pub unit: String,
    /// Standard deviation.
    pub std: Option<f64>,
}

/// A recorded range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct RangeEntry {
    /// The lowest value.
    pub low: Option<f64>,
    /// The highest value.
    pub high: Option<f64>,
    /// Symbol of the unit.
    pub unit: String,
}

/// A form close to a law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct NearEntry {
    /// Its formula.
    pub formula: String,
    /// Its residuals relative to those of the law.
    pub ratio: Option<f64>,
}

/// A law, or effects, that explain the recordings as well.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct RivalEntry {
    /// Terms of a law.
    pub terms: Vec<LawTermEntry>,
    /// Names of effects.
    pub effects: Vec<String>,
    /// The noise variance that it leaves, as a multiple.
    pub left: LeftEntry,
    /// A test that would separate it.
    pub told_apart_by: Option<String>,
}

/// Residual variance as a multiple of the noise variance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LeftEntry {
    /// In training.
    pub train: Option<f64>,
    /// In validation.
    pub valid: Option<f64>,
}

/// A condition outside which the model holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct RegimeEntry {
    /// The condition.
    pub condition: Option<ConditionEntry>,
    /// Residual variance as a multiple of the noise variance.
    pub left: RegimeLeft,
    /// Parameters of the model outside.
    pub parameters: ByName<FoundParameter>,
}

/// Residual variance outside and inside a regime, as multiples of the noise variance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct RegimeLeft {
    /// Outside.
    pub outside: Option<f64>,
    /// Inside.
    pub inside: Option<f64>,
}

/// Wrong constants and faults of recordings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct PlainResult {
    /// The cause, then those that the recordings cannot separate from it.
    pub causes: Vec<CauseEntry>,
    /// Effects that the recordings cannot separate from it.
    pub effects: Vec<String>,
}

/// A wrong constant or a fault of the recordings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct CauseEntry {
    /// `constant`, `parameter`, `unit`, `exchanged`, `interpolation`, `clock`, `start`, `stuck`, `number_differs`, `offset_differs` or
    /// `clock_differs`.
    pub kind: String,
    /// Of the constant, column or clock.
    pub name: String,
    /// The column that it is exchanged with.
    pub with: Option<String>,
    /// The number in the model.
    pub declared: Option<f64>,
    /// The number that fits; of a clock, recorded seconds for each true one.
    pub value: Option<f64>,
    /// Its standard deviation.
    pub std: Option<f64>,
    /// Symbol of the unit.
    pub unit: Option<String>,
    /// The unit in which the number, or the column, would be right; for an input, `hold` or `linear`.
    pub meant_in: Option<String>,
    /// The recordings in which a column is stuck.
    pub since: Vec<StuckEntry>,
    /// The value in each group of recordings that differ.
    pub values: Vec<GroupValue>,
}

/// A stuck column.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct StuckEntry {
    /// The recording.
    pub recording: String,
    /// The last time at which it was read, s.
    pub time: Option<f64>,
    /// In its unit.
    pub value: Option<f64>,
}

/// The value in a group of recordings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct GroupValue {
    /// Training recordings.
    pub recordings: Vec<String>,
    /// Validation recordings that this value explains best.
    pub held_out: Vec<String>,
    /// In its unit.
    pub value: Option<f64>,
    /// Null for the value of the model.
    pub std: Option<f64>,
}

/// An effect that only describes the discrepancy.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct DescribedEntry {
    /// Name with arguments.
    pub name: String,
    /// `plant`, `sensor` or `input`.
    pub kind: String,
    /// The choice of its form.
    pub form: Option<String>,
    /// The equation, output or input.
    pub target: String,
    /// Its parameters.
    pub parameters: ByName<FoundParameter>,
    /// Residual variance as a multiple of the noise variance.
    pub left: LeftEntry,
    /// Its file beside the result.
    pub file: String,
    /// What applies it to the model.
    pub apply: String,
}

/// A place that lacks something without a name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct UnexplainedEntry {
    /// The equation, parameter, input or output.
    pub target: String,
    /// `equation`, `parameter`, `input` or `sensor`.
    pub kind: String,
    /// Whether another place explains the recordings as well.
    pub tied: bool,
    /// Whether it explains them together with other places only.
    pub joint: bool,
    /// Residual variance as a multiple of the noise variance.
    pub left: Option<f64>,
    /// A reason against it.
    pub objection: Option<String>,
    /// A test that would separate it.
    pub told_apart_by: Option<String>,
    /// The share of the discrepancy that it takes.
    pub gain: Option<f64>,
    /// Times at which it acts, s.
    pub windows: Vec<[f64; 2]>,
    /// The condition that coincides with the windows.
    pub condition: Option<ConditionEntry>,
    /// Quantities with a similar course.
    pub together: Vec<CourseEntry>,
    /// The file of its trace.
    pub trace: String,
    /// In words.
    pub description: String,
    /// A formula for its trace.
    pub guess: Option<GuessEntry>,
    /// The formula as an effect file.
    pub law: Option<LawFile>,
}

/// A quantity whose course resembles that of a missing term.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct CourseEntry {
    /// The quantity.
    pub quantity: String,
    /// `rises`, `falls` or `turns`.
    pub course: String,
    /// R² on held-out data.
    pub r2_held_out: Option<f64>,
    /// The held-out data: `recordings`, or `parts` of them.
    pub held_out: String,
}

/// A formula for the trace of a missing term.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct GuessEntry {
    /// In the language of models.
    pub formula: String,
    /// Its terms.
    pub coefficients: Vec<GuessTermEntry>,
    /// R² on held-out data.
    pub r2_held_out: Option<f64>,
    /// The held-out data: `recordings`, or `parts` of them.
    pub held_out: String,
    /// Residual variance without it, as a multiple of the noise variance.
    pub left_before: Option<f64>,
    /// Residual variance with it.
    pub left_after: Option<f64>,
}

/// A term of a guess.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct GuessTermEntry {
    /// Its coefficient.
    pub value: Option<f64>,
    /// Unit of the coefficient.
    pub unit: String,
    /// Standard deviation.
    pub std: Option<f64>,
    /// The factor of the coefficient.
    pub factor: String,
}

/// A guess as an effect file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LawFile {
    /// Beside the result.
    pub file: String,
    /// Its formula.
    pub formula: String,
    /// Its constants.
    pub parameters: Vec<CoefficientEntry>,
    /// The recorded range of each quantity.
    pub range: ByName<RangeEntry>,
}

/// A place that was not tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct UntriedPlace {
    /// The place.
    pub target: String,
    /// The reason.
    pub reason: String,
}

/// The smallest effect that the recordings would have shown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct PowerEntry {
    /// Name with arguments.
    pub name: String,
    /// Its parameter.
    pub parameter: String,
    /// In the unit.
    pub smallest: Option<f64>,
    /// Symbol of the unit.
    pub unit: String,
}

/// Root-mean-square errors of an output before and after the correction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct GapEntry {
    /// Symbol of the unit.
    pub unit: String,
    /// Standard deviation of the noise.
    pub noise: Option<f64>,
    /// In training.
    pub train_before: Option<f64>,
    /// In training.
    pub train_after: Option<f64>,
    /// In validation.
    pub valid_before: Option<f64>,
    /// In validation.
    pub valid_after: Option<f64>,
    /// The condition that coincides with its errors.
    pub condition: Option<ConditionEntry>,
}

/// A recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct UsedRecording {
    /// Its name.
    pub name: String,
    /// Whether it is used for validation only.
    pub held_out: bool,
    /// The time from which its readings count, s; null if all count.
    pub counts_from: Option<f64>,
}

/// A set of effects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct RankedEntry {
    /// Their names.
    pub effects: Vec<String>,
    /// Residual variance in training, as a multiple of the noise variance.
    pub train: Option<f64>,
    /// In validation.
    pub valid: Option<f64>,
    /// Bayesian information criterion.
    pub bic: Option<f64>,
    /// A remark; empty for the chosen set.
    pub note: String,
}

/// An effect and the share of the discrepancy that it can take.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ScreenedEntry {
    /// Name with arguments.
    pub name: String,
    /// The share that the screen estimates.
    pub share: Option<f64>,
}

/// An effect that was not tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct UntriedEffect {
    /// Name with arguments.
    pub name: String,
    /// The reason.
    pub reason: String,
}
