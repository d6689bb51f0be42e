//! The headline of the page of a fit: whether it converged, whether it fits, what to doubt.

use dgd_page::{HeadlineTone, Markup};
use dgd_runtime::Signature;
use serde_json::Value;

use super::diagnosis::Diagnosis;
use super::parameters::doubtful;
use crate::fit::report::bad_fit::{exceeds_noise, why_bad};
use crate::fit::report::outcome::CORRELATED;
use crate::output::page::told;
use crate::output::quantity::short;

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

pub(super) fn headline(json: &Value, signature: &Signature, diagnosis: &Diagnosis) -> Headline {
    let names = |outputs: &[usize]| quoted(outputs.iter().map(|i| &*signature.outputs[*i].name));
    let all_outputs = || 0..signature.outputs.len();
    let dependent: Vec<usize> =
        all_outputs().filter(|i| !diagnosis.depends_on(*i).is_empty()).collect();
    let coloured: Vec<usize> = all_outputs().filter(|i| diagnosis.is_coloured(*i)).collect();
    let (sentence, tone) = if json["converged"] != true {
        ("Not converged: do not use these values".to_owned(), HeadlineTone::Doubt)
    } else if let Some(words) = why_bad(json) {
        (format!("Converged, but {words}"), HeadlineTone::Doubt)
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
    let mut doubts: Vec<String> = strings(&json["left_out"]);
    doubts.extend(larger(json));
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
    doubts.extend(worse(json));
    doubts.push(doubtful(json, CORRELATED));
    doubts.extend(strings(&json["reservations"]));
    let doubts: Vec<Markup> = doubts.iter().map(|doubt| Markup::prose(doubt)).collect();
    Headline {
        sentence: Markup::prose(&sentence),
        tone,
        doubts: Markup::list(&doubts),
        end: Markup::prose(&end(json)).caption(),
    }
}

/// Residuals larger than the declared noise, in a sentence.
fn larger(json: &Value) -> Option<String> {
    let chi = json["reduced_chi_square"].as_f64().filter(|_| exceeds_noise(json))?;
    Some(format!(
        "The residuals are larger than the declared noise (reduced χ² = {}): the model misses something, or the noise is \
         larger than was declared, and the standard deviations below are too small.",
        short(chi, 3)
    ))
}

/// Outputs that the fit predicts worse than it fits them.
fn worse(json: &Value) -> Option<String> {
    let outputs = json["outputs"].as_object()?;
    let ratio =
        |output: &Value| Some(output["rms_valid"].as_f64()? / output["rms_train"].as_f64()?);
    let worse = outputs.iter().filter_map(|(name, output)| Some((name, ratio(output)?)));
    let worse = worse.filter(|(_, ratio)| *ratio > WORSE);
    let worse: Vec<String> =
        worse.map(|(name, ratio)| format!("`{name}` by {}", short(ratio, 2))).collect();
    (!worse.is_empty())
        .then(|| format!("Errors are larger in validation than in training: {}.", worse.join(", ")))
}

/// The outcome of the search, in numbers.
fn end(json: &Value) -> String {
    let mut parts = Vec::new();
    let mut push = |key: &str, name: &str| {
        if let Some(value) = json[key].as_f64() {
            parts.push(format!("{name} {}", told(value)));
        }
    };
    push("reduced_chi_square", "reduced χ²");
    push("samples", "samples:");
    push("iterations", "steps:");
    push("evaluations", "simulations or evaluations:");
    for (key, name) in [("aicc", "AICc"), ("bic", "BIC")] {
        if let Some(value) = json[key].as_f64() {
            // Differences of a few units matter, however large the value is.
            parts.push(format!("{name} {value:.1}"));
        }
    }
    if let Some(how) = json["termination"].as_str() {
        parts.push(format!("ended by {how}"));
    }
    parts.join("; ")
}

fn strings(list: &Value) -> Vec<String> {
    let list = list.as_array().map_or(&[][..], Vec::as_slice);
    list.iter().filter_map(|one| one.as_str().map(str::to_owned)).collect()
}

fn quoted<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}
