//! Estimates parameters and initial values from recordings, and validates them on others.
//!
//! ```text
//!   FitRequest ─ task ─► recordings and problem ─┬─ output_error (and linear models)
//!                                                ├─ prediction_error (filters)      ─► report ─► FitResult
//!                                                └─ regress (equations)
//! ```

pub mod compare;
mod estimator;
pub(crate) mod fitted_model;
mod multi_start;
pub mod objective;
mod output_error;
pub(crate) mod page;
mod prediction_error;
mod refit;
mod regress;
pub(crate) mod report;
mod task;

use std::path::{Path, PathBuf};

use dgd_compiler::model::Setting;
use dgd_compiler::pipeline::CompiledStages;
use dgd_compiler::source::SourceMap;
use dgd_data::files::ResultFolder;
use dgd_data::files::journal::RunJournal;
use dgd_identify::ParameterEstimate;
use dgd_plot::Figure;
use dgd_runtime::Signature;
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use crate::error::{TaskEnd, UsageError, WorkError};
use crate::output::json_text;
use crate::output::provenance::Provenance;
use crate::request::{EstimationApproach, Estimator, FitRequest};
use crate::result::fit::FitDocument;
use crate::run::keeping;
use crate::session::TaskContext;
use page::traces::PageTrace;
use report::intervals::{IntervalEstimates, Intervals};
use report::left_out::IncompleteFit;
use task::FitSetup;

pub use fitted_model::file_names;

/// Estimates, their uncertainty, and the fitted model.
#[non_exhaustive]
pub struct FitResult {
    /// The estimator.
    pub estimator: Estimator,
    /// The estimates, SI: parameters, and initial values of recordings.
    pub estimates: Vec<ParameterEstimate>,
    /// Figures, if requested.
    pub figures: Vec<FitFigure>,
    /// Reasons why the estimates are incomplete; empty for a fit that converged.
    pub left_out: Vec<String>,
    /// Versions and digests of the inputs.
    pub provenance: Provenance,
    result: FitDocument,
    text: String,
    more: Vec<(String, Vec<u8>)>,
    traces: Vec<PageTrace>,
    signature: Signature,
    command: String,
    end: IncompleteFit,
    model: PathBuf,
    compiled: CompiledStages,
    sources: SourceMap,
    settings: Vec<Setting>,
    journal: Option<RunJournal>,
}

/// A figure of a fit.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct FitFigure {
    /// The estimate of a profile; `None` for a figure of the recordings.
    pub of: Option<String>,
    /// The figure.
    pub figure: Figure,
}

impl FitFigure {
    /// The figures of profiles.
    fn of_profiles(
        intervals: &Intervals,
        outcome: &dyn IntervalEstimates,
    ) -> impl Iterator<Item = FitFigure> {
        let figures = intervals.figures(outcome).into_iter();
        figures.map(|(name, figure)| FitFigure { of: Some(name), figure })
    }
}

/// The result of an estimator.
struct EstimatorResult {
    result: FitDocument,
    text: String,
    figures: Vec<FitFigure>,
    estimates: Vec<ParameterEstimate>,
    /// The recordings with their simulations.
    traces: Vec<PageTrace>,
    /// Files in addition to the result and the model.
    more: Vec<(String, Vec<u8>)>,
    left_out: IncompleteFit,
}

/// Fits a model to recordings.
///
/// # Errors
///
/// [`WorkError`]. A fit that does not converge, or is cancelled, returns a result with that status.
pub fn fit(request: &FitRequest, session: TaskContext<'_>) -> Result<FitResult, WorkError> {
    keeping::verify(&request.keep)?;
    let estimator = request.regression.estimator;
    let place = request.regression.place()?;
    let mut task = FitSetup::load(request, session)?;
    // Builds without the other estimators leave this out.
    let has_all = cfg!(feature = "estimators");
    if let Some(place) = place.filter(|_| has_all) {
        task.linearise(place);
    }
    let task = task;
    request.search.verify(estimator)?;
    request.regression.verify_evaluations(request.evaluations)?;
    request.intervals.verify(estimator, dgd_runtime::System::signature(&task.system))?;
    let result = match estimator.approach() {
        EstimationApproach::Simulation => output_error::run(&task, request, place),
        _ if !has_all => Err(UsageError::EstimatorNotBuilt(estimator).into()),
        EstimationApproach::LinearSimulation => output_error::run(&task, request, place),
        EstimationApproach::Filter => prediction_error::run(&task, request),
        EstimationApproach::Regression(method) => regress::run(&task, request, Some(method)),
        EstimationApproach::RecursiveRegression => regress::run(&task, request, None),
    }?;
    Ok(FitResult {
        estimator,
        estimates: result.estimates,
        figures: result.figures,
        left_out: result.left_out.all().to_vec(),
        result: result.result,
        provenance: task.provenance,
        text: result.text,
        more: result.more,
        traces: result.traces,
        signature: dgd_runtime::System::signature(&task.system).clone(),
        command: request.command.clone(),
        end: result.left_out,
        model: request.model.clone(),
        compiled: task.compiled,
        sources: task.sources,
        settings: task.options_of_model.settings,
        journal: task.journal,
    })
}

impl FitResult {
    /// The result, for programs.
    pub fn result(&self) -> &FitDocument {
        &self.result
    }

    /// `result.json`.
    pub fn to_json(&self) -> Value {
        json!(self.result)
    }

    /// Tables and remarks.
    pub fn to_text(&self) -> &str {
        &self.text
    }

    /// Text of the fitted model for this folder, with paths of imports relative to it.
    pub fn model_text(&self, folder: &Path) -> String {
        fitted_model::text(
            &self.compiled,
            &self.sources,
            &self.settings,
            &self.estimates,
            &self.model,
            folder,
        )
    }

    /// `report.html`: the quality of the fit and how far to trust it.
    pub fn page(&self) -> String {
        page::write(self)
    }

    /// The files of a folder of results: [`file_names`].
    pub fn files(&self, folder: &Path) -> ResultFolder {
        let name = fitted_model::file_name(&self.model);
        let json = json_text(&self.to_json());
        let mut written = vec![
            (name, self.model_text(folder).into_bytes()),
            (fitted_model::RESULT.to_owned(), json.into_bytes()),
            (fitted_model::REPORT.to_owned(), self.page().into_bytes()),
        ];
        written.extend(self.more.iter().cloned());
        ResultFolder { written, ..ResultFolder::default() }
    }

    /// The outcome; `written` is the folder of the files. If the fit can be resumed, its journal stays.
    pub fn ended(&self, written: Option<&Path>) -> TaskEnd {
        self.end.ended(self.journal.as_ref(), written)
    }

    /// Keeps the fit's journal, if any, so that the same request with `--resume` returns this result at once. Otherwise
    /// the journal is removed with the result.
    pub fn leave(&self) {
        if let Some(journal) = &self.journal {
            journal.leave();
        }
    }
}

impl Serialize for FitResult {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.result.serialize(serializer)
    }
}
