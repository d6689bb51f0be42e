//! What the crew does: booster pump, top fill, set point.

use super::plant::LPM;
use super::random::Random;
use super::recording::five_digits;

/// Booster flow and top fill, m³/s, and set point relative to the first, Pa, at every second.
#[derive(Debug, Clone)]
pub(crate) struct Schedule {
    pub(crate) boost: Vec<f64>,
    pub(crate) top_fill: Vec<f64>,
    pub(crate) set_point: Vec<f64>,
}

impl Schedule {
    /// A schedule of so many seconds; `stops` says whether the booster pump is ever stopped.
    pub(crate) fn draw(random: &mut Random, seconds: usize, stops: bool) -> Self {
        let samples = seconds + 1;
        Self {
            boost: booster_flow(random, samples, stops),
            top_fill: top_fill(random, samples),
            set_point: set_point(random, samples),
        }
    }
}

/// As it will be recorded, so that a recording's inputs are what the rig was given.
fn recorded(lpm: f64) -> f64 {
    five_digits(lpm) * LPM
}

/// Levels for minutes, with ramps of 6 s to 38 s between them.
fn booster_flow(random: &mut Random, samples: usize, stops: bool) -> Vec<f64> {
    let mut level = random.between(1500.0, 2300.0);
    let mut flow = Vec::with_capacity(samples);
    let mut hold = random.between(350.0, 750.0) as usize;
    while flow.len() < samples {
        flow.extend(std::iter::repeat_n(level, hold));
        let stop = stops && level > 0.0 && random.chance(0.65);
        let next = if stop { 0.0 } else { random.between(1300.0, 2500.0) };
        let ramp = random.between(6.0, 38.0).round();
        flow.extend((1..ramp as usize).map(|k| level + (next - level) * k as f64 / ramp));
        level = next;
        let (least, most) = if stop { (200.0, 430.0) } else { (320.0, 720.0) };
        hold = random.between(least, most) as usize;
    }
    flow.truncate(samples);
    flow.into_iter().map(recorded).collect()
}

/// A valve that is set by hand now and then, and a flow that is never quite steady.
fn top_fill(random: &mut Random, samples: usize) -> Vec<f64> {
    let mut level = random.between(130.0, 300.0);
    let unrest = random.between(1.4, 2.4);
    let mut change = random.between(0.1, 0.6) * samples as f64;
    (0..samples)
        .map(|k| {
            if k as f64 >= change {
                level = random.between(100.0, 350.0);
                change += random.between(0.2, 0.8) * samples as f64;
            }
            recorded(level + unrest * random.normal())
        })
        .collect()
}

/// Steps of up to half a bar, back and forth around the first.
fn set_point(random: &mut Random, samples: usize) -> Vec<f64> {
    let mut level = 0.0;
    let mut change = random.between(900.0, 1800.0);
    (0..samples)
        .map(|k| {
            if k as f64 >= change {
                level = random.either_sign(0.1, 0.5) * 1e5;
                change += random.between(900.0, 1800.0);
            }
            level
        })
        .collect()
}
