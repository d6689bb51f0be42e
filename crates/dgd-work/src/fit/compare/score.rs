//! The likelihood of contenders on the samples common to all, and information criteria.
//!
//! ```text
//!   −2 ln L = Σ n (ln(2π Σe²/n) + 1)      over the outputs, each with a noise of its own
//!   AIC = −2 ln L + 2 k                   BIC = −2 ln L + k ln N
//! ```
//!
//! k counts the parameters and initial values that were estimated and are not at a bound, and a noise for each output;
//! N counts all samples. Residuals are assumed white and normally distributed. Outputs whose readings have standard
//! deviations of their own, by a formula or recorded, contribute the density of each reading instead, and no noise.
//!
//! Sources: Akaike, IEEE Trans. Automat. Contr. 19 (1974) 716–723; Schwarz, Ann. Statist. 6 (1978) 461–464.

use std::f64::consts::PI;

use dgd_identify::ParameterEstimate;

use crate::error::{UnusableFile, WorkError};
use crate::fit::FitResult;
use crate::fit::page::traces::PageTrace;
use crate::output::agreement::Agreement;
use crate::output::quantity::of_differences;

/// An output that all contenders have.
#[derive(Debug, Clone)]
pub(super) struct CommonOutput {
    pub name: String,
    /// Unit of its residuals: that of the first contender.
    pub unit: String,
    /// By contender: index of the output, and the factor that converts its numbers to that unit.
    pub places: Vec<(usize, f64)>,
}

/// Measurements and residuals of one contender and one output.
#[derive(Debug, Clone, Default)]
struct ContenderSamples {
    measured: Vec<f64>,
    residuals: Vec<f64>,
    /// −2 ln of the density of each reading, if the readings have standard deviations of their own.
    deviances: Option<Vec<f64>>,
}

/// The samples common to all contenders.
#[derive(Debug, Clone)]
pub(super) struct CommonSamples {
    pub outputs: Vec<CommonOutput>,
    /// Training and validation samples, by contender and output.
    samples: [Vec<Vec<ContenderSamples>>; 2],
}

/// Likelihood of a contender in training, and the number of its estimates.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ContenderScore {
    /// −2 ln L; none if an output is matched without any error.
    pub deviance: Option<f64>,
    /// Estimated parameters, initial values and noises that are not at a bound.
    pub estimates: usize,
    /// Estimates at a bound.
    pub at_bounds: usize,
    /// Samples of all outputs.
    pub samples: usize,
}

impl ContenderScore {
    /// Akaike's criterion.
    pub fn aic(&self) -> Option<f64> {
        Some(self.deviance? + 2.0 * self.estimates as f64)
    }

    /// Schwarz's criterion.
    pub fn bic(&self) -> Option<f64> {
        Some(self.deviance? + self.estimates as f64 * (self.samples as f64).ln())
    }
}

impl CommonSamples {
    /// The samples common to fits of the same recordings.
    pub(super) fn collect(fits: &[FitResult]) -> Result<CommonSamples, WorkError> {
        let first = &fits[0];
        verify_recordings(fits)?;
        let is_measured = |i: usize| {
            first.traces.iter().any(|trace| !trace.is_valid && trace.measured[i].is_some())
        };
        let outputs = first.signature.outputs.iter().enumerate();
        let outputs = outputs.filter(|(i, _)| is_measured(*i)).filter_map(|(_, output)| {
            let place = |fitted: &FitResult| {
                let mut outputs = fitted.signature.outputs.iter();
                let i = outputs.position(|other| other.name == output.name)?;
                let unit = &fitted.signature.outputs[i].unit;
                Some((i, unit.factor / output.unit.factor))
            };
            let places: Option<Vec<(usize, f64)>> = fits.iter().map(place).collect();
            let unit = of_differences(&output.unit).symbol.to_string();
            Some(CommonOutput { name: output.name.to_string(), unit, places: places? })
        });
        let outputs: Vec<CommonOutput> = outputs.collect();
        if outputs.is_empty() {
            return Err(UnusableFile::NothingMeasuredInCommon.into());
        }
        let samples = [false, true].map(|is_valid| {
            let of_contender = |k: usize| -> Vec<ContenderSamples> {
                outputs.iter().map(|output| samples(fits, output, k, is_valid)).collect()
            };
            (0..fits.len()).map(of_contender).collect()
        });
        Ok(CommonSamples { outputs, samples })
    }

    /// Training samples of all outputs.
    pub(super) fn samples(&self) -> usize {
        self.samples[0][0].iter().map(|one| one.residuals.len()).sum()
    }

    /// The score of a contender with these parameters and initial values.
    pub(super) fn score(
        &self,
        contender: usize,
        estimates: &[ParameterEstimate],
    ) -> ContenderScore {
        let outputs = &self.samples[0][contender];
        let deviance = deviance(outputs.iter());
        let levels = outputs.iter().filter(|one| one.deviances.is_none()).count();
        let at_bounds = estimates.iter().filter(|estimate| estimate.at_bound.is_some()).count();
        let estimates = estimates.len() - at_bounds + levels;
        ContenderScore { deviance, estimates, at_bounds, samples: self.samples() }
    }

    pub(super) fn agreement(
        &self,
        contender: usize,
        output: usize,
        is_valid: bool,
    ) -> Option<Agreement> {
        let ContenderSamples { measured, residuals, .. } =
            &self.samples[usize::from(is_valid)][contender][output];
        Agreement::measure(measured.iter().zip(residuals).map(|(y, e)| (*y, y - e)))
    }
}

/// −2 ln L of residuals, output by output.
fn deviance<'a>(outputs: impl Iterator<Item = &'a ContenderSamples>) -> Option<f64> {
    let deviance_of = |ContenderSamples { residuals, deviances, .. }: &ContenderSamples| -> f64 {
        if let Some(deviances) = deviances {
            return deviances.iter().sum();
        }
        let n = residuals.len() as f64;
        let mean_square = residuals.iter().map(|e| e * e).sum::<f64>() / n;
        n * ((2.0 * PI * mean_square).ln() + 1.0)
    };
    let sum: f64 = outputs.filter(|one| !one.residuals.is_empty()).map(deviance_of).sum();
    sum.is_finite().then_some(sum)
}

/// Checks that the recordings have the same sample times in all fits.
fn verify_recordings(fits: &[FitResult]) -> Result<(), WorkError> {
    let times = |fitted: &FitResult| -> Vec<Vec<f64>> {
        fitted.traces.iter().map(|trace| trace.times.clone()).collect()
    };
    let first = times(&fits[0]);
    if fits.iter().all(|fitted| times(fitted) == first) {
        return Ok(());
    }
    Err(UnusableFile::OtherRecordings.into())
}

/// The samples of a contender that all contenders have.
fn samples(
    fits: &[FitResult],
    output: &CommonOutput,
    contender: usize,
    is_valid: bool,
) -> ContenderSamples {
    let mut common = ContenderSamples::default();
    let traces_of =
        |k: usize| fits[k].traces.iter().filter(move |trace| trace.is_valid == is_valid);
    let residuals = |trace: &PageTrace, k: usize| -> Option<Vec<f64>> {
        let (i, factor) = output.places[k];
        Some(trace.residuals[i].as_ref()?.iter().map(|e| e * factor).collect())
    };
    for (r, trace) in traces_of(contender).enumerate() {
        let residuals_of_all: Option<Vec<Vec<f64>>> =
            (0..fits.len()).map(|k| residuals(traces_of(k).nth(r)?, k)).collect();
        let (i, factor) = output.places[contender];
        let (Some(residuals_of_all), Some(measured)) = (residuals_of_all, &trace.measured[i])
        else {
            continue;
        };
        // Densities are per SI unit; residuals are in the unit of the first contender.
        let unit = fits[contender].signature.outputs[i].unit.factor / factor;
        let in_unit = 2.0 * unit.abs().ln();
        for (k, y) in measured.iter().enumerate() {
            if residuals_of_all.iter().all(|one| one[k].is_finite()) {
                // A constant offset of the unit does not change a fit.
                common.measured.push(y * factor);
                common.residuals.push(residuals_of_all[contender][k]);
                if let Some(deviances) = &trace.deviances[i] {
                    common.deviances.get_or_insert_default().push(deviances[k] - in_unit);
                }
            }
        }
    }
    common
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_likelihood_is_that_of_normal_residuals() {
        // Densities of the residuals, with the standard deviation that maximises the likelihood.
        let residuals = [[1.0, -2.0, 0.5, 1.5].as_slice(), &[10.0, -20.0]];
        let by_density: f64 = residuals
            .iter()
            .map(|e| {
                let sigma = (e.iter().map(|e| e * e).sum::<f64>() / e.len() as f64).sqrt();
                let density =
                    |e: &f64| (-0.5 * (e / sigma).powi(2)).exp() / (sigma * (2.0 * PI).sqrt());
                -2.0 * e.iter().map(|e| density(e).ln()).sum::<f64>()
            })
            .sum();
        let samples =
            |e: &[f64]| ContenderSamples { residuals: e.to_vec(), ..ContenderSamples::default() };
        let computed = deviance(residuals.map(samples).iter()).expect("a number");
        assert!((computed - by_density).abs() < 1e-12, "{computed} {by_density}");
        assert_eq!(deviance([samples(&[0.0, 0.0])].iter()), None);
    }

    #[test]
    fn criteria_charge_for_estimates() {
        let score =
            ContenderScore { deviance: Some(100.0), estimates: 3, at_bounds: 1, samples: 1000 };
        assert_eq!(score.aic(), Some(106.0));
        assert!((score.bic().unwrap_or(0.0) - 120.723_27).abs() < 1e-4);
    }
}
