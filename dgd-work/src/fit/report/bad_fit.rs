//! Whether a fit is bad however its search ended: what is said before all else.

use serde_json::Value;

use crate::output::quantity::short;

/// A fit whose residuals are twice the declared noise, in their squares four times, is bad.
const BAD: f64 = 4.0;

/// A fit in percent below which an output is followed worse than by its mean, in training. One that does not move is
/// followed no better than by its mean by any model, to within what noise makes of that.
const WORSE_THAN_MEAN: f64 = -10.0;

/// Why a fit is bad, from its `result.json`; nothing where it is not.
pub(crate) fn why_bad(json: &Value) -> Option<String> {
    let outputs = json["outputs"].as_object().into_iter().flatten();
    let is_worse = |output: &Value| {
        let percent = output["quality"]["train"]["fit_percent"].as_f64();
        output["fitted"] != false && percent.is_some_and(|percent| percent < WORSE_THAN_MEAN)
    };
    let worse = outputs.filter(|(_, output)| is_worse(output));
    let worse: Vec<String> = worse.map(|(name, _)| format!("`{name}`")).collect();
    match worse.as_slice() {
        [] => {}
        [one] => return Some(format!("the model follows {one} worse than its mean does")),
        all => {
            return Some(format!("the model follows {} worse than their means do", all.join(", ")));
        }
    }
    let chi = json["reduced_chi_square"].as_f64()?;
    (exceeds_noise(json) && chi > BAD)
        .then(|| format!("the residuals are {} times the declared noise", short(chi.sqrt(), 2)))
}

/// Whether residuals are larger than the declared noise by more than chance makes them.
pub(crate) fn exceeds_noise(json: &Value) -> bool {
    json["left_over"]["exceeds_declared_noise"] == true
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn what_is_bad_is_named_and_what_is_not_is_left() {
        let fit = |percent: f64, chi: f64, exceeds: bool| {
            why_bad(&json!({
                "outputs": {
                    "y": { "fitted": true, "quality": { "train": { "fit_percent": percent } } },
                    "z": { "fitted": false, "quality": { "train": { "fit_percent": -300.0 } } },
                },
                "reduced_chi_square": chi,
                "left_over": { "exceeds_declared_noise": exceeds },
            }))
        };
        assert_eq!(fit(90.0, 1.2, true), None);
        assert_eq!(fit(-1.0, 1.0, false), None);
        // Noise that is not declared is what the fit leaves.
        assert_eq!(fit(50.0, 25.0, false), None);
        let words = fit(50.0, 25.0, true).expect("five times the noise");
        assert_eq!(words, "the residuals are 5 times the declared noise");
        let words = fit(-40.0, 1.0, false).expect("worse than nothing");
        assert_eq!(words, "the model follows `y` worse than its mean does");
        assert_eq!(why_bad(&json!({ "outputs": { "y": { "rms_train": 1.0 } } })), None);
    }
}
