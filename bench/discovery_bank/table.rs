//! The table of all answers.

use std::fmt::Write as _;

use crate::bank::Kind;
use crate::score::{Mark, Score};

/// A table for each kind of case.
pub(crate) fn of(scores: &[Score]) -> String {
    let mut text = String::new();
    for kind in Kind::ALL {
        let of_kind: Vec<&Score> = scores.iter().filter(|score| score.kind == kind).collect();
        if of_kind.is_empty() {
            continue;
        }
        let number = of_kind.len();
        let _ = writeln!(text, "{}: {number}", kind.word());
        for (what, count) in rows(kind, &of_kind) {
            let _ = writeln!(text, "  {what:44} {count:4}");
        }
    }
    let mut seconds: Vec<f64> = scores.iter().map(|score| score.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    if let (Some(median), Some(most)) = (seconds.get(seconds.len() / 2), seconds.last()) {
        let _ = writeln!(text, "seconds: median {median:.1}, longest {most:.1}");
    }
    text
}

fn rows(kind: Kind, scores: &[&Score]) -> Vec<(&'static str, usize)> {
    let marked = |mark: Mark| scores.iter().filter(|score| score.mark == mark).count();
    let misnamed = scores.iter().filter(|score| score.is_misnamed).count();
    let mut rows = match kind {
        Kind::Library => vec![
            ("exact", marked(Mark::Right)),
            ("within alternatives", marked(Mark::Within)),
            ("described without a name", marked(Mark::Described)),
            ("unexplained", marked(Mark::Noticed)),
            ("called sufficient", marked(Mark::Missed)),
            ("with a wrong name", misnamed),
            (
                "files of the library mentioned nowhere",
                scores.iter().map(|s| s.unmentioned.len()).sum(),
            ),
        ],
        Kind::Template => vec![
            ("named right", marked(Mark::Right)),
            ("within alternatives", marked(Mark::Within)),
            ("described right without a name", marked(Mark::Described)),
            ("right place only", marked(Mark::Placed)),
            ("unexplained", marked(Mark::Noticed)),
            ("called sufficient", marked(Mark::Missed)),
            ("with a wrong name", misnamed),
        ],
        Kind::Parameter => vec![
            ("named right", marked(Mark::Right)),
            ("law or trace within 10 %", marked(Mark::Traced)),
            ("right parameter, no such law or trace", marked(Mark::Described)),
            ("its equation, or as good a place", marked(Mark::Placed)),
            ("unexplained elsewhere", marked(Mark::Noticed)),
            ("called sufficient", marked(Mark::Missed)),
            ("with a wrong name", misnamed),
        ],
        Kind::Nothing => vec![
            ("called sufficient", marked(Mark::Right)),
            ("false alarms", marked(Mark::Missed)),
            ("false names", misnamed),
        ],
        Kind::Twin => vec![("alike", marked(Mark::Right)), ("not alike", marked(Mark::Missed))],
    };
    rows.push(("without an answer", marked(Mark::Failed)));
    rows
}
