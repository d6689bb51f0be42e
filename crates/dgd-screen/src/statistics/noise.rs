//! Estimates a sensor's noise from its own record.
//!
//! For three neighbouring samples of r = s + v, with s smooth and v white of variance σ²,
//!
//! ```text
//!   e = (r₁ − a r₀ − b r₂)/√(1 + a² + b²),   a = (t₂ − t₁)/(t₂ − t₀),   b = (t₁ − t₀)/(t₂ − t₀)
//! ```
//!
//! has variance σ²: linear trends over three samples cancel, and s adds s̈²h⁴/6 at a spacing of h. With equal spacing
//! e² = Δ²/6 for second differences Δ. Steps, spikes and the curvature of a few samples are cut off: σ² is the mean of
//! e² over |e| ≤ 3σ, divided by its value for a normal distribution, starting from the median of |e|. If that is zero,
//! most of the record is constant: if it changes by the sensor's step at times, e of about that size count; otherwise
//! values are set and have no noise.
//!
//! Source: Gasser, Sroka, Jennen-Steinmetz, Residual variance and residual pattern in nonlinear
//! regression, Biometrika 73 (1986) 625–633, for e; the trimming is Huber's proposal of a truncated
//! second moment (Robust Statistics, 1981, §5).

/// The correlated part of a sensor's noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseColour {
    /// Its standard deviation, in the unit of the samples.
    pub std: f64,
    /// The time after which its autocorrelation is 1/e, s.
    pub memory: f64,
}

/// Noise of one sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorNoise {
    /// Standard deviation σ of its white part, in the unit of the samples; at least that of rounding to the sensor's
    /// steps, if it has any.
    pub std: f64,
    /// Standard error of the estimate relative to σ.
    pub relative_error: f64,
    /// The step to multiples of which the sensor rounds, if it does.
    pub quantisation: Option<f64>,
    /// Its correlated part, if it has one.
    pub colour: Option<NoiseColour>,
}

impl SensorNoise {
    /// Known noise.
    pub fn known(std: f64) -> Self {
        SensorNoise { std, relative_error: 0.0, quantisation: None, colour: None }
    }

    /// Standard deviation of all its parts together.
    pub fn total(&self) -> f64 {
        self.std.hypot(self.colour.map_or(0.0, |colour| colour.std))
    }
}

/// Cut-off of the squares, in standard deviations.
const CUT: f64 = 3.0;
/// Mean square of a standard normal number within ±3: 1 − 2·3·φ(3)/(2Φ(3) − 1).
const LEFT_WITHIN_CUT: f64 = 0.973_336_924_606_624_6;
/// Median magnitude of a standard normal number.
const MEDIAN_SIZE: f64 = 0.674_489_750_196_081_7;
/// Minimum number of triples for a noise level, and of steps for a step size.
const FEWEST: usize = 8;
/// Unit conversions change the last bits of a reading.
const ROUNDING: f64 = 1e-12;

/// White noise of a sensor from its residuals (measured − simulated) and its readings.
///
/// Without a model, the readings serve as residuals. Samples that are not finite are skipped, as are triples that span
/// more than three times the median spacing. `None` if too little is left, nothing ever changes, or values are set and
/// held.
///
/// # Panics
///
/// If the slices differ in length.
pub fn white_noise(times: &[f64], residuals: &[f64], measured: &[f64]) -> Option<SensorNoise> {
    assert_eq!(times.len(), residuals.len(), "a residual for each time");
    assert_eq!(times.len(), measured.len(), "a reading for each time");
    let errors = second_difference_errors(times, residuals);
    if errors.len() < FEWEST {
        return None;
    }
    let quantisation = quantisation_step(measured);
    // Rounding to multiples of q adds an error with a variance of q²/12.
    let rounding = quantisation.map_or(0.0, |step| step / 12f64.sqrt());
    let mut sizes: Vec<f64> = errors.iter().map(|e| e.abs()).collect();
    let typical = median(&mut sizes)? / MEDIAN_SIZE;
    let std = if typical > 0.0 {
        trimmed_root_mean_square(&errors, typical)
    } else {
        // |e| is less than a change of the middle one of three samples.
        let step = quantisation.or_else(|| flicker(measured))?;
        mean_square(&errors, step).sqrt()
    };
    // A value that jumps by several steps at a time, never by one, is set.
    if std == 0.0 {
        return None;
    }
    let std = std.max(rounding);
    // Var(mean Δ²/6)/σ⁴ = 2·(36 + 2·16 + 2·1)/36/N = 35/(9N) from the autocorrelation 6, −4, 1 of
    // second differences; half of its root for σ. The trimming costs 6 % more.
    let relative_error = 1.06 * 0.5 * (35.0 / (9.0 * errors.len() as f64)).sqrt();
    Some(SensorNoise { std, relative_error, quantisation, colour: None })
}

/// e of each triple of neighbouring valid samples.
fn second_difference_errors(times: &[f64], residuals: &[f64]) -> Vec<f64> {
    let valid: Vec<(f64, f64)> = times
        .iter()
        .zip(residuals)
        .filter(|(t, r)| t.is_finite() && r.is_finite())
        .map(|(t, r)| (*t, *r))
        .collect();
    let mut spacings: Vec<f64> =
        valid.windows(2).map(|pair| pair[1].0 - pair[0].0).filter(|h| *h > 0.0).collect();
    let Some(usual) = median(&mut spacings) else { return Vec::new() };
    valid
        .windows(3)
        .filter_map(|triple| {
            let [(t0, r0), (t1, r1), (t2, r2)] = [triple[0], triple[1], triple[2]];
            if t1 <= t0 || t2 <= t1 || t2 - t0 > 3.0 * usual * (1.0 + 1e-9) {
                return None;
            }
            let (a, b) = ((t2 - t1) / (t2 - t0), (t1 - t0) / (t2 - t0));
            Some((r1 - a * r0 - b * r2) / (1.0 + a * a + b * b).sqrt())
        })
        .collect()
}

/// Mean of e² where |e| is within a bound.
fn mean_square(errors: &[f64], bound: f64) -> f64 {
    let kept = errors.iter().filter(|e| e.abs() <= bound);
    let (sum, count) = kept.fold((0.0, 0usize), |(sum, n), e| (sum + e * e, n + 1));
    sum / count.max(1) as f64
}

/// σ with σ² = mean(e² where |e| ≤ 3σ)/(the same for a unit normal distribution), from an initial guess.
fn trimmed_root_mean_square(errors: &[f64], guess: f64) -> f64 {
    let mut std = guess;
    // A fixed point: the set of errors within the bound stops changing after a few rounds.
    for _ in 0..20 {
        let next = (mean_square(errors, CUT * std) / LEFT_WITHIN_CUT).sqrt();
        if (next - std).abs() <= 1e-12 * std {
            break;
        }
        std = next;
    }
    std
}

/// The step of a mostly constant reading that flickers between a few levels; `None` if most changes exceed the
/// smallest, or there are few: then the value is set and held.
fn flicker(measured: &[f64]) -> Option<f64> {
    let valid: Vec<f64> = measured.iter().copied().filter(|value| value.is_finite()).collect();
    let size = valid.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
    let changes: Vec<f64> = valid
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|change| *change > ROUNDING * size)
        .collect();
    let step = changes.iter().copied().fold(f64::INFINITY, f64::min);
    let single = changes.iter().filter(|change| **change < 1.5 * step).count();
    (single >= FEWEST && 2 * single > changes.len()).then_some(step)
}

/// The step to multiples of which, up to an offset, all readings are rounded; `None` if they are not, or with fewer
/// than eight different distances.
///
/// The smallest distance between two different readings is the initial step, refined by every larger one; each must be
/// a multiple of it within a tenth of the step. Eight distances that are not multiples pass by accident with a
/// probability of 0.2⁸ ≈ 3·10⁻⁶.
pub fn quantisation_step(measured: &[f64]) -> Option<f64> {
    let mut levels: Vec<f64> = measured.iter().copied().filter(|value| value.is_finite()).collect();
    levels.sort_unstable_by(f64::total_cmp);
    let (&lowest, &highest) = (levels.first()?, levels.last()?);
    let rounding = ROUNDING * lowest.abs().max(highest.abs());
    let mut distances: Vec<f64> = levels
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .filter(|distance| *distance > rounding)
        .collect();
    distances.sort_unstable_by(f64::total_cmp);
    if distances.len() < FEWEST {
        return None;
    }
    // step = Σ distances / Σ multiples
    let (mut sum, mut multiples) = (0.0, 0.0);
    let mut step = distances[0];
    for distance in distances {
        let multiple = (distance / step).round();
        if (distance - multiple * step).abs() > 0.1 * step + rounding {
            return None;
        }
        sum += distance;
        multiples += multiple;
        step = sum / multiples;
    }
    Some(step)
}

/// The median of the values, which are sorted; `None` without values.
pub fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    let lower = values[(values.len() - 1) / 2];
    Some(f64::midpoint(lower, upper))
}
