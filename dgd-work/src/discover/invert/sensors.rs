//! Which outputs were measured, and how noisy they are.

use dgd_runtime::Unit;
use dgd_screen::noise::white_noise;
use serde_json::{Value, json};

use crate::error::{WorkError, meant};
use crate::output::quantity::of_differences;
use crate::run::Run;

/// An output that was measured.
#[derive(Debug, Clone)]
pub(super) struct Sensor {
    pub(super) name: String,
    unit: Unit,
    /// Standard deviation, SI.
    pub(super) noise: f64,
    is_declared: bool,
}

/// Those of the model's outputs that were measured and are asked for, with their noise as declared or, where
/// nothing is declared, as it is from one sample to the next.
pub(super) fn sensors(run: &Run, asked: &[String]) -> Result<Vec<Option<Sensor>>, WorkError> {
    let outputs = &run.signature().outputs;
    let names: Vec<&str> = outputs.iter().map(|output| &*output.name).collect();
    if let Some(unknown) = asked.iter().find(|name| !names.contains(&name.as_str())) {
        let help = meant(unknown, &names);
        return Err(WorkError::Usage(format!(
            "`--outputs {unknown}`: no output is called so; {help}"
        )));
    }
    let times = &run.measured.times;
    let sensor = |output: usize| {
        let own = &outputs[output];
        if !asked.is_empty() && !asked.iter().any(|name| *name == *own.name) {
            return None;
        }
        let samples = run.measured.outputs.get(output)?.as_ref()?;
        let estimated = || white_noise(times, samples, samples).map(|noise| noise.std);
        // Readings without any noise are as good as their last digit.
        let rounding = || {
            let largest = samples.iter().filter(|w| w.is_finite()).map(|w| w.abs());
            1e-9 * largest.fold(own.unit.factor.abs(), f64::max)
        };
        Some(Sensor {
            name: own.name.to_string(),
            unit: of_differences(&own.unit),
            noise: own.noise.or_else(estimated).unwrap_or_else(rounding),
            is_declared: own.noise.is_some(),
        })
    };
    Ok((0..outputs.len()).map(sensor).collect())
}

impl Sensor {
    /// Its noise in its unit.
    pub(super) fn shown(&self) -> (f64, &str, &'static str) {
        let of = if self.is_declared { "declared" } else { "estimated" };
        (self.noise / self.unit.factor, &self.unit.symbol, of)
    }

    pub(super) fn to_json(&self) -> Value {
        let (noise, unit, of) = self.shown();
        json!({ "output": self.name, "noise": noise, "unit": unit, "noise_from": of })
    }
}
