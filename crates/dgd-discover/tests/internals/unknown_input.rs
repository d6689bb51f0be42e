//! A missing term is found at its place, in the unit of the equation as written.

use dgd_discover::{
    DeviationError, Deviations, MissingTerms, NoiseColour, PlaceKind, ReconstructedRecording,
    SensorNoise, UnknownInput, reconstruct, unknown_input,
};
use dgd_runtime::{InputColumn, Inputs, Options, Problem, Signature, System, observe, simulate};

use crate::support::{Normal, model_text, seconds, with_missing_terms};

/// A recording of a model in which something is missing.
struct Case {
    model: MissingTerms,
    p: Vec<f64>,
    times: Vec<f64>,
    /// The model's inputs: one column for each.
    inputs: Vec<Vec<f64>>,
}

impl Case {
    fn new(text: &str, variants: &[(&str, &str)], times: Vec<f64>) -> Self {
        let model = with_missing_terms(text, variants);
        let p = model.system().signature().parameters.iter().map(|p| p.value).collect();
        Case { model, p, times, inputs: Vec::new() }
    }

    fn signature(&self) -> &Signature {
        self.model.system().signature()
    }

    fn place(&self, kind: PlaceKind, name: &str) -> usize {
        let mut places = self.model.places().iter();
        places.position(|place| place.kind == kind && place.name == name).expect("a place")
    }

    /// Positions of equations and sensors among the places.
    fn physics_and_sensors(&self) -> Vec<usize> {
        let of = |kind| [PlaceKind::Equation, PlaceKind::Output].contains(&kind);
        let places = self.model.places().iter().enumerate();
        places.filter(|(_, place)| of(place.kind)).map(|(i, _)| i).collect()
    }

    /// Inputs with these missing terms; including all places if `missing` is not empty.
    fn recorded(&self, missing: &[Vec<f64>]) -> Inputs {
        let declared = self.signature().inputs.iter();
        let columns: Vec<InputColumn<'_>> = declared
            .zip(self.inputs.iter().chain(missing))
            .map(|(input, values)| InputColumn {
                name: "input",
                interpolation: input.interpolation,
                values,
            })
            .collect();
        Inputs::recorded(&self.times, &columns).expect("sound inputs")
    }

    fn nothing_missing(&self) -> Vec<Vec<f64>> {
        vec![vec![0.0; self.times.len()]; self.model.places().len()]
    }

    /// Outputs with these missing terms, and the trajectory.
    fn simulate(&self, missing: &[Vec<f64>]) -> (Vec<f64>, dgd_runtime::Solution) {
        let inputs = self.recorded(missing);
        let system = self.model.system();
        let problem = Problem { system, p: &self.p, inputs: &inputs, start: &[] };
        let options = Options { rtol: 1e-9, atol: 1e-9, ..Options::default() };
        let solution = simulate(&problem, &self.times, &options).expect("a solution");
        (observe(&problem, &solution).w, solution)
    }

    fn deviations(&self) -> Deviations {
        let (_, nominal) = self.simulate(&self.nothing_missing());
        Deviations::linearize(&self.model, &self.p, &self.recorded(&[]), &nominal)
            .expect("derivatives")
    }

    /// measured − simulated, where the measurement has these terms and noise.
    fn residuals(&self, missing: &[Vec<f64>], noise: &[f64], seed: u64) -> Vec<f64> {
        let (measured, _) = self.simulate(missing);
        let (simulated, _) = self.simulate(&self.nothing_missing());
        let mut normal = Normal::new(seed);
        let errors = measured.iter().zip(&simulated).zip(noise.iter().cycle());
        errors.map(|((m, s), noise)| m - s + noise * normal.next()).collect()
    }

    /// The estimate at a place if d is missing there.
    fn estimate(&self, place: usize, d: &[f64], noise: &[f64], seed: u64) -> UnknownInput {
        let mut missing = self.nothing_missing();
        missing[place] = d.to_vec();
        let residuals = self.residuals(&missing, noise, seed);
        unknown_input(&self.deviations(), place, &residuals, &white(noise))
            .expect("a place that is seen")
    }
}

/// White noise of known standard deviations.
fn white(stds: &[f64]) -> Vec<Option<SensorNoise>> {
    stds.iter().map(|std| Some(SensorNoise::known(*std))).collect()
}

/// Asserts that d lies within the estimate's own uncertainty.
fn assert_recovered(found: &UnknownInput, d: &[f64], floor: f64) {
    let n = d.len() as f64;
    let z: Vec<f64> = found
        .estimate
        .iter()
        .zip(&found.std)
        .zip(d)
        .map(|((estimate, std), d)| (estimate - d) / (std + floor))
        .collect();
    let outside = z.iter().filter(|z| z.abs() > 3.0).count() as f64;
    // 0.3 % of a normal distribution; neighbouring errors are correlated, so it may be more.
    assert!(outside <= 0.02 * n, "{outside} of {n} outside of 3 standard deviations");
    let mean_square = z.iter().map(|z| z * z).sum::<f64>() / n;
    assert!(mean_square < 2.0, "{mean_square}");
}

const TWO_LAGS: &str = "
model two_lags
input u [1] linear
parameter a [1/s] = 0.05
parameter b [m^2] = 4
state x [m] = 0
state y [m] = 0
equation first:  b * der(x) = b*a*(u*1 [m] - x)
equation second: der(y) = 2*a*(x - y)
output x [m]
output y [m]
";

fn two_lags(n: usize) -> Case {
    let mut case = Case::new(TWO_LAGS, &[], seconds(n));
    case.inputs = vec![(0..n).map(|k| (k as f64 / 80.0).sin()).collect()];
    case
}

#[test]
fn a_known_input_of_a_linear_system_is_recovered() {
    let case = two_lags(1200);
    let noise = [0.01, 0.02];
    // A bump of 0.2 m³/s between 400 s and 700 s.
    let d: Vec<f64> =
        case.times.iter().map(|t| 0.2 * (-((t - 550.0) / 60.0).powi(2)).exp()).collect();
    for seed in 0..5 {
        let place = case.place(PlaceKind::Equation, "first");
        let found = case.estimate(place, &d, &noise, seed);
        assert_recovered(&found, &d, 0.0);
        assert!(found.gain > 100.0, "{}", found.gain);
        let [window] = &found.windows[..] else { panic!("{:?}", found.windows) };
        assert!(window.from > 400.0 && window.until < 700.0, "{window:?}");
        // ∫ bump over the window, nearly all of 0.2·60·√π.
        let area = 0.2 * 60.0 * std::f64::consts::PI.sqrt();
        assert!((window.mean * (window.until - window.from) / area - 1.0).abs() < 0.05);
        // Only noise is left: 1 ± √(2/1200) = 0.04, minus what the walk has absorbed, less than a tenth: it resolves
        // some 10 s with outputs at 1 Hz.
        for (output, noise) in noise.iter().enumerate() {
            let left = found.residuals.iter().skip(output).step_by(2);
            let mean_square = left.map(|r| (r / noise).powi(2)).sum::<f64>() / 1200.0;
            assert!(mean_square < 1.0 + 4.0 * 0.04, "{mean_square}");
            assert!(mean_square > 0.9 - 4.0 * 0.04, "{mean_square}");
        }
    }
}

#[test]
fn the_equation_that_lacks_something_explains_most() {
    // Only a term missing in the first equation shows in both outputs. (One missing in the second shows only in y, and
    // could be an error of y's sensor.)
    let case = two_lags(1200);
    let noise = [0.01, 0.02];
    let truth = case.place(PlaceKind::Equation, "first");
    let mut missing = case.nothing_missing();
    missing[truth] = case.times.iter().map(|t| if *t > 500.0 { 0.05 } else { 0.0 }).collect();
    let residuals = case.residuals(&missing, &noise, 3);
    let deviations = case.deviations();
    let gain = |place| {
        unknown_input(&deviations, place, &residuals, &white(&noise)).map_or(0.0, |d| d.gain)
    };
    let best = gain(truth);
    for place in case.physics_and_sensors().into_iter().filter(|place| *place != truth) {
        // An offset of 0.25 m in one of the outputs stays unexplained: 700 samples of 12σ or more.
        assert!(gain(place) < 0.9 * best, "{place}: {} of {best}", gain(place));
    }
}

#[test]
fn an_exact_equation_lacks_nothing() {
    let text = "model cart\ninput F [N] hold\nstate x [m] = 0\nstate v [m/s] = 0\n\
                equation speed: der(x) = v exact\n\
                equation force: 2 [kg] * der(v) = F - 1 [N*s/m]*v\noutput x noise 1 [mm]\n";
    let case = Case::new(text, &[], vec![0.0, 1.0]);
    let places: Vec<&str> = case.model.places().iter().map(|place| place.name.as_str()).collect();
    assert_eq!(places, ["force", "F", "x"]);
}

#[test]
fn nothing_hidden_gains_nothing() {
    let case = two_lags(600);
    let noise = [0.01, 0.02];
    let deviations = case.deviations();
    let mut large = 0;
    for seed in 0..40 {
        let residuals = case.residuals(&case.nothing_missing(), &noise, seed);
        for place in case.physics_and_sensors() {
            let found =
                unknown_input(&deviations, place, &residuals, &white(&noise)).expect("seen");
            assert_eq!(found.windows, [], "seed {seed}, place {place}: gain {}", found.gain);
            large += usize::from(found.gain > 2.0);
        }
    }
    // ½ P(χ²₁ > 4) = 2.3 % of 160, which are dependent: 3.6 expected.
    assert!(large <= 12, "{large}");
}

#[test]
fn correlated_noise_is_not_what_is_missing() {
    // As much correlated noise as white, with a correlation time of 12 s: averages over some minutes carry five times
    // less information than with white noise.
    let case = two_lags(1200);
    let (stds, memory) = ([0.01, 0.02], 12.0);
    let noise = stds.map(|std| {
        Some(SensorNoise { colour: Some(NoiseColour { std, memory }), ..SensorNoise::known(std) })
    });
    let deviations = case.deviations();
    let place = case.place(PlaceKind::Equation, "first");
    let coloured = |seed: u64, missing: &[Vec<f64>]| {
        let mut residuals = case.residuals(missing, &stds, seed);
        let mut normal = Normal::new(1000 + seed);
        let phi = (-1.0 / memory).exp();
        for (output, std) in stds.iter().enumerate() {
            let mut v = std * normal.next();
            for r in residuals.iter_mut().skip(output).step_by(2) {
                *r += v;
                v = phi * v + std * (1.0 - phi * phi).sqrt() * normal.next();
            }
        }
        residuals
    };
    let (mut taken_for_white, mut large) = (0, 0);
    for seed in 0..20 {
        let residuals = coloured(seed, &case.nothing_missing());
        for place in case.physics_and_sensors() {
            let found = unknown_input(&deviations, place, &residuals, &noise).expect("seen");
            assert_eq!(found.windows, [], "seed {seed}, place {place}: gain {}", found.gain);
            large += usize::from(found.gain > 2.0);
        }
        let total = stds.map(|std| 2.0_f64.sqrt() * std);
        let found = unknown_input(&deviations, place, &residuals, &white(&total)).expect("seen");
        taken_for_white += usize::from(!found.windows.is_empty());
    }
    // ½ P(χ²₁ > 4) = 2.3 % of 80, which are dependent: 1.8 expected.
    assert!(large <= 7, "{large}");
    assert!(taken_for_white > 10, "{taken_for_white}");

    let d: Vec<f64> =
        case.times.iter().map(|t| 0.2 * (-((t - 550.0) / 60.0).powi(2)).exp()).collect();
    let mut missing = case.nothing_missing();
    missing[place].clone_from(&d);
    for seed in 0..3 {
        let found = unknown_input(&deviations, place, &coloured(seed, &missing), &noise);
        let found = found.expect("seen");
        assert_recovered(&found, &d, 0.0);
        assert!(found.gain > 100.0, "{}", found.gain);
    }
}

#[test]
fn missing_samples_and_uneven_times_are_taken_as_they_are() {
    let mut normal = Normal::new(21);
    let mut t = 0.0;
    let times: Vec<f64> = (0..900)
        .map(|_| {
            t += 0.3 + 1.4 * normal.uniform();
            t
        })
        .collect();
    let mut case = Case::new(TWO_LAGS, &[], times);
    case.inputs = vec![case.times.iter().map(|t| (t / 80.0).sin()).collect()];
    let noise = [0.01, 0.02];
    let d: Vec<f64> = case.times.iter().map(|t| 0.1 * (t / 100.0).sin()).collect();
    let place = case.place(PlaceKind::Equation, "first");
    let mut missing = case.nothing_missing();
    missing[place].clone_from(&d);
    let mut residuals = case.residuals(&missing, &noise, 2);
    for (k, r) in residuals.iter_mut().enumerate() {
        if k % 3 == 0 || (600..700).contains(&k) {
            *r = f64::NAN;
        }
    }
    let found = unknown_input(&case.deviations(), place, &residuals, &white(&noise)).expect("seen");
    assert_recovered(&found, &d, 0.0);
    assert!(found.residuals[600..700].iter().all(|r| r.is_nan()));
    assert!(found.residuals[704].is_finite());
}

/// The recordings of the riser: pump and booster vary, the return flow is poorly measured.
fn riser(variant: &str, n: usize) -> Case {
    let mut case = Case::new(&model_text("mud_circulation"), &[("flow", variant)], seconds(n));
    let lpm = 1e-3 / 60.0;
    // Balanced at 50 m level, so that the level stays in the riser.
    let boost = |t: f64| lpm * (1650.0 + 250.0 * (t / 300.0).sin());
    let speed = |t: f64| 0.55 + 0.01 * (t / 300.0).sin();
    case.inputs = vec![
        case.times.iter().map(|t| speed(*t)).collect(),
        case.times.iter().map(|t| boost(*t)).collect(),
        vec![lpm * 250.0; n],
    ];
    case
}

/// An unmeasured flow into the riser: equation riser lacks −flow on its right-hand side.
fn flow_into_the_riser(variant: &str) {
    let n = 2000;
    let case = riser(variant, n);
    let noise = [1e3, 1e3, 1e3, 15e-3 / 60.0];
    // 120 lpm between 800 s and 1100 s, with ramps of 60 s.
    let lpm = 1e-3 / 60.0;
    let flow = |t: f64| 120.0 * lpm * ((t - 800.0).min(1100.0 - t) / 60.0).clamp(0.0, 1.0);
    let d: Vec<f64> = case.times.iter().map(|t| -flow(*t)).collect();
    let riser = case.place(PlaceKind::Equation, "riser");
    assert_eq!(case.model.places()[riser].unit, "m^3/s");

    // As in the field: the booster delivers more than its input says.
    let mut altered = riser_with_more_boost(&case, &d);
    let (measured, _) = altered.simulate(&altered.nothing_missing());
    altered.inputs.clone_from(&case.inputs);
    let (simulated, _) = altered.simulate(&altered.nothing_missing());
    let mut normal = Normal::new(8);
    let residuals: Vec<f64> = measured
        .iter()
        .zip(&simulated)
        .zip(noise.iter().cycle())
        .map(|((m, s), noise)| m - s + noise * normal.next())
        .collect();

    let deviations = case.deviations();
    let found = unknown_input(&deviations, riser, &residuals, &white(&noise)).expect("seen");
    // The model is nonlinear over 8 m of level: a hundredth of the flow.
    assert_recovered(&found, &d, 1.2 * lpm);
    let [window] = &found.windows[..] else { panic!("{:?}", found.windows) };
    assert!((window.from - 800.0).abs() < 40.0 && (window.until - 1100.0).abs() < 40.0);
    assert!((window.mean / lpm + 100.0).abs() < 15.0, "{}", window.mean / lpm);
    for place in case.physics_and_sensors().into_iter().filter(|place| *place != riser) {
        let other = unknown_input(&deviations, place, &residuals, &white(&noise));
        assert!(other.is_none_or(|other| other.gain < found.gain), "{place}");
    }
}

fn riser_with_more_boost(case: &Case, d: &[f64]) -> Case {
    let mut inputs = case.inputs.clone();
    for (boost, d) in inputs[1].iter_mut().zip(d) {
        *boost -= d;
    }
    Case { model: case.model.clone(), p: case.p.clone(), times: case.times.clone(), inputs }
}

#[test]
fn a_flow_into_the_riser_is_found_in_cubic_metres_per_second() {
    flow_into_the_riser("dynamic");
}

#[test]
fn a_flow_into_the_riser_is_found_with_a_static_return_line() {
    flow_into_the_riser("static");
}

#[test]
fn a_sensor_that_drifts_is_found_in_its_own_unit() {
    let case = riser("dynamic", 1500);
    let noise = [1e3, 1e3, 1e3, 15e-3 / 60.0];
    let place = case.place(PlaceKind::Output, "p_in");
    assert_eq!(case.model.places()[place].unit, "Pa");
    let d: Vec<f64> = case.times.iter().map(|t| 5e3 * (t / 1500.0)).collect();
    let found = case.estimate(place, &d, &noise, 4);
    assert_recovered(&found, &d, 0.0);
    assert!(found.gain > 100.0);
}

#[test]
fn what_no_sensor_sees_is_not_estimated() {
    let text = TWO_LAGS.replace("output y [m]\n", "");
    let mut case = Case::new(&text, &[], seconds(100));
    case.inputs = vec![vec![0.0; 100]];
    let residuals = vec![0.1; 100];
    let deviations = case.deviations();
    let second = case.place(PlaceKind::Equation, "second");
    assert_eq!(unknown_input(&deviations, second, &residuals, &white(&[0.1])), None);
    let first = case.place(PlaceKind::Equation, "first");
    assert_eq!(unknown_input(&deviations, first, &residuals, &white(&[0.0])), None);
    assert_eq!(unknown_input(&deviations, first, &[f64::NAN; 100], &white(&[0.1])), None);
    assert!(unknown_input(&deviations, first, &residuals, &white(&[0.1])).is_some());
}

#[test]
fn one_sample_is_no_trajectory() {
    let mut case = two_lags(2);
    let (_, mut nominal) = case.simulate(&case.nothing_missing());
    nominal.times.truncate(1);
    nominal.y.truncate(nominal.n);
    case.times.truncate(2);
    let found = Deviations::linearize(&case.model, &case.p, &case.recorded(&[]), &nominal);
    assert_eq!(found.err(), Some(DeviationError::TooShort));
}

#[test]
fn a_leak_that_takes_the_level_far_is_reconstructed_where_it_led() {
    let text = "
model tank
input q_in [m^3/s] hold
parameter a [m^(5/2)/s] = 0.02
state h [m] = 4
equation level: 3 [m^2] * der(h) = q_in - a*sqrt(h)
output h [m]
";
    let n = 3000;
    let mut case = Case::new(text, &[], seconds(n));
    case.inputs = vec![vec![0.04; n]];
    let noise = [5e-3];
    let place = case.place(PlaceKind::Equation, "level");
    // Half of the inflow leaks from 300 s on: the level falls from 4 m to 1 m.
    let d: Vec<f64> =
        case.times.iter().map(|t| -0.02 * ((t - 300.0) / 100.0).clamp(0.0, 1.0)).collect();
    let mut missing = case.nothing_missing();
    missing[place].clone_from(&d);
    let (mut measured, _) = case.simulate(&missing);
    let mut normal = Normal::new(6);
    for w in &mut measured {
        *w += noise[0] * normal.next();
    }
    let (simulated, _) = case.simulate(&case.nothing_missing());
    let residuals: Vec<f64> = measured.iter().zip(&simulated).map(|(m, s)| m - s).collect();

    let first = unknown_input(&case.deviations(), place, &residuals, &white(&noise)).expect("seen");
    let inputs = case.recorded(&[]);
    let recording = ReconstructedRecording {
        p: &case.p,
        inputs: &inputs,
        start: &[],
        times: &case.times,
        measured: &measured,
        noise: &white(&noise),
    };
    let options = Options::default();
    let again = |earlier: &UnknownInput| {
        reconstruct(&case.model, &recording, place, earlier, &options)
            .expect("a solution")
            .expect("seen")
    };
    let second = again(&first);
    let third = again(&second);
    assert_recovered(&third, &d, 0.0);
    // At rest at 1 m, seven time constants later: the outflow a √h has a slope of a/4 at 4 m, so that
    // the first estimate takes 3·a/4 = 0.015 for the 0.02 that is missing.
    let end = |found: &UnknownInput| found.estimate[2500..2900].iter().sum::<f64>() / 400.0;
    assert!((end(&first) + 0.015).abs() < 2e-4, "{}", end(&first));
    assert!((end(&third) + 0.02).abs() < 2e-4, "{}", end(&third));
}
