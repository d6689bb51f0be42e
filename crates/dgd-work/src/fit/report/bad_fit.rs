//! Detects a bad fit, whatever the outcome of its search; the report begins with it.

use serde_json::Value;

use super::quality::RARE;
use crate::output::quantity::short;

/// A fit whose residuals exceed the declared noise by more than this factor is bad.
const BAD: f64 = 2.0;

/// A fit in percent below which an output is matched worse than by its mean, in training: 0 within the accuracy of a
/// converged search.
const WORSE_THAN_MEAN: f64 = -1e-3;

/// Why a fit is bad, from its `result.json`; `None` if it is not.
pub(crate) fn why_bad(json: &Value) -> Option<String> {
    let outputs = json["outputs"].as_object().into_iter().flatten();
    let outputs: Vec<(&String, &Value)> =
        outputs.filter(|(_, output)| output["fitted"] != false).collect();
    let is_worse = |output: &Value| {
        let percent = output["quality"]["train"]["fit_percent"].as_f64();
        percent.is_some_and(|percent| percent < WORSE_THAN_MEAN)
    };
    let worse = outputs.iter().filter(|(_, output)| is_worse(output));
    let worse: Vec<String> = worse.map(|(name, _)| format!("`{name}`")).collect();
    match worse.as_slice() {
        [] => {}
        [one] => return Some(format!("the model follows {one} worse than its mean does")),
        all => {
            return Some(format!("the model follows {} worse than their means do", all.join(", ")));
        }
    }
    let excess = |output: &Value| {
        let excess = &output["over_declared_noise"];
        Some((excess["times"].as_f64()?, excess["p_value"].as_f64()?))
    };
    let judged = outputs.iter().filter_map(|(name, output)| {
        let (times, p_value) = excess(output)?;
        let samples = output["quality"]["train"]["samples"].as_f64().unwrap_or(1.0);
        Some((name, times, p_value, samples))
    });
    let judged: Vec<_> = judged.collect();
    let tests = judged.len() as f64;
    let is_larger = |times: f64, p_value: f64| times > BAD && p_value * tests < RARE;
    let larger = judged.iter().filter(|(_, times, p_value, _)| is_larger(*times, *p_value));
    let larger: Vec<(&str, f64)> =
        larger.map(|(name, times, ..)| (name.as_str(), *times)).collect();
    let ((first, times), others) = larger.split_first()?;
    if larger.len() == outputs.len() {
        let sum = |of: fn(f64) -> f64| -> f64 {
            judged.iter().map(|(_, times, _, samples)| samples * of(*times)).sum()
        };
        let times = (sum(|times| times * times) / sum(|_| 1.0)).sqrt();
        return Some(format!("the residuals are {} times the declared noise", short(times, 2)));
    }
    let times = short(*times, 2);
    if others.is_empty() {
        return Some(format!("the residuals of `{first}` are {times} times the declared noise"));
    }
    let others = others.iter();
    let others =
        others.map(|(name, times)| format!(", {} times that of `{name}`", short(*times, 2)));
    let others: String = others.collect();
    Some(format!("the residuals are {times} times the declared noise of `{first}`{others}"))
}

/// Whether residuals exceed the declared noise by more than chance explains.
pub(crate) fn exceeds_noise(json: &Value) -> bool {
    json["left_over"]["exceeds_declared_noise"] == true
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn what_is_bad_is_named_and_what_is_not_is_left() {
        let fit = |percent: f64, times: f64, p_value: f64| {
            why_bad(&json!({
                "outputs": {
                    "y": {
                        "fitted": true,
                        "quality": { "train": { "fit_percent": percent } },
                        "over_declared_noise": { "times": times, "p_value": p_value },
                    },
                    "z": { "fitted": false, "quality": { "train": { "fit_percent": -300.0 } } },
                    "without": { "fitted": true, "over_declared_noise": null },
                },
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
        assert_eq!(why_bad(&json!({ "outputs": { "y": { "rms_train": 1.0 } } })), None);
        let over =
            |times: f64| json!({ "over_declared_noise": { "times": times, "p_value": 0.0 } });
        let reason = why_bad(&json!({ "outputs": { "a": over(3.0), "b": over(4.0) } }));
        // √(25/2).
        assert_eq!(reason.as_deref(), Some("the residuals are 3.5 times the declared noise"));
        let outputs = json!({ "a": over(3.0), "b": over(17.0), "c": over(1.0) });
        let both = why_bad(&json!({ "outputs": outputs }));
        let words = "the residuals are 3 times the declared noise of `a`, 17 times that of `b`";
        assert_eq!(both.as_deref(), Some(words));
    }
}
