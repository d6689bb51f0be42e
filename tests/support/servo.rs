//! Readings of a servo, made by small steps without any solver of this project, and its model.

#![allow(dead_code, reason = "no test binary uses all of it")]

use super::examined::Samples;
use super::random::Random;

/// A motor with viscous friction alone.
pub(crate) const MODEL: &str = "/// A motor with a load.
model servo

input u [V] linear    /// at the motor

parameter gain    [rad/(s^2*V)] = 5    in 0.1 .. 100, log    /// torque over inertia and voltage
parameter viscous [1/s]         = 1.5  in 0.01 .. 100, log

state w   [rad/s] = 0
state phi [rad]   = 0

equation motor: der(w)   = gain*u - viscous*w
equation shaft: der(phi) = w

output w   [rad/s]  noise 0.02 [rad/s]
output phi [rad]    noise 0.005 [rad]
";

/// Samples in a second.
const RATE: usize = 20;
const GAIN: f64 = 6.0;
const VISCOUS: f64 = 2.0;
/// Standard deviations of the white noise of both sensors.
const NOISE: [f64; 2] = [0.02, 0.005];

/// What a servo and its sensors have that the model has not; nothing, by default.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Servo {
    /// Coulomb friction over inertia, rad/s².
    pub(crate) friction: f64,
    /// Voltage that the amplifier does not pass on, V.
    pub(crate) dead_band: f64,
    /// The largest voltage that the amplifier passes on, V.
    pub(crate) most: Option<f64>,
    /// Time constant of the tachometer, s.
    pub(crate) lag: f64,
    /// Step of the encoder, rad.
    pub(crate) step: f64,
    /// Coloured noise of both sensors, as large as their white one, has this memory, s.
    pub(crate) memory: Option<f64>,
}

impl Servo {
    /// Readings for so many seconds at 20 Hz.
    ///
    /// ẇ = gain u − viscous w − friction sign(w) by steps of 0.1 ms; at rest it sticks while the motor is
    /// weaker than the friction. Nothing is smoothed.
    pub(crate) fn record(&self, seed: u64, seconds: usize) -> Samples {
        let is_smooth = self.friction == 0.0 && self.dead_band == 0.0 && self.most.is_none();
        let steps = if is_smooth { 50 } else { 500 };
        let mut random = Random::new(seed, 1);
        let n = RATE * seconds;
        let parts: Vec<[f64; 3]> = (0..4)
            .map(|_| {
                let (size, period) = (random.between(0.3, 0.9), random.between(2.0, 12.0));
                [size, std::f64::consts::TAU / period, random.between(0.0, 6.0)]
            })
            .collect();
        let times: Vec<f64> = (0..=n).map(|k| k as f64 / RATE as f64).collect();
        let voltage = |t: &f64| parts.iter().map(|[a, f, start]| a * (f * t + start).sin()).sum();
        let u: Vec<f64> = times.iter().map(voltage).collect();
        let (mut w, mut phi) = (0.0_f64, 0.0_f64);
        let mut shown = w;
        let (mut read_w, mut read_phi) = (Vec::new(), Vec::new());
        let mut errors = [Coloured::new(self.memory), Coloured::new(self.memory)];
        for k in 0..=n {
            let [of_w, of_phi] = [0, 1].map(|i| NOISE[i] * errors[i].next(&mut random));
            let rounded = |phi: f64| {
                if self.step > 0.0 { (phi / self.step).round() * self.step } else { phi }
            };
            read_w.push(of_w + if self.lag > 0.0 { shown } else { w });
            read_phi.push(rounded(phi + of_phi));
            let next = u[(k + 1).min(n)];
            for step in 0..steps {
                let h = 1.0 / (RATE * steps) as f64;
                let share = (step as f64 + 0.5) / steps as f64;
                let voltage =
                    (u[k] + share * (next - u[k])).min(self.most.unwrap_or(f64::INFINITY));
                let beyond = voltage - voltage.clamp(-self.dead_band, self.dead_band);
                let motor = |w: f64| GAIN * beyond - VISCOUS * w;
                let before = w;
                if w == 0.0 {
                    let moving = (motor(w).abs() - self.friction).max(0.0);
                    w += h * moving * motor(w).signum();
                } else {
                    // The midpoint, with the friction that the beginning has.
                    let against = self.friction * w.signum();
                    w += h * (motor(w + 0.5 * h * (motor(w) - against)) - against);
                    if w * before < 0.0 && self.friction > 0.0 {
                        w = 0.0;
                    }
                }
                phi += 0.5 * h * (before + w);
                if self.lag > 0.0 {
                    shown += h / self.lag * (0.5 * (before + w) - shown);
                }
            }
        }
        let columns = [("u", u), ("w", read_w), ("phi", read_phi)];
        Samples { times, columns: columns.map(|(name, values)| (name.to_owned(), values)).to_vec() }
    }
}

/// White noise of one, and as much coloured noise where it has a memory.
#[derive(Debug, Clone)]
struct Coloured {
    memory: Option<f64>,
    state: Option<f64>,
}

impl Coloured {
    fn new(memory: Option<f64>) -> Self {
        Self { memory, state: None }
    }

    fn next(&mut self, random: &mut Random) -> f64 {
        let white = random.normal();
        let Some(memory) = self.memory else { return white };
        // v₊ = φ v + √(1 − φ²) ξ,  φ = e^(−h/T), from where it has been for ever.
        let phi = self.state.map_or(0.0, |_| (-1.0 / (RATE as f64 * memory)).exp());
        let v = phi * self.state.unwrap_or(0.0) + (1.0 - phi * phi).sqrt() * random.normal();
        self.state = Some(v);
        white + v
    }
}
