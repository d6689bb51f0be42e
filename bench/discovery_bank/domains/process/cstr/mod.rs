//! A stirred reactor with a cooling jacket for seven hours, at two samples a minute.

use crate::bank::integrate::rk4;
use crate::bank::signal::{Signal, steps, waves};
use crate::bank::{Column, Domain, Hidden, Plan, Recording, Truth};

pub(crate) static DOMAIN: Domain = Domain {
    name: "cstr",
    model: include_str!("model.dgd"),
    effects: &[
        ("catalyst_decay", include_str!("effects/catalyst_decay.dgd")),
        ("coolant_film", include_str!("effects/coolant_film.dgd")),
        ("heat_loss", include_str!("effects/heat_loss.dgd")),
        ("jacket_scale", include_str!("effects/jacket_scale.dgd")),
        ("product_inhibition", include_str!("effects/product_inhibition.dgd")),
        ("reaction_order", include_str!("effects/reaction_order.dgd")),
        ("reverse_reaction", include_str!("effects/reverse_reaction.dgd")),
        ("short_circuit", include_str!("effects/short_circuit.dgd")),
        ("side_reaction", include_str!("effects/side_reaction.dgd")),
        ("stirrer_heat", include_str!("effects/stirrer_heat.dgd")),
    ],
    hidden: HIDDEN,
    record,
};

const HIDDEN: &[Hidden] = &[
    Hidden::library("reaction_order"),
    Hidden::library("short_circuit"),
    Hidden::library("catalyst_decay+heat_loss"),
    Hidden::library("side_reaction"),
    Hidden::library("coolant_film"),
    Hidden::library("reverse_reaction"),
    Hidden::library("jacket_scale"),
    Hidden::library("heat_loss"),
    Hidden::library("coolant_film+side_reaction"),
    Hidden::library("catalyst_decay"),
    Hidden::library("product_inhibition"),
    Hidden::library("stirrer_heat"),
    Hidden {
        name: "thermowell",
        truth: Truth::Template(&["sensor_lag(T)"]),
        effect: "effect truth on cstr\nkind sensor\n\
            parameter tau [min] = 1 in 0.05 .. 30, log\nstate T_read [°C] = 55\n\
            equation well: tau*der(T_read) = T - T_read\nreplace output T by T_read\n",
    },
    Hidden {
        name: "poisoning",
        truth: Truth::Template(&["parameter_step(k_ref)"]),
        effect: "effect truth on cstr\nkind plant\n\
            parameter step [1] = -0.1 in -0.9 .. 5\nparameter since [min] = 200 in 0 .., nominal 5\n\
            replace k_ref by k_ref*(1 + (if time > since then step else 0))\n",
    },
    Hidden {
        name: "analyser_gain",
        // If the heat of reaction is scaled as well, an analyser that reads too much and a stronger feed give the
        // same equations.
        truth: Truth::Template(&["sensor_gain(c)", "input_gain(c_in)"]),
        effect: "effect truth on cstr\nkind sensor\n\
            parameter gain [1] = 1 in 0.2 .. 5\nnull gain = 1\nreplace output c by gain*c\n",
    },
    Hidden {
        name: "warm_pipe",
        truth: Truth::Template(&["input_offset(T_c)"]),
        effect: "effect truth on cstr\nkind input\n\
            parameter offset [K] = 0\nnull offset = 0\nreplace T_c by T_c + offset\n",
    },
    Hidden {
        name: "turbulence",
        truth: Truth::Parameter {
            name: "UA",
            places: &[],
            law: "UA grows with q_c and saturates: a film in series with a wall",
        },
        effect: "effect truth on cstr\nkind plant\n\
            parameter film [1] = 0.5 in 0.01 .. 50, log\n\
            replace UA by UA/(1 + film/(q_c/10 [lpm])^0.8)\n",
    },
    Hidden {
        name: "sintering",
        truth: Truth::Parameter {
            name: "k_ref",
            places: &[],
            law: "k_ref falls with time as 1/(1 + t/t_half)",
        },
        effect: "effect truth on cstr\nkind plant\n\
            parameter half [h] = 20 in 0.5 .. 1000, log\n\
            replace k_ref by k_ref/(1 + time/half)\n",
    },
];

const INTERVAL: f64 = 0.5; // min
const RHO_CP: f64 = 4.18; // kJ/(l K)
const JACKET: f64 = 25.0; // l
const ZERO: f64 = 273.15; // K
const HALL: f64 = 20.0; // °C

/// The plant in l, mol, kJ, min and °C; sizes of effects that are not hidden stay zero.
#[derive(Debug, Clone, Copy, Default)]
struct Plant {
    volume: f64,
    k_ref: f64,
    activation: f64,
    heat: f64,
    transfer: f64,
    order: f64,
    back: f64,
    adsorption: f64,
    side: f64,
    decay: f64,
    loss: f64,
    stirrer: f64,
    film: f64,
    scale: f64,
    short: f64,
    well: f64,
    step: f64,
    step_at: f64,
    analyser_gain: f64,
    coolant_offset: f64,
    series_film: f64,
    half: f64,
}

/// Concentrations of A and B, temperatures of tank, jacket and thermowell.
type State = [f64; 5];

/// Inputs at one moment.
#[derive(Debug, Clone, Copy)]
struct Inputs {
    feed: f64,
    strength: f64,
    feed_temperature: f64,
    coolant: f64,
    coolant_temperature: f64,
}

impl Plant {
    fn drawn(plan: &Plan) -> (Plant, Vec<(&'static str, f64)>) {
        let mut r = plan.sizes();
        let mut plant = Plant {
            volume: r.off(100.0),
            k_ref: r.off(0.1),
            activation: r.off(8000.0),
            heat: r.off(100.0),
            transfer: 60.0 * r.off(0.7),
            order: 1.0,
            analyser_gain: 1.0,
            ..Plant::default()
        };
        let mut sizes = Vec::new();
        let mut size = |name: &'static str, value: f64| {
            sizes.push((name, value));
            value
        };
        if plan.hides("reaction_order") {
            plant.order = size("order [1]", 1.0 + r.either_sign(0.2, 0.45));
        }
        if plan.hides("reverse_reaction") {
            plant.back = size("k_back [1/min]", r.between(0.02, 0.05));
        }
        if plan.hides("product_inhibition") {
            plant.adsorption = size("K_B [l/mol]", r.between(0.8, 2.0));
        }
        if plan.hides("side_reaction") {
            plant.side = size("k_side [l/(mol*min)]", r.between(0.01, 0.03));
        }
        if plan.hides("catalyst_decay") {
            plant.decay = size("k_d [1/h]", r.between(0.02, 0.06)) / 60.0;
        }
        if plan.hides("heat_loss") {
            plant.loss = 0.06 * size("loss [W/K]", r.between(70.0, 160.0));
        }
        if plan.hides("stirrer_heat") {
            plant.stirrer = 60.0 * size("power [kW]", r.between(1.5, 3.5));
        }
        if plan.hides("coolant_film") {
            plant.film = size("film [1]", r.between(0.2, 0.45));
        }
        if plan.hides("jacket_scale") {
            plant.scale = size("scale [1/h]", r.between(0.02, 0.06)) / 60.0;
        }
        if plan.hides("short_circuit") {
            plant.short = size("share [1]", r.between(0.08, 0.18));
        }
        if plan.hides("thermowell") {
            plant.well = size("tau [min]", r.between(1.0, 3.0));
        }
        if plan.hides("poisoning") {
            plant.step = size("step [1]", -r.between(0.1, 0.2));
            plant.step_at = size("since [min]", r.between(140.0, 260.0));
        }
        if plan.hides("analyser_gain") {
            plant.analyser_gain = size("gain [1]", 1.0 + r.either_sign(0.05, 0.12));
        }
        if plan.hides("warm_pipe") {
            plant.coolant_offset = size("offset [K]", r.either_sign(1.0, 3.0));
        }
        if plan.hides("turbulence") {
            plant.series_film = size("film [1]", r.between(0.5, 1.2));
        }
        if plan.hides("sintering") {
            plant.half = 60.0 * size("half [h]", r.between(12.0, 30.0));
        }
        (plant, sizes)
    }

    fn k_ref(&self, t: f64) -> f64 {
        let step = if t > self.step_at { 1.0 + self.step } else { 1.0 };
        let sintered = if self.half > 0.0 { 1.0 + t / self.half } else { 1.0 };
        self.k_ref * step * (-self.decay * t).exp() / sintered
    }

    /// Heat transfer to the jacket, kJ/(min K).
    fn transfer(&self, t: f64, coolant: f64) -> f64 {
        let flow = coolant / 10.0;
        let series = if self.series_film > 0.0 { self.series_film / flow.powf(0.8) } else { 0.0 };
        self.transfer * flow.powf(self.film) / (1.0 + self.scale * t) / (1.0 + series)
    }

    fn slope(&self, t: f64, y: &State, u: &Inputs) -> State {
        let [a, b, tank, jacket, well] = *y;
        let arrhenius = (self.activation * (1.0 / 330.0 - 1.0 / (tank + ZERO))).exp();
        let forward = self.k_ref(t) * arrhenius * a.powf(self.order);
        let rate = forward / (1.0 + self.adsorption * b) - self.back * b;
        let feed = (1.0 - self.short) * u.feed;
        let exchanged = self.transfer(t, u.coolant) * (tank - jacket);
        let coolant = u.coolant_temperature + self.coolant_offset;
        let heat = RHO_CP * feed * (u.feed_temperature - tank) + self.heat * self.volume * rate
            - exchanged
            - self.loss * (tank - HALL)
            + self.stirrer;
        [
            feed / self.volume * (u.strength - a) - rate - self.side * a * a,
            rate - feed / self.volume * b,
            heat / (RHO_CP * self.volume),
            (RHO_CP * u.coolant * (coolant - jacket) + exchanged) / (RHO_CP * JACKET),
            if self.well > 0.0 { (tank - well) / self.well } else { 0.0 },
        ]
    }
}

fn record(plan: &Plan) -> Recording {
    let (plant, sizes) = Plant::drawn(plan);
    let rows = if plan.is_train() { 841 } else { 601 };
    let mut r = plan.excitation();
    let lengths = if plan.is_train() { [30, 110] } else { [20, 80] };
    let feed = steps(&mut r, rows, [7.0, 15.0], lengths);
    let strength = steps(&mut r, rows, [0.8, 2.4], lengths);
    let feed_temperature = waves(&mut r, rows, [35.0, 50.0], &[260.0, 97.0]);
    let coolant = steps(&mut r, rows, [5.0, 20.0], lengths);
    let coolant_temperature = waves(&mut r, rows, [12.0, 22.0], &[330.0, 71.0]);
    let warm = Signal::linear(INTERVAL, &feed_temperature);
    let cold = Signal::linear(INTERVAL, &coolant_temperature);
    let a = r.between(0.8, 1.2);
    let tank = r.between(45.0, 60.0);
    let mut y = [a, strength[0] - a, tank, r.between(30.0, 40.0), tank];
    let (mut c, mut hot, mut jacket, mut trace) = (vec![], vec![], vec![], vec![]);
    for k in 0..rows {
        let t = k as f64 * INTERVAL;
        let outlet = (1.0 - plant.short) * y[0] + plant.short * strength[k];
        c.push(plant.analyser_gain * outlet);
        hot.push(if plant.well > 0.0 { y[4] } else { y[2] });
        jacket.push(y[3]);
        if plan.hides("turbulence") {
            trace.push(plant.transfer(t, coolant[k]) / 60.0);
        }
        if plan.hides("sintering") {
            trace.push(plant.k_ref(t));
        }
        let (feed, strength, coolant) = (feed[k], strength[k], coolant[k]);
        rk4(&mut y, t, INTERVAL, 10, |t, y| {
            let (feed_temperature, coolant_temperature) = (warm.at(t), cold.at(t));
            let inputs = Inputs { feed, strength, feed_temperature, coolant, coolant_temperature };
            plant.slope(t, y, &inputs)
        });
    }
    Recording {
        time_unit: "min",
        times: (0..rows).map(|k| k as f64 * INTERVAL).collect(),
        columns: vec![
            Column::input("q", "lpm", feed),
            Column::input("c_in", "mol/l", strength),
            Column::input("T_in", "°C", feed_temperature),
            Column::input("q_c", "lpm", coolant),
            Column::input("T_c", "°C", coolant_temperature),
            Column::output("c", "mol/l", 0.006, c),
            Column::output("T", "°C", 0.1, hot),
            Column::output("T_j", "°C", 0.1, jacket),
        ],
        trace,
        sizes,
    }
}
