//! Two tanks in a row, at six samples a minute for two hours.
//!
//! The simulator keeps volumes, in litres and seconds, where the model keeps levels.

use crate::bank::integrate::rk4;
use crate::bank::signal::{Signal, ramps, steps};
use crate::bank::{Column, Domain, Hidden, Plan, Recording, Truth};

pub(crate) static DOMAIN: Domain = Domain {
    name: "two_tanks",
    model: include_str!("model.dgd"),
    effects: &[
        ("bypass", include_str!("effects/bypass.dgd")),
        ("clogged_passage", include_str!("effects/clogged_passage.dgd")),
        ("conical_tank", include_str!("effects/conical_tank.dgd")),
        ("leak_lower", include_str!("effects/leak_lower.dgd")),
        ("leak_upper", include_str!("effects/leak_upper.dgd")),
        ("overflow_pipe", include_str!("effects/overflow_pipe.dgd")),
        ("pump_wear", include_str!("effects/pump_wear.dgd")),
        ("valve_characteristic", include_str!("effects/valve_characteristic.dgd")),
    ],
    hidden: HIDDEN,
    record,
};

const HIDDEN: &[Hidden] = &[
    Hidden::library("clogged_passage"),
    Hidden::library("bypass"),
    Hidden::library("valve_characteristic"),
    Hidden::library("leak_upper"),
    Hidden::library("pump_wear"),
    Hidden::library("overflow_pipe"),
    Hidden::library("leak_lower"),
    Hidden::library("conical_tank"),
    Hidden::library("valve_characteristic+leak_upper"),
    Hidden {
        name: "pump_gain",
        // With all areas by the same factor smaller, a pump that delivers less and a flow meter that reads
        // more are the same equations.
        truth: Truth::Template(&["input_gain(q_in)", "sensor_gain(q_2)"]),
        effect: "effect truth on two_tanks\nkind input\n\
            parameter gain [1] = 1 in 0.2 .. 5\nnull gain = 1\nreplace q_in by gain*q_in\n",
    },
    Hidden {
        name: "gauge_offset",
        truth: Truth::Template(&["sensor_offset(h_2)"]),
        effect: "effect truth on two_tanks\nkind sensor\n\
            parameter offset [m] = 0\nnull offset = 0\nreplace output h_2 by h_2 + offset\n",
    },
    Hidden {
        name: "seepage",
        truth: Truth::Template(&["leak(h_1, upper)"]),
        effect: "effect truth on two_tanks\nkind plant\n\
            parameter rate [lpm/m] = 0\nnull rate = 0\nadd -rate*h_1 to upper\n",
    },
    Hidden {
        name: "rain",
        truth: Truth::Template(&["unmeasured_flow(lower)"]),
        effect: "effect truth on two_tanks\nkind plant\n\
            parameter flow [lpm] = 5\nparameter since [min] = 60 in 0 .., nominal 10\nnull flow = 0\n\
            add if time > since then flow else 0 to lower\n",
    },
    Hidden {
        name: "slow_valve",
        truth: Truth::Template(&["input_lag(opening)"]),
        effect: "effect truth on two_tanks\nkind plant\n\
            parameter tau [s] = 60 in 5 .. 600, log\nstate follows [%] = opening fixed\n\
            equation lag: tau*der(follows) = opening - follows\nreplace opening by follows\n",
    },
    Hidden {
        name: "loose_linkage",
        truth: Truth::Template(&["backlash(opening)"]),
        effect: "effect truth on two_tanks\nkind plant\n\
            parameter play [%] = 2 in 0 .. 30\nstate follows [%] = opening fixed\n\
            equation flank: 0.1 [s] * der(follows) = max(opening - play - follows, 0) + min(opening + play - follows, 0)\n\
            replace opening by follows\n",
    },
    Hidden {
        name: "drifting_gauge",
        truth: Truth::Template(&["sensor_drift(h_1)"]),
        effect: "effect truth on two_tanks\nkind sensor\n\
            parameter drift [m/h] = 0\nnull drift = 0\nreplace output h_1 by h_1 + drift*time\n",
    },
    Hidden {
        name: "fouling",
        truth: Truth::Parameter {
            name: "a_2",
            // Only the product with the opening acts.
            places: &["opening"],
            law: "a_2 falls with time, ever more slowly, towards a last value",
        },
        effect: "effect truth on two_tanks\nkind plant\n\
            parameter lost [1] = 0.3 in 0 .. 0.9\nparameter tau [min] = 40 in 5 .. 500, log\n\
            replace a_2 by a_2*(1 - lost*(1 - exp(-time/tau)))\n",
    },
    Hidden {
        name: "flap",
        truth: Truth::Parameter {
            name: "a_1",
            places: &[],
            law: "a_1 grows with h_1, in a straight line",
        },
        effect: "effect truth on two_tanks\nkind plant\n\
            parameter slope [1/m] = 0.3 in -0.5 .. 5\n\
            replace a_1 by a_1*(1 + slope*(h_1 - 1 [m]))\n",
    },
];

const G: f64 = 98.1; // dm/s²
const INTERVAL: f64 = 10.0;
const ROWS: usize = 721;

/// The plant in dm, l and s, with sizes of what is hidden; those that are not hidden are zero.
#[derive(Debug, Clone, Copy, Default)]
struct Plant {
    area: [f64; 2],
    passage: f64,
    valve: f64,
    clog: f64,
    clog_from: f64,
    hole: [f64; 2],
    bypass: f64,
    exponent: f64,
    wear: f64,
    cone: f64,
    pipe: f64,
    pipe_height: f64,
    gain: f64,
    offset: f64,
    seepage: f64,
    rain: f64,
    rain_from: f64,
    lag: f64,
    play: f64,
    drift: f64,
    fouled: f64,
    fouling_time: f64,
    flap: f64,
}

/// Volumes of the tanks, l, and where the valve is.
type State = [f64; 3];

impl Plant {
    fn drawn(plan: &Plan) -> (Plant, Vec<(&'static str, f64)>) {
        let mut r = plan.sizes();
        let mut plant = Plant {
            area: [r.off(50.0), r.off(70.0)],
            passage: r.off(0.04),
            valve: r.off(0.07),
            exponent: 1.0,
            gain: 1.0,
            ..Plant::default()
        };
        let mut sizes = Vec::new();
        let mut size = |name: &'static str, value: f64| {
            sizes.push((name, value));
            value
        };
        if plan.hides("clogged_passage") {
            plant.clog = size("clog [1]", r.between(0.1, 0.25));
            plant.clog_from = 60.0 * size("t_clog [min]", r.between(35.0, 80.0));
        }
        if plan.hides("leak_upper") {
            plant.hole[0] = 0.01 * size("a_hole [cm^2]", r.between(0.2, 0.5));
        }
        if plan.hides("leak_lower") {
            plant.hole[1] = 0.01 * size("a_drip [cm^2]", r.between(0.2, 0.5));
        }
        if plan.hides("bypass") {
            plant.bypass = size("share [1]", r.between(0.2, 0.4));
        }
        if plan.hides("valve_characteristic") {
            plant.exponent = size("exponent [1]", r.between(1.15, 1.5));
        }
        if plan.hides("pump_wear") {
            plant.wear = size("wear [1/h]", r.between(0.03, 0.1)) / 3600.0;
        }
        if plan.hides("conical_tank") {
            // The file's cross-section is that in the middle.
            plant.area[0] *= 0.5;
            plant.cone = 0.1 * size("cone [1/m]", r.between(1.0, 2.5));
        }
        if plan.hides("overflow_pipe") {
            // A little below the level that the mean flow would have, so that the water is above and below.
            let level = (1.5 / plant.passage).powi(2) / (2.0 * G);
            plant.pipe = 0.01 * size("a_pipe [cm^2]", r.between(0.6, 1.5));
            plant.pipe_height = 10.0 * size("h_pipe [m]", 0.1 * level * r.between(0.75, 0.95));
        }
        if plan.hides("pump_gain") {
            plant.gain = size("gain [1]", 1.0 + r.either_sign(0.05, 0.12));
        }
        if plan.hides("gauge_offset") {
            plant.offset = size("offset [m]", r.either_sign(0.06, 0.15));
        }
        if plan.hides("seepage") {
            plant.seepage = size("rate [lpm/m]", r.between(4.0, 10.0)) / 600.0;
        }
        if plan.hides("rain") {
            plant.rain = size("flow [lpm]", r.between(5.0, 12.0)) / 60.0;
            plant.rain_from = 60.0 * size("since [min]", r.between(35.0, 80.0));
        }
        if plan.hides("slow_valve") {
            plant.lag = size("tau [s]", r.between(40.0, 120.0));
        }
        if plan.hides("loose_linkage") {
            plant.play = 0.01 * size("play [%]", r.between(2.0, 6.0));
        }
        if plan.hides("drifting_gauge") {
            plant.drift = size("drift [m/h]", r.either_sign(0.03, 0.07));
        }
        if plan.hides("fouling") {
            plant.fouled = size("lost [1]", r.between(0.2, 0.4));
            plant.fouling_time = 60.0 * size("tau [min]", r.between(20.0, 60.0));
        }
        if plan.hides("flap") {
            plant.flap = 0.1 * size("slope [1/m]", r.between(0.2, 0.5));
        }
        (plant, sizes)
    }

    /// Depth of so much water in the upper tank, whose cross-section is A(1 + c h).
    fn upper_level(&self, volume: f64) -> f64 {
        let (a, c) = (self.area[0], self.cone);
        if c == 0.0 {
            return volume / a;
        }
        // a (h + c h²/2) = V
        ((1.0 + 2.0 * c * volume / a).sqrt() - 1.0) / c
    }

    fn upper_volume(&self, h: f64) -> f64 {
        self.area[0] * (h + 0.5 * self.cone * h * h)
    }

    fn levels(&self, y: &State) -> [f64; 2] {
        [self.upper_level(y[0]), y[1] / self.area[1]]
    }

    fn valve_area(&self, t: f64) -> f64 {
        let fouled = if self.fouled > 0.0 { 1.0 - (-t / self.fouling_time).exp() } else { 0.0 };
        self.valve * (1.0 - self.fouled * fouled)
    }

    fn passage_area(&self, t: f64, h: f64) -> f64 {
        let clog = if t > self.clog_from { self.clog } else { 0.0 };
        self.passage * (1.0 - clog) * (1.0 + self.flap * (h - 10.0))
    }

    /// Flow through the valve, l/s.
    fn outflow(&self, t: f64, y: &State) -> f64 {
        self.valve_area(t) * y[2].powf(self.exponent) * jet(self.levels(y)[1])
    }

    fn slope(&self, t: f64, y: &State, pumped: f64, opening: f64) -> State {
        let [h, low] = self.levels(y);
        let pumped = pumped * self.gain * (1.0 - self.wear * t);
        let between = self.passage_area(t, h) * jet(h) + self.pipe * jet(h - self.pipe_height);
        let lost = self.hole[0] * jet(h) + self.seepage * h;
        let rain = if t > self.rain_from { self.rain } else { 0.0 };
        [
            pumped * (1.0 - self.bypass) - between - lost,
            pumped * self.bypass + between + rain - self.outflow(t, y) - self.hole[1] * jet(low),
            if self.lag > 0.0 { (opening - y[2]) / self.lag } else { 0.0 },
        ]
    }
}

/// Speed of a jet below so much water, dm/s.
fn jet(depth: f64) -> f64 {
    (2.0 * G * depth.max(0.0)).sqrt()
}

fn record(plan: &Plan) -> Recording {
    let (plant, sizes) = Plant::drawn(plan);
    let mut r = plan.excitation();
    let q_in = if plan.is_train() {
        ramps(&mut r, ROWS, [50.0, 135.0], [40, 120], 12)
    } else {
        ramps(&mut r, ROWS, [55.0, 130.0], [25, 90], 5)
    };
    let opening = steps(&mut r, ROWS, [45.0, 95.0], [30, 110]);
    let (pump, valve) = (Signal::linear(INTERVAL, &q_in), Signal::held(INTERVAL, &opening));
    let mut y = [
        plant.upper_volume(r.between(6.0, 12.0)),
        plant.area[1] * r.between(6.0, 12.0),
        opening[0] / 100.0,
    ];
    let (mut h_1, mut h_2, mut q_2, mut trace) = (vec![], vec![], vec![], vec![]);
    for k in 0..ROWS {
        let t = k as f64 * INTERVAL;
        let opened = valve.at(t) / 100.0;
        if plant.lag == 0.0 && plant.play == 0.0 {
            y[2] = opened;
        }
        let [high, low] = plant.levels(&y);
        h_1.push(0.1 * high + plant.drift * t / 3600.0);
        h_2.push(0.1 * low + plant.offset);
        q_2.push(60.0 * plant.outflow(t, &y));
        if plan.hides("fouling") {
            trace.push(100.0 * plant.valve_area(t));
        }
        if plan.hides("flap") {
            trace.push(100.0 * plant.passage_area(t, high));
        }
        if plant.play > 0.0 {
            // Within its play the valve stays where it is; it is not there yet when the reading is taken.
            y[2] = y[2].clamp(opened - plant.play, opened + plant.play);
        }
        rk4(&mut y, t, INTERVAL, 20, |t, y| plant.slope(t, y, pump.at(t) / 60.0, opened));
    }
    Recording {
        time_unit: "s",
        times: (0..ROWS).map(|k| k as f64 * INTERVAL).collect(),
        columns: vec![
            Column::input("q_in", "lpm", q_in),
            Column::input("opening", "%", opening),
            Column::output("h_1", "m", 0.005, h_1),
            Column::output("h_2", "m", 0.005, h_2),
            Column::output("q_2", "lpm", 1.0, q_2),
        ],
        trace,
        sizes,
    }
}
