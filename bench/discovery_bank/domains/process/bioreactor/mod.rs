//! A chemostat for four days, at ten samples an hour: cells, sugar, and a product.

use crate::bank::integrate::rk4;
use crate::bank::signal::{Signal, steps, waves};
use crate::bank::{Column, Domain, Hidden, Plan, Recording, Truth};

pub(crate) static DOMAIN: Domain = Domain {
    name: "bioreactor",
    model: include_str!("model.dgd"),
    effects: &[
        ("contois", include_str!("effects/contois.dgd")),
        ("decay", include_str!("effects/decay.dgd")),
        ("growth_lag", include_str!("effects/growth_lag.dgd")),
        ("haldane", include_str!("effects/haldane.dgd")),
        ("maintenance", include_str!("effects/maintenance.dgd")),
        ("overflow_metabolism", include_str!("effects/overflow_metabolism.dgd")),
        ("product_inhibition", include_str!("effects/product_inhibition.dgd")),
        ("tessier", include_str!("effects/tessier.dgd")),
        ("wall_growth", include_str!("effects/wall_growth.dgd")),
    ],
    hidden: HIDDEN,
    record,
};

const HIDDEN: &[Hidden] = &[
    Hidden::library("haldane"),
    Hidden::library("contois"),
    Hidden::library("maintenance+product_inhibition"),
    Hidden::library("overflow_metabolism"),
    Hidden::library("maintenance"),
    Hidden::library("growth_lag"),
    Hidden::library("product_inhibition"),
    Hidden::library("decay"),
    Hidden::library("haldane+decay"),
    Hidden::library("wall_growth"),
    Hidden {
        name: "slow_analyser",
        truth: Truth::Template(&["sensor_lag(S)"]),
        effect: "effect truth on bioreactor\nkind sensor\n\
            parameter tau [h] = 0.5 in 0.02 .. 10, log\nstate S_read [g/l] = 1\n\
            equation analyser: tau*der(S_read) = S - S_read\nreplace output S by S_read\n",
    },
    Hidden {
        name: "dying_cells",
        truth: Truth::Template(&["leak(X, biomass)"]),
        effect: "effect truth on bioreactor\nkind plant\n\
            parameter rate [1/h] = 0\nnull rate = 0\nadd -rate*X to biomass\n",
    },
    Hidden {
        name: "feed_strength",
        // If K_s and Y are scaled as well, a stronger feed and an analyser that reads too much give the same
        // equations.
        truth: Truth::Template(&["input_gain(S_f)", "sensor_gain(S)"]),
        effect: "effect truth on bioreactor\nkind input\n\
            parameter gain [1] = 1 in 0.2 .. 5\nnull gain = 1\nreplace S_f by gain*S_f\n",
    },
    Hidden {
        name: "infection",
        truth: Truth::Template(&["parameter_step(mu_max)"]),
        effect: "effect truth on bioreactor\nkind plant\n\
            parameter step [1] = -0.1 in -0.9 .. 5\nparameter since [h] = 45 in 0 .., nominal 2\n\
            replace mu_max by mu_max*(1 + (if time > since then step else 0))\n",
    },
    Hidden {
        name: "broth_temperature",
        truth: Truth::Parameter {
            name: "mu_max",
            places: &[],
            law: "mu_max over the broth's temperature is a bell with its top at 33 °C",
        },
        effect: "effect truth on bioreactor\nkind plant\n\
            parameter best [°C] = 33 in 20 .. 45\nparameter width [K] = 5 in 1 .. 50, log\n\
            replace mu_max by mu_max*exp(-((T_b - best)/width)^2)\n",
    },
    Hidden {
        name: "tired_cells",
        truth: Truth::Parameter {
            name: "alpha",
            places: &[],
            law: "alpha falls with time from one level to a lower one, along an S",
        },
        effect: "effect truth on bioreactor\nkind plant\n\
            parameter fall [1] = 0.2 in -1 .. 0.95\nparameter half [h] = 45 in 0 .. 200\n\
            parameter width [h] = 8 in 1 .. 100, log\n\
            replace alpha by alpha*(1 - fall*0.5*(1 + tanh((time - half)/width)))\n",
    },
];

const INTERVAL: f64 = 0.1; // h

/// The plant in g, l and h; sizes of effects that are not hidden stay zero.
#[derive(Debug, Clone, Copy, Default)]
struct Plant {
    mu_max: f64,
    k_s: f64,
    yield_of_cells: f64,
    alpha: f64,
    beta: f64,
    inhibition: f64,
    crowding: f64,
    maintenance: f64,
    death: f64,
    toxicity: f64,
    wall: f64,
    growth_lag: f64,
    waste: f64,
    analyser_lag: f64,
    feed_gain: f64,
    step: f64,
    step_at: f64,
    bell_width: f64,
    fall: f64,
    fall_at: f64,
    fall_width: f64,
}

/// Cells, sugar, product, the growth rate that cells are ready for, and the analyser's reading.
type State = [f64; 5];

/// Inputs at one moment.
#[derive(Debug, Clone, Copy)]
struct Feed {
    dilution: f64,
    sugar: f64,
    temperature: f64,
}

impl Plant {
    fn drawn(plan: &Plan) -> (Plant, Vec<(&'static str, f64)>) {
        let mut r = plan.sizes();
        let mut plant = Plant {
            mu_max: r.off(0.45),
            k_s: r.off(0.6),
            yield_of_cells: r.off(0.5),
            alpha: r.off(1.2),
            beta: r.off(0.06),
            feed_gain: 1.0,
            ..Plant::default()
        };
        let mut sizes = Vec::new();
        let mut size = |name: &'static str, value: f64| {
            sizes.push((name, value));
            value
        };
        if plan.hides("haldane") {
            plant.inhibition = size("inhibition [l/g]", r.between(0.05, 0.12));
        }
        if plan.hides("contois") {
            plant.crowding = size("crowding [1]", r.between(0.1, 0.3));
        }
        if plan.hides("maintenance") {
            plant.maintenance = size("m_s [1/h]", r.between(0.02, 0.05));
        }
        if plan.hides("decay") {
            plant.death = size("k_d [1/h]", r.between(0.01, 0.025));
        }
        if plan.hides("product_inhibition") {
            plant.toxicity = size("toxicity [l/g]", r.between(0.02, 0.04));
        }
        if plan.hides("wall_growth") {
            plant.wall = size("X_wall [g/l]", r.between(0.25, 0.6));
        }
        if plan.hides("growth_lag") {
            plant.growth_lag = size("tau_growth [h]", r.between(0.3, 1.0));
        }
        if plan.hides("overflow_metabolism") {
            plant.waste = size("waste [l/g]", r.between(0.04, 0.12));
        }
        if plan.hides("slow_analyser") {
            plant.analyser_lag = size("tau [h]", r.between(0.3, 0.8));
        }
        if plan.hides("dying_cells") {
            plant.death = size("rate [1/h]", r.between(0.01, 0.025));
        }
        if plan.hides("feed_strength") {
            plant.feed_gain = size("gain [1]", 1.0 + r.either_sign(0.08, 0.18));
        }
        if plan.hides("infection") {
            plant.step = size("step [1]", -r.between(0.08, 0.2));
            plant.step_at = size("since [h]", r.between(30.0, 55.0));
        }
        if plan.hides("broth_temperature") {
            plant.bell_width = size("width [K]", r.between(6.0, 10.0));
        }
        if plan.hides("tired_cells") {
            plant.fall = size("fall [1]", r.between(0.15, 0.35));
            plant.fall_at = size("half [h]", r.between(30.0, 50.0));
            plant.fall_width = size("width [h]", r.between(5.0, 15.0));
        }
        (plant, sizes)
    }

    fn mu_max(&self, t: f64, temperature: f64) -> f64 {
        let stepped = if t > self.step_at { 1.0 + self.step } else { 1.0 };
        let bell = if self.bell_width > 0.0 {
            (-((temperature - 33.0) / self.bell_width).powi(2)).exp()
        } else {
            1.0
        };
        self.mu_max * stepped * bell
    }

    fn alpha(&self, t: f64) -> f64 {
        if self.fall == 0.0 {
            return self.alpha;
        }
        let fallen = 0.5 * (1.0 + ((t - self.fall_at) / self.fall_width).tanh());
        self.alpha * (1.0 - self.fall * fallen)
    }

    fn slope(&self, t: f64, y: &State, feed: &Feed) -> State {
        let [cells, sugar, product, ready, read] = *y;
        let half = self.k_s + self.crowding * cells + self.inhibition * sugar * sugar;
        let wanted = self.mu_max(t, feed.temperature) * sugar / (half + sugar);
        let wanted = wanted * (1.0 - self.toxicity * product);
        let growth = if self.growth_lag > 0.0 { ready } else { wanted };
        let growing = cells + self.wall;
        let eaten = growth * growing * (1.0 + self.waste * sugar) / self.yield_of_cells;
        let made = (self.alpha(t) * growth + self.beta) * growing;
        [
            growth * growing - (feed.dilution + self.death) * cells,
            feed.dilution * (self.feed_gain * feed.sugar - sugar)
                - eaten
                - self.maintenance * cells,
            made - feed.dilution * product,
            if self.growth_lag > 0.0 { (wanted - ready) / self.growth_lag } else { 0.0 },
            if self.analyser_lag > 0.0 { (sugar - read) / self.analyser_lag } else { 0.0 },
        ]
    }
}

fn record(plan: &Plan) -> Recording {
    let (plant, sizes) = Plant::drawn(plan);
    let rows = if plan.is_train() { 901 } else { 701 };
    let mut r = plan.excitation();
    // The operator knows how fast the cells can grow, and stays away from washing them out.
    let dilutions = [0.12 * plant.mu_max, 0.8 * plant.mu_max];
    let lengths = if plan.is_train() { [25, 80] } else { [20, 70] };
    let dilution = steps(&mut r, rows, dilutions, lengths);
    let sugar = steps(&mut r, rows, [4.0, 14.0], [50, 130]);
    let temperature = waves(&mut r, rows, [28.0, 35.0], &[310.0, 97.0]);
    let warmth = Signal::linear(INTERVAL, &temperature);
    // It begins as a batch: few cells and much sugar.
    let mut y = [r.between(0.8, 1.6), r.between(7.0, 11.0), r.between(0.3, 1.0), dilution[0], 0.0];
    y[4] = y[1];
    let (mut x, mut s, mut p, mut trace) = (vec![], vec![], vec![], vec![]);
    for k in 0..rows {
        let t = k as f64 * INTERVAL;
        x.push(y[0]);
        s.push(if plant.analyser_lag > 0.0 { y[4] } else { y[1] });
        p.push(y[2]);
        if plan.hides("broth_temperature") {
            trace.push(plant.mu_max(t, temperature[k]));
        }
        if plan.hides("tired_cells") {
            trace.push(plant.alpha(t));
        }
        let (dilution, sugar) = (dilution[k], sugar[k]);
        rk4(&mut y, t, INTERVAL, 20, |t, y| {
            plant.slope(t, y, &Feed { dilution, sugar, temperature: warmth.at(t) })
        });
    }
    Recording {
        time_unit: "h",
        times: (0..rows).map(|k| k as f64 * INTERVAL).collect(),
        columns: vec![
            Column::input("D", "1/h", dilution),
            Column::input("S_f", "g/l", sugar),
            Column::input("T_b", "°C", temperature),
            Column::output("X", "g/l", 0.02, x),
            Column::output("S", "g/l", 0.02, s),
            Column::output("P", "g/l", 0.04, p),
        ],
        trace,
        sizes,
    }
}
