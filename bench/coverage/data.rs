//! Problems, their true values, and recordings of them from solutions in closed form.

use dgd_identify::Recording;
use dgd_runtime::{InputColumn, Inputs, Interpolation};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

/// What is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Problem {
    Substrate,
    Siphon,
    Room,
}

/// mmol/l in mol/m³, l/min in m³/s, cm in m, min in s.
const MILLIMOLAR: f64 = 1.0;
const LITRES_PER_MINUTE: f64 = 1e-3 / 60.0;
const CENTIMETRES: f64 = 0.01;
const MINUTES: f64 = 60.0;
const KILOWATTS: f64 = 1e3;

/// Most turned over per second, concentration at half of that, and at the beginning.
const SUBSTRATE: [f64; 3] = [0.08 * MILLIMOLAR, 1.5 * MILLIMOLAR, 4.0 * MILLIMOLAR];
/// Inflow, flow through the siphon over the level, level of the rim, level at the beginning.
const SIPHON: [f64; 4] = [
    10.0 * LITRES_PER_MINUTE,
    3.0 * LITRES_PER_MINUTE / CENTIMETRES,
    31.0 * CENTIMETRES,
    11.0 * CENTIMETRES,
];
/// Temperature over heat, time constant, temperature at the beginning.
const ROOM: [f64; 3] = [5.0 / KILOWATTS, 40.0 * MINUTES, 1.0];

impl Problem {
    pub(super) const ALL: [Self; 3] = [Self::Substrate, Self::Siphon, Self::Room];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Substrate => "substrate",
            Self::Siphon => "siphon",
            Self::Room => "room",
        }
    }

    pub(super) fn model(self) -> &'static str {
        match self {
            Self::Substrate => include_str!("substrate.dgd"),
            Self::Siphon => include_str!("siphon.dgd"),
            Self::Room => include_str!("room.dgd"),
        }
    }

    /// Names of the estimates, in their order.
    pub(super) fn estimates(self) -> &'static [&'static str] {
        match self {
            Self::Substrate => &["v_max", "k_m", "s(0)"],
            Self::Siphon => &["q_in", "drain", "rim", "h(0)"],
            Self::Room => &["gain", "tau", "rise(0)"],
        }
    }

    /// Their true values, SI.
    pub(super) fn truth(self) -> &'static [f64] {
        match self {
            Self::Substrate => &SUBSTRATE,
            Self::Siphon => &SIPHON,
            Self::Room => &ROOM,
        }
    }

    /// A data set.
    pub(super) fn drawn(self, seed: u64, set: u64) -> Recording {
        let mut random = Normal(Pcg64::new(u128::from(seed), u128::from(set)));
        match self {
            Self::Substrate => substrate(&mut random),
            Self::Siphon => siphon(&mut random),
            Self::Room => room(&mut random),
        }
    }
}

/// The integrated equation of Michaelis and Menten, s + k ln s = s₀ + k ln s₀ − v t (Schnell and Mendoza 1997), solved for
/// ln s by Newton's method.
fn substrate(random: &mut Normal) -> Recording {
    let [v, k, s_0] = SUBSTRATE;
    let times: Vec<f64> = (0..40).map(|row| 3.0 * f64::from(row)).collect();
    let reading = |t: f64| {
        let right = s_0 + k * s_0.ln() - v * t;
        let mut z = s_0.ln();
        for _ in 0..100 {
            z -= (z.exp() + k * z - right) / (z.exp() + k);
        }
        z.exp() + 0.1 * random.next()
    };
    let measured = times.iter().copied().map(reading).collect();
    Recording::new(times, Inputs::none(), vec![Some(measured)])
}

/// A straight line up to the rim, and from there an exponential down to where the siphon runs dry, again and again.
fn siphon(random: &mut Normal) -> Recording {
    const AREA: f64 = 0.1;
    const DRY: f64 = 5.0 * CENTIMETRES;
    let [q_in, drain, rim, h_0] = SIPHON;
    let times: Vec<f64> = (0..120).map(|row| 8.0 * f64::from(row)).collect();
    let filling = |from: f64| (rim - from) * AREA / q_in;
    let rest = q_in / drain;
    let tau = AREA / drain;
    let emptying = tau * ((rim - rest) / (DRY - rest)).ln();
    let level = |t: f64| {
        let first = filling(h_0);
        if t < first {
            return h_0 + q_in * t / AREA;
        }
        let cycle = emptying + filling(DRY);
        let since = (t - first) % cycle;
        if since < emptying {
            rest + (rim - rest) * (-since / tau).exp()
        } else {
            DRY + q_in * (since - emptying) / AREA
        }
    };
    let measured = times.iter().map(|t| level(*t) + 0.5 * CENTIMETRES * random.next()).collect();
    Recording::new(times, Inputs::none(), vec![Some(measured)])
}

/// A linear equation under heat that is held, with a state that strays: its recursion from reading to reading is exact.
fn room(random: &mut Normal) -> Recording {
    const STEP: f64 = MINUTES;
    /// In a root of a second.
    const STRAYS: f64 = 0.01;
    const SIGMA: f64 = 0.05;
    let [gain, tau, mut rise] = ROOM;
    let times: Vec<f64> = (0..400).map(|row| STEP * f64::from(row)).collect();
    let heat: Vec<f64> =
        (0..400).map(|row| [2.0, 0.5, 1.5, 0.0][row / 50 % 4] * KILOWATTS).collect();
    let kept = (-STEP / tau).exp();
    let strayed = (STRAYS * STRAYS * tau / 2.0 * (1.0 - kept * kept)).sqrt();
    let mut measured = Vec::new();
    for heat in &heat {
        measured.push(rise + SIGMA * random.next());
        rise = kept * rise + (1.0 - kept) * gain * heat + strayed * random.next();
    }
    let column = InputColumn { name: "heat", interpolation: Interpolation::Hold, values: &heat };
    let inputs = Inputs::recorded(&times, &[column]).expect("as many values as times");
    Recording::new(times, inputs, vec![Some(measured)])
}

struct Normal(Pcg64);

impl Normal {
    /// A normal deviate by Box and Muller.
    fn next(&mut self) -> f64 {
        let mut uniform = || ((self.0.next_u64() >> 11) + 1) as f64 / (1_u64 << 53) as f64;
        let radius = (-2.0 * uniform().ln()).sqrt();
        radius * (std::f64::consts::TAU * uniform()).cos()
    }
}
