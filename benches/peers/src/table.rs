//! Times with errors beside them, and ratios at equal error, as Markdown.

use std::fmt::Write as _;

use crate::catalogue::{CASES, Case, DISAGREEMENT, LIMITS, OURS, TARGETS};
use crate::measure::{Cell, Row};
use crate::ratio::{Reach, best, reach};

/// What all peers need for a case; empty where none was run.
pub(crate) fn of_case(case: &Case, rows: &[Row]) -> String {
    let rows: Vec<&Row> = rows.iter().filter(|row| row.case.name == case.name).collect();
    if rows.is_empty() {
        return String::new();
    }
    let mut text = format!("### {}\n\nLeast time (median) / error.\n\n| |", case.title);
    for rtol in case.tolerances {
        let _ = write!(text, " rtol {rtol:.0e} |");
    }
    let middle = case.tolerances.len() / 2;
    let _ = write!(
        text,
        " steps at {:.0e} | at error {:.0e} |\n|---|",
        case.tolerances[middle], case.equal_error
    );
    text += &"---|".repeat(case.tolerances.len() + 2);
    text.push('\n');
    for row in rows {
        let _ = write!(text, "| {} {} |", row.peer, row.method);
        for cell in &row.cells {
            let _ = match cell {
                Ok(Cell { least, median, error, .. }) => {
                    write!(text, " {} ({}) / {error:.1e} |", time(*least), time(*median))
                }
                Err(_) => write!(text, " failed |"),
            };
        }
        let steps = row.cells[middle].as_ref().map_or(0, |cell| cell.steps);
        let steps = if steps == 0 { "-".to_owned() } else { steps.to_string() };
        let at = reach(row).map_or("not reached".to_owned(), reached);
        let _ = writeln!(text, " {steps} | {at} |");
    }
    text.push('\n');
    text
}

/// How many times faster than each peer, against what is to be reached.
pub(crate) fn of_targets(rows: &[Row]) -> String {
    let mut text = String::from(
        "### Ratios at equal error\n\n| | error | dgd | peer | ratio | to reach | |\n|---|---|---|---|---|---|---|\n",
    );
    let before = text.len();
    for target in TARGETS {
        let Some(case) = CASES.iter().find(|case| case.name == target.case) else { continue };
        let was_run = |peer| rows.iter().any(|row| row.case.name == case.name && row.peer == peer);
        if !was_run(OURS) || !was_run(target.peer) {
            continue;
        }
        let ours = best(rows, case.name, OURS, None);
        let theirs = best(rows, case.name, target.peer, target.method);
        let show = |reach: Option<(Reach, &str)>| {
            reach.map_or("not reached".to_owned(), |(time, method)| {
                format!("{method} {}", reached(time))
            })
        };
        let (ratio, verdict) = match (ours, theirs) {
            (Some((ours, _)), Some((theirs, _))) => {
                let ratio = theirs.seconds() / ours.seconds();
                (format!("{ratio:.1}"), if ratio >= target.ratio { "reached" } else { "missed" })
            }
            (Some(_), None) => ("-".to_owned(), "reached: the peer is not that accurate"),
            (None, _) => ("-".to_owned(), "missed"),
        };
        let _ = writeln!(
            text,
            "| {}, {} | {:.0e} | {} | {} | {ratio} | {} | {verdict} |",
            case.name,
            target.peer,
            case.equal_error,
            show(ours),
            show(theirs),
            target.ratio,
        );
    }
    for limit in LIMITS {
        let (Some((dear, _)), Some((cheap, _))) =
            (best(rows, limit.case, OURS, None), best(rows, limit.than, OURS, None))
        else {
            continue;
        };
        let ratio = dear.seconds() / cheap.seconds();
        let verdict = if ratio <= limit.ratio { "reached" } else { "missed" };
        let _ = writeln!(
            text,
            "| {} over {} | | {} | {} | {ratio:.1} | at most {} | {verdict} |",
            limit.case,
            limit.than,
            reached(dear),
            reached(cheap),
            limit.ratio
        );
    }
    if text.len() == before { String::new() } else { text }
}

/// What failed, and who gives another answer than the reference.
pub(crate) fn complaints(rows: &[Row]) -> (Vec<String>, Vec<String>) {
    let (mut failures, mut disagreements) = (Vec::new(), Vec::new());
    for row in rows {
        for (cell, rtol) in row.cells.iter().zip(row.case.tolerances) {
            let what = format!("{}: {} {} at {rtol:.0e}", row.case.name, row.peer, row.method);
            match cell {
                Err(message) => failures.push(format!("{what} failed: {message}")),
                Ok(cell) if cell.error > DISAGREEMENT => {
                    disagreements.push(format!("{what} does not agree: {:.1e}", cell.error));
                }
                Ok(_) => {}
            }
        }
    }
    (failures, disagreements)
}

fn reached(reach: Reach) -> String {
    match reach {
        Reach::Between(seconds) => time(seconds),
        Reach::AtMost(seconds) => format!("≤ {}", time(seconds)),
    }
}

/// Three digits with a unit.
fn time(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s < 1e-3 => (s * 1e6, "µs"),
        s if s < 1.0 => (s * 1e3, "ms"),
        s => (s, "s"),
    };
    let digits = if value < 10.0 { 2 } else { usize::from(value < 100.0) };
    format!("{value:.digits$} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_has_three_digits() {
        assert_eq!(time(7.04e-6), "7.04 µs");
        assert_eq!(time(0.0123), "12.3 ms");
        assert_eq!(time(123.0), "123 s");
    }
}
