//! A stand-in for the field data of Haukanes 2015, which is confidential: a rig that is richer than
//! any model which is fitted to it, its instruments, its controller and what its crew did.
//!
//! ```text
//! schedule ──► booster pump, top fill ──┐
//!          set point ──► controller ──► plant ──► instruments ──► recording
//!                            ▲                        │
//!                            └── riser pressure, read ┘
//! ```
//!
//! The plant is written in plain Rust and integrated by a fixed-step method, so that nothing in it
//! depends on the language or the solvers that are tried on the recordings.

#![allow(dead_code, reason = "neither the example nor the tests use all of it")]

pub(crate) mod files;
pub(crate) mod instruments;
pub(crate) mod plant;
pub(crate) mod schedule;

use super::drilling_rig;
use drilling_rig::plant::{A_B, G, H_PR, L_B, LPM, P_ATM, RHO};
use drilling_rig::random::Random;
use instruments::{Instruments, Row};
use plant::{Controls, OutletValve, Pipe, Plant, Pressures, State, Suction};
use schedule::{Drive, Schedule};

/// Everything random depends on it and on nothing else.
const SEED: u64 = 2015;
/// Integration steps in a second; the fastest there is swings with 3 rad/s (booster line).
const STEPS: u32 = 50;

/// A rig with its instruments and its controller.
#[derive(Debug, Clone)]
pub(crate) struct Rig {
    pub(crate) plant: Plant,
    pub(crate) instruments: Instruments,
    pub(crate) control: Control,
    /// Unrest of the top fill, m³/s.
    pub(crate) unrest: f64,
}

/// Proportional–integral control of the riser pressure (2.31): ω = K_p (e + 1/T_i ∫e dt).
///
/// e is filtered, because the pump would follow its noise. The integral stops at the limits. The low
/// one keeps mud from flowing back: it is the speed that holds a least flow at the present level.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Control {
    /// Gain, 1/Pa, integral time and time constant of the filter, s.
    pub(crate) gain: f64,
    pub(crate) integral_time: f64,
    pub(crate) filter: f64,
    /// Least flow, m³/s, and highest speed, of the maximum.
    pub(crate) least_flow: f64,
    pub(crate) high: f64,
}

/// What the controller remembers: the filtered error, Pa, and its integral, as a speed.
#[derive(Debug, Clone, Copy)]
struct Memory {
    error: f64,
    integral: f64,
}

/// What was recorded and what was true, a row a second.
#[derive(Debug, Clone)]
pub(crate) struct Recording {
    pub(crate) schedule: Schedule,
    /// Set point of the riser pressure, Pa above a vacuum, where the controller was on.
    pub(crate) set_point: Option<Vec<f64>>,
    pub(crate) rows: Vec<Row>,
    pub(crate) truth: Vec<Truth>,
}

/// What was true at the moment of a row, in SI units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Truth {
    pub(crate) state: State,
    pub(crate) pressures: Pressures,
    /// What the booster pump delivered, and the top fill.
    pub(crate) pumped: f64,
    pub(crate) top_fill: f64,
}

impl Rig {
    /// The rig that the recordings are of but for `booster_restarts`.
    pub(crate) fn field() -> Self {
        let viscosity = 0.012;
        let return_line = Pipe {
            // From the pump up to the rig floor, and on deck to the flow meter and the shakers.
            length: 302.0 + 98.0,
            diameter: 6.05 * 0.0254,
            roughness: 5e-5,
            minor_losses: 38.0,
            viscosity,
        };
        let booster_line = Pipe {
            length: L_B,
            // As wide as the cross-section that the thesis calculates with.
            diameter: (4.0 * A_B / std::f64::consts::PI).sqrt(),
            roughness: 5e-5,
            // Its outlet into the riser is narrow, or it would never be full at a deep level.
            minor_losses: 345.0,
            viscosity,
        };
        Self {
            plant: Plant {
                c0: 295.0,
                exponent: 2.2,
                c2: 9.0e3,
                speed_lag: 1.0,
                return_line,
                booster_line,
                outlet: None,
                bulk_modulus: 1.2e9,
                suction: Suction::Tank { missing: 0.03, pressure: 1e5 },
            },
            instruments: Instruments {
                offsets: [0.0, 0.5e5, 0.06e5, -0.06e5],
                pressure_noise: 800.0,
                pressure_count: 1000.0,
                theta_1: 0.951,
                damping: 2.0,
                flow_white: 9.0 * LPM,
                flow_coloured: 9.0 * LPM,
                flow_correlation: 4.0,
                cut_off: 30.0 * LPM,
                top_fill_noise: 1.5 * LPM,
                flow_count: LPM,
                speed_count: 1e-3,
            },
            control: Control {
                gain: 1.2e-6,
                integral_time: 200.0,
                filter: 5.0,
                least_flow: 250.0 * LPM,
                high: 0.98,
            },
            unrest: 2.0 * LPM,
        }
    }

    /// The same with its booster line refitted: a valve in the place of the narrow outlet, and a charge
    /// pump in that of the tank. `examples/data/field/README.md` tells what was tuned, and why.
    pub(crate) fn refitted() -> Self {
        let Self { mut plant, instruments, control, unrest } = Self::field();
        plant.booster_line.minor_losses = 2.0;
        plant.outlet = Some(OutletValve { spring: 12e5, full_lift: 1880.0 * LPM });
        plant.suction = Suction::ChargePump { through: 900.0 * LPM, pressure: 1.2e5 };
        Self { plant, instruments, control, unrest }
    }

    /// Records what the schedule says.
    pub(crate) fn record(&self, schedule: &Schedule) -> Recording {
        self.record_in(schedule, STEPS)
    }

    /// The same, in so many integration steps a second.
    pub(crate) fn record_in(&self, schedule: &Schedule, steps: u32) -> Recording {
        let Rig { plant, instruments, control, .. } = self;
        let mut random = Random::new(SEED, schedule.stream);
        let mut state =
            plant.at_rest(schedule.level, schedule.boost_at(0.0), schedule.top_fill.at(0.0) * LPM);
        let at_start = P_ATM + plant.pressures(&state).riser;
        let mut memory = Memory { error: 0.0, integral: state.speed };
        let mut reader = instruments.reader(&mut random);

        let (mut rows, mut truth, mut set_points) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..=schedule.seconds {
            let t = k as f64;
            let pressures = plant.pressures(&state);
            let riser = reader.riser(&pressures, &mut random);
            let wanted = match &schedule.drive {
                Drive::Manual(percent) => percent.at(t) / 100.0,
                Drive::Pressure(above) => {
                    let set_point = at_start + 1e5 * above.at(t);
                    set_points.push(set_point);
                    control.act(plant, &mut memory, riser, set_point)
                }
            };
            let reference = instruments.reference(wanted);

            let boost = schedule.boost_at(t);
            let filled = schedule.top_fill.at(t) * LPM;
            // A valve that is shut passes nothing.
            let top_fill = if filled > 0.0 { filled + self.unrest * random.normal() } else { 0.0 };
            let settings = [boost, top_fill, reference];
            rows.push(reader.read(&state, &pressures, riser, settings, &mut random));
            truth.push(Truth {
                state,
                pressures,
                pumped: plant.pumped(boost, boost > 0.0, state.p_b),
                top_fill,
            });

            let controls = Controls {
                since: t,
                reference,
                speed_before: state.speed,
                boost,
                boost_slope: schedule.boost_at(t + 1.0) - boost,
                top_fill,
                damping: instruments.damping,
            };
            for step in 0..steps {
                let at = |step: u32| t + f64::from(step) / f64::from(steps);
                state = plant.advance(at(step), &state, &controls, at(step + 1));
            }
        }
        let set_point = (!set_points.is_empty()).then_some(set_points);
        Recording { schedule: schedule.clone(), set_point, rows, truth }
    }
}

impl Control {
    /// The speed for the coming second; more pressure wants more speed.
    fn act(&self, plant: &Plant, memory: &mut Memory, riser: f64, set_point: f64) -> f64 {
        memory.error += (riser - set_point - memory.error) / self.filter;
        let Memory { error, integral } = *memory;
        let level = H_PR - (set_point + error - P_ATM) / (RHO * G);
        let low = plant.steady_speed(level, self.least_flow).min(self.high);

        let wanted = self.gain * error + integral;
        let outwards = (wanted > self.high && error > 0.0) || (wanted < low && error < 0.0);
        if !outwards {
            memory.integral += self.gain * error / self.integral_time;
        }
        wanted.clamp(low, self.high)
    }
}
