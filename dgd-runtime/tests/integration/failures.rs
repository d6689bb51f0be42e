//! Messages of simulations that cannot be finished.

use dgd_runtime::{
    BadRequest, Failure, InputColumn, Inputs, IntegrateError, Interpolation, METHODS, Options,
    Problem, Solution, choose_per_sample, consistent_start, find_method, method_to_begin, simulate,
    simulate_chosen, simulate_observed, simulate_with_sensitivities,
};

use crate::support::problems::Relaxation;
use crate::support::problems::hopeless::{BelowZero, Explosion, NoRoot};
use crate::support::{Equations, Heaped, parameters};

fn run<E: Equations>(
    inputs: &Inputs,
    times: &[f64],
    options: &Options,
) -> Result<Solution, Failure> {
    let system = Heaped::of::<E>();
    let p = parameters::<E>();
    let problem = Problem { system: &system, p: &p, inputs, start: &[] };
    let with = simulate_with_sensitivities(&problem, times, options);
    let without = simulate(&problem, times, options);
    assert_eq!(with.is_ok(), without.is_ok());
    without
}

fn said<E: Equations>(inputs: &Inputs, times: &[f64], options: &Options) -> String {
    run::<E>(inputs, times, options).unwrap_err().to_string()
}

#[test]
fn the_solver_says_where_it_stopped_and_why() {
    let none = Inputs::none();
    let times = [0.0, 0.5, 1.5];
    let options = Options::default();
    let failure = run::<Explosion>(&none, &times, &options).unwrap_err();
    assert_eq!(failure.partial.times, [0.0, 0.5]);
    assert!((failure.partial.y(1)[0] - 2.0).abs() < 1e-4);
    // The last steps overflow.
    let message = failure.to_string();
    assert!(message.contains("`of_x` is not finite at t = 1.0"), "{message}");

    let message = said::<BelowZero>(&none, &times, &options);
    assert!(message.contains("`of_x` is not finite at t = 1.07"), "{message}");

    let failure = run::<BelowZero>(&none, &times, &options).unwrap_err();
    let IntegrateError::NotFinite { equation, unknown, values, .. } = &failure.error else {
        panic!("{failure}");
    };
    assert_eq!((equation.as_str(), unknown.as_str()), ("of_x", "x"));
    let read: Vec<&str> = values.iter().map(|value| value.name.as_str()).collect();
    assert_eq!(read, ["x", "k"]);
    // The argument of the root is almost zero.
    assert!(values[0].value.abs() < 1e-3, "{values:?}");

    let few = Options { max_steps: 3, ..options };
    let message = said::<BelowZero>(&none, &[0.0, 0.9], &Options { rtol: 1e-9, ..few });
    assert!(message.contains("3 steps were not enough"), "{message}");

    let message = said::<NoRoot>(&none, &times, &options);
    assert!(message.contains("no consistent values at t = 0 s"), "{message}");
    assert!(message.contains("`of_z`"), "{message}");
}

/// Where a solution or the domain of its equations ends, every method stops, returns the part reached, and names the
/// cause.
#[test]
fn every_method_says_where_it_stopped_and_why() {
    let none = Inputs::none();
    let times = [0.0, 0.5, 1.5];
    for method in METHODS {
        let options = Options { method, ..Options::default() };
        let name = method.name;
        // x = 1/(1 − t): infinite at t = 1, where step sizes vanish or numbers overflow.
        let failure = run::<Explosion>(&none, &times, &options).unwrap_err();
        assert_eq!(failure.partial.times, [0.0, 0.5], "{name}");
        let message = failure.to_string();
        assert!(message.contains("x`"), "{name}: {message}");
        let t = time(&failure.error);
        assert!((t - 1.0).abs() < 1e-3, "{name}: {message}");
        assert!(format!("{failure:?}").ends_with("reached: Some(0.5), .. }"), "{failure:?}");
        // √x with x = 0 at t = 1.07: not defined from there on.
        let failure = run::<BelowZero>(&none, &times, &options).unwrap_err();
        let message = failure.to_string();
        assert!(message.contains("`of_x` is not finite"), "{name}: {message}");
        let t = time(&failure.error);
        assert!((t - 1.07).abs() < 1e-2, "{name}: {message}");
    }
}

/// Time at which it stopped.
fn time(error: &IntegrateError) -> f64 {
    match error {
        IntegrateError::StepSizeTooSmall { t, .. }
        | IntegrateError::NotFinite { t, .. }
        | IntegrateError::NewtonDiverged { t, .. }
        | IntegrateError::SingularIteration { t, .. } => *t,
        other => panic!("{other}"),
    }
}

#[test]
fn senseless_requests_are_refused() {
    let inputs = Inputs::constant(&[0.0]);
    for (rtol, atol) in [(0.0, 1e-6), (1e-6, -1.0), (f64::NAN, 1e-6)] {
        let options = Options { rtol, atol, ..Options::default() };
        let message = said::<Relaxation>(&inputs, &[0.0, 1.0], &options);
        assert!(message.contains("must be a positive number"), "{message}");
    }
    let options = Options::default();
    let message = said::<Relaxation>(&inputs, &[0.0, 2.0, 1.0], &options);
    assert!(message.contains("asked times go back"), "{message}");
    // Replicates.
    let again = run::<Relaxation>(&inputs, &[0.0, 1.0, 1.0, 1.0], &options).unwrap();
    assert_eq!(again.y[1..], [again.y[1]; 3]);
    let message = said::<Relaxation>(&inputs, &[0.0, f64::NAN], &options);
    assert!(message.contains("asked time number 2"), "{message}");
    assert!(run::<Relaxation>(&inputs, &[], &options).unwrap().is_empty());
    assert_eq!(run::<Relaxation>(&inputs, &[3.0], &options).unwrap().y, [2.0]);
}

#[test]
fn linear_inputs_end_and_all_begin() {
    let column =
        InputColumn { name: "u", interpolation: Interpolation::Linear, values: &[1.0, 2.0] };
    let inputs = Inputs::recorded(&[0.0, 1.0], &[column]).unwrap();
    let options = Options::default();
    let message = said::<Relaxation>(&inputs, &[0.0, 2.0], &options);
    assert!(message.contains("`u`") && message.contains("beyond its last sample"), "{message}");
    let message = said::<Relaxation>(&inputs, &[-1.0, 1.0], &options);
    assert!(message.contains("before its first sample"), "{message}");
}

#[test]
fn methods_are_found_by_name() {
    assert_eq!(find_method("rodas5p").unwrap().order, 5);
    let message = find_method("euler").unwrap_err().to_string();
    assert!(message.contains("`euler`") && message.contains("`rodas5p`"), "{message}");
}

/// The error of every entry point of the solver for an invalid relaxation problem, ẋ = k (u − x) from x0.
fn refusal(p: &[f64], inputs: &Inputs, start: &[(usize, f64)]) -> BadRequest {
    let system = Heaped::of::<Relaxation>();
    let (times, options) = ([0.0, 1.0], Options::default());
    let problem = Problem { system: &system, p, inputs, start };
    let refusal = problem.verify().unwrap_err();
    let expected = IntegrateError::BadRequest(refusal.clone());
    assert_eq!(simulate(&problem, &times, &options).unwrap_err().error, expected);
    let with_sensitivities = simulate_with_sensitivities(&problem, &times, &options);
    assert_eq!(with_sensitivities.unwrap_err().error, expected);
    let chosen = simulate_chosen(&problem, &[0], &times, &options);
    assert_eq!(chosen.unwrap_err().error, expected);
    let observed = simulate_observed(&problem, &[0], &times, &options);
    assert_eq!(observed.unwrap_err().error, expected);
    assert_eq!(choose_per_sample(&problem, &times, &options).unwrap_err(), expected);
    assert_eq!(consistent_start(&problem, 0.0, &options).unwrap_err(), expected);
    assert!(method_to_begin(&problem, 0.0, &options).is_none());
    refusal
}

#[test]
fn another_number_of_parameters_is_refused() {
    let inputs = Inputs::constant(&[0.0]);
    let refusal = refusal(&[1.0], &inputs, &[]);
    assert_eq!(refusal.to_string(), "`test` has 2 parameters, and the problem gives 1");
}

#[test]
fn another_number_of_inputs_is_refused() {
    let refusal = refusal(&parameters::<Relaxation>(), &Inputs::none(), &[]);
    assert_eq!(refusal.to_string(), "`test` has 1 input, and the problem gives 0");
}

#[test]
fn a_start_value_of_no_unknown_is_refused() {
    let inputs = Inputs::constant(&[0.0]);
    let refusal = refusal(&parameters::<Relaxation>(), &inputs, &[(0, 1.0), (4, 2.0)]);
    let message = "`test` has 1 unknown, and a start value is given for number 5";
    assert_eq!(refusal.to_string(), message);
}

#[test]
fn an_unknown_to_be_kept_exists() {
    let system = Heaped::of::<Relaxation>();
    let (p, inputs) = (parameters::<Relaxation>(), Inputs::constant(&[0.0]));
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let (times, options) = ([0.0, 1.0], Options::default());
    for run in [simulate_chosen, simulate_observed] {
        let message = run(&problem, &[0, 1], &times, &options).unwrap_err().to_string();
        assert_eq!(message, "`test` has 1 unknown, and number 2 is to be kept");
    }
}
