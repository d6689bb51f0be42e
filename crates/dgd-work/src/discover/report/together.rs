//! The quantities that a missing term correlates with, as text and JSON.

use dgd_discover::{CorrelatedQuantity, TraceCourse};
use serde_json::{Value, json};

use super::result_json::tidy;
use crate::output::quantity::rounded;

/// As text: ``falls where `z` grows (R² 0.93); R² on other recordings``. Names are between backticks; `None` without a
/// correlation.
pub(super) fn words(all: &[CorrelatedQuantity]) -> Option<String> {
    let first = all.first()?;
    let phrases: Vec<String> = all.iter().map(one).collect();
    let basis = if first.is_of_recordings {
        "on other recordings"
    } else {
        "on parts that the curve was not learnt from"
    };
    Some(format!("{}; R² {basis}", phrases.join(", ")))
}

fn one(together: &CorrelatedQuantity) -> String {
    let CorrelatedQuantity { quantity, course, r2, .. } = together;
    let course = match (course, quantity.as_str()) {
        (TraceCourse::Rises, "time") => "rises over time".to_owned(),
        (TraceCourse::Falls, "time") => "falls over time".to_owned(),
        (TraceCourse::Turns, "time") => "rises and falls over time".to_owned(),
        (TraceCourse::Rises, name) => format!("rises where `{name}` grows"),
        (TraceCourse::Falls, name) => format!("falls where `{name}` grows"),
        (TraceCourse::Turns, name) => format!("rises and falls with `{name}`"),
    };
    format!("{course} (R² {})", rounded(*r2, 2))
}

/// For programs.
pub(super) fn value(all: &[CorrelatedQuantity]) -> Vec<Value> {
    let value = |one: &CorrelatedQuantity| {
        let course = match one.course {
            TraceCourse::Rises => "rises",
            TraceCourse::Falls => "falls",
            TraceCourse::Turns => "turns",
        };
        json!({
            "quantity": one.quantity,
            "course": course,
            "r2_held_out": tidy(one.r2),
            "held_out": if one.is_of_recordings { "recordings" } else { "parts" },
        })
    };
    all.iter().map(value).collect()
}
