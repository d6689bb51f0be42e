//! Recordings of a dual gradient drilling rig in which an effect is hidden.
//!
//! The rig is written in plain Rust and integrated by a fixed-step method, so that nothing in it
//! depends on the language or the solvers that are tested with it. It is richer than
//! `models/mud_circulation.dgd`: a controller acts once a second on the riser pressure *as it is
//! read*, with limits and a filter; the subsea pump's speed takes a moment; the instruments are read
//! a moment after the controller acted; the return line's inertia depends on the riser level. None
//! of that shows above the noise, so with nothing hidden the model explains a recording to the noise.
//!
//! ```text
//! schedule ──► booster pump, top fill ─┐
//!          set point ──► controller ──► plant ──► sensors ──► recording
//!                            ▲                       │
//!                            └──── riser pressure ◄──┘
//! ```

#![allow(dead_code, reason = "neither the example nor the tests use all of it")]

pub(crate) mod controller;
pub(crate) mod effects;
pub(crate) mod plant;
pub(crate) mod random;
pub(crate) mod recording;
pub(crate) mod schedule;
pub(crate) mod sensors;

use controller::{Controller, Tuning};
use effects::Effect;
use plant::{Controls, LPM, Plant, RHO, State};
use random::Random;
use recording::{Recording, Row, five_digits};
use schedule::Schedule;
use sensors::{Errors, History, Noise, Roughness, Sensors};

/// How long after the controller the instruments are read, s.
const SCAN: f64 = 0.1;
/// Time constant of a healthy pump's speed, s.
const HEALTHY_SPEED_LAG: f64 = 0.02;

/// What is to be recorded.
#[derive(Debug, Clone)]
pub(crate) struct Scenario {
    /// Everything that is drawn depends on it and on nothing else.
    pub(crate) seed: u64,
    /// Length of each of the two recordings, min.
    pub(crate) minutes: f64,
    /// What is hidden.
    pub(crate) effects: Vec<Effect>,
    pub(crate) noise: Noise,
    pub(crate) roughness: Roughness,
    /// Integration steps in a second.
    pub(crate) steps: u32,
}

/// Two recordings of one rig, with different schedules and noise.
#[derive(Debug, Clone)]
pub(crate) struct Pair {
    pub(crate) rig: Rig,
    pub(crate) train: Recording,
    pub(crate) valid: Recording,
}

/// A rig with its instruments and its controller's tuning.
#[derive(Debug, Clone)]
pub(crate) struct Rig {
    pub(crate) plant: Plant,
    pub(crate) sensors: Sensors,
    pub(crate) tuning: Tuning,
    /// True flows over recorded: booster and top fill.
    pub(crate) booster_gain: f64,
    pub(crate) fill_gain: f64,
    /// Whether its booster pump is ever stopped.
    pub(crate) stops: bool,
}

/// Streams of a scenario's random numbers.
const RIG: u64 = 1;
const TRAIN: u64 = 2;
const VALID: u64 = 3;
const EFFECTS: u64 = 4;
const ROUGHNESS: u64 = 5;

impl Scenario {
    /// A scenario with the noise of the field's sensors.
    pub(crate) fn new(seed: u64, minutes: f64, effects: Vec<Effect>) -> Self {
        let (noise, roughness) = (Noise::FIELD, Roughness::NONE);
        Self { seed, minutes, effects, noise, roughness, steps: 20 }
    }

    /// The same, with effects of those names and of sizes drawn; `None` for a name unknown.
    pub(crate) fn drawn(seed: u64, minutes: f64, names: &[&str]) -> Option<Self> {
        let mut random = Random::new(seed, EFFECTS);
        let effects = names.iter().map(|name| Effect::draw(name, &mut random, minutes * 60.0));
        Some(Self::new(seed, minutes, effects.collect::<Option<_>>()?))
    }

    /// The same with effects of two fifths of their size, and with sensors whose noise is coloured
    /// and which may round.
    pub(crate) fn hardened(mut self) -> Self {
        for effect in &mut self.effects {
            *effect = effect.reduced(0.4);
        }
        self.roughness = Roughness::draw(&mut Random::new(self.seed, ROUGHNESS));
        self
    }
}

/// Records both recordings of a scenario.
pub(crate) fn record(scenario: &Scenario) -> Pair {
    let rig = Rig::new(scenario);
    let train = rig.record(scenario, TRAIN);
    let valid = rig.record(scenario, VALID);
    Pair { rig, train, valid }
}

impl Rig {
    /// A rig of a scenario's seed with its effects hidden in it.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let mut random = Random::new(scenario.seed, RIG);
        let plant = Plant {
            inertia: random.between(0.95e8, 1.25e8),
            c0: random.between(245.0, 310.0),
            exponent: 2.0,
            c2: random.between(8.0e3, 1.0e4),
            f2: random.between(1.55e8, 1.95e8),
            speed_lag: HEALTHY_SPEED_LAG,
            booster_line: None,
            influx: None,
            ageing: None,
            valve: None,
            f4: 0.0,
            wear: 0.0,
            plugging: None,
            density_step: None,
        };
        let tuning = Tuning::draw(&mut random);
        let stops = random.chance(0.75);
        let sensors = Sensors::default();
        let mut rig = Self { plant, sensors, tuning, booster_gain: 1.0, fill_gain: 1.0, stops };
        for effect in &scenario.effects {
            effect.hide(&mut rig);
        }
        rig
    }

    fn record(&self, scenario: &Scenario, stream: u64) -> Recording {
        let mut random = Random::new(scenario.seed, stream);
        let seconds = (scenario.minutes * 60.0).round() as usize;
        let schedule = Schedule::draw(&mut random, seconds, self.stops);
        let Rig { plant, sensors, .. } = self;

        // At rest, with the booster line full.
        let h_r = random.between(44.0, 54.0);
        let pumped: Vec<f64> = schedule.boost.iter().map(|q| self.booster_gain * q).collect();
        let q_ssp = pumped[0] + self.fill_gain * schedule.top_fill[0];
        let speed = plant.steady_speed(h_r, q_ssp);
        let mut state = State { h_r, h_b: 0.0, q_ssp, q_bo: pumped[0], speed, draining: false };
        let mut history = History::new(plant, &state);
        let mut gauge = sensors.riser_gauge(&history);
        let mut controller = Controller::new(self.tuning, speed, Plant::inlet_pressure(RHO, h_r));
        let first_set_point = gauge.read(&history, 0.0);

        let Noise { p_r, p_in, p_out, q_ssp } = scenario.noise;
        let mut errors = [p_r, p_in, p_out, q_ssp]
            .map(|white| Errors::new(white, &scenario.roughness, &mut random));
        let rough = scenario.roughness;
        let mut recording = Recording { rows: Vec::new(), hidden: Vec::new(), pumped };
        for k in 0..=seconds {
            let t = k as f64;
            let [p_r, p_in, p_out, q_ssp] = &mut errors;
            let riser = gauge.read(&history, t) + p_r.next(&mut random);
            // The controller has a transmitter of its own.
            let inlet = Plant::inlet_pressure(plant.density(t), state.h_r)
                + scenario.noise.p_in * random.normal();
            let error = riser - first_set_point - schedule.set_point[k];
            let percent = five_digits(100.0 * controller.act(plant, error, inlet));
            let riser = match sensors.pressures_late {
                0.0 => riser,
                late => history.at(t - late).p_r + sensors.riser_offset + p_r.next(&mut random),
            };

            recording.hidden.push(state);
            let next = (k + 1).min(seconds);
            let controls = Controls {
                since: t,
                reference: percent / 100.0,
                speed_before: state.speed,
                boost: recording.pumped[k],
                boost_slope: recording.pumped[next] - recording.pumped[k],
                top_fill: self.fill_gain * schedule.top_fill[k],
            };
            for step in 0..scenario.steps {
                let at = |step: u32| t + f64::from(step) / f64::from(scenario.steps);
                state = plant.advance(at(step), &state, &controls, at(step + 1));
                history.push(at(step + 1), plant, &state);
            }

            let read = t + SCAN;
            let pressures = history.at(read - sensors.pressures_late);
            let flow = history.at(read - sensors.flow_delay).q_ssp;
            let flow = flow / sensors.theta + sensors.flow_offset;
            recording.rows.push(Row {
                time: t,
                w_ssp: percent,
                q_boost: five_digits(schedule.boost[k] / LPM),
                q_tf: five_digits(schedule.top_fill[k] / LPM),
                p_r: five_digits(rough.pressure(riser / 1e5)),
                p_in: five_digits(rough.pressure((pressures.p_in + p_in.next(&mut random)) / 1e5)),
                p_out: five_digits(
                    rough.pressure((pressures.p_out + p_out.next(&mut random)) / 1e5),
                ),
                q_ssp: five_digits(rough.flow((flow + q_ssp.next(&mut random)) / LPM)),
            });
        }
        recording
    }
}
