//! Residuals over their own standard deviations: what tests and figures are made of.
//!
//! ```text
//!   z = (measured − simulated)/σ        log-normal noise: (ln measured − ln simulated)/σ
//!   Student's: Φ⁻¹(F(z)), the normal deviate of the same probability
//! ```
//!
//! σ is that of the output, or that of the reading where the noise is a formula or recorded. Where the model is right,
//! z are standard normal deviates whatever the noise is, so that tests have their level.

use dgd_identify::{Fit, Judged, Noise, Recording};
use dgd_runtime::signature::Distribution;
use dgd_screen::distribution::normal_of_student;

/// A residual over its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Standardised {
    /// z.
    pub residual: f64,
    /// The same with the weight of the fit's loss: outliers do not hide what other samples show.
    pub tested: f64,
    /// −2 ln of the density of the reading, SI; `None` where all readings of the output have one σ.
    pub deviance: Option<f64>,
}

impl Standardised {
    /// That of a sample that does not count.
    pub(crate) fn missing(changes: bool) -> Self {
        let deviance = changes.then_some(f64::NAN);
        Standardised { residual: f64::NAN, tested: f64::NAN, deviance }
    }
}

/// The noise with which a fit was made, and which it found.
#[derive(Clone, Copy)]
pub(crate) struct Standard<'a> {
    pub noise: &'a [Option<Noise>],
    pub fit: &'a Fit,
}

impl Standard<'_> {
    /// Whether the readings of an output have standard deviations of their own.
    pub(crate) fn changes(&self, output: usize) -> bool {
        self.noise[output].is_some_and(Noise::is_likelihood)
    }

    /// The residual of sample k of an output, where the model has the outputs `w`; `None` where the output is not
    /// fitted, so that its noise is not known.
    pub(crate) fn of(
        &self,
        recording: &Recording,
        output: usize,
        k: usize,
        w: &[f64],
    ) -> Option<Standardised> {
        let (noise, sigma) = (self.noise[output]?, self.fit.noise[output]?);
        if let Some(Judged { residual, distribution, deviance }) =
            noise.judge(recording, output, k, w)
        {
            let z = match distribution {
                Distribution::Normal | Distribution::LogNormal => residual,
                Distribution::Student { freedom } => normal_of_student(residual, freedom),
            };
            return Some(Standardised { residual: z, tested: z, deviance: Some(deviance) });
        }
        let error = recording.measured[output].as_ref()?[k] - w[output];
        let z = error / sigma;
        Some(Standardised {
            residual: z,
            tested: self.fit.weight(output, error) * z,
            deviance: None,
        })
    }
}
