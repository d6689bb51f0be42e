//! How good an answer is, and the table of all.

use std::fmt::Write;

use dgd_discover::{Discovery, Verdict};

use crate::cases::{Case, Kind};
use crate::drilling_rig::Pair;
use crate::drilling_rig::effects::{Effect, LIBRARY};
use crate::drilling_rig::plant::LPM;
use crate::drilling_rig::recording::ACTIVE;
use crate::drilling_rig::sensors::Noise;

/// More alternatives than that do not count as an answer.
const MOST_ALTERNATIVES: usize = 2;
/// An onset is found within so many seconds.
const ONSET: f64 = 60.0;

/// How good the answer to one case is.
#[derive(Debug, Clone)]
pub(crate) struct Score {
    case: String,
    kind: Kind,
    verdict: &'static str,
    named: Vec<String>,
    pub(crate) is_exact: bool,
    /// Right within the alternatives.
    is_within: bool,
    /// Names that the answer leaves open for each effect, on average.
    names: f64,
    /// Largest validation error of any output over its sensor's noise.
    gap: f64,
    /// Distance of the onset, s, where there is one.
    onset: Option<f64>,
    /// Intersection over union of windows, where the truth has some.
    overlap: Option<f64>,
    seconds: f64,
    /// Whether another seed and number of threads say the same, where that was tried.
    pub(crate) is_repeatable: Option<bool>,
}

impl Score {
    pub(crate) const HEADER: &str =
        "case,verdict,named,exact,within_alternatives,names,gap,onset_error [s],overlap,seconds";

    pub(crate) fn new(case: &Case, pair: &Pair, found: &Discovery, seconds: f64) -> Score {
        let truth: Vec<&str> = case.scenario.effects.iter().map(Effect::name).collect();
        let mut wanted: Vec<&str> = truth.iter().copied().filter(|name| *name != "?").collect();
        let mut named: Vec<&str> = found.effects.iter().map(|e| e.name.as_str()).collect();
        wanted.sort_unstable();
        named.sort_unstable();
        let is_verdict = (found.verdict == Verdict::Sufficient) == (case.kind == Kind::Nothing);
        let is_named_right = match case.kind {
            Kind::Outside => !named.iter().any(|name| LIBRARY.contains(name)),
            _ => named == wanted,
        };
        let is_exact = is_verdict && is_named_right;
        let classes: Vec<Vec<&str>> = found
            .effects
            .iter()
            .map(|effect| {
                let others = effect.alternatives.iter().map(|other| other.name.as_str());
                std::iter::once(effect.name.as_str()).chain(others).collect()
            })
            .collect();
        let is_in = |name: &&str| {
            classes.iter().any(|c| c.contains(name) && c.len() <= 1 + MOST_ALTERNATIVES)
        };
        let is_within = is_exact
            || (!wanted.is_empty() && named.len() == wanted.len() && wanted.iter().all(is_in));
        let sizes = classes.iter().map(Vec::len).sum::<usize>();
        let names = if classes.is_empty() { 1.0 } else { sizes as f64 / classes.len() as f64 };
        let onset = case.scenario.effects.iter().find_map(Effect::onset);
        let onset = onset.filter(|_| !found.effects.is_empty()).map(|truth| {
            let found = found.effects.iter().filter_map(|effect| effect.onset);
            found.map(|found| (found - truth).abs()).fold(f64::INFINITY, f64::min)
        });
        let truth = pair.rig.plant.booster_line.map(|_| pair.train.windows(ACTIVE));
        let overlap = truth.filter(|truth| !truth.is_empty() && !found.effects.is_empty());
        let overlap = overlap.map(|truth| {
            let of = |windows: &[[f64; 2]]| overlap_of(windows, &truth, pair.train.rows.len());
            found.effects.iter().map(|effect| of(&effect.windows)).fold(0.0, f64::max)
        });
        Score {
            case: case.name.clone(),
            kind: case.kind,
            verdict: found.verdict.word(),
            named: named.iter().map(|name| (*name).to_owned()).collect(),
            is_exact,
            is_within,
            names,
            gap: gap(case, found),
            onset,
            overlap,
            seconds,
            is_repeatable: None,
        }
    }

    fn said(&self) -> String {
        if self.named.is_empty() { self.verdict.to_owned() } else { self.named.join("+") }
    }

    /// For the terminal.
    pub(crate) fn line(&self) -> String {
        let grade = match (self.is_exact, self.is_within) {
            (true, _) => "exact",
            (_, true) => "within",
            _ => "WRONG",
        };
        let mut line = format!("{:48} {grade:6} {:40}", self.case, self.said());
        let _ = write!(line, " gap {:.2}  {:.1} s", self.gap, self.seconds);
        if let Some(onset) = self.onset {
            let _ = write!(line, "  onset {onset:.0} s");
        }
        if let Some(overlap) = self.overlap {
            let _ = write!(line, "  overlap {overlap:.2}");
        }
        line
    }

    /// For a file.
    pub(crate) fn row(&self) -> String {
        let number = |value: Option<f64>| value.map(|v| format!("{v:.3}")).unwrap_or_default();
        format!(
            "{},{},{},{},{},{:.2},{:.3},{},{},{:.2}",
            self.case,
            self.verdict,
            self.named.join("+"),
            self.is_exact,
            self.is_within,
            self.names,
            self.gap,
            number(self.onset),
            number(self.overlap),
            self.seconds
        )
    }
}

/// The largest validation error over the noise of the rig's own sensors.
fn gap(case: &Case, found: &Discovery) -> f64 {
    let Noise { p_r, p_in, p_out, q_ssp } = case.scenario.noise;
    let rough = case.scenario.roughness;
    let ratio = |gap: &dgd_discover::OutputGap| {
        let (white, step) = match gap.output.as_str() {
            "p_r" => (p_r, rough.steps.map_or(0.0, |[step, _]| step * 1e5)),
            "p_in" => (p_in, rough.steps.map_or(0.0, |[step, _]| step * 1e5)),
            "p_out" => (p_out, rough.steps.map_or(0.0, |[step, _]| step * 1e5)),
            _ => (q_ssp, rough.steps.map_or(0.0, |[_, step]| step * LPM)),
        };
        // Coloured noise is as large as the white one; rounding adds q²/12.
        let parts = if rough.memory.is_some() { 2.0 } else { 1.0 };
        gap.valid_after / (parts * white * white + step * step / 12.0).sqrt()
    };
    found.gap.iter().map(ratio).fold(0.0, f64::max)
}

/// Intersection over union, by seconds.
fn overlap_of(found: &[[f64; 2]], truth: &[(usize, usize)], seconds: usize) -> f64 {
    let (mut both, mut any) = (0_u32, 0_u32);
    for k in 0..seconds {
        let t = k as f64;
        let is_found = found.iter().any(|[from, until]| (from.floor()..=*until).contains(&t));
        let is_true = truth.iter().any(|(from, until)| (*from..=*until).contains(&k));
        both += u32::from(is_found && is_true);
        any += u32::from(is_found || is_true);
    }
    f64::from(both) / f64::from(any.max(1_u32))
}

/// The table of what is promised, with what was reached.
pub(crate) fn table(scores: &[Score], hard: bool) -> String {
    let mut text = String::new();
    let mut line = |what: &str, value: Option<f64>, promised: &str, is_met: bool| {
        let value = value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"));
        let met = if value == "-" {
            "not tried"
        } else if is_met {
            "met"
        } else {
            "MISSED"
        };
        let _ = writeln!(text, "{what:58} {value:>7}  {promised:10} {met}");
    };
    let of = |kinds: &[Kind]| -> Vec<&Score> {
        scores.iter().filter(|score| kinds.contains(&score.kind)).collect()
    };
    let share = |scores: &[&Score], is: &dyn Fn(&Score) -> bool| {
        let count = scores.iter().filter(|score| is(score)).count();
        (!scores.is_empty()).then(|| count as f64 / scores.len() as f64)
    };
    let at_least = |value: Option<f64>, least: f64| value.is_none_or(|value| value >= least);
    let at_most = |value: Option<f64>, most: f64| value.is_none_or(|value| value <= most);

    let hidden = of(&[Kind::One, Kind::Two]);
    let exact = share(&hidden, &|score| score.is_exact);
    let least = if hard { 0.75 } else { 0.92 };
    line("exact names", exact, if hard { ">= 0.75" } else { ">= 0.92" }, at_least(exact, least));
    let within = share(&hidden, &|score| score.is_within);
    let least = if hard { 0.95 } else { 0.98 };
    line(
        "right within at most two alternatives each",
        within,
        if hard { ">= 0.95" } else { ">= 0.98" },
        at_least(within, least),
    );
    let answered: Vec<f64> =
        scores.iter().filter(|s| !s.named.is_empty()).map(|s| s.names).collect();
    let names =
        (!answered.is_empty()).then(|| answered.iter().sum::<f64>() / answered.len() as f64);
    line("names per answer, on average", names, "<= 1.5", at_most(names, 1.5));
    let nothing = of(&[Kind::Nothing]);
    let alarms = share(&nothing, &|score| !score.is_exact);
    line(
        &format!("false alarms with nothing hidden, share of {}", nothing.len()),
        alarms,
        "0",
        at_most(alarms, 0.0),
    );
    let outside = share(&of(&[Kind::Outside]), &|score| score.is_exact);
    line("outside the library: no wrong name", outside, ">= 0.9", at_least(outside, 0.9));
    let both = share(&of(&[Kind::Two]), &|score| score.is_exact);
    line("two effects: both named", both, ">= 0.9", at_least(both, 0.9));
    let gaps: Vec<f64> = hidden.iter().map(|score| score.gap).collect();
    line(
        "validation error over the noise, median",
        median(gaps),
        "<= 1.10",
        at_most(median(hidden.iter().map(|score| score.gap).collect()), 1.10),
    );
    let small = share(&hidden, &|score| score.gap <= 1.5);
    line("validation error at most 1.5 times the noise", small, ">= 0.95", at_least(small, 0.95));
    let onsets: Vec<&Score> = scores.iter().filter(|score| score.onset.is_some()).collect();
    let near = share(&onsets, &|score| score.onset.is_some_and(|onset| onset <= ONSET));
    line("onset within 60 s", near, ">= 0.9", at_least(near, 0.9));
    let overlap = median(scores.iter().filter_map(|score| score.overlap).collect());
    line("windows, intersection over union, median", overlap, ">= 0.7", at_least(overlap, 0.7));
    let seconds = median(scores.iter().map(|score| score.seconds).collect());
    line("seconds per case on one thread, median", seconds, "<= 5", at_most(seconds, 5.0));
    let repeated: Vec<&Score> = scores.iter().filter(|s| s.is_repeatable.is_some()).collect();
    let same = share(&repeated, &|score| score.is_repeatable == Some(true));
    line("same with another seed and two threads", same, "1", at_least(same, 1.0));
    text
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
