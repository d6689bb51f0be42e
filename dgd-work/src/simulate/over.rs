//! Outputs drawn over another quantity than time, as characteristic curves are.

use dgd_plot::{Figure, Panel, Series, Style, Text};
use dgd_runtime::Signature;

use super::Simulated;
use crate::error::{WorkError, meant};
use crate::output::Kind;
use crate::output::columns::{in_unit, is_element};

/// Checks before anything is computed that there is such a quantity.
pub(super) fn verify(name: &str, signature: &Signature) -> Result<(), WorkError> {
    let inputs = signature.inputs.iter().map(|input| input.name.to_string());
    let unknowns = signature.unknowns.iter().map(|unknown| unknown.name.to_string());
    let unknowns = unknowns.filter(|name| !is_element(name));
    let outputs = signature.outputs.iter().map(|output| output.name.to_string());
    let known: Vec<String> = inputs.chain(unknowns).chain(outputs).collect();
    if known.iter().any(|known| known == name) {
        return Ok(());
    }
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    let help = meant(name, &known);
    let message = format!("`--over {name}`: no input, state or output is called so; {help}");
    Err(WorkError::Usage(message))
}

/// A panel for each unit of the outputs, over a column of the result. What was measured at a row of
/// the result is a dot there, over what was measured of that column if it was.
pub(super) fn figure(name: &str, simulated: &Simulated) -> Option<Figure> {
    let times = &simulated.table.times;
    let abscissa = simulated.table.columns.iter().find(|column| column.name == name)?;
    let x = abscissa.in_unit();
    let measured = |i: usize| {
        let samples = simulated.measured.outputs.get(i)?.as_ref()?;
        Some(measured_at(times, &simulated.measured.times, samples))
    };
    let outputs = || simulated.of_kind(Kind::Output);
    let measured_x = (outputs().position(|output| output.name == name))
        .and_then(measured)
        .map_or_else(|| x.clone(), |samples| in_unit(&samples, &abscissa.unit));
    let mut panels: Vec<Panel> = Vec::new();
    for (i, output) in outputs().enumerate() {
        if output.name == name {
            continue;
        }
        let label = Text::default().with_unit(&output.unit.symbol);
        let at = panels.iter().position(|panel| panel.y_label == label).unwrap_or_else(|| {
            panels.push(Panel { y_label: label, ..Panel::default() });
            panels.len() - 1
        });
        let panel = &mut panels[at];
        panel.series.push(Series {
            name: Text::name(&output.name),
            style: Style::Line,
            x: x.clone(),
            y: output.in_unit(),
        });
        if let Some(samples) = measured(i) {
            panel.series.push(Series {
                name: Text::plain(&format!("{} measured", output.name)),
                style: Style::Dots,
                x: measured_x.clone(),
                y: in_unit(&samples, &output.unit),
            });
        }
    }
    for panel in &mut panels {
        // A legend names two and more.
        if let [only] = panel.series.as_slice() {
            panel.title = only.name.clone();
        }
    }
    Some(Figure::new(Text::name(name).with_unit(&abscissa.unit.symbol), panels))
}

/// Samples at the rows that have one; NaN, which is not drawn, elsewhere. Of two rows with one time, the
/// sides of a jump, the second has the second sample of that time, if there are two.
pub(super) fn measured_at(rows: &[f64], times: &[f64], samples: &[f64]) -> Vec<f64> {
    let sample = |(at, row): (usize, &f64)| {
        let first = times.partition_point(|time| time < row);
        let end = times.partition_point(|time| time <= row);
        let side = usize::from(at > 0 && rows[at - 1] == *row);
        if first == end { f64::NAN } else { samples[(first + side).min(end - 1)] }
    };
    rows.iter().enumerate().map(sample).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_rows_with_a_sample_have_one() {
        let found = measured_at(&[0.0, 0.5, 1.0, 3.0], &[0.0, 1.0, 2.0], &[5.0, 6.0, 7.0]);
        assert_eq!(found[0], 5.0);
        assert!(found[1].is_nan() && found[3].is_nan());
        assert_eq!(found[2], 6.0);
    }

    #[test]
    fn both_sides_of_a_jump_are_drawn() {
        let times = [0.0, 1.0, 1.0, 2.0];
        let samples = [5.0, 6.0, 7.0, 8.0];
        assert_eq!(measured_at(&times, &times, &samples), samples);
        // A result that jumps where the samples do not, and the other way round.
        assert_eq!(measured_at(&[0.0, 0.0, 1.0], &times, &samples), [5.0, 5.0, 6.0]);
    }
}
