//! A vessel for compressed air between two valves for three minutes, at five samples a second.
//!
//! The simulator keeps the mass of the air and its temperature, where the model keeps a pressure.

use crate::bank::integrate::rk4;
use crate::bank::signal::{Signal, steps, waves};
use crate::bank::{Column, Domain, Hidden, Part, Plan, Recording, Truth};

pub(crate) static DOMAIN: Domain = Domain {
    name: "pressure_vessel",
    model: include_str!("model.dgd"),
    effects: &[
        ("exhaust_icing", include_str!("effects/exhaust_icing.dgd")),
        ("gas_heating", include_str!("effects/gas_heating.dgd")),
        ("leak_orifice", include_str!("effects/leak_orifice.dgd")),
        ("relief_valve", include_str!("effects/relief_valve.dgd")),
        ("second_volume", include_str!("effects/second_volume.dgd")),
        ("stretching_hose", include_str!("effects/stretching_hose.dgd")),
        ("supply_drop", include_str!("effects/supply_drop.dgd")),
        ("valve_characteristic", include_str!("effects/valve_characteristic.dgd")),
        ("valve_lag", include_str!("effects/valve_lag.dgd")),
    ],
    hidden: HIDDEN,
    record,
};

const HIDDEN: &[Hidden] = &[
    Hidden::library("relief_valve"),
    Hidden::library("second_volume"),
    Hidden::library("leak_orifice+valve_lag"),
    Hidden::library("gas_heating"),
    Hidden::library("supply_drop"),
    Hidden::library("valve_characteristic"),
    Hidden::library("stretching_hose"),
    Hidden::library("exhaust_icing"),
    Hidden::library("second_volume+supply_drop"),
    Hidden::library("leak_orifice"),
    Hidden::library("valve_lag"),
    Hidden {
        name: "porous_wall",
        truth: Truth::Template(&["leak(p, mass)"]),
        effect: "effect truth on pressure_vessel\nkind plant\n\
            parameter rate [g/(s*bar)] = 0\nnull rate = 0\nadd -rate*p to mass\n",
    },
    Hidden {
        name: "full_scale",
        truth: Truth::Template(&["sensor_saturation(p)"]),
        effect: "effect truth on pressure_vessel\nkind sensor\n\
            parameter top [barg] = 4.5 in 2 .. 8\nreplace output p by min(p, top)\n",
    },
    Hidden {
        name: "slow_flow_meter",
        truth: Truth::Template(&["sensor_lag(m_in)"]),
        effect: "effect truth on pressure_vessel\nkind sensor\n\
            parameter tau [s] = 0.5 in 0.02 .. 20, log\nstate m_read [g/s] = 3\n\
            equation meter: tau*der(m_read) = m_in - m_read\nreplace output m_in by m_read\n",
    },
    Hidden {
        name: "valve_zero",
        truth: Truth::Template(&["input_offset(u_out)"]),
        effect: "effect truth on pressure_vessel\nkind input\n\
            parameter offset [%] = 0\nnull offset = 0\nreplace u_out by u_out + offset\n",
    },
    Hidden {
        name: "soft_seat",
        truth: Truth::Parameter {
            name: "C_out",
            // Only the product with the opening matters.
            places: &["u_out"],
            law: "C_out grows with p, in a straight line",
        },
        effect: "effect truth on pressure_vessel\nkind plant\n\
            parameter widening [1/bar] = 0.1 in -0.12 .. 5\n\
            replace C_out by C_out*(1 + widening*(p - 3 [barg]))\n",
    },
    Hidden {
        name: "clogging_filter",
        truth: Truth::Parameter {
            name: "C_in",
            // Only the product with the opening matters.
            places: &["u_in"],
            law: "C_in falls with time, ever more slowly, towards a last value",
        },
        effect: "effect truth on pressure_vessel\nkind plant\n\
            parameter lost [1] = 0.2 in 0 .. 0.95\nparameter tau [s] = 60 in 5 .. 1000, log\n\
            replace C_in by C_in*(1 - lost*(1 - exp(-time/tau)))\n",
    },
];

const INTERVAL: f64 = 0.2; // s
const GAS: f64 = 2.871e-3; // l bar/(g K)
const WARM: f64 = 293.15; // K
const ATMOSPHERE: f64 = 1.013_25; // bar
const DENSITY: f64 = 1.185; // g/l at 1 bar
const CHOKED_BELOW: f64 = 0.35;
const C_V: f64 = 0.7178; // J/(g K)
const GAS_J: f64 = 0.2871; // J/(g K)

/// The plant in l, g, bar and s; sizes of effects that are not hidden stay zero.
#[derive(Debug, Clone, Copy, Default)]
struct Plant {
    volume: f64,
    filling: f64,
    exhaust: f64,
    hole: f64,
    relief: f64,
    relief_from: f64,
    tube: f64,
    second: f64,
    /// To the wall, W/K; zero for a wall that keeps the air at its temperature.
    wall: f64,
    valve_lag: f64,
    line: f64,
    exponent: f64,
    stretch: f64,
    ice: f64,
    pores: f64,
    top: f64,
    meter_lag: f64,
    zero: f64,
    widening: f64,
    clogged: f64,
    clogging_time: f64,
}

/// Mass and temperature of the air, gauge pressure of the dead volume, opening of the filling valve in %, and
/// what the flow meter shows.
type State = [f64; 5];

/// Openings in %, and gauge pressure of the supply.
#[derive(Debug, Clone, Copy)]
struct Inputs {
    filling: f64,
    exhaust: f64,
    supply: f64,
}

impl Plant {
    fn drawn(plan: &Plan) -> (Plant, Vec<(&'static str, f64)>) {
        let mut r = plan.sizes();
        let mut plant = Plant {
            volume: r.off(8.0),
            filling: r.off(1.0),
            exhaust: r.off(1.2),
            exponent: 1.0,
            top: f64::INFINITY,
            ..Plant::default()
        };
        let mut sizes = Vec::new();
        let mut size = |name: &'static str, value: f64| {
            sizes.push((name, value));
            value
        };
        if plan.hides("leak_orifice") {
            plant.hole = size("C_leak [l/(s*bar)]", r.between(0.02, 0.05));
        }
        if plan.hides("relief_valve") {
            plant.relief = size("relief [g/(s*bar)]", r.between(0.3, 0.9));
            plant.relief_from = size("p_open [barg]", r.between(3.2, 4.2));
        }
        if plan.hides("second_volume") {
            plant.tube = size("tube [g/(s*bar)]", r.between(0.15, 0.5));
            plant.second = size("V_2 [l]", r.between(1.0, 3.0));
        }
        if plan.hides("gas_heating") {
            plant.wall = size("hA [W/K]", r.between(1.0, 4.0));
        }
        if plan.hides("valve_lag") {
            plant.valve_lag = size("tau_valve [s]", r.between(0.2, 0.6));
        }
        if plan.hides("supply_drop") {
            plant.line = size("line [bar*s^2/g^2]", r.between(0.008, 0.02));
        }
        if plan.hides("valve_characteristic") {
            plant.exponent = size("exponent [1]", r.between(1.06, 1.2));
        }
        if plan.hides("stretching_hose") {
            plant.stretch = size("stretch [1/bar]", r.between(0.05, 0.12));
        }
        if plan.hides("exhaust_icing") {
            plant.ice = size("ice [1/min]", r.between(0.015, 0.04)) / 60.0;
        }
        if plan.hides("porous_wall") {
            plant.pores = size("rate [g/(s*bar)]", r.between(0.03, 0.08));
        }
        if plan.hides("full_scale") {
            plant.top = size("top [barg]", r.between(0.8, 0.92) * highest(plan));
        }
        if plan.hides("slow_flow_meter") {
            plant.meter_lag = size("tau [s]", r.between(0.3, 1.0));
        }
        if plan.hides("valve_zero") {
            plant.zero = size("offset [%]", r.either_sign(1.5, 4.0));
        }
        if plan.hides("soft_seat") {
            plant.widening = size("widening [1/bar]", r.between(0.03, 0.08));
        }
        if plan.hides("clogging_filter") {
            plant.clogged = size("lost [1]", r.between(0.08, 0.2));
            plant.clogging_time = size("tau [s]", r.between(30.0, 90.0));
        }
        (plant, sizes)
    }

    /// Absolute pressure of the air, bar: of a hose whose volume is V (1 + s p), from M R T = V (1 + s p) (p + p₀).
    fn pressure(&self, y: &State) -> f64 {
        let stiff = y[0] * GAS * y[1] / self.volume;
        if self.stretch == 0.0 {
            return stiff;
        }
        // s p² + (1 + s p₀) p + p₀ − stiff = 0
        let s = self.stretch;
        let b = 1.0 + s * ATMOSPHERE;
        let gauge = (-b + (b * b + 4.0 * s * (stiff - ATMOSPHERE)).sqrt()) / (2.0 * s);
        gauge + ATMOSPHERE
    }

    /// Mass of the air in the vessel at 20 °C and a gauge pressure, g.
    fn mass(&self, gauge: f64) -> f64 {
        let volume = self.volume * (1.0 + self.stretch * gauge);
        (gauge + ATMOSPHERE) * volume / (GAS * WARM)
    }

    fn filling(&self, t: f64) -> f64 {
        let clogged = if self.clogged > 0.0 { 1.0 - (-t / self.clogging_time).exp() } else { 0.0 };
        self.filling * (1.0 - self.clogged * clogged)
    }

    fn exhaust(&self, t: f64, gauge: f64) -> f64 {
        self.exhaust * (1.0 - self.ice * t) * (1.0 + self.widening * (gauge - 3.0))
    }

    /// Flow through the filling valve, g/s.
    fn inflow(&self, t: f64, y: &State, u: &Inputs) -> f64 {
        let opening = if self.valve_lag > 0.0 { y[3] } else { u.filling };
        let area = self.filling(t) * (0.01 * opening).powf(self.exponent);
        let vessel = self.pressure(y);
        let through = |before: f64| DENSITY * area * before * share(vessel / before);
        let supply = u.supply + ATMOSPHERE;
        if self.line == 0.0 {
            return through(supply);
        }
        // The flow at which line and valve agree; both sides are monotonic in it.
        let (mut low, mut high) = (0.0, through(supply));
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            let before = (supply - self.line * middle * middle).max(vessel);
            if through(before) > middle { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    fn slope(&self, t: f64, y: &State, u: &Inputs) -> State {
        let [mass, temperature, dead, opened, shown] = *y;
        let pressure = self.pressure(y);
        let gauge = pressure - ATMOSPHERE;
        let inflow = self.inflow(t, y, u);
        let out = 0.01 * (u.exhaust + self.zero) * self.exhaust(t, gauge);
        let jet = DENSITY * pressure * share(ATMOSPHERE / pressure);
        let outflow = out * jet * (WARM / temperature).sqrt();
        let relieved = self.relief * (gauge - self.relief_from).max(0.0);
        let tube = self.tube * (gauge - dead);
        let lost = self.hole * jet + relieved + tube + self.pores * gauge;
        let warming = inflow * ((C_V + GAS_J) * WARM - C_V * temperature)
            - outflow * GAS_J * temperature
            - self.wall * (temperature - WARM);
        [
            inflow - outflow - lost,
            if self.wall > 0.0 { warming / (mass * C_V) } else { 0.0 },
            if self.second > 0.0 { tube * GAS * WARM / self.second } else { 0.0 },
            if self.valve_lag > 0.0 { (u.filling - opened) / self.valve_lag } else { 0.0 },
            if self.meter_lag > 0.0 { (inflow - shown) / self.meter_lag } else { 0.0 },
        ]
    }
}

/// Flow over choked flow at a ratio of pressures.
fn share(ratio: f64) -> f64 {
    let beyond = ((ratio - CHOKED_BELOW) / (1.0 - CHOKED_BELOW)).clamp(0.0, 1.0);
    (1.0 - beyond * beyond).sqrt()
}

/// A gauge pressure that both recordings of this plant reach.
fn highest(plan: &Plan) -> f64 {
    let highest_of = |part: Part| {
        let healthy = record(&Plan { hidden: "", part, ..*plan });
        let p = healthy.columns.iter().find(|column| column.name == "p");
        p.into_iter().flat_map(|column| column.values.clone()).fold(0.0, f64::max)
    };
    highest_of(Part::Train).min(highest_of(Part::Valid))
}

fn record(plan: &Plan) -> Recording {
    let (plant, sizes) = Plant::drawn(plan);
    let rows = if plan.is_train() { 901 } else { 751 };
    let mut r = plan.excitation();
    let lengths = if plan.is_train() { [10, 50] } else { [8, 40] };
    let filling = steps(&mut r, rows, [25.0, 80.0], lengths);
    let exhaust = steps(&mut r, rows, [25.0, 85.0], lengths);
    let supply = waves(&mut r, rows, [6.2, 7.4], &[300.0, 83.0]);
    let line = Signal::linear(INTERVAL, &supply);
    let start = r.between(2.0, 4.0);
    let mut y = [plant.mass(start), WARM, start, filling[0], 0.0];
    let (mut p, mut m, mut trace) = (vec![], vec![], vec![]);
    for k in 0..rows {
        let t = k as f64 * INTERVAL;
        let (filling, exhaust) = (filling[k], exhaust[k]);
        let inputs = |t: f64| Inputs { filling, exhaust, supply: line.at(t) };
        let gauge = plant.pressure(&y) - ATMOSPHERE;
        let inflow = plant.inflow(t, &y, &inputs(t));
        if k == 0 {
            y[4] = inflow;
        }
        p.push(gauge.min(plant.top));
        m.push(if plant.meter_lag > 0.0 { y[4] } else { inflow });
        if plan.hides("soft_seat") {
            trace.push(plant.exhaust(t, gauge));
        }
        if plan.hides("clogging_filter") {
            trace.push(plant.filling(t));
        }
        rk4(&mut y, t, INTERVAL, 10, |t, y| plant.slope(t, y, &inputs(t)));
    }
    Recording {
        time_unit: "s",
        times: (0..rows).map(|k| k as f64 * INTERVAL).collect(),
        columns: vec![
            Column::input("u_in", "%", filling),
            Column::input("u_out", "%", exhaust),
            Column::input("p_s", "barg", supply),
            Column::output("p", "barg", 0.01, p),
            Column::output("m_in", "g/s", 0.05, m),
        ],
        trace,
        sizes,
    }
}
