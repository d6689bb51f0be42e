//! The headline of the page of a fit: whether it converged, whether it fits, what to doubt.

use dgd_page::{HeadlineTone, Markup};
use dgd_runtime::Signature;

use super::diagnosis::Diagnosis;
use super::parameters::doubtful;
use crate::fit::report::bad_fit::BadFit;
use crate::fit::report::outcome::CORRELATED;
use crate::output::page::told;
use crate::output::quantity::short;
use crate::result::fit::{FitDocument, OutputEntry};

/// Validation residuals larger than those in training by this factor are pointed out.
const WORSE: f64 = 1.5;

/// The top of the page.
pub(super) struct Headline {
    pub sentence: Markup,
    pub tone: HeadlineTone,
    /// Doubts, as a list.
    pub doubts: Markup,
    /// The outcome of the search.
    pub end: Markup,
}

pub(super) fn headline(
    result: &FitDocument,
    signature: &Signature,
    diagnosis: &Diagnosis,
) -> Headline {
    let names = |outputs: &[usize]| quoted(outputs.iter().map(|i| &*signature.outputs[*i].name));
    let all_outputs = || 0..signature.outputs.len();
    let dependent: Vec<usize> =
        all_outputs().filter(|i| !diagnosis.depends_on(*i).is_empty()).collect();
    let coloured: Vec<usize> = all_outputs().filter(|i| diagnosis.is_coloured(*i)).collect();
    let (sentence, tone) = if !result.converged {
        ("Not converged: do not use these values".to_owned(), HeadlineTone::Doubt)
    } else if let Some(reason) = BadFit::find(result) {
        (format!("Converged, but {reason}"), HeadlineTone::Doubt)
    } else if !dependent.is_empty() {
        let outputs = names(&dependent);
        (format!("Converged, but the model misses something in {outputs}"), HeadlineTone::Doubt)
    } else if !coloured.is_empty() {
        let outputs = names(&coloured);
        (
            format!("Converged, but the residuals of {outputs} are more than noise"),
            HeadlineTone::Doubt,
        )
    } else if diagnosis.tested() == 0 {
        (
            "Converged; too few samples to judge the fit by its residuals".to_owned(),
            HeadlineTone::Plain,
        )
    } else {
        ("Converged, and the residuals look like noise".to_owned(), HeadlineTone::Good)
    };
    let mut doubts: Vec<String> = result.left_out.clone();
    doubts.extend(larger(result));
    for i in dependent {
        let inputs = diagnosis.depends_on(i);
        let inputs = quoted(inputs.into_iter().map(|k| &*signature.inputs[k].name));
        doubts.push(format!(
            "The residuals of `{}` correlate with {inputs}: the model misses something in how {inputs} acts. \
             `dgd discover` looks for it.",
            signature.outputs[i].name
        ));
    }
    if !coloured.is_empty() {
        doubts.push(format!(
            "The residuals of {} are autocorrelated, so the standard deviations below are too small.",
            names(&coloured)
        ));
    }
    doubts.extend(worse(result));
    doubts.push(doubtful(result, CORRELATED));
    doubts.extend(result.reservations.iter().flatten().cloned());
    let doubts: Vec<Markup> = doubts.iter().map(|doubt| Markup::prose(doubt)).collect();
    Headline {
        sentence: Markup::prose(&sentence),
        tone,
        doubts: Markup::list(&doubts),
        end: Markup::prose(&end(result)).caption(),
    }
}

/// Residuals larger than the declared noise, in a sentence.
fn larger(result: &FitDocument) -> Option<String> {
    let details = result.simulation.as_ref()?;
    let chi = details.reduced_chi_square?;
    details.left_over.as_ref().filter(|model_error| model_error.exceeds_declared_noise)?;
    Some(format!(
        "The residuals are larger than the declared noise (reduced χ² = {}): the model misses something, or the noise is \
         larger than was declared, and the standard deviations below are too small.",
        short(chi, 3)
    ))
}

/// Outputs that the fit predicts worse than it fits them.
fn worse(result: &FitDocument) -> Option<String> {
    let ratio = |output: &OutputEntry| Some(output.rms_valid? / output.rms_train?);
    let worse = result.outputs.iter().filter_map(|(name, output)| Some((name, ratio(output)?)));
    let worse = worse.filter(|(_, ratio)| *ratio > WORSE);
    let worse: Vec<String> =
        worse.map(|(name, ratio)| format!("`{name}` by {}", short(ratio, 2))).collect();
    (!worse.is_empty())
        .then(|| format!("Errors are larger in validation than in training: {}.", worse.join(", ")))
}

/// The outcome of the search, in numbers.
fn end(result: &FitDocument) -> String {
    let details = result.simulation.as_ref();
    let mut parts = Vec::new();
    if let Some(chi) = details.and_then(|details| details.reduced_chi_square) {
        parts.push(format!("reduced χ² {}", told(chi)));
    }
    for (name, count) in [
        ("samples:", result.samples),
        ("steps:", result.iterations),
        ("simulations or evaluations:", result.evaluations),
    ] {
        parts.push(format!("{name} {}", told(count as f64)));
    }
    let criteria = details.map(|details| [("AICc", details.aicc), ("BIC", details.bic)]);
    for (name, value) in criteria.into_iter().flatten() {
        if let Some(value) = value {
            // Differences of a few units matter, however large the value is.
            parts.push(format!("{name} {value:.1}"));
        }
    }
    if let Some(how) = &result.termination {
        parts.push(format!("ended by {how}"));
    }
    parts.join("; ")
}

fn quoted<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}
