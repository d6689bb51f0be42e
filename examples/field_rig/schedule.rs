//! What the crew does in each of the recordings.

use super::Rig;
use super::drilling_rig::plant::LPM;

/// From one value to another: at a time, s, within so many seconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Change {
    pub(crate) at: f64,
    pub(crate) within: f64,
    pub(crate) to: f64,
}

/// A value that changes now and then, and is held in between.
#[derive(Debug, Clone)]
pub(crate) struct Course {
    pub(crate) first: f64,
    /// In order of time, none beginning before the last is done.
    pub(crate) changes: Vec<Change>,
}

/// Who sets the speed of the subsea pump.
#[derive(Debug, Clone)]
pub(crate) enum Drive {
    /// The crew, in % of its maximum.
    Manual(Course),
    /// The controller, to a pressure in the riser, in bar above that at the start.
    Pressure(Course),
}

/// How the booster line is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fitting {
    /// As it was built: a narrow outlet, the pump fed from a tank.
    AsBuilt,
    /// With a valve at its outlet and a charge pump.
    Refitted,
}

/// One recording.
#[derive(Debug, Clone)]
pub(crate) struct Schedule {
    /// The file's name without ending, and what is recorded.
    pub(crate) name: &'static str,
    pub(crate) about: &'static str,
    pub(crate) fitting: Fitting,
    /// Stream of random numbers.
    pub(crate) stream: u64,
    pub(crate) seconds: usize,
    /// Riser level at the start, m, where the rig is at rest.
    pub(crate) level: f64,
    /// Calculated booster flow and top fill, lpm.
    pub(crate) boost: Course,
    pub(crate) top_fill: Course,
    pub(crate) drive: Drive,
}

impl Course {
    pub(crate) fn at(&self, t: f64) -> f64 {
        let mut value = self.first;
        for change in self.changes.iter().take_while(|change| change.at <= t) {
            let share = ((t - change.at) / change.within).min(1.0);
            value += share * (change.to - value);
        }
        value
    }
}

/// A course from its first value and its changes: at, within, to.
fn course(first: f64, changes: &[[f64; 3]]) -> Course {
    let changes = changes.iter().map(|&[at, within, to]| Change { at, within, to }).collect();
    Course { first, changes }
}

impl Schedule {
    /// Calculated booster flow at a time, m³/s.
    pub(crate) fn boost_at(&self, t: f64) -> f64 {
        self.boost.at(t) * LPM
    }

    /// The rig that it is a recording of.
    pub(crate) fn rig(&self) -> Rig {
        match self.fitting {
            Fitting::AsBuilt => Rig::field(),
            Fitting::Refitted => Rig::refitted(),
        }
    }
}

/// Level at which the riser balances the full return line when nothing turns: h_in − h_out, m.
const BALANCE: f64 = 5.0;

/// All recordings.
pub(crate) fn schedules() -> Vec<Schedule> {
    vec![no_flow(), normal_circulation(), booster_ramps(), booster_restarts(), pump_tests()]
}

fn no_flow() -> Schedule {
    Schedule {
        name: "no_flow",
        about: "everything stands still (section 3.3.1)",
        fitting: Fitting::AsBuilt,
        stream: 1,
        seconds: 800,
        level: BALANCE,
        boost: course(0.0, &[]),
        top_fill: course(0.0, &[]),
        drive: Drive::Manual(course(0.0, &[])),
    }
}

fn normal_circulation() -> Schedule {
    let set_point = [
        [400.0, 200.0, -0.9],
        [1000.0, 200.0, 0.6],
        [1600.0, 300.0, -0.4],
        [2200.0, 150.0, 0.9],
        [2900.0, 200.0, 0.0],
    ];
    Schedule {
        name: "normal_circulation",
        about: "constant inflow, the riser pressure steered up and down (section 3.6, case 1)",
        fitting: Fitting::AsBuilt,
        stream: 2,
        seconds: 3600,
        level: 146.0,
        boost: course(2200.0, &[]),
        top_fill: course(300.0, &[]),
        drive: Drive::Pressure(course(0.0, &set_point)),
    }
}

fn booster_ramps() -> Schedule {
    let boost = [
        // Stopped for long, and for a short while.
        [500.0, 20.0, 0.0],
        [900.0, 30.0, 2200.0],
        [1500.0, 10.0, 0.0],
        [1640.0, 20.0, 1800.0],
        [2300.0, 20.0, 2300.0],
        // Ramped down slowly, and up in stages.
        [2900.0, 60.0, 0.0],
        [3500.0, 10.0, 800.0],
        [3620.0, 10.0, 1500.0],
        [3760.0, 20.0, 2200.0],
        // Not all the way down.
        [4400.0, 20.0, 900.0],
        [4900.0, 25.0, 2200.0],
        [5500.0, 15.0, 0.0],
        [5900.0, 45.0, 2400.0],
    ];
    let top_fill = [[2950.0, 10.0, 600.0], [3700.0, 10.0, 350.0]];
    let set_point = [[2000.0, 200.0, 0.8], [4100.0, 200.0, -0.3]];
    Schedule {
        name: "booster_ramps",
        about: "the booster pump stopped and started again and again (section 3.7, case 2)",
        fitting: Fitting::AsBuilt,
        stream: 3,
        seconds: 6600,
        level: 160.0,
        boost: course(2200.0, &boost),
        top_fill: course(350.0, &top_fill),
        drive: Drive::Pressure(course(0.0, &set_point)),
    }
}

fn booster_restarts() -> Schedule {
    let boost = [
        // Stopped for long and for longer, ...
        [500.0, 30.0, 0.0],
        [900.0, 35.0, 2430.0],
        [1500.0, 25.0, 0.0],
        [1850.0, 30.0, 2430.0],
        [2500.0, 30.0, 0.0],
        [3100.0, 40.0, 2450.0],
        // ... for a short while, and for long again.
        [3800.0, 20.0, 0.0],
        [3960.0, 30.0, 2450.0],
        [4600.0, 25.0, 0.0],
        [5000.0, 35.0, 2480.0],
    ];
    let top_fill = [[2200.0, 10.0, 350.0], [4350.0, 10.0, 250.0]];
    let set_point = [[2000.0, 200.0, 0.6], [4250.0, 200.0, 0.1]];
    Schedule {
        name: "booster_restarts",
        about: "the booster pump stopped and started again at a deep level (section 3.7, case 2)",
        fitting: Fitting::Refitted,
        stream: 5,
        seconds: 6000,
        level: 218.0,
        boost: course(2430.0, &boost),
        top_fill: course(250.0, &top_fill),
        drive: Drive::Pressure(course(0.0, &set_point)),
    }
}

/// Speeds of the pump tests, %, and the booster flows that are held at each, lpm.
pub(crate) const PUMP_TESTS: [(f64, [f64; 3]); 6] = [
    (45.0, [600.0, 1200.0, 1900.0]),
    (52.0, [2500.0, 1600.0, 700.0]),
    (60.0, [900.0, 1900.0, 2900.0]),
    (70.0, [3500.0, 2200.0, 1000.0]),
    (80.0, [1200.0, 2500.0, 3700.0]),
    (90.0, [3800.0, 2600.0, 1400.0]),
];

/// How long a flow of the pump tests is held, s, and within what time it and the speed are set.
pub(crate) const HELD: f64 = 600.0;
const FLOW_SET: f64 = 30.0;
const SPEED_SET: f64 = 120.0;

fn pump_tests() -> Schedule {
    let (mut boost, mut speed) = (Vec::new(), Vec::new());
    for (i, (percent, flows)) in PUMP_TESTS.iter().enumerate() {
        let begins = HELD * (3 * i) as f64;
        speed.push([begins, SPEED_SET, *percent]);
        for (j, flow) in flows.iter().enumerate() {
            boost.push([begins + HELD * j as f64, FLOW_SET, *flow]);
        }
    }
    Schedule {
        name: "pump_tests",
        about: "the pump's speed set by hand, three booster flows at each (sections 3.4, 3.5)",
        fitting: Fitting::AsBuilt,
        stream: 4,
        seconds: (HELD * 3.0) as usize * PUMP_TESTS.len(),
        level: 55.0,
        boost: course(boost[0][2], &boost[1..]),
        top_fill: course(200.0, &[]),
        drive: Drive::Manual(course(speed[0][2], &speed[1..])),
    }
}
