//! Estimates the unknown input at one place of any model.
//!
//! Haukanes (2015, eq. 3.10) computed, from the measured level of a riser, the flow missing from its balance, and
//! recognised the effect in its trace. Here the same is done for every equation and sensor: the unknown input d at one
//! place is a random walk of intensity q, ⟨(d(t + h) − d(t))²⟩ = q h, whose effect on measurements is given by the
//! linearised model, and which a smoother estimates from the whole recording.
//!
//! q maximises the likelihood of the measured residuals: √(q T) on a grid of decades above the size of a just
//! detectable constant d, then refined. The gain in log-likelihood over q = 0, where nothing is missing, is the
//! [`UnknownInput::gain`]. Since q cannot be negative, 2·gain of noise alone exceeds c with a probability of ½ P(χ²₁ >
//! c) (Self & Liang, J. Am. Stat. Assoc. 82 (1987) 605–610, case 5).
//!
//! The estimate shows the place, not the cause: an input that is free in time can explain, at a cost, a term that is
//! really missing elsewhere. Compare the gains of all places. For effects so large that the model is no longer linear
//! in them, use [`reconstruct`](crate::reconstruct).
//!
//! Source of the approach: Kristensen, Madsen, Jørgensen, Parameter estimation in stochastic
//! grey-box models, Automatica 40 (2004) 225–237.

use super::deviations::Deviations;
use super::kalman::{DeviationChain, InputWalk};
use crate::noise::{SignalWindow, gather};
use dgd_screen::noise::{SensorNoise, median};

/// The input at one place with which the model would follow the measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct UnknownInput {
    /// The samples' times, s.
    pub times: Vec<f64>,
    /// d: for an equation, the term missing from its right-hand side as written; for an output, the sensor's reading
    /// minus the model's output. SI units of the place; constant from one sample to the next.
    pub estimate: Vec<f64>,
    /// Standard deviation of the estimate, given q and the sensors' noise. If q = 0 the estimate is zero, and this is
    /// the accuracy to which a constant d could be known.
    pub std: Vec<f64>,
    /// q, unit²/s; 0 if no random walk makes the measurements more likely than no input.
    pub intensity: f64,
    /// Gain in log-likelihood over q = 0, in nats; 0 if q = 0.
    pub gain: f64,
    /// Windows in which d exceeds three standard deviations, extended as long as it keeps its sign and exceeds two.
    /// Empty if noise alone has such a gain in more than one of ten thousand recordings.
    pub windows: Vec<SignalWindow>,
    /// The residuals after subtracting d and correlated noise, n_w per sample; NaN where nothing was measured.
    pub residuals: Vec<f64>,
}

/// Decades of √(q T) above the size of a just detectable constant. 0 is that constant; 9 is a walk that is visible in
/// every single sample, if a constant is integrated over 10⁶ of them.
const DECADES: i32 = 9;
/// The grid ends when a walk two decades above the best is less likely by this: a freer one only follows the noise more
/// closely.
const BELOW_HOPE: f64 = 20.0;
/// Halvings of the grid's step, down to an eighth of a decade: the likelihood of q, about a decade wide, does not
/// resolve less.
const HALVINGS: usize = 3;
/// A gain that noise alone exceeds with a probability of ½ P(χ²₁ > 2·6.9) = 10⁻⁴.
pub(super) const SIGNIFICANT_GAIN: f64 = 6.9;
/// Standard deviations at which a window starts, and down to which it extends.
const STANDS_OUT: f64 = 3.0;
const GOES_ON: f64 = 2.0;
/// Minimum length of gaps in a window that are bridged, in typical sample intervals.
const BRIDGED: f64 = 5.0;

/// Estimates the unknown input at one place.
///
/// | name | shape | unit |
/// |---|---|---|
/// | `place` | position in `MissingTerms::places` | |
/// | `residuals` | n_w per sample, measured − simulated; not finite where not measured | SI |
/// | `noise` | n_w, white and correlated; outputs without any are left out | SI |
///
/// `None` if no measured output depends on the place.
///
/// # Panics
///
/// If the residuals or the noise have the wrong length, or there is no such place.
pub fn unknown_input(
    deviations: &Deviations,
    place: usize,
    residuals: &[f64],
    noise: &[Option<SensorNoise>],
) -> Option<UnknownInput> {
    let n_w = deviations.n_outputs;
    assert!(place < deviations.n_places, "a place of the model");
    assert_eq!(noise.len(), n_w, "a noise level for each output");
    assert_eq!(residuals.len(), n_w * deviations.times.len(), "residuals of all samples");
    let chain = DeviationChain::new(deviations, place, InputWalk::Random, residuals, noise);
    let information = chain.information_on_a_constant();
    if !(information > 0.0 && information.is_finite() && chain.duration() > 0.0) {
        return None;
    }

    let just_seen = 1.0 / information.sqrt();
    let intensity = |decades: f64| (just_seen * 10f64.powf(decades)).powi(2) / chain.duration();
    let nothing = chain.log_likelihood(0.0);
    let (decades, best) = maximum(|decades| chain.log_likelihood(intensity(decades)));
    let gain = best - nothing;
    let is_found = gain > 0.0 && gain.is_finite();
    let intensity = if is_found { intensity(decades) } else { 0.0 };

    let mut smoothed = chain.smooth(intensity);
    if !is_found {
        smoothed.std.fill(just_seen);
    }
    let mut left = vec![f64::NAN; residuals.len()];
    for (measurement, residual) in chain.measurements.iter().zip(&smoothed.residuals) {
        left[measurement.sample * n_w + measurement.output] = *residual;
    }
    let windows = if is_found && gain > SIGNIFICANT_GAIN {
        standing_out(&deviations.times, &smoothed.input, &smoothed.std, intensity)
    } else {
        Vec::new()
    };
    Some(UnknownInput {
        times: deviations.times.clone(),
        estimate: smoothed.input,
        std: smoothed.std,
        intensity,
        gain: if is_found { gain } else { 0.0 },
        windows,
        residuals: left,
    })
}

/// The position and value of the maximum of f between 0 and [`DECADES`]: the best of a grid, refined by halved steps.
pub(super) fn maximum(f: impl Fn(f64) -> f64) -> (f64, f64) {
    let mut best = (0.0, f(0.0));
    for decade in 1..=DECADES {
        let x = f64::from(decade);
        let value = f(x);
        if value > best.1 {
            best = (x, value);
        } else if x > best.0 + 1.0 && value < best.1 - BELOW_HOPE {
            break;
        }
    }
    let mut step = 0.5;
    for _ in 0..HALVINGS {
        let (below, above) = (best.0 - step, best.0 + step);
        let sides = [(below, f(below)), (above, f(above))];
        for side in sides {
            if side.1 > best.1 {
                best = side;
            }
        }
        step *= 0.5;
    }
    best
}

/// Windows around where |d| exceeds three standard deviations, as far as it exceeds two.
pub(super) fn standing_out(
    times: &[f64],
    estimate: &[f64],
    std: &[f64],
    intensity: f64,
) -> Vec<SignalWindow> {
    let z: Vec<f64> =
        estimate.iter().zip(std).map(|(d, std)| if *std > 0.0 { d / std } else { 0.0 }).collect();
    let mut marked: Vec<Option<f64>> =
        z.iter().map(|z| (z.abs() > STANDS_OUT).then_some(*z)).collect();
    let last = marked.len() - 1;
    let steps = (0..last).map(|k| (k, k + 1)).chain((0..last).rev().map(|k| (k + 1, k)));
    for (from, to) in steps {
        if marked[from].is_some_and(|mark| mark * z[to] > 0.0) && z[to].abs() > GOES_ON {
            marked[to] = Some(z[to]);
        }
    }
    let mut spacings: Vec<f64> =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|h| *h > 0.0).collect();
    let usual = median(&mut spacings).unwrap_or(0.0);
    // If d itself is measured, errors of its estimate are correlated as exp(−|τ| q/(2 std²)): gaps of up to twice that
    // time are not resolved.
    let resolved = 4.0 * median(&mut std.to_vec()).unwrap_or(0.0).powi(2) / intensity;
    gather(times, estimate, &marked, resolved.max(BRIDGED * usual))
}
