//! Effects of each kind for which there is a template, or a law, are found without a library: name and value.

use std::f64::consts::TAU;

use dgd_discover::{Discovery, PlainKind, Verdict};

use crate::examined::{Samples, Texts};
use crate::random::Random;

/// How an input moves.
#[derive(Debug, Clone, Copy)]
enum Moves {
    /// Steps between two values, each for so many samples; it holds between samples.
    Steps(f64, f64, usize),
    /// Waves about a mean, of a size, with periods in samples; it is linear between samples.
    Waves(f64, f64, [f64; 2]),
}

/// What acts at every so many samples: on states, with inputs.
type Tick = (usize, fn(&mut [f64], &[f64]));

/// An output: its name, its value for states and inputs, and the standard deviation of its noise.
type Seen<'a> = (&'a str, fn(&[f64], &[f64]) -> f64, f64);

/// A plant, integrated by Runge–Kutta steps that are far shorter than the samples.
struct Plant<'a> {
    inputs: &'a [(&'a str, Moves)],
    start: &'a [f64],
    /// Rates from time, inputs and states.
    rates: fn(f64, &[f64], &[f64]) -> Vec<f64>,
    tick: Option<Tick>,
    /// Each with its noise.
    outputs: &'a [Seen<'a>],
    interval: f64,
    samples: usize,
}

const STEPS: usize = 40;

impl Plant<'_> {
    fn record(&self, seed: u64) -> Samples {
        let mut random = Random::new(seed, 7);
        let n = self.samples;
        let inputs: Vec<Vec<f64>> =
            self.inputs.iter().map(|(_, moves)| moves.values(n, &mut random)).collect();
        let h = self.interval / STEPS as f64;
        let mut x = self.start.to_vec();
        let mut read = vec![Vec::new(); self.outputs.len()];
        for k in 0..n {
            let at = |share: f64| -> Vec<f64> {
                let next = (k + 1).min(n - 1);
                let both = self.inputs.iter().zip(&inputs);
                both.map(|((_, moves), u)| match moves {
                    Moves::Steps(..) => u[k],
                    Moves::Waves(..) => u[k] + share * (u[next] - u[k]),
                })
                .collect()
            };
            if let Some((every, act)) = self.tick.filter(|(every, _)| k % every == 0) {
                debug_assert!(every > 0);
                act(&mut x, &at(0.0));
            }
            for (read, (_, output, noise)) in read.iter_mut().zip(self.outputs) {
                read.push(output(&x, &at(0.0)) + noise * random.normal());
            }
            for step in 0..STEPS {
                let rate = |share: f64, x: &[f64]| {
                    let share = (step as f64 + share) / STEPS as f64;
                    (self.rates)((k as f64 + share) * self.interval, &at(share), x)
                };
                let moved = |part: f64, rates: &[f64]| -> Vec<f64> {
                    x.iter().zip(rates).map(|(x, rate)| x + part * h * rate).collect()
                };
                let a = rate(0.0, &x);
                let b = rate(0.5, &moved(0.5, &a));
                let c = rate(0.5, &moved(0.5, &b));
                let d = rate(1.0, &moved(1.0, &c));
                for i in 0..x.len() {
                    x[i] += h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]);
                }
            }
        }
        let names = self.inputs.iter().map(|(name, _)| *name);
        let names = names.chain(self.outputs.iter().map(|(name, ..)| *name));
        let columns = names.map(str::to_owned).zip(inputs.into_iter().chain(read)).collect();
        Samples { times: (0..n).map(|k| self.interval * k as f64).collect(), columns }
    }

    /// What is found with a model of it.
    fn found(&self, model: &str) -> Discovery {
        let texts = Texts { model: ("plant.dgd".to_owned(), model.to_owned()), effects: vec![] };
        let examined = texts.read();
        let [train, valid] =
            [1, 2].map(|seed| examined.recording_without_start(&self.record(seed)));
        examined.discover(&[train], &[valid], 1)
    }
}

impl Moves {
    fn values(self, n: usize, random: &mut Random) -> Vec<f64> {
        match self {
            Moves::Steps(low, high, hold) => {
                let steps: Vec<f64> = (0..=n / hold).map(|_| random.between(low, high)).collect();
                (0..n).map(|k| steps[k / hold]).collect()
            }
            Moves::Waves(mean, size, [shortest, longest]) => {
                let parts: Vec<[f64; 3]> = (0..4)
                    .map(|_| {
                        let share = random.between(0.2, 0.5);
                        let pace = TAU / random.between(shortest, longest);
                        [size * share, pace, random.between(0.0, 6.0)]
                    })
                    .collect();
                let at = |k: usize| {
                    parts.iter().map(|[a, pace, from]| a * (pace * k as f64 + from).sin()).sum()
                };
                (0..n).map(at).map(|wave: f64| mean + wave).collect()
            }
        }
    }
}

/// What remains of a quantity behind a dead band.
fn beyond(x: f64, band: f64) -> f64 {
    (x - band).max(0.0) + (x + band).min(0.0)
}

/// One effect is named, and the first of its parameters is right: within three standard deviations or two per cent.
#[track_caller]
fn is_named(found: &Discovery, name: &str, value: f64) {
    assert_eq!(found.verdict, Verdict::Effects, "{}\n{:#?}", found.reason, found.ranking);
    let names: Vec<&String> = found.effects.iter().map(|effect| &effect.name).collect();
    let [effect] = found.effects.as_slice() else { panic!("{names:?}: {}", found.reason) };
    assert_eq!(effect.name, name, "{}", found.reason);
    let own = effect.parameters.iter().find(|own| own.std.is_some()).expect("a value");
    let std = own.std.expect("the recordings determine it") / own.unit.factor.abs();
    let off = (own.unit.from_si(own.value) - value).abs();
    assert!(off < (3.0 * std).max(0.02 * value.abs()), "{own:?}, not {value}");
}

/// A law of one term is found, with this coefficient, SI.
#[track_caller]
fn is_law(found: &Discovery, target: &str, factor: &str, value: f64) {
    assert_eq!(found.verdict, Verdict::Law, "{}", found.reason);
    let terms = &found.law.as_ref().expect("a law").terms;
    let own = terms.iter().find(|term| term.target == target && term.formula.ends_with(factor));
    let own = own.unwrap_or_else(|| panic!("{terms:?}"));
    let coefficient = &own.coefficients[0];
    let std = coefficient.std.unwrap_or(0.0);
    let off = (coefficient.value - value).abs();
    assert!(off < (3.0 * std).max(0.02 * value.abs()), "{coefficient:?}, not {value}");
}

/// A room that is heated by up to 1.5 kW; outdoors it is about 5 °C.
const HEATED: [(&str, Moves); 2] =
    [("P", Moves::Steps(0.0, 1500.0, 20)), ("T_out", Moves::Waves(5.0, 8.0, [40.0, 300.0]))];

/// The same with the sun, and a heater that is moved smoothly.
const SUNNY: [(&str, Moves); 3] = [
    ("P", Moves::Waves(800.0, 700.0, [40.0, 120.0])),
    ("T_out", Moves::Waves(5.0, 8.0, [40.0, 300.0])),
    ("G", Moves::Waves(300.0, 200.0, [30.0, 200.0])),
];

const TEMPERATURE: Seen<'static> = ("T", |x, _| x[0], 0.05);

#[test]
fn a_recorded_quantity_that_the_model_does_not_use_acts_in_an_equation() {
    let plant = Plant {
        inputs: &SUNNY,
        start: &[20.0],
        rates: |_, u, x| vec![(u[0] + 1.7 * u[2] - 40.0 * (x[0] - u[1])) / 250e3],
        tick: None,
        outputs: &[TEMPERATURE],
        interval: 60.0,
        samples: 400,
    };
    let model = "model room
input P [W] linear
input T_out [degC] linear
input G [W/m^2] linear
parameter C [kJ/K] = 300 in 10 .. 10000, log
parameter H [W/K] = 30 in 1 .. 500, log
state T [degC] = 20
equation air: C*der(T) = P - H*(T - T_out)
output T [degC] noise 0.05 [K]
";
    is_law(&plant.found(model), "air", "G", 1.7);
}

/// A room that leaks into surroundings.
fn leaking() -> Plant<'static> {
    Plant {
        inputs: &HEATED,
        start: &[20.0],
        rates: |_, u, x| vec![(u[0] - 40.0 * (x[0] - u[1])) / 250e3],
        tick: None,
        outputs: &[TEMPERATURE],
        interval: 60.0,
        samples: 400,
    }
}

#[test]
fn a_store_leaks_into_recorded_surroundings_though_without_them_the_model_strays() {
    // Without a loss the fitted capacity is at its bound, from where no fit finds back.
    let model = "model room
input P [W] hold
input T_out [degC] linear
parameter C [kJ/K] = 300 in 10 .. 10000, log
state T [degC] = 20
equation air: C*der(T) = P
output T [degC] noise 0.05 [K]
";
    is_named(&leaking().found(model), "loss_to(T, air, T_out)", 40.0);
}

#[test]
fn so_does_one_in_hours_by_other_names_and_with_its_store_on_the_right() {
    let plant = leaking();
    let plant = Plant {
        inputs: &[("q", HEATED[0].1), ("sky", HEATED[1].1)],
        outputs: &[("theta", TEMPERATURE.1, TEMPERATURE.2)],
        ..plant
    };
    let model = "model store
input q [W] hold
input sky [degC] linear
parameter Z [kW*h/K] = 0.08 in 0.002 .. 3, log
state theta [degC] = 20
equation heat: q = Z*der(theta)
output theta [degC] noise 0.05 [K]
";
    is_named(&plant.found(model), "loss_to(theta, heat, sky)", 40.0);
}

#[test]
fn a_store_leaks_into_surroundings_at_a_level() {
    let plant = Plant { rates: |_, u, x| vec![(u[0] - 40.0 * (x[0] - 9.0)) / 250e3], ..leaking() };
    let model = "model room
input P [W] hold
input T_out [degC] linear
parameter C [kJ/K] = 300 in 10 .. 10000, log
state T [degC] = 20
equation air: C*der(T) = P
output T [degC] noise 0.05 [K]
";
    let found = plant.found(model);
    // A term with the state and a constant are the same.
    if found.verdict == Verdict::Law {
        is_law(&found, "air", " T", -40.0);
        is_law(&found, "air", "[W]", 40.0 * 282.15);
    } else {
        is_named(&found, "loss_to_level(T, air)", 40.0);
    }
}

/// Two masses and a shaft with play, smoothly driven.
const SHAFT: &str = "model shaft
input M [N*m] linear
parameter J_1 [kg*m^2] = 0.03 in 1e-4 .. 10, log
parameter J_2 [kg*m^2] = 0.05 in 1e-4 .. 10, log
parameter k [N*m/rad] = 4 in 0.1 .. 500, log
parameter d [N*m*s/rad] = 0.02 in 0 .. 5
parameter b [N*m*s/rad] = 0.1 in 0 .. 5
state w_1 [rad/s] = 0
state w_2 [rad/s] = 0
state phi [rad] = 0
let M_s = k*phi + d*(w_1 - w_2)
equation one: J_1*der(w_1) = M - M_s
equation two: J_2*der(w_2) = M_s - b*w_2
equation twist: der(phi) = w_1 - w_2 exact
output w_1 [rad/s] noise 0.02
output w_2 [rad/s] noise 0.02
";

fn shaft(rates: fn(f64, &[f64], &[f64]) -> Vec<f64>) -> Plant<'static> {
    Plant {
        inputs: &[("M", Moves::Waves(0.0, 2.0, [50.0, 300.0]))],
        start: &[0.0, 0.0, 0.0],
        rates,
        tick: None,
        outputs: &[("w_1", |x, _| x[0], 0.02), ("w_2", |x, _| x[1], 0.02)],
        interval: 0.02,
        samples: 400,
    }
}

/// Rates of the two masses with this torque between them.
fn masses(torque: f64, u: &[f64], x: &[f64]) -> Vec<f64> {
    vec![(u[0] - torque) / 0.035, (torque - 0.1 * x[1]) / 0.05, x[0] - x[1]]
}

#[test]
fn play_in_a_shaft_is_found() {
    let plant = shaft(|_, u, x| masses(5.0 * beyond(x[2], 0.15) + 0.02 * (x[0] - x[1]), u, x));
    is_named(&plant.found(SHAFT), "play(phi)", 0.15);
}

#[test]
fn play_in_a_coupling_that_only_pushes_is_found() {
    let plant = shaft(|_, u, x| {
        let (twist, torque) = (x[2], 5.0 * beyond(x[2], 0.15) + 0.05 * (x[0] - x[1]));
        let torque = match twist {
            twist if twist > 0.15 => torque.max(0.0),
            twist if twist < -0.15 => torque.min(0.0),
            _ => 0.0,
        };
        masses(torque, u, x)
    });
    is_named(&plant.found(SHAFT), "play(phi, M_s)", 0.15);
}

#[test]
fn the_dead_band_of_a_let_is_found() {
    let plant = Plant {
        inputs: &[("q_1", Moves::Steps(0.0, 1.0, 25)), ("q_2", Moves::Steps(0.0, 1.0, 35))],
        start: &[0.5, 0.5],
        rates: |_, u, x| {
            let q = 1.4 * beyond(x[0] - x[1], 0.12);
            vec![u[0] - q - 0.5 * x[0], u[1] + q - 0.5 * x[1]]
        },
        tick: None,
        outputs: &[("h_1", |x, _| x[0], 0.004), ("h_2", |x, _| x[1], 0.004)],
        interval: 0.2,
        samples: 500,
    };
    let model = "model tanks
input q_1 [m^3/s] hold
input q_2 [m^3/s] hold
constant A [m^2] = 1
parameter c [m^2/s] = 1 in 0.01 .. 100, log
parameter g [m^2/s] = 0.4 in 0.01 .. 100, log
state h_1 [m] = 0.5
state h_2 [m] = 0.5
let dh = h_1 - h_2
let q = c*dh
equation first: A*der(h_1) = q_1 - q - g*h_1
equation second: A*der(h_2) = q_2 + q - g*h_2
output h_1 [m] noise 0.004
output h_2 [m] noise 0.004
";
    is_named(&plant.found(model), "dead_band(dh)", 0.12);
}

#[test]
fn the_dead_band_of_a_state_is_found_and_its_sensor_reads_the_state() {
    // A current that a converter answers only beyond a threshold.
    let plant = Plant {
        inputs: &[("v", Moves::Waves(0.0, 3.0, [20.0, 150.0]))],
        start: &[0.0, 0.0],
        rates: |_, u, x| {
            let seen = beyond(x[0], 0.3);
            vec![(u[0] - 1.8 * seen) / 0.5, 2.0 * seen - 0.7 * x[1]]
        },
        tick: None,
        outputs: &[("i", |x, _| x[0], 0.01), ("y", |x, _| x[1], 0.01)],
        interval: 0.05,
        samples: 500,
    };
    let model = "model converter
input v [V] linear
parameter L [H] = 0.6 in 0.01 .. 100, log
parameter r [ohm] = 1.5 in 0.01 .. 100, log
parameter a [1/s] = 1.5 in 0.01 .. 100, log
parameter b [1/s] = 0.6 in 0.01 .. 100, log
state i [A] = 0
state y [A] = 0
equation mesh: L*der(i) = v - r*i
equation answer: der(y) = a*i - b*y
output i [A] noise 0.01
output y [A] noise 0.01
";
    is_named(&plant.found(model), "dead_band(i)", 0.3);
}

#[test]
fn an_actuator_that_is_stuck_from_a_moment_on_is_found() {
    let plant = Plant {
        inputs: &[("v", Moves::Steps(10.0, 90.0, 20))],
        start: &[1.0],
        rates: |t, u, x| {
            let v = if t > 3000.0 { 57.3 } else { u[0] };
            vec![(1e-4 * v - 6e-3 * x[0].max(1e-4).sqrt()) / 0.6]
        },
        tick: None,
        outputs: &[("h", |x, _| x[0], 0.003)],
        interval: 10.0,
        samples: 600,
    };
    let model = "model tank
input v [%] hold
parameter A [m^2] = 0.5 in 0.01 .. 10, log
parameter g [m^(5/2)/s] = 0.004 in 0.0001 .. 1, log
constant k [m^3/s] = 0.01
state h [m] = 1
equation level: A*der(h) = k*v - g*sqrt(max(h, 0.0001 [m]))
output h [m] noise 0.003
";
    is_named(&plant.found(model), "stuck(v)", 3000.0);
}

#[test]
fn a_leak_at_a_node_without_a_store_is_found() {
    let plant = Plant {
        inputs: &[
            ("q", Moves::Steps(0.0, 14.0, 25)),
            ("p_s", Moves::Waves(3.0, 1.5, [10.0, 200.0])),
        ],
        start: &[3.0],
        rates: |_, u, x| vec![(8.0 * (node(u, x) - 0.1 * x[0]) - u[0]) / 40.0],
        tick: None,
        outputs: &[("h", |x, _| x[0], 0.01), ("p", |x, u| node(u, x), 0.004)],
        interval: 1.0,
        samples: 500,
    };
    let model = "model network
input q [m^3/s] hold
input p_s [Pa] linear
constant k_1 [m^3/(s*Pa)] = 12
parameter k_2 [m^3/(s*Pa)] = 7 in 0.1 .. 1000, log
parameter A [m^2] = 50 in 0.1 .. 1000, log
constant w [Pa/m] = 0.1
state h [m] = 3
unknown p [Pa] = 1
equation node: k_1*(p_s - p) = k_2*(p - w*h)
equation store: A*der(h) = k_2*(p - w*h) - q
output h [m] noise 0.01
output p [Pa] noise 0.004
";
    is_law(&plant.found(model), "node", "p", 3.1);
}

/// The pressure of the node: 12 (p_s − p) = 8 (p − 0.1 h) + 3.1 p.
fn node(u: &[f64], x: &[f64]) -> f64 {
    (12.0 * u[1] + 0.8 * x[0]) / 23.1
}

const LOSING: &str = "model room
input P [W] linear
input T_out [degC] linear
input G [W/m^2] linear
parameter C [kJ/K] = 300 in 10 .. 10000, log
parameter H [W/K] = 30 in 1 .. 500, log
state T [degC] = 20
equation air: C*der(T) = P - H*(T - T_out)
output T [degC] noise 0.02 [K]
";

#[test]
fn an_input_that_is_read_now_and_then_and_held_is_found() {
    let plant = Plant {
        inputs: &SUNNY,
        start: &[20.0, 0.0],
        rates: |_, u, x| vec![(x[1] - 40.0 * (x[0] - u[1])) / 250e3, 0.0],
        tick: Some((20, |x, u| x[1] = u[0])),
        outputs: &[("T", |x, _| x[0], 0.02)],
        interval: 60.0,
        samples: 500,
    };
    // Half of 20 min.
    is_named(&plant.found(LOSING), "sampled(P)", 600.0);
}

#[test]
fn a_sensor_that_is_read_now_and_then_and_held_is_found() {
    let plant = Plant {
        inputs: &SUNNY,
        start: &[20.0, 0.0],
        rates: |_, u, x| vec![(u[0] - 40.0 * (x[0] - u[1])) / 250e3, 0.0],
        tick: Some((10, |x, _| x[1] = x[0])),
        outputs: &[("T", |x, _| x[1], 0.02)],
        interval: 60.0,
        samples: 500,
    };
    is_named(&plant.found(LOSING), "sensor_sampled(T)", 300.0);
}

#[test]
fn an_input_is_twenty_times_as_large_as_recorded() {
    let plant = Plant {
        inputs: &[("F", Moves::Waves(0.0, 1.0, [20.0, 120.0])), ("D", Moves::Steps(-8.0, 8.0, 30))],
        start: &[0.0],
        rates: |_, u, x| vec![(20.0 * u[0] + u[1] - 1.7 * x[0]) / 2.0],
        tick: None,
        outputs: &[("v", |x, _| x[0], 0.01)],
        interval: 0.1,
        samples: 500,
    };
    let model = "model cart
input F [N] linear
input D [N] hold
constant m [kg] = 2
parameter b [N*s/m] = 1 in 0.01 .. 1000, log
state v [m/s] = 0
equation force: m*der(v) = F + D - b*v
output v [m/s] noise 0.01
";
    is_named(&plant.found(model), "input_gain(F)", 20.0);
}

#[test]
fn an_input_in_a_thousandth_of_its_unit_is_a_slip_of_the_recording() {
    let plant = Plant {
        inputs: &[("P", Moves::Steps(0.0, 1.5, 20)), HEATED[1]],
        rates: |_, u, x| vec![(1000.0 * u[0] - 40.0 * (x[0] - u[1])) / 250e3],
        ..leaking()
    };
    let model = "model room
input P [W] hold
input T_out [degC] linear
constant C [kJ/K] = 250
parameter H [W/K] = 30 in 1 .. 500, log
state T [degC] = 20
equation air: C*der(T) = P - H*(T - T_out)
output T [degC] noise 0.05 [K]
";
    let found = plant.found(model);
    assert_eq!(found.verdict, Verdict::Plain, "{}", found.reason);
    let first = &found.plain.as_ref().expect("causes").causes[0];
    assert_eq!((&*first.name, first.kind), ("P", PlainKind::Unit), "{first:?}");
}

#[test]
fn nothing_is_named_where_nothing_is_hidden() {
    let right = shaft(|_, u, x| masses(5.0 * x[2] + 0.05 * (x[0] - x[1]), u, x));
    let found = right.found(SHAFT);
    assert_eq!(found.verdict, Verdict::Sufficient, "{}", found.reason);
}
