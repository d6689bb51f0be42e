//! Where something is missing, what it is like, and what is said without validation data.

use dgd_discover::{Discovery, PlaceKind, Verdict};

use crate::examined::{Examined, Samples, Texts};
use crate::random::Random;

/// A mass on a spring with a damper, driven by a force.
const OSCILLATOR: &str = "model oscillator
input F [N] linear
constant m [kg] = 1.5
parameter c [N*s/m] = 0.5 in 0.01 .. 10, log
parameter k [N/m] = 30 in 1 .. 300, log
state x [m] = 0
state v [m/s] = 0
equation speed: der(x) = v exact
equation force: m*der(v) = F - c*v - k*x
output x [m] noise 0.001
output v [m/s] noise 0.01
";

/// A tank that empties through a valve, whose surroundings are recorded.
const TANK: &str = "model tank
input q [l/min] hold
input T [K] linear    /// of the oil
constant A [m^2] = 0.1
parameter k [l/(min*m^(1/2))] = 12 in 1 .. 100, log
state h [m] = 0.5
equation level: A*der(h) = q - k*sqrt(h^2 + (1 [mm])^2)^(1/2) + 0*T/(1 [K])*q
output h [m] noise 0.002
";

/// A cell whose temperature is recorded; its resistance is taken for a constant.
const CELL: &str = "model cell
input i [A] hold
input T [K] linear
parameter Q [A*h] = 5 in 0.5 .. 50, log
parameter R0 [mohm] = 25 in 1 .. 500, log
parameter R1 [mohm] = 10 in 1 .. 500, log
parameter C1 [kF] = 2 in 0.1 .. 50, log
state soc [1] = 0.8
state v1 [mV] = 0 nominal 10
equation charge: Q*der(soc) = -i
equation relax: C1*der(v1) = i - v1/R1
output v [V] = 3.3 [V] + 0.7 [V]*soc - R0*i - v1 + 0*T/(1 [K])*(1 [V]) noise 0.002
";

fn examined(name: &str, text: &str) -> Examined {
    Texts { model: (name.to_owned(), text.to_owned()), effects: Vec::new() }.read()
}

/// Steps of random height between 0 and 1, each held for so many samples.
fn steps(random: &mut Random, samples: usize, held: usize) -> Vec<f64> {
    let mut level = 0.5;
    (0..samples)
        .map(|i| {
            if i.is_multiple_of(held) {
                level = random.between(0.0, 1.0);
            }
            level
        })
        .collect()
}

/// The oscillator with a cubic spring, by a scheme of its own: 40 half-implicit steps a sample.
fn oscillator(seed: u64, cubic: f64) -> Samples {
    let mut random = Random::new(seed, 0);
    let (n, h) = (800, 0.02);
    let force: Vec<f64> =
        steps(&mut random, n, 25).iter().map(|level| 40.0 * (level - 0.5)).collect();
    let (mut x, mut v) = (0.0_f64, 0.0_f64);
    let (mut read_x, mut read_v) = (Vec::new(), Vec::new());
    for i in 0..n {
        read_x.push(x + 0.001 * random.normal());
        read_v.push(v + 0.01 * random.normal());
        let next = force[(i + 1).min(n - 1)];
        for j in 0..200 {
            let share = f64::from(j) / 200.0;
            let f = force[i] + share * (next - force[i]);
            v += h / 200.0 * (f - 0.8 * v - 40.0 * x - cubic * x.powi(3)) / 1.5;
            x += h / 200.0 * v;
        }
    }
    let columns = vec![("F".to_owned(), force), ("x".to_owned(), read_x), ("v".to_owned(), read_v)];
    Samples { times: (0..n).map(|i| h * i as f64).collect(), columns }
}

/// The tank, whose valve passes more when the oil is warm.
fn tank(seed: u64) -> Samples {
    let mut random = Random::new(seed, 0);
    let (n, h) = (900, 2.0);
    let q: Vec<f64> = steps(&mut random, n, 60).iter().map(|level| 4.0 + 8.0 * level).collect();
    let phase = 6.0 * random.between(0.0, 1.0);
    let warm = |i: usize| 300.0 + 20.0 * (i as f64 / 130.0 + phase).sin();
    let mut level = 0.5_f64;
    let mut read = Vec::new();
    for (i, q) in q.iter().enumerate() {
        read.push(level + 0.002 * random.normal());
        for j in 0..50 {
            let temperature = warm(i) + (warm(i + 1) - warm(i)) * f64::from(j) / 50.0;
            let k = 10.0 * (0.02 * (temperature - 300.0)).exp();
            level += h / 50.0 * (q - k * level.max(0.0).sqrt()) / 60_000.0 / 0.1;
        }
    }
    let temperature = (0..n).map(warm).collect();
    let columns = vec![("q".to_owned(), q), ("T".to_owned(), temperature), ("h".to_owned(), read)];
    Samples { times: (0..n).map(|i| h * i as f64).collect(), columns }
}

/// The cell over five hours, whose resistance has an activation temperature of 2500 K.
fn cell(seed: u64) -> Samples {
    let mut random = Random::new(seed, 0);
    let (n, h) = (1500, 12.0);
    // At rest a third of the time, seldom charged.
    let [which, share] = [(); 2].map(|()| steps(&mut random, n, 40));
    let level = |which: f64| [0.0, 0.0, 1.0, 2.0, 4.0, -2.0][(6.0 * which) as usize % 6];
    let both = which.iter().zip(&share);
    let i: Vec<f64> = both.map(|(which, share)| level(*which) * (0.5 + 0.5 * share)).collect();
    let phase = 6.0 * random.between(0.0, 1.0);
    let warm = |k: usize| 293.0 + 15.0 * (k as f64 / 190.0 + phase).sin();
    let (mut soc, mut v1) = (0.8_f64, 0.0_f64);
    let mut read = Vec::new();
    for (k, i) in i.iter().enumerate() {
        let resistance = 0.03 * (2500.0 * (warm(k).recip() - 293.15_f64.recip())).exp();
        read.push(3.3 + 0.7 * soc - resistance * i - v1 + 0.002 * random.normal());
        for _ in 0..12 {
            soc -= h / 12.0 * i / (5.0 * 3600.0);
            v1 += h / 12.0 * (i - v1 / 0.012) / 2000.0;
        }
    }
    let temperature = (0..n).map(warm).collect();
    let columns = vec![("i".to_owned(), i), ("T".to_owned(), temperature), ("v".to_owned(), read)];
    Samples { times: (0..n).map(|k| h * k as f64).collect(), columns }
}

/// A cart on a rail, which its model lets run freely.
const CART: &str = "model cart
input F [N] hold
parameter m [kg] = 1.8 in 0.5 .. 10
state x [m] = 0
state v [m/s] = 0 nominal 1
equation way: der(x) = v exact
equation force: m*der(v) = F
output x [m] noise 0.002
output v [m/s] noise 0.01
";

/// The cart, of 2 kg, in air, by the classical method of Runge and Kutta.
fn cart(seed: u64) -> Samples {
    let mut random = Random::new(seed, 0);
    let (n, h) = (1200, 0.05);
    let force: Vec<f64> = steps(&mut random, n, 40).iter().map(|level| 8.0 * level - 4.0).collect();
    let (mut x, mut v) = (0.0_f64, 0.0_f64);
    let (mut read_x, mut read_v) = (Vec::new(), Vec::new());
    for force in &force {
        read_x.push(x + 0.002 * random.normal());
        read_v.push(v + 0.01 * random.normal());
        let slope = |v: f64| (force - 0.8 * v * v.abs()) / 2.0;
        for _ in 0..20 {
            let d = h / 20.0;
            let k_1 = slope(v);
            let k_2 = slope(v + d / 2.0 * k_1);
            let k_3 = slope(v + d / 2.0 * k_2);
            let k_4 = slope(v + d * k_3);
            x += d * (v + d / 6.0 * (k_1 + k_2 + k_3));
            v += d / 6.0 * (k_1 + 2.0 * k_2 + 2.0 * k_3 + k_4);
        }
    }
    let columns = vec![("F".to_owned(), force), ("x".to_owned(), read_x), ("v".to_owned(), read_v)];
    Samples { times: (0..n).map(|k| h * k as f64).collect(), columns }
}

fn found(examined: &Examined, train: &Samples, valid: Option<&Samples>) -> Discovery {
    let train = [examined.recording_without_start(train)];
    let valid: Vec<_> = valid.iter().map(|one| examined.recording_without_start(one)).collect();
    examined.discover(&train, &valid, 2)
}

#[test]
fn a_cubic_spring_is_named_with_validation_data_and_without() {
    let examined = examined("oscillator.dgd", OSCILLATOR);
    let [train, valid] = [1, 2].map(|seed| oscillator(seed, 200.0));
    for valid in [Some(&valid), None] {
        let discovery = found(&examined, &train, valid);
        assert_eq!(discovery.verdict, Verdict::Effects, "{}", discovery.reason);
        let [effect] = discovery.effects.as_slice() else { panic!("{}", discovery.reason) };
        assert_eq!((&*effect.name, &*effect.target), ("cubic_stiffness(x, force)", "force"));
        let size = effect.parameters[0].value;
        assert!((size / 200.0 - 1.0).abs() < 0.05, "{size}");
    }
}

#[test]
fn drag_is_named_and_not_what_bends_the_same_way_sooner() {
    // Without drag the model is far off, and a stop beyond a gap is near after four simulations, drag after fourteen.
    let examined = examined("cart.dgd", CART);
    for seed in [1, 3, 5] {
        let [train, valid] = [seed, seed + 1].map(cart);
        let discovery = found(&examined, &train, Some(&valid));
        assert_eq!(discovery.verdict, Verdict::Effects, "{seed}: {}", discovery.reason);
        let [effect] = discovery.effects.as_slice() else { panic!("{}", discovery.reason) };
        assert_eq!((&*effect.name, &*effect.target), ("power_loss(v, force)", "force"));
        let loss = effect.parameters[0].value;
        assert!((loss - 0.8).abs() < 0.001, "{seed}: {loss}");
    }
}

#[test]
fn an_exact_equation_is_no_place() {
    let examined = examined("oscillator.dgd", OSCILLATOR);
    let [train, valid] = [3, 4].map(|seed| oscillator(seed, 200.0));
    let discovery = found(&examined, &train, Some(&valid));
    let places: Vec<(PlaceKind, &str)> =
        discovery.missing.iter().map(|one| (one.place.kind, &*one.place.name)).collect();
    assert!(!places.iter().any(|(_, name)| *name == "speed"), "{places:?}");
    // A spring that stiffens is a missing force, or a stiffness that is not constant.
    let first = places.first().expect("a place");
    assert!(["force", "k", "F"].contains(&first.1), "{places:?}");
}

#[test]
fn a_parameter_that_depends_on_a_recorded_quantity_is_the_place() {
    let examined = examined("tank.dgd", TANK);
    let [train, valid] = [tank(5), tank(6)];
    let discovery = found(&examined, &train, Some(&valid));
    assert_eq!(discovery.verdict, Verdict::Effects, "{}", discovery.reason);
    let [effect] = discovery.effects.as_slice() else { panic!("{}", discovery.reason) };
    assert_eq!((&*effect.name, &*effect.target), ("parameter_varies(k, T)", "k"));
    // The trace of the parameter, whatever the name: within a tenth of the truth where it stands.
    let place = &discovery.missing[0];
    assert_eq!((place.place.kind, &*place.place.name), (PlaceKind::Parameter, "k"));
    let columns = &train.columns;
    let warm = &columns.iter().find(|(name, _)| name == "T").expect("a column").1;
    let off = place.times.iter().zip(&place.value).map(|(t, k)| {
        let at = train.times.iter().position(|time| time == t).expect("a sample");
        let truth = 10.0 * (0.02 * (warm[at] - 300.0)).exp();
        (k / truth - 1.0).powi(2)
    });
    let rms = (off.sum::<f64>() / place.times.len() as f64).sqrt();
    assert!(rms < 0.1, "{rms}");
}

#[test]
fn a_form_that_begins_as_another_one_is_tried_where_that_comes_near() {
    // Arrhenius' law begins as 1/T does, and an exponential, which begins as a line does, comes nearer than both.
    let examined = examined("cell.dgd", CELL);
    let discovery = found(&examined, &cell(1), Some(&cell(2)));
    assert_eq!(discovery.verdict, Verdict::Effects, "{}", discovery.reason);
    let [effect] = discovery.effects.as_slice() else { panic!("{}", discovery.reason) };
    assert_eq!(effect.name, "parameter_varies(R0, T)");
    assert_eq!(effect.form.as_deref(), Some("arrhenius"), "{:#?}", discovery.ranking);
    let [activation] = effect.parameters.as_slice() else { panic!("{:?}", effect.parameters) };
    assert!((activation.value / -2500.0 - 1.0).abs() < 0.02, "{}", activation.value);
}
