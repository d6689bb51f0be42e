//! Terms that equations lack are found without a library.

use dgd_discover::{Discovery, FoundLaw, RivalLaw, Verdict};

use crate::examined::{Examined, Samples, Texts};
use crate::random::Random;

/// The right sides of the whole system.
type Rates = fn(&[f64]) -> Vec<f64>;

fn examined(text: &str) -> Examined {
    Texts { model: ("model.dgd".to_owned(), text.to_owned()), effects: Vec::new() }.read()
}

/// A system from a start to an end by Runge–Kutta steps that are far shorter than the samples, in these units of time
/// and of the states, with noise; `seen` are the states that are read.
struct Plant<'a> {
    rates: Rates,
    seen: &'a [(&'a str, usize)],
    samples: usize,
    until: f64,
    noise: f64,
    unit: f64,
}

impl Plant<'_> {
    fn record(&self, seed: u64, start: &[f64]) -> Samples {
        const STEPS: usize = 200;
        let mut random = Random::new(seed, 3);
        let (mut x, interval) = (start.to_vec(), self.until / (self.samples - 1) as f64);
        let h = interval / STEPS as f64;
        let mut rows = Vec::new();
        for _ in 0..self.samples {
            rows.push(x.clone());
            for _ in 0..STEPS {
                let at = |part: f64, k: &[f64]| -> Vec<f64> {
                    x.iter().zip(k).map(|(x, k)| x + part * h * k).collect()
                };
                let k1 = (self.rates)(&x);
                let k2 = (self.rates)(&at(0.5, &k1));
                let k3 = (self.rates)(&at(0.5, &k2));
                let k4 = (self.rates)(&at(1.0, &k3));
                for i in 0..x.len() {
                    x[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
                }
            }
        }
        let columns = self.seen.iter().map(|(name, i)| {
            let mean = rows.iter().map(|row| row[*i]).sum::<f64>() / rows.len() as f64;
            let square = rows.iter().map(|row| (row[*i] - mean).powi(2)).sum::<f64>();
            let std = self.noise * (square / rows.len() as f64).sqrt();
            let read = |row: &Vec<f64>| self.unit * (row[*i] + std * random.normal());
            ((*name).to_owned(), rows.iter().map(read).collect())
        });
        let columns = columns.collect();
        Samples { times: (0..self.samples).map(|k| interval * k as f64).collect(), columns }
    }

    fn found(&self, model: &str, starts: [&[f64]; 3]) -> Discovery {
        self.found_in_time(model, starts, 1.0)
    }

    /// The same with so many seconds for each unit of time.
    fn found_in_time(&self, model: &str, starts: [&[f64]; 3], seconds: f64) -> Discovery {
        let examined = examined(model);
        let mut seed = 0;
        let [first, second, valid] = starts.map(|start| {
            seed += 1;
            let mut samples = self.record(seed, start);
            for t in &mut samples.times {
                *t *= seconds;
            }
            examined.recording_without_start(&samples)
        });
        examined.discover(&[first, second], &[valid], 1)
    }
}

/// The terms of a law, each with its equation, without its coefficient, and that, SI.
fn terms(discovery: &Discovery) -> Vec<(String, String, f64)> {
    assert_eq!(discovery.verdict, Verdict::Law, "{}", discovery.reason);
    let FoundLaw { terms, .. } = discovery.law.as_ref().expect("a law");
    let mut all: Vec<(String, String, f64)> = (terms.iter())
        .map(|term| {
            let (_, factor) = term.formula.split_once(" * ").unwrap_or(("", ""));
            (term.target.clone(), factor.to_owned(), term.coefficients[0].value)
        })
        .collect();
    all.sort_by(|a, b| a.0.cmp(&b.0));
    all
}

fn is_near(found: &(String, String, f64), target: &str, factor: &str, value: f64, within: f64) {
    assert_eq!((&*found.0, &*found.1), (target, factor));
    assert!((found.2 / value - 1.0).abs() < within, "{found:?}: {value}");
}

const HUNTERS: &str = "model hunters
constant alpha [1/s] = 1.3
constant delta [1/s] = 1.8
state x [1] = 3.1
state y [1] = 4.4
equation prey: der(x) = alpha*x
equation hunters: der(y) = -delta*y
output x noise 0.02
output y noise 0.02
";

fn hunters(x: &[f64]) -> Vec<f64> {
    vec![1.3 * x[0] - 0.9 * x[0] * x[1], -1.8 * x[1] + 0.8 * x[0] * x[1]]
}

const BOTH: &[(&str, usize)] = &[("x", 0), ("y", 1)];

#[test]
fn two_interactions_are_found_from_few_readings() {
    // Without them the model runs away from the first reading on.
    let plant =
        Plant { rates: hunters, seen: BOTH, samples: 21, until: 5.0, noise: 0.005, unit: 1.0 };
    let found = plant.found(HUNTERS, [&[3.1, 4.4], &[1.0, 1.0], &[2.0, 3.0]]);
    let [hunters, prey] = &terms(&found)[..] else { panic!("{:?}", found.law) };
    is_near(hunters, "hunters", "x*y", 0.8, 0.02);
    is_near(prey, "prey", "x*y", -0.9, 0.02);
    assert!(found.corrected.contains("der(x) = alpha*x + law_"), "{}", found.corrected);
}

#[test]
fn the_terms_are_the_same_in_other_units_and_names_and_in_another_order() {
    let model = "model hunters
state w [g] = 4400
state p [g] = 3100
equation b: der(w) = -1.8 [1/s]*w
equation a: der(p) = 1.3 [1/s]*p
output w noise 20
output p noise 20
";
    let seen = &[("p", 0), ("w", 1)];
    let plant = Plant { rates: hunters, seen, samples: 101, until: 5.0, noise: 0.01, unit: 1000.0 };
    let found = plant.found(model, [&[3.1, 4.4], &[1.0, 1.0], &[2.0, 3.0]]);
    let [a, b] = &terms(&found)[..] else { panic!("{:?}", found.law) };
    is_near(a, "a", "w*p", -0.9, 0.02);
    is_near(b, "b", "w*p", 0.8, 0.02);
}

#[test]
fn a_level_is_missing_in_the_plant_before_its_sensor_has_an_offset() {
    // der(x) = 0.32 - 0.6 x: x of a plant without the constant, read 0.53 too high, is the same.
    let plant = Plant {
        rates: |x| vec![0.32 - 0.6 * x[0]],
        seen: &[("x", 0)],
        samples: 100,
        until: 10.0,
        noise: 0.01,
        unit: 1.0,
    };
    let model = "model level
state x [1] = 0.1
equation level: 1 [s]*der(x) = -0.6*x
output x noise 0.002
";
    let found = plant.found(model, [&[0.14], &[0.55], &[0.3]]);
    let [only] = &terms(&found)[..] else { panic!("{:?}", found.law) };
    is_near(only, "level", "", 0.32, 0.02);
}

#[test]
fn a_sine_is_found_as_one_and_only_of_a_number() {
    let plant = Plant {
        rates: |x| vec![x[1], -x[0].sin() - 0.2 * x[1]],
        seen: BOTH,
        samples: 120,
        until: 12.0,
        noise: 0.01,
        unit: 1.0,
    };
    let model = "model pendulum
state x [1] = 2.5
state y [1/s] = 0
equation angle: der(x) = y exact
equation momentum: der(y) = -0.2 [1/s]*y
output x noise 0.02
output y noise 0.02
";
    let found = plant.found(model, [&[2.5, 0.0], &[-1.0, 1.5], &[1.7, -0.5]]);
    let [only] = &terms(&found)[..] else { panic!("{:?}", found.law) };
    is_near(only, "momentum", "sin(x)", -1.0, 0.02);
}

#[test]
fn a_state_that_is_not_read_is_followed() {
    let plant = Plant {
        rates: |x| {
            vec![
                1.0 - 4.03 * x[0] + 3.1 * x[0] * x[0] * x[1],
                3.03 * x[0] - 3.1 * x[0] * x[0] * x[1],
            ]
        },
        seen: &[("x", 0)],
        samples: 200,
        until: 10.0,
        noise: 0.01,
        unit: 1.0,
    };
    let model = "model brusselator
state x [1] = 0.7
state y [1] = -1.4
equation ex: 1 [s]*der(x) = 3.1*x^2*y + 1
equation ey: 1 [s]*der(y) = 3.03*x - 3.1*x^2*y
output x noise 0.01
";
    let found = plant.found(model, [&[0.7, -1.4], &[2.1, 1.3], &[1.2, 0.4]]);
    let [only] = &terms(&found)[..] else { panic!("{:?}", found.law) };
    is_near(only, "ex", "x", -4.03, 0.02);
}

#[test]
fn nothing_is_added_to_a_model_that_lacks_nothing() {
    let model = HUNTERS
        .replace("alpha*x", "alpha*x - 0.9 [1/s]*x*y")
        .replace("-delta*y", "-delta*y + 0.8 [1/s]*x*y");
    let plant =
        Plant { rates: hunters, seen: BOTH, samples: 101, until: 5.0, noise: 0.01, unit: 1.0 };
    let found = plant.found(&model, [&[3.1, 4.4], &[1.0, 1.0], &[2.0, 3.0]]);
    assert_eq!(found.verdict, Verdict::Sufficient, "{}", found.reason);
}

#[test]
fn laws_that_explain_the_recordings_alike_are_both_given() {
    // What slows y, which is not read, and what slows x, are one and the same to x.
    let plant = Plant {
        rates: |x| vec![0.8 * x[1], -1.1 * x[0] - 0.43 * x[1]],
        seen: &[("x", 0)],
        samples: 201,
        until: 10.0,
        noise: 0.01,
        unit: 1.0,
    };
    let model = "model swing
state x [1] = 1
state y [1] = 0.2
equation a: der(x) = 0.8 [1/s]*y
equation b: der(y) = -1.1 [1/s]*x
output x noise 0.005
";
    let found = plant.found(model, [&[1.0, 0.2], &[-0.4, 0.9], &[0.7, -0.5]]);
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.reason);
    let formula = |law: &RivalLaw| {
        let terms = law.terms.iter().map(|term| {
            let (_, factor) = term.formula.split_once(" * ").unwrap_or(("", ""));
            let off = term.coefficients[0].value + 0.43;
            assert!(off.abs() < 0.02, "{term:?}");
            format!("{factor} in {}", term.target)
        });
        terms.collect::<Vec<_>>().join(" and ")
    };
    let mut all: Vec<String> = found.rivals.iter().map(formula).collect();
    all.sort();
    assert_eq!(all, ["x in a", "y in b"]);
    assert_eq!(found.rivals[1].told_apart_by.as_deref(), Some("a measurement of `y`"));
    let mut places: Vec<&str> = found.unexplained.iter().map(|one| &*one.target).collect();
    places.truncate(2);
    places.sort_unstable();
    assert_eq!(places, ["a", "b"]);
    // Each of them can be taken into a library.
    assert!(found.unexplained[..2].iter().all(|one| one.guess.is_some()));
}

/// Two levels, each driven by a coordinate of Lorenz' system that no name of the model follows.
fn driven(x: &[f64]) -> Vec<f64> {
    let (u, v, w) = (x[2], x[3], x[4]);
    vec![
        -0.6 * x[0] + 0.1 * u,
        -0.9 * x[1] + 0.1 * (w - 25.0),
        10.0 * (v - u),
        u * (28.0 - w) - v,
        u * v - 8.0 / 3.0 * w,
    ]
}

const LORENZ: [&[f64]; 3] =
    [&[1.0, 0.5, 1.0, 1.0, 20.0], &[0.2, 0.9, -5.0, -4.0, 22.0], &[0.6, 0.1, 7.0, 3.0, 30.0]];

#[test]
fn equations_that_lack_something_together_are_named_together() {
    let model = "model levels
state x [1] = 1
state y [1] = 0.5
equation a: der(x) = -0.6 [1/s]*x
equation b: der(y) = -0.9 [1/s]*y
output x noise 0.01
output y noise 0.01
";
    let plant =
        Plant { rates: driven, seen: BOTH, samples: 201, until: 8.0, noise: 0.02, unit: 1.0 };
    let found = plant.found(model, LORENZ);
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.reason);
    let joint = found.unexplained.iter().filter(|one| one.is_joint);
    let mut joint: Vec<&str> = joint.map(|one| &*one.target).collect();
    joint.sort_unstable();
    assert_eq!(joint, ["a", "b"]);
    assert!(found.unexplained[0].is_joint);
}

#[test]
fn the_only_sensor_comes_after_the_plant() {
    let model = "model level
state x [1] = 1
equation a: der(x) = -0.6 [1/s]*x
output x noise 0.01
";
    let seen = &[("x", 0)];
    let plant = Plant { rates: driven, seen, samples: 201, until: 8.0, noise: 0.02, unit: 1.0 };
    let found = plant.found(model, LORENZ);
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.reason);
    let targets: Vec<&str> = found.unexplained.iter().map(|one| &*one.target).collect();
    assert_eq!(targets, ["a", "sensor x"]);
    let sensor = &found.unexplained[1];
    assert_eq!(sensor.told_apart_by.as_deref(), Some("a second sensor of `x`"));
}

#[test]
fn a_model_that_holds_except_in_a_regime_is_fitted_outside_it() {
    // While s is above 0.5, a coordinate of Lorenz' system acts that no name follows.
    let plant = Plant {
        rates: |x| {
            let (s, u, v, w) = (x[1], x[3], x[4], x[5]);
            let extra = if s > 0.5 { 0.06 * u } else { 0.0 };
            let lorenz = [10.0 * (v - u), u * (28.0 - w) - v, u * v - 8.0 / 3.0 * w];
            let [a, b, c] = lorenz;
            vec![-0.8 * x[0] + s + extra, x[2], -s, a, b, c]
        },
        seen: &[("x", 0), ("s", 1)],
        samples: 401,
        until: 40.0,
        noise: 0.01,
        unit: 1.0,
    };
    let model = "model driven
input s [1] linear
parameter k [1/s] = 0.7 in 0.1 .. 10, log
state x [1] = 1
equation a: der(x) = -k*x + 1 [1/s]*s
output x noise 0.01
";
    let lorenz = [[1.0, 1.0, 20.0], [-5.0, -4.0, 22.0], [7.0, 3.0, 30.0]];
    let starts = [[1.0, 0.0, 1.0], [0.2, 0.5, -0.8], [0.6, -0.7, 0.7]];
    let all: Vec<Vec<f64>> =
        starts.iter().zip(lorenz).map(|(start, own)| [&start[..], &own[..]].concat()).collect();
    let found = plant.found(model, [&all[0], &all[1], &all[2]]);
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.reason);
    let regime = found.regime.as_ref().expect("a regime");
    assert_eq!(regime.condition.quantity, "s");
    assert!((regime.condition.threshold.expect("a level") - 0.5).abs() < 0.1, "{regime:?}");
    assert!(regime.outside < 1.1 && regime.inside > 3.0, "{regime:?}");
    let k = &regime.parameters[0];
    assert!((k.value - 0.8).abs() < 4.0 * k.std.expect("a std"), "{k:?}");
}

#[test]
fn a_product_is_no_bend_beyond_the_recorded_range() {
    // `x*z` looks like `sin(x)*z` and like `x*z/(131 + abs(z))` there.
    let roessler: Rates = |x| {
        let [x, y, z] = [x[0], x[1], x[2]];
        vec![-5.0 * y - 5.0 * z, 5.0 * x - y, 1.0 - 28.5 * z + 5.0 * x * z]
    };
    for (unit, factor) in [("s", 1.0), ("min", 60.0)] {
        let rate = format!("1 [{unit}]");
        let model = format!(
            "model attractor
state x [1] = 2.3
state y [1] = 1.1
state z [1] = 0.8
equation ex: {rate}*der(x) = -5.0*y - 5.0*z
equation ey: {rate}*der(y) = 5.0*x - 1.0*y
equation ez: {rate}*der(z) = 1.0 - 28.5*z
output x noise 0.018
output y noise 0.019
output z noise 0.0022
"
        );
        let seen = &[("x", 0), ("y", 1), ("z", 2)];
        let plant =
            Plant { rates: roessler, seen, samples: 200, until: 2.0, noise: 0.01, unit: 1.0 };
        let starts: [&[f64]; 3] = [&[2.3, 1.1, 0.8], &[1.2, 0.7, 1.9], &[1.7, 0.9, 1.3]];
        let found = plant.found_in_time(&model, starts, factor);
        let [law] = &terms(&found)[..] else { panic!("{:?}", found.law) };
        is_near(law, "ez", "x*z", 5.0, 0.05);
    }
}

#[test]
fn a_loss_in_one_regime_is_found_with_its_threshold() {
    // Sunshine p goes round with q; the window is open while there is much of it.
    let room: Rates = |x| {
        let [air, wall, p, q] = [x[0], x[1], x[2], x[3]];
        let open = if p > 0.4 { 0.8 } else { 0.0 };
        let exchange = 0.5 * (wall - air);
        vec![2.0 * p + exchange - open * (air - wall), -0.3 * exchange, 1.3 * q, -1.3 * p]
    };
    let model = "model room
state air [K] = 20
state wall [K] = 18
state p [1] = 1
state q [1] = 0
equation of_air: der(air) = 2 [K/s]*p + 0.5 [1/s]*(wall - air)
equation of_wall: der(wall) = -0.15 [1/s]*(wall - air)
equation sun: der(p) = 1.3 [1/s]*q
equation shade: der(q) = -1.3 [1/s]*p
output air noise 0.01
output wall noise 0.01
output p noise 0.01
output q noise 0.01
";
    let seen = &[("air", 0), ("wall", 1), ("p", 2), ("q", 3)];
    let plant = Plant { rates: room, seen, samples: 300, until: 30.0, noise: 0.01, unit: 1.0 };
    let starts: [&[f64]; 3] =
        [&[20.0, 18.0, 1.0, 0.0], &[21.0, 19.0, 0.2, 1.1], &[18.0, 19.0, -0.6, 0.7]];
    let found = plant.found(model, starts);
    assert_eq!(found.verdict, Verdict::Law, "{}", found.reason);
    let FoundLaw { terms, .. } = found.law.as_ref().expect("a law");
    let [term] = &terms[..] else { panic!("{terms:?}") };
    assert_eq!(term.target, "of_air");
    assert!(term.formula.contains("(if p > ") && term.formula.contains("(wall - air)"), "{term:?}");
    let [size, threshold] = &term.coefficients[..] else { panic!("{term:?}") };
    assert!((size.value - 0.8).abs() < 0.03 && (threshold.value - 0.4).abs() < 0.02, "{term:?}");
}
