//! Times with their errors, and ratios at equal error, as Markdown.

use std::fmt::Write as _;

use crate::catalogue::{BARS, Bar, CASES, Case, DISAGREEMENT, OURS};
use crate::measure::{Cell, Missing, Row};
use crate::ratio::{Reach, best, reach};
use crate::user_crate::{Build, Builds};

/// The results of all peers for a case; empty if none was run.
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
    for row in &rows {
        let _ = write!(text, "| {} {} |", row.peer, row.method);
        for cell in &row.cells {
            let _ = match cell {
                Ok(Cell { least, median, error, .. }) => {
                    write!(text, " {} ({}) / {error:.1e} |", show(*least), show(*median))
                }
                Err(Missing::LeftOut(reason)) => write!(text, " left out: {reason} |"),
                Err(Missing::Failed(_)) => write!(text, " failed |"),
            };
        }
        let steps = row.cells[middle].as_ref().map_or(0, |cell| cell.steps);
        let steps = if steps == 0 { "-".to_owned() } else { steps.to_string() };
        let time = reach(row).map_or("not reached".to_owned(), reached);
        let _ = writeln!(text, " {steps} | {time} |");
    }
    text.push('\n');
    for row in rows {
        let report =
            row.cells.iter().flatten().map(|cell| &cell.says).find(|says| !says.is_empty());
        if let Some(report) = report {
            let _ = writeln!(text, "{} {} says: {report}\n", row.peer, row.method);
        }
    }
    text
}

/// The growth of time and memory with the number of states, between successive cases and overall.
fn growth(cases: &[&str], rows: &[Row]) -> Vec<Growth> {
    let mut growths: Vec<Growth> = Vec::new();
    for row in rows.iter().filter(|row| cases.contains(&row.case.name)) {
        // The tightest tolerance is common to all sizes.
        let Some(Ok(cell)) = row.cells.last() else { continue };
        let Some(states) = row.case.states() else { continue };
        let point = Size { states, time: cell.least, memory: cell.memory };
        match growths.iter_mut().find(|one| (one.peer, one.method) == (row.peer, row.method)) {
            Some(one) => one.sizes.push(point),
            None => {
                growths.push(Growth { peer: row.peer, method: row.method, sizes: vec![point] });
            }
        }
    }
    growths.retain(|growth| growth.sizes.len() > 1);
    growths
}

/// The growth of a method.
struct Growth {
    peer: &'static str,
    method: &'static str,
    /// Two or more, ascending.
    sizes: Vec<Size>,
}

struct Size {
    states: f64,
    time: f64,
    memory: Option<f64>,
}

impl Growth {
    /// Between two sizes: the exponents of time and memory, and the bytes for each additional state.
    fn between(from: &Size, to: &Size) -> (f64, Option<(f64, f64)>) {
        let exponent = |from: f64, to: f64| (to / from).ln();
        let size = exponent(from.states, to.states);
        let memory = from.memory.zip(to.memory).map(|(before, after)| {
            (exponent(before, after) / size, (after - before) / (to.states - from.states))
        });
        (exponent(from.time, to.time) / size, memory)
    }

    /// Between the smallest and the largest size.
    fn overall(&self) -> (f64, Option<(f64, f64)>) {
        Self::between(&self.sizes[0], &self.sizes[self.sizes.len() - 1])
    }
}

/// Exponents of time and memory; empty for fewer than two sizes.
pub(crate) fn of_growth(rows: &[Row]) -> String {
    let mut text = String::new();
    for bar in BARS {
        let Bar::Linear { cases, .. } = bar else { continue };
        for growth in growth(cases, rows) {
            for sizes in growth.sizes.windows(2) {
                let (exponent, memory) = Growth::between(&sizes[0], &sizes[1]);
                let (of_memory, bytes) = memory.unwrap_or((f64::NAN, f64::NAN));
                let _ = writeln!(
                    text,
                    "| {} {} | {:.0} to {:.0} | {exponent:.2} | {of_memory:.2} | {bytes:.0} |",
                    growth.peer, growth.method, sizes[0].states, sizes[1].states,
                );
            }
        }
    }
    if text.is_empty() {
        return text;
    }
    format!(
        "### P3: growth with the number of states\n\nPeak memory of the program; the exponents of small lines are those of all that does not grow.\n\n| | states | exponent of time | exponent of memory | bytes for each further state |\n|---|---|---|---|---|\n{text}\n"
    )
}

/// The targets, and whether they were reached; empty if none was run.
pub(crate) fn of_bars(rows: &[Row], builds: Option<&Builds>) -> String {
    let lines: String = BARS.iter().filter_map(|bar| of_bar(bar, rows, builds)).collect();
    if lines.is_empty() {
        return lines;
    }
    format!(
        "| | at error | dgd | other | ratio | to reach | |\n|---|---|---|---|---|---|---|\n{lines}"
    )
}

/// The lines of a target; `None` if it was not run.
fn of_bar(bar: &Bar, rows: &[Row], builds: Option<&Builds>) -> Option<String> {
    let was_run = |case, peer| rows.iter().any(|row| row.case.name == case && row.peer == peer);
    let ours = |case| best(rows, case, OURS, None);
    match *bar {
        Bar::Faster { case, peer, method, ratio } => {
            let target = CASES.iter().find(|of| of.name == case)?;
            if !was_run(case, OURS) || !was_run(case, peer) {
                return None;
            }
            let theirs = best(rows, case, peer, method);
            let (found, verdict) = match (ours(case), theirs) {
                (Some((ours, _)), Some((theirs, _))) => {
                    let factor = theirs.seconds() / ours.seconds();
                    (format!("{factor:.1}"), verdict(factor >= ratio))
                }
                (Some(_), None) => ("-".to_owned(), "reached: the other is not that accurate"),
                (None, _) => ("-".to_owned(), verdict(false)),
            };
            let show = |reach: Option<(Reach, &str)>| {
                reach.map_or("not reached".to_owned(), |(time, method)| {
                    format!("{method}: {}", reached(time))
                })
            };
            let (error, dgd) = (target.equal_error, show(ours(case)));
            let problem = target.label();
            let theirs = show(theirs);
            Some(format!(
                "| {problem} | {error:.0e} | {dgd} | {peer} {theirs} | {found} | {ratio} | {verdict} |\n"
            ))
        }
        Bar::AtMost { case, than, ratio } => {
            let (dear, cheap) = (ours(case)?.0, ours(than)?.0);
            let factor = dear.seconds() / cheap.seconds();
            let (dear, cheap) = (reached(dear), reached(cheap));
            let verdict = verdict(factor <= ratio);
            let (case, than) = (case.replace('p', "P"), than.replace('p', "P"));
            Some(format!(
                "| {case} over {than} | | {dear} | {than}: {cheap} | {factor:.1} | at most {ratio} | {verdict} |\n"
            ))
        }
        Bar::Threads { one, all } => {
            let (one, all) = (ours(one)?.0, ours(all)?.0);
            let factor = one.seconds() / all.seconds();
            let cores = std::thread::available_parallelism().map_or(1, usize::from);
            let (one, all) = (reached(one), reached(all));
            Some(format!(
                "| P4 by {cores} threads | | {all} | one thread: {one} | {factor:.2} | | |\n"
            ))
        }
        Bar::Loaded { case, compiled, loaded, ratio } => {
            let find = |method| {
                let mut rows = rows.iter().filter(|row| row.case.name == case && row.peer == OURS);
                rows.find(|row| row.method == method)
            };
            let (compiled, loaded) = (find(compiled)?, find(loaded)?);
            // The middle tolerance.
            let middle = compiled.cells.len() / 2;
            let time = |row: &Row| row.cells.get(middle)?.as_ref().ok().map(|cell| cell.least);
            let (fast, slow) = (time(compiled)?, time(loaded)?);
            let factor = slow / fast;
            let case = case.replace('p', "P");
            let rtol = compiled.case.tolerances[middle];
            let verdict = verdict(factor <= ratio);
            let (fast, slow) = (show(fast), show(slow));
            Some(format!(
                "| {case} loaded over compiled | rtol {rtol:.0e} | {slow} | compiled: {fast} | {factor:.1} | at most {ratio} | {verdict} |\n"
            ))
        }
        Bar::Linear { cases, exponent, bytes } => {
            let growths = growth(cases, rows);
            let ours = growths.iter().filter(|growth| growth.peer == OURS);
            let lines = ours.map(|growth| {
                let (time, memory) = growth.overall();
                let (of_memory, found) = memory.unwrap_or((f64::NAN, f64::NAN));
                let reached = time <= exponent && of_memory <= exponent && found <= bytes;
                let (from, to) = (&growth.sizes[0], &growth.sizes[growth.sizes.len() - 1]);
                format!(
                    "| P3, {:.0} to {:.0} states | | {}: {} to {} | | time n^{time:.2}, memory n^{of_memory:.2}, {found:.0} bytes a state | at most n^{exponent}, {bytes} bytes | {} |\n",
                    from.states, to.states, growth.method, show(from.time), show(to.time),
                    verdict(reached),
                )
            });
            Some(lines.collect()).filter(|lines: &String| !lines.is_empty())
        }
        Bar::Says { case, words } => {
            let mut rows = rows.iter().filter(|row| row.case.name == case);
            let report = |row: &Row| row.cells.first()?.as_ref().ok().map(|cell| cell.says.clone());
            let ours = rows.find(|row| row.peer == OURS).and_then(report)?;
            let is_said = |word: &str| ours.split([' ', ':', ';']).any(|part| part == word);
            let reached =
                ours.starts_with("not determined") && words.iter().all(|word| is_said(word));
            let others = rows
                .filter_map(|row| Some(format!("{} {}: {}", row.peer, row.method, report(row)?)));
            let others = others.collect::<Vec<_>>().join("<br>");
            Some(format!(
                "| a fit with c2 and F both free | | {ours} | {others} | | said | {} |\n",
                verdict(reached)
            ))
        }
        Bar::Build { again, first } => {
            let builds = builds?;
            let line = |what: &str, build: &Build, most: f64| {
                format!(
                    "| a user's crate, {what} | | {:.1} s ({:.1} s of processors) | | | at most {most} s | {} |\n",
                    build.time,
                    build.processors,
                    verdict(build.time <= most),
                )
            };
            let (after, nothing) = ("dependencies built", "from nothing");
            Some(line(after, &builds.again, again) + &line(nothing, &builds.first, first))
        }
    }
}

fn verdict(reached: bool) -> &'static str {
    if reached { "reached" } else { "**missed**" }
}

/// Failed runs, and programs whose answers differ from the reference.
pub(crate) fn complaints(rows: &[Row]) -> (Vec<String>, Vec<String>) {
    let (mut failures, mut disagreements) = (Vec::new(), Vec::new());
    for row in rows {
        for (cell, rtol) in row.cells.iter().zip(row.case.tolerances) {
            let what = format!("{}: {} {} at {rtol:.0e}", row.case.name, row.peer, row.method);
            match cell {
                Err(Missing::Failed(message)) => failures.push(format!("{what} failed: {message}")),
                Ok(cell) if cell.error > DISAGREEMENT => {
                    disagreements.push(format!("{what} does not agree: {:.1e}", cell.error));
                }
                Ok(_) | Err(Missing::LeftOut(_)) => {}
            }
        }
    }
    (failures, disagreements)
}

fn reached(reach: Reach) -> String {
    match reach {
        Reach::Between(seconds) => show(seconds),
        Reach::AtMost(seconds, error) => format!("≤ {} ({error:.0e})", show(seconds)),
    }
}

/// Three digits with a unit.
fn show(seconds: f64) -> String {
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
        assert_eq!(show(7.04e-6), "7.04 µs");
        assert_eq!(show(0.0123), "12.3 ms");
        assert_eq!(show(123.0), "123 s");
    }
}
