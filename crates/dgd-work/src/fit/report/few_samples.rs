//! Outputs with too few samples to estimate their noise.
//!
//! The residuals of a fit to few samples are far smaller than their noise, and so are standard deviations computed from
//! them. The declared noise is used instead; without a declaration, no standard deviation is given.

use std::fmt::Write as _;

use dgd_identify::{NoiseSource, Recording, too_few_for_noise};
use dgd_runtime::Output;

use crate::output::quantity::{short, with_unit};
use crate::result::ByName;
use crate::result::fit::FewSamplesEntry;

/// An output with too few samples.
#[derive(Debug)]
struct TooFewSamples {
    output: String,
    samples: usize,
    /// The noise used instead, with its unit.
    declared: Option<(f64, String)>,
}

/// Outputs with too few samples, and the number of estimates.
#[derive(Debug, Default)]
pub(crate) struct FewSamples {
    all: Vec<TooFewSamples>,
    samples: usize,
    estimates: usize,
}

impl FewSamples {
    /// Finds them, and substitutes their declared noise.
    pub(crate) fn find(
        outputs: &[Output],
        recordings: &[Recording],
        noise: &mut [Option<NoiseSource>],
        estimates: usize,
    ) -> Self {
        let samples_of = |i: usize| -> usize {
            let samples = recordings.iter().filter_map(|recording| recording.measured[i].as_ref());
            samples.flatten().filter(|value| value.is_finite()).count()
        };
        let counts: Vec<usize> =
            (0..noise.len()).map(|i| noise[i].map_or(0, |_| samples_of(i))).collect();
        let samples = counts.iter().sum();
        let mut outputs_with_few = Vec::new();
        for (i, noise) in noise.iter_mut().enumerate() {
            let is_estimated = *noise == Some(NoiseSource::Estimated);
            if !is_estimated || !too_few_for_noise(counts[i], samples, estimates) {
                continue;
            }
            let (output, unit) = (&outputs[i], &outputs[i].unit);
            if let Some(sigma) = output.noise {
                *noise = Some(NoiseSource::Known(sigma));
            }
            outputs_with_few.push(TooFewSamples {
                output: output.name.to_string(),
                samples: counts[i],
                declared: output
                    .noise
                    .map(|sigma| (sigma / unit.factor.abs(), unit.symbol.to_string())),
            });
        }
        Self { all: outputs_with_few, samples, estimates }
    }

    /// Whether standard deviations would rest on unknown noise.
    pub(crate) fn hide_stds(&self) -> bool {
        self.all.iter().any(|few| few.declared.is_none())
    }

    /// Whether the noise of an output is unknown.
    pub(crate) fn hide_noise(&self, output: &str) -> bool {
        self.all.iter().any(|few| few.output == output && few.declared.is_none())
    }

    /// A possible reason why a search did not converge.
    pub(crate) fn as_reason(&self) -> String {
        if self.all.is_empty() {
            return String::new();
        }
        let Self { samples, estimates, .. } = self;
        format!("; {samples} samples are few for {estimates} estimates")
    }

    /// For programs.
    pub(crate) fn entries(&self) -> ByName<FewSamplesEntry> {
        let entry = |few: &TooFewSamples| {
            let (declared_noise, unit) = few.declared.clone().unzip();
            (few.output.clone(), FewSamplesEntry { samples: few.samples, declared_noise, unit })
        };
        self.all.iter().map(entry).collect()
    }

    /// A line for each output.
    pub(crate) fn push_text(&self, text: &mut String) {
        for TooFewSamples { output, samples, declared } in &self.all {
            // Writing to a string cannot fail.
            let _ = write!(
                text,
                "{samples} samples of `{output}`, {} in all, are too few to say how large its noise is \
                 beside {} estimates: ",
                self.samples, self.estimates
            );
            let _ = match declared {
                Some((sigma, unit)) => {
                    let sigma = with_unit(short(*sigma, 3), unit);
                    writeln!(text, "its declared noise was taken, {sigma}")
                }
                None => writeln!(
                    text,
                    "there are no standard deviations that could be trusted; with its `noise` in the \
                     model there are"
                ),
            };
        }
    }
}
