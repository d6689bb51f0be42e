//! Models, variants, effects and results side by side on the same recordings.
//!
//! ```text
//!   CompareRequest ─ contender ─► model and choices, each fitted alike (fit)
//!                  ─ score ─────► likelihoods on common samples, criteria, ratios ─► Comparison
//!                                                        text, json, page, one figure
//! ```

mod contender;
mod figure;
mod page;
mod ratio;
mod score;
mod summary;

use dgd_compiler::pipeline::Directions;
use dgd_data::files::Files;
use dgd_plot::Figure;
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use crate::error::{Ended, WorkError};
use crate::fit::{Fitted, fit};
use crate::model::load;
use crate::output::agreement::Agreement;
use crate::output::provenance::Provenance;
use crate::request::{CompareRequest, FitRequest};
use crate::session::Session;
use contender::Named;
use score::Common;

pub use contender::model_of;
pub use ratio::LikelihoodRatio;
pub use score::Score;

/// Files of a folder of results.
pub const FILES: [&str; 2] = ["report.html", "result.json"];

/// Contenders, fitted to the same recordings.
#[non_exhaustive]
pub struct Comparison {
    /// In the order of the request.
    pub contenders: Vec<Contender>,
    /// Those of which one is a special case of another.
    pub ratios: Vec<LikelihoodRatio>,
    /// What it was made of; models have their digests with the contenders.
    pub provenance: Provenance,
    common: Common,
    command: String,
}

/// One of what is compared.
#[non_exhaustive]
pub struct Contender {
    /// A letter, by which tables call it.
    pub label: String,
    /// As it was asked for.
    pub name: String,
    /// Its fit.
    pub fitted: Fitted,
    /// How well it does on the training recordings, and what that takes.
    pub score: Score,
    named: Named,
}

/// Fits all contenders to the same recordings and compares them.
///
/// # Errors
///
/// [`WorkError`]: a contender is missing or cannot be fitted, or they have no output in common.
pub fn compare(request: &CompareRequest, session: Session<'_>) -> Result<Comparison, WorkError> {
    let named = contender::all(&request.contenders, session.files)?;
    let outputs = common_outputs(&named, session)?;
    let mut fits = Vec::with_capacity(named.len());
    for one in &named {
        let mut fitting = FitRequest::new(&one.model, request.data.clone());
        fitting.choices = one.choices.clone();
        fitting.valid.clone_from(&request.valid);
        fitting.sought = request.sought.clone();
        fitting.outputs.clone_from(&outputs);
        fitting.evaluations = request.evaluations;
        fitting.solve = request.solve.clone();
        fits.push(fit(&fitting, session).map_err(|error| of_contender(&one.name, error))?);
    }
    let common = Common::of(&fits)?;
    let score = |(k, fitted): (usize, &Fitted)| common.score(k, fitted.estimates.len());
    let scores: Vec<Score> = fits.iter().enumerate().map(score).collect();
    let ratios = ratio::all(&named, &scores, request.nested);
    let mut provenance = fits[0].provenance.clone();
    provenance.model = None;
    let contenders = named.into_iter().zip(fits).zip(scores).enumerate();
    let contenders = contenders.map(|(k, ((named, fitted), score))| Contender {
        label: label(k),
        name: named.name.clone(),
        fitted,
        score,
        named,
    });
    Ok(Comparison {
        contenders: contenders.collect(),
        ratios,
        provenance,
        common,
        command: request.command.clone(),
    })
}

/// A mistake, with whose it is; diagnostics have their places.
fn of_contender(name: &str, error: WorkError) -> WorkError {
    let told = |words: &str| format!("`{name}`: {words}");
    match error {
        WorkError::Diagnosed { .. } => error,
        WorkError::Found(words) => WorkError::Found(told(&words)),
        WorkError::Usage(words) => WorkError::Usage(told(&words)),
        WorkError::Computation(words) => WorkError::Computation(told(&words)),
    }
}

/// A, B … Z, then A1 and so on.
fn label(k: usize) -> String {
    let letter = char::from(b'A' + (k % 26) as u8);
    if k < 26 { letter.to_string() } else { format!("{letter}{}", k / 26) }
}

/// The outputs to fit: none, which means all, where all contenders have the same ones.
fn common_outputs(named: &[Named], session: Session<'_>) -> Result<Vec<String>, WorkError> {
    let mut all: Vec<Vec<String>> = Vec::with_capacity(named.len());
    for one in named {
        let loaded = load(&one.model, &one.choices, &Directions::None, session)?;
        let outputs = loaded.compiled.dae.outputs.iter();
        all.push(outputs.map(|output| output.declared.name.clone()).collect());
    }
    let has = |names: &Vec<String>, name: &String| names.contains(name);
    let common: Vec<String> =
        all[0].iter().filter(|name| all.iter().all(|names| has(names, name))).cloned().collect();
    if common.is_empty() {
        let message = "the contenders have no output of one name: nothing can be compared";
        return Err(WorkError::Found(message.to_owned()));
    }
    let are_same = all.iter().all(|names| names.len() == common.len());
    Ok(if are_same { Vec::new() } else { common })
}

impl Comparison {
    /// Outputs that are compared, with the unit of their errors, in that of the first contender.
    pub fn outputs(&self) -> impl Iterator<Item = (&str, &str)> {
        self.common.outputs.iter().map(|output| (output.name.as_str(), output.unit.as_str()))
    }

    /// How an output of a contender agrees with the samples that all contenders are judged by.
    pub(crate) fn agreement(
        &self,
        contender: usize,
        output: usize,
        is_valid: bool,
    ) -> Option<Agreement> {
        self.common.agreement(contender, output, is_valid)
    }

    /// Geometric mean over the outputs of a contender's errors over those of the first one.
    pub fn relative_error(&self, contender: usize, is_valid: bool) -> Option<f64> {
        let rms = |k: usize, i: usize| Some(self.agreement(k, i, is_valid)?.rms);
        let logs = (0..self.common.outputs.len())
            .filter_map(|i| Some((rms(contender, i)? / rms(0, i)?).ln()))
            .filter(|log| log.is_finite());
        let logs: Vec<f64> = logs.collect();
        (!logs.is_empty()).then(|| (logs.iter().sum::<f64>() / logs.len() as f64).exp())
    }

    /// The contender for which a number is least, if there is one.
    fn least(&self, number: impl Fn(usize) -> Option<f64>) -> Option<usize> {
        let numbers = (0..self.contenders.len()).filter_map(|k| Some((k, number(k)?)));
        numbers.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
    }

    /// For programs.
    pub fn to_json(&self) -> Value {
        let contenders: Vec<Value> =
            (0..self.contenders.len()).map(|k| summary::entry(self, k)).collect();
        let name = |k: Option<usize>| k.map(|k| &self.contenders[k].name);
        let ratio = |one: &LikelihoodRatio| {
            json!({
                "null": self.contenders[one.null].name,
                "alternative": self.contenders[one.alternative].name,
                "statistic": one.statistic,
                "degrees_of_freedom": one.degrees_of_freedom,
                "p_value": one.p_value,
            })
        };
        let mut all = json!({
            "contenders": contenders,
            "samples": self.common.samples(),
            "likelihood_ratios": self.ratios.iter().map(ratio).collect::<Vec<_>>(),
            "least": {
                "aic": name(self.least(|k| self.contenders[k].score.aic())),
                "bic": name(self.least(|k| self.contenders[k].score.bic())),
                "valid": name(self.least(|k| self.relative_error(k, true))),
            },
        });
        self.provenance.push_json(&mut all);
        all
    }

    /// For people.
    pub fn to_text(&self) -> String {
        summary::text(self)
    }

    /// The page to read.
    pub fn page(&self) -> String {
        page::write(self)
    }

    /// Each output as measured and by each contender, and what is left, in the first validation recording, or the
    /// first of training where there is none.
    pub fn figure(&self) -> Figure {
        figure::figure(self)
    }

    /// The files of a folder of results: [`FILES`].
    pub fn files(&self) -> Files {
        let json = format!("{:#}\n", self.to_json());
        let contents = [self.page().into_bytes(), json.into_bytes()];
        let mut files = Files::default();
        files.written.extend(FILES.map(str::to_owned).into_iter().zip(contents));
        files
    }

    /// How it ended: badly where a contender did not converge.
    pub fn ended(&self) -> Ended {
        for contender in &self.contenders {
            match contender.fitted.ended(None) {
                Ended::Stopped(why) => return Ended::Stopped(format!("{}: {why}", contender.name)),
                Ended::Interrupted(why) => return Ended::Interrupted(why),
                Ended::Done | Ended::Found(_) => {}
            }
        }
        Ended::Done
    }
}

impl Serialize for Comparison {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_json().serialize(serializer)
    }
}
