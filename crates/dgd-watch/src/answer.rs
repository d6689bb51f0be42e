//! Answers as JSON: the model's controls, results of a run, and errors.

use dgd_work::{ApplicableEffect, SimulationResult, WorkError, neutral};
use serde_json::{Value, json};

use dgd_work::check::{ModelDescription, ParameterDescription, VariantChoices};

/// Maximum length of a text shown around errors, bytes.
const LONGEST_TEXT: usize = 1 << 20;

/// The choices and settings. `written` are the parameters whose values are in the text of the opened model.
pub(crate) fn controls(
    description: &ModelDescription,
    effects: &[ApplicableEffect],
    applied: &[String],
    written: &[String],
) -> Value {
    let parameter = |parameter: &ParameterDescription| {
        let mut control = json!(parameter);
        control["writable"] = json!(written.contains(&parameter.name));
        control
    };
    let variant = |variant: &VariantChoices| json!(variant);
    let effect = |effect: &ApplicableEffect| {
        let is_applied = applied.contains(&effect.name);
        json!({ "name": effect.name, "doc": effect.doc, "applied": is_applied })
    };
    json!({
        "model": description.model,
        "doc": description.doc,
        "parameters": description.parameters.iter().map(parameter).collect::<Vec<_>>(),
        "variants": description.variants.iter().map(variant).collect::<Vec<_>>(),
        "effects": effects.iter().map(effect).collect::<Vec<_>>(),
    })
}

/// The results of a run, in words.
pub(crate) fn run(simulated: &SimulationResult) -> Value {
    let (headline, agreement) = simulated.in_words();
    json!({
        "headline": headline,
        "stopped": simulated.stopped.is_some(),
        "agreement": agreement.as_str(),
    })
}

/// An error: in words, with diagnostics and their locations, and the texts that contain them.
pub fn of_error(error: &WorkError) -> Value {
    let mistakes = error.mistakes(neutral);
    let mut texts = serde_json::Map::new();
    if let WorkError::Diagnosed { sources, .. } = error {
        for source in sources.files() {
            let is_meant = |place: &dgd_work::TextSpot| place.file == source.name;
            let is_shown = mistakes.iter().any(|mistake| mistake.places.iter().any(is_meant));
            if is_shown && source.text.len() <= LONGEST_TEXT {
                texts.insert(source.name.clone(), json!(source.text));
            }
        }
    }
    // The page renders the diagnostics itself.
    let words = match mistakes.first() {
        Some(mistake) => mistake.message.clone(),
        None => error.to_string(),
    };
    json!({ "ok": false, "error": words, "mistakes": mistakes, "texts": texts })
}
