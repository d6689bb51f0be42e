//! Inputs that jump, and their effects.

use dgd_runtime::{
    InputColumn, Inputs, Interpolation,
    LimitSide::{Left, Right},
    Options, Problem, consistent_start, observe, simulate_with_sensitivities,
};

use crate::support;
use crate::support::parameters;
use crate::support::problems::{Follower, FollowerStacked};

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-5
}

#[test]
fn a_time_that_occurs_twice_is_left_and_right() {
    let system = FollowerStacked::of::<Follower>();
    let p = parameters::<Follower>();
    let column =
        InputColumn { name: "u", interpolation: Interpolation::Hold, values: &[1.0, 3.0, 2.0] };
    let inputs = Inputs::recorded(&[0.0, 1.0, 2.0], &[column]).unwrap();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };

    let times = [0.0, 0.5, 1.0, 1.0, 1.5, 2.0];
    let solution = simulate_with_sensitivities(&problem, &times, &Options::default()).unwrap();
    assert_eq!(solution.times, times);
    let sides: Vec<_> = (0..6).map(|k| solution.side(k)).collect();
    assert_eq!(sides, [Right, Right, Left, Right, Right, Right]);

    // z = k u, ∂z/∂k = u
    let observed = observe(&problem, &solution);
    for (k, u) in [1.0, 1.0, 1.0, 3.0, 3.0, 2.0].into_iter().enumerate() {
        assert!(close(solution.y(k)[1], 2.0 * u), "z at {k}: {}", solution.y(k)[1]);
        assert!(close(solution.s(k)[1], u), "dz/dk at {k}");
        assert_eq!(observed.w(k), solution.y(k));
        assert_eq!(observed.dw(k), solution.s(k));
    }
    // x does not jump.
    assert!(close(solution.y(2)[0], 2.0 * (1.0 - (-1.0_f64).exp())));
    assert!(close(solution.y(2)[0], solution.y(3)[0]));

    // A jump requested once has its right value, at the end too; requested twice, both.
    let once = simulate_with_sensitivities(&problem, &[0.0, 1.0, 2.0], &Options::default());
    let once = once.unwrap();
    assert!(close(once.y(1)[1], 6.0) && close(once.y(2)[1], 4.0));
    let twice = simulate_with_sensitivities(&problem, &[0.0, 2.0, 2.0], &Options::default());
    let twice = twice.unwrap();
    assert!(close(twice.y(1)[1], 6.0) && close(twice.y(2)[1], 4.0));
}

#[test]
fn a_time_that_occurs_more_often_is_that_of_replicates() {
    let system = FollowerStacked::of::<Follower>();
    let p = parameters::<Follower>();
    let values = [1.0, 3.0, 3.0, 3.0, 2.0];
    let column = InputColumn { name: "u", interpolation: Interpolation::Hold, values: &values };
    let inputs = Inputs::recorded(&[0.0, 1.0, 1.0, 1.0, 2.0], &[column]).unwrap();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let times = [0.0, 0.0, 0.0, 0.4, 0.4, 0.4, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0];
    let solution = simulate_with_sensitivities(&problem, &times, &Options::default()).unwrap();
    assert_eq!(solution.times, times);
    assert!((0..times.len()).all(|k| solution.side(k) == Right));
    let observed = observe(&problem, &solution);
    for (k, t) in times.iter().enumerate() {
        let u = if *t < 1.0 {
            1.0
        } else if *t < 2.0 {
            3.0
        } else {
            2.0
        };
        assert!(close(solution.y(k)[1], 2.0 * u), "z at {k}: {}", solution.y(k)[1]);
        assert!(close(solution.s(k)[1], u), "dz/dk at {k}");
        assert_eq!(observed.w(k), solution.y(k));
    }
    assert_eq!(solution.y(6), solution.y(8));
}

#[test]
fn a_consistent_start_has_consistent_slopes() {
    let system = FollowerStacked::of::<Follower>();
    let p = parameters::<Follower>();
    let column =
        InputColumn { name: "u", interpolation: Interpolation::Linear, values: &[1.0, 3.0] };
    let inputs = Inputs::recorded(&[0.0, 1.0], &[column]).unwrap();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[(0, 0.25)] };
    let start = consistent_start(&problem, 0.0, &Options::default()).unwrap();
    // ẋ = z − x, ż = k u̇
    let (y, ydot) = ([0.25, 2.0], [1.75, 4.0]);
    for i in 0..2 {
        assert!((start.y[i] - y[i]).abs() < 1e-9, "{start:?}");
        assert!((start.ydot[i] - ydot[i]).abs() < 1e-9, "{start:?}");
    }
}

#[test]
fn the_step_is_carried_over_segments() {
    // Constant except for the clock's jumps each second, after which one step suffices.
    let system = support::Heaped::of::<support::problems::Logistic>();
    let p = parameters::<support::problems::Logistic>();
    let samples: Vec<f64> = (0..=200).map(f64::from).collect();
    let values: Vec<f64> = (0..=200).map(|k| f64::from(k % 2)).collect();
    let column = InputColumn { name: "clock", interpolation: Interpolation::Hold, values: &values };
    let inputs = Inputs::recorded(&samples, &[column]).unwrap();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let options = Options { rtol: 1e-4, atol: 1e-4, ..Options::default() };
    let solution = simulate_with_sensitivities(&problem, &[0.0, 200.0], &options).unwrap();
    // One each second, and one after the last sample.
    assert_eq!(solution.statistics.segments, 201);
    assert!(solution.statistics.steps < 220, "{:?}", solution.statistics);
}
