//! A meeting room and the corridor next to it for three days, at a sample every five minutes.
//!
//! The simulator keeps litres of carbon dioxide, where the model keeps concentrations.

use crate::bank::integrate::rk4;
use crate::bank::random::Random;
use crate::bank::signal::{Signal, steps, waves};
use crate::bank::{Column, Domain, Hidden, Plan, Recording, Truth};

pub(crate) static DOMAIN: Domain = Domain {
    name: "co2_zones",
    model: include_str!("model.dgd"),
    effects: &[
        ("daily_rhythm", include_str!("effects/daily_rhythm.dgd")),
        ("damper_lag", include_str!("effects/damper_lag.dgd")),
        ("dead_corner", include_str!("effects/dead_corner.dgd")),
        ("door_traffic", include_str!("effects/door_traffic.dgd")),
        ("fan_slip", include_str!("effects/fan_slip.dgd")),
        ("people_in_corridor", include_str!("effects/people_in_corridor.dgd")),
        ("recirculation", include_str!("effects/recirculation.dgd")),
        ("window_ajar", include_str!("effects/window_ajar.dgd")),
        ("windy_leaks", include_str!("effects/windy_leaks.dgd")),
    ],
    hidden: HIDDEN,
    record,
};

const HIDDEN: &[Hidden] = &[
    Hidden::library("windy_leaks"),
    Hidden::library("recirculation"),
    Hidden::library("window_ajar+people_in_corridor"),
    Hidden::library("door_traffic"),
    Hidden::library("fan_slip"),
    Hidden::library("damper_lag"),
    Hidden::library("daily_rhythm"),
    Hidden::library("recirculation+windy_leaks"),
    Hidden::library("window_ajar"),
    Hidden::library("people_in_corridor"),
    Hidden {
        name: "slow_sensor",
        truth: Truth::Template(&["sensor_lag(c_1)"]),
        effect: "effect truth on co2_zones\nkind sensor\n\
            parameter tau [min] = 10 in 0.5 .. 200, log\nstate c_read [ppm] = 450\n\
            equation membrane: tau*der(c_read) = c_1 - c_read\nreplace output c_1 by c_read\n",
    },
    Hidden {
        name: "gas_boiler",
        truth: Truth::Template(&["unmeasured_flow(corridor)"]),
        effect: "effect truth on co2_zones\nkind plant\n\
            parameter flow [l/h] = 5\nparameter since [h] = 36 in 0 .., nominal 1\nnull flow = 0\n\
            add if time > since then flow else 0 to corridor\n",
    },
    Hidden {
        name: "ageing_sensor",
        truth: Truth::Template(&["sensor_drift(c_2)"]),
        effect: "effect truth on co2_zones\nkind sensor\n\
            parameter drift [ppm/d] = 0\nnull drift = 0\nreplace output c_2 by c_2 + drift*time\n",
    },
    Hidden {
        name: "outdoor_meter",
        truth: Truth::Template(&["input_offset(c_out)"]),
        effect: "effect truth on co2_zones\nkind input\n\
            parameter offset [ppm] = 0\nnull offset = 0\nreplace c_out by c_out + offset\n",
    },
    Hidden {
        name: "draughty_room",
        truth: Truth::Parameter {
            name: "q_inf",
            places: &[],
            law: "q_inf grows with the power 1.5 of the wind, from a value in still air",
        },
        effect: "effect truth on co2_zones\nkind plant\n\
            parameter gusty [1] = 0.5 in 0 .. 50\n\
            replace q_inf by q_inf*(1 + gusty*(wind/4 [m/s])^1.5)\n",
    },
    Hidden {
        name: "wedged_door",
        truth: Truth::Parameter {
            name: "q_x",
            places: &[],
            law: "q_x is larger by a factor during the same hours of each day",
        },
        effect: "effect truth on co2_zones\nkind plant\n\
            parameter wider [1] = 1 in 0 .. 20\n\
            parameter wedged [h] = 10 in 4 .. 14, nominal 1\nparameter closed [h] = 16 in 14 .. 23, nominal 1\n\
            let hour = if time > 48 [h] then time - 48 [h] else (if time > 24 [h] then time - 24 [h] else time)\n\
            replace q_x by q_x*(1 + (if hour > wedged and hour <= closed then wider else 0))\n",
    },
];

const INTERVAL: f64 = 1.0 / 12.0; // h

/// The plant in m³, l and h; sizes of effects that are not hidden stay zero.
#[derive(Debug, Clone, Copy, Default)]
struct Plant {
    volumes: [f64; 2],
    breath: f64,
    leaks: f64,
    door: f64,
    fresh: f64,
    gusty: f64,
    taken: f64,
    window: f64,
    window_from: f64,
    outside: f64,
    damper_lag: f64,
    traffic: f64,
    power: f64,
    rhythm: f64,
    sensor_lag: f64,
    boiler: f64,
    boiler_from: f64,
    drift: f64,
    outdoor_offset: f64,
    gusts: f64,
    wider: f64,
    wedged: f64,
    closed: f64,
}

/// Litres of carbon dioxide in room and corridor, supply flow, and what the room's sensor shows in ppm.
type State = [f64; 4];

/// Inputs at one moment.
#[derive(Debug, Clone, Copy)]
struct Inputs {
    people: f64,
    supply: f64,
    outdoors: f64,
    wind: f64,
}

impl Plant {
    fn drawn(plan: &Plan) -> (Plant, Vec<(&'static str, f64)>) {
        let mut r = plan.sizes();
        let mut plant = Plant {
            volumes: [r.off(80.0), r.off(150.0)],
            breath: r.off(18.0),
            leaks: r.off(30.0),
            door: r.off(60.0),
            fresh: r.off(90.0),
            power: 1.0,
            ..Plant::default()
        };
        let mut sizes = Vec::new();
        let mut size = |name: &'static str, value: f64| {
            sizes.push((name, value));
            value
        };
        if plan.hides("windy_leaks") {
            plant.gusty = size("gusty [s/m]", r.between(0.15, 0.4));
        }
        if plan.hides("recirculation") {
            plant.taken = size("taken [1]", r.between(0.3, 0.7));
        }
        if plan.hides("window_ajar") {
            plant.window = size("q_window [m^3/h]", r.between(20.0, 60.0));
            plant.window_from = size("t_open [h]", r.between(32.0, 41.0));
        }
        if plan.hides("people_in_corridor") {
            plant.outside = size("outside [1]", r.between(0.06, 0.2));
        }
        if plan.hides("damper_lag") {
            plant.damper_lag = size("tau_damper [min]", r.between(12.0, 35.0)) / 60.0;
        }
        if plan.hides("door_traffic") {
            plant.traffic = size("traffic [1]", r.between(0.2, 0.5));
        }
        if plan.hides("fan_slip") {
            plant.power = size("power [1]", 1.0 + r.either_sign(0.25, 0.45));
        }
        if plan.hides("daily_rhythm") {
            plant.rhythm = size("rhythm [1]", r.between(0.12, 0.3));
        }
        if plan.hides("slow_sensor") {
            plant.sensor_lag = size("tau [min]", r.between(8.0, 20.0)) / 60.0;
        }
        if plan.hides("gas_boiler") {
            plant.boiler = size("flow [l/h]", r.between(4.0, 10.0));
            plant.boiler_from = size("since [h]", r.between(32.0, 41.0));
        }
        if plan.hides("ageing_sensor") {
            plant.drift = size("drift [ppm/d]", r.either_sign(12.0, 30.0)) / 24.0;
        }
        if plan.hides("outdoor_meter") {
            plant.outdoor_offset = size("offset [ppm]", r.either_sign(20.0, 50.0));
        }
        if plan.hides("draughty_room") {
            plant.gusts = size("gusty [1]", r.between(0.6, 1.6));
        }
        if plan.hides("wedged_door") {
            plant.wider = size("wider [1]", r.between(0.8, 2.0));
            plant.wedged = size("wedged [h]", r.between(9.0, 11.0));
            plant.closed = size("closed [h]", r.between(15.0, 18.0));
        }
        (plant, sizes)
    }

    fn leaks(&self, t: f64, wind: f64) -> f64 {
        let window = if t > self.window_from { self.window } else { 0.0 };
        self.leaks * (1.0 + self.gusty * wind) * (1.0 + self.gusts * (wind / 4.0).powf(1.5))
            + window
    }

    fn door(&self, t: f64, people: f64) -> f64 {
        let hour = t.rem_euclid(24.0);
        let is_wedged = hour > self.wedged && hour <= self.closed;
        self.door * (1.0 + self.traffic * people) * if is_wedged { 1.0 + self.wider } else { 1.0 }
    }

    /// Concentrations in room and corridor, ppm.
    fn concentrations(&self, y: &State) -> [f64; 2] {
        [1e3 * y[0] / self.volumes[0], 1e3 * y[1] / self.volumes[1]]
    }

    fn slope(&self, t: f64, y: &State, u: &Inputs) -> State {
        let [room, corridor] = self.concentrations(y);
        let outdoors = u.outdoors + self.outdoor_offset;
        let supply = if self.damper_lag > 0.0 { y[2] } else { u.supply };
        let supply = supply * (supply / 150.0).powf(self.power - 1.0);
        let day = self.rhythm * (std::f64::consts::TAU * t / 24.0).cos();
        let breath = self.breath * (1.0 - day) * u.people;
        // A cubic metre with one ppm is a thousandth of a litre.
        let blown = 1e-3 * supply * (outdoors + self.taken * (corridor - outdoors) - room);
        let leaked = 1e-3 * self.leaks(t, u.wind) * (outdoors - room);
        let exchanged = 1e-3 * self.door(t, u.people) * (room - corridor);
        let boiler = if t > self.boiler_from { self.boiler } else { 0.0 };
        [
            (1.0 - self.outside) * breath + blown + leaked - exchanged,
            self.outside * breath + exchanged + 1e-3 * self.fresh * (outdoors - corridor) + boiler,
            if self.damper_lag > 0.0 { (u.supply - y[2]) / self.damper_lag } else { 0.0 },
            if self.sensor_lag > 0.0 { (room - y[3]) / self.sensor_lag } else { 0.0 },
        ]
    }
}

/// Meetings of half an hour to two and a half hours between 8 and 19 h, with pauses.
fn people(r: &mut Random, rows: usize) -> Vec<f64> {
    let mut values: Vec<f64> = Vec::with_capacity(rows);
    while values.len() < rows {
        let hour = (values.len() as f64 * INTERVAL).rem_euclid(24.0);
        let is_day = (8.0..19.0).contains(&hour);
        let number = if is_day && r.chance(0.75) { r.whole(2, 9) } else { 0 };
        let length = r.whole(6, 30).min(rows - values.len());
        values.resize(values.len() + length, number as f64);
    }
    values
}

fn record(plan: &Plan) -> Recording {
    let (plant, sizes) = Plant::drawn(plan);
    let rows = if plan.is_train() { 865 } else { 721 };
    let mut r = plan.excitation();
    let people = people(&mut r, rows);
    let lengths = if plan.is_train() { [15, 60] } else { [12, 48] };
    let supply = steps(&mut r, rows, [40.0, 260.0], lengths);
    let outdoors = waves(&mut r, rows, [405.0, 450.0], &[288.0, 110.0]);
    let wind = waves(&mut r, rows, [0.0, 9.0], &[190.0, 57.0]);
    let (outdoors_now, wind_now) =
        (Signal::linear(INTERVAL, &outdoors), Signal::linear(INTERVAL, &wind));
    let (start, corridor) = (r.between(430.0, 520.0), r.between(430.0, 480.0));
    let mut y =
        [1e-3 * start * plant.volumes[0], 1e-3 * corridor * plant.volumes[1], supply[0], start];
    let (mut c_1, mut c_2, mut trace) = (vec![], vec![], vec![]);
    for k in 0..rows {
        let t = k as f64 * INTERVAL;
        let [room, corridor] = plant.concentrations(&y);
        c_1.push(if plant.sensor_lag > 0.0 { y[3] } else { room });
        c_2.push(corridor + plant.drift * t);
        if plan.hides("draughty_room") {
            trace.push(plant.leaks(t, wind[k]));
        }
        if plan.hides("wedged_door") {
            trace.push(plant.door(t, people[k]));
        }
        let (people, supply) = (people[k], supply[k]);
        rk4(&mut y, t, INTERVAL, 10, |t, y| {
            let (outdoors, wind) = (outdoors_now.at(t), wind_now.at(t));
            plant.slope(t, y, &Inputs { people, supply, outdoors, wind })
        });
    }
    Recording {
        time_unit: "min",
        times: (0..rows).map(|k| k as f64 * 5.0).collect(),
        columns: vec![
            Column::input("n", "1", people),
            Column::input("q_v", "m^3/h", supply),
            Column::input("c_out", "ppm", outdoors),
            Column::input("wind", "m/s", wind),
            Column::output("c_1", "ppm", 3.0, c_1),
            Column::output("c_2", "ppm", 3.0, c_2),
        ],
        trace,
        sizes,
    }
}
