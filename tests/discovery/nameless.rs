//! Of what no effect has a name for, a formula is guessed, and nothing more is said of it.

use dgd::{Column, Inputs, Options, Problem, System, observe, simulate};
use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{Directions, compile_asts, load};
use dgd_compiler::source::{Source, Sources};
use dgd_discover::{Discovery, Guess, Verdict};

use crate::examined::{Samples, Texts, declared};
use crate::random::Random;

/// A tank whose second outlet the model does not have.
const TANK: &str = "/// A tank with a pump and two outlets.
model tank

input q_in    [L/min] linear    /// pump
input opening [%]     linear    /// valve of the second outlet

parameter area [m^2]               = 0.5  fixed
parameter k    [L/(min*m^(1/2))]   = 30   in 1 .. 500, log    /// first outlet

state h [m] = 1

equation level: area*der(h) = q_in - k*sqrt(h)

output h [m]  noise 0.002 [m]
";

/// Of the second outlet, in L/min at 1 m and fully open; and of the first.
const SECOND: f64 = 25.0;
const FIRST: f64 = 40.0;

/// A quantity that rests at random levels and goes from one to the next in some time.
fn ramps(random: &mut Random, n: usize, low: f64, high: f64) -> Vec<f64> {
    let mut values = Vec::new();
    let mut level = f64::midpoint(low, high);
    while values.len() < n {
        let rest = random.between(40.0, 160.0) as usize;
        values.extend(std::iter::repeat_n(level, rest));
        let (next, steps) = (random.between(low, high), random.between(10.0, 40.0) as usize);
        values.extend((0..steps).map(|k| level + (next - level) * k as f64 / steps as f64));
        level = next;
    }
    values.truncate(n);
    values
}

/// Readings every two seconds of a tank, made by small steps without any solver of this project.
fn tank(seed: u64) -> Samples {
    let n = 1500;
    let mut random = Random::new(seed, 4);
    let inflow = ramps(&mut random, n, 40.0, 80.0);
    let opening = ramps(&mut random, n, 0.0, 100.0);
    let times: Vec<f64> = (0..n).map(|k| 2.0 * k as f64).collect();
    let (mut h, mut read) = (1.2_f64, Vec::new());
    for k in 0..n {
        read.push(h + 0.002 * random.normal());
        let next = (k + 1).min(n - 1);
        for step in 0..200 {
            let share = (f64::from(step) + 0.5) / 200.0;
            let at = |values: &[f64]| values[k] + share * (values[next] - values[k]);
            let rate = |h: f64| {
                let out = FIRST * h.sqrt() + SECOND * at(&opening) / 100.0 * h.sqrt();
                (at(&inflow) - out) / 60_000.0 / 0.5
            };
            h += 0.01 * rate(h + 0.005 * rate(h));
        }
    }
    let columns = [("q_in", inflow), ("opening", opening), ("h", read)];
    Samples { times, columns: columns.map(|(name, values)| (name.to_owned(), values)).to_vec() }
}

/// The guess of a discovery that has no name for what is missing.
#[track_caller]
fn guess(discovery: &Discovery) -> &Guess {
    assert_eq!(discovery.verdict, Verdict::Unexplained, "{}", discovery.reason);
    let [unexplained] = discovery.unexplained.as_slice() else { panic!("one discrepancy") };
    unexplained.guess.as_ref().unwrap_or_else(|| panic!("a guess in {}", unexplained.target))
}

/// Whether a model compiles; units are checked then.
fn compiles(text: &str) -> bool {
    let (mut sources, mut diagnostics) = (Sources::default(), Diagnostics::default());
    let source = Source { name: "guessed.dgd".to_owned(), text: text.to_owned() };
    let mut nothing = |path: &str| Err(format!("{path} is not read here"));
    let asts = load(source, &mut nothing, &mut sources, &mut diagnostics);
    asts.and_then(|asts| {
        diagnostics.check()?;
        compile_asts(asts, &ModelOptions::default(), &Directions::None, &mut diagnostics)
    })
    .is_ok()
}

/// The formula stands on the right-hand side of an equation as it was printed, and only with its units.
#[track_caller]
fn fits_the_equation(text: &str, equation: &str, guess: &Guess) {
    let with = |formula: &str| {
        let changed = text.replace(equation, &format!("{equation} + ({formula})"));
        assert_ne!(changed, text, "the equation is in the model");
        changed
    };
    assert!(compiles(&with(&guess.formula)), "{}", guess.formula);
    let without = guess.formula.replace('[', "[s*").replace("[s*1]", "[s]");
    assert!(without == guess.formula || !compiles(&with(&without)), "{without}");
}

#[test]
fn a_second_outlet_of_a_tank_is_guessed() {
    let text = Texts { model: ("tank.dgd".to_owned(), TANK.to_owned()), effects: Vec::new() };
    let examined = text.read();
    let [train, valid] = [1, 2].map(|seed| examined.recording_without_start(&tank(seed)));
    let discovery = examined.discover(&[train], &[valid], 2);
    assert_eq!(discovery.unexplained[0].target, "level");
    let guess = guess(&discovery);
    let [term] = guess.terms.as_slice() else { panic!("{}", guess.formula) };
    assert!(
        ["* opening*sqrt(h)", "* sqrt(h)*opening"].contains(&term.factor.as_str()),
        "{}",
        guess.formula
    );
    // −25 L/min at 1 m and fully open.
    let found = term.coefficient * 60_000.0;
    assert!((found / -SECOND - 1.0).abs() < 0.03, "{found}: {}", guess.formula);
    assert!(guess.r2_held_out > 0.8, "{}", guess.r2_held_out);
    assert!(guess.is_of_recordings);
    assert!(guess.left_after < 1.1 && guess.left_before > 3.0, "{guess:?}");
    fits_the_equation(TANK, "q_in - k*sqrt(h)", guess);
}

/// A recording of the circulation model with a term in its riser's balance, in its own units.
fn circulation(term: &str, seed: u64) -> Samples {
    let mut texts = Texts::of_the_repository();
    texts.effects.clear();
    texts.model.1 = texts.model.1.replace("q_ssp - q_boost - q_tf\n", &format!("{term}\n"));
    let hidden = texts.read();
    let system = hidden.system();
    let signature = system.signature();
    let n = 1200;
    let mut random = Random::new(seed, 5);
    let speed = ramps(&mut random, n, 48.0, 56.0);
    let booster = ramps(&mut random, n, 1200.0, 1900.0);
    let fill = ramps(&mut random, n, 150.0, 250.0);
    let times: Vec<f64> = (0..n).map(|k| 2.0 * k as f64).collect();
    let own = [("w_ssp", speed), ("q_boost", booster), ("q_tf", fill)];
    let in_si: Vec<Vec<f64>> = (signature.inputs.iter().zip(&own))
        .map(|(input, (name, values))| {
            assert_eq!(input.name, *name);
            values.iter().map(|value| value * input.unit.factor).collect()
        })
        .collect();
    let columns: Vec<Column<'_>> = (signature.inputs.iter().zip(&in_si))
        .map(|(input, values)| Column {
            name: &input.name,
            interpolation: input.interpolation,
            values,
        })
        .collect();
    let inputs = Inputs::recorded(&times, &columns).expect("sound inputs");
    let p = declared(signature);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let solution = simulate(&problem, &times, &Options::default()).expect("a run");
    let w = observe(&problem, &solution).w;
    let n_w = signature.outputs.len();
    let read = signature.outputs.iter().enumerate().map(|(i, output)| {
        let noise = output.noise.expect("it is declared");
        let reading = |k: usize| output.unit.from_si(w[k * n_w + i] + noise * random.normal());
        (output.name.to_string(), (0..n).map(reading).collect::<Vec<f64>>())
    });
    let read: Vec<(String, Vec<f64>)> = read.collect();
    let inputs = own.map(|(name, values)| (name.to_owned(), values));
    Samples { times, columns: inputs.into_iter().chain(read).collect() }
}

/// What is guessed about such recordings where no effect is known.
fn circulation_without_effects(term: &str) -> Discovery {
    let mut texts = Texts::of_the_repository();
    texts.effects.clear();
    let mut examined = texts.read();
    examined.templates.clear();
    let recordings = [1, 2].map(|seed| examined.recording_without_start(&circulation(term, seed)));
    let [train, valid] = recordings;
    examined.discover(&[train], &[valid], 1)
}

#[test]
fn an_inflow_that_goes_with_two_quantities_of_a_riser_is_guessed() {
    let term = "q_ssp - q_boost - q_tf + 2e-4 [m^2/s]*w_ssp*h_r";
    let discovery = circulation_without_effects(term);
    assert_eq!(discovery.unexplained[0].target, "riser");
    let guess = guess(&discovery);
    let [term] = guess.terms.as_slice() else { panic!("{}", guess.formula) };
    assert_eq!(term.factor, "* w_ssp*h_r", "{}", guess.formula);
    assert!((term.coefficient / 2e-4 - 1.0).abs() < 0.05, "{}", guess.formula);
    let text = Texts::of_the_repository().model.1;
    fits_the_equation(&text, "q_ssp - q_boost - q_tf", guess);
}

#[test]
fn what_goes_with_nothing_that_the_model_has_is_not_guessed() {
    let term = "q_ssp - q_boost - q_tf + 2e-3 [m^3/s]*sin(time/23 [s])";
    let discovery = circulation_without_effects(term);
    assert_eq!(discovery.verdict, Verdict::Unexplained, "{}", discovery.reason);
    assert!(discovery.unexplained[0].guess.is_none(), "{:?}", discovery.unexplained[0].guess);
}
