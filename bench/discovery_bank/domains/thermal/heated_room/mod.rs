//! A room under a controller, a reading every five minutes for four days.
//!
//! The simulator keeps heat, in kWh, and counts in hours and kW. The controller acts on what the thermometer shows, and
//! the record has the power that it asked for.

use std::f64::consts::TAU;

use crate::bank::integrate::rk4;
use crate::bank::random::Random;
use crate::bank::signal::{Signal, four_digits, ramps, waves};
use crate::bank::{Column, Domain, Hidden, Plan, Recording, Truth};

pub(crate) static DOMAIN: Domain = Domain {
    name: "heated_room",
    model: include_str!("model.dgd"),
    effects: &[
        ("cellar_loss", include_str!("effects/cellar_loss.dgd")),
        ("damp_walls", include_str!("effects/damp_walls.dgd")),
        ("heated_walls", include_str!("effects/heated_walls.dgd")),
        ("internal_gain", include_str!("effects/internal_gain.dgd")),
        ("open_window", include_str!("effects/open_window.dgd")),
        ("radiator_lag", include_str!("effects/radiator_lag.dgd")),
        ("sunny_walls", include_str!("effects/sunny_walls.dgd")),
        ("thermometer_pocket", include_str!("effects/thermometer_pocket.dgd")),
        ("wind_infiltration", include_str!("effects/wind_infiltration.dgd")),
    ],
    hidden: HIDDEN,
    record,
};

const HIDDEN: &[Hidden] = &[
    Hidden::library("open_window"),
    Hidden::library("radiator_lag"),
    Hidden::library("wind_infiltration"),
    Hidden::library("cellar_loss"),
    Hidden::library("thermometer_pocket"),
    Hidden::library("internal_gain"),
    Hidden::library("heated_walls"),
    Hidden::library("sunny_walls"),
    Hidden::library("damp_walls"),
    Hidden::library("open_window+radiator_lag"),
    Hidden {
        name: "slow_radiator",
        truth: Truth::Template(&["input_lag(P)"]),
        effect: "effect truth on heated_room\nkind plant\n\
            parameter t_radiator [min] = 15 in 1 .. 300, log\nstate follows [kW] = P nominal 2, fixed\n\
            equation lag: t_radiator*der(follows) = P - follows\nreplace P by follows\n",
    },
    Hidden {
        name: "stove",
        truth: Truth::Template(&["unmeasured_flow(air)"]),
        effect: "effect truth on heated_room\nkind plant\n\
            parameter flow [kW] = 0.1\nparameter since [h] = 48 in 0 .., nominal 5\nnull flow = 0\n\
            add if time > since then flow else 0 to air\n",
    },
    Hidden {
        name: "wrong_wall_probe",
        truth: Truth::Template(&["sensor_offset(T_w)"]),
        effect: "effect truth on heated_room\nkind sensor\n\
            parameter offset [K] = 0\nnull offset = 0\nreplace output T_w by T_w + offset\n",
    },
    Hidden {
        name: "new_window",
        truth: Truth::Template(&["parameter_step(U_ao)"]),
        effect: "effect truth on heated_room\nkind plant\n\
            parameter opened [1] = 0.2\nparameter t_open [h] = 48 in 0 .., nominal 5\nnull opened = 0\n\
            replace U_ao by U_ao*(1 + (if time > t_open then opened else 0))\n",
    },
    Hidden {
        name: "weak_heater",
        truth: Truth::Template(&["input_saturation(P)"]),
        effect: "effect truth on heated_room\nkind input\n\
            parameter top [kW] = 4 in 0.5 .. 20\nreplace P by min(P, top)\n",
    },
    Hidden {
        name: "neighbour",
        truth: Truth::Template(&["periodic_disturbance(air)"]),
        effect: "effect truth on heated_room\nkind plant\n\
            parameter size_s [kW] = 0.1\nparameter size_c [kW] = 0.1\n\
            parameter period [h] = 6 in 1 .. 50, log\n\
            add size_s*sin(2*pi*time/period) + size_c*cos(2*pi*time/period) to air\n",
    },
    Hidden {
        name: "draughty",
        truth: Truth::Parameter {
            name: "U_ao",
            places: &["air"],
            law: "U_ao grows with wind, in a straight line",
        },
        effect: "effect truth on heated_room\nkind plant\n\
            parameter leaks [J/(K*m)] = 5 in 0 .. 200\nreplace U_ao by U_ao + leaks*wind\n",
    },
    Hidden {
        name: "settling_insulation",
        truth: Truth::Parameter {
            name: "U_wo",
            places: &["walls"],
            law: "U_wo grows with time, ever more slowly, towards a last value",
        },
        effect: "effect truth on heated_room\nkind plant\n\
            parameter grown [1] = 0.3 in 0 .. 5\nparameter tau [h] = 30 in 2 .. 300, log\n\
            replace U_wo by U_wo*(1 + grown*(1 - exp(-time/tau)))\n",
    },
];

/// Interval of the rows, h.
const INTERVAL: f64 = 1.0 / 12.0;
const ROWS: usize = 1153;

/// The plant in kWh, kW, K and h, with sizes of what is hidden; those that are not hidden are zero.
#[derive(Debug, Clone, Copy, Default)]
struct Plant {
    air: f64,
    walls: f64,
    inside: f64,
    outside: f64,
    window: f64,
    area: f64,
    opened: f64,
    opens: f64,
    leaks: f64,
    gain: f64,
    cellar: f64,
    radiator: f64,
    share: f64,
    wall_area: f64,
    damp: f64,
    thermometer: f64,
    stove: f64,
    lit: f64,
    probe: f64,
    top: f64,
    neighbour: [f64; 3],
    grown: f64,
    growing: f64,
}

/// Heat in the air and in the walls, kWh above 0 °C; the radiator's power, kW; what the thermometer shows, °C.
type State = [f64; 4];

/// The weather: temperature, °C, sun, W/m², wind, m/s.
#[derive(Debug, Clone)]
struct Weather {
    outside: Signal,
    sun: Signal,
    wind: Signal,
}

impl Plant {
    fn drawn(plan: &Plan) -> (Plant, Vec<(&'static str, f64)>) {
        let mut r = plan.sizes();
        let mut plant = Plant {
            air: r.off(700.0) / 3600.0,
            walls: r.off(10.0) / 3.6,
            inside: r.off(0.35),
            outside: r.off(0.1),
            window: r.off(0.05),
            area: r.off(2.0),
            top: f64::INFINITY,
            ..Plant::default()
        };
        let mut sizes = Vec::new();
        let mut size = |name: &'static str, value: f64| {
            sizes.push((name, value));
            value
        };
        if plan.hides("open_window") || plan.hides("new_window") {
            plant.opened = size("opened [1]", r.between(0.3, 0.8));
            plant.opens = size("t_open [h]", r.between(28.0, 68.0));
        }
        if plan.hides("wind_infiltration") || plan.hides("draughty") {
            plant.leaks = 1e-3 * size("leaks [J/(K*m)]", r.between(4.0, 10.0));
        }
        if plan.hides("internal_gain") {
            plant.gain = 1e-3 * size("gain [W]", r.between(150.0, 350.0));
        }
        if plan.hides("cellar_loss") {
            plant.cellar = 1e-3 * size("cellar [W/K]", r.between(35.0, 70.0));
        }
        if plan.hides("radiator_lag") || plan.hides("slow_radiator") {
            plant.radiator = size("t_radiator [min]", r.between(10.0, 25.0)) / 60.0;
        }
        if plan.hides("heated_walls") {
            plant.share = size("share [1]", r.between(0.2, 0.45));
        }
        if plan.hides("sunny_walls") {
            plant.wall_area = size("A_wall [m^2]", r.between(0.8, 2.0));
        }
        if plan.hides("damp_walls") {
            plant.damp = size("damp [1/d]", r.between(0.08, 0.2)) / 24.0;
        }
        if plan.hides("thermometer_pocket") {
            plant.thermometer = size("t_box [min]", r.between(6.0, 15.0)) / 60.0;
        }
        if plan.hides("stove") {
            plant.stove = size("flow [kW]", r.between(0.1, 0.25));
            plant.lit = size("since [h]", r.between(28.0, 68.0));
        }
        if plan.hides("wrong_wall_probe") {
            plant.probe = size("offset [K]", r.either_sign(0.8, 2.0));
        }
        if plan.hides("weak_heater") {
            plant.top = size("top [kW]", r.between(2.9, 3.6));
        }
        if plan.hides("neighbour") {
            plant.neighbour = [
                size("size_s [kW]", r.either_sign(0.1, 0.2)),
                size("size_c [kW]", r.either_sign(0.1, 0.2)),
                size("period [h]", r.between(4.0, 9.0)),
            ];
        }
        if plan.hides("settling_insulation") {
            plant.grown = size("grown [1]", r.between(0.3, 0.7));
            plant.growing = size("tau [h]", r.between(15.0, 40.0));
        }
        (plant, sizes)
    }

    /// From air to outside, kW/K.
    fn window(&self, t: f64, wind: f64) -> f64 {
        let opened = if t > self.opens { self.opened } else { 0.0 };
        self.window * (1.0 + opened) + self.leaks * wind
    }

    /// From walls to outside, kW/K.
    fn outside(&self, t: f64) -> f64 {
        let grown = if self.grown > 0.0 { 1.0 - (-t / self.growing).exp() } else { 0.0 };
        self.outside * (1.0 + self.grown * grown) * (1.0 + self.damp * t)
    }

    fn slope(&self, t: f64, y: &State, power: f64, weather: &Weather) -> State {
        let (air, walls) = (y[0] / self.air, y[1] / self.walls);
        let (out, sun) = (weather.outside.at(t), weather.sun.at(t) / 1000.0);
        let power = power.min(self.top);
        let heat = if self.radiator > 0.0 { y[2] } else { power };
        let [sine, cosine, period] = self.neighbour;
        let angle = if period > 0.0 { TAU * t / period } else { 0.0 };
        let neighbour = sine * angle.sin() + cosine * angle.cos();
        let stove = if t > self.lit { self.stove } else { 0.0 };
        let inside = self.inside * (air - walls);
        let gains = (1.0 - self.share) * heat + self.area * sun + self.gain + stove + neighbour;
        let window = self.window(t, weather.wind.at(t)) * (air - out);
        [
            gains - inside - window - self.cellar * (air - 10.0),
            inside + self.share * heat + self.wall_area * sun - self.outside(t) * (walls - out),
            if self.radiator > 0.0 { (power - y[2]) / self.radiator } else { 0.0 },
            if self.thermometer > 0.0 { (air - y[3]) / self.thermometer } else { 0.0 },
        ]
    }
}

/// Sun on the window through four days with clouds, W/m².
fn sunshine(r: &mut Random) -> Vec<f64> {
    let clouds = ramps(r, ROWS, [0.15, 1.0], [8, 60], 6);
    let bright = |(k, clear): (usize, &f64)| {
        let hour = (k as f64 * INTERVAL).rem_euclid(24.0);
        four_digits(550.0 * clear * (TAU * (hour - 6.0) / 24.0).sin().max(0.0))
    };
    clouds.iter().enumerate().map(bright).collect()
}

fn record(plan: &Plan) -> Recording {
    let (plant, sizes) = Plant::drawn(plan);
    let mut r = plan.excitation();
    let days = if plan.is_train() { [288.0, 701.0, 173.0] } else { [288.0, 533.0, 211.0] };
    let outside = waves(&mut r, ROWS, [-6.0, 9.0], &days);
    let sun = sunshine(&mut r);
    let wind = ramps(&mut r, ROWS, [0.5, 9.0], [20, 90], 15);
    let weather = Weather {
        outside: Signal::linear(INTERVAL, &outside),
        sun: Signal::linear(INTERVAL, &sun),
        wind: Signal::linear(INTERVAL, &wind),
    };
    let (air, walls) = (r.between(16.0, 20.0), r.between(13.0, 17.0));
    let mut y = [air * plant.air, walls * plant.walls, 0.0, air];
    let wanted = ramps(&mut r, ROWS, [16.0, 23.0], [50, 150], 1);
    let (mut t_air, mut t_walls, mut power, mut trace) = (vec![], vec![], vec![], vec![]);
    let mut sum = 2.0;
    for (k, wanted) in wanted.iter().enumerate() {
        let t = k as f64 * INTERVAL;
        let shown = if plant.thermometer > 0.0 { y[3] } else { y[0] / plant.air };
        t_air.push(shown);
        t_walls.push(y[1] / plant.walls + plant.probe);
        if plan.hides("draughty") {
            trace.push(1e3 * plant.window(t, wind[k]));
        }
        if plan.hides("settling_insulation") {
            trace.push(1e3 * plant.outside(t));
        }
        let off = wanted - shown;
        let asked = sum + 1.2 * off;
        let given = four_digits(asked.clamp(0.0, 5.0));
        // It does not add up what the heater cannot give.
        if (asked - given).abs() < 0.01 {
            sum += 0.5 * off * INTERVAL;
        }
        if k == 0 {
            y[2] = given;
        }
        power.push(given);
        rk4(&mut y, t, INTERVAL, 20, |t, y| plant.slope(t, y, given, &weather));
    }
    Recording {
        time_unit: "min",
        times: (0..ROWS).map(|k| 5.0 * k as f64).collect(),
        columns: vec![
            Column::input("P", "kW", power),
            Column::input("T_out", "°C", outside),
            Column::input("sun", "W/m^2", sun),
            Column::input("wind", "m/s", wind),
            Column::output("T", "°C", 0.05, t_air),
            Column::output("T_w", "°C", 0.05, t_walls),
        ],
        trace,
        sizes,
    }
}
