//! Fits all contenders with the same settings, one after the other; a failure does not end the others.

use dgd_compiler::argument::Spelling;
use dgd_compiler::pipeline::SensitivityDirections;

use super::contender::NamedModel;
use super::label;
use crate::error::WorkError;
use crate::fit::{FitResult, fit};
use crate::model::load;
use crate::request::{CompareRequest, FitRequest, JournalChoice};
use crate::run::keeping;
use crate::session::TaskContext;

/// A contender that could not be fitted.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct FailedContender {
    /// Its letter in tables.
    pub label: String,
    /// As it was requested.
    pub name: String,
    /// Why the fit failed.
    pub reason: String,
}

/// The outcomes of the contenders.
pub(super) struct ContenderFits {
    /// Those that were fitted, each with its index among all.
    pub fitted: Vec<(usize, FitResult)>,
    pub failed: Vec<FailedContender>,
}

/// Fits each contender. If none can be fitted, the error of the first is returned.
pub(super) fn all(
    request: &CompareRequest,
    named: &[NamedModel],
    outputs: &[String],
    session: TaskContext<'_>,
) -> Result<ContenderFits, WorkError> {
    let mut fits = ContenderFits { fitted: Vec::with_capacity(named.len()), failed: Vec::new() };
    let mut first_error = None;
    for (k, one) in named.iter().enumerate() {
        let failed = |reason| FailedContender { label: label(k), name: one.name.clone(), reason };
        // After a cancelled fit the remaining contenders are not fitted.
        if k > 0 && session.listener.is_stopped() {
            fits.failed.push(failed("not fitted: stopped by Ctrl-C".to_owned()));
            continue;
        }
        match fit(&request_of(request, one, outputs, k), session) {
            Ok(fitted) => fits.fitted.push((k, fitted)),
            Err(error) => {
                fits.failed.push(failed(reason(&error, session.spelling())));
                first_error.get_or_insert(of_contender(&one.name, error));
            }
        }
    }
    match first_error {
        Some(error) if fits.fitted.is_empty() => Err(error),
        _ => Ok(fits),
    }
}

fn request_of(
    request: &CompareRequest,
    one: &NamedModel,
    outputs: &[String],
    place: usize,
) -> FitRequest {
    let mut fitting = FitRequest::new(&one.model, request.data.clone());
    fitting.choices = one.choices.clone();
    fitting.valid.clone_from(&request.valid);
    fitting.sought = request.sought.clone();
    fitting.outputs = outputs.to_vec();
    fitting.keep = kept(&request.keep, place);
    fitting.evaluations = request.evaluations;
    fitting.solve = request.solve.clone();
    fitting
}

/// The journal of a contender: beside the results, by its letter.
fn kept(keep: &JournalChoice, place: usize) -> JournalChoice {
    let out = keep.out.as_ref().map(|out| {
        let mut name = out.file_name().unwrap_or_default().to_owned();
        name.push(format!(".{}", label(place)));
        out.with_file_name(name)
    });
    JournalChoice::new(out, keep.resume)
}

/// The reason why a contender has no fit, in one line.
fn reason(error: &WorkError, spelling: Spelling) -> String {
    let first = error.mistakes(spelling).into_iter().next();
    let words = first.map_or_else(|| error.spelled(spelling), |mistake| mistake.message);
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A mistake with the contender's name; diagnostics have their spans.
fn of_contender(name: &str, error: WorkError) -> WorkError {
    match error {
        WorkError::Diagnosed { .. } => error,
        _ => WorkError::Contender { name: name.to_owned(), error: Box::new(error) },
    }
}

/// Passes each contender the settings that it declares. A setting that none declares is an error of the first.
pub(super) fn set(
    named: &mut [NamedModel],
    settings: &[String],
    session: TaskContext<'_>,
) -> Result<(), WorkError> {
    for setting in settings {
        let mut known = Vec::with_capacity(named.len());
        let mut first_error = None;
        for (k, one) in named.iter().enumerate() {
            let mut choices = one.choices.clone();
            choices.set.push(setting.clone());
            match load(&one.model, &choices, &SensitivityDirections::None, session) {
                Ok(_) => known.push(k),
                Err(error) => {
                    // Report mistakes that exist without the setting first.
                    load(&one.model, &one.choices, &SensitivityDirections::None, session)?;
                    first_error.get_or_insert(error);
                }
            }
        }
        if let (Some(error), true) = (first_error, known.is_empty()) {
            return Err(error);
        }
        for k in known {
            named[k].choices.set.push(setting.clone());
        }
    }
    Ok(())
}

/// Checks the options for resuming.
pub(super) fn verify(request: &CompareRequest) -> Result<(), WorkError> {
    keeping::verify(&request.keep)
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn finished_work_of_each_contender_has_a_place_of_its_own() {
        let keep = JournalChoice::new(Some(PathBuf::from("a/out")), true);
        assert_eq!(kept(&keep, 1), JournalChoice::new(Some(PathBuf::from("a/out.B")), true));
        assert_eq!(kept(&JournalChoice::default(), 1), JournalChoice::default());
    }
}
