//! Regressions on made-up and on recorded data, against formulas, other computations of the same, and the
//! numbers of Haukanes 2015, chapter 3.

#[path = "profiles.rs"]
mod profiles;

use std::path::Path;

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_execute::LoadedSystem;
use dgd_identify::regression::{
    FollowOptions, Forgetting, Normalisation, RegressionError, RegressionFit, RegressionMethod,
    RegressionProblem, RowOf, RowsLeftOut, follow, regress,
};
use dgd_identify::{BoundReached, Prior, Recording};
use dgd_runtime::{InputColumn, Inputs, Interpolation, System};

use crate::recorded::recorded;
use crate::support;
use crate::support::Noise;

/// The pump as §3.5 and §3.5.1 have it, between the readings of inlet A and outlet A, whose offset of 0.06
/// bar is known from no flow, and with the corrected flow.
const PUMP: &str = "\
model pump
constant g [m/s^2] = 9.81
constant rho [kg/m^3] = 1120
constant offset [bar] = 0.06
input w_ssp [%] linear
input q_ssp [lpm] linear
input p_in_A [barg] linear
parameter c0 [m] = 250 in 0 ..
parameter c1 [s/m^2] = 10 in 0 ..
parameter c2 [s^2/m^5] = 8e3 in 0 ..
parameter k [1] = 2 in 1 .. 4
let q = 0.951*q_ssp
output p_out_A [barg] = p_in_A + offset + rho*g*(c0*w_ssp^k - c1*w_ssp*q - c2*q^2)
";

/// The return line's friction, §3.4.
const FRICTION: &str = "\
model friction
constant g [m/s^2] = 9.81
constant rho [kg/m^3] = 1120
constant h_out [m] = 302
constant offset [bar] = 0.06
input q_ssp [lpm] linear
parameter F1 [Pa*s/m^3] = 0
parameter F2 [Pa*s^2/m^6] = 1e8
parameter F3 [Pa*s^3/m^9] = 0
parameter F4 [Pa*s^4/m^12] = 0
let q = 0.951*q_ssp
output p_out_A [barg] = rho*g*h_out + offset + F1*q + F2*q^2 + F3*q^3 + F4*q^4
";

/// The riser with the correction of the return flow, 3.9.
const RISER: &str = "\
model riser
constant g [m/s^2] = 9.81
constant rho [kg/m^3] = 1120
constant h_in [m] = 307
constant d_r [in] = 19.75
let A_r = pi/4*d_r^2
input q_ssp [lpm] linear
input q_boost [lpm] linear
input q_tf [lpm] linear
parameter theta_1 [1] = 1
state h_r [m] = 150
equation riser: A_r*der(h_r) = theta_1*q_ssp - q_boost - q_tf
output p_in_A [barg] = rho*g*(h_in - h_r)
";

struct Case {
    system: LoadedSystem,
    p: Vec<f64>,
    recordings: Vec<Recording>,
}

impl Case {
    /// A model and recordings of `examples/data/field/`, with these parameters free.
    fn of(text: &str, free: &[&str], files: &[&str]) -> Self {
        let free = free.iter().map(|text| support::name(text)).collect();
        let directions = SensitivityDirections::Estimated { free, fixed: Vec::new() };
        let path = Path::new("model.dgd");
        let compiled = support::compiled_text(path, text.to_owned(), (&[], &[]), &directions);
        let file = |name: &&str| support::root().join(format!("examples/data/field/{name}.csv.gz"));
        let recordings = files.iter().map(|name| recorded(&compiled, &file(name))).collect();
        Self::loaded(LoadedSystem::new(compiled.program), recordings)
    }

    /// A model and a recording that was made up.
    fn made_up(text: &str, recording: Recording) -> Self {
        let directions = SensitivityDirections::Estimated { free: Vec::new(), fixed: Vec::new() };
        let path = Path::new("model.dgd");
        let compiled = support::compiled_text(path, text.to_owned(), (&[], &[]), &directions);
        Self::loaded(LoadedSystem::new(compiled.program), vec![recording])
    }

    fn loaded(system: LoadedSystem, recordings: Vec<Recording>) -> Self {
        let p = system.signature().parameters.iter().map(|p| p.value).collect();
        Self { system, p, recordings }
    }

    fn problem(&self) -> RegressionProblem<'_> {
        RegressionProblem::new(&self.system, &self.p, &self.recordings)
    }

    fn fit(&self, method: RegressionMethod) -> RegressionFit {
        regress(&self.problem(), method).unwrap_or_else(|error| panic!("{error}"))
    }
}

fn value(fit: &RegressionFit, name: &str) -> f64 {
    let found = fit.estimates.iter().find(|estimate| estimate.name == name);
    found.unwrap_or_else(|| panic!("{name} is not estimated")).value
}

/// Inputs and outputs at times 0, h, 2h, …
fn made_up(
    h: f64,
    n: usize,
    inputs: &[(&str, &dyn Fn(f64) -> f64)],
    outputs: &[&dyn Fn(f64) -> f64],
) -> Recording {
    let times: Vec<f64> = (0..n).map(|k| h * k as f64).collect();
    let sampled = |f: &dyn Fn(f64) -> f64| times.iter().map(|t| f(*t)).collect::<Vec<f64>>();
    let values: Vec<Vec<f64>> = inputs.iter().map(|(_, f)| sampled(f)).collect();
    let columns: Vec<InputColumn<'_>> = inputs
        .iter()
        .zip(&values)
        .map(|((name, _), values)| InputColumn {
            name,
            interpolation: Interpolation::Linear,
            values,
        })
        .collect();
    let inputs = Inputs::recorded(&times, &columns).expect("inputs");
    let measured = outputs.iter().map(|f| Some(sampled(*f))).collect();
    Recording::new(times, inputs, measured)
}

#[test]
fn friction_of_fourth_order_fits_a_little_better_than_of_second() {
    let second = Case::of(FRICTION, &["F1", "F2"], &["pump_tests"]);
    let second_order = second.fit(RegressionMethod::LeastSquares);
    let fourth = Case::of(FRICTION, &[], &["pump_tests"]);
    let fourth_order = fourth.fit(RegressionMethod::LeastSquares);
    let quality = |fit: &RegressionFit| fit.rows[0].r_squared.expect("pressures differ");
    println!("R² {} {}", quality(&second_order), quality(&fourth_order));
    assert!(quality(&second_order) > 0.99 && quality(&second_order) < quality(&fourth_order));
    assert_eq!((second_order.rank, fourth_order.rank), (2, 4));
    assert!(second_order.condition_number < fourth_order.condition_number);

    // The normal equations of the same rows, from the recording itself.
    let Recording { times, inputs, measured, .. } = &second.recordings[0];
    let pressure = measured[0].as_ref().expect("it was measured");
    let (mut a, mut b) = ([[0.0; 2]; 2], [0.0; 2]);
    for (t, p) in times.iter().zip(pressure) {
        let mut u = [0.0];
        inputs.value(*t, dgd_runtime::LimitSide::Right, &mut u);
        let q = 0.951 * u[0];
        let z = p - 1120.0 * 9.81 * 302.0 - 0.06e5;
        let phi = [q, q * q];
        for i in 0..2 {
            b[i] += phi[i] * z;
            for j in 0..2 {
                a[i][j] += phi[i] * phi[j];
            }
        }
    }
    let determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    let f1 = (b[0] * a[1][1] - a[0][1] * b[1]) / determinant;
    let f2 = (a[0][0] * b[1] - b[0] * a[1][0]) / determinant;
    for (name, expected) in [("F1", f1), ("F2", f2)] {
        let found = value(&second_order, name);
        assert!((found / expected - 1.0).abs() < 1e-8, "{name}: {found} {expected}");
    }
}

#[test]
fn the_pumps_cross_term_is_driven_to_its_bound() {
    // Section 3.5: with the square of the speed c1 comes out negative, which is infeasible.
    let case = Case::of(PUMP, &[], &["pump_tests"]);
    let mut problem = case.problem();
    problem.free[3] = false;
    let free = regress(&problem, RegressionMethod::LeastSquares).expect("a fit");
    assert!(value(&free, "c1") < -100.0, "{:?}", free.estimates);
    assert!(free.unbounded.is_none());
    let bounded = regress(&problem, RegressionMethod::Bounded).expect("a fit");
    let c1 = &bounded.estimates[1];
    assert_eq!((c1.value, c1.at_bound, c1.std), (0.0, Some(BoundReached::Lower), None));
    let unbounded = bounded.unbounded.as_ref().expect("a bound is active");
    for (j, estimate) in free.estimates.iter().enumerate() {
        assert!((unbounded[j] / estimate.value - 1.0).abs() < 1e-9);
    }
    // At c1 = 0 the others are those of the model without it.
    problem.free[1] = false;
    let p = [case.p[0], 0.0, case.p[2], 2.0];
    let without = RegressionProblem { p: &p, ..problem };
    let without = regress(&without, RegressionMethod::LeastSquares).expect("a fit");
    for name in ["c0", "c2"] {
        let (with, without) = (value(&bounded, name), value(&without, name));
        assert!((with / without - 1.0).abs() < 1e-9, "{name}: {with} {without}");
    }
}

#[test]
fn the_exponent_of_the_speed_is_the_same_by_simplex_and_by_projection() {
    let case = Case::of(PUMP, &[], &["pump_tests"]);
    let p = [case.p[0], 0.0, case.p[2], case.p[3]];
    let mut problem = RegressionProblem { p: &p, ..case.problem() };
    problem.free[1] = false;
    let projection = regress(&problem, RegressionMethod::VariableProjection).expect("a fit");
    let simplex = regress(&problem, RegressionMethod::NelderMead).expect("a fit");
    assert_eq!(projection.linear, [true, true, false]);
    // The least of a sum of squares is flat: 1e-13 of it is 1e-6.5 of a variable's deviation.
    for (a, b) in projection.estimates.iter().zip(&simplex.estimates) {
        let std = a.std.expect("determined");
        assert!((a.value - b.value).abs() < 1e-3 * std, "{a:?} {b:?}");
    }
    println!(
        "k {} in {} and {} evaluations",
        value(&projection, "k"),
        projection.evaluations,
        simplex.evaluations
    );
    // What is true (`examples/data/field/README.md`): k = 2.2, c0 = 295, c2 = 9000; as `tests/thesis/field_data.rs` has it.
    assert!((value(&projection, "k") - 2.2).abs() < 0.011);
    assert!((value(&projection, "c0") / 295.0 - 1.0).abs() < 0.01);
    assert!((value(&projection, "c2") / 9.0e3 - 1.0).abs() < 0.01);
    // Section 3.5.1: the free exponent cuts the error by more than ten.
    problem.free[3] = false;
    let square = regress(&problem, RegressionMethod::LeastSquares).expect("a fit");
    let ratio = square.rows[0].mean_squared_error / projection.rows[0].mean_squared_error;
    assert!(ratio > 10.0, "{ratio}");
    let error = regress(&case.problem(), RegressionMethod::LeastSquares).expect_err("k");
    assert_eq!(
        error,
        RegressionError::NotLinear { parameters: vec![("k".into(), "p_out_A".into())] }
    );
}

#[test]
fn the_correction_of_the_return_flow_is_that_of_the_thesis() {
    // Section 3.6: Λ = 5s + 1, m 1, θ₀ 1, P₀ 10, and β 0.1 or none.
    let case = Case::of(RISER, &[], &["normal_circulation"]);
    let options = |rate: f64| FollowOptions {
        time_constants: vec![5.0],
        start_variance: 10.0,
        forgetting: Forgetting { rate, ..Forgetting::default() },
    };
    let all = follow(&case.problem(), &options(0.0)).expect("it follows");
    let theta = value(&all.fit, "theta_1");
    println!("θ₁ {theta} without forgetting");
    assert!((theta - 0.951).abs() < 0.01, "{theta}");
    let forgetting = follow(&case.problem(), &options(0.1)).expect("it follows");
    assert_eq!(forgetting.times.len(), 3601);
    // It follows noise of the last 10 s, so that it is the mean that settles.
    let settled: Vec<f64> = forgetting
        .times
        .iter()
        .zip(&forgetting.estimates)
        .filter(|((_, t), _)| *t >= 60.0)
        .map(|(_, estimates)| estimates[0])
        .collect();
    let mean = settled.iter().sum::<f64>() / settled.len() as f64;
    let widest = settled.iter().map(|theta| (theta - mean).abs()).fold(0.0, f64::max);
    println!("θ₁ {mean} ± {widest} with β = 0.1, P {}", forgetting.covariance[(0, 0)]);
    assert!((mean - 0.951).abs() < 0.01, "{mean}");
    // A constant regressor has P = β/φ² in the end: φ = q/A_r.
    assert!(forgetting.covariance[(0, 0)] > 0.0 && forgetting.covariance[(0, 0)] < 10.0);

    let batch = case.fit(RegressionMethod::LeastSquares);
    assert!((value(&batch, "theta_1") - 0.951).abs() < 0.01, "{:?}", batch.estimates);
    assert_eq!(batch.rows[0].of, RowOf::Equation(0));
}

/// A mass on a spring with a damper, driven: x = sin t + sin 2t/2, v = ẋ, F = m v̇ + d v + k x.
const SPRING: &str = "\
model spring
input F [N] linear
parameter m [kg] = 1 in 0.1 ..
parameter d [N*s/m] = 1
parameter k [N/m] = 1
state x [m] = 0
state v [m/s] = 2
equation motion: der(x) = v
equation force: m*der(v) = F - d*v - k*x
output x [m]
output v [m/s]
";

fn spring(h: f64) -> Recording {
    let x = |t: f64| t.sin() + 0.5 * (2.0 * t).sin();
    let v = |t: f64| t.cos() + (2.0 * t).cos();
    let force = move |t: f64| 3.0 * (-t.sin() - 2.0 * (2.0 * t).sin()) + 0.7 * v(t) + 5.0 * x(t);
    made_up(h, (20.0 / h) as usize, &[("F", &force)], &[&x, &v])
}

#[test]
fn an_equation_with_a_factor_is_linear_once_it_is_multiplied() {
    let case = Case::made_up(SPRING, spring(0.01));
    let fit = case.fit(RegressionMethod::LeastSquares);
    assert_eq!(fit.rows[0].multiplied_by.as_deref(), Some("m"));
    assert_eq!(fit.linear, [true; 3]);
    // Slopes over 0.05 s either side err by 0.05²/10 of the third derivative, 8 at most, of 2: 1e-3.
    for (name, truth) in [("m", 3.0), ("d", 0.7), ("k", 5.0)] {
        let found = value(&fit, name);
        assert!((found - truth).abs() < 5e-3, "{name}: {found}");
    }
    // Filtered, no slope is taken: what is left is the straight lines between samples, 0.01²/8 of the
    // second derivatives, 1e-4.
    let options = FollowOptions {
        time_constants: vec![0.3],
        start_variance: 1e6,
        forgetting: Forgetting::default(),
    };
    let followed = follow(&case.problem(), &options).expect("it follows");
    for (name, truth) in [("m", 3.0), ("d", 0.7), ("k", 5.0)] {
        let found = value(&followed.fit, name);
        assert!((found - truth).abs() < 2e-3, "{name}: {found}");
    }
    // Normalised, and in a filter of second order, it is the same.
    let normalised = FollowOptions {
        time_constants: vec![0.3, 0.2],
        forgetting: Forgetting {
            rate: 0.05,
            normalisation: Normalisation::Regressors,
            ..Forgetting::default()
        },
        ..options
    };
    let followed = follow(&case.problem(), &normalised).expect("it follows");
    for (name, truth) in [("m", 3.0), ("d", 0.7), ("k", 5.0)] {
        let found = value(&followed.fit, name);
        assert!((found - truth).abs() < 5e-3, "{name}: {found}");
    }
}

#[test]
fn samples_that_move_can_be_left_out() {
    let case = Case::made_up(SPRING, spring(0.01));
    let all = case.fit(RegressionMethod::LeastSquares);
    let slow = RegressionProblem { steady: vec![(1, 1.0)], ..case.problem() };
    let slow = regress(&slow, RegressionMethod::LeastSquares).expect("a fit");
    // v̇ = −sin t − 2 sin 2t is below 1 for about a third of the time.
    let part = slow.samples as f64 / all.samples as f64;
    assert!((0.2..0.5).contains(&part), "{part}");
    assert!((value(&slow, "k") - 5.0).abs() < 5e-3);
}

#[test]
fn rows_that_read_no_state_obey_limits_of_states_too() {
    // `gain` reads the input alone: at samples that are not steady it is off.
    let text = format!("{SPRING}parameter c [1/N] = 1\noutput gain [1] = c*F\n");
    let mut recording = spring(0.01);
    let rate = |t: f64| -t.sin() - 2.0 * (2.0 * t).sin();
    let force = |t: f64| {
        let (x, v) = (t.sin() + 0.5 * (2.0 * t).sin(), t.cos() + (2.0 * t).cos());
        3.0 * rate(t) + 0.7 * v + 5.0 * x
    };
    let gain = |t: &f64| if rate(*t).abs() < 1.3 { 2.0 } else { 50.0 } * force(*t);
    recording.measured.push(Some(recording.times.iter().map(gain).collect()));
    let case = Case::made_up(&text, recording);
    let slow = RegressionProblem { steady: vec![(1, 1.0)], ..case.problem() };
    let fit = regress(&slow, RegressionMethod::LeastSquares).expect("a fit");
    assert!((value(&fit, "c") - 2.0).abs() < 1e-9, "{}", value(&fit, "c"));
}

#[test]
fn without_a_steady_sample_it_is_said_how_slow_they_are() {
    let case = Case::made_up(SPRING, spring(0.01));
    let slow = RegressionProblem { steady: vec![(1, 1e-9)], ..case.problem() };
    let error = regress(&slow, RegressionMethod::LeastSquares).expect_err("nothing is steady");
    let RegressionError::NothingSteady { unknowns } = &error else { panic!("{error}") };
    assert!(unknowns[0].slowest > 1e-9 && unknowns[0].slowest < 0.05, "{error}");
    assert!(error.to_string().starts_with("no sample is steady: `v` moves by "), "{error}");
}

const LINE: &str = "\
model line
input x [1] linear
parameter a [1] = 0
parameter b [1] = 0
output y [1] = a + b*x
";

#[test]
fn estimates_scatter_as_their_covariance_says() {
    // Uniform noise in (−1, 1) has the variance 1/3.
    let (n_seeds, mut squares) = (300, [0.0; 2]);
    for seed in 0..n_seeds {
        let mut noise = Noise::new(seed);
        let errors: Vec<f64> = (0..40).map(|_| noise.next()).collect();
        let y = |t: f64| 1.0 + 0.5 * t + errors[t as usize];
        let case = Case::made_up(LINE, made_up(1.0, 40, &[("x", &|t| t)], &[&y]));
        let fit = case.fit(RegressionMethod::LeastSquares);
        for ((sum, estimate), truth) in squares.iter_mut().zip(&fit.estimates).zip([1.0, 0.5]) {
            let error = (estimate.value - truth) / estimate.std.expect("determined");
            *sum += error * error;
        }
        // Closed form: ρ = −x̄/√(mean of x²).
        let rho = -19.5 / f64::sqrt((0..40).map(|k| f64::from(k * k)).sum::<f64>() / 40.0);
        assert!((fit.correlation(0, 1).expect("determined") - rho).abs() < 1e-12);
    }
    // Student's t of 38 degrees of freedom squared: mean 38/36, and about √(2n) of scatter; five times.
    let n = n_seeds as f64;
    for sum in squares {
        assert!((sum - n * 38.0 / 36.0).abs() < 5.0 * (2.0 * n).sqrt() * 1.1, "{sum}");
    }
}

#[test]
fn parameters_that_cancel_are_named_and_stay_near_their_start() {
    let text = "\
model sum
input x [1] linear
parameter a [1] = 1
parameter b [1] = 2
parameter c [1] = 5
output y [1] = (a + b)*x
output z [1] = c*0*x + x
";
    let case = Case::made_up(
        text,
        made_up(1.0, 20, &[("x", &|t| t)], &[&|t| 4.0 * t + 0.01 * (9.0 * t).sin(), &|t| t]),
    );
    match regress(&case.problem(), RegressionMethod::LeastSquares) {
        Err(RegressionError::NotRead { parameter }) => assert_eq!(parameter, "c"),
        other => panic!("{other:?}"),
    }
    let mut problem = case.problem();
    problem.free[2] = false;
    for method in [RegressionMethod::LeastSquares, RegressionMethod::Bounded] {
        let fit = regress(&problem, method).expect("a fit");
        assert_eq!((fit.rank, fit.undetermined.len()), (1, 1));
        let (a, b) = (value(&fit, "a"), value(&fit, "b"));
        // The sum is seen; the difference is not, and stays.
        assert!((a + b - 4.0).abs() < 1e-3 && (b - a - 1.0).abs() < 1e-9, "{a} {b}");
        assert!(fit.estimates.iter().all(|estimate| estimate.std.is_none()));
        let changes: Vec<f64> = fit.undetermined[0].terms.iter().map(|term| term.change).collect();
        // One up by 1 %, the other down by as much: of 1 and 2.
        assert!((changes[0] / changes[1] + 2.0).abs() < 1e-9, "{changes:?}");
    }
    // A prior tells them apart.
    problem.priors = vec![Prior::normal(0, 3.0, 0.1)];
    let fit = regress(&problem, RegressionMethod::LeastSquares).expect("a fit");
    assert!((value(&fit, "a") - 3.0).abs() < 1e-9 && (value(&fit, "b") - 1.0).abs() < 1e-3);
    assert_eq!(fit.rank, 2);
}

#[test]
fn an_unknown_that_no_output_gives_is_named() {
    let text = SPRING.replace("output v [m/s]\n", "");
    let case = Case::made_up(&text, {
        let mut recording = spring(0.1);
        recording.measured.truncate(1);
        recording
    });
    let error =
        regress(&case.problem(), RegressionMethod::LeastSquares).expect_err("v is not known");
    assert_eq!(
        error,
        RegressionError::NotReconstructed {
            parameter: "m".into(),
            row: "force".into(),
            unknown: "v".into(),
            taken: Vec::new(),
        }
    );
    let short = Case::made_up(LINE, made_up(1.0, 1, &[("x", &|t| t)], &[&|t| t]));
    let error = regress(&short.problem(), RegressionMethod::LeastSquares).expect_err("one sample");
    assert_eq!(error, RegressionError::TooFewRows { rows: 1, free: 2 });
}

/// An input over time: its name, what it does between samples, and its values.
type Driven<'a> = (&'a str, Interpolation, &'a dyn Fn(f64) -> f64);

/// A recording of a model's own run with other values of some parameters, all outputs read without error.
fn simulated(
    text: &str,
    truth: &[(&str, f64)],
    h: f64,
    n: usize,
    inputs: &[Driven<'_>],
) -> (Recording, dgd_runtime::Solution) {
    let times: Vec<f64> = (0..n).map(|k| h * k as f64).collect();
    let sampled: Vec<Vec<f64>> =
        inputs.iter().map(|(_, _, f)| times.iter().map(|t| f(*t)).collect()).collect();
    let columns: Vec<InputColumn<'_>> = inputs
        .iter()
        .zip(&sampled)
        .map(|((name, interpolation, _), values)| InputColumn {
            name,
            interpolation: *interpolation,
            values,
        })
        .collect();
    let inputs = if columns.is_empty() {
        Inputs::none()
    } else {
        Inputs::recorded(&times, &columns).expect("inputs")
    };
    let directions = SensitivityDirections::None;
    let path = Path::new("model.dgd");
    let compiled = support::compiled_text(path, text.to_owned(), (&[], &[]), &directions);
    let system = LoadedSystem::new(compiled.program);
    let parameters = &system.signature().parameters;
    let of = |p: &dgd_runtime::Parameter| truth.iter().find(|(name, _)| *name == p.name);
    let p: Vec<f64> =
        parameters.iter().map(|p| of(p).map_or(p.value, |(_, value)| *value)).collect();
    let problem = dgd_runtime::Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let tight =
        dgd_runtime::Options { rtol: 1e-11, atol: 1e-11, ..dgd_runtime::Options::default() };
    let solution = dgd_runtime::simulate(&problem, &times, &tight).expect("a run");
    let seen = dgd_runtime::observe(&problem, &solution);
    let n_w = seen.n_w;
    let measured = (0..n_w).map(|i| Some((0..n).map(|k| seen.w(k)[i]).collect())).collect();
    (Recording::new(times, inputs, measured), solution)
}

/// The riser with a booster line that goes on after its pump has slowed down, and comes back (Haukanes 2015:
/// 3.9, 3.13, 3.14): no sensor sees what comes out of the line.
const RISER_AND_LINE: &str = "\
model riser_and_line
constant rho [kg/m^3] = 1120
constant g [m/s^2] = 9.81
constant wobble [lpm] = 20
input q_boost [lpm] linear
parameter A_r [m^2] = 0.15
parameter theta_1 [1] = 1
parameter tau_d [s] = 30
parameter tau_b [s] = 10
parameter theta_i [1/s] = 0.05
state h_r [m] = 150
state q_ssp [lpm] = 2000
state q_bo [lpm] = q_boost  fixed
equation riser: A_r*der(h_r) = theta_1*q_ssp - q_bo
equation pump: der(q_ssp) = (2000 [lpm] - q_ssp + 8 [lpm/m]*(150 [m] - h_r))/(20 [s])
modes line {
  full { equation outlet: q_bo = q_boost }
  ramp_down { equation outlet: tau_b*der(q_bo) = delay(q_boost, tau_d) - q_bo }
  ramp_up { equation outlet: der(q_bo) = theta_i*q_boost }
  full -> ramp_down when q_boost falls below delay(q_boost, 10 [s]) - wobble { reset q_bo = delay(q_boost, 10 [s]) }
  ramp_down -> ramp_up when q_boost rises above q_bo + wobble
  ramp_up -> full when q_bo rises above q_boost
}
output h_r [m]
output q_ssp [lpm]
";

/// The flow out of a line without a sensor follows from known values: the regression is that of a model
/// which is given the true flow as an input.
#[test]
fn a_line_that_no_sensor_sees_goes_along_with_the_record() {
    let lpm = 1e-3 / 60.0;
    let ramp = |t: f64, from: f64, until: f64| ((t - from) / (until - from)).clamp(0.0, 1.0);
    let boost = |t: f64| {
        lpm * 1800.0
            * (1.0 - ramp(t, 100.0, 112.0) + ramp(t, 260.0, 275.0) - ramp(t, 500.0, 510.0)
                + ramp(t, 640.0, 650.0))
    };
    let truth = [("A_r", 0.2), ("theta_1", 0.93)];
    let (recording, solution) =
        simulated(RISER_AND_LINE, &truth, 1.0, 900, &[("q_boost", Interpolation::Linear, &boost)]);
    let entered: Vec<&str> = solution.events.iter().map(|event| event.to.as_ref()).collect();
    assert_eq!(entered, ["ramp_down", "ramp_up", "full"].repeat(2));

    // The same riser, given what comes out of the line.
    let given = RISER_AND_LINE
        .replace("state q_bo [lpm] = q_boost  fixed\n", "")
        .replace("input q_boost [lpm] linear", "input q_bo [lpm] linear");
    let begin = given.find("modes line").expect("the block");
    let end = given.find("output h_r").expect("the outputs");
    let given = format!("{}{}", &given[..begin], &given[end..]);
    let given = given
        .lines()
        .filter(|line| !["tau_d", "tau_b", "theta_i"].iter().any(|name| line.contains(name)))
        .collect::<Vec<_>>()
        .join("\n");
    let q_bo: Vec<f64> = (0..solution.len()).map(|k| solution.y(k)[2]).collect();
    let column = InputColumn { name: "q_bo", interpolation: Interpolation::Linear, values: &q_bo };
    let inputs = Inputs::recorded(&recording.times, &[column]).expect("inputs");
    let with_flow = Case::made_up(&format!("{given}\n"), Recording { inputs, ..recording.clone() });

    let line = |free: &[&str]| {
        let case = Case::of(RISER_AND_LINE, free, &[]);
        Case { recordings: vec![recording.clone()], ..case }
    };
    let carried = line(&["A_r", "theta_1"]).fit(RegressionMethod::LeastSquares);
    let known = with_flow.fit(RegressionMethod::LeastSquares);
    for (name, truth) in truth {
        let (found, expected) = (value(&carried, name), value(&known, name));
        println!("{name}: {found}, with the flow {expected}, true {truth}");
        // Slopes over eleven samples round the corners of the flow: a thousandth. Windows end where modes
        // change, so that there is less of that here.
        assert!((found / truth - 1.0).abs() < 2e-3, "{name}: {found}");
        assert!((found / expected - 1.0).abs() < 2e-3, "{name}: {found} {expected}");
    }
    assert_eq!(carried.left_out, RowsLeftOut::default());
    // Every sample has a row: the flow is known in all modes.
    assert_eq!(carried.rows[0].samples, 900);

    // Neither with what is estimated in the line's own equations, which no reading helps with.
    let error = regress(&line(&["theta_1", "tau_b"]).problem(), RegressionMethod::LeastSquares);
    let error = error.expect_err("the flow is not measured");
    assert!(
        matches!(&error, RegressionError::NotReconstructed { unknown, .. } if unknown == "q_bo"),
        "{error}"
    );
    // Along the record, too: least squares that go along end where those of all rows do.
    let options = FollowOptions {
        time_constants: vec![5.0],
        start_variance: 1e6,
        forgetting: Forgetting {
            rate: 0.0,
            limit: f64::INFINITY,
            normalisation: Normalisation::None,
        },
    };
    let case = line(&["A_r", "theta_1"]);
    let followed = follow(&case.problem(), &options).expect("estimates");
    for (name, truth) in truth {
        let found = value(&followed.fit, name);
        assert!((found / truth - 1.0).abs() < 2e-3, "{name}: {found}");
    }
}

/// Conditions on what is measured tell the mode; windows of slopes end where something happens. A
/// counter that starts anew is a straight line between its resets, and a heater's temperature goes along two
/// exponentials.
#[test]
fn conditions_on_readings_tell_the_mode() {
    const HEATER: &str = "\
model heater
parameter a [1] = 1
parameter power [1] = 2
parameter rate [1] = 0.5
state x [1] = 0.1
state n [1] = 0
modes heater {
  on  { equation heat: der(x) * 10 [s] = power - a*x }
  off { equation heat: der(x) * 10 [s] = -a*x }
  on -> off when x rises above 0.8
  off -> on when x falls below 0.2
}
equation count: der(n) * 1 [s] = rate
when n rises above 10 { reset n = 0 }
output x [1]
output n [1]
";
    let truth = [("a", 0.7), ("power", 1.5), ("rate", 0.83)];
    let (recording, solution) = simulated(HEATER, &truth, 0.2, 600, &[]);
    assert!(solution.events.len() > 12, "{:?}", solution.events);
    let fit = Case::made_up(HEATER, recording).fit(RegressionMethod::LeastSquares);
    // A straight line has no error; a parabola over 2.2 s of exp(−0.07 t) is off by 1²/10 0.07² of itself.
    assert!((value(&fit, "rate") / 0.83 - 1.0).abs() < 1e-6, "{}", value(&fit, "rate"));
    for (name, truth) in &truth[..2] {
        let found = value(&fit, name);
        assert!((found / truth - 1.0).abs() < 2e-3, "{name}: {found}");
    }
}

/// x is read late from the record; the delay is searched for where it is not known.
#[test]
fn what_was_is_read_from_the_record() {
    const LATE: &str = "\
model late
input u [1] linear
parameter a [1] = 0.5
parameter b [1] = 0.5
parameter tau [s] = 2.9  in 0.5 .. 10
state x [1] = 0.3
equation late: der(x) * 4 [s] = b*u - a*delay(x, tau)
output x [1]
";
    let truth = [("a", 0.8), ("b", 1.2), ("tau", 3.43)];
    let u = |t: f64| (0.2 * t).sin() + 0.6 * (0.31 * t).cos();
    let (recording, _) = simulated(LATE, &truth, 0.05, 1600, &[("u", Interpolation::Linear, &u)]);
    let case = |free: &[&str], text: &str| Case {
        recordings: vec![recording.clone()],
        ..Case::of(text, free, &[])
    };
    let known = case(&["a", "b"], &LATE.replace("tau [s] = 2.9", "tau [s] = 3.43"));
    let known = known.fit(RegressionMethod::LeastSquares);
    let searched = case(&[], LATE).fit(RegressionMethod::VariableProjection);
    assert_eq!(searched.linear, [true, true, false]);
    for (fit, names) in [(&known, &truth[..2]), (&searched, &truth[..])] {
        for (name, truth) in names {
            let found = value(fit, name);
            println!("{name}: {found} {truth}");
            // The slope of a parabola over 0.5 s of a signal with ω = 0.4 is off by 0.25²/10 ω² of itself.
            assert!((found / truth - 1.0).abs() < 1e-3, "{name}: {found}");
        }
        // 3.43 s before the sample at 3.4 s nothing had been recorded: 69 samples.
        assert_eq!(fit.left_out.before_record, 69);
        assert_eq!(fit.rows[0].samples, 1531);
    }
    let error = regress(&case(&[], LATE).problem(), RegressionMethod::LeastSquares);
    let error = error.expect_err("a delay is not linear").to_string();
    assert!(error.contains("`tau` does not enter `late` linearly"), "{error}");
    // A delay of an input stays refused.
    let of_input = LATE.replace("b*u", "b*delay(u, tau)");
    let error = regress(&case(&[], &of_input).problem(), RegressionMethod::VariableProjection);
    assert!(matches!(error, Err(RegressionError::FreeDelay { .. })), "{error:?}");
}
