//! The summary of a discovery on a terminal.

use std::fmt::Write;
use std::path::Path;

use dgd_discover::{
    Alternative, DetectionPower, Discovery, FoundEffect, OutputGap, ParameterValue,
    ResemblingEffect, UnexplainedError, Verdict, WindowCondition,
};

use super::{condition, guess, law, together, verdict};
use crate::output::quantity::{
    UncertainValue, moment, of_differences, percent, probability, rounded, stretches, with_unit,
};

/// Untried templates named for each reason; the report lists all.
const NAMED: usize = 3;

/// The verdict, the effects, the residuals before and after, and the report's folder.
pub(crate) fn text(
    discovery: &Discovery,
    reservations: &[String],
    folder: Option<&Path>,
) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_text(&mut text, discovery, reservations, folder);
    text
}

fn write_text(
    text: &mut String,
    discovery: &Discovery,
    reservations: &[String],
    folder: Option<&Path>,
) -> std::fmt::Result {
    writeln!(text, "{}", verdict::sentence(discovery))?;
    if !discovery.reason.is_empty() {
        writeln!(text, "{}", discovery.reason)?;
    }
    writeln!(text, "{}", verdict::next(discovery))?;
    if says_std_model(discovery) {
        writeln!(text, "{STD_MODEL}")?;
    }
    if let Some(regime) = &discovery.regime {
        writeln!(text, "{}", condition::regime(regime))?;
    }
    for words in reservations {
        writeln!(text, "But {words}.")?;
    }
    for effect in &discovery.effects {
        writeln!(text, "\n{}: {}", effect.name, verdict::place(effect))?;
        write_table(text, &effect_rows(effect), &[])?;
    }
    if let Some(law) = &discovery.law {
        writeln!(text, "\nlaw")?;
        write_table(text, &law::rows(law), &[])?;
    }
    for (k, rival) in discovery.rivals.iter().enumerate() {
        writeln!(text, "\n{}", if k == 0 { "either" } else { "or" })?;
        write_table(text, &law::rival_rows(rival), &[])?;
    }
    for described in &discovery.described {
        writeln!(text, "\nthe recordings look as if there was {}", described.name)?;
        write_table(text, &described_rows(described), &[])?;
    }
    if let Some(reason) = discovery
        .nowhere
        .as_ref()
        .filter(|_| discovery.unexplained.is_empty() && discovery.verdict == Verdict::Unexplained)
    {
        writeln!(text, "\nNo place can be named: {reason}.")?;
    }
    for left in &discovery.unexplained {
        let tie = match left {
            UnexplainedError { is_joint: true, .. } => ", together with the others",
            UnexplainedError { is_tied: true, .. } => ", about as likely",
            _ => "",
        };
        writeln!(text, "\nwithout a name: {}{tie}", left.target)?;
        let mut rows = vec![["what".to_owned(), left.description.clone()]];
        rows.extend(place_rows(left));
        if !left.windows.is_empty() {
            rows.push(["when".to_owned(), stretches(left.windows.iter().copied())]);
        }
        rows.extend(left.condition.as_ref().map(goes_with));
        rows.extend(together::words(&left.together).map(|words| ["course".to_owned(), words]));
        if guess::is_told(discovery) {
            rows.push(["guess".to_owned(), guess::words(left)]);
        }
        write_table(text, &rows, &[])?;
    }
    if !discovery.gap.is_empty() {
        writeln!(text, "\nsimulation error, root mean square")?;
        let head =
            ["output", "unit", "noise", "training", "after", "validation", "after", "over noise"];
        let mut rows = vec![head.map(str::to_owned)];
        rows.extend(discovery.gap.iter().map(gap_row));
        write_table(text, &rows, &[2, 3, 4, 5, 6, 7])?;
    }
    if !discovery.power.is_empty() {
        writeln!(text, "\nthese recordings would have shown")?;
        let shown = |power: &DetectionPower| {
            let unit = of_differences(&power.unit);
            let size = with_unit(rounded(power.smallest / unit.factor, 2), &unit.symbol);
            [power.name.clone(), format!("`{}` from {size}", power.parameter)]
        };
        let rows: Vec<[String; 2]> = discovery.power.iter().map(shown).collect();
        write_table(text, &rows, &[])?;
    }
    let off = discovery
        .gap
        .iter()
        .filter_map(|gap| Some([gap.output.clone(), condition::words(gap.condition.as_ref()?)]));
    let off: Vec<[String; 2]> = off.collect();
    if !off.is_empty() {
        writeln!(text, "\nwhen the base model is off")?;
        write_table(text, &off, &[])?;
    }
    let not_tried = not_tried(discovery, NAMED);
    if !not_tried.is_empty() {
        writeln!(text, "\ntemplates that were not tried")?;
        // Side by side they are wider than a terminal.
        for [names, why] in not_tried {
            writeln!(text, "  {names}\n    {why}")?;
        }
    }
    if let Some(folder) = folder {
        writeln!(text, "\nreport: {}", folder.join("report.html").display())?;
    }
    Ok(())
}

/// The share of the discrepancy that a missing term explains, and the evidence against it.
pub(super) fn place_rows(unexplained: &UnexplainedError) -> Vec<[String; 2]> {
    let mut rows = Vec::new();
    if let Some(left) = unexplained.left {
        let left = format!("{} times the noise variance", rounded(left, 2));
        rows.push(["leaves".to_owned(), left]);
    }
    rows.extend(unexplained.objection.iter().map(|why| ["but".to_owned(), why.clone()]));
    let test = unexplained.told_apart_by.iter();
    rows.extend(test.map(|test| ["told apart by".to_owned(), test.clone()]));
    rows
}

/// Explains the second deviation of a value.
pub(super) const STD_MODEL: &str = "Behind `model ±` stands how far a value may be off for what is left over: how far \
     estimates from parts of the recordings, and from models that do nearly as well, are apart.";

/// Whether a value has a second deviation.
pub(super) fn says_std_model(discovery: &Discovery) -> bool {
    let of_effects = discovery.effects.iter().flat_map(|effect| &effect.parameters);
    let described = discovery.described.iter().flat_map(|described| &described.parameters);
    of_effects.chain(described).any(|parameter| parameter.std_model.is_some())
}

/// Untried templates by reason, with up to `named` names for each.
pub(super) fn not_tried(discovery: &Discovery, named: usize) -> Vec<[String; 2]> {
    let mut by_reason: Vec<(&str, Vec<&str>)> = Vec::new();
    for (name, why) in &discovery.not_tried {
        match by_reason.iter_mut().find(|(other, _)| other == why) {
            Some((_, names)) => names.push(name),
            None => by_reason.push((why, vec![name])),
        }
    }
    let row = |(why, names): &(&str, Vec<&str>)| {
        let shown = names[..names.len().min(named)].join(", ");
        let more = names.len().saturating_sub(named);
        let names = if more > 0 { format!("{shown} and {more} more") } else { shown };
        [names, (*why).to_owned()]
    };
    by_reason.iter().map(row).collect()
}

pub(super) fn described_rows(described: &ResemblingEffect) -> Vec<[String; 2]> {
    let mut rows: Vec<[String; 2]> = described.parameters.iter().map(parameter_row).collect();
    let (training, validation) = described.left;
    let validation = validation
        .map_or_else(String::new, |left| format!(", {} on validation data", rounded(left, 2)));
    let left =
        format!("residuals of {} times the noise variance{validation}", rounded(training, 2));
    rows.push(["leaves".to_owned(), left]);
    rows
}

fn parameter_row(p: &ParameterValue) -> [String; 2] {
    [p.name.clone(), with_unit(UncertainValue::from_parameter(p), &p.unit.symbol)]
}

fn effect_rows(effect: &FoundEffect) -> Vec<[String; 2]> {
    let mut rows: Vec<[String; 2]> = effect.parameters.iter().map(parameter_row).collect();
    if let Some(onset) = effect.onset {
        rows.push(["since".to_owned(), moment(onset)]);
    }
    if !effect.windows.is_empty() {
        rows.push(["active".to_owned(), stretches(effect.windows.iter().copied())]);
    }
    rows.extend(effect.condition.as_ref().map(goes_with));
    for other in &effect.alternatives {
        let ratio = rounded(other.valid_ratio, 3);
        rows.push(["or".to_owned(), format!("{} (rms residual × {ratio})", other.name)]);
    }
    rows.extend(other_forms(effect).map(|forms| ["other forms".to_owned(), forms]));
    if let Some(test) = &effect.told_apart_by {
        rows.push(["told apart by".to_owned(), test.clone()]);
    }
    rows.push(["evidence".to_owned(), evidence(effect)]);
    rows
}

/// Alternative forms listed for an effect.
const FORMS: usize = 3;

/// The other forms of an effect, the best first.
pub(super) fn other_forms(effect: &FoundEffect) -> Option<String> {
    let describe = |other: &Alternative| {
        format!("{} (rms residual × {})", form(other), rounded(other.valid_ratio, 3))
    };
    let mut forms: Vec<String> = effect.other_forms.iter().take(FORMS).map(describe).collect();
    let more = effect.other_forms.len() - forms.len();
    forms.extend((more > 0).then(|| format!("{more} more")));
    (!forms.is_empty()).then(|| forms.join(", "))
}

/// The form of an alternative.
fn form(alternative: &Alternative) -> &str {
    alternative.form.as_deref().unwrap_or("its plain form")
}

/// The row of the condition that coincides with windows.
fn goes_with(condition: &WindowCondition) -> [String; 2] {
    ["happens".to_owned(), condition::words(condition)]
}

/// The evidence for an effect, in one line.
pub(super) fn evidence(effect: &FoundEffect) -> String {
    let evidence = &effect.evidence;
    format!(
        "{} from {} resamples, BIC falls by {}, in {} of resampled recordings",
        probability(evidence.p_value, evidence.resamples),
        evidence.resamples,
        rounded(evidence.bic_gain, 3),
        percent(evidence.inclusion)
    )
}

/// Residuals in the unit of differences: output, unit, noise, training before and after, validation before and after,
/// and the last of them over the noise.
pub(super) fn gap_row(gap: &OutputGap) -> [String; 8] {
    let unit = of_differences(&gap.unit);
    let shown = |error: f64| rounded(error / unit.factor, 2);
    [
        gap.output.clone(),
        if unit.symbol == "1" { "–".to_owned() } else { unit.symbol.to_string() },
        shown(gap.noise),
        shown(gap.train_before),
        shown(gap.train_after),
        shown(gap.valid_before),
        shown(gap.valid_after),
        rounded(gap.valid_after / gap.noise, 2),
    ]
}

/// Rows with aligned columns, indented; those of `right` are right-aligned.
fn write_table<const N: usize>(
    text: &mut String,
    rows: &[[String; N]],
    right: &[usize],
) -> std::fmt::Result {
    let width = |c: usize| rows.iter().map(|row| row[c].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    for row in rows {
        let mut line = String::from(" ");
        for (c, cell) in row.iter().enumerate() {
            let room = widths[c];
            if right.contains(&c) {
                write!(line, " {cell:>room$} ")?;
            } else {
                write!(line, " {cell:<room$} ")?;
            }
        }
        writeln!(text, "{}", line.trim_end())?;
    }
    Ok(())
}
