//! A step-down converter whose duty jumps, a reading every 5 microseconds for 7 milliseconds.
//!
//! The simulator keeps the flux of the coil and the charge of the capacitor, where the model keeps current and voltage.

use super::coil::Coil;
use crate::bank::integrate::rk4;
use crate::bank::signal::{Signal, steps, waves};
use crate::bank::{Column, Domain, Hidden, Plan, Recording, Truth};

pub(crate) static DOMAIN: Domain = Domain {
    name: "buck",
    model: include_str!("model.dgd"),
    effects: &[
        ("capacitor_resistance", include_str!("effects/capacitor_resistance.dgd")),
        ("ceramic_capacitor", include_str!("effects/ceramic_capacitor.dgd")),
        ("core_saturation", include_str!("effects/core_saturation.dgd")),
        ("dead_time", include_str!("effects/dead_time.dgd")),
        ("diode_drop", include_str!("effects/diode_drop.dgd")),
        ("lamp_heating", include_str!("effects/lamp_heating.dgd")),
        ("modulator_delay", include_str!("effects/modulator_delay.dgd")),
        ("sense_filter", include_str!("effects/sense_filter.dgd")),
        ("switch_resistance", include_str!("effects/switch_resistance.dgd")),
    ],
    hidden: HIDDEN,
    record,
};

const HIDDEN: &[Hidden] = &[
    Hidden::library("capacitor_resistance"),
    Hidden::library("diode_drop"),
    Hidden::library("core_saturation"),
    Hidden::library("dead_time"),
    Hidden::library("sense_filter"),
    Hidden::library("ceramic_capacitor"),
    Hidden::library("modulator_delay"),
    Hidden::library("switch_resistance"),
    Hidden::library("lamp_heating"),
    Hidden::library("diode_drop+sense_filter"),
    Hidden {
        name: "current_offset",
        truth: Truth::Template(&["sensor_offset(i)"]),
        effect: "effect truth on buck\nkind sensor\n\
            parameter offset [A] = 0\nnull offset = 0\nreplace output i by i + offset\n",
    },
    Hidden {
        name: "voltage_gain",
        // With coil and capacitor on the scale of the reading, a larger drive is a larger reading, and so is a
        // voltage that counts less in the coil.
        truth: Truth::Template(&[
            "sensor_gain(v)",
            "input_gain(d)",
            "input_gain(v_in)",
            "viscous_drag(v, coil)",
        ]),
        effect: "effect truth on buck\nkind sensor\n\
            parameter gain [1] = 1 in 0.2 .. 5\nnull gain = 1\nreplace output v by gain*v\n",
    },
    Hidden {
        name: "late_duty",
        truth: Truth::Template(&["input_delay(d)"]),
        effect: "effect truth on buck\nkind input\n\
            parameter late [us] = 15 in 0 .. 200\nnull late = 0\nreplace d by delay(d, late)\n",
    },
    Hidden {
        name: "limited_duty",
        truth: Truth::Template(&["input_saturation(d)"]),
        effect: "effect truth on buck\nkind input\n\
            parameter top [%] = 60 in 10 .. 100\nreplace d by min(d, top)\n",
    },
    Hidden {
        name: "filtered_voltage",
        truth: Truth::Template(&["sensor_lag(v)"]),
        effect: "effect truth on buck\nkind sensor\n\
            parameter tau [us] = 20 in 1 .. 500, log\nstate shown [V] = 5\n\
            equation gauge: tau*der(shown) = v - shown\nreplace output v by shown\n",
    },
    Hidden {
        name: "ripple",
        truth: Truth::Template(&["periodic_disturbance(coil)"]),
        effect: "effect truth on buck\nkind plant\n\
            parameter size_s [V] = 0.1\nparameter size_c [V] = 0.1\n\
            parameter f [kHz] = 1.2 in 0.2 .. 5\n\
            add size_s*sin(2*pi*f*time) + size_c*cos(2*pi*f*time) to coil\n",
    },
    Hidden {
        name: "resistance_with_current",
        truth: Truth::Template(&["quadratic_drag(i, coil)"]),
        effect: "effect truth on buck\nkind plant\n\
            parameter loss [ohm/A] = 0\nnull loss = 0\nadd -loss*i*abs(i) to coil\n",
    },
    Hidden {
        name: "soft_core",
        truth: Truth::Parameter {
            name: "L",
            places: &["coil"],
            law: "L falls with the size of i, as 1/(1 + (i/i_s)^2)",
        },
        effect: "effect truth on buck\nkind plant\n\
            parameter soft [1/A^2] = 0.03 in 0 .. 2\nreplace L by L/(1 + soft*i^2)\n",
    },
    Hidden {
        name: "voltage_dependent_capacitor",
        truth: Truth::Parameter {
            name: "C",
            places: &["capacitor"],
            law: "C falls in a straight line with v",
        },
        effect: "effect truth on buck\nkind plant\n\
            parameter slope [1/V] = -0.05 in -0.09 .. 0.5\nreplace C by C*(1 + slope*v)\n",
    },
];

/// Interval of the rows in ms; the simulator counts in ms, kHz, uF = ms/kohm, mH, V and A.
const INTERVAL: f64 = 0.005;
const ROWS: usize = 1400;

/// The plant in ms, V and A, so that inductances are in mH and capacitances in mF; with sizes of what is
/// hidden. Those that are not hidden are zero.
#[derive(Debug, Clone, Copy, Default)]
struct Plant {
    coil: Coil,
    capacitance: f64,
    resistance: f64,
    lamp: f64,
    esr: f64,
    forward: f64,
    bias: f64,
    bias_line: f64,
    lost: f64,
    on: f64,
    late: f64,
    filter: f64,
    filament: f64,
    offset: f64,
    gain: f64,
    top: f64,
    ripple: [f64; 3],
    loss: f64,
}

/// Flux of the coil, V ms; charge of the capacitor, A ms; and what the filter shows, V.
type State = [f64; 3];

/// What acts on the plant.
#[derive(Debug, Clone, Copy)]
struct Drive {
    duty: f64,
    supply: f64,
    load: f64,
}

impl Plant {
    fn drawn(plan: &Plan) -> (Plant, Vec<(&'static str, f64)>) {
        let mut r = plan.sizes();
        let mut plant = Plant {
            coil: Coil::of_air(r.off(0.047)),
            capacitance: r.off(0.1),
            resistance: r.off(0.15),
            lamp: r.off(8.0),
            gain: 1.0,
            top: 1.0,
            ..Plant::default()
        };
        let mut sizes = Vec::new();
        let mut size = |name: &'static str, value: f64| {
            sizes.push((name, value));
            value
        };
        if plan.hides("capacitor_resistance") {
            plant.esr = 1e-3 * size("esr [mohm]", r.between(40.0, 100.0));
        }
        if plan.hides("diode_drop") {
            plant.forward = size("forward [V]", r.between(0.4, 0.8));
        }
        if plan.hides("core_saturation") || plan.hides("soft_core") {
            plant.coil.softness = size("soft [1/A^2]", r.between(0.03, 0.08));
        }
        if plan.hides("ceramic_capacitor") {
            plant.bias = size("bias [1/V^2]", r.between(0.008, 0.02));
        }
        if plan.hides("voltage_dependent_capacitor") {
            plant.bias_line = size("slope [1/V]", -r.between(0.04, 0.07));
        }
        if plan.hides("dead_time") {
            plant.lost = 0.01 * size("lost [%]", r.between(1.5, 4.0));
        }
        if plan.hides("switch_resistance") {
            plant.on = 1e-3 * size("r_on [mohm]", r.between(150.0, 350.0));
        }
        if plan.hides("modulator_delay") || plan.hides("late_duty") {
            plant.late = 1e-3
                * size(
                    if plan.hides("late_duty") { "late [us]" } else { "t_load [us]" },
                    r.between(8.0, 25.0),
                );
        }
        if plan.hides("sense_filter") || plan.hides("filtered_voltage") {
            plant.filter = 1e-3
                * size(
                    if plan.hides("filtered_voltage") { "tau [us]" } else { "t_sense [us]" },
                    r.between(12.0, 35.0),
                );
        }
        if plan.hides("lamp_heating") {
            // The file's resistance is that of the warm lamp.
            plant.lamp *= 0.25;
            plant.filament = size("filament [1/V]", r.between(0.4, 1.0));
        }
        if plan.hides("current_offset") {
            plant.offset = size("offset [A]", r.either_sign(0.25, 0.5));
        }
        if plan.hides("voltage_gain") {
            plant.gain = size("gain [1]", 1.0 + r.either_sign(0.03, 0.08));
        }
        if plan.hides("limited_duty") {
            plant.top = 0.01 * size("top [%]", r.between(50.0, 60.0));
        }
        if plan.hides("ripple") {
            plant.ripple =
                [r.either_sign(0.07, 0.18), r.either_sign(0.07, 0.18), r.between(0.7, 1.5)];
            size("size_s [V]", plant.ripple[0]);
            size("size_c [V]", plant.ripple[1]);
            size("f [kHz]", plant.ripple[2]);
        }
        if plan.hides("resistance_with_current") {
            plant.loss = size("loss [ohm/A]", r.between(0.06, 0.15));
        }
        (plant, sizes)
    }

    fn capacitance(&self, v: f64) -> f64 {
        self.capacitance * (1.0 + self.bias_line * v) / (1.0 + self.bias * v * v)
    }

    /// The charge at a voltage: the integral of the capacitance.
    fn charge(&self, v: f64) -> f64 {
        let bias = if self.bias > 0.0 {
            let root = self.bias.sqrt();
            (v * root).atan() / root
        } else {
            v + 0.5 * self.bias_line * v * v
        };
        self.capacitance * bias
    }

    /// The voltage at a charge, from one nearby, by Newton's method.
    fn voltage(&self, charge: f64) -> f64 {
        let mut v = charge / self.capacitance;
        for _ in 0..30 {
            let step = (charge - self.charge(v)) / self.capacitance(v);
            v += step;
            if step.abs() < 1e-13 * (1.0 + v.abs()) {
                break;
            }
        }
        v
    }

    fn lamp(&self, v: f64) -> f64 {
        v / (self.lamp * (1.0 + self.filament * v))
    }

    /// Voltage at the capacitor's terminals.
    fn terminal(&self, i: f64, v: f64, load: f64) -> f64 {
        v + self.esr * (i - load - self.lamp(v))
    }

    fn slope(&self, t: f64, y: &State, drive: &Drive) -> State {
        let (i, v) = (self.coil.current(y[0]), self.voltage(y[1]));
        let duty = (drive.duty - self.lost).clamp(0.0, self.top);
        let [sine, cosine, frequency] = self.ripple;
        let angle = std::f64::consts::TAU * frequency * t;
        let ripple = sine * angle.sin() + cosine * angle.cos();
        let terminal = self.terminal(i, v, drive.load);
        let lost = (self.resistance + self.on * duty) * i + self.loss * i * i.abs();
        [
            duty * drive.supply + ripple - (1.0 - duty) * self.forward - lost - terminal,
            i - drive.load - self.lamp(v),
            if self.filter > 0.0 { (v - y[2]) / self.filter } else { 0.0 },
        ]
    }
}

fn record(plan: &Plan) -> Recording {
    let (plant, sizes) = Plant::drawn(plan);
    let mut r = plan.excitation();
    let lengths = if plan.is_train() { [60, 200] } else { [40, 260] };
    let d = steps(&mut r, ROWS, [30.0, 70.0], lengths);
    let v_in = waves(&mut r, ROWS, [10.5, 13.5], &[830.0, 397.0]);
    let i_load = steps(&mut r, ROWS, [0.2, 2.0], [70, 250]);
    let (duty, supply) = (Signal::held(INTERVAL, &d), Signal::linear(INTERVAL, &v_in));
    let v = r.between(4.0, 6.0);
    let mut y = [plant.coil.flux(i_load[0] + v / 8.0), plant.charge(v), v];
    let (mut i, mut v, mut trace) = (vec![], vec![], vec![]);
    for (k, load) in i_load.iter().enumerate() {
        let t = k as f64 * INTERVAL;
        let (current, charged) = (plant.coil.current(y[0]), plant.voltage(y[1]));
        let shown = if plant.filter > 0.0 {
            y[2]
        } else {
            plant.gain * plant.terminal(current, charged, *load)
        };
        i.push(current + plant.offset);
        v.push(shown);
        if plan.hides("soft_core") {
            trace.push(1e3 * plant.coil.inductance(current));
        }
        if plan.hides("voltage_dependent_capacitor") {
            trace.push(1e3 * plant.capacitance(charged));
        }
        // In pieces, so that a late duty changes at the end of one.
        for piece in 0..10 {
            let t = t + f64::from(piece) * INTERVAL / 10.0;
            let duty = 0.01 * duty.at(t + INTERVAL / 20.0 - plant.late);
            rk4(&mut y, t, INTERVAL / 10.0, 1, |t, y| {
                plant.slope(t, y, &Drive { duty, supply: supply.at(t), load: *load })
            });
        }
    }
    Recording {
        time_unit: "ms",
        times: (0..ROWS).map(|k| k as f64 * INTERVAL).collect(),
        columns: vec![
            Column::input("d", "%", d),
            Column::input("v_in", "V", v_in),
            Column::input("i_load", "A", i_load),
            Column::output("i", "A", 0.03, i),
            Column::output("v", "V", 0.02, v),
        ],
        trace,
        sizes,
    }
}
