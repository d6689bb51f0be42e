//! What the instruments of Table 3.2 show of the rig.

use super::drilling_rig::plant::{LPM, P_ATM};
use super::drilling_rig::random::Random;
use super::plant::{Pressures, State};

/// What the instruments are like.
#[derive(Debug, Clone)]
pub(crate) struct Instruments {
    /// Reading minus pressure of inlet A and B and of outlet A and B, Pa (§3.3.1).
    pub(crate) offsets: [f64; 4],
    /// White error of every pressure sensor, Pa, and what one count is.
    pub(crate) pressure_noise: f64,
    pub(crate) pressure_count: f64,
    /// True return flow over its reading, θ₁ of (3.9), and the meter's time constant, s.
    pub(crate) theta_1: f64,
    pub(crate) damping: f64,
    /// Errors of the return flow meter, m³/s: white, and correlated over a time, s.
    pub(crate) flow_white: f64,
    pub(crate) flow_coloured: f64,
    pub(crate) flow_correlation: f64,
    /// Below that the return flow meter shows nothing, m³/s.
    pub(crate) cut_off: f64,
    /// White error of the top-fill meter, and what one count of a flow is, m³/s.
    pub(crate) top_fill_noise: f64,
    pub(crate) flow_count: f64,
    /// What one count of the pump's speed reference is, of the maximum.
    pub(crate) speed_count: f64,
}

/// One row, in the units of [`super::files::RECORDING`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Row {
    pub(crate) p_r: f64,
    /// A and B.
    pub(crate) p_in: [f64; 2],
    pub(crate) p_out: [f64; 2],
    pub(crate) q_ssp: f64,
    pub(crate) q_boost: f64,
    pub(crate) q_tf: f64,
    pub(crate) w_ssp: f64,
}

/// Instruments at work: the return flow meter remembers its error.
#[derive(Debug, Clone)]
pub(crate) struct Reader<'a> {
    instruments: &'a Instruments,
    flow_error: f64,
}

/// A value to whole counts.
fn counted(value: f64, count: f64) -> f64 {
    (value / count).round() * count
}

impl Instruments {
    pub(crate) fn reader(&self, random: &mut Random) -> Reader<'_> {
        Reader { instruments: self, flow_error: self.flow_coloured * random.normal() }
    }

    /// The speed reference as the drive takes it.
    pub(crate) fn reference(&self, wanted: f64) -> f64 {
        counted(wanted, self.speed_count)
    }
}

impl Reader<'_> {
    /// Reading of the riser's gauge, Pa above a vacuum.
    pub(crate) fn riser(&self, pressures: &Pressures, random: &mut Random) -> f64 {
        self.pressure(P_ATM + pressures.riser, random)
    }

    fn pressure(&self, value: f64, random: &mut Random) -> f64 {
        let Instruments { pressure_noise, pressure_count, .. } = *self.instruments;
        counted(value + pressure_noise * random.normal(), pressure_count)
    }

    /// The row of a second; `riser` is what the controller was told.
    pub(crate) fn read(
        &mut self,
        state: &State,
        pressures: &Pressures,
        riser: f64,
        settings: [f64; 3],
        random: &mut Random,
    ) -> Row {
        let i = self.instruments;
        let [in_a, in_b, out_a, out_b] = i.offsets;
        let inlet = [in_a, in_b].map(|o| self.pressure(pressures.inlet + o, random) / 1e5);
        let outlet = [out_a, out_b].map(|o| self.pressure(pressures.outlet + o, random) / 1e5);

        // e⁺ = φ e + √(1 − φ²) σ n keeps the variance at σ².
        let kept = (-1.0 / i.flow_correlation).exp();
        let fresh = (1.0 - kept * kept).sqrt() * i.flow_coloured;
        self.flow_error = kept * self.flow_error + fresh * random.normal();
        let flow = state.metered / i.theta_1 + self.flow_error + i.flow_white * random.normal();
        let flow = if state.metered.abs() < i.cut_off { 0.0 } else { flow };

        let [boost, top_fill, reference] = settings;
        let filled = top_fill + i.top_fill_noise * random.normal();
        // A valve that is shut passes nothing, and its meter is cut off.
        let filled = if top_fill == 0.0 { 0.0 } else { filled };
        let count = |flow: f64| counted(flow, i.flow_count) / LPM;
        Row {
            p_r: riser / 1e5,
            p_in: inlet,
            p_out: outlet,
            q_ssp: count(flow),
            q_boost: count(boost),
            q_tf: count(filled),
            w_ssp: 100.0 * reference,
        }
    }
}
