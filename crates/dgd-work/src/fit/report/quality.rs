//! The quality of a fit, output by output, on training and validation recordings.
//!
//! ```text
//!   e = measured − simulated      R² = 1 − Σe²/Σ(y − ȳ)²      fit = 100 (1 − ‖e‖/‖y − ȳ‖) %
//! ```
//!
//! ȳ is the mean of all samples that count. The fit in percent is Ljung's, System Identification Toolbox, `compare`;
//! residuals are tested by [`dgd_screen::residuals`], after division by their own standard deviations
//! ([`super::standard`]).

use std::fmt::Write as _;

use dgd_identify::{OutputErrorEvaluation, Recording};
use dgd_runtime::{LimitSide, Signature, Unit};
use dgd_screen::residuals::{CrossCorrelation, Portmanteau, cross_correlation, portmanteau};

use super::standard::NoiseStandard;
use crate::output::quantity::short;
use crate::result::fit::{InputTestEntry, QualityEntry, WhitenessEntry};

/// Tested lags, in samples.
const LAGS: usize = 25;

/// Significance level of all tests of a set together.
pub(crate) const RARE: f64 = 0.01;

/// Quality of all outputs on one set of recordings.
pub(crate) struct FitQuality {
    outputs: Vec<Option<OutputQuality>>,
    /// Number of input tests made.
    input_tests: usize,
}

/// Quality of one output, in its declared unit.
struct OutputQuality {
    samples: usize,
    mse: f64,
    bias: f64,
    /// Σe²/Σ(y − ȳ)²; `None` if the output is constant.
    unexplained: Option<f64>,
    whiteness: Option<Portmanteau>,
    /// By input.
    inputs: Vec<Option<CrossCorrelation>>,
    /// The typical sample interval, s.
    spacing: f64,
}

impl FitQuality {
    /// From an evaluation of these recordings, with the noise of a fit.
    pub(crate) fn evaluate(
        signature: &Signature,
        recordings: &[Recording],
        evaluation: &OutputErrorEvaluation,
        standard: NoiseStandard<'_>,
    ) -> Self {
        let inputs: Vec<Vec<Vec<f64>>> =
            recordings.iter().map(|recording| input_values(signature, recording)).collect();
        let quality_of = |(i, output): (usize, &dgd_runtime::Output)| {
            output_quality(recordings, evaluation, &inputs, i, &output.unit, standard)
        };
        let outputs: Vec<_> = signature.outputs.iter().enumerate().map(quality_of).collect();
        let input_tests = outputs.iter().flatten().flat_map(|q| q.inputs.iter().flatten()).count();
        Self { outputs, input_tests }
    }

    /// Ljung's fit of an output, %.
    pub(crate) fn fit_percent(&self, output: usize) -> Option<f64> {
        self.outputs[output].as_ref()?.fit_percent()
    }

    /// The entry of an output in the result; `None` if it was not measured.
    pub(crate) fn entry(&self, output: usize, signature: &Signature) -> Option<QualityEntry> {
        let quality = self.outputs[output].as_ref()?;
        let inputs = signature.inputs.iter().zip(&quality.inputs);
        let inputs = inputs.filter_map(|(input, test)| {
            Some((input.name.to_string(), input_entry(test.as_ref()?, quality)))
        });
        let whiteness = quality.whiteness.as_ref().map(|test| WhitenessEntry {
            lags: test.autocorrelation.len(),
            statistic: Some(test.statistic),
            p_value: Some(test.p_value),
            autocorrelation: test.autocorrelation.iter().copied().map(Some).collect(),
            limit: Some(test.limit),
        });
        Some(QualityEntry {
            samples: quality.samples,
            r_squared: quality.unexplained.map(|unexplained| 1.0 - unexplained),
            fit_percent: quality.fit_percent(),
            mse: Some(quality.mse),
            mse_unit: squared(&signature.outputs[output].unit),
            bias: Some(quality.bias),
            whiteness,
            inputs: inputs.collect(),
        })
    }

    /// A sentence for each output whose residuals correlate with an input.
    pub(crate) fn push_remarks(&self, text: &mut String, signature: &Signature) {
        let names = || signature.outputs.iter().map(|output| &output.name).zip(&self.outputs);
        // Writing to a string cannot fail.
        for (name, quality) in names() {
            let Some((input, test, lag)) = quality.as_ref().and_then(|q| q.worst_input(self))
            else {
                continue;
            };
            let input = &signature.inputs[input].name;
            let when =
                if test.lag == 0 { String::new() } else { format!(" {} s earlier", short(lag, 3)) };
            let _ = writeln!(
                text,
                "The residuals of `{name}` correlate with `{input}`{when} (correlation {:+.2}, limit {:.2}): \
                 the model misses something in how `{input}` acts. `dgd discover` looks for it.",
                test.correlation[test.lag], test.limit
            );
        }
    }

    /// Outputs whose residuals are autocorrelated.
    pub(crate) fn coloured(&self, signature: &Signature) -> Vec<String> {
        let tests = self.outputs.iter().flatten().filter(|q| q.whiteness.is_some()).count();
        let names = signature.outputs.iter().map(|output| output.name.to_string());
        let is_coloured = |quality: &Option<OutputQuality>| {
            quality.as_ref().is_some_and(|quality| quality.is_coloured(tests))
        };
        let outputs = names.zip(&self.outputs).filter(|(_, quality)| is_coloured(quality));
        outputs.map(|(name, _)| name).collect()
    }
}

impl OutputQuality {
    fn fit_percent(&self) -> Option<f64> {
        self.unexplained.map(|unexplained| 100.0 * (1.0 - unexplained.sqrt()))
    }

    /// Whether the residuals are autocorrelated, given the number of tested outputs.
    fn is_coloured(&self, tests: usize) -> bool {
        self.whiteness.as_ref().is_some_and(|test| test.p_value * (tests as f64) < RARE)
    }

    /// The input with the most significant correlation, if any, and the lag, s.
    fn worst_input(&self, all: &FitQuality) -> Option<(usize, &CrossCorrelation, f64)> {
        let tests =
            self.inputs.iter().enumerate().filter_map(|(i, test)| Some((i, test.as_ref()?)));
        let excess = |test: &CrossCorrelation| test.correlation[test.lag].abs() / test.limit;
        tests
            .filter(|(_, test)| test.p_value * (all.input_tests as f64) < RARE)
            .max_by(|(_, a), (_, b)| excess(a).total_cmp(&excess(b)))
            .map(|(i, test)| (i, test, test.lag as f64 * self.spacing))
    }
}

fn input_entry(test: &CrossCorrelation, quality: &OutputQuality) -> InputTestEntry {
    InputTestEntry {
        lag: Some(test.lag as f64 * quality.spacing),
        largest: Some(test.correlation[test.lag]),
        limit: Some(test.limit),
        p_value: Some(test.p_value),
        correlation: test.correlation.iter().copied().map(Some).collect(),
    }
}

/// Values of all inputs at the sample times of a recording.
fn input_values(signature: &Signature, recording: &Recording) -> Vec<Vec<f64>> {
    let mut values = vec![Vec::with_capacity(recording.times.len()); signature.inputs.len()];
    let mut u = vec![0.0; recording.inputs.len()];
    for t in &recording.times {
        recording.inputs.value(*t, LimitSide::Right, &mut u);
        for (values, value) in values.iter_mut().zip(&u) {
            values.push(*value);
        }
    }
    values
}

fn output_quality(
    recordings: &[Recording],
    evaluation: &OutputErrorEvaluation,
    inputs: &[Vec<Vec<f64>>],
    output: usize,
    unit: &Unit,
    standard: NoiseStandard<'_>,
) -> Option<OutputQuality> {
    // Σe², Σe, and e over σ for the tests.
    let (mut squares, mut sum) = (0.0, 0.0);
    let (mut residuals, mut measured) = (Vec::new(), Vec::new());
    for (recording, observations) in recordings.iter().zip(&evaluation.observations) {
        let samples = recording.measured[output].as_deref();
        let mut e = Vec::with_capacity(recording.times.len());
        for (k, t) in recording.times.iter().enumerate() {
            let y = samples.map_or(f64::NAN, |samples| samples[k]);
            if y.is_finite() && *t >= recording.counts_from {
                measured.push(y / unit.factor);
                let w = observations.w(k);
                let in_unit = (y - w[output]) / unit.factor;
                squares += in_unit * in_unit;
                sum += in_unit;
                let standardised = standard.standardise(recording, output, k, w);
                e.push(standardised.map_or(in_unit, |standardised| standardised.tested));
            } else {
                e.push(f64::NAN);
            }
        }
        residuals.push(e);
    }
    if measured.is_empty() {
        return None;
    }
    let n = measured.len() as f64;
    let mean = measured.iter().sum::<f64>() / n;
    let scatter: f64 = measured.iter().map(|y| (y - mean).powi(2)).sum();
    let runs: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
    let tests = (0..inputs.first().map_or(0, Vec::len))
        .map(|input| {
            let pairs: Vec<(&[f64], &[f64])> =
                runs.iter().zip(inputs).map(|(e, inputs)| (*e, inputs[input].as_slice())).collect();
            cross_correlation(&pairs, LAGS)
        })
        .collect();
    Some(OutputQuality {
        samples: measured.len(),
        mse: squares / n,
        bias: sum / n,
        unexplained: (scatter > 0.0).then(|| squares / scatter),
        whiteness: portmanteau(&runs, LAGS),
        inputs: tests,
        spacing: recordings
            .iter()
            .find_map(|recording| dgd_screen::usual_spacing(&recording.times))
            .unwrap_or(f64::NAN),
    })
}

/// The square of a unit, as usually written.
fn squared(unit: &Unit) -> String {
    let symbol = &unit.symbol;
    if symbol.contains(['*', '/', '^', ' ']) {
        format!("({symbol})^2")
    } else {
        format!("{symbol}^2")
    }
}
