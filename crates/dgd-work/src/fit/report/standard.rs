//! Standardised residuals, for tests and figures.
//!
//! ```text
//!   z = (measured − simulated)/σ        log-normal noise: (ln measured − ln simulated)/σ
//!   Student's t: Φ⁻¹(F(z)), the normal deviate of the same probability
//! ```
//!
//! σ is the noise of the output, or of the single reading if the noise is a formula or recorded. For a correct model z
//! is standard normal whatever the noise is, so that tests keep their significance level.

use dgd_identify::{Fit, JudgedReading, NoiseSource, Recording};
use dgd_runtime::signature::Distribution;
use dgd_screen::distribution::normal_of_student;

/// A residual over its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StandardisedResidual {
    /// z.
    pub residual: f64,
    /// The same with the weight of the fit's loss, so that outliers do not dominate tests.
    pub tested: f64,
    /// −2 ln of the density of the reading, SI; `None` if all readings of the output have the same σ.
    pub deviance: Option<f64>,
}

impl StandardisedResidual {
    /// For a sample that does not count.
    pub(crate) fn missing(changes: bool) -> Self {
        let deviance = changes.then_some(f64::NAN);
        StandardisedResidual { residual: f64::NAN, tested: f64::NAN, deviance }
    }
}

/// The noise used and estimated by a fit.
#[derive(Clone, Copy)]
pub(crate) struct NoiseStandard<'a> {
    pub noise: &'a [Option<NoiseSource>],
    pub fit: &'a Fit,
}

impl NoiseStandard<'_> {
    /// Whether the readings of an output have standard deviations of their own.
    pub(crate) fn changes(&self, output: usize) -> bool {
        self.noise[output].is_some_and(NoiseSource::is_likelihood)
    }

    /// The residual of sample k of an output for the model outputs `w`; `None` if the output is not fitted and its
    /// noise therefore unknown.
    pub(crate) fn standardise(
        &self,
        recording: &Recording,
        output: usize,
        k: usize,
        w: &[f64],
    ) -> Option<StandardisedResidual> {
        let (noise, sigma) = (self.noise[output]?, self.fit.noise[output]?);
        if let Some(JudgedReading { residual, distribution, deviance }) =
            noise.judge(recording, output, k, w)
        {
            let z = match distribution {
                Distribution::Normal | Distribution::LogNormal => residual,
                Distribution::Student { freedom } => normal_of_student(residual, freedom),
            };
            return Some(StandardisedResidual { residual: z, tested: z, deviance: Some(deviance) });
        }
        let error = recording.measured[output].as_ref()?[k] - w[output];
        let z = error / sigma;
        Some(StandardisedResidual {
            residual: z,
            tested: self.fit.weight(output, error) * z,
            deviance: None,
        })
    }
}
