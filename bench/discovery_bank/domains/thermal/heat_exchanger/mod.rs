//! A heat exchanger between waste water and a cold stream for five days, at a sample every ten minutes.
//!
//! The simulator keeps the heat stored on both sides, in kJ above 0 °C, where the model keeps temperatures.

use crate::bank::integrate::rk4;
use crate::bank::signal::{Signal, steps, waves};
use crate::bank::{Column, Domain, Hidden, Plan, Recording, Truth};

pub(crate) static DOMAIN: Domain = Domain {
    name: "heat_exchanger",
    model: include_str!("model.dgd"),
    effects: &[
        ("air_pocket", include_str!("effects/air_pocket.dgd")),
        ("fouling_asymptotic", include_str!("effects/fouling_asymptotic.dgd")),
        ("fouling_linear", include_str!("effects/fouling_linear.dgd")),
        ("fouling_washed", include_str!("effects/fouling_washed.dgd")),
        ("heat_loss", include_str!("effects/heat_loss.dgd")),
        ("hot_bypass", include_str!("effects/hot_bypass.dgd")),
        ("hot_film_exponent", include_str!("effects/hot_film_exponent.dgd")),
        ("internal_leak", include_str!("effects/internal_leak.dgd")),
        ("viscous_film", include_str!("effects/viscous_film.dgd")),
        ("wall_cleaned", include_str!("effects/wall_cleaned.dgd")),
    ],
    hidden: HIDDEN,
    record,
};

const HIDDEN: &[Hidden] = &[
    Hidden::library("fouling_asymptotic"),
    Hidden::library("heat_loss"),
    Hidden::library("fouling_linear+internal_leak"),
    Hidden::library("hot_film_exponent"),
    Hidden::library("fouling_washed"),
    Hidden::library("hot_bypass"),
    Hidden::library("fouling_linear"),
    Hidden::library("internal_leak"),
    Hidden::library("fouling_asymptotic+heat_loss"),
    Hidden::library("wall_cleaned"),
    Hidden::library("viscous_film"),
    Hidden::library("air_pocket"),
    Hidden {
        name: "cold_meter",
        // Only the ratio of the two flows matters: volumes and heat transfer can be scaled with both.
        truth: Truth::Template(&["input_gain(q_c)", "input_gain(q_h)"]),
        effect: "effect truth on heat_exchanger\nkind input\n\
            parameter gain [1] = 1 in 0.2 .. 5\nnull gain = 1\nreplace q_c by gain*q_c\n",
    },
    Hidden {
        name: "drifting_thermometer",
        truth: Truth::Template(&["sensor_drift(T_h)"]),
        effect: "effect truth on heat_exchanger\nkind sensor\n\
            parameter drift [K/d] = 0\nnull drift = 0\nreplace output T_h by T_h + drift*time\n",
    },
    Hidden {
        name: "hot_inlet_offset",
        truth: Truth::Template(&["input_offset(T_h_in)"]),
        effect: "effect truth on heat_exchanger\nkind input\n\
            parameter offset [K] = 0\nnull offset = 0\nreplace T_h_in by T_h_in + offset\n",
    },
    Hidden {
        name: "sludge",
        truth: Truth::Template(&["parameter_step(R_w)"]),
        effect: "effect truth on heat_exchanger\nkind plant\n\
            parameter step [1] = 0.3 in -0.9 .. 20\nparameter since [h] = 60 in 0 .., nominal 2\n\
            replace R_w by R_w*(1 + (if time > since then step else 0))\n",
    },
    Hidden {
        name: "biofilm",
        truth: Truth::Parameter {
            name: "R_w",
            places: &[],
            law: "R_w grows with time from one level to another, along an S",
        },
        effect: "effect truth on heat_exchanger\nkind plant\n\
            parameter film [K/kW] = 0.1 in 0 .. 5\nparameter half [h] = 60 in 0 .. 300\n\
            parameter width [h] = 12 in 1 .. 200, log\n\
            replace R_w by R_w + film/2*(1 + tanh((time - half)/width))\n",
    },
    Hidden {
        name: "flushing",
        truth: Truth::Parameter {
            name: "R_w",
            places: &[],
            law: "R_w grows in a straight line and is flushed back at equal intervals",
        },
        // Up to three flushes within a recording: after each, growth begins again.
        effect: "effect truth on heat_exchanger\nkind plant\n\
            parameter dirt [K/(kW*d)] = 0.1 in 0 .. 5\n\
            parameter first [h] = 20 in 1 .. 120, nominal 2\n\
            parameter period [h] = 40 in 30 .. 120, nominal 2\n\
            let flushed = if time > first + 2*period then first + 2*period else (\n\
            if time > first + period then first + period else (if time > first then first else first - period))\n\
            replace R_w by R_w + dirt*(time - flushed)\n",
    },
];

const INTERVAL: f64 = 10.0; // min
const RHO_CP: f64 = 4.18; // kJ/(l K)

/// The plant in l, kJ, min and °C; sizes of effects that are not hidden stay zero.
#[derive(Debug, Clone, Copy, Default)]
struct Plant {
    film: f64,
    wall: f64,
    volumes: [f64; 2],
    growth: f64,
    end: f64,
    end_time: f64,
    settling: f64,
    washing: f64,
    cleaned: f64,
    cleaned_at: f64,
    loss: f64,
    exponent: f64,
    thinning: f64,
    leak: f64,
    bypass: f64,
    covered: f64,
    air_below: f64,
    meter_gain: f64,
    drift: f64,
    inlet_offset: f64,
    sludge: f64,
    sludge_at: f64,
    biofilm: f64,
    biofilm_at: f64,
    biofilm_width: f64,
    dirt: f64,
    first_flush: f64,
    flush_period: f64,
}

/// Heat of both sides, and the dirt that the flow washes away.
type State = [f64; 3];

/// Inputs at one moment.
#[derive(Debug, Clone, Copy)]
struct Inputs {
    hot: f64,
    cold: f64,
    hot_inlet: f64,
    cold_inlet: f64,
    room: f64,
}

impl Plant {
    fn drawn(plan: &Plan) -> (Plant, Vec<(&'static str, f64)>) {
        let mut r = plan.sizes();
        // kW are 60 kJ/min.
        let mut plant = Plant {
            film: 60.0 * r.off(5.0),
            wall: r.off(0.3) / 60.0,
            volumes: [r.off(900.0), r.off(700.0)],
            exponent: 0.8,
            meter_gain: 1.0,
            ..Plant::default()
        };
        let mut sizes = Vec::new();
        let mut size = |name: &'static str, value: f64| {
            sizes.push((name, value));
            value
        };
        if plan.hides("fouling_linear") {
            plant.growth = size("dirt [K/(kW*d)]", r.between(0.02, 0.06)) / 60.0 / 1440.0;
        }
        if plan.hides("fouling_asymptotic") {
            plant.end = size("R_end [K/kW]", r.between(0.1, 0.3)) / 60.0;
            plant.end_time = 1440.0 * size("tau [d]", r.between(0.6, 1.8));
        }
        if plan.hides("fouling_washed") {
            plant.settling = size("settling [K/(kW*d)]", r.between(0.15, 0.4)) / 60.0 / 1440.0;
            plant.washing = size("washing [1/d]", r.between(0.8, 2.0)) / 1440.0;
        }
        if plan.hides("wall_cleaned") {
            plant.cleaned = size("cleaned [1]", r.between(0.3, 0.6));
            plant.cleaned_at = 60.0 * size("t_clean [h]", r.between(40.0, 75.0));
        }
        if plan.hides("heat_loss") {
            plant.loss = 0.06 * size("loss [W/K]", r.between(15.0, 45.0));
        }
        if plan.hides("hot_film_exponent") {
            plant.exponent = size("exponent [1]", 0.8 + r.either_sign(0.25, 0.5));
        }
        if plan.hides("viscous_film") {
            plant.thinning = size("thinning [1/K]", r.between(0.015, 0.03));
        }
        if plan.hides("internal_leak") {
            plant.leak = size("q_leak [lpm]", r.between(0.5, 1.2));
        }
        if plan.hides("hot_bypass") {
            plant.bypass = size("share [1]", r.between(0.06, 0.15));
        }
        if plan.hides("air_pocket") {
            plant.covered = size("covered [1]", r.between(0.04, 0.12));
            plant.air_below = size("q_air [lpm]", r.between(24.0, 32.0));
        }
        if plan.hides("cold_meter") {
            plant.meter_gain = size("gain [1]", 1.0 + r.either_sign(0.03, 0.08));
        }
        if plan.hides("drifting_thermometer") {
            plant.drift = size("drift [K/d]", r.either_sign(0.1, 0.25)) / 1440.0;
        }
        if plan.hides("hot_inlet_offset") {
            plant.inlet_offset = size("offset [K]", r.either_sign(0.6, 1.5));
        }
        if plan.hides("sludge") {
            plant.sludge = size("step [1]", r.between(0.25, 0.6));
            plant.sludge_at = 60.0 * size("since [h]", r.between(40.0, 75.0));
        }
        if plan.hides("biofilm") {
            plant.biofilm = size("film [K/kW]", r.between(0.08, 0.2)) / 60.0;
            plant.biofilm_at = 60.0 * size("half [h]", r.between(40.0, 70.0));
            plant.biofilm_width = 60.0 * size("width [h]", r.between(6.0, 18.0));
        }
        if plan.hides("flushing") {
            plant.dirt = size("dirt [K/(kW*d)]", r.between(0.06, 0.15)) / 60.0 / 1440.0;
            plant.first_flush = 60.0 * size("first [h]", r.between(15.0, 35.0));
            plant.flush_period = 60.0 * size("period [h]", r.between(35.0, 45.0));
        }
        (plant, sizes)
    }

    /// Resistance of the wall with what sits on it, K min/kJ.
    fn wall(&self, t: f64, washed: f64) -> f64 {
        let cleaned = if t > self.cleaned_at { 1.0 - self.cleaned } else { 1.0 };
        let sludge = if t > self.sludge_at { 1.0 + self.sludge } else { 1.0 };
        let settled = if self.end > 0.0 { 1.0 - (-t / self.end_time).exp() } else { 0.0 };
        let grown = if self.biofilm > 0.0 {
            0.5 * (1.0 + ((t - self.biofilm_at) / self.biofilm_width).tanh())
        } else {
            0.0
        };
        let since_flush = if self.dirt > 0.0 {
            (t - self.first_flush).rem_euclid(self.flush_period)
        } else {
            0.0
        };
        self.wall * cleaned * sludge
            + self.growth * t
            + self.end * settled
            + self.biofilm * grown
            + self.dirt * since_flush
            + washed
    }

    fn temperatures(&self, y: &State) -> [f64; 2] {
        [y[0] / (RHO_CP * self.volumes[0]), y[1] / (RHO_CP * self.volumes[1])]
    }

    fn slope(&self, t: f64, y: &State, u: &Inputs) -> State {
        let [hot, cold] = self.temperatures(y);
        let flow = (1.0 - self.bypass) * u.hot;
        let cold_flow = self.meter_gain * u.cold;
        let thinning = (self.thinning * (hot - 55.0)).exp();
        let hot_film = self.film * (flow / 30.0).powf(self.exponent) * thinning;
        let cold_film = self.film * (cold_flow / 30.0).powf(0.8);
        let resistance = 1.0 / hot_film + 1.0 / cold_film + self.wall(t, y[2]);
        let bare = if u.cold < self.air_below { 1.0 - self.covered } else { 1.0 };
        let exchanged = bare * (hot - cold) / resistance;
        let inlet = u.hot_inlet + self.inlet_offset;
        [
            RHO_CP * flow * (inlet - hot) - exchanged - self.loss * (hot - u.room),
            RHO_CP * (cold_flow * (u.cold_inlet - cold) + self.leak * (hot - cold)) + exchanged,
            self.settling - self.washing * (u.cold / 30.0).powi(2) * y[2],
        ]
    }
}

fn record(plan: &Plan) -> Recording {
    let (plant, sizes) = Plant::drawn(plan);
    let rows = if plan.is_train() { 721 } else { 631 };
    let mut r = plan.excitation();
    let lengths = if plan.is_train() { [15, 60] } else { [10, 45] };
    let hot = steps(&mut r, rows, [15.0, 50.0], lengths);
    let cold = steps(&mut r, rows, [15.0, 50.0], lengths);
    let hot_inlet = waves(&mut r, rows, [60.0, 75.0], &[144.0, 41.0]);
    let cold_inlet = waves(&mut r, rows, [8.0, 16.0], &[144.0, 63.0]);
    let room = waves(&mut r, rows, [14.0, 26.0], &[144.0]);
    let [hot_now, cold_now, room_now] =
        [&hot_inlet, &cold_inlet, &room].map(|values| Signal::linear(INTERVAL, values));
    let mut y = [
        RHO_CP * plant.volumes[0] * r.between(50.0, 58.0),
        RHO_CP * plant.volumes[1] * r.between(26.0, 36.0),
        0.0,
    ];
    let (mut warm, mut heated, mut trace) = (vec![], vec![], vec![]);
    for k in 0..rows {
        let t = k as f64 * INTERVAL;
        let [hot_side, cold_side] = plant.temperatures(&y);
        let inlet = hot_inlet[k] + plant.inlet_offset;
        warm.push(hot_side + plant.bypass * (inlet - hot_side) + plant.drift * t);
        heated.push(cold_side);
        if plan.hides("biofilm") || plan.hides("flushing") {
            trace.push(60.0 * plant.wall(t, y[2]));
        }
        let (hot, cold) = (hot[k], cold[k]);
        rk4(&mut y, t, INTERVAL, 20, |t, y| {
            let (hot_inlet, cold_inlet, room) = (hot_now.at(t), cold_now.at(t), room_now.at(t));
            plant.slope(t, y, &Inputs { hot, cold, hot_inlet, cold_inlet, room })
        });
    }
    Recording {
        time_unit: "min",
        times: (0..rows).map(|k| k as f64 * INTERVAL).collect(),
        columns: vec![
            Column::input("q_h", "lpm", hot),
            Column::input("q_c", "lpm", cold),
            Column::input("T_h_in", "°C", hot_inlet),
            Column::input("T_c_in", "°C", cold_inlet),
            Column::input("T_room", "°C", room),
            Column::output("T_h", "°C", 0.1, warm),
            Column::output("T_c", "°C", 0.1, heated),
        ],
        trace,
        sizes,
    }
}
