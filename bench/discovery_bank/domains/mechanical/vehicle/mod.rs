//! A car that is driven over hills for six minutes, at two samples a second.
//!
//! The driver follows a speed, so that the inputs depend on what is hidden: they are recorded as they were.

use crate::bank::integrate::rk4;
use crate::bank::signal::{Signal, four_digits, steps, waves};
use crate::bank::{Column, Domain, Hidden, Plan, Recording, Truth};

pub(crate) static DOMAIN: Domain = Domain {
    name: "vehicle",
    model: include_str!("model.dgd"),
    effects: &[
        ("brake_fade", include_str!("effects/brake_fade.dgd")),
        ("brake_over_speed", include_str!("effects/brake_over_speed.dgd")),
        ("cold_tyres", include_str!("effects/cold_tyres.dgd")),
        ("drive_lag", include_str!("effects/drive_lag.dgd")),
        ("driveline_loss", include_str!("effects/driveline_loss.dgd")),
        ("engine_braking", include_str!("effects/engine_braking.dgd")),
        ("headwind", include_str!("effects/headwind.dgd")),
        ("power_limit", include_str!("effects/power_limit.dgd")),
        ("rolling_over_speed", include_str!("effects/rolling_over_speed.dgd")),
        ("rotating_mass", include_str!("effects/rotating_mass.dgd")),
    ],
    hidden: HIDDEN,
    record,
};

const HIDDEN: &[Hidden] = &[
    Hidden::library("headwind"),
    Hidden::library("brake_fade"),
    Hidden::library("power_limit+driveline_loss"),
    Hidden::library("rolling_over_speed"),
    Hidden::library("rotating_mass"),
    Hidden::library("engine_braking"),
    Hidden::library("brake_over_speed"),
    Hidden::library("cold_tyres"),
    Hidden::library("brake_fade+headwind"),
    Hidden::library("drive_lag"),
    Hidden::library("driveline_loss"),
    Hidden::library("power_limit"),
    Hidden {
        name: "pedal_play",
        truth: Truth::Template(&["dead_band(p_brake)"]),
        effect: "effect truth on vehicle\nkind input\n\
            parameter band [bar] = 1 in 0 .. 20\nreplace p_brake by max(p_brake - band, 0)\n",
    },
    Hidden {
        name: "slow_motor",
        truth: Truth::Template(&["input_lag(F_drive)"]),
        effect: "effect truth on vehicle\nkind plant\n\
            parameter tau [s] = 0.5 in 0.02 .. 20, log\nstate F_now [kN] = F_drive fixed\n\
            equation lag: tau*der(F_now) = F_drive - F_now\nreplace F_drive by F_now\n",
    },
    Hidden {
        name: "wrong_slope",
        // With another rolling resistance, an accelerometer that is off gives the same equations, and so does a
        // constant force that it does not feel.
        truth: Truth::Template(&[
            "input_offset(slope)",
            "sensor_offset(a)",
            "unmeasured_flow(motion)",
        ]),
        effect: "effect truth on vehicle\nkind input\n\
            parameter offset [%] = 0\nnull offset = 0\nreplace slope by slope + offset\n",
    },
    Hidden {
        name: "filtered_speed",
        truth: Truth::Template(&["sensor_lag(v)"]),
        effect: "effect truth on vehicle\nkind sensor\n\
            parameter tau [s] = 0.5 in 0.02 .. 20, log\nstate v_read [km/h] = 55\n\
            equation filter: tau*der(v_read) = v - v_read\nreplace output v by v_read\n",
    },
    Hidden {
        name: "filling_tank",
        truth: Truth::Parameter {
            name: "m",
            places: &[],
            law: "m grows with time, ever more slowly, towards a last value",
        },
        effect: "effect truth on vehicle\nkind plant\n\
            parameter load [1] = 0.2 in 0 .. 5\nparameter tau [s] = 100 in 5 .. 2000, log\n\
            replace m by m*(1 + load*(1 - exp(-time/tau)))\n",
    },
    Hidden {
        name: "glazed_pads",
        truth: Truth::Parameter {
            name: "k_b",
            // Only the product with the pressure matters.
            places: &["p_brake"],
            law: "k_b falls with v, along an S about 60 km/h",
        },
        effect: "effect truth on vehicle\nkind plant\n\
            parameter fall [1] = 0.2 in 0 .. 0.95\nparameter half [km/h] = 60 in 10 .. 130\n\
            parameter width [km/h] = 15 in 2 .. 100, log\n\
            replace k_b by k_b*(1 - fall/2*(1 + tanh((v - half)/width)))\n",
    },
];

const INTERVAL: f64 = 0.5; // s
const GRAVITY: f64 = 9.81;
const AIR: f64 = 1.2; // kg/m³
const KMH: f64 = 1.0 / 3.6;

/// The plant in SI units and bar; sizes of effects that are not hidden stay zero.
#[derive(Debug, Clone, Copy, Default)]
struct Plant {
    mass: f64,
    rolling: f64,
    drag_area: f64,
    brakes: f64,
    wind: f64,
    wind_from: f64,
    fade: f64,
    cooling_time: f64,
    fall_over_speed: f64,
    drive_lag: f64,
    power: f64,
    viscous: f64,
    standing_wave: f64,
    spinning: f64,
    engine_drag: f64,
    cold: f64,
    warming_time: f64,
    play: f64,
    slope_offset: f64,
    filter: f64,
    load: f64,
    loading_time: f64,
    glazed: f64,
    glazed_at: f64,
    glazed_width: f64,
}

/// Speed, force of the motor, heat in the brakes, speed as it is shown.
type State = [f64; 4];

/// What the driver does, N and bar, and the road.
#[derive(Debug, Clone, Copy)]
struct Inputs {
    force: f64,
    pressure: f64,
    slope: f64,
}

impl Plant {
    fn drawn(plan: &Plan) -> (Plant, Vec<(&'static str, f64)>) {
        let mut r = plan.sizes();
        let mut plant = Plant {
            mass: r.off(1500.0),
            rolling: r.off(0.012),
            drag_area: r.off(0.7),
            brakes: r.off(120.0),
            ..Plant::default()
        };
        let mut sizes = Vec::new();
        let mut size = |name: &'static str, value: f64| {
            sizes.push((name, value));
            value
        };
        if plan.hides("headwind") {
            plant.wind = KMH * size("wind [km/h]", r.between(4.0, 10.0));
            plant.wind_from = size("t_wind [s]", r.between(100.0, 220.0));
        }
        if plan.hides("brake_fade") {
            plant.fade = 1e-6 * size("fade [1/MJ]", r.between(0.5, 1.5));
            plant.cooling_time = size("tau_cool [s]", r.between(40.0, 120.0));
        }
        if plan.hides("brake_over_speed") {
            plant.fall_over_speed = size("fall [h/km]", r.between(0.003, 0.008)) / KMH;
        }
        if plan.hides("drive_lag") {
            plant.drive_lag = size("tau_drive [s]", r.between(0.4, 1.2));
        }
        if plan.hides("power_limit") {
            plant.power = 1e3 * size("P_max [kW]", r.between(56.0, 72.0));
        }
        if plan.hides("driveline_loss") {
            plant.viscous = size("viscous [N*h/km]", r.between(1.5, 4.0)) / KMH;
        }
        if plan.hides("rolling_over_speed") {
            plant.standing_wave = size("standing_wave [1]", r.between(0.8, 2.0));
        }
        if plan.hides("rotating_mass") {
            plant.spinning = size("spinning [1]", r.between(0.03, 0.09));
        }
        if plan.hides("engine_braking") {
            plant.engine_drag = size("drag [N]", r.between(120.0, 350.0));
        }
        if plan.hides("cold_tyres") {
            plant.cold = size("cold [1]", r.between(0.25, 0.7));
            plant.warming_time = size("tau_warm [s]", r.between(50.0, 150.0));
        }
        if plan.hides("pedal_play") {
            plant.play = size("band [bar]", r.between(0.8, 2.5));
        }
        if plan.hides("slow_motor") {
            plant.drive_lag = size("tau [s]", r.between(0.4, 1.2));
        }
        if plan.hides("wrong_slope") {
            plant.slope_offset = 0.01 * size("offset [%]", r.either_sign(0.5, 1.2));
        }
        if plan.hides("filtered_speed") {
            plant.filter = size("tau [s]", r.between(0.4, 1.2));
        }
        if plan.hides("filling_tank") {
            plant.load = size("load [1]", r.between(0.1, 0.3));
            plant.loading_time = size("tau [s]", r.between(60.0, 150.0));
        }
        if plan.hides("glazed_pads") {
            plant.glazed = size("fall [1]", r.between(0.15, 0.4));
            plant.glazed_at = KMH * size("half [km/h]", r.between(50.0, 70.0));
            plant.glazed_width = KMH * size("width [km/h]", r.between(8.0, 20.0));
        }
        (plant, sizes)
    }

    fn mass(&self, t: f64) -> f64 {
        let filled = if self.load > 0.0 { 1.0 - (-t / self.loading_time).exp() } else { 0.0 };
        self.mass * (1.0 + self.load * filled)
    }

    /// Newtons of braking for each bar, with cold discs.
    fn brakes(&self, v: f64) -> f64 {
        let glazed = if self.glazed > 0.0 {
            0.5 * (1.0 + ((v - self.glazed_at) / self.glazed_width).tanh())
        } else {
            0.0
        };
        self.brakes * (1.0 - self.glazed * glazed) / (1.0 + self.fall_over_speed * v)
    }

    fn braking(&self, y: &State, pressure: f64) -> f64 {
        (pressure - self.play).max(0.0) * self.brakes(y[0]) / (1.0 + self.fade * y[2])
    }

    /// What an accelerometer along the road feels, m/s²: all but the weight.
    fn felt(&self, t: f64, y: &State, u: &Inputs) -> f64 {
        let v = y[0];
        let mass = self.mass(t);
        let demanded = if self.drive_lag > 0.0 { y[1] } else { u.force };
        let limit = if self.power > 0.0 { self.power / v } else { f64::INFINITY };
        let engine = if u.force <= 0.0 { self.engine_drag } else { 0.0 };
        let driven = demanded.min(limit) - engine - self.viscous * v;
        let cold = if self.cold > 0.0 { self.cold * (-t / self.warming_time).exp() } else { 0.0 };
        let fast = self.standing_wave * (v * 3.6 / 100.0).powi(4);
        let rolling = self.rolling * mass * GRAVITY * (1.0 + cold + fast);
        let through_air = v + if t > self.wind_from { self.wind } else { 0.0 };
        let air = 0.5 * AIR * self.drag_area * through_air * through_air.abs();
        let force = driven - self.braking(y, u.pressure) - rolling - air;
        // Part of the mass only spins, and does not weigh: m (1 + s) a = F − m g sin.
        let weight = GRAVITY * (u.slope + self.slope_offset);
        (force / mass - weight) / (1.0 + self.spinning) + weight
    }

    fn slope(&self, t: f64, y: &State, u: &Inputs) -> State {
        let weight = GRAVITY * (u.slope + self.slope_offset);
        let cooling = if self.fade > 0.0 { y[2] / self.cooling_time } else { 0.0 };
        [
            self.felt(t, y, u) - weight,
            if self.drive_lag > 0.0 { (u.force - y[1]) / self.drive_lag } else { 0.0 },
            self.braking(y, u.pressure) * y[0] - cooling,
            if self.filter > 0.0 { (y[0] - y[3]) / self.filter } else { 0.0 },
        ]
    }

    /// Force and pressure of a driver who wants another speed: kN and bar, as they are recorded.
    fn driver(&self, wanted: f64, v: f64, slope: f64) -> [f64; 2] {
        let error = wanted - v;
        let hold =
            self.mass * GRAVITY * (slope + self.rolling) + 0.5 * AIR * self.drag_area * v * v;
        let force = (1e-3 * (hold + 0.45 * self.mass * error)).clamp(0.0, 3.5);
        let pressure = if error < -0.5 { (-2.2 * error).clamp(1.0, 25.0) } else { 0.0 };
        let force = if pressure > 0.0 { 0.0 } else { force };
        [four_digits(force), four_digits(pressure)]
    }
}

fn record(plan: &Plan) -> Recording {
    let (plant, sizes) = Plant::drawn(plan);
    let rows = if plan.is_train() { 721 } else { 601 };
    let mut r = plan.excitation();
    let lengths = if plan.is_train() { [25, 70] } else { [15, 60] };
    let wanted = steps(&mut r, rows, [25.0, 110.0], lengths);
    let slope = waves(&mut r, rows, [-4.0, 4.0], &[210.0, 67.0]);
    let road = Signal::linear(INTERVAL, &slope);
    let speed = KMH * r.between(45.0, 65.0);
    let mut y = [speed, 0.0, 0.0, speed];
    let (mut force, mut pressure) = (vec![], vec![]);
    let (mut v, mut a, mut trace) = (vec![], vec![], vec![]);
    for k in 0..rows {
        let t = k as f64 * INTERVAL;
        // The driver looks at the traffic twice in three seconds.
        if k % 3 == 0 {
            let [drive, brake] = plant.driver(KMH * wanted[k], y[0], 0.01 * slope[k]);
            force.push(drive);
            pressure.push(brake);
        } else {
            force.push(force[k - 1]);
            pressure.push(pressure[k - 1]);
        }
        let (drive, brake) = (1e3 * force[k], pressure[k]);
        if k == 0 {
            y[1] = drive;
        }
        let inputs = |t: f64| Inputs { force: drive, pressure: brake, slope: 0.01 * road.at(t) };
        v.push(if plant.filter > 0.0 { y[3] } else { y[0] } / KMH);
        a.push(plant.felt(t, &y, &inputs(t)));
        if plan.hides("filling_tank") {
            trace.push(plant.mass(t));
        }
        if plan.hides("glazed_pads") {
            trace.push(1e-3 * plant.brakes(y[0]));
        }
        rk4(&mut y, t, INTERVAL, 10, |t, y| plant.slope(t, y, &inputs(t)));
    }
    Recording {
        time_unit: "s",
        times: (0..rows).map(|k| k as f64 * INTERVAL).collect(),
        columns: vec![
            Column::input("F_drive", "kN", force),
            Column::input("p_brake", "bar", pressure),
            Column::input("slope", "%", slope),
            Column::output("v", "km/h", 0.1, v),
            Column::output("a", "m/s^2", 0.04, a),
        ],
        trace,
        sizes,
    }
}
