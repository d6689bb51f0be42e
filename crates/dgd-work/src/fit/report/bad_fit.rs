//! Detects a bad fit, whatever the outcome of its search; the report begins with it.

use std::fmt;

use super::quality::RARE;
use crate::output::quantity::short;
use crate::result::fit::{FitDocument, OutputEntry, QualityEntry};

/// A fit whose residuals exceed the declared noise by more than this factor is bad.
const BAD: f64 = 2.0;

/// A fit in percent below which an output is matched worse than by its mean, in training: 0 within the accuracy of a
/// converged search.
const WORSE_THAN_MEAN: f64 = -1e-3;

/// The reason why a fit is bad.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum BadFit {
    /// The means of these outputs are closer to the measurements than the model is.
    WorseThanMean(Vec<String>),
    /// The residuals of all outputs are this many times their declared noise, as a root mean square.
    AboveNoise(f64),
    /// The residuals of some outputs are this many times their declared noise.
    SomeAboveNoise(Vec<(String, f64)>),
}

impl BadFit {
    /// `None` if the fit is not bad.
    pub(crate) fn find(result: &FitDocument) -> Option<Self> {
        let outputs = || result.outputs.iter().filter(|(_, output)| output.fitted != Some(false));
        let is_worse = |output: &OutputEntry| {
            let percent = training_quality(output).and_then(|quality| quality.fit_percent);
            percent.is_some_and(|percent| percent < WORSE_THAN_MEAN)
        };
        let worse = outputs().filter(|(_, output)| is_worse(output));
        let worse: Vec<String> = worse.map(|(name, _)| name.clone()).collect();
        if !worse.is_empty() {
            return Some(BadFit::WorseThanMean(worse));
        }
        let judged = outputs().filter_map(|(name, output)| {
            let samples = training_quality(output).map_or(1, |quality| quality.samples);
            Some((name, output.over_declared_noise.as_ref()?, samples as f64))
        });
        let judged: Vec<_> = judged.collect();
        let tests = judged.len() as f64;
        let larger = judged
            .iter()
            .filter(|(_, excess, _)| excess.times > BAD && excess.p_value * tests < RARE);
        let larger: Vec<(String, f64)> =
            larger.map(|(name, excess, _)| ((*name).to_owned(), excess.times)).collect();
        if larger.is_empty() {
            return None;
        }
        if larger.len() < outputs().count() {
            return Some(BadFit::SomeAboveNoise(larger));
        }
        let samples: f64 = judged.iter().map(|(.., samples)| samples).sum();
        let squares: f64 =
            judged.iter().map(|(_, excess, samples)| samples * excess.times * excess.times).sum();
        Some(BadFit::AboveNoise((squares / samples).sqrt()))
    }
}

fn training_quality(output: &OutputEntry) -> Option<&QualityEntry> {
    output.quality.as_ref()?.train.as_ref()
}

impl fmt::Display for BadFit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BadFit::WorseThanMean(outputs) => match outputs.as_slice() {
                [one] => write!(formatter, "the model follows `{one}` worse than its mean does"),
                all => {
                    let names: Vec<String> = all.iter().map(|name| format!("`{name}`")).collect();
                    let names = names.join(", ");
                    write!(formatter, "the model follows {names} worse than their means do")
                }
            },
            BadFit::AboveNoise(times) => {
                let times = short(*times, 2);
                write!(formatter, "the residuals are {times} times the declared noise")
            }
            BadFit::SomeAboveNoise(outputs) => match outputs.as_slice() {
                [(name, times)] => {
                    let times = short(*times, 2);
                    write!(
                        formatter,
                        "the residuals of `{name}` are {times} times the declared noise"
                    )
                }
                all => {
                    for (k, (name, times)) in all.iter().enumerate() {
                        let times = short(*times, 2);
                        if k == 0 {
                            let noise = "times the declared noise of";
                            write!(formatter, "the residuals are {times} {noise} `{name}`")?;
                        } else {
                            write!(formatter, ", {times} times that of `{name}`")?;
                        }
                    }
                    Ok(())
                }
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::result::fit::tests::with;

    fn sentence(outputs: &Value) -> Option<String> {
        BadFit::find(&with(&json!({ "outputs": outputs }))).map(|reason| reason.to_string())
    }

    fn output(fitted: bool, percent: f64, excess: Option<(f64, f64)>) -> Value {
        let quality = json!({
            "samples": 9, "r_squared": null, "fit_percent": percent, "mse": 1.0, "mse_unit": "m²", "bias": 0.0,
            "whiteness": null, "inputs": {},
        });
        let excess = excess.map(|(times, p_value)| json!({ "times": times, "p_value": p_value }));
        json!({
            "unit": "m", "fitted": fitted, "over_declared_noise": excess, "rms_train": 1.0, "rms_valid": null,
            "quality": { "train": quality, "valid": null },
        })
    }

    #[test]
    fn a_bad_fit_is_named_with_its_reason() {
        let fit = |percent: f64, times: f64, p_value: f64| {
            sentence(&json!({
                "y": output(true, percent, Some((times, p_value))),
                "z": output(false, -300.0, None),
                "without": output(true, 50.0, None),
            }))
        };
        assert_eq!(fit(90.0, 1.2, 1e-9), None);
        assert_eq!(fit(0.0, 1.0, 0.5), None);
        // A few samples may do so by chance.
        assert_eq!(fit(50.0, 2.5, 0.02), None);
        let words = fit(50.0, 5.0, 1e-9).expect("five times the noise");
        assert_eq!(words, "the residuals of `y` are 5 times the declared noise");
        let words = fit(-1.0, 1.0, 0.5).expect("worse than nothing");
        assert_eq!(words, "the model follows `y` worse than its mean does");
        let above = |times: f64| output(true, 50.0, Some((times, 0.0)));
        let reason = sentence(&json!({ "a": above(3.0), "b": above(4.0) }));
        // √(25/2).
        assert_eq!(reason.as_deref(), Some("the residuals are 3.5 times the declared noise"));
        let both = sentence(&json!({ "a": above(3.0), "b": above(17.0), "c": above(1.0) }));
        let words = "the residuals are 3 times the declared noise of `a`, 17 times that of `b`";
        assert_eq!(both.as_deref(), Some(words));
    }
}
