//! A recording, as it goes to a file.

use std::fmt::Write;

use super::plant::{LPM, State};

/// What was recorded, a row a second, and what was hidden from it.
#[derive(Debug, Clone)]
pub(crate) struct Recording {
    pub(crate) rows: Vec<Row>,
    /// The rig's state at each row.
    pub(crate) hidden: Vec<State>,
    /// Flow into the booster line at each row, m³/s.
    pub(crate) pumped: Vec<f64>,
}

/// One row, in the units of [`HEADER`] and to the digits of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Row {
    pub(crate) time: f64,
    pub(crate) w_ssp: f64,
    pub(crate) q_boost: f64,
    pub(crate) q_tf: f64,
    pub(crate) p_r: f64,
    pub(crate) p_in: f64,
    pub(crate) p_out: f64,
    pub(crate) q_ssp: f64,
}

/// Flow by which a draining or filling booster line counts as active, m³/s.
pub(crate) const ACTIVE: f64 = 60.0 * LPM;

/// The columns of a file.
pub(crate) const HEADER: &str =
    "time [s],w_ssp [%],q_boost [lpm],q_tf [lpm],p_r [bara],p_in [barg],p_out [barg],q_ssp [lpm]";

impl Recording {
    /// The text of a file.
    pub(crate) fn csv(&self) -> String {
        let mut text = format!("{HEADER}\n");
        for row in &self.rows {
            let Row { time, w_ssp, q_boost, q_tf, p_r, p_in, p_out, q_ssp } = row;
            writeln!(text, "{time},{w_ssp},{q_boost},{q_tf},{p_r},{p_in},{p_out},{q_ssp}")
                .expect("a string takes all text");
        }
        text
    }

    /// First and last second of the stretches in which the booster line delivers more than `least`
    /// (m³/s) above or below what is pumped into it.
    pub(crate) fn windows(&self, least: f64) -> Vec<(usize, usize)> {
        let mut windows: Vec<(usize, usize)> = Vec::new();
        for (k, (state, pumped)) in self.hidden.iter().zip(&self.pumped).enumerate() {
            if (state.q_bo - pumped).abs() <= least {
                continue;
            }
            match windows.last_mut() {
                Some((_, last)) if *last + 1 == k => *last = k,
                _ => windows.push((k, k)),
            }
        }
        windows
    }
}

/// A number to five significant digits, which is what the rig's sensors resolve.
pub(crate) fn five_digits(x: f64) -> f64 {
    if x == 0.0 {
        return 0.0;
    }
    let decimals = 4 - x.abs().log10().floor() as i32;
    let scale = 10f64.powi(decimals.abs());
    // Dividing by a power of ten that is exact gives the double nearest to the decimal number.
    if decimals >= 0 { (x * scale).round() / scale } else { (x / scale).round() * scale }
}
