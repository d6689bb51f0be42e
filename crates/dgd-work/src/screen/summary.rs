//! The summary of a screening on a terminal.

use std::fmt::Write;
use std::path::Path;

use dgd_screen::Severity;

use super::notice::{reading, unit_of};
use super::{ScreenedRecording, quoted};
use crate::output::table::{push_table, significant};

/// Intervals listed in a line.
const LISTED: usize = 4;

/// The findings of each recording, then its columns in numbers.
pub(crate) fn text(screened: &[ScreenedRecording], folder: Option<&Path>) -> String {
    let mut text = String::new();
    for (at, one) in screened.iter().enumerate() {
        if at > 0 {
            text.push('\n');
        }
        // Writing to a string cannot fail.
        let _ = push(&mut text, one);
    }
    if let Some(folder) = folder {
        let _ = writeln!(text, "\nreport: {}", folder.join("report.html").display());
    }
    text
}

fn push(text: &mut String, one: &ScreenedRecording) -> std::fmt::Result {
    let seconds = one.times().last().copied().unwrap_or(0.0);
    let rows = one.table.len();
    writeln!(text, "{}: {rows} rows over {} s", one.path.display(), reading(seconds))?;
    writeln!(text, "{}", verdict(one))?;
    for weight in [Severity::Fault, Severity::Remark] {
        for notice in one.notices.iter().filter(|notice| notice.weight == weight) {
            let word = match weight {
                Severity::Fault => "fault",
                Severity::Remark => "remark",
            };
            writeln!(text, "\n{word}: {}", notice.text)?;
            let when = notice.when(LISTED);
            writeln!(text, "  when: {when} ({})", notice.certainty())?;
            if !notice.advice.is_empty() {
                writeln!(text, "  do:   {}", notice.advice)?;
            }
        }
    }
    text.push('\n');
    push_table(text, &columns(one));
    let motion = &one.screening.motion;
    writeln!(
        text,
        "\n{} steady stretches at {} operating points, {} transients (slopes over {} s)",
        motion.steady.len(),
        one.screening.points.len(),
        motion.transients.len(),
        reading(motion.window)
    )?;
    Ok(())
}

/// The verdict in a sentence.
pub(super) fn verdict(one: &ScreenedRecording) -> String {
    let count = |n: usize, word: &str| match n {
        1 => format!("1 {word}"),
        n => format!("{n} {word}s"),
    };
    let (faults, remarks) = (one.count(Severity::Fault), one.count(Severity::Remark));
    match (faults, remarks) {
        (0, 0) => "nothing is wrong with it".to_owned(),
        (0, n) => format!("no fault, {}", count(n, "remark")),
        (n, 0) => count(n, "fault"),
        (n, m) => format!("{}, {}", count(n, "fault"), count(m, "remark")),
    }
}

/// Columns in numbers: range, mean, noise and step.
pub(super) fn columns(one: &ScreenedRecording) -> Vec<[String; 8]> {
    let head = ["column", "unit", "values", "least", "mean", "most", "noise", "step"];
    let mut rows = vec![head.map(str::to_owned)];
    for (column, summary) in one.table.columns.iter().zip(&one.screening.channels) {
        let (low, high) = summary
            .range
            .map_or(("-".to_owned(), "-".to_owned()), |(a, b)| (reading(a), reading(b)));
        let mean = if summary.samples > 0 { reading(summary.mean) } else { "-".to_owned() };
        let noise = summary.noise.map_or("-".to_owned(), |noise| significant(noise.std, 2));
        let step = summary.noise.and_then(|noise| noise.quantisation);
        let step = step.map_or("-".to_owned(), |step| significant(step, 2));
        let unit = unit_of(column.unit.as_ref());
        let unit = if unit.is_empty() { "1".to_owned() } else { unit };
        let samples = summary.samples.to_string();
        rows.push([column.name.clone(), unit, samples, low, mean, high, noise, step]);
    }
    rows
}

/// The columns of a notice as words, for tables.
pub(super) fn subject(channels: &[String]) -> String {
    if channels.is_empty() { "time".to_owned() } else { quoted(channels) }
}
