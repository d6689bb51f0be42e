//! A mass on a spring on a shaker, 50 samples a second for half a minute.
//!
//! The simulator counts in millimetres, and in momenta where the model has speeds.

use crate::bank::integrate::rk4;
use crate::bank::signal::{Signal, ramps, waves};
use crate::bank::{Column, Domain, Hidden, Plan, Recording, Truth};

pub(crate) static DOMAIN: Domain = Domain {
    name: "oscillator",
    model: include_str!("model.dgd"),
    effects: &[
        ("accelerometer_gain", include_str!("effects/accelerometer_gain.dgd")),
        ("asymmetric_spring", include_str!("effects/asymmetric_spring.dgd")),
        ("coulomb_friction", include_str!("effects/coulomb_friction.dgd")),
        ("cubic_spring", include_str!("effects/cubic_spring.dgd")),
        ("end_stop", include_str!("effects/end_stop.dgd")),
        ("hysteresis", include_str!("effects/hysteresis.dgd")),
        ("quadratic_drag", include_str!("effects/quadratic_drag.dgd")),
        ("spring_fatigue", include_str!("effects/spring_fatigue.dgd")),
        ("spring_play", include_str!("effects/spring_play.dgd")),
    ],
    hidden: HIDDEN,
    record,
};

const HIDDEN: &[Hidden] = &[
    Hidden::library("cubic_spring"),
    Hidden::library("coulomb_friction"),
    Hidden::library("end_stop"),
    Hidden::library("hysteresis"),
    Hidden::library("quadratic_drag"),
    Hidden::library("spring_play"),
    Hidden::library("asymmetric_spring"),
    Hidden::library("spring_fatigue"),
    Hidden::library("accelerometer_gain"),
    Hidden::library("cubic_spring+coulomb_friction"),
    Hidden {
        name: "progressive_spring",
        truth: Truth::Template(&["cubic_stiffness(x, momentum)"]),
        effect: "effect truth on oscillator\nkind plant\n\
            parameter k_3 [N/m^3] = 0\nnull k_3 = 0\nadd -k_3*x^3 to momentum\n",
    },
    Hidden {
        name: "guide",
        truth: Truth::Template(&["dry_friction(v, momentum)"]),
        effect: "effect truth on oscillator\nkind plant\n\
            parameter rub [N] = 0.3 in 0 ..\nnull rub = 0\nadd -rub*tanh(v / 10 [mm/s]) to momentum\n",
    },
    Hidden {
        name: "loose_spring",
        // The stiffness is estimated, so a spring with a gap is the same as no spring and two stops at the ends of the gap.
        truth: Truth::Template(&["backlash(x, momentum)", "end_stop(x, momentum)"]),
        effect: "effect truth on oscillator\nkind plant\n\
            parameter play [mm] = 10 in 0 ..\nnull play = 0\n\
            replace x in momentum by max(x - play, 0) + min(x + play, 0)\n",
    },
    Hidden {
        name: "way_gain",
        // Speed is not measured: on the scale of the reading it is the acceleration that is off, by the inverse.
        truth: Truth::Template(&["sensor_gain(x)", "sensor_gain(a)"]),
        effect: "effect truth on oscillator\nkind sensor\n\
            parameter gain [1] = 1 in 0.2 .. 5\nnull gain = 1\nreplace output x by gain*x\n",
    },
    Hidden {
        name: "paddle",
        truth: Truth::Template(&["quadratic_drag(v, momentum)"]),
        effect: "effect truth on oscillator\nkind plant\n\
            parameter air [N*s^2/m^2] = 0\nnull air = 0\nadd -air*v*abs(v) to momentum\n",
    },
    Hidden {
        name: "imbalance",
        truth: Truth::Template(&["periodic_disturbance(momentum)"]),
        effect: "effect truth on oscillator\nkind plant\n\
            parameter size_s [N] = 0.5\nparameter size_c [N] = 0.5\n\
            parameter f [Hz] = 2 in 0.5 .. 5\n\
            add size_s*sin(2*pi*f*time) + size_c*cos(2*pi*f*time) to momentum\n",
    },
    Hidden {
        name: "leaning_weight",
        truth: Truth::Template(&["unmeasured_flow(momentum)"]),
        effect: "effect truth on oscillator\nkind plant\n\
            parameter weight [N] = 1\nparameter since [s] = 15 in 0 .., nominal 2\nnull weight = 0\n\
            add if time > since then weight else 0 to momentum\n",
    },
    Hidden {
        name: "slow_gauge",
        truth: Truth::Template(&["sensor_lag(x)"]),
        effect: "effect truth on oscillator\nkind sensor\n\
            parameter tau [ms] = 30 in 2 .. 500, log\nstate shown [m] = 0 nominal 0.1\n\
            equation gauge: tau*der(shown) = x - shown\nreplace output x by shown\n",
    },
    Hidden {
        name: "tired_spring",
        truth: Truth::Parameter {
            name: "k",
            places: &["momentum"],
            law: "k falls with time, ever more slowly, towards a last value",
        },
        effect: "effect truth on oscillator\nkind plant\n\
            parameter lost [1] = 0.2 in 0 .. 0.9\nparameter tau [s] = 10 in 1 .. 100, log\n\
            replace k by k*(1 - lost*(1 - exp(-time/tau)))\n",
    },
    Hidden {
        name: "tapered_damper",
        truth: Truth::Parameter {
            name: "c",
            // What is added is a product of x and v: a stiffness that changes with v is the same.
            places: &["momentum", "parameter_varies(k, v)"],
            law: "c grows with x, in a straight line",
        },
        effect: "effect truth on oscillator\nkind plant\n\
            parameter taper [1/m] = 1 in -20 .. 20\nreplace c by c*(1 + taper*x)\n",
    },
];

const INTERVAL: f64 = 0.02;
const ROWS: usize = 1500;

/// The plant in kg, mm and s, so that forces are in mN; with sizes of what is hidden. Those that are not hidden
/// are zero.
#[derive(Debug, Clone, Copy, Default)]
struct Plant {
    mass: f64,
    stiffness: f64,
    damping: f64,
    cubic: f64,
    quadratic: f64,
    stop: f64,
    gap: f64,
    play: f64,
    rub: f64,
    air: f64,
    broken: f64,
    breaks: f64,
    mount: f64,
    reach: f64,
    amplified: f64,
    way_gain: f64,
    imbalance: [f64; 3],
    weight: f64,
    leans: f64,
    lag: f64,
    tired: f64,
    tiring: f64,
    taper: f64,
}

/// Way, mm; momentum, kg mm/s; turn of the mount; what the gauge shows, mm.
type State = [f64; 4];

impl Plant {
    fn drawn(plan: &Plan) -> (Plant, Vec<(&'static str, f64)>) {
        let mut r = plan.sizes();
        let mut plant = Plant {
            mass: r.off(2.0),
            stiffness: r.off(80.0),
            damping: r.off(1.5),
            amplified: 1.0,
            way_gain: 1.0,
            gap: f64::INFINITY,
            ..Plant::default()
        };
        let mut sizes = Vec::new();
        let mut size = |name: &'static str, value: f64| {
            sizes.push((name, value));
            value
        };
        if plan.hides("cubic_spring") || plan.hides("progressive_spring") {
            plant.cubic = 1e-6 * size("k_3 [N/m^3]", r.between(60.0, 200.0));
        }
        if plan.hides("asymmetric_spring") {
            plant.quadratic = 1e-3 * size("k_2 [N/m^2]", r.either_sign(6.0, 18.0));
        }
        if plan.hides("end_stop") {
            plant.stop = size("k_stop [N/m]", r.between(10.0, 30.0));
            plant.gap = 1e3 * size("gap [m]", r.between(0.1, 0.18));
        }
        if plan.hides("spring_play") || plan.hides("loose_spring") {
            plant.play = size("play [mm]", r.between(6.0, 18.0));
        }
        if plan.hides("coulomb_friction") || plan.hides("guide") {
            plant.rub = 1e3 * size("rub [N]", r.between(0.3, 0.9));
        }
        if plan.hides("quadratic_drag") || plan.hides("paddle") {
            plant.air = 1e-3 * size("air [N*s^2/m^2]", r.between(0.8, 2.0));
        }
        if plan.hides("spring_fatigue") {
            plant.broken = size("broken [1]", r.between(0.03, 0.07));
            plant.breaks = size("t_break [s]", r.between(9.0, 20.0));
        }
        if plan.hides("hysteresis") {
            plant.mount = 1e3 * size("mount [N]", r.between(1.0, 3.0));
            plant.reach = size("reach [mm]", r.between(40.0, 100.0));
        }
        if plan.hides("accelerometer_gain") {
            plant.amplified = size("amplified [1]", 1.0 + r.either_sign(0.06, 0.15));
        }
        if plan.hides("way_gain") {
            plant.way_gain = size("gain [1]", 1.0 + r.either_sign(0.05, 0.12));
        }
        if plan.hides("imbalance") {
            plant.imbalance = [
                1e3 * size("size_s [N]", r.either_sign(0.3, 0.8)),
                1e3 * size("size_c [N]", r.either_sign(0.3, 0.8)),
                size("f [Hz]", r.between(1.5, 3.0)),
            ];
        }
        if plan.hides("leaning_weight") {
            plant.weight = 1e3 * size("weight [N]", r.either_sign(0.6, 1.5));
            plant.leans = size("since [s]", r.between(8.0, 20.0));
        }
        if plan.hides("slow_gauge") {
            plant.lag = 1e-3 * size("tau [ms]", r.between(15.0, 50.0));
        }
        if plan.hides("tired_spring") {
            plant.tired = size("lost [1]", r.between(0.06, 0.15));
            plant.tiring = size("tau [s]", r.between(6.0, 14.0));
        }
        if plan.hides("tapered_damper") {
            // Twice the damping, so that its changes show.
            plant.damping *= 2.0;
            plant.taper = 1e-3 * size("taper [1/m]", r.either_sign(1.0, 2.0));
        }
        (plant, sizes)
    }

    fn stiffness(&self, t: f64) -> f64 {
        let broken = if t > self.breaks { self.broken } else { 0.0 };
        let tired = if self.tired > 0.0 { 1.0 - (-t / self.tiring).exp() } else { 0.0 };
        self.stiffness * (1.0 - broken) * (1.0 - self.tired * tired)
    }

    fn damping(&self, x: f64) -> f64 {
        self.damping * (1.0 + self.taper * x)
    }

    /// Rate of the momentum, mN.
    fn force(&self, t: f64, y: &State, pushed: f64) -> f64 {
        let (x, v) = (y[0], y[1] / self.mass);
        let stretched = if x.abs() < self.play { 0.0 } else { x - self.play.copysign(x) };
        let spring =
            self.stiffness(t) * stretched + self.quadratic * x * x + self.cubic * x.powi(3);
        let stop = if x > self.gap { self.stop * (x - self.gap) } else { 0.0 };
        let [sine, cosine, frequency] = self.imbalance;
        let angle = std::f64::consts::TAU * frequency * t;
        let imbalance = sine * angle.sin() + cosine * angle.cos();
        let weight = if t > self.leans { self.weight } else { 0.0 };
        let friction = self.damping(x) * v
            + self.air * v * v.abs()
            + self.rub * (v / 10.0).tanh()
            + self.mount * y[2];
        pushed + imbalance + weight - spring - stop - friction
    }

    fn slope(&self, t: f64, y: &State, pushed: f64) -> State {
        let v = y[1] / self.mass;
        let turning = v - v.abs() * y[2].abs() * y[2];
        [
            v,
            self.force(t, y, pushed),
            if self.mount > 0.0 { turning / self.reach } else { 0.0 },
            if self.lag > 0.0 { (y[0] - y[3]) / self.lag } else { 0.0 },
        ]
    }
}

fn record(plan: &Plan) -> Recording {
    let (plant, sizes) = Plant::drawn(plan);
    let mut r = plan.excitation();
    let pushes = ramps(&mut r, ROWS, [-9.0, 9.0], [20, 90], 10);
    let swings = if plan.is_train() {
        waves(&mut r, ROWS, [-6.0, 6.0], &[71.0, 43.0, 118.0])
    } else {
        waves(&mut r, ROWS, [-6.0, 6.0], &[83.0, 36.0, 141.0])
    };
    let f: Vec<f64> =
        pushes.iter().zip(&swings).map(|(a, b)| (100.0 * (a + b)).round() / 100.0).collect();
    let shaker = Signal::linear(INTERVAL, &f);
    let x = r.between(-80.0, 80.0);
    let mut y = [x, plant.mass * r.between(-300.0, 300.0), 0.0, x];
    let (mut x, mut a, mut trace) = (vec![], vec![], vec![]);
    for (k, pushed) in f.iter().enumerate() {
        let t = k as f64 * INTERVAL;
        x.push(plant.way_gain * if plant.lag > 0.0 { y[3] } else { y[0] });
        a.push(1e-3 * plant.amplified * plant.force(t, &y, 1e3 * pushed) / plant.mass);
        if plan.hides("tired_spring") {
            trace.push(plant.stiffness(t));
        }
        if plan.hides("tapered_damper") {
            trace.push(plant.damping(y[0]));
        }
        rk4(&mut y, t, INTERVAL, 40, |t, y| plant.slope(t, y, 1e3 * shaker.at(t)));
    }
    Recording {
        time_unit: "s",
        times: (0..ROWS).map(|k| k as f64 * INTERVAL).collect(),
        columns: vec![
            Column::input("F", "N", f),
            Column::output("x", "mm", 1.0, x),
            Column::output("a", "m/s^2", 0.1, a),
        ],
        trace,
        sizes,
    }
}
