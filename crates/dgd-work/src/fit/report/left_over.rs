//! Model error in the residuals of a fit, and the bias it may have caused in the estimates.

use std::fmt::Write as _;
use std::path::PathBuf;

use dgd_identify::{
    EstimateError, Fit, Jackknife, JackknifeBlock, NoiseSource, OutputErrorProblem,
};
use dgd_runtime::{Signature, Unit};
use dgd_screen::distribution::chi_square_tail;

use super::quality::{FitQuality, RARE};
use crate::output::quantity::short;
use crate::result::fit::{ModelErrorEntry, RecordingPartEntry};

/// The spread of estimates over parts of the recordings, if the residuals show a model error.
#[derive(Debug, Default)]
pub(crate) struct ModelErrorSpread {
    /// Outputs whose residuals are autocorrelated.
    coloured: Vec<String>,
    /// Whether residuals exceed the declared noise.
    is_larger: bool,
    spread: Option<Jackknife>,
}

impl ModelErrorSpread {
    /// For a fit; parts are compared only if it has `ended` in a known minimum.
    pub(crate) fn find(
        problem: &OutputErrorProblem<'_>,
        fit: &Fit,
        quality: &FitQuality,
        ended: bool,
    ) -> Result<Self, EstimateError> {
        let signature = problem.system.signature();
        let is_fitted = |name: &String| {
            let mut outputs = signature.outputs.iter().zip(&fit.noise);
            outputs.any(|(output, sigma)| *output.name == *name && sigma.is_some())
        };
        let mut coloured = quality.coloured(signature);
        coloured.retain(is_fitted);
        let is_known = |noise: &Option<NoiseSource>| matches!(noise, Some(NoiseSource::Known(_)));
        let is_larger = problem.noise.iter().any(is_known)
            && fit.reduced_chi_square().is_some_and(|chi| {
                let freedom = fit.degrees_of_freedom as f64;
                chi > 1.0 && chi_square_tail(chi * freedom, freedom) < RARE
            });
        let is_left_over = is_larger || !coloured.is_empty();
        let spread = if ended && is_left_over { fit.spread(problem)? } else { None };
        Ok(Self { coloured, is_larger, spread })
    }

    /// The spread of an estimate, SI; `None` without model error, or if it is unknown.
    pub(crate) fn std(&self, estimate: usize) -> Option<f64> {
        self.spread.as_ref()?.std[estimate]
    }

    /// The same in its unit.
    pub(crate) fn std_in(&self, estimate: usize, unit: &Unit) -> Option<f64> {
        self.std(estimate).map(|std| std / unit.factor.abs())
    }

    /// Whether any estimate has a spread.
    pub(crate) fn is_shown(&self) -> bool {
        self.spread.as_ref().is_some_and(|spread| spread.std.iter().any(Option::is_some))
    }

    /// `None` without model error.
    pub(crate) fn entry(
        &self,
        data: &[PathBuf],
        name: impl Fn(usize) -> String,
    ) -> Option<ModelErrorEntry> {
        if self.coloured.is_empty() && !self.is_larger {
            return None;
        }
        let parts = self.spread.iter().flat_map(|spread| &spread.parts);
        let part = |part: &JackknifeBlock| {
            let [first, last] = part.recordings.map(|r| data[r].display().to_string());
            let recordings = if first == last { vec![first] } else { vec![first, last] };
            RecordingPartEntry { recordings, from: Some(part.from), until: Some(part.until) }
        };
        Some(ModelErrorEntry {
            autocorrelated: self.coloured.clone(),
            exceeds_declared_noise: self.is_larger,
            parts: parts.map(part).collect(),
            rests_on_part: self.rests_on().map(|(estimate, part)| (name(estimate), part)).collect(),
        })
    }

    /// Estimates that depend on a single part, and the part.
    fn rests_on(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let estimates = self.spread.iter().flat_map(|spread| spread.rests_on.iter().enumerate());
        estimates.filter_map(|(estimate, part)| Some((estimate, (*part)?)))
    }

    /// Explains the second deviation, and lists the estimates without one.
    pub(crate) fn push_text(
        &self,
        text: &mut String,
        signature: &Signature,
        recording_names: &[String],
        name: impl Fn(usize) -> String,
    ) {
        // Writing to a string cannot fail.
        if !self.coloured.is_empty() {
            let named: Vec<String> = self.coloured.iter().map(|name| format!("`{name}`")).collect();
            let _ = writeln!(
                text,
                "The residuals of {} are autocorrelated, so the standard deviations above are unreliable.",
                named.join(", ")
            );
        }
        if self.is_larger {
            let _ = writeln!(
                text,
                "The residuals of `{}` are larger than the declared noise, which `std` takes them for.",
                signature.name
            );
        }
        if self.is_larger || !self.coloured.is_empty() {
            let _ = writeln!(
                text,
                "`dgd discover` with the same recordings looks for what the model misses."
            );
        }
        let Some(spread) = &self.spread else { return };
        if self.is_shown() {
            let _ = writeln!(
                text,
                "`std model` is how far estimates from {} parts of the recordings scatter: what the model \
                 misses does not average out as noise does.",
                spread.parts.len()
            );
        }
        for (estimate, part) in self.rests_on() {
            let JackknifeBlock { recordings: [first, last], from, until } = spread.parts[part];
            let seconds = format!("{} to {} s", short(from, 4), short(until, 4));
            let place = match recording_names {
                [_] => format!("the recording from {seconds}"),
                _ if first == last => format!("{} from {seconds}", recording_names[first]),
                _ => format!("{} to {}", recording_names[first], recording_names[last]),
            };
            let _ = writeln!(
                text,
                "`{}` rests on one part, {place}: another test with what happens there would show how far \
                 the model bends it.",
                name(estimate)
            );
        }
    }
}
