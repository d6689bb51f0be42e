//! Compares models, variants, effects and results on the same recordings.
//!
//! ```text
//!   CompareRequest ─ contender ─► model and choices ─ fitting ─► each fitted alike
//!                  ─ score ─────► likelihoods on common samples, criteria, ratios ─► Comparison
//!                                                        text, json, page, one figure
//! ```

mod contender;
mod figure;
mod fitting;
mod page;
mod ratio;
mod score;
mod summary;

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_compiler::sentence;
use dgd_data::files::ResultFolder;
use dgd_plot::Figure;
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use crate::error::{TaskEnd, UnusableFile, WorkError};
use crate::fit::FitResult;
use crate::model::load;
use crate::output::agreement::Agreement;
use crate::output::json_text;
use crate::output::provenance::Provenance;
use crate::request::CompareRequest;
use crate::result::compare::{BestContenders, CompareDocument, FailedEntry, LikelihoodRatioEntry};
use crate::session::TaskContext;
use contender::NamedModel;
use fitting::ContenderFits;
use score::CommonSamples;

pub use contender::model_of;
pub use fitting::FailedContender;
pub use ratio::LikelihoodRatio;
pub use score::ContenderScore;

/// Files of a folder of results.
pub const FILES: [&str; 2] = ["report.html", "result.json"];

/// Contenders, fitted to the same recordings.
#[non_exhaustive]
pub struct FitComparison {
    /// Those that were fitted, in the order of the request.
    pub contenders: Vec<Contender>,
    /// Those that could not be fitted.
    pub failed: Vec<FailedContender>,
    /// Pairs in which one is a special case of the other.
    pub ratios: Vec<LikelihoodRatio>,
    /// Versions and digests of the inputs; contenders hold the digests of the models.
    pub provenance: Provenance,
    common: CommonSamples,
    command: String,
}

/// A contender.
#[non_exhaustive]
pub struct Contender {
    /// Its letter in tables.
    pub label: String,
    /// As it was requested.
    pub name: String,
    /// Its fit.
    pub fitted: FitResult,
    /// Its likelihood on the training recordings, and the number of estimates.
    pub score: ContenderScore,
    named: NamedModel,
}

/// Fits all contenders to the same recordings and compares them.
///
/// # Errors
///
/// [`WorkError`]: a contender is missing or has mistakes, none can be fitted, or they have no output in common. If only
/// some cannot be fitted, they are in [`FitComparison::failed`].
pub fn compare(
    request: &CompareRequest,
    session: TaskContext<'_>,
) -> Result<FitComparison, WorkError> {
    fitting::verify(request)?;
    let mut named = contender::all(&request.contenders, session.files)?;
    fitting::set(&mut named, &request.set, session)?;
    let outputs = common_outputs(&named, session)?;
    let ContenderFits { fitted, failed } = fitting::all(request, &named, &outputs, session)?;
    let (places, fits): (Vec<usize>, Vec<FitResult>) = fitted.into_iter().unzip();
    let named: Vec<NamedModel> = places.iter().map(|place| named[*place].clone()).collect();
    let common = CommonSamples::collect(&fits)?;
    let score = |(k, fitted): (usize, &FitResult)| common.score(k, &fitted.estimates);
    let scores: Vec<ContenderScore> = fits.iter().enumerate().map(score).collect();
    // The first fitted contender may not be the first in the request.
    let is_first_within = request.nested && places.first() == Some(&0);
    let ratios = ratio::all(&named, &scores, is_first_within);
    let mut provenance = fits[0].provenance.clone();
    provenance.model = None;
    let contenders = places.into_iter().zip(named.into_iter().zip(fits).zip(scores));
    let contenders = contenders.map(|(place, ((named, fitted), score))| Contender {
        label: label(place),
        name: named.name.clone(),
        fitted,
        score,
        named,
    });
    Ok(FitComparison {
        contenders: contenders.collect(),
        failed,
        ratios,
        provenance,
        common,
        command: request.command.clone(),
    })
}

/// A, B … Z, then A1 and so on.
fn label(k: usize) -> String {
    let letter = char::from(b'A' + (k % 26) as u8);
    if k < 26 { letter.to_string() } else { format!("{letter}{}", k / 26) }
}

/// The outputs to fit: an empty list, which means all, if all contenders have the same ones.
fn common_outputs(
    named: &[NamedModel],
    session: TaskContext<'_>,
) -> Result<Vec<String>, WorkError> {
    let mut outputs_of_all: Vec<Vec<String>> = Vec::with_capacity(named.len());
    for one in named {
        let loaded = load(&one.model, &one.choices, &SensitivityDirections::None, session)?;
        let outputs = loaded.compiled.dae.outputs.iter();
        outputs_of_all.push(outputs.map(|output| output.declared.name.clone()).collect());
    }
    let has = |names: &Vec<String>, name: &String| names.contains(name);
    let common: Vec<String> = outputs_of_all[0]
        .iter()
        .filter(|name| outputs_of_all.iter().all(|names| has(names, name)))
        .cloned()
        .collect();
    if common.is_empty() {
        return Err(UnusableFile::NoCommonOutput.into());
    }
    let are_same = outputs_of_all.iter().all(|names| names.len() == common.len());
    Ok(if are_same { Vec::new() } else { common })
}

impl FitComparison {
    /// Outputs that are compared, with the unit of their residuals: that of the first contender.
    pub fn outputs(&self) -> impl Iterator<Item = (&str, &str)> {
        self.common.outputs.iter().map(|output| (output.name.as_str(), output.unit.as_str()))
    }

    /// The agreement of an output of a contender with the samples common to all contenders.
    pub(crate) fn agreement(
        &self,
        contender: usize,
        output: usize,
        is_valid: bool,
    ) -> Option<Agreement> {
        self.common.agreement(contender, output, is_valid)
    }

    /// Geometric mean over the outputs of a contender's residuals relative to those of the first one.
    pub fn relative_error(&self, contender: usize, is_valid: bool) -> Option<f64> {
        let rms = |k: usize, i: usize| Some(self.agreement(k, i, is_valid)?.rms);
        let logs = (0..self.common.outputs.len())
            .filter_map(|i| Some((rms(contender, i)? / rms(0, i)?).ln()))
            .filter(|log| log.is_finite());
        let logs: Vec<f64> = logs.collect();
        (!logs.is_empty()).then(|| (logs.iter().sum::<f64>() / logs.len() as f64).exp())
    }

    /// The contender with the smallest number, if any.
    fn least(&self, number: impl Fn(usize) -> Option<f64>) -> Option<usize> {
        let numbers = (0..self.contenders.len()).filter_map(|k| Some((k, number(k)?)));
        numbers.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
    }

    /// The result, for programs.
    pub fn result(&self) -> CompareDocument {
        let name = |k: Option<usize>| k.map(|k| self.contenders[k].name.clone());
        let ratio = |one: &LikelihoodRatio| LikelihoodRatioEntry {
            null: self.contenders[one.null].name.clone(),
            alternative: self.contenders[one.alternative].name.clone(),
            statistic: one.statistic,
            degrees_of_freedom: one.degrees_of_freedom,
            p_value: one.p_value,
        };
        let failed = |one: &FailedContender| FailedEntry {
            name: one.name.clone(),
            reason: one.reason.clone(),
        };
        CompareDocument {
            contenders: (0..self.contenders.len()).map(|k| summary::entry(self, k)).collect(),
            failed: self.failed.iter().map(failed).collect(),
            samples: self.common.samples(),
            likelihood_ratios: self.ratios.iter().map(ratio).collect(),
            least: BestContenders {
                aic: name(self.least(|k| self.contenders[k].score.aic())),
                bic: name(self.least(|k| self.contenders[k].score.bic())),
                valid: name(self.least(|k| self.relative_error(k, true))),
            },
            provenance: self.provenance.clone(),
        }
    }

    /// As JSON.
    pub fn to_json(&self) -> Value {
        json!(self.result())
    }

    /// As text.
    pub fn to_text(&self) -> String {
        summary::text(self)
    }

    /// The page to read.
    pub fn page(&self) -> String {
        page::write(self)
    }

    /// Each output as measured and by each contender, and the residuals, for the first validation recording, or the
    /// first training recording if there is none.
    pub fn figure(&self) -> Figure {
        figure::figure(self)
    }

    /// The files of a folder of results: [`FILES`].
    pub fn files(&self) -> ResultFolder {
        let json = json_text(&self.to_json());
        let contents = [self.page().into_bytes(), json.into_bytes()];
        let mut files = ResultFolder::default();
        files.written.extend(FILES.map(str::to_owned).into_iter().zip(contents));
        files
    }

    /// The outcome: a failure if a contender failed or did not converge. If the comparison can be resumed, all journals
    /// stay.
    pub fn ended(&self) -> TaskEnd {
        let ends = self.contenders.iter().map(|one| (&one.name, one.fitted.ended(None)));
        let ended = ends.fold(TaskEnd::Done, |first, (name, ended)| match (first, ended) {
            (_, TaskEnd::Interrupted(why)) => TaskEnd::Interrupted(why),
            (TaskEnd::Done, TaskEnd::Stopped(why)) => {
                TaskEnd::Stopped(sentence![format!("{name}: "), why])
            }
            (first, _) => first,
        });
        if ended != TaskEnd::Done {
            self.leave();
        }
        match (ended, self.failed.first()) {
            (TaskEnd::Done, Some(one)) => {
                TaskEnd::Stopped(format!("{}: {}", one.name, one.reason).into())
            }
            (ended, _) => ended,
        }
    }

    /// Keeps the journals of the fits, if any, so that the same request with `--resume` has their results at once.
    pub fn leave(&self) {
        self.contenders.iter().for_each(|one| one.fitted.leave());
    }
}

impl Serialize for FitComparison {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_json().serialize(serializer)
    }
}
