//! Parameters and start values from recordings, tested on others.
//!
//! ```text
//!   FitRequest ─ task ─► recordings and problem ─┬─ output_error (and linear models)
//!                                                ├─ prediction_error (filters)      ─► report ─► Fitted
//!                                                └─ regress (equations)
//! ```

pub mod compare;
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
use dgd_compiler::pipeline::Compiled;
use dgd_compiler::source::Sources;
use dgd_data::files::Files;
use dgd_data::files::journal::RunJournal;
use dgd_identify::Estimate;
use dgd_plot::Figure;
use dgd_runtime::Signature;
use serde::{Serialize, Serializer};
use serde_json::Value;

use crate::error::{Ended, WorkError};
use crate::output::json_text;
use crate::output::provenance::Provenance;
use crate::request::{Estimator, FitRequest};
use crate::run::keeping;
use crate::session::Session;
use page::traces::Trace;
use report::intervals::{Estimated, Intervals};
use report::left_out::LeftOut;
use task::Task;

pub use fitted_model::file_names;

/// Estimates, how far they can be trusted, and the fitted model.
#[non_exhaustive]
pub struct Fitted {
    /// How they were found.
    pub estimator: Estimator,
    /// The estimates, SI: parameters, and start values of recordings.
    pub estimates: Vec<Estimate>,
    /// Figures, where they were asked for.
    pub figures: Vec<FitFigure>,
    /// Why the estimates are not what they should be; nothing where a fit came to its end.
    pub left_out: Vec<String>,
    /// What it was made of.
    pub provenance: Provenance,
    json: Value,
    text: String,
    more: Vec<(String, Vec<u8>)>,
    traces: Vec<Trace>,
    signature: Signature,
    command: String,
    end: LeftOut,
    model: PathBuf,
    compiled: Compiled,
    sources: Sources,
    settings: Vec<Setting>,
    journal: Option<RunJournal>,
}

/// A figure of a fit.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct FitFigure {
    /// The estimate whose profile it is; nothing where it shows the recordings.
    pub of: Option<String>,
    /// The figure.
    pub figure: Figure,
}

impl FitFigure {
    /// Those of profiles.
    fn of_profiles(
        intervals: &Intervals,
        outcome: &dyn Estimated,
    ) -> impl Iterator<Item = FitFigure> {
        let figures = intervals.figures(outcome).into_iter();
        figures.map(|(name, figure)| FitFigure { of: Some(name), figure })
    }
}

/// What an estimator has found.
struct Found {
    json: Value,
    text: String,
    figures: Vec<FitFigure>,
    estimates: Vec<Estimate>,
    /// The recordings with what was simulated of them.
    traces: Vec<Trace>,
    /// Files besides the result and the model.
    more: Vec<(String, Vec<u8>)>,
    left_out: LeftOut,
}

/// Fits a model to recordings.
///
/// # Errors
///
/// [`WorkError`]. A fit that ends in no minimum, or is stopped, is a result, which says so.
pub fn fit(request: &FitRequest, session: Session<'_>) -> Result<Fitted, WorkError> {
    keeping::verify(&request.keep)?;
    let estimator = request.regression.estimator;
    let place = request.regression.place()?;
    let mut task = Task::load(request, session)?;
    // What a program does without is not in it.
    let has_all = cfg!(feature = "estimators");
    if let Some(place) = place.filter(|_| has_all) {
        task.linearise(place);
    }
    let task = task;
    request.search.verify(estimator)?;
    request.regression.verify_evaluations(request.evaluations)?;
    request.intervals.verify(estimator, dgd_runtime::System::signature(&task.system))?;
    let found = match estimator {
        Estimator::OutputError => output_error::run(&task, request, place),
        Estimator::Linearised if has_all => output_error::run(&task, request, place),
        Estimator::PredictionError if has_all => prediction_error::run(&task, request),
        Estimator::LeastSquares
        | Estimator::Bounded
        | Estimator::Separable
        | Estimator::NelderMead
        | Estimator::Recursive
            if has_all =>
        {
            regress::run(&task, request)
        }
        _ => Err(WorkError::Usage("this program fits by simulation alone".to_owned())),
    }?;
    let mut json = found.json;
    task.provenance.push_json(&mut json);
    Ok(Fitted {
        estimator,
        estimates: found.estimates,
        figures: found.figures,
        left_out: found.left_out.all().to_vec(),
        json,
        provenance: task.provenance,
        text: found.text,
        more: found.more,
        traces: found.traces,
        signature: dgd_runtime::System::signature(&task.system).clone(),
        command: request.command.clone(),
        end: found.left_out,
        model: request.model.clone(),
        compiled: task.compiled,
        sources: task.sources,
        settings: task.options_of_model.settings,
        journal: task.journal,
    })
}

impl Fitted {
    /// `result.json`.
    pub fn to_json(&self) -> &Value {
        &self.json
    }

    /// Tables and remarks.
    pub fn to_text(&self) -> &str {
        &self.text
    }

    /// The fitted model as a text that holds in this folder: what it imports is found from there.
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

    /// `report.html`: how good the fit is and what to think of it.
    pub fn page(&self) -> String {
        page::write(self)
    }

    /// The files of a folder of results: [`file_names`].
    pub fn files(&self, folder: &Path) -> Files {
        let name = fitted_model::file_name(&self.model);
        let json = json_text(&self.json);
        let mut written = vec![
            (name, self.model_text(folder).into_bytes()),
            (fitted_model::RESULT.to_owned(), json.into_bytes()),
            (fitted_model::REPORT.to_owned(), self.page().into_bytes()),
        ];
        written.extend(self.more.iter().cloned());
        Files { written, ..Files::default() }
    }

    /// How it ended; `written` is where its files are. Where it can be gone on from, what it has kept is left.
    pub fn ended(&self, written: Option<&Path>) -> Ended {
        self.end.ended(self.journal.as_ref(), written)
    }

    /// Leaves what the fit has kept, where there is any: the same request, resumed, has this result at once.
    /// Otherwise it is removed with the result.
    pub fn leave(&self) {
        if let Some(journal) = &self.journal {
            journal.leave();
        }
    }
}

impl Serialize for Fitted {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.json.serialize(serializer)
    }
}
