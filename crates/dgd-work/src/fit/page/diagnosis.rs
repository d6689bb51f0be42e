//! Autocorrelation of the residuals of the training recordings, and their correlation with inputs.

use dgd_runtime::Signature;
use dgd_screen::residuals::{CrossCorrelation, Portmanteau, cross_correlation, portmanteau};

use super::traces::PageTrace;

/// Tested lags, in samples.
const LAGS: usize = 25;

/// Significance level of all tests together.
const RARE: f64 = 0.01;

/// By output; `None` for outputs with too few samples.
pub(super) struct Diagnosis {
    pub outputs: Vec<OutputTests>,
}

/// The tests of one output.
pub(super) struct OutputTests {
    pub whiteness: Option<Portmanteau>,
    /// By input.
    pub inputs: Vec<Option<CrossCorrelation>>,
    /// The typical sample interval, s.
    pub spacing: f64,
}

impl Diagnosis {
    pub(super) fn test(signature: &Signature, traces: &[PageTrace]) -> Self {
        let tests_of = |i: usize| {
            let runs = || traces.iter().filter(|trace| !trace.is_valid);
            let runs: Vec<(&PageTrace, &[f64])> =
                runs().filter_map(|trace| Some((trace, trace.tested[i].as_deref()?))).collect();
            let residuals: Vec<&[f64]> = runs.iter().map(|(_, residuals)| *residuals).collect();
            let inputs = (0..signature.inputs.len()).map(|input| {
                let pairs: Vec<(&[f64], &[f64])> =
                    runs.iter().map(|(trace, e)| (*e, trace.inputs[input].as_slice())).collect();
                cross_correlation(&pairs, LAGS)
            });
            let spacing =
                runs.iter().find_map(|(trace, _)| dgd_screen::usual_spacing(&trace.times));
            OutputTests {
                whiteness: portmanteau(&residuals, LAGS),
                inputs: inputs.collect(),
                spacing: spacing.unwrap_or(1.0),
            }
        };
        Diagnosis { outputs: (0..signature.outputs.len()).map(tests_of).collect() }
    }

    /// Number of outputs tested for whiteness.
    pub(super) fn tested(&self) -> usize {
        self.outputs.iter().filter(|tested| tested.whiteness.is_some()).count()
    }

    /// Whether the residuals of an output are autocorrelated.
    pub(super) fn is_coloured(&self, output: usize) -> bool {
        let test = self.outputs[output].whiteness.as_ref();
        test.is_some_and(|test| test.p_value * (self.tested() as f64) < RARE)
    }

    /// The inputs that the residuals of an output depend on.
    pub(super) fn depends_on(&self, output: usize) -> Vec<usize> {
        let tests = self.outputs.iter().flat_map(|tested| tested.inputs.iter().flatten()).count();
        let fails = |test: &CrossCorrelation| test.p_value * (tests as f64) < RARE;
        let inputs = self.outputs[output].inputs.iter().enumerate();
        inputs.filter(|(_, test)| test.as_ref().is_some_and(fails)).map(|(i, _)| i).collect()
    }
}
