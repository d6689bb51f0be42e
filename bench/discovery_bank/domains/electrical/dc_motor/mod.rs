//! A motor on a test bench, a thousand samples a second for a second and a half.
//!
//! The simulator keeps the flux of the winding and the angular momentum of the rotor, where the model keeps current
//! and speed.

use super::coil::Coil;
use crate::bank::integrate::rk4;
use crate::bank::signal::{Signal, steps};
use crate::bank::{Column, Domain, Hidden, Plan, Recording, Truth};

pub(crate) static DOMAIN: Domain = Domain {
    name: "dc_motor",
    model: include_str!("model.dgd"),
    effects: &[
        ("amplifier_dead_band", include_str!("effects/amplifier_dead_band.dgd")),
        ("armature_reaction", include_str!("effects/armature_reaction.dgd")),
        ("brake_gain", include_str!("effects/brake_gain.dgd")),
        ("brush_drop", include_str!("effects/brush_drop.dgd")),
        ("coulomb_friction", include_str!("effects/coulomb_friction.dgd")),
        ("fading_magnet", include_str!("effects/fading_magnet.dgd")),
        ("quadratic_drag", include_str!("effects/quadratic_drag.dgd")),
        ("tachometer_lag", include_str!("effects/tachometer_lag.dgd")),
        ("winding_heating", include_str!("effects/winding_heating.dgd")),
    ],
    hidden: HIDDEN,
    record,
};

const HIDDEN: &[Hidden] = &[
    Hidden::library("coulomb_friction"),
    Hidden::library("winding_heating"),
    Hidden::library("amplifier_dead_band"),
    Hidden::library("quadratic_drag"),
    Hidden::library("brush_drop"),
    Hidden::library("tachometer_lag"),
    Hidden::library("armature_reaction"),
    Hidden::library("fading_magnet"),
    Hidden::library("brake_gain"),
    Hidden::library("coulomb_friction+tachometer_lag"),
    Hidden {
        name: "fan",
        truth: Truth::Template(&["quadratic_drag(w, mechanical)"]),
        effect: "effect truth on dc_motor\nkind plant\n\
            parameter fan [N*m*s^2] = 0\nnull fan = 0\nadd -fan*w*abs(w) to mechanical\n",
    },
    Hidden {
        name: "dead_amplifier",
        truth: Truth::Template(&["dead_band(u)"]),
        effect: "effect truth on dc_motor\nkind input\n\
            parameter ignored [V] = 0.3 in 0 ..\nnull ignored = 0\n\
            replace u by max(u - ignored, 0) + min(u + ignored, 0)\n",
    },
    Hidden {
        name: "late_amplifier",
        truth: Truth::Template(&["input_delay(u)"]),
        effect: "effect truth on dc_motor\nkind input\n\
            parameter late [ms] = 4 in 0 .. 50\nnull late = 0\nreplace u by delay(u, late)\n",
    },
    Hidden {
        name: "current_gain",
        // All of these change only the ratio of the torque for a current to the voltage for a speed, which the
        // model takes to be one: the other parameters make up for the rest.
        truth: Truth::Template(&[
            "sensor_gain(i)",
            "sensor_gain(w)",
            "input_gain(u)",
            "input_gain(load)",
            "viscous_drag(i, mechanical)",
            "viscous_drag(w, electrical)",
        ]),
        effect: "effect truth on dc_motor\nkind sensor\n\
            parameter gain [1] = 1 in 0.2 .. 5\nnull gain = 1\nreplace output i by gain*i\n",
    },
    Hidden {
        name: "rubbing",
        truth: Truth::Template(&["dry_friction(w, mechanical)"]),
        effect: "effect truth on dc_motor\nkind plant\n\
            parameter rub [N*m] = 0.01 in 0 .. 1\nnull rub = 0\n\
            add -rub*tanh(w / 0.5 [rad/s]) to mechanical\n",
    },
    Hidden {
        name: "slow_amplifier",
        truth: Truth::Template(&["input_lag(u)"]),
        effect: "effect truth on dc_motor\nkind plant\n\
            parameter tau [ms] = 4 in 0.5 .. 50, log\nstate follows [V] = u nominal 5, fixed\n\
            equation lag: tau*der(follows) = u - follows\nreplace u by follows\n",
    },
    Hidden {
        name: "hum",
        truth: Truth::Template(&["periodic_disturbance(mechanical)"]),
        effect: "effect truth on dc_motor\nkind plant\n\
            parameter size_s [N*m] = 0\nparameter size_c [N*m] = 0\n\
            parameter f [Hz] = 11 in 2 .. 40\nnull size_s = 0\nnull size_c = 0\n\
            add size_s*sin(2*pi*f*time) + size_c*cos(2*pi*f*time) to mechanical\n",
    },
    Hidden {
        name: "clipped_current",
        truth: Truth::Template(&["sensor_saturation(i)"]),
        effect: "effect truth on dc_motor\nkind sensor\n\
            parameter top [A] = 3.5 in 0.5 .. 20\nreplace output i by min(i, top)\n",
    },
    Hidden {
        name: "heating",
        truth: Truth::Parameter {
            name: "R",
            places: &["electrical"],
            law: "R rises with time, ever more slowly, towards a last value",
        },
        effect: "effect truth on dc_motor\nkind plant\n\
            parameter rise [1] = 0.3 in -0.9 .. 3\nparameter tau [s] = 0.5 in 0.05 .. 5, log\n\
            replace R by R*(1 + rise*(1 - exp(-time/tau)))\n",
    },
    Hidden {
        name: "saturated_iron",
        truth: Truth::Parameter {
            name: "L",
            places: &["electrical"],
            law: "L falls with the size of i, as 1/(1 + (i/i_s)^2)",
        },
        effect: "effect truth on dc_motor\nkind plant\n\
            parameter iron [1/A^2] = 0.03 in 0 .. 2\nreplace L by L/(1 + iron*i^2)\n",
    },
];

const INTERVAL: f64 = 1e-3;
const ROWS: usize = 1500;

/// The plant in SI units, with sizes of what is hidden; those that are not hidden are zero.
#[derive(Debug, Clone, Copy, Default)]
struct Plant {
    resistance: f64,
    coil: Coil,
    field: f64,
    inertia: f64,
    viscous: f64,
    rub: f64,
    fan: f64,
    rise: f64,
    warming: f64,
    drop: f64,
    weakening: f64,
    ignored: f64,
    fade: f64,
    filter: f64,
    brake: f64,
    late: f64,
    current_gain: f64,
    lag: f64,
    hum: [f64; 3],
    clip: f64,
    drying: f64,
    drying_time: f64,
}

/// Flux of the winding, Vs; angular momentum, Nms; warmth; what the tachometer shows, rad/s; the voltage that acts, V.
type State = [f64; 5];

impl Plant {
    fn drawn(plan: &Plan) -> (Plant, Vec<(&'static str, f64)>) {
        let mut r = plan.sizes();
        let mut plant = Plant {
            resistance: r.off(1.2),
            coil: Coil::of_air(r.off(2e-3)),
            field: r.off(0.05),
            inertia: r.off(1e-4),
            viscous: r.off(1.5e-4),
            brake: 1.0,
            current_gain: 1.0,
            clip: f64::INFINITY,
            ..Plant::default()
        };
        let mut sizes = Vec::new();
        let mut size = |name: &'static str, value: f64| {
            sizes.push((name, value));
            value
        };
        if plan.hides("coulomb_friction") || plan.hides("rubbing") {
            plant.rub = size("rub [N*m]", r.between(0.012, 0.025));
        }
        if plan.hides("quadratic_drag") || plan.hides("fan") {
            plant.fan = size("fan [N*m*s^2]", r.between(2e-6, 4e-6));
        }
        if plan.hides("winding_heating") {
            plant.rise = size("rise [1]", r.between(0.25, 0.5));
            plant.warming = size("t_warm [s]", r.between(0.25, 0.7));
        }
        if plan.hides("brush_drop") {
            plant.drop = size("drop [V]", r.between(0.4, 0.9));
        }
        if plan.hides("armature_reaction") {
            plant.weakening = size("weakening [1/A^2]", r.between(0.002, 0.004));
        }
        if plan.hides("amplifier_dead_band") || plan.hides("dead_amplifier") {
            plant.ignored = size("ignored [V]", r.between(0.3, 0.8));
        }
        if plan.hides("fading_magnet") {
            plant.fade = size("fade [1/s]", r.between(0.04, 0.1));
        }
        if plan.hides("tachometer_lag") {
            plant.filter = 1e-3 * size("t_filter [ms]", r.between(2.0, 5.0));
        }
        if plan.hides("brake_gain") {
            plant.brake = size("brake [1]", 1.0 + r.either_sign(0.15, 0.3));
        }
        if plan.hides("late_amplifier") {
            plant.late = 1e-3 * size("late [ms]", r.between(2.5, 7.0));
        }
        if plan.hides("current_gain") {
            plant.current_gain = size("gain [1]", 1.0 + r.either_sign(0.1, 0.2));
        }
        if plan.hides("slow_amplifier") {
            plant.lag = 1e-3 * size("tau [ms]", r.between(6.0, 12.0));
        }
        if plan.hides("hum") {
            plant.hum =
                [r.either_sign(0.01, 0.02), r.either_sign(0.01, 0.02), r.between(8.0, 15.0)];
            size("size_s [N*m]", plant.hum[0]);
            size("size_c [N*m]", plant.hum[1]);
            size("f [Hz]", plant.hum[2]);
        }
        if plan.hides("clipped_current") {
            plant.clip = size("top [A]", r.between(3.0, 4.5));
        }
        if plan.hides("heating") {
            plant.drying = size("rise [1]", r.between(0.2, 0.5));
            plant.drying_time = size("tau [s]", r.between(0.3, 0.7));
        }
        if plan.hides("saturated_iron") {
            plant.coil.softness = size("iron [1/A^2]", r.between(0.05, 0.12));
        }
        (plant, sizes)
    }

    fn resistance(&self, t: f64) -> f64 {
        let heated = if self.drying > 0.0 { 1.0 - (-t / self.drying_time).exp() } else { 0.0 };
        self.resistance * (1.0 + self.drying * heated)
    }

    /// Voltage behind the amplifier.
    fn amplified(&self, u: f64) -> f64 {
        if u.abs() <= self.ignored { 0.0 } else { u - self.ignored.copysign(u) }
    }

    fn slope(&self, t: f64, y: &State, u: f64, load: f64) -> State {
        let (i, w) = (self.coil.current(y[0]), y[1] / self.inertia);
        let field = self.field * (1.0 - self.fade * t) * (1.0 - self.weakening * i * i);
        let voltage = if self.lag > 0.0 { y[4] } else { u };
        let lost = self.resistance(t) * (1.0 + self.rise * y[2]) * i
            + self.drop * (i / 0.2).tanh()
            + field * w;
        let [sine, cosine, frequency] = self.hum;
        let angle = std::f64::consts::TAU * frequency * t;
        let hum = sine * angle.sin() + cosine * angle.cos();
        let friction = self.viscous * w + self.fan * w * w.abs() + self.rub * (w / 0.5).tanh();
        [
            voltage - lost,
            field * i + hum - friction - self.brake * load,
            if self.rise > 0.0 { (i * i / 9.0 - y[2]) / self.warming } else { 0.0 },
            if self.filter > 0.0 { (w - y[3]) / self.filter } else { 0.0 },
            if self.lag > 0.0 { (u - y[4]) / self.lag } else { 0.0 },
        ]
    }
}

fn record(plan: &Plan) -> Recording {
    let (plant, sizes) = Plant::drawn(plan);
    let mut r = plan.excitation();
    let (voltages, lengths) =
        if plan.is_train() { ([-10.0, 10.0], [30, 120]) } else { ([-9.0, 11.0], [20, 160]) };
    let u = steps(&mut r, ROWS, voltages, lengths);
    let load = steps(&mut r, ROWS, [-0.06, 0.06], [80, 200]);
    let command = Signal::held(INTERVAL, &u);
    // It is at rest until the first command, but for what the command before it left.
    let mut y = [0.0, plant.inertia * r.between(-20.0, 20.0), 0.0, 0.0, 0.0];
    y[3] = y[1] / plant.inertia;
    y[4] = plant.amplified(u[0]);
    let (mut i, mut w, mut trace) = (vec![], vec![], vec![]);
    for (k, brake) in load.iter().enumerate() {
        let t = k as f64 * INTERVAL;
        let current = plant.coil.current(y[0]);
        i.push((current * plant.current_gain).min(plant.clip));
        w.push(if plant.filter > 0.0 { y[3] } else { y[1] / plant.inertia });
        if plan.hides("heating") {
            trace.push(plant.resistance(t));
        }
        if plan.hides("saturated_iron") {
            trace.push(1e3 * plant.coil.inductance(current));
        }
        // In pieces, so that a late command changes at the end of one.
        for piece in 0..20 {
            let t = t + f64::from(piece) * INTERVAL / 20.0;
            let late = command.at(t + INTERVAL / 40.0 - plant.late);
            let voltage = plant.amplified(late);
            rk4(&mut y, t, INTERVAL / 20.0, 1, |t, y| plant.slope(t, y, voltage, *brake));
        }
    }
    Recording {
        time_unit: "s",
        times: (0..ROWS).map(|k| k as f64 * INTERVAL).collect(),
        columns: vec![
            Column::input("u", "V", u),
            Column::input("load", "N*m", load),
            Column::output("i", "A", 0.05, i),
            Column::output("w", "rad/s", 0.5, w),
        ],
        trace,
        sizes,
    }
}
