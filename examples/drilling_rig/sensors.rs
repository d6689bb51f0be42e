//! What the instruments show of the plant.

use super::plant::{LPM, Plant, State};
use super::random::Random;

/// Standard deviations of white errors: pressures, Pa, and return flow, m³/s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Noise {
    pub(crate) p_r: f64,
    pub(crate) p_in: f64,
    pub(crate) p_out: f64,
    pub(crate) q_ssp: f64,
}

impl Noise {
    /// What the field's sensors have.
    pub(crate) const FIELD: Self = Self { p_r: 800.0, p_in: 1e3, p_out: 1e3, q_ssp: 14.0 * LPM };
    pub(crate) const NONE: Self = Self { p_r: 0.0, p_in: 0.0, p_out: 0.0, q_ssp: 0.0 };
}

/// What makes instruments worse than white noise does.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Roughness {
    /// Coloured noise, of the white one's standard deviation, has this time constant, s.
    pub(crate) memory: Option<f64>,
    /// Readings are multiples of this, pressures in bar and flows in l/min.
    pub(crate) steps: Option<[f64; 2]>,
}

impl Roughness {
    pub(crate) const NONE: Self = Self { memory: None, steps: None };

    pub(crate) fn draw(random: &mut Random) -> Self {
        let memory = Some(random.between(4.0, 30.0));
        let steps = random.chance(0.5);
        let steps = steps.then(|| [random.between(0.005, 0.02), random.between(5.0, 20.0)]);
        Self { memory, steps }
    }

    pub(crate) fn pressure(&self, bar: f64) -> f64 {
        self.steps.map_or(bar, |[step, _]| (bar / step).round() * step)
    }

    pub(crate) fn flow(&self, lpm: f64) -> f64 {
        self.steps.map_or(lpm, |[_, step]| (lpm / step).round() * step)
    }
}

/// Errors of one sensor.
#[derive(Debug, Clone)]
pub(crate) struct Errors {
    white: f64,
    memory: Option<f64>,
    coloured: f64,
}

impl Errors {
    pub(crate) fn new(white: f64, roughness: &Roughness, random: &mut Random) -> Self {
        let memory = roughness.memory;
        Self { white, memory, coloured: memory.map_or(0.0, |_| white * random.normal()) }
    }

    /// The error of the next second.
    pub(crate) fn next(&mut self, random: &mut Random) -> f64 {
        if let Some(memory) = self.memory {
            // v₊ = φ v + √(1 − φ²) σ ξ,  φ = e^(−1/T)
            let phi = (-1.0 / memory).exp();
            self.coloured =
                phi * self.coloured + (1.0 - phi * phi).sqrt() * self.white * random.normal();
        }
        self.coloured + self.white * random.normal()
    }
}

/// What is wrong with the instruments; nothing, by default.
#[derive(Debug, Clone)]
pub(crate) struct Sensors {
    /// True return flow over the reading.
    pub(crate) theta: f64,
    /// Reading of the return flow meter without a flow, m³/s, and its delay, s.
    pub(crate) flow_offset: f64,
    pub(crate) flow_delay: f64,
    /// What the riser's gauge reads too much, and how far off it must be to move, Pa.
    pub(crate) riser_offset: f64,
    pub(crate) riser_band: f64,
    /// What it reads too much for each second since the beginning, Pa/s.
    pub(crate) riser_drift: f64,
    /// How late the recorder stamps the pressures, s.
    pub(crate) pressures_late: f64,
}

impl Default for Sensors {
    fn default() -> Self {
        Self {
            theta: 1.0,
            flow_offset: 0.0,
            flow_delay: 0.0,
            riser_offset: 0.0,
            riser_band: 0.0,
            riser_drift: 0.0,
            pressures_late: 0.0,
        }
    }
}

/// The gauge in the riser, which may read too much and may stick.
#[derive(Debug, Clone)]
pub(crate) struct RiserGauge {
    offset: f64,
    drift: f64,
    band: f64,
    /// Where it stands, Pa.
    stands: f64,
}

impl Sensors {
    /// The gauge, standing where the plant is.
    pub(crate) fn riser_gauge(&self, history: &History) -> RiserGauge {
        RiserGauge {
            offset: self.riser_offset,
            drift: self.riser_drift,
            band: self.riser_band,
            stands: history.at(0.0).p_r,
        }
    }
}

impl RiserGauge {
    /// Its reading without noise, Pa.
    pub(crate) fn read(&mut self, history: &History, t: f64) -> f64 {
        let there = history.at(t).p_r;
        if (there - self.stands).abs() >= self.band {
            self.stands = there;
        }
        self.stands + self.offset + self.drift * t
    }
}

/// What instruments without fault and noise would have read, in SI units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reading {
    pub(crate) p_r: f64,
    pub(crate) p_in: f64,
    pub(crate) p_out: f64,
    pub(crate) q_ssp: f64,
}

/// The past of all readings; before its first moment the plant was at rest.
#[derive(Debug, Clone)]
pub(crate) struct History {
    times: Vec<f64>,
    readings: Vec<Reading>,
}

impl Reading {
    fn new(t: f64, plant: &Plant, state: &State) -> Self {
        Self {
            p_r: plant.riser_pressure(t, state.h_r),
            p_in: Plant::inlet_pressure(plant.density(t), state.h_r),
            p_out: plant.outlet_pressure(t, state),
            q_ssp: state.q_ssp,
        }
    }
}

impl History {
    /// A history that begins at rest at time zero.
    pub(crate) fn new(plant: &Plant, state: &State) -> Self {
        Self { times: vec![0.0], readings: vec![Reading::new(0.0, plant, state)] }
    }

    /// Adds the state at a time later than all before.
    pub(crate) fn push(&mut self, t: f64, plant: &Plant, state: &State) {
        self.times.push(t);
        self.readings.push(Reading::new(t, plant, state));
    }

    /// The readings at a time, linear between two that were kept.
    pub(crate) fn at(&self, t: f64) -> Reading {
        let after = self.times.partition_point(|&time| time <= t);
        if after == 0 {
            return self.readings[0];
        }
        let Some(&b) = self.readings.get(after) else { return self.readings[after - 1] };
        let a = self.readings[after - 1];
        let share = (t - self.times[after - 1]) / (self.times[after] - self.times[after - 1]);
        let between = |a: f64, b: f64| a + share * (b - a);
        Reading {
            p_r: between(a.p_r, b.p_r),
            p_in: between(a.p_in, b.p_in),
            p_out: between(a.p_out, b.p_out),
            q_ssp: between(a.q_ssp, b.q_ssp),
        }
    }
}
