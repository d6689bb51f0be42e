//! Discoveries in servos with nothing hidden: are their p-values what they say?

use std::sync::atomic::{AtomicUsize, Ordering};

use dgd_discover::Verdict;

use super::examined::{Examined, Texts};
use super::servo::{MODEL, Servo};

/// Length of a recording, s.
const SECONDS: usize = 40;

/// Effects that are looked for: with and without onsets, with inner constants, on both sides and on one.
const LIBRARY: [&str; 7] = [
    "sensor_gain",
    "sensor_drift",
    "input_lag",
    "parameter_step",
    "unmeasured_flow",
    "power_loss",
    "dry_friction",
];

/// Noise of the servo's sensors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Noise {
    White,
    /// As much coloured noise as white, with a memory of 0.2 to 1.5 s.
    Coloured,
}

/// What is said about one servo.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Said {
    pub(crate) verdict: Verdict,
    pub(crate) p_value: f64,
}

/// What is said about so many servos of different seeds.
pub(crate) fn said(number: usize, noise: Noise, threads: usize) -> Vec<Said> {
    let examined = examined();
    let next = AtomicUsize::new(0);
    let work = || {
        let mut all = Vec::new();
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            if k >= number {
                return all;
            }
            all.push((k, of(&examined, k as u64, noise)));
        }
    };
    let mut all: Vec<(usize, Said)> = std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let own = work();
        others.into_iter().flat_map(|other| other.join().expect("a discovery")).chain(own).collect()
    });
    all.sort_by_key(|(k, _)| *k);
    all.into_iter().map(|(_, said)| said).collect()
}

/// The servo's model with a library of some templates.
fn examined() -> Examined {
    let mut examined =
        Texts { model: ("servo.dgd".to_owned(), MODEL.to_owned()), effects: Vec::new() }.read();
    let templates = std::mem::take(&mut examined.templates);
    (examined.library, examined.templates) =
        templates.into_iter().partition(|effect| LIBRARY.contains(&effect.name.text.as_str()));
    examined
}

fn of(examined: &Examined, seed: u64, noise: Noise) -> Said {
    let memory = match noise {
        Noise::White => None,
        Noise::Coloured => Some(super::random::Random::new(seed, 2).between(0.2, 1.5)),
    };
    let samples = Servo { memory, ..Servo::default() }.record(seed, SECONDS);
    let found =
        examined.discover_seeded(&[examined.recording_without_start(&samples)], &[], 1, seed);
    Said { verdict: found.verdict, p_value: found.p_value.expect("a library that applies") }
}
