//! Filters of models that read what was: against a filter that remembers all of it on a fine grid, against
//! least squares, and against simulations.

use crate::filtering::{
    Data, Normal, close, declared, held_inputs, recursive, rows, system, tight, tuning,
};
use dgd_identify::filter::{
    FilterAlgorithm, FilterProblem, FilterSample, RunningFilter, SigmaSpread, TrackedRow,
};
use dgd_runtime::{Direction, Problem, System, observe, simulate, simulate_with_sensitivities};

/// A level whose outflow follows what the level was, and that is also read from afar.
const REMOTE: &str = "\
model remote
input u [1] hold
parameter a [1] = 0.45
state x [1] = 1  nominal 1
equation lag: der(x) * 1 [s] = u - a*delay(x, 2.3 [s])
output near [1] = x                  noise 0.1 [1]
output far  [1] = delay(x, 1.4 [s])  noise 0.05 [1]
";

const A: f64 = 0.45;
const X: f64 = 1.0;
/// 50 s of the level with noise of its own, every so many hundredths of a second a row of samples with
/// noise; some are missing.
fn recorded(each: usize, rate: f64) -> Data {
    let (h, mut random) = (0.01, Normal::new(7));
    let mut x = vec![1.2; 231];
    let (mut u, mut measured) = (Vec::new(), Vec::new());
    let n = 5000 / each;
    for k in 0..n {
        let input = if (each * k / 600).is_multiple_of(2) { 1.0 } else { 0.2 };
        u.push(vec![input]);
        let now = x.len() - 1;
        let near = if k % 3 == 1 { f64::NAN } else { x[now] + 0.1 * random.next() };
        let far = if k % 5 == 2 { f64::NAN } else { x[now - 140] + 0.05 * random.next() };
        measured.push(vec![near, far]);
        for _ in 0..each {
            let now = x.len() - 1;
            let late = 0.5 * (x[now - 230] + x[now - 229]);
            x.push(x[now] + h * (input - A * late) + rate * h.sqrt() * random.next());
        }
    }
    Data { t: (0..n).map(|k| h * (each * k) as f64).collect(), u, measured }
}

/// Extended Kalman filter of the level and a, with all of the past since 2.3 s on a grid of 0.01 s:
///
/// ```text
///   X = (x(t), x(t − h), …, x(t − 2.3), a),   x(t + h) = x + h (u − a (x(t − 2.3) + x(t − 2.3 + h))/2)
/// ```
///
/// Gives mean and standard deviation of level and a after each row.
fn on_a_grid(data: &Data, [x_std, rate]: [f64; 2], a_std: f64) -> Vec<[(f64, f64); 2]> {
    let (h, n, at_a) = (0.01, 232, 231);
    let mut mean = vec![X; n];
    mean[at_a] = A;
    let mut covariance = vec![vec![x_std * x_std; n]; n];
    for of in &mut covariance {
        of[at_a] = 0.0;
    }
    covariance[at_a].fill(0.0);
    covariance[at_a][at_a] = a_std * a_std;
    let mut all = Vec::new();
    for (k, measured) in data.measured.iter().enumerate() {
        let each = (data.t[1] / h).round() as usize;
        for _ in 0..if k == 0 { 0 } else { each } {
            let (late, half) = (0.5 * (mean[230] + mean[229]), 0.5 * h * mean[at_a]);
            let x = mean[0] + h * (data.u[k - 1][0] - mean[at_a] * late);
            // The covariance of the new level with all others, which move on by one, and with itself.
            let of_new =
                |c: &dyn Fn(usize) -> f64| c(0) - half * (c(230) + c(229)) - h * late * c(at_a);
            let row: Vec<f64> = (0..n).map(|j| of_new(&|i| covariance[i][j])).collect();
            let own = of_new(&|i| row[i]) + rate * rate * h;
            let with_a: Vec<f64> = (0..230).map(|j| covariance[j][at_a]).collect();
            covariance.remove(230);
            for (j, of) in covariance.iter_mut().enumerate() {
                of.remove(230);
                of.insert(0, if j == 230 { row[at_a] } else { row[j] });
            }
            let first = [&[own], &row[..230], &[row[at_a]]].concat();
            covariance.insert(0, first);
            for (j, with_a) in with_a.into_iter().enumerate() {
                (covariance[j + 1][at_a], covariance[at_a][j + 1]) = (with_a, with_a);
            }
            mean.remove(230);
            mean.insert(0, x);
        }
        for (i, (place, sigma)) in [(0, 0.1), (140, 0.05)].into_iter().enumerate() {
            if measured[i].is_finite() {
                let row = covariance[place].clone();
                let s = row[place] + sigma * sigma;
                let innovation = measured[i] - mean[place];
                for (j, of) in covariance.iter_mut().enumerate() {
                    mean[j] += row[j] / s * innovation;
                    for (c, with) in of.iter_mut().zip(&row) {
                        *c -= row[j] / s * with;
                    }
                }
            }
        }
        let known = |i: usize| (mean[i], covariance[i][i].sqrt());
        all.push([known(0), known(at_a)]);
    }
    all
}

fn found(data: &Data, estimator: FilterAlgorithm, walk: [f64; 2], a_std: f64) -> Vec<TrackedRow> {
    let system = system(REMOTE, &["a"]);
    let p = declared(&system);
    let options = tight();
    let problem = FilterProblem { estimator, options, ..FilterProblem::new(&system, &p) };
    rows(&problem, &tuning(&[walk], &[[a_std, 0.0]], &[0.1, 0.05]), data)
}

/// Root mean squares over all rows, for the level and a: differences of means and of standard deviations, over
/// that of the standard deviations.
fn apart(rows: &[TrackedRow], expected: &[[(f64, f64); 2]]) -> [[f64; 2]; 2] {
    [0, 1].map(|i| {
        let mut sums = [0.0_f64; 3];
        for (row, expected) in rows.iter().zip(expected) {
            let found = [row.states[0], row.parameters[0]][i];
            let (mean, std) = expected[i];
            let of_row = [found.value - mean, found.std - std, std];
            sums.iter_mut().zip(of_row).for_each(|(sum, own)| *sum += own * own);
        }
        [0, 1].map(|k| (sums[k] / sums[2]).sqrt())
    })
}

#[test]
fn the_past_is_as_uncertain_as_one_that_is_all_remembered() {
    let found_with = |rate: f64, each: usize| {
        let data = recorded(each, rate);
        let expected = on_a_grid(&data, [0.5, rate], 0.1);
        let by = |estimator| apart(&found(&data, estimator, [0.5, rate], 0.1), &expected);
        [
            by(FilterAlgorithm::ExtendedKalman),
            by(FilterAlgorithm::Unscented(SigmaSpread::default())),
        ]
    };
    // Between two rows what was changes with them in a straight line: of second order in their distance.
    let [[wide, _], [close, _]] = [50, 25].map(|each| found_with(0.0, each));
    for i in 0..2 {
        let [mean, std] = wide[i];
        assert!(mean < 5e-3 && std < 5e-3, "{wide:?}");
        assert!(3.0 * close[i][1] < std, "{wide:?} {close:?}");
    }
    // A stray between two rows is not remembered between them; sigma points also see that the model is
    // bilinear in a and x.
    for of_estimator in found_with(0.05, 50) {
        for [mean, std] in of_estimator {
            assert!(mean < 0.025 && std < 5e-3, "{of_estimator:?}");
        }
    }
}

/// Late values are read by differential and algebraic equations, of states and of algebraic unknowns, with
/// delays that are estimated, in two modes, and by an output.
const LATE: &str = "\
model late
input u [1] hold
parameter k   [1] = 0.4
parameter tau [s] = 1.73  in 0.1 .. 10
state x [1] = 1
state y [1] = 0.4
unknown q [1] = 0.4
modes valve {
  open { equation flow: q = k*delay(x, tau) }
  shut { equation flow: q = 0.1*delay(x, 1.1 [s]) }
  shut -> open when x rises above 1.3
  open -> shut when x falls below 0.6
}
equation level:  der(x) * 1 [s] = u - q
equation behind: der(y) * 2 [s] = delay(q, tau + 0.55 [s]) - y
output near [1] = y + 0.2*q                            noise 0.1 [1]
output far  [1] = delay(k*x*x + 0.5*q, 0.7 [s] + tau)  noise 0.1 [1]
";

fn of_late(each: f64) -> Data {
    let n = (30.0 / each) as usize;
    let input =
        |k: usize| if ((each * k as f64 / 6.0) as usize).is_multiple_of(2) { 0.9 } else { 0.05 };
    Data {
        t: (0..n).map(|k| each * k as f64).collect(),
        u: (0..n).map(|k| vec![input(k)]).collect(),
        measured: vec![vec![1.0; 2]; n],
    }
}

#[test]
fn without_uncertainty_a_filter_with_a_past_is_a_simulation() {
    let system = system(LATE, &["k", "tau"]);
    let (p, data) = (declared(&system), of_late(0.4));
    let inputs = held_inputs(&data);
    let run = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let solution = simulate(&run, &data.t, &tight()).expect("a run");
    assert!(solution.z.windows(2).filter(|z| z[0] != z[1]).count() > 1, "the valve moves");
    let simulated = observe(&run, &solution);
    let tuning = tuning(&[[0.0, 0.0]; 2], &[[0.0, 0.0]; 2], &[0.1, 0.1]);
    for estimator in [
        FilterAlgorithm::ExtendedKalman,
        FilterAlgorithm::Unscented(SigmaSpread::default()),
        recursive(1.0),
    ] {
        let problem =
            FilterProblem { estimator, options: tight(), ..FilterProblem::new(&system, &p) };
        for (k, row) in rows(&problem, &tuning, &data).iter().enumerate() {
            assert_eq!(row.failure, None, "{estimator:?} {}", row.t);
            for (i, state) in row.states.iter().enumerate() {
                close(state.value, solution.y(k)[i], 1e-6);
            }
            for (innovation, w) in row.innovations.iter().zip(simulated.w(k)) {
                close(1.0 - innovation.expect("measured").value, *w, 1e-6);
            }
        }
    }
}

/// Without samples the covariance is S P₀ Sᵀ with the sensitivities of a run from the beginning, to second
/// order in the distance of rows.
#[test]
fn the_covariance_is_that_of_the_sensitivities_of_one_run() {
    // One mode: where a valve shuts, what was has a kink that moves.
    let text = LATE.replace("falls below 0.6", "falls below -9");
    let system = system(&text, &["k", "tau"]);
    let p = declared(&system);
    let sigma = [0.3, 0.2, 0.05, 0.1];
    let (walks, of_parameters) = ([[0.3, 0.0], [0.2, 0.0]], [[0.05, 0.0], [0.1, 0.0]]);
    let tuning = tuning(&walks, &of_parameters, &[1e3, 1e3]);
    let apart = |each: f64, estimator| {
        let data = of_late(each);
        let inputs = held_inputs(&data);
        let run = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        let solution = simulate_with_sensitivities(&run, &data.t, &tight()).expect("a run");
        let simulated = observe(&run, &solution);
        let sigma = |direction: &Direction| match direction {
            Direction::Start(i) => sigma[*i],
            Direction::Parameter(i) => sigma[2 + i],
        };
        let sigma: Vec<f64> = system.signature().directions.iter().map(sigma).collect();
        let problem =
            FilterProblem { estimator, options: tight(), ..FilterProblem::new(&system, &p) };
        let mut most = [0.0_f64; 2];
        for (k, row) in rows(&problem, &tuning, &data).iter().enumerate() {
            let std = |of: &[f64], n: usize, i: usize| {
                let each = sigma.iter().enumerate();
                each.map(|(j, sigma)| (of[j * n + i] * sigma).powi(2)).sum::<f64>().sqrt()
            };
            for (i, state) in row.states.iter().enumerate() {
                most[0] = most[0].max((state.std - std(solution.s(k), solution.n, i)).abs());
            }
            for (i, innovation) in row.innovations.iter().enumerate() {
                let found = innovation.expect("measured").std;
                let own = (found * found - 1e6).max(0.0).sqrt();
                most[1] = most[1].max((own - std(simulated.dw(k), 2, i)).abs());
            }
        }
        most
    };
    for estimator in [FilterAlgorithm::ExtendedKalman, recursive(1.0)] {
        let (wide, close) = (apart(0.4, estimator), apart(0.2, estimator));
        assert!(wide[0] < 2e-3 && 3.0 * close[0] < wide[0], "{wide:?} {close:?}");
        // An output that reads between a kink and the next row has a derivative to the delay that jumped at
        // the kink: of 0.3, less than a hundredth.
        assert!(wide[1] < 3e-3 && close[1] < 3e-3, "{wide:?} {close:?}");
    }
}

#[test]
fn what_a_filter_does_not_follow_is_named() {
    let refused = |text: &str| {
        let system = system(text, &["a"]);
        let p = declared(&system);
        let problem = FilterProblem::new(&system, &p);
        let tuning = tuning(&[[1.0, 0.1]], &[[0.1, 0.0]], &[0.1, 0.1]);
        let first = FilterSample { t: 0.0, u: &[1.0], measured: &[0.0; 2] };
        RunningFilter::begin(&problem, &tuning, first).err().expect("refused").to_string()
    };
    let error = refused(&REMOTE.replace("delay(x, 2.3 [s])", "delay(x, 1 [s] + x*x * 1 [s])"));
    assert!(error.contains("what `x` was, at a delay that varies"), "{error}");
    assert!(error.contains("`output-error`"), "{error}");
    let error = refused(&REMOTE.replace("delay(x, 1.4 [s])", "delay(x, -1.4 [s])"));
    assert!(error.contains("what output `far` will be"), "{error}");
}
