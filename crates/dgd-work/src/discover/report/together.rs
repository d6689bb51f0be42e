//! The quantities that a missing term correlates with, as text and JSON.

use dgd_discover::{CorrelatedQuantity, TraceCourse};

use super::guess::held_out;
use super::result_json::number;
use crate::output::quantity::rounded;
use crate::result::discover::CourseEntry;

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
pub(super) fn entry(together: &CorrelatedQuantity) -> CourseEntry {
    let course = match together.course {
        TraceCourse::Rises => "rises",
        TraceCourse::Falls => "falls",
        TraceCourse::Turns => "turns",
    };
    CourseEntry {
        quantity: together.quantity.clone(),
        course: course.to_owned(),
        r2_held_out: number(together.r2),
        held_out: held_out(together.is_of_recordings).to_owned(),
    }
}
