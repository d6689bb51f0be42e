//! The values in an equation at the samples that have all of them.

use dgd_runtime::Pattern;

use super::signals::ChosenSources;
use super::{InversionError, InversionProblem};
use crate::regression::known::RecordingSamples;
use crate::regression::known::gains::Gains;
use crate::variables::first_start;

/// The equation at one sample.
#[derive(Debug, Clone)]
pub(super) struct EquationSample {
    /// Position among all samples.
    pub(super) at: usize,
    pub(super) t: f64,
    /// Whether the equation has a derivative there.
    pub(super) is_differential: bool,
    /// y_i, if the equation has its derivative.
    pub(super) y: f64,
    pub(super) g: f64,
    pub(super) c: f64,
    /// Errors of y_i and g for an error of one standard deviation of each sensor.
    pub(super) y_errors: Vec<f64>,
    pub(super) g_errors: Vec<f64>,
    /// Whether it continues the previous sample, without a jump in between.
    pub(super) goes_on: bool,
}

/// All usable samples.
pub(super) struct EquationSamples {
    pub(super) times: Vec<f64>,
    pub(super) known: Vec<EquationSample>,
}

impl EquationSamples {
    pub(super) fn new(
        problem: &InversionProblem<'_>,
        chosen: &ChosenSources,
    ) -> Result<Self, InversionError> {
        let InversionProblem { system, p, recording, input, .. } = *problem;
        let signature = system.signature();
        let row = chosen.equation;
        let known = RecordingSamples::new(system, p, 0, recording, &chosen.sensors, None)
            .map_err(InversionError::Known)?;
        let guess = first_start(system, p, recording).unwrap_or_else(|_| {
            signature.unknowns.iter().map(|unknown| unknown.unit.factor).collect()
        });
        let mut gains = Gains::new(system, &chosen.sensors, guess);
        let of_row = |pattern: &Pattern| -> Vec<(usize, usize)> {
            let places = pattern.positions().enumerate();
            places.filter(|(_, (r, _))| *r == row).map(|(k, (_, column))| (k, column)).collect()
        };
        let by_y = of_row(&signature.jacobian);
        let by_d = of_row(&signature.input_jacobian).into_iter().find(|(_, c)| *c == input);
        let n = signature.unknowns.len();
        let (mut f, mut dfdt) = (vec![0.0; n], vec![0.0; n]);
        let mut dfdy = vec![0.0; signature.jacobian.len()];
        let mut dfdu = vec![0.0; signature.input_jacobian.len()];
        let (mut mass, still) = (vec![0.0; n], vec![0.0; signature.n_u()]);
        let mut samples: Vec<EquationSample> = Vec::new();
        let mut is_cut = false;
        for (at, t) in known.times.iter().enumerate() {
            is_cut |= known.is_cut(at);
            let point = known.point(at, p);
            if at >= known.lost_from || chosen.needs.iter().any(|i| !point.y[*i].is_finite()) {
                continue;
            }
            // Unknown values are not read either.
            let y: Vec<f64> =
                point.y.iter().map(|y| if y.is_finite() { *y } else { 0.0 }).collect();
            let point = dgd_runtime::EvaluationPoint { y: &y, ..point };
            system.linearize(point, &still, &mut f, &mut dfdy, &mut dfdt);
            system.input_jacobian(point, &mut dfdu);
            system.mass(point, &mut mass);
            let c = by_d.map_or(0.0, |(place, _)| dfdu[place]);
            if !(f[row].is_finite() && c.is_finite() && c != 0.0) {
                is_cut = true;
                continue;
            }
            let measured = |i: usize| recording.measured[i].as_ref().map_or(f64::NAN, |w| w[at]);
            let Some(errors) = gains.compute(&known, at, p, &measured) else { continue };
            let is_differential = mass[row] != 0.0;
            let sensors = 0..errors.ncols();
            let of_g = |s: usize| {
                by_y.iter().map(|(place, j)| dfdy[*place] * errors[(*j, s)]).sum::<f64>()
            };
            let of_y = |s: usize| if is_differential { errors[(row, s)] } else { 0.0 };
            let same = samples.last().is_none_or(|last| last.is_differential == is_differential);
            samples.push(EquationSample {
                at,
                t: *t,
                is_differential,
                y: if is_differential { y[row] } else { 0.0 },
                g: f[row],
                c,
                y_errors: sensors.clone().map(of_y).collect(),
                g_errors: sensors.map(of_g).collect(),
                goes_on: !samples.is_empty() && !is_cut && same,
            });
            is_cut = false;
        }
        if samples.len() < 2 {
            return Err(InversionError::NoSamples);
        }
        Ok(EquationSamples { times: known.times.clone(), known: samples })
    }

    /// The usual time between samples, s.
    pub(super) fn spacing(&self) -> f64 {
        let mut steps: Vec<f64> = self.known.windows(2).map(|pair| pair[1].t - pair[0].t).collect();
        steps.retain(|step| *step > 0.0);
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied().unwrap_or(0.0)
    }

    /// Whether the equation has a derivative at any sample.
    pub(super) fn sums_up(&self) -> bool {
        self.known.iter().any(|sample| sample.is_differential)
    }
}
