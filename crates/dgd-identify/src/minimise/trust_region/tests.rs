//! Problems with known minima.

use super::*;

const ANYWHERE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// Σ r² from residuals and the rows of J.
fn normal<const N: usize>(rows: &[(f64, [f64; N])]) -> NormalEquations {
    let mut normal = NormalEquations::zeros(N);
    for (r, slopes) in rows {
        let slopes = DVector::from_row_slice(slopes);
        normal.cost += r * r;
        normal.gradient += &slopes * *r;
        normal.information += &slopes * slopes.transpose();
    }
    normal
}

/// Runs a problem that can be evaluated everywhere.
fn solve<const N: usize>(
    start: [f64; N],
    bounds: &[(f64, f64)],
    rows: impl Fn(&[f64]) -> Vec<(f64, [f64; N])>,
) -> Minimum<NormalEquations, ()> {
    let first = normal(&rows(&start));
    let rule = StoppingRule::default();
    minimise(start.to_vec(), first, bounds, &rule, |x| Ok(normal(&rows(x))))
}

fn rosenbrock(x: &[f64]) -> Vec<(f64, [f64; 2])> {
    vec![(10.0 * (x[1] - x[0] * x[0]), [-20.0 * x[0], 10.0]), (1.0 - x[0], [-1.0, 0.0])]
}

#[test]
fn a_curved_valley_is_followed_to_its_end() {
    let minimum = solve([-1.2, 1.0], &[ANYWHERE; 2], rosenbrock);
    assert!(minimum.termination.is_converged(), "{:?}", minimum.termination);
    for x in &minimum.x {
        assert!((x - 1.0).abs() < 1e-8, "{:?}", minimum.x);
    }
}

/// Misra1a of the NIST Statistical Reference Datasets, y = b1 (1 − exp(−b2 x)): certified to 11 digits. The model's
/// logarithmic relative error at this condition is a few units of 1e-9 with the default rule.
#[test]
fn misra1a_has_its_certified_values() {
    let data = [
        (77.6, 10.07),
        (114.9, 14.73),
        (141.1, 17.94),
        (190.8, 23.93),
        (239.9, 29.61),
        (289.0, 35.18),
        (332.8, 40.02),
        (378.4, 44.82),
        (434.8, 50.76),
        (477.3, 55.05),
        (536.8, 61.01),
        (593.1, 66.40),
        (689.1, 75.47),
        (760.0, 81.78),
    ];
    let (size1, size2) = (500.0, 1e-4);
    let minimum = solve([1.0, 1.0], &[ANYWHERE; 2], |z| {
        let (b1, b2) = (z[0] * size1, z[1] * size2);
        let row = |(x, y): &(f64, f64)| {
            let decay = (-b2 * x).exp();
            (b1 * (1.0 - decay) - y, [(1.0 - decay) * size1, b1 * x * decay * size2])
        };
        data.iter().map(row).collect()
    });
    let close = |found: f64, certified: f64, digits: f64| {
        assert!((found / certified - 1.0).abs() < digits, "{found} against {certified}");
    };
    close(minimum.x[0] * size1, 2.389_421_291_8e2, 1e-8);
    close(minimum.x[1] * size2, 5.501_564_318_1e-4, 1e-8);
    close(minimum.at.cost, 1.245_513_889_4e-1, 1e-9);
    // Standard deviations: √(diag (JᵀJ)⁻¹ Σr²/12).
    let inverse = minimum.at.information.clone().try_inverse().expect("two parameters");
    let variance = minimum.at.cost / 12.0;
    close((inverse[(0, 0)] * variance).sqrt() * size1, 2.707_007_524_1, 1e-6);
    close((inverse[(1, 1)] * variance).sqrt() * size2, 7.266_868_843_6e-6, 1e-6);
}

#[test]
fn at_a_bound_the_others_converge_as_without_it() {
    // On x₁ = 1/2 the valley's floor is x₂ = 1/4.
    let at_bound = solve([-1.2, 1.0], &[(-2.0, 0.5), ANYWHERE], rosenbrock);
    assert_eq!(at_bound.x[0], 0.5);
    assert!((at_bound.x[1] - 0.25).abs() < 1e-8, "{:?}", at_bound.x);
    assert!(at_bound.termination.is_converged());
    // A bound that is only met on the way does not hold: the first full step goes to x₂ = −3.84.
    let released = solve([-1.2, 1.0], &[ANYWHERE, (0.0, 1.0)], rosenbrock);
    for x in &released.x {
        assert!((x - 1.0).abs() < 1e-6, "{:?}", released.x);
    }
    // Both fixed: nothing is left to do.
    let minimum = solve([0.0, 2.0], &[(0.0, 0.0), (2.0, 2.0)], rosenbrock);
    assert_eq!((minimum.x, minimum.evaluations), (vec![0.0, 2.0], 0));
}

#[test]
fn what_is_not_determined_stays_near_the_start() {
    // Only the sum has influence; the smallest step keeps the difference.
    let rows = |x: &[f64]| vec![(x[0] + x[1] - 5.0, [1.0, 1.0]), (x[0] + x[1] - 5.0, [1.0, 1.0])];
    let shortest = solve([1.0, 2.0], &[ANYWHERE; 2], rows);
    assert!(shortest.termination.is_converged());
    assert!(
        (shortest.x[0] - 2.0).abs() < 1e-6 && (shortest.x[1] - 3.0).abs() < 1e-6,
        "{:?}",
        shortest.x
    );
    // A variable without any influence is not moved.
    let minimum = solve([1.0, 7.0], &[ANYWHERE; 2], |x| vec![(x[0] - 4.0, [1.0, 0.0])]);
    assert!((minimum.x[0] - 4.0).abs() < 1e-8);
    assert_eq!(minimum.x[1], 7.0);
}

/// r = ln x − ln 2, not defined for x ≤ `edge`.
fn logarithm(edge: f64) -> impl Fn(&[f64]) -> Result<NormalEquations, String> {
    move |x: &[f64]| {
        if x[0] <= edge {
            return Err(format!("{} is too small", x[0]));
        }
        Ok(normal(&[((x[0] / 2.0).ln(), [1.0 / x[0]])]))
    }
}

#[test]
fn a_failed_trial_is_a_step_too_far() {
    let rule = StoppingRule::default();
    let evaluate = logarithm(0.0);
    let first = evaluate(&[20.0]).expect("defined");
    // The Gauss–Newton step from 20 goes to 20 − 20 ln 10 < 0.
    let minimum = minimise(vec![20.0], first, &[ANYWHERE], &rule, evaluate);
    assert!(minimum.failures > 0 && minimum.last_failure.is_some());
    assert!((minimum.x[0] - 2.0).abs() < 1e-8, "{:?}", minimum.x);
    assert!(minimum.termination.is_converged());
}

#[test]
fn a_minimum_beyond_the_edge_is_not_claimed() {
    let rule = StoppingRule::default();
    let evaluate = logarithm(3.0);
    let first = evaluate(&[20.0]).expect("defined");
    let minimum = minimise(vec![20.0], first, &[ANYWHERE], &rule, evaluate);
    assert_eq!(minimum.termination, Termination::Blocked);
    assert!(minimum.last_failure.is_some_and(|reason| reason.contains("too small")));
    assert!(minimum.x[0] > 3.0 && minimum.x[0] < 3.01, "{:?}", minimum.x);
}

#[test]
fn the_limit_of_evaluations_is_kept() {
    let first = normal(&rosenbrock(&[-1.2, 1.0]));
    let rule = StoppingRule { evaluations: 3, ..StoppingRule::default() };
    let evaluate = |x: &[f64]| Ok::<_, ()>(normal(&rosenbrock(x)));
    let minimum = minimise(vec![-1.2, 1.0], first, &[ANYWHERE; 2], &rule, evaluate);
    assert_eq!((minimum.termination, minimum.evaluations), (Termination::EvaluationLimit, 3));
}

/// Decays x = exp(−t eᶻ) at t = 1 .. 100 compared with those of a rate 0.3, starting from far too slow a one.
fn decay(x: &[f64]) -> Vec<(f64, [f64; 1])> {
    let row = |t: i32| {
        let exponent = f64::from(t) * x[0].exp();
        ((-exponent).exp() - (-0.3 * f64::from(t)).exp(), [-exponent * (-exponent).exp()])
    };
    (1..=100).map(row).collect()
}

fn search(reach: f64, start: f64) -> Minimum<NormalEquations, ()> {
    let bounds = [(1e-8_f64.ln(), 1e4_f64.ln())];
    let region = VariableRegion { bounds: &bounds, reach: &[reach], leading: 1 };
    let first = normal(&decay(&[start]));
    let rule = StoppingRule::default();
    minimise_watched(vec![start], first, region, &rule, &NoMonitor, |x| Ok(normal(&decay(x))))
}

#[test]
fn steps_of_limited_reach_do_not_leap_over_a_minimum() {
    let minimum = search(10_f64.ln(), 1e-4_f64.ln());
    assert!(minimum.termination.is_converged(), "{:?}", minimum.termination);
    assert!((minimum.x[0].exp() - 0.3).abs() < 1e-6, "{:?}", minimum.x);
}

#[test]
fn a_plain_among_bounds_is_no_minimum() {
    // The slope is rounding error: nothing changes along it.
    let minimum = solve([0.0], &[(-9.0, 9.0)], |_| vec![(1.0, [1e-9])]);
    assert_eq!(minimum.termination, Termination::Flat);
    assert!(!minimum.termination.is_converged());
}

#[test]
fn a_far_bound_is_not_leapt_to() {
    // The first step would go eight decades, to the bound, where the solution has decayed completely.
    let minimum = search(f64::INFINITY, 1e-4_f64.ln());
    assert!((minimum.x[0].exp() - 0.3).abs() < 1e-6, "{:?}", minimum.x);
}

#[test]
fn the_slope_of_a_plain_leads_down_from_it() {
    // exp(−40 t) changes Σ r² by a relative 1e-17; the edge of the plateau is ten times slower.
    let minimum = search(10_f64.ln(), 40_f64.ln());
    assert!(minimum.termination.is_converged(), "{:?}", minimum.termination);
    assert!((minimum.x[0].exp() - 0.3).abs() < 1e-6, "{:?}", minimum.x);
}

#[test]
fn what_has_no_influence_yet_but_rounding_stays_near_the_start() {
    // The second variable acts through the first, which is zero at the start.
    let rows = |x: &[f64]| {
        let rounding = 1e-11;
        vec![(1.0 - x[0], [-1.0, 0.0]), (3.0 + x[0] * (x[1] - 5.0), [x[1] - 5.0, x[0] + rounding])]
    };
    let evaluate = |x: &[f64]| if x[1].abs() < 1e3 { Ok(normal(&rows(x))) } else { Err(()) };
    let start = vec![0.0, 0.0];
    let first = normal(&rows(&start));
    let minimum = minimise(start, first, &[ANYWHERE; 2], &StoppingRule::default(), evaluate);
    assert!(minimum.termination.is_converged(), "{:?}", minimum.termination);
    assert_eq!(minimum.failures, 0);
    for (x, truth) in minimum.x.iter().zip([1.0, 2.0]) {
        assert!((x - truth).abs() < 1e-8, "{:?}", minimum.x);
    }
}

/// The Brown–Dennis problem, with large residuals (Moré, Garbow, Hillstrom, ACM TOMS 7 (1981) 17, number 16).
fn brown_dennis(x: &[f64]) -> Vec<(f64, [f64; 4])> {
    let row = |i: i32| {
        let t = f64::from(i) / 5.0;
        let (a, b) = (x[0] + t * x[1] - t.exp(), x[2] + t.sin() * x[3] - t.cos());
        (a * a + b * b, [2.0 * a, 2.0 * a * t, 2.0 * b, 2.0 * b * t.sin()])
    };
    (1..=20).map(row).collect()
}

#[test]
fn large_residuals_do_not_slow_it_down() {
    let minimum = solve([25.0, 5.0, -5.0, -1.0], &[ANYWHERE; 4], brown_dennis);
    assert!(minimum.termination.is_converged(), "{:?}", minimum.termination);
    // The collection's value; pure Gauss–Newton steps need some two hundred evaluations to reach it.
    assert!((minimum.at.cost - 85_822.2).abs() < 0.05, "{}", minimum.at.cost);
    assert!(minimum.evaluations < 40, "{}", minimum.evaluations);
}

#[test]
fn a_failed_trial_quarters_the_radius() {
    let tried = std::cell::RefCell::new(Vec::new());
    let rule = StoppingRule { evaluations: 3, ..StoppingRule::default() };
    let first = normal(&rosenbrock(&[-1.2, 1.0]));
    let minimum = minimise(vec![-1.2, 1.0], first.clone(), &[ANYWHERE; 2], &rule, |x| {
        tried.borrow_mut().push(x.to_vec());
        Err::<NormalEquations, ()>(())
    });
    assert_eq!((minimum.termination, minimum.failures), (Termination::EvaluationLimit, 3));
    let length = |x: &Vec<f64>| {
        let scaled = |i: usize| first.information[(i, i)].sqrt() * (x[i] - [-1.2, 1.0][i]).powi(2);
        (scaled(0) + scaled(1)).sqrt()
    };
    let lengths: Vec<f64> = tried.borrow().iter().map(length).collect();
    for pair in lengths.windows(2) {
        // Within a tenth, the tolerance of lengths.
        assert!((pair[1] / pair[0] / 0.25 - 1.0).abs() <= 0.15, "{lengths:?}");
    }
}

#[test]
fn evaluations_go_on_until_the_first_step() {
    let edge = 19.0;
    let evaluate =
        |x: &[f64]| if x[0] < edge { Err(()) } else { logarithm(0.0)(x).map_err(|_| ()) };
    let first = logarithm(0.0)(&[20.0]).expect("defined");
    let rule = StoppingRule { evaluations: 2, ..StoppingRule::default() };
    let short = minimise(vec![20.0], first.clone(), &[ANYWHERE], &rule, evaluate);
    assert_eq!((short.iterations, short.evaluations), (0, 2));
    let rule = StoppingRule { until_a_step: 20, ..rule };
    let long = minimise(vec![20.0], first, &[ANYWHERE], &rule, evaluate);
    assert!(long.iterations > 0 && long.evaluations <= 20, "{long:?}");
}

#[test]
fn no_step_that_helps_is_a_stall_and_no_minimum() {
    // The gradient points upwards.
    let evaluate = |x: &[f64]| Ok::<_, ()>(normal(&[(1.0 + x[0] * x[0], [-1.0])]));
    let start = evaluate(&[1.0]).expect("defined");
    let rule = StoppingRule::default();
    let ended = minimise(vec![1.0], start, &[ANYWHERE], &rule, evaluate);
    assert_eq!(ended.termination, Termination::Stalled);
    assert!(!ended.termination.is_converged());
    // Nor is a sum with jumps that are larger than the predicted reductions.
    let coarse = |x: &[f64]| {
        let mut equations = normal(&[(1.0, [0.0]), (x[0], [1.0])]);
        equations.cost = (equations.cost * 1e3 + 0.5).ceil() / 1e3;
        Ok::<_, ()>(equations)
    };
    let first = coarse(&[0.02]).expect("defined");
    let stalled = minimise(vec![0.02], first.clone(), &[ANYWHERE], &rule, coarse);
    assert_eq!(stalled.termination, Termination::Stalled, "{stalled:?}");
    // With a given accuracy of the sum, it is the minimum.
    let rule = StoppingRule { accuracy: 1e-3, ..rule };
    let minimum = minimise(vec![0.02], first, &[ANYWHERE], &rule, coarse);
    assert_eq!(minimum.termination, Termination::Reduction, "{minimum:?}");
}

/// The Jennrich–Sampson problem, with large residuals (Moré, Garbow, Hillstrom, number 6).
fn jennrich_sampson(x: &[f64]) -> Vec<(f64, [f64; 2])> {
    let row = |i: i32| {
        let k = f64::from(i);
        let (a, b) = ((k * x[0]).exp(), (k * x[1]).exp());
        (2.0 + 2.0 * k - a - b, [-k * a, -k * b])
    };
    (1..=10).map(row).collect()
}

#[test]
fn no_search_with_large_residuals_stalls_at_the_minimum() {
    for k in 0..60 {
        let t = f64::from(k);
        let start = [0.05 + 0.004 * t, 0.45 - 0.005 * t];
        let minimum = solve(start, &[ANYWHERE; 2], jennrich_sampson);
        assert!(
            minimum.termination.is_converged(),
            "{start:?}: {:?} {}",
            minimum.termination,
            minimum.at.cost
        );
        assert!((minimum.at.cost - 124.362).abs() < 1e-3, "{start:?}: {}", minimum.at.cost);
    }
    for k in 0..60 {
        let t = f64::from(k);
        let start = [25.0 - 0.5 * t, 5.0 + 0.1 * t, -5.0 + 0.2 * t, -1.0 - 0.05 * t];
        let minimum = solve(start, &[ANYWHERE; 4], brown_dennis);
        assert!(
            minimum.termination.is_converged(),
            "{start:?}: {:?} {}",
            minimum.termination,
            minimum.at.cost
        );
        assert!((minimum.at.cost - 85_822.2).abs() < 0.05, "{start:?}: {}", minimum.at.cost);
    }
}
