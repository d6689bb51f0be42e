//! A pendulum driven by a motor, 50 samples a second for 28 seconds.
//!
//! The simulator divides all torques by the moment of inertia, where the model has them as they are.

use crate::bank::integrate::rk4;
use crate::bank::signal::{Signal, ramps, steps, waves};
use crate::bank::{Column, Domain, Hidden, Plan, Recording, Truth};

pub(crate) static DOMAIN: Domain = Domain {
    name: "pendulum",
    model: include_str!("model.dgd"),
    effects: &[
        ("bumper", include_str!("effects/bumper.dgd")),
        ("coulomb_friction", include_str!("effects/coulomb_friction.dgd")),
        ("eddy_brake", include_str!("effects/eddy_brake.dgd")),
        ("gyro_gain", include_str!("effects/gyro_gain.dgd")),
        ("hair_spring", include_str!("effects/hair_spring.dgd")),
        ("lost_weight", include_str!("effects/lost_weight.dgd")),
        ("motor_dead_band", include_str!("effects/motor_dead_band.dgd")),
        ("quadratic_drag", include_str!("effects/quadratic_drag.dgd")),
        ("tilted_base", include_str!("effects/tilted_base.dgd")),
    ],
    hidden: HIDDEN,
    record,
};

const HIDDEN: &[Hidden] = &[
    Hidden::library("coulomb_friction"),
    Hidden::library("tilted_base"),
    Hidden::library("eddy_brake"),
    Hidden::library("quadratic_drag"),
    Hidden::library("hair_spring"),
    Hidden::library("lost_weight"),
    Hidden::library("bumper"),
    Hidden::library("gyro_gain"),
    Hidden::library("motor_dead_band"),
    Hidden::library("coulomb_friction+gyro_gain"),
    Hidden {
        name: "rubbing",
        truth: Truth::Template(&["dry_friction(w, swing)"]),
        effect: "effect truth on pendulum\nkind plant\n\
            parameter rub [N*m] = 0.03 in 0 ..\nnull rub = 0\n\
            add -rub*tanh(w / 0.05 [rad/s]) to swing\n",
    },
    Hidden {
        name: "late_torque",
        truth: Truth::Template(&["input_delay(torque)"]),
        effect: "effect truth on pendulum\nkind input\n\
            parameter late [ms] = 50 in 0 .. 1000\nnull late = 0\nreplace torque by delay(torque, late)\n",
    },
    Hidden {
        name: "turned_encoder",
        truth: Truth::Template(&["sensor_offset(phi)"]),
        effect: "effect truth on pendulum\nkind sensor\n\
            parameter offset [deg] = 0\nnull offset = 0\nreplace output phi by phi + offset\n",
    },
    Hidden {
        name: "vane",
        truth: Truth::Template(&["quadratic_drag(w, swing)"]),
        effect: "effect truth on pendulum\nkind plant\n\
            parameter air [N*m*s^2] = 0\nnull air = 0\nadd -air*w*abs(w) to swing\n",
    },
    Hidden {
        name: "creeping_motor",
        truth: Truth::Template(&["rate_limit(torque)"]),
        effect: "effect truth on pendulum\nkind plant\n\
            parameter rate [N*m/s] = 2 in 0.1 .. 100, log\nstate given [N*m] = torque nominal 1, fixed\n\
            equation limited: der(given) = max(min((torque - given) / 2 [ms], rate), -rate)\n\
            replace torque by given\n",
    },
    Hidden {
        name: "dead_motor",
        truth: Truth::Template(&["dead_band(torque)"]),
        effect: "effect truth on pendulum\nkind input\n\
            parameter ignored [N*m] = 0.05 in 0 ..\nnull ignored = 0\n\
            replace torque by max(torque - ignored, 0) + min(torque + ignored, 0)\n",
    },
    Hidden {
        name: "warm_oil",
        truth: Truth::Parameter {
            name: "b",
            places: &["swing"],
            law: "b falls with T_oil, as exp(-T_oil/T_b)",
        },
        effect: "effect truth on pendulum\nkind plant\n\
            parameter warm [1/K] = 0.05 in -1 .. 1\n\
            replace b by b*exp(-warm*(T_oil - 20 [°C]))\n",
    },
    Hidden {
        name: "drying_bearing",
        truth: Truth::Parameter {
            name: "b",
            places: &["swing"],
            law: "b grows with time, ever faster, as exp(time/tau)",
        },
        effect: "effect truth on pendulum\nkind plant\n\
            parameter rate [1/s] = 0.03 in -1 .. 1\nreplace b by b*exp(rate*time)\n",
    },
];

const G: f64 = 9.81;
const INTERVAL: f64 = 0.02;
const ROWS: usize = 1400;

/// The plant in SI units, with sizes of what is hidden; those that are not hidden are zero.
#[derive(Debug, Clone, Copy, Default)]
struct Plant {
    mass: f64,
    length: f64,
    viscous: f64,
    rub: f64,
    air: f64,
    magnet: f64,
    critical: f64,
    tilt: f64,
    cable: f64,
    rest: f64,
    bump: f64,
    edge: f64,
    lost: f64,
    falls: f64,
    gyro: f64,
    ignored: f64,
    late: f64,
    offset: f64,
    rate: f64,
    warm: f64,
    drying: f64,
}

/// Angle, rad; speed, rad/s; the torque of a motor whose rate is limited, Nm.
type State = [f64; 3];

impl Plant {
    fn drawn(plan: &Plan) -> (Plant, Vec<(&'static str, f64)>) {
        let mut r = plan.sizes();
        let mut plant = Plant {
            mass: r.off(0.5),
            length: r.off(0.4),
            viscous: r.off(0.06),
            critical: 1.0,
            edge: std::f64::consts::PI,
            gyro: 1.0,
            ..Plant::default()
        };
        let mut sizes = Vec::new();
        let mut size = |name: &'static str, value: f64| {
            sizes.push((name, value));
            value
        };
        if plan.hides("coulomb_friction") || plan.hides("rubbing") {
            plant.rub = size("rub [N*m]", r.between(0.02, 0.06));
        }
        if plan.hides("quadratic_drag") || plan.hides("vane") {
            plant.air = size("air [N*m*s^2]", r.between(0.03, 0.07));
        }
        if plan.hides("eddy_brake") {
            plant.magnet = size("magnet [N*m*s]", r.between(0.1, 0.2));
            plant.critical = size("w_crit [rad/s]", r.between(0.6, 1.5));
        }
        if plan.hides("tilted_base") {
            plant.tilt = size("tilt [deg]", r.either_sign(2.0, 5.0)).to_radians();
        }
        if plan.hides("hair_spring") {
            let level = plant.mass * plant.length * G;
            plant.cable = size("cable [N*m]", level * r.between(0.1, 0.3));
            plant.rest = size("rest [deg]", r.either_sign(15.0, 35.0)).to_radians();
        }
        if plan.hides("bumper") {
            plant.bump = size("bump [N*m]", r.between(0.4, 0.9));
            plant.edge = size("edge [deg]", r.between(14.0, 22.0)).to_radians();
        }
        if plan.hides("lost_weight") {
            plant.lost = size("lost [1]", r.between(0.08, 0.18));
            plant.falls = size("t_lost [s]", r.between(8.0, 19.0));
        }
        if plan.hides("gyro_gain") {
            plant.gyro = size("gyro [1]", 1.0 + r.either_sign(0.08, 0.16));
        }
        if plan.hides("motor_dead_band") || plan.hides("dead_motor") {
            plant.ignored = size("ignored [N*m]", r.between(0.04, 0.1));
        }
        if plan.hides("late_torque") {
            plant.late = 1e-3 * size("late [ms]", r.between(30.0, 90.0));
        }
        if plan.hides("turned_encoder") {
            plant.offset = size("offset [deg]", r.either_sign(2.0, 5.0)).to_radians();
        }
        if plan.hides("creeping_motor") {
            plant.rate = size("rate [N*m/s]", r.between(1.5, 4.0));
        }
        if plan.hides("warm_oil") {
            plant.warm = size("warm [1/K]", r.between(0.05, 0.09));
        }
        if plan.hides("drying_bearing") {
            plant.drying = size("rate [1/s]", r.between(0.025, 0.05));
        }
        (plant, sizes)
    }

    fn viscous(&self, t: f64, oil: f64) -> f64 {
        self.viscous * (self.drying * t - self.warm * (oil - 27.0)).exp()
    }

    fn motor(&self, torque: f64) -> f64 {
        if torque.abs() < self.ignored { 0.0 } else { torque - self.ignored.copysign(torque) }
    }

    fn slope(&self, t: f64, y: &State, torque: f64, oil: f64) -> State {
        let [phi, w, given] = *y;
        let fallen = if t > self.falls { self.lost } else { 0.0 };
        let mass = self.mass * (1.0 - fallen);
        let acting = if self.rate > 0.0 { given } else { self.motor(torque) };
        let beyond = (phi.abs() - self.edge).max(0.0).copysign(phi);
        let lost = self.viscous(t, oil) * w
            + self.air * w * w.abs()
            + self.rub * (w / 0.05).tanh()
            + self.magnet * w / (1.0 + (w / self.critical).powi(2))
            + self.cable * (phi - self.rest)
            + self.bump * beyond;
        let inertia = mass * self.length * self.length;
        let gravity = G / self.length * (phi + self.tilt).sin();
        let following = ((torque - given) / 0.002).clamp(-self.rate, self.rate);
        [w, (acting - lost) / inertia - gravity, following]
    }
}

fn record(plan: &Plan) -> Recording {
    let (plant, sizes) = Plant::drawn(plan);
    let mut r = plan.excitation();
    let (lengths, periods): (_, &[f64]) =
        if plan.is_train() { ([30, 110], &[97.0, 151.0]) } else { ([20, 140], &[113.0, 37.0]) };
    let pushes = steps(&mut r, ROWS, [-0.28, 0.28], lengths);
    let swings = waves(&mut r, ROWS, [-0.15, 0.15], periods);
    // Shares of the torque that holds it level: it swings widely and does not go over the top.
    let level = plant.mass * plant.length * G;
    let torque = |(a, b): (&f64, &f64)| (1e3 * level * (a + b)).round() / 1e3;
    let torque: Vec<f64> = pushes.iter().zip(&swings).map(torque).collect();
    let oil = ramps(&mut r, ROWS, [15.0, 40.0], [150, 400], 120);
    let (motor, heater) = (Signal::held(INTERVAL, &torque), Signal::linear(INTERVAL, &oil));
    let mut y = [r.between(-0.4, 0.4), r.between(-1.0, 1.0), torque[0]];
    let (mut phi, mut w, mut trace) = (vec![], vec![], vec![]);
    for k in 0..ROWS {
        let t = k as f64 * INTERVAL;
        phi.push((y[0] + plant.offset).to_degrees());
        w.push(plant.gyro * y[1]);
        if plan.hides("warm_oil") || plan.hides("drying_bearing") {
            trace.push(plant.viscous(t, heater.at(t)));
        }
        // In pieces, so that a late torque changes at the end of one.
        for piece in 0..40 {
            let t = t + f64::from(piece) * INTERVAL / 40.0;
            let torque = motor.at(t + INTERVAL / 80.0 - plant.late);
            rk4(&mut y, t, INTERVAL / 40.0, 1, |t, y| plant.slope(t, y, torque, heater.at(t)));
        }
    }
    Recording {
        time_unit: "s",
        times: (0..ROWS).map(|k| k as f64 * INTERVAL).collect(),
        columns: vec![
            Column::input("torque", "N*m", torque),
            Column::input("T_oil", "°C", oil),
            Column::output("phi", "deg", 0.5, phi),
            Column::output("w", "rad/s", 0.03, w),
        ],
        trace,
        sizes,
    }
}
