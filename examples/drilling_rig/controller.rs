//! What sets the subsea pump's speed once a second.

use super::plant::{G, H_IN, LPM, Plant, RHO};
use super::random::Random;

/// Time constant of the low limit's filter, s.
const FILTER: f64 = 30.0;
/// Flow below which the return line must not come, m³/s.
const LEAST_FLOW: f64 = 300.0 * LPM;
/// Highest speed, of the maximum.
const HIGH: f64 = 0.98;

/// Proportional–integral control of the riser pressure (2.31), between limits.
///
/// Too much pressure wants more speed. The low limit keeps a least flow: it follows the riser level
/// as the inlet pressure shows it. The integral stops where the limits hold the speed.
#[derive(Debug, Clone)]
pub(crate) struct Controller {
    tuning: Tuning,
    /// Speed without an error, of the maximum.
    integral: f64,
    inlet_pressure: f64,
}

/// Gain, 1/Pa, and integral time, s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tuning {
    gain: f64,
    integral_time: f64,
}

impl Tuning {
    pub(crate) fn draw(random: &mut Random) -> Self {
        let gain = random.between(6.0, 10.0) * 1e-7;
        Self { gain, integral_time: random.between(180.0, 260.0) }
    }
}

impl Controller {
    /// A controller at rest at a speed and an inlet pressure, Pa.
    pub(crate) fn new(tuning: Tuning, speed: f64, inlet_pressure: f64) -> Self {
        Self { tuning, integral: speed, inlet_pressure }
    }

    /// The speed for the coming second, from pressures as they are read, Pa.
    pub(crate) fn act(&mut self, plant: &Plant, error: f64, inlet_pressure: f64) -> f64 {
        self.inlet_pressure += (inlet_pressure - self.inlet_pressure) / FILTER;
        let level = H_IN - self.inlet_pressure / (RHO * G);
        let low = plant.steady_speed(level, LEAST_FLOW).min(HIGH);

        // ω = K e + I,  dI/dt = K e / T
        let Tuning { gain, integral_time } = self.tuning;
        let wanted = gain * error + self.integral;
        let outwards = (wanted > HIGH && error > 0.0) || (wanted < low && error < 0.0);
        if !outwards {
            self.integral += gain * error / integral_time;
        }
        wanted.clamp(low, HIGH)
    }
}
