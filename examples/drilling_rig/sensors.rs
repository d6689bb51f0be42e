//! What the instruments show of the plant.

use super::plant::{LPM, Plant, State};

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
            pressures_late: 0.0,
        }
    }
}

/// The gauge in the riser, which may read too much and may stick.
#[derive(Debug, Clone)]
pub(crate) struct RiserGauge {
    offset: f64,
    band: f64,
    /// Where it stands, Pa.
    stands: f64,
}

impl Sensors {
    /// The gauge, standing where the plant is.
    pub(crate) fn riser_gauge(&self, history: &History) -> RiserGauge {
        RiserGauge { offset: self.riser_offset, band: self.riser_band, stands: history.at(0.0).p_r }
    }
}

impl RiserGauge {
    /// Its reading without noise, Pa.
    pub(crate) fn read(&mut self, history: &History, t: f64) -> f64 {
        let there = history.at(t).p_r;
        if (there - self.stands).abs() >= self.band {
            self.stands = there;
        }
        self.stands + self.offset
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
    fn new(plant: &Plant, state: &State) -> Self {
        Self {
            p_r: Plant::riser_pressure(state.h_r),
            p_in: Plant::inlet_pressure(state.h_r),
            p_out: plant.outlet_pressure(state),
            q_ssp: state.q_ssp,
        }
    }
}

impl History {
    /// A history that begins at rest at time zero.
    pub(crate) fn new(plant: &Plant, state: &State) -> Self {
        Self { times: vec![0.0], readings: vec![Reading::new(plant, state)] }
    }

    /// Adds the state at a time later than all before.
    pub(crate) fn push(&mut self, t: f64, plant: &Plant, state: &State) {
        self.times.push(t);
        self.readings.push(Reading::new(plant, state));
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
