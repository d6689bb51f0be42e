//! A drone that flies up and down under a controller, 50 samples a second for 15 seconds.
//!
//! The simulator counts in multiples of the drone's weight. The controller flies by what the sensors show, faults
//! included, and the record has what it demanded.

use crate::bank::integrate::rk4;
use crate::bank::signal::{Signal, steps};
use crate::bank::{Column, Domain, Hidden, Plan, Recording, Truth};

pub(crate) static DOMAIN: Domain = Domain {
    name: "drone",
    model: include_str!("model.dgd"),
    effects: &[
        ("battery_sag", include_str!("effects/battery_sag.dgd")),
        ("dropped_payload", include_str!("effects/dropped_payload.dgd")),
        ("ground_effect", include_str!("effects/ground_effect.dgd")),
        ("quadratic_drag", include_str!("effects/quadratic_drag.dgd")),
        ("slow_barometer", include_str!("effects/slow_barometer.dgd")),
        ("thrust_curve", include_str!("effects/thrust_curve.dgd")),
        ("updraft", include_str!("effects/updraft.dgd")),
        ("viscous_drag", include_str!("effects/viscous_drag.dgd")),
        ("vortex_ring", include_str!("effects/vortex_ring.dgd")),
    ],
    hidden: HIDDEN,
    record,
};

const HIDDEN: &[Hidden] = &[
    Hidden::library("ground_effect"),
    Hidden::library("viscous_drag"),
    Hidden::library("battery_sag"),
    Hidden::library("vortex_ring"),
    Hidden::library("quadratic_drag"),
    Hidden::library("slow_barometer"),
    Hidden::library("thrust_curve"),
    Hidden::library("updraft"),
    Hidden::library("dropped_payload"),
    Hidden::library("ground_effect+quadratic_drag"),
    Hidden {
        name: "drag",
        truth: Truth::Template(&["viscous_drag(v, climb)"]),
        effect: "effect truth on drone\nkind plant\n\
            parameter drag [N*s/m] = 0\nnull drag = 0\nadd -drag*v to climb\n",
    },
    Hidden {
        name: "late_command",
        truth: Truth::Template(&["input_delay(thrust)"]),
        effect: "effect truth on drone\nkind input\n\
            parameter late [ms] = 60 in 0 .. 1000\nnull late = 0\nreplace thrust by delay(thrust, late)\n",
    },
    Hidden {
        name: "biased_speed",
        // Speed is where height comes from: with the reading's speed the height drifts.
        truth: Truth::Template(&["sensor_offset(v)", "sensor_drift(z)"]),
        effect: "effect truth on drone\nkind sensor\n\
            parameter offset [m/s] = 0\nnull offset = 0\nreplace output v by v + offset\n",
    },
    Hidden {
        name: "parachute",
        truth: Truth::Template(&["quadratic_drag(v, climb)"]),
        effect: "effect truth on drone\nkind plant\n\
            parameter area [N*s^2/m^2] = 0\nnull area = 0\nadd -area*v*abs(v) to climb\n",
    },
    Hidden {
        name: "limited_rotors",
        truth: Truth::Template(&["input_saturation(thrust)"]),
        effect: "effect truth on drone\nkind input\n\
            parameter top [N] = 15 in 1 .. 100\nreplace thrust by min(thrust, top)\n",
    },
    Hidden {
        name: "filtered_height",
        truth: Truth::Template(&["sensor_lag(z)"]),
        effect: "effect truth on drone\nkind sensor\n\
            parameter t_baro [s] = 0.1 in 0.01 .. 5, log\nstate shown [m] = 1\n\
            equation gauge: t_baro*der(shown) = z - shown\nreplace output z by shown\n",
    },
    Hidden {
        name: "wind_from_below",
        // In the balance of the rotors it is the same force a tenth of a second later.
        truth: Truth::Template(&["unmeasured_flow(climb)", "unmeasured_flow(rotors)"]),
        effect: "effect truth on drone\nkind plant\n\
            parameter push [N] = 0.3\nparameter t_push [s] = 7 in 0 .., nominal 2\nnull push = 0\n\
            add if time > t_push then push else 0 to climb\n",
    },
    Hidden {
        name: "near_the_ground",
        truth: Truth::Parameter {
            name: "eff",
            places: &["climb"],
            law: "eff grows near the ground, as 1 + c/z",
        },
        effect: "effect truth on drone\nkind plant\n\
            parameter ground [m] = 0.01 in -0.1 .. 1\n\
            replace eff by eff*(1 + ground/max(z, 0.05 [m]))\n",
    },
    Hidden {
        name: "weak_battery",
        truth: Truth::Parameter {
            name: "eff",
            places: &["climb"],
            law: "eff falls with time, ever faster, as 1 - (time/t)^2",
        },
        effect: "effect truth on drone\nkind plant\n\
            parameter sag [1/min^2] = 0.1 in -5 .. 5\nreplace eff by eff*(1 - sag*time^2)\n",
    },
];

const G: f64 = 9.81;
/// Weight, N.
const WEIGHT: f64 = 1.2 * G;
const INTERVAL: f64 = 0.02;
/// Rows for training and for validation. Height is the integral of the integral of what acts, so that
/// what is a little wrong grows with the square of the time.
const ROWS: [usize; 2] = [750, 600];

/// The plant: forces are in weights, the rest in m and s; with sizes of what is hidden. Those that are not hidden are
/// zero.
#[derive(Debug, Clone, Copy, Default)]
struct Plant {
    efficiency: f64,
    lag: f64,
    viscous: f64,
    quadratic: f64,
    ground: f64,
    wake: f64,
    sag: f64,
    ageing: f64,
    dropped: f64,
    drops: f64,
    push: f64,
    pushes: f64,
    power: f64,
    barometer: f64,
    late: f64,
    offset: f64,
    top: f64,
}

/// Height, m; speed, m/s; thrust as demanded, weights; what the barometer shows, m.
type State = [f64; 4];

impl Plant {
    fn drawn(plan: &Plan) -> (Plant, Vec<(&'static str, f64)>) {
        let mut r = plan.sizes();
        let mut plant = Plant {
            efficiency: r.off(1.0),
            lag: r.off(0.1),
            power: 1.0,
            top: f64::INFINITY,
            ..Plant::default()
        };
        let mut sizes = Vec::new();
        let mut size = |name: &'static str, value: f64| {
            sizes.push((name, value));
            value
        };
        if plan.hides("viscous_drag") || plan.hides("drag") {
            plant.viscous = size("drag [N*s/m]", r.between(0.15, 0.35)) / WEIGHT;
        }
        if plan.hides("quadratic_drag") || plan.hides("parachute") {
            plant.quadratic = size("area [N*s^2/m^2]", r.between(0.2, 0.4)) / WEIGHT;
        }
        if plan.hides("ground_effect") || plan.hides("near_the_ground") {
            plant.ground = size("ground [m]", r.between(0.01, 0.04));
        }
        if plan.hides("vortex_ring") {
            plant.wake = size("wake [s/m]", r.between(0.02, 0.05));
        }
        if plan.hides("battery_sag") {
            plant.sag = size("sag [1/min]", r.between(0.015, 0.05)) / 60.0;
        }
        if plan.hides("weak_battery") {
            plant.ageing = size("sag [1/min^2]", r.between(0.1, 0.3)) / 3600.0;
        }
        if plan.hides("dropped_payload") {
            plant.dropped = size("payload [kg]", r.between(0.005, 0.02)) / 1.2;
            plant.drops = size("t_drop [s]", r.between(4.0, 10.5));
        }
        if plan.hides("updraft") || plan.hides("wind_from_below") {
            plant.push = size("push [N]", r.either_sign(0.04, 0.15)) / WEIGHT;
            plant.pushes = size("t_push [s]", r.between(4.0, 10.5));
        }
        if plan.hides("thrust_curve") {
            plant.power = size("power [1]", 1.0 + r.either_sign(0.1, 0.3));
        }
        if plan.hides("slow_barometer") || plan.hides("filtered_height") {
            plant.barometer = size("t_baro [s]", r.between(0.15, 0.3));
        }
        if plan.hides("late_command") {
            plant.late = 1e-3 * size("late [ms]", r.between(150.0, 220.0));
        }
        if plan.hides("biased_speed") {
            plant.offset = size("offset [m/s]", r.either_sign(0.1, 0.3));
        }
        if plan.hides("limited_rotors") {
            plant.top = size("top [N]", r.between(1.2, 1.3) * WEIGHT / plant.efficiency) / WEIGHT;
        }
        (plant, sizes)
    }

    fn efficiency(&self, t: f64, y: &State) -> f64 {
        let near = 1.0 + self.ground / y[0].max(0.05);
        let wake = 1.0 - self.wake * (-y[1]).max(0.0);
        self.efficiency * near * wake * (1.0 - self.sag * t) * (1.0 - self.ageing * t * t)
    }

    fn slope(&self, t: f64, y: &State, demanded: f64) -> State {
        let v = y[1];
        let mass = 1.0 - if t > self.drops { self.dropped } else { 0.0 };
        let push = if t > self.pushes { self.push } else { 0.0 };
        let weighed = y[2] / mass;
        let curved = y[2] * weighed.max(0.1 / WEIGHT).powf(self.power - 1.0);
        let lift = self.efficiency(t, y) * curved;
        let drag = self.viscous * v + self.quadratic * v * v.abs();
        [
            v,
            G * ((lift + push - drag) / mass - 1.0),
            (demanded.min(self.top) - y[2]) / self.lag,
            if self.barometer > 0.0 { (y[0] - y[3]) / self.barometer } else { 0.0 },
        ]
    }

    /// Height and speed as the sensors show them.
    fn shown(&self, y: &State) -> [f64; 2] {
        [if self.barometer > 0.0 { y[3] } else { y[0] }, y[1] + self.offset]
    }
}

fn record(plan: &Plan) -> Recording {
    let (plant, sizes) = Plant::drawn(plan);
    let mut r = plan.excitation();
    let (rows, lengths) = if plan.is_train() { (ROWS[0], [60, 200]) } else { (ROWS[1], [45, 180]) };
    // It comes close to the ground only where that matters.
    let lowest = if plant.ground > 0.0 { 0.4 } else { 0.9 };
    let wanted = steps(&mut r, rows, [lowest, 3.5], lengths);
    // Without a push of its own now and then a loop that is still says little.
    let dither = steps(&mut r, rows, [-0.08, 0.08], [12, 50]);
    let z = r.between(0.8, 1.6);
    let mut y = [z, r.between(-0.2, 0.2), 1.0 / plant.efficiency, z];
    let (mut z, mut v, mut thrust, mut trace) = (vec![], vec![], Vec::<f64>::new(), vec![]);
    let (mut sum, mut target) = (1.0 / plant.efficiency, wanted[0]);
    for k in 0..rows {
        let t = k as f64 * INTERVAL;
        let [height, speed] = plant.shown(&y);
        z.push(height);
        v.push(speed);
        if plan.hides("near_the_ground") || plan.hides("weak_battery") {
            trace.push(plant.efficiency(t, &y));
        }
        // The wanted height moves at no more than 1.8 m/s.
        target += (wanted[k] - target).clamp(-1.8 * INTERVAL, 1.8 * INTERVAL);
        let off = target - height;
        sum += 0.1 * off * INTERVAL;
        let demanded = (sum + 0.45 * off - 0.37 * speed + dither[k]).clamp(0.2, 2.2) * WEIGHT;
        thrust.push((1e3 * demanded).round() / 1e3);
        let command = Signal::held(INTERVAL, &thrust);
        // In pieces, so that a late command changes at the end of one.
        for piece in 0..10 {
            let t = t + f64::from(piece) * INTERVAL / 10.0;
            let demanded = command.at(t + INTERVAL / 20.0 - plant.late) / WEIGHT;
            rk4(&mut y, t, INTERVAL / 10.0, 2, |t, y| plant.slope(t, y, demanded));
        }
    }
    Recording {
        time_unit: "s",
        times: (0..rows).map(|k| k as f64 * INTERVAL).collect(),
        columns: vec![
            Column::input("thrust", "N", thrust),
            Column::output("z", "m", 0.02, z),
            Column::output("v", "m/s", 0.04, v),
        ],
        trace,
        sizes,
    }
}
