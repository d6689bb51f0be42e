//! A comparison of fits.

use serde::{Deserialize, Serialize};

use super::ByName;
use super::fit::{EstimateEntry, FitStatus};
pub use crate::output::agreement::Agreement;
use crate::output::provenance::Provenance;

/// `dgd compare`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "compare"))]
#[non_exhaustive]
pub struct CompareDocument {
    /// Fitted contenders, in the order of the request.
    pub contenders: Vec<ContenderEntry>,
    /// Contenders that could not be fitted.
    pub failed: Vec<FailedEntry>,
    /// Training samples of all outputs.
    pub samples: usize,
    /// Tests of contenders against their special cases.
    pub likelihood_ratios: Vec<LikelihoodRatioEntry>,
    /// The best contenders.
    pub least: BestContenders,
    /// Inputs, seed and versions.
    pub provenance: Provenance,
}

/// A fitted contender.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ContenderEntry {
    /// As in the request.
    pub name: String,
    /// The model file.
    pub model: String,
    /// Digest of the model.
    pub model_digest: Option<String>,
    /// Choices of variants.
    pub variants: Vec<String>,
    /// Applied effects.
    pub effects: Vec<String>,
    /// Whether the fit converged.
    pub converged: bool,
    /// The outcome of the fit.
    pub status: FitStatus,
    /// Estimated parameters.
    pub parameters: ByName<EstimateEntry>,
    /// Number of parameters, initial values, and a noise for each output.
    pub estimates: usize,
    /// −2 ln L of the training samples; null if an output is matched exactly.
    pub deviance: Option<f64>,
    /// Akaike's criterion.
    pub aic: Option<f64>,
    /// Schwarz's criterion.
    pub bic: Option<f64>,
    /// Akaike's criterion minus that of the best contender.
    pub aic_above_least: Option<f64>,
    /// Schwarz's criterion minus that of the best contender.
    pub bic_above_least: Option<f64>,
    /// Geometric mean over the outputs of root-mean-square errors relative to those of the first contender.
    pub relative_error: RelativeError,
    /// Errors in the unit of the first contender, over the samples that count for all.
    pub outputs: ByName<ContenderOutput>,
}

/// Errors relative to those of the first contender.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct RelativeError {
    /// In training.
    pub train: Option<f64>,
    /// In validation.
    pub valid: Option<f64>,
}

/// Errors of an output of a contender.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ContenderOutput {
    /// Symbol of the unit.
    pub unit: String,
    /// In training.
    pub train: Option<Agreement>,
    /// In validation.
    pub valid: Option<Agreement>,
}

/// A contender that could not be fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct FailedEntry {
    /// As in the request.
    pub name: String,
    /// The reason.
    pub reason: String,
}

/// The test of a contender against a special case of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LikelihoodRatioEntry {
    /// Name of the special case.
    pub null: String,
    /// Name of the general contender.
    pub alternative: String,
    /// The fall of −2 ln L.
    pub statistic: f64,
    /// The number of additional estimates.
    pub degrees_of_freedom: usize,
    /// Probability of such a fall by chance.
    pub p_value: f64,
}

/// Names of the best contenders.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct BestContenders {
    /// The contender with the smallest value of Akaike's criterion.
    pub aic: Option<String>,
    /// The contender with the smallest value of Schwarz's criterion.
    pub bic: Option<String>,
    /// The contender with the smallest relative errors in validation.
    pub valid: Option<String>,
}
