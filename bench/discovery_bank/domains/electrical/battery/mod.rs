//! A lithium cell that is charged and discharged for 100 minutes, at a sample every 5 s.
//!
//! The simulator counts the charge that was taken out, in coulombs, where the model keeps a state of charge.

use crate::bank::integrate::rk4;
use crate::bank::random::Random;
use crate::bank::signal::{Signal, four_digits, waves};
use crate::bank::{Column, Domain, Hidden, Plan, Recording, Truth};

pub(crate) static DOMAIN: Domain = Domain {
    name: "battery",
    model: include_str!("model.dgd"),
    effects: &[
        ("charge_transfer", include_str!("effects/charge_transfer.dgd")),
        ("cold_resistance", include_str!("effects/cold_resistance.dgd")),
        ("coulombic_loss", include_str!("effects/coulombic_loss.dgd")),
        ("empty_resistance", include_str!("effects/empty_resistance.dgd")),
        ("entropic_heat", include_str!("effects/entropic_heat.dgd")),
        ("hysteresis", include_str!("effects/hysteresis.dgd")),
        ("natural_convection", include_str!("effects/natural_convection.dgd")),
        ("second_rc", include_str!("effects/second_rc.dgd")),
        ("self_discharge", include_str!("effects/self_discharge.dgd")),
        ("tab_heat", include_str!("effects/tab_heat.dgd")),
    ],
    hidden: HIDDEN,
    record,
};

const HIDDEN: &[Hidden] = &[
    Hidden::library("entropic_heat"),
    Hidden::library("hysteresis"),
    Hidden::library("second_rc+natural_convection"),
    Hidden::library("cold_resistance"),
    Hidden::library("second_rc"),
    Hidden::library("charge_transfer"),
    Hidden::library("empty_resistance"),
    Hidden::library("hysteresis+entropic_heat"),
    Hidden::library("natural_convection"),
    Hidden::library("self_discharge"),
    Hidden::library("coulombic_loss"),
    Hidden {
        name: "current_offset",
        truth: Truth::Template(&["input_offset(i)"]),
        effect: "effect truth on battery\nkind input\n\
            parameter offset [A] = 0\nnull offset = 0\nreplace i by i + offset\n",
    },
    Hidden {
        name: "slow_thermometer",
        truth: Truth::Template(&["sensor_lag(T)"]),
        effect: "effect truth on battery\nkind sensor\n\
            parameter tau [s] = 60 in 1 .. 1000, log\nstate T_read [°C] = 25\n\
            equation pocket: tau*der(T_read) = T - T_read\nreplace output T by T_read\n",
    },
    Hidden {
        name: "thermometer_offset",
        // Only the difference from the air temperature matters: either thermometer may be off, and a constant heat
        // source has the same effect.
        truth: Truth::Template(&[
            "sensor_offset(T)",
            "input_offset(T_amb)",
            "unmeasured_flow(heat)",
        ]),
        effect: "effect truth on battery\nkind sensor\n\
            parameter offset [K] = 0\nnull offset = 0\nreplace output T by T + offset\n",
    },
    Hidden {
        name: "loose_clamp",
        truth: Truth::Template(&["parameter_step(R0)"]),
        effect: "effect truth on battery\nkind plant\n\
            parameter step [1] = 0.2 in -0.9 .. 20\nparameter since [min] = 50 in 0 .., nominal 1\n\
            replace R0 by R0*(1 + (if time > since then step else 0))\n",
    },
    Hidden {
        name: "warm_resistance",
        truth: Truth::Parameter {
            name: "R0",
            places: &[],
            law: "R0 falls with T, exponentially, towards a least value",
        },
        effect: "effect truth on battery\nkind plant\n\
            parameter cold [1] = 0.4 in 0 .. 20\nparameter fade [K] = 12 in 2 .. 200, log\n\
            replace R0 by R0*(1 + cold*exp(-(T - 15 [°C])/fade))\n",
    },
    Hidden {
        name: "empty_transfer",
        truth: Truth::Parameter {
            name: "R1",
            places: &[],
            law: "R1 grows as soc falls, with its inverse",
        },
        effect: "effect truth on battery\nkind plant\n\
            parameter rise [1] = 0.3 in 0 .. 20\n\
            replace R1 by R1*(1 + rise*(1/(soc + 0.1) - 1))\n",
    },
];

const INTERVAL: f64 = 5.0; // s
const ROWS: usize = 1201;
const ZERO: f64 = 273.15; // K

/// The plant in SI units and °C; sizes of effects that are not hidden stay zero.
#[derive(Debug, Clone, Copy, Default)]
struct Plant {
    capacity: f64,
    r0: f64,
    r1: f64,
    c1: f64,
    heat_capacity: f64,
    cooling: f64,
    activation: f64,
    empty: f64,
    r2: f64,
    tau2: f64,
    half_gap: f64,
    gamma: f64,
    entropy: f64,
    efficiency: f64,
    self_discharge: f64,
    draught: f64,
    transfer: f64,
    exchange: f64,
    current_offset: f64,
    thermometer_lag: f64,
    thermometer_offset: f64,
    clamp: f64,
    clamp_at: f64,
    cold: f64,
    cold_fade: f64,
    empty_transfer: f64,
}

/// Charge taken out, voltages of the RC elements, temperature, side of the hysteresis, thermometer.
type State = [f64; 6];

impl Plant {
    fn drawn(plan: &Plan) -> (Plant, Vec<(&'static str, f64)>) {
        let mut r = plan.sizes();
        let mut plant = Plant {
            capacity: 3600.0 * r.off(3.0),
            r0: r.off(0.02),
            r1: r.off(0.012),
            c1: r.off(2500.0),
            heat_capacity: r.off(60.0),
            cooling: r.off(0.12),
            efficiency: 1.0,
            ..Plant::default()
        };
        let mut sizes = Vec::new();
        let mut size = |name: &'static str, value: f64| {
            sizes.push((name, value));
            value
        };
        if plan.hides("cold_resistance") {
            plant.activation = size("B [K]", r.between(1200.0, 2500.0));
        }
        if plan.hides("empty_resistance") {
            plant.empty = size("rise [1]", r.between(0.6, 1.5));
        }
        if plan.hides("second_rc") {
            plant.r2 = 1e-3 * size("R2 [mohm]", r.between(6.0, 14.0));
            plant.tau2 = size("tau2 [s]", r.between(200.0, 500.0));
        }
        if plan.hides("hysteresis") {
            plant.half_gap = 1e-3 * size("half_gap [mV]", r.between(10.0, 25.0));
            plant.gamma = size("gamma [1]", r.between(15.0, 40.0));
        }
        if plan.hides("entropic_heat") {
            plant.entropy = 1e-3 * size("dU_dT [mV/K]", r.either_sign(0.1, 0.25));
        }
        if plan.hides("coulombic_loss") {
            plant.efficiency = size("efficiency [1]", r.between(0.94, 0.975));
        }
        if plan.hides("self_discharge") {
            plant.self_discharge = 1e-3 * size("i_self [mA]", r.between(60.0, 150.0));
        }
        if plan.hides("natural_convection") {
            plant.draught = size("draught [1/K]", r.between(0.04, 0.1));
        }
        if plan.hides("charge_transfer") {
            plant.transfer = 1e-3 * size("v_t [mV]", r.between(10.0, 20.0));
            plant.exchange = size("i_0 [A]", r.between(0.4, 1.2));
        }
        if plan.hides("current_offset") {
            plant.current_offset = size("offset [A]", r.either_sign(0.06, 0.15));
        }
        if plan.hides("slow_thermometer") {
            plant.thermometer_lag = size("tau [s]", r.between(40.0, 120.0));
        }
        if plan.hides("thermometer_offset") {
            plant.thermometer_offset = size("offset [K]", r.either_sign(0.8, 2.0));
        }
        if plan.hides("loose_clamp") {
            plant.clamp = size("step [1]", r.between(0.12, 0.35));
            plant.clamp_at = 60.0 * size("since [min]", r.between(30.0, 70.0));
        }
        if plan.hides("warm_resistance") {
            plant.cold = size("cold [1]", r.between(0.4, 0.8));
            plant.cold_fade = size("fade [K]", r.between(8.0, 16.0));
        }
        if plan.hides("empty_transfer") {
            plant.empty_transfer = size("rise [1]", r.between(0.4, 0.8));
        }
        (plant, sizes)
    }

    fn series_resistance(&self, t: f64, charge: f64, warmth: f64) -> f64 {
        let arrhenius = (self.activation * (1.0 / (warmth + ZERO) - 1.0 / 298.15)).exp();
        let empty = 1.0 + self.empty * (1.0 - charge).powi(2);
        let clamp = if t > self.clamp_at { 1.0 + self.clamp } else { 1.0 };
        let cold = if self.cold > 0.0 { (-(warmth - 15.0) / self.cold_fade).exp() } else { 0.0 };
        self.r0 * arrhenius * empty * clamp * (1.0 + self.cold * cold)
    }

    fn transfer_resistance(&self, charge: f64) -> f64 {
        self.r1 * (1.0 + self.empty_transfer * (1.0 / (charge + 0.1) - 1.0))
    }

    fn state_of_charge(&self, y: &State) -> f64 {
        1.0 - y[0] / self.capacity
    }

    /// Open-circuit voltage minus terminal voltage, V.
    fn drop(&self, t: f64, y: &State, i: f64) -> f64 {
        let transfer = if self.transfer > 0.0 { (i / self.exchange).asinh() } else { 0.0 };
        let series = self.series_resistance(t, self.state_of_charge(y), y[3]);
        series * i + y[1] + y[2] + self.transfer * transfer
    }

    fn voltage(&self, t: f64, y: &State, i: f64) -> f64 {
        let z = self.state_of_charge(y);
        let rest = 3.35 + 0.62 * z + 0.2 * z.powi(3) - 0.25 * (-z / 0.08).exp();
        rest + self.half_gap * y[4] - self.drop(t, y, i)
    }

    fn slope(&self, t: f64, y: &State, i: f64, air: f64) -> State {
        let r1 = self.transfer_resistance(self.state_of_charge(y));
        let stored = if i < 0.0 { self.efficiency * i } else { i };
        let cooling = self.cooling * (1.0 + self.draught * (y[3] - air).abs());
        let heat = self.drop(t, y, i) * i - i * (y[3] + ZERO) * self.entropy;
        [
            stored + self.self_discharge,
            (i - y[1] / r1) / self.c1,
            if self.tau2 > 0.0 { (self.r2 * i - y[2]) / self.tau2 } else { 0.0 },
            (heat - cooling * (y[3] - air)) / self.heat_capacity,
            -self.gamma / self.capacity * (i.abs() * y[4] + i),
            if self.thermometer_lag > 0.0 { (y[3] - y[5]) / self.thermometer_lag } else { 0.0 },
        ]
    }
}

/// Currents that last for 20 s to 4 min, and keep the charge between a tenth and nine tenths.
fn currents(r: &mut Random, start: f64, capacity: f64, longest: usize) -> Vec<f64> {
    let mut values: Vec<f64> = Vec::with_capacity(ROWS);
    let mut charge = start;
    while values.len() < ROWS {
        let length = r.whole(4, longest).min(ROWS - values.len());
        let discharges = r.chance(((charge - 0.15) / 0.7).clamp(0.0, 1.0));
        let level = if r.chance(0.15) {
            0.0
        } else if discharges {
            r.between(1.0, 8.0)
        } else {
            -r.between(1.0, 6.0)
        };
        let level = four_digits(level);
        charge -= level * length as f64 * INTERVAL / capacity;
        values.resize(values.len() + length, level);
    }
    values
}

fn record(plan: &Plan) -> Recording {
    let (plant, sizes) = Plant::drawn(plan);
    let mut r = plan.excitation();
    let start = r.between(0.5, 0.75);
    let longest = if plan.is_train() { 48 } else { 30 };
    let current = currents(&mut r, start, plant.capacity, longest);
    let air = waves(&mut r, ROWS, [8.0, 32.0], &[900.0, 370.0]);
    let around = Signal::linear(INTERVAL, &air);
    let warmth = air[0] + r.between(0.0, 6.0);
    let mut y = [(1.0 - start) * plant.capacity, 0.0, 0.0, warmth, 0.0, warmth];
    let (mut v, mut shown, mut trace) = (vec![], vec![], vec![]);
    for (k, recorded) in current.iter().enumerate() {
        let t = k as f64 * INTERVAL;
        let i = recorded + plant.current_offset;
        v.push(plant.voltage(t, &y, i));
        let read = if plant.thermometer_lag > 0.0 { y[5] } else { y[3] };
        shown.push(read + plant.thermometer_offset);
        let charge = plant.state_of_charge(&y);
        if plan.hides("warm_resistance") {
            trace.push(1e3 * plant.series_resistance(t, charge, y[3]));
        }
        if plan.hides("empty_transfer") {
            trace.push(1e3 * plant.transfer_resistance(charge));
        }
        rk4(&mut y, t, INTERVAL, 10, |t, y| plant.slope(t, y, i, around.at(t)));
    }
    Recording {
        time_unit: "s",
        times: (0..ROWS).map(|k| k as f64 * INTERVAL).collect(),
        columns: vec![
            Column::input("i", "A", current),
            Column::input("T_amb", "°C", air),
            Column::output("v", "V", 0.002, v),
            Column::output("T", "°C", 0.1, shown),
        ],
        trace,
        sizes,
    }
}
