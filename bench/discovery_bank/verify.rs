//! Whether the bank is sound: the truth fits a case to the noise, and the base model does not.

use dgd_data::InMemory;
use dgd_work::{FitRequest, ModelChoices, NoiseFrom, SilentReporter, TaskContext, fit};
use serde_json::Value;

use crate::bank::{Case, Kind};
use crate::search::{FOLDER, files};

/// A truth leaves no more than this of the noise's mean square, in training and in validation, where start values and
/// parameters that are not known well enough add something.
const MOST: [f64; 2] = [1.15, 2.0];

/// The reduced chi-square of training and validation with the base model and with the truth, for the terminal.
pub(crate) fn line(case: &Case) -> String {
    let files = files(case).with_file(format!("{FOLDER}/truth.dgd"), case.effect.as_str());
    let base = fitted(case, &files, &[], &[]);
    let shown = |chi: &Result<Fit, String>| match chi {
        Ok(Fit { chi: [train, valid], .. }) => format!("{train:10.2} {valid:10.2}"),
        Err(error) => format!("{:>21}", error.lines().next().unwrap_or_default()),
    };
    let effects: Vec<String> = match case.truth.kind() {
        Kind::Library => {
            case.hidden.split('+').map(|name| format!("{FOLDER}/effects/{name}.dgd")).collect()
        }
        _ if case.effect.is_empty() => Vec::new(),
        _ => vec![format!("{FOLDER}/truth.dgd")],
    };
    let name = &case.name;
    if effects.is_empty() {
        return format!("{name:52} base {}", shown(&base));
    }
    let sizes = sizes(case);
    let from_base = base.as_ref().map(|fit| fit.parameters.clone()).unwrap_or_default();
    // A fit finds the nearest minimum; these are near the truth in the effect, in the model, or in both.
    let starts = [sizes.clone(), [sizes, from_base.clone()].concat(), from_base];
    let fits = starts.iter().map(|set| fitted(case, &files, &effects, set));
    let best = fits.reduce(|a, b| match (&a, &b) {
        (Ok(first), Ok(second)) if second.chi[0] >= first.chi[0] => a,
        (Ok(_), Err(_)) => a,
        _ => b,
    });
    let truth = best.unwrap_or_else(|| Err("nothing was fitted".to_owned()));
    let is_sound = truth.as_ref().is_ok_and(|fit| fit.chi[0] <= MOST[0] && fit.chi[1] <= MOST[1]);
    let is_visible = base.as_ref().is_ok_and(|fit| fit.chi[0] > 1.5 || fit.chi[1] > 1.5);
    let doubt = match (is_sound, is_visible) {
        (false, _) => "  NOT TO THE NOISE",
        (_, false) => "  hardly visible",
        _ => "",
    };
    format!("{name:52} base {}  truth {}{doubt}", shown(&base), shown(&truth))
}

#[derive(Debug, Clone)]
struct Fit {
    /// Mean over the outputs of the residuals' mean square over the noise's, in training and validation.
    chi: [f64; 2],
    /// Estimates, as they are set.
    parameters: Vec<String>,
}

fn fitted(case: &Case, files: &InMemory, apply: &[String], set: &[String]) -> Result<Fit, String> {
    let path = |name: &str| format!("{FOLDER}/{name}");
    let mut request = FitRequest::new(path("model.dgd"), vec![path("train.csv").into()]);
    request.valid = vec![path("valid.csv").into()];
    request.noise = NoiseFrom::Declared;
    request.choices = ModelChoices::new(Vec::new(), set.to_vec(), apply.to_vec());
    let session = TaskContext::new(&SilentReporter).with_files(files).with_threads(1);
    let fitted = fit(&request, session).map_err(|error| error.to_string())?;
    let json = fitted.to_json();
    let noisy = case.train.columns.iter().filter_map(|column| Some((column, column.noise?)));
    let mut sums = [0.0; 2];
    let mut outputs = 0.0;
    for (column, noise) in noisy {
        let of = |key: &str| json["outputs"][&column.name][key].as_f64().unwrap_or(f64::NAN);
        sums[0] += (of("rms_train") / noise).powi(2);
        sums[1] += (of("rms_valid") / noise).powi(2);
        outputs += 1.0;
    }
    let parameters = json["parameters"].as_object().into_iter().flatten();
    let set = |(name, value): (&String, &Value)| {
        let (number, unit) = (value["value"].as_f64()?, value["unit"].as_str()?);
        Some(format!("{name}={number} [{unit}]"))
    };
    let parameters = parameters.filter_map(set).collect();
    Ok(Fit { chi: sums.map(|sum| sum / outputs), parameters })
}

/// The true sizes of what is hidden, as far as the effect has parameters of these names.
fn sizes(case: &Case) -> Vec<String> {
    let texts = case.effects.iter().map(|(_, text)| text.as_str()).chain([case.effect.as_str()]);
    let texts: Vec<&str> = texts.collect();
    let is_there = |name: &str| {
        let mut lines = texts.iter().flat_map(|text| text.lines());
        lines.any(|line| {
            let mut words = line.split_whitespace();
            words.next() == Some("parameter") && words.next() == Some(name)
        })
    };
    let sizes = case.train.sizes.iter();
    let set = sizes.filter_map(|(name, size)| {
        let (name, unit) = name.split_once(' ').unwrap_or((name, "[1]"));
        is_there(name).then(|| format!("{name}={size} {unit}"))
    });
    set.collect()
}
