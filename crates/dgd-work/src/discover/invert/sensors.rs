//! The measured outputs and their noise.

use dgd_compiler::argument::Argument;
use dgd_runtime::Unit;
use dgd_screen::noise::white_noise;
use serde_json::{Value, json};

use crate::error::{UsageError, WorkError};
use crate::output::quantity::of_differences;
use crate::run::ModelRun;

/// A measured output.
#[derive(Debug, Clone)]
pub(super) struct Sensor {
    pub(super) name: String,
    unit: Unit,
    /// Standard deviation, SI.
    pub(super) noise: f64,
    is_declared: bool,
}

/// The requested outputs that were measured. Noise is as declared or, without a declaration, estimated from differences
/// between successive samples.
pub(super) fn sensors(run: &ModelRun, asked: &[String]) -> Result<Vec<Option<Sensor>>, WorkError> {
    let outputs = &run.signature().outputs;
    let names: Vec<&str> = outputs.iter().map(|output| &*output.name).collect();
    if let Some(unknown) = asked.iter().find(|name| !names.contains(&name.as_str())) {
        let known = names.iter().map(|&name| name.to_owned()).collect();
        let given = Some(Argument::Outputs.with(unknown));
        let (kind, name) = ("output", unknown.clone());
        return Err(UsageError::Unknown { given, kind, name, known }.into());
    }
    let times = &run.measured.times;
    let sensor = |output: usize| {
        let declared = &outputs[output];
        if !asked.is_empty() && !asked.iter().any(|name| *name == *declared.name) {
            return None;
        }
        let samples = run.measured.outputs.get(output)?.as_ref()?;
        let estimated = || white_noise(times, samples, samples).map(|noise| noise.std);
        // For readings without noise, the rounding of their last digit counts.
        let rounding = || {
            let largest = samples.iter().filter(|w| w.is_finite()).map(|w| w.abs());
            1e-9 * largest.fold(declared.unit.factor.abs(), f64::max)
        };
        Some(Sensor {
            name: declared.name.to_string(),
            unit: of_differences(&declared.unit),
            noise: declared.noise.or_else(estimated).unwrap_or_else(rounding),
            is_declared: declared.noise.is_some(),
        })
    };
    Ok((0..outputs.len()).map(sensor).collect())
}

impl Sensor {
    /// Its noise, the unit, and the source of the value.
    pub(super) fn shown(&self) -> (f64, &str, &'static str) {
        let source = if self.is_declared { "declared" } else { "estimated" };
        (self.noise / self.unit.factor, &self.unit.symbol, source)
    }

    pub(super) fn to_json(&self) -> Value {
        let (noise, unit, of) = self.shown();
        json!({ "output": self.name, "noise": noise, "unit": unit, "noise_from": of })
    }
}
