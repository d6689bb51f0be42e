//! What sensors add to the truth.

use super::random::Random;
use super::{Column, Plan, Recording};

/// What kind of errors all sensors of a recording have; their standard deviations are the columns' own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Noise {
    /// Independent and normal.
    White,
    /// As much correlated noise as white, with a memory of a few samples.
    Correlated,
    /// White, then rounded to steps of one and a half standard deviations.
    Quantised,
    /// Student's t with four degrees of freedom.
    HeavyTails,
    /// White, and one reading in a hundred is off by 6 to 15 standard deviations.
    Outliers,
    /// White, and one cell in ten is empty, some in a row.
    MissingCells,
    /// White; every second output, if there is one, has a reading at every fourth row only.
    TwoRates,
}

impl Noise {
    pub(crate) const ALL: [Noise; 7] = [
        Noise::White,
        Noise::Correlated,
        Noise::Quantised,
        Noise::HeavyTails,
        Noise::Outliers,
        Noise::MissingCells,
        Noise::TwoRates,
    ];

    pub(crate) fn word(self) -> &'static str {
        match self {
            Noise::White => "white",
            Noise::Correlated => "correlated",
            Noise::Quantised => "quantised",
            Noise::HeavyTails => "heavy_tails",
            Noise::Outliers => "outliers",
            Noise::MissingCells => "missing_cells",
            Noise::TwoRates => "two_rates",
        }
    }

    /// The recording with errors on all outputs, which are not a number where a cell is empty.
    pub(crate) fn add(self, recording: &Recording, plan: &Plan) -> Recording {
        let mut random = plan.errors();
        let mut outputs = 0;
        let mut noisy = |column: &Column| {
            let Some(noise) = column.noise else { return column.clone() };
            outputs += 1;
            let errors = self.errors(column.values.len(), plan, outputs, &mut random);
            let pairs = column.values.iter().zip(errors);
            let step = if self == Noise::Quantised { 1.5 * noise } else { fine(noise) };
            let values = pairs.map(|(value, error)| rounded(value + noise * error, step)).collect();
            Column { values, ..column.clone() }
        };
        Recording {
            columns: recording.columns.iter().map(&mut noisy).collect(),
            ..recording.clone()
        }
    }

    /// Errors of the nth output, of standard deviation one.
    fn errors(self, rows: usize, plan: &Plan, output: usize, random: &mut Random) -> Vec<f64> {
        // A memory is a sensor's: the same in both recordings.
        let memory = Random::new(plan.seed, 8 + output as u64).between(3.0, 12.0);
        let mut coloured = random.normal();
        let mut gap = 0;
        let mut one = |row: usize| match self {
            Noise::White | Noise::Quantised => random.normal(),
            Noise::Correlated => {
                // v₊ = φ v + √(1 − φ²) ξ,  φ = e^(−1/T)
                let phi = (-1.0 / memory).exp();
                coloured = phi * coloured + (1.0 - phi * phi).sqrt() * random.normal();
                coloured + random.normal()
            }
            Noise::HeavyTails => random.heavy_tailed(),
            Noise::Outliers => {
                let outlier = if random.chance(0.01) { random.either_sign(6.0, 15.0) } else { 0.0 };
                random.normal() + outlier
            }
            Noise::MissingCells => {
                if gap == 0 && random.chance(0.03) {
                    gap = random.whole(1, 6);
                }
                let is_missing = gap > 0;
                gap -= usize::from(is_missing);
                let error = random.normal();
                if is_missing { f64::NAN } else { error }
            }
            Noise::TwoRates => {
                let error = random.normal();
                if output.is_multiple_of(2) && !row.is_multiple_of(4) { f64::NAN } else { error }
            }
        };
        (0..rows).map(&mut one).collect()
    }
}

/// The resolution of a recording: a tenth of the noise, or a little less, as a power of ten.
fn fine(noise: f64) -> f64 {
    10f64.powi((0.1 * noise).log10().floor() as i32)
}

/// The nearest multiple of a step, as a decimal number would be written.
fn rounded(x: f64, step: f64) -> f64 {
    let y = (x / step).round() * step;
    // Without what multiplication adds behind the digits of the step.
    format!("{y:.11e}").parse().unwrap_or(y)
}
