//! The field's recordings, SI, and what the thesis derives from their columns.

use std::path::Path;

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::source::SourceMap;
use dgd_data::read;

use crate::chapters::Fallible;

/// Acceleration by gravity, m/s².
pub(crate) const G: f64 = 9.81;
/// Density of the mud, kg/m³.
pub(crate) const RHO: f64 = 1120.0;
/// Pressure of the air, Pa.
pub(crate) const P_ATM: f64 = 101_325.0;
/// Inlet and outlet of the subsea pump and the riser's gauge, m below the rig floor.
pub(crate) const H_IN: f64 = 307.0;
pub(crate) const H_OUT: f64 = 302.0;
pub(crate) const H_PR: f64 = 305.0;
/// Cross sections of the riser and of the booster line, m².
pub(crate) const A_R: f64 = std::f64::consts::FRAC_PI_4 * (19.75 * 0.0254) * (19.75 * 0.0254);
pub(crate) const A_B: f64 = 0.0103;
/// A litre per minute, m³/s; a bar, Pa.
pub(crate) const LPM: f64 = 1e-3 / 60.0;
pub(crate) const BAR: f64 = 1e5;

/// A recording of the field.
pub(crate) struct Field {
    pub(crate) times: Vec<f64>,
    columns: Vec<(String, Vec<f64>)>,
}

impl Field {
    /// Reads one of the files in `examples/data/field/`.
    pub(crate) fn read(name: &str) -> Fallible<Field> {
        let file = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join(format!("examples/data/field/{name}.csv.gz"));
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let table = read(&file, &mut sources, &mut diagnostics).map_err(|_| {
            render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain)
        })?;
        let times = table.time.ok_or("a recording has times")?;
        let columns = table.columns.into_iter().map(|column| {
            let unit = column.unit.ok_or_else(|| format!("`{}` has no unit", column.name))?;
            let values = column.values.iter().map(|value| unit.to_si(*value)).collect();
            Ok((column.name, values))
        });
        Ok(Field { times, columns: columns.collect::<Fallible<_>>()? })
    }

    /// The part between two times, which begins at its own time zero.
    pub(crate) fn between(&self, from: f64, until: f64) -> Field {
        let [a, b] = [from, until].map(|t| self.times.partition_point(|time| *time < t));
        let columns =
            self.columns.iter().map(|(name, values)| (name.clone(), values[a..b].to_vec()));
        let times = self.times[a..b].iter().map(|t| t - self.times[a]).collect();
        Field { times, columns: columns.collect() }
    }

    /// A column.
    pub(crate) fn column(&self, name: &str) -> &[f64] {
        let column = self.columns.iter().find(|(other, _)| other == name);
        column.map_or(&[], |(_, values)| values.as_slice())
    }

    /// The same with another column, by the place of the sample and what was read.
    #[cfg(test)]
    pub(crate) fn changed(&self, name: &str, value: impl Fn(usize, f64) -> f64) -> Field {
        let mut columns = self.columns.clone();
        for (_, values) in columns.iter_mut().filter(|(other, _)| other == name) {
            values.iter_mut().enumerate().for_each(|(k, read)| *read = value(k, *read));
        }
        Field { times: self.times.clone(), columns }
    }

    /// All columns by name.
    pub(crate) fn columns(&self) -> Vec<(&str, &[f64])> {
        self.columns.iter().map(|(name, values)| (name.as_str(), values.as_slice())).collect()
    }

    pub(crate) fn len(&self) -> usize {
        self.times.len()
    }

    /// Pressure behind the pump, by both of its sensors (section 3.3.1).
    pub(crate) fn outlet(&self) -> Vec<f64> {
        let pairs = self.column("p_out_A").iter().zip(self.column("p_out_B"));
        pairs.map(|(a, b)| f64::midpoint(*a, *b)).collect()
    }

    /// Level of the riser, m, by inlet sensor A.
    pub(crate) fn level(&self) -> Vec<f64> {
        self.column("p_in_A").iter().map(|p| H_IN - p / (RHO * G)).collect()
    }

    /// Head of the pump, m: (p_out − p_in)/(ρ g).
    pub(crate) fn head(&self) -> Vec<f64> {
        let pairs = self.outlet().into_iter().zip(self.column("p_in_A"));
        pairs.map(|(outlet, inlet)| (outlet - inlet) / (RHO * G)).collect()
    }

    /// Friction of the return line, Pa: ΔP − ΔG(h_r), ΔG = ρ g (h_out − h_in + h_r) (3.6, 3.7).
    pub(crate) fn friction(&self) -> Vec<f64> {
        let pairs = self.head().into_iter().zip(self.level());
        pairs.map(|(head, level)| RHO * G * (head - (H_OUT - H_IN + level))).collect()
    }
}

/// The mean of some values.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The mean of each value and those up to `half` before and behind it.
pub(crate) fn smoothed(values: &[f64], half: usize) -> Vec<f64> {
    let window = |k: usize| k.saturating_sub(half)..(k + half + 1).min(values.len());
    (0..values.len()).map(|k| mean(&values[window(k)])).collect()
}

/// Slopes by the line through each value and those up to `half` before and behind it, per second.
pub(crate) fn slopes(times: &[f64], values: &[f64], half: usize) -> Vec<f64> {
    let slope = |k: usize| {
        let window = k.saturating_sub(half)..(k + half + 1).min(values.len());
        let (t, y) = (mean(&times[window.clone()]), mean(&values[window.clone()]));
        let (mut cross, mut square) = (0.0, 0.0);
        for i in window {
            cross += (times[i] - t) * (values[i] - y);
            square += (times[i] - t).powi(2);
        }
        cross / square
    };
    (0..values.len()).map(slope).collect()
}
