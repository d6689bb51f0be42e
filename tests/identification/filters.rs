//! Filters against closed forms, against each other, and against the statistics that they promise.

use dgd_execute::LoadedSystem;
use dgd_identify::filter::{
    FilterAlgorithm, FilterError, FilterProblem, FilterSample, InnovationAlarm, LevelEstimate,
    NoiseLevelSource, PredictionError, PredictionErrorProblem, RunningFilter, SigmaSpread,
    TrackedRow, prediction_error, prediction_error_profiles, usual_tuning,
};
use dgd_identify::{
    BoundReached, CombinationTerm, NoiseSource, OutputErrorProblem, ProfileEnd, Recording, fit,
    profiles,
};
use dgd_runtime::{Options, System};

use crate::filtering::{
    Data, Normal, close, declared, held_inputs, recursive, rows, system, tight, tuning,
};
use crate::support;

/// A lag whose state is measured: dx = (u − x)/τ dt + dβ.
const LAG: &str = "\
model lag
input u [1] hold
parameter tau [s] = 4  in 0.1 .. 1000, log
parameter k   [1] = 1  in 0 .. 10
state x [1] = 0  nominal 1
equation lag: tau * der(x) = k*u - x
output y [1] = x  noise 0.3 [1]
";

/// The lag with nothing free, samples every half second, u = 1: Kalman's recursion in closed form.
///
/// φ = e^{−h/τ},  Q = q τ/2 (1 − φ²),  m⁻ = φ m + (1 − φ) u,  P⁻ = φ² P + Q,  P⁺ = P⁻ r/(P⁻ + r)
#[test]
fn a_linear_model_has_kalmans_filter_and_its_steady_covariance() {
    let system = system(LAG, &[]);
    let p = declared(&system);
    let free = vec![false; system.signature().directions.len()];
    let (tau, h, rate, sigma, start) = (4.0, 0.5, 0.2, 0.3, 2.0_f64);
    let mut random = Normal::new(1);
    let n = 120;
    let data = Data {
        t: (0..n).map(|k| h * f64::from(k)).collect(),
        u: vec![vec![1.0]; n as usize],
        measured: (0..n)
            .map(|k| vec![if k % 7 == 3 { f64::NAN } else { 1.0 + random.next() }])
            .collect(),
    };
    let phi = f64::exp(-h / tau);
    let q = rate * rate * tau / 2.0 * (1.0 - phi * phi);
    let (mut m, mut variance) = (0.0, start * start);
    let mut expected = Vec::new();
    for (k, measured) in data.measured.iter().enumerate() {
        if k > 0 {
            m = phi * m + (1.0 - phi);
            variance = phi * phi * variance + q;
        }
        if measured[0].is_finite() {
            let s = variance + sigma * sigma;
            m += variance / s * (measured[0] - m);
            variance *= sigma * sigma / s;
        }
        expected.push((m, variance.sqrt()));
    }
    let tuning = tuning(&[[start, rate]], &[], &[sigma]);
    for estimator in
        [FilterAlgorithm::ExtendedKalman, FilterAlgorithm::Unscented(SigmaSpread::default())]
    {
        let problem = FilterProblem {
            free: free.clone(),
            estimator,
            options: tight(),
            ..FilterProblem::new(&system, &p)
        };
        for (row, (m, std)) in rows(&problem, &tuning, &data).iter().zip(&expected) {
            close(row.states[0].value, *m, 1e-9);
            close(row.states[0].std, *std, 1e-9);
        }
        // Without gaps the covariance settles where P = (φ² P + Q) r/(φ² P + Q + r).
        let all = Data {
            measured: vec![vec![1.0]; n as usize],
            ..Data { t: data.t.clone(), u: data.u.clone(), measured: Vec::new() }
        };
        let (r, a) = (sigma * sigma, phi * phi);
        let b = q + r - a * r;
        let steady = (-b + (b * b + 4.0 * a * q * r).sqrt()) / (2.0 * a);
        let last = rows(&problem, &tuning, &all).pop().expect("rows");
        close(last.states[0].std, steady.sqrt(), 1e-9);
    }
}

/// Mean of χ² over so many degrees of freedom, within what one in ten thousand exceeds on each side.
#[track_caller]
fn consistent(sum: f64, freedom: f64) {
    // Wilson and Hilferty: (χ²/ν)^{1/3} is normal with mean 1 − 2/(9ν) and variance 2/(9ν).
    let part = 2.0 / (9.0 * freedom);
    let z = ((sum / freedom).cbrt() - (1.0 - part)) / part.sqrt();
    assert!(z.abs() < 3.72, "{sum} for {freedom} degrees of freedom: {z} standard deviations");
}

/// The lag with process noise, by its exact recursion, and a gain drawn from what is known of it.
struct Truth {
    data: Data,
    x: Vec<f64>,
    k: f64,
}

fn lagging(seed: u64, n: usize, k_std: f64, rate: f64, sigma: f64) -> Truth {
    let mut random = Normal::new(seed);
    let (tau, h, x_std) = (4.0, 0.5, 1.0);
    let phi = f64::exp(-h / tau);
    let q = rate * rate * tau / 2.0 * (1.0 - phi * phi);
    let k = 1.0 + k_std * random.next();
    let mut state = x_std * random.next();
    let mut truth = Truth { data: Data { t: vec![], u: vec![], measured: vec![] }, x: vec![], k };
    for i in 0..n {
        let u = [1.0, 4.0, 2.0][i / 20 % 3];
        truth.data.t.push(h * i as f64);
        truth.data.u.push(vec![u]);
        truth.data.measured.push(vec![state + sigma * random.next()]);
        truth.x.push(state);
        state = phi * state + (1.0 - phi) * k * u + q.sqrt() * random.next();
    }
    truth
}

/// Squared errors by the covariance (NEES) and squared innovations by theirs (NIS) are χ² over many runs,
/// and innovations are white (Bar-Shalom, Li, Kirubarajan 2001, §5.4). State and gain together: the model
/// is linear in both, so that the statistics are exact.
#[test]
fn errors_and_innovations_are_as_large_as_the_filter_says() {
    let system = system(LAG, &["k"]);
    let p = declared(&system);
    let (runs, n, rate, sigma, k_std) = (60, 80, 0.3, 0.2, 0.25);
    let tuning = tuning(&[[1.0, rate]], &[[k_std, 0.0]], &[sigma]);
    for estimator in
        [FilterAlgorithm::ExtendedKalman, FilterAlgorithm::Unscented(SigmaSpread::default())]
    {
        let problem = FilterProblem { estimator, ..FilterProblem::new(&system, &p) };
        let (mut nis, mut products, mut squares) = (0.0, 0.0, 0.0);
        let (mut of_state, mut of_gain) = ([0.0; 3], [0.0; 3]);
        for seed in 0..runs {
            let truth = lagging(100 + seed, n, k_std, rate, sigma);
            let rows = rows(&problem, &tuning, &truth.data);
            let mut last = None;
            for row in &rows {
                let innovation = row.innovations[0].expect("measured");
                let e = innovation.value / innovation.std;
                close(e * e, row.normalised_square, 1e-9 * (1.0 + e * e));
                nis += e * e;
                if let Some(last) = last {
                    products += e * last;
                }
                squares += e * e;
                last = Some(e);
                assert_eq!(row.failure, None);
            }
            for (at, k) in [5, 40, n - 1].into_iter().enumerate() {
                let (x, gain) = (rows[k].states[0], rows[k].parameters[0]);
                of_state[at] += ((x.value - truth.x[k]) / x.std).powi(2);
                of_gain[at] += ((gain.value - truth.k) / gain.std).powi(2);
            }
        }
        consistent(nis, (runs as usize * n) as f64);
        for sum in of_state.into_iter().chain(of_gain) {
            consistent(sum, runs as f64);
        }
        // Of white innovations the correlation with the last has the standard deviation 1/√n.
        let correlation = products / squares;
        assert!(correlation.abs() < 3.9 / ((runs as usize * n) as f64).sqrt(), "{correlation}");
    }
}

/// Outputs are chained through algebraic unknowns: z z = x is sqrt(x).
#[test]
fn algebraic_unknowns_follow_the_states() {
    let text = |algebra: &str, output: &str| {
        format!(
            "model tank\ninput u [1] hold\nparameter a [1] = 0.5\nstate x [1] = 4\n{algebra}\
             equation fill: der(x) * 1 [s] = u - a*{output}\noutput y [1] = {output}  noise 0.05 [1]\n"
        )
    };
    let explicit = system(&text("", "sqrt(x)"), &[]);
    let implicit = system(&text("unknown r [1] = 1\nequation root: r*r = x\n", "r"), &[]);
    let mut random = Normal::new(5);
    // Stamps at irregular times, an input that jumps.
    let data = Data {
        t: (0..60).map(|k| f64::from(k) * 0.3 + if k % 4 == 1 { 0.1 } else { 0.0 }).collect(),
        u: (0..60).map(|k| vec![if k < 30 { 1.0 } else { 2.0 }]).collect(),
        measured: (0..60).map(|_| vec![2.0 + 0.05 * random.next()]).collect(),
    };
    let tuning = tuning(&[[0.5, 0.05]], &[[0.2, 0.01]], &[0.05]);
    for estimator in
        [FilterAlgorithm::ExtendedKalman, FilterAlgorithm::Unscented(SigmaSpread::default())]
    {
        let of = |system: &LoadedSystem| {
            let p = declared(system);
            let problem =
                FilterProblem { estimator, options: tight(), ..FilterProblem::new(system, &p) };
            rows(&problem, &tuning, &data)
        };
        for (a, b) in of(&explicit).iter().zip(of(&implicit)) {
            close(a.states[0].value, b.states[0].value, 1e-8);
            close(a.states[0].std, b.states[0].std, 1e-8);
            close(a.parameters[0].value, b.parameters[0].value, 1e-8);
            let std = |row: &TrackedRow| row.innovations[0].expect("measured").std;
            close(std(a), std(&b), 1e-8);
        }
    }
}

/// In a model that is linear in gain and start value, recursive prediction error without forgetting is
/// least squares: x_j = φʲ x(0) + k Σ …, with the first uncertainties as priors.
#[test]
fn recursive_prediction_error_is_least_squares_on_a_linear_model() {
    let system = system(LAG, &["k"]);
    let p = declared(&system);
    let truth = lagging(7, 90, 0.2, 0.0, 0.2);
    let (x_std, k_std, sigma) = (2.0, 0.5, 0.2);
    let tuning = tuning(&[[x_std, 0.0]], &[[k_std, 0.0]], &[sigma]);
    let problem = FilterProblem {
        estimator: recursive(1.0),
        options: tight(),
        ..FilterProblem::new(&system, &p)
    };
    let found = rows(&problem, &tuning, &truth.data);
    // Normal equations of (x(0), k − 1) about the first estimates 0 and 1.
    let phi = f64::exp(-0.5 / 4.0);
    let mut a = [1.0 / (x_std * x_std), 0.0, 1.0 / (k_std * k_std)];
    let mut b = [0.0, 0.0];
    let (mut by_x, mut by_k) = (1.0, 0.0);
    for (row, (u, measured)) in found.iter().zip(truth.data.u.iter().zip(&truth.data.measured)) {
        let e = (measured[0] - by_k) / sigma;
        let (fx, fk) = (by_x / sigma, by_k / sigma);
        a = [a[0] + fx * fx, a[1] + fx * fk, a[2] + fk * fk];
        b = [b[0] + fx * e, b[1] + fk * e];
        let det = a[0] * a[2] - a[1] * a[1];
        let x0 = (a[2] * b[0] - a[1] * b[1]) / det;
        let k = 1.0 + (a[0] * b[1] - a[1] * b[0]) / det;
        close(row.parameters[0].value, k, 1e-9);
        close(row.parameters[0].std, (a[0] / det).sqrt(), 1e-9);
        close(row.states[0].value, by_x * x0 + by_k * k, 1e-9);
        by_x *= phi;
        by_k = phi * by_k + (1.0 - phi) * u[0];
    }
    assert!((found[89].parameters[0].value - truth.k).abs() < 0.1);
}

/// With forgetting, a gain that changes is followed; without excitation the covariance stops growing at
/// its bound, and the estimate stays.
#[test]
fn forgetting_follows_a_change_and_does_not_wind_up() {
    let system = system(LAG, &["k"]);
    let p = declared(&system);
    let phi = f64::exp(-0.5 / 4.0);
    let mut random = Normal::new(11);
    let mut data = Data { t: vec![], u: vec![], measured: vec![] };
    let mut x = 0.0;
    for i in 0..1500 {
        let u: f64 = if i < 600 { [1.0, 3.0][i / 40 % 2] } else { 0.0 };
        let k = if i < 300 { 1.0 } else { 1.5 };
        data.t.push(0.5 * i as f64);
        data.u.push(vec![u]);
        data.measured.push(vec![x + 0.05 * random.next()]);
        x = phi * x + (1.0 - phi) * k * u;
    }
    let tuning = tuning(&[[0.1, 0.0]], &[[0.5, 0.0]], &[0.05]);
    let run = |factor: f64| {
        let problem =
            FilterProblem { estimator: recursive(factor), ..FilterProblem::new(&system, &p) };
        rows(&problem, &tuning, &data)
    };
    let (forgets, remembers) = (run(0.95), run(1.0));
    close(forgets[299].parameters[0].value, 1.0, 0.03);
    close(forgets[599].parameters[0].value, 1.5, 0.03);
    assert!((remembers[599].parameters[0].value - 1.5).abs() > 0.1);
    // Without a bound the variance would have grown by 0.95⁻⁹⁰⁰ = 10²⁰.
    let last = forgets[1499].parameters[0];
    assert!(forgets.iter().all(|row| row.parameters[0].std <= 0.5 * (1.0 + 1e-9)));
    assert!(last.std > 0.1, "it has forgotten: {}", last.std);
    close(last.value, 1.5, 0.15);
}

/// Friction of the return line doubles within an hour. With the usual tuning the filter follows it; how far
/// it lags is what the ramp has gone on since the friction was what is now estimated.
#[test]
fn friction_that_doubles_in_an_hour_is_followed() {
    let path = support::root().join("models/mud_circulation.dgd");
    let text = std::fs::read_to_string(&path).expect("a model file");
    let rising = text.replace("F2*q*abs(q)", "F2*(1 + time/1 [h])*q*abs(q)");
    assert_ne!(text, rising);
    let plant = system(&rising, &["F2"]);
    let p = declared(&plant);
    let n = 1800;
    let times: Vec<f64> = (0..n).map(|k| 2.0 * f64::from(k)).collect();
    let w: Vec<f64> = (0..n).map(|k| 0.9 + 0.05 * f64::from((k / 90) % 3)).collect();
    let q: Vec<f64> = vec![0.02; n as usize];
    let zeros = vec![0.0; n as usize];
    let column = |name, values| dgd_runtime::InputColumn {
        name,
        interpolation: dgd_runtime::Interpolation::Hold,
        values,
    };
    let columns = [column("w_ssp", &w), column("q_boost", &q), column("q_tf", &zeros)];
    let inputs = dgd_runtime::Inputs::recorded(&times, &columns).expect("inputs");
    let start = [(0, 60.0)];
    let problem = dgd_runtime::Problem { system: &plant, p: &p, inputs: &inputs, start: &start };
    let solution = dgd_runtime::simulate(&problem, &times, &Options::default()).expect("a run");
    let simulated = dgd_runtime::observe(&problem, &solution);

    let system = system(&text, &["F2"]);
    let noise: Vec<f64> =
        system.signature().outputs.iter().map(|output| output.noise.expect("declared")).collect();
    let mut random = Normal::new(3);
    let measured: Vec<Vec<f64>> = (0..n as usize)
        .map(|k| simulated.w(k).iter().zip(&noise).map(|(w, s)| w + s * random.next()).collect())
        .collect();
    let u: Vec<Vec<f64>> = (0..n as usize).map(|k| vec![w[k], q[k], 0.0]).collect();
    let data = Data { t: times, u, measured };
    for estimator in
        [FilterAlgorithm::ExtendedKalman, FilterAlgorithm::Unscented(SigmaSpread::default())]
    {
        let problem = FilterProblem { estimator, ..FilterProblem::new(&system, &p) };
        let first = FilterSample { t: 0.0, u: &data.u[0], measured: &data.measured[0] };
        let tuning = usual_tuning(&problem, first).expect("a start");
        let rows = rows(&problem, &tuning, &data);
        let f2 = p[system.signature().parameters.iter().position(|p| p.name == "F2").expect("F2")];
        let lags: Vec<f64> = rows[300..]
            .iter()
            .map(|row| row.t - (row.parameters[0].value / f2 - 1.0) * 3600.0)
            .collect();
        let mean = lags.iter().sum::<f64>() / lags.len() as f64;
        let largest = lags.iter().fold(0.0_f64, |most, lag| most.max(lag.abs()));
        println!("{estimator:?}: lag {mean:.1} s, at most {largest:.1} s of 3600 s");
        assert!(rows.iter().all(|row| row.failure.is_none() && row.alarm.is_none()));
        assert!(mean.abs() < 60.0 && largest < 300.0, "{mean} {largest}");
        let last = rows.last().expect("rows").parameters[0];
        close(last.value, 2.0 * f2, 0.06 * f2);
    }
}

fn recorded(truths: &[Truth]) -> Vec<Recording> {
    let of = |truth: &Truth| {
        let u: Vec<f64> = truth.data.u.iter().map(|u| u[0]).collect();
        let column = dgd_runtime::InputColumn {
            name: "u",
            interpolation: dgd_runtime::Interpolation::Hold,
            values: &u,
        };
        let inputs = dgd_runtime::Inputs::recorded(&truth.data.t, &[column]).expect("inputs");
        let y = truth.data.measured.iter().map(|w| w[0]).collect();
        Recording::new(truth.data.t.clone(), inputs, vec![Some(y)])
    };
    truths.iter().map(of).collect()
}

/// Lag, gain, process and sensor noise from two recordings of a stochastic lag: over several seeds the
/// squared errors by the variances are χ².
#[test]
fn prediction_error_recovers_parameters_and_noise() {
    let system = system(LAG, &["k", "tau"]);
    let p = declared(&system);
    let (rate, sigma) = (0.3, 0.2);
    let seeds = 12;
    let mut sums = [0.0; 4];
    for seed in 0..seeds {
        let mut truth = lagging(1000 + seed, 400, 0.0, rate, sigma);
        truth.data.measured[17][0] = f64::NAN;
        let recordings = recorded(&[truth, lagging(2000 + seed, 300, 0.0, rate, sigma)]);
        let problem = PredictionErrorProblem::new(&system, &p, &recordings);
        let found = prediction_error(&problem).expect("estimates");
        assert!(found.termination.is_converged(), "{:?}", found.termination);
        assert_eq!(found.samples, 699);
        let level = |level: LevelEstimate, truth: f64| {
            ((level.value / truth).ln() / level.log_std.expect("determined")).powi(2)
        };
        let of = |name: &str, truth: f64| {
            let estimate = found.estimates.iter().find(|e| e.name == name).expect("estimated");
            ((estimate.value - truth) / estimate.std.expect("determined")).powi(2)
        };
        sums[0] += of("tau", 4.0);
        sums[1] += of("k", 1.0);
        sums[2] += level(found.rates[0], rate);
        sums[3] += level(found.noise[0].expect("used"), sigma);
        if seed == 0 {
            println!("{:?} {:?} {:?}", found.estimates, found.rates, found.noise);
        }
    }
    for sum in sums {
        consistent(sum, seeds as f64);
    }
}

/// Without process noise it is the fit by simulation error.
#[test]
fn prediction_error_without_process_noise_is_output_error() {
    let system = system(LAG, &["k", "tau"]);
    let p = declared(&system);
    let recordings = recorded(&[lagging(31, 300, 0.1, 0.0, 0.2)]);
    let options = Options { rtol: 1e-10, atol: 1e-10, ..Options::default() };
    let known = PredictionErrorProblem {
        rates: vec![NoiseLevelSource::Known(0.0)],
        noise: vec![Some(NoiseLevelSource::Known(0.2))],
        options,
        ..PredictionErrorProblem::new(&system, &p, &recordings)
    };
    let simulated = OutputErrorProblem {
        noise: vec![Some(NoiseSource::Known(0.2))],
        options,
        ..OutputErrorProblem::new(&system, &p, &recordings)
    };
    let of_simulation = fit(&simulated).expect("a fit");
    let found = prediction_error(&known).expect("estimates");
    assert_eq!(found.estimates.len(), of_simulation.estimates.len());
    for (a, b) in found.estimates.iter().zip(&of_simulation.estimates) {
        let std = b.std.expect("determined");
        assert_eq!(a.name, b.name);
        close(a.value, b.value, 1e-3 * std);
        close(a.std.expect("determined"), std, 1e-3 * std);
    }
    close(found.deviance, of_simulation.deviance, 1e-6 * found.deviance.abs());
    // So are the ways along an estimate, and who makes up for it.
    let along = prediction_error_profiles(&known, &found, &[0, 1]).expect("profiles");
    let expected = profiles(&simulated, &of_simulation, &[0, 1]).expect("profiles");
    assert_eq!(along.len(), 2);
    for (a, b) in along.iter().zip(&expected) {
        let std = found.estimates[a.estimate].std.expect("determined");
        for (a, b) in [(a.lower, b.lower), (a.upper, b.upper)] {
            assert!(
                matches!((a, b), (ProfileEnd::Interval(_), ProfileEnd::Interval(_))),
                "{a:?} {b:?}"
            );
            close(a.value(), b.value(), 5e-3 * std);
        }
        for ((a, b), estimate) in a.at_upper.iter().zip(&b.at_upper).zip(&found.estimates) {
            close(*a, *b, 2e-2 * estimate.std.expect("determined"));
        }
        let names =
            |terms: &[CombinationTerm]| terms.iter().map(|term| term.estimate).collect::<Vec<_>>();
        assert_eq!(names(&a.with_upper), names(&b.with_upper));
    }
    // Sought, the process noise is not told from none: estimates move by less than half their deviation.
    let sought = PredictionErrorProblem { rates: vec![NoiseLevelSource::Estimated], ..known };
    let sought = prediction_error(&sought).expect("estimates");
    for (a, b) in sought.estimates.iter().zip(&of_simulation.estimates) {
        close(a.value, b.value, 0.5 * b.std.expect("determined"));
    }
    assert!(sought.deviance <= found.deviance + 1e-6 && sought.deviance > found.deviance - 8.0);
}

/// A state that does not stray is found not to: its rate is zero, not merely too small to matter, and the search
/// does not creep there. The result does not depend on how many threads there are.
#[test]
fn a_state_that_does_not_stray_has_no_process_noise() {
    let system = system(LAG, &["k", "tau"]);
    let p = declared(&system);
    let of = |seed: u64, threads: usize| {
        let recordings = recorded(&[lagging(seed, 600, 0.1, 0.0, 0.2)]);
        let problem = PredictionErrorProblem::new(&system, &p, &recordings);
        prediction_error(&PredictionErrorProblem { threads, ..problem }).expect("estimates")
    };
    let all: Vec<_> = (40..46).map(|seed| of(seed, 1)).collect();
    // By half a chance noise looks as if the state strayed, a little.
    let none = all.iter().filter(|found| found.rates[0].at_bound.is_some()).count();
    assert!((1..6).contains(&none), "{none} of 6");
    for found in &all {
        let PredictionError { termination, iterations, .. } = found;
        assert!(termination.is_converged() && *iterations < 20, "{termination:?} {iterations}");
        let LevelEstimate { value, log_std, at_bound } = found.rates[0];
        match at_bound {
            Some(bound) => assert_eq!((bound, value, log_std), (BoundReached::Lower, 0.0, None)),
            None => assert!(value < 0.03 && log_std.expect("determined") > 0.2, "{value}"),
        }
    }
    for threads in [2, 3, 20] {
        assert_eq!(format!("{:?}", of(40, threads)), format!("{:?}", all[0]));
    }
}

/// Of two rows with one time the second counts: in the likelihood, and where samples are counted.
#[test]
fn samples_that_are_counted_are_those_that_are_used() {
    let system = system(LAG, &["k", "tau"]);
    let p = declared(&system);
    let of = |first: f64| {
        let mut truth = lagging(51, 200, 0.1, 0.2, 0.2);
        let Data { t, u, measured } = &mut truth.data;
        for k in [40, 80] {
            t.insert(k, t[k]);
            u.insert(k, u[k].clone());
            measured.insert(k, vec![first]);
        }
        let recordings = recorded(&[truth]);
        let problem = PredictionErrorProblem::new(&system, &p, &recordings);
        let problem =
            PredictionErrorProblem { noise: vec![Some(NoiseLevelSource::Known(0.2))], ..problem };
        prediction_error(&problem).expect("estimates")
    };
    let (with, without) = (of(0.7), of(f64::NAN));
    assert_eq!((with.samples, without.samples), (200, 200));
    assert_eq!((with.deviance, &with.p), (without.deviance, &without.p));
}

#[test]
fn bad_rows_are_named_and_leave_the_filter_as_it_was() {
    let system = system(LAG, &["k"]);
    let p = declared(&system);
    let problem = FilterProblem { gate: Some(5.0), ..FilterProblem::new(&system, &p) };
    let tuning = tuning(&[[0.1, 0.2]], &[[0.01, 0.0]], &[0.3]);
    let (u, none) = ([1.0], [f64::NAN]);
    let sample = |t: f64, y: f64| (t, [y]);
    let begin = |(t, y): (f64, [f64; 1])| {
        RunningFilter::begin(&problem, &tuning, FilterSample { t, u: &u, measured: &y })
            .expect("a filter")
    };
    let (mut filter, first) = begin(sample(0.0, 0.1));
    assert_eq!(first.samples, 1);
    let mut step = |t: f64, u: &[f64], y: &[f64]| filter.step(FilterSample { t, u, measured: y });
    let before = step(1.0, &u, &[0.2]).expect("a row");
    // Backwards in time.
    let error = step(0.5, &u, &[0.2]).expect_err("backwards").to_string();
    assert!(error.contains("back in time"), "{error}");
    // The same reading with the same stamp is one reading, another is another.
    let again = step(1.0, &[2.0], &[0.2]).expect("a jump");
    assert_eq!((again.samples, again.states), (0, before.states.clone()));
    let error = step(1.0, &u, &[0.2]).expect_err("a third").to_string();
    assert!(error.contains("more than two"), "{error}");
    // Nothing measured and no input: the last input goes on, the uncertainty grows.
    let row = step(2.0, &none, &none).expect("a row");
    assert!(row.samples == 0 && row.states[0].std > before.states[0].std);
    // Beyond the gate.
    let row = step(3.0, &u, &[50.0]).expect("a row");
    let innovation = row.innovations[0].expect("measured");
    assert!(!innovation.used && row.samples == 0);
    // A gap of a day.
    let row = step(86_403.0, &u, &[1.0]).expect("a row");
    assert!(row.failure.is_none() && row.states[0].std < 0.3);
    assert_eq!(filter.missing_inputs(), [1]);

    let error = RunningFilter::begin(
        &problem,
        &tuning,
        FilterSample { t: 0.0, u: &none, measured: &[1.0] },
    );
    assert!(matches!(error.err(), Some(FilterError::FirstInput { input }) if input == "u"));
}

/// A wrong model is told: innovations stay far larger than expected.
#[test]
fn a_filter_that_has_lost_its_way_says_so() {
    let system = system(LAG, &["k"]);
    let p = declared(&system);
    let problem = FilterProblem { free: vec![false; 2], ..FilterProblem::new(&system, &p) };
    let mut truth = lagging(3, 200, 0.0, 0.0, 0.3);
    for measured in &mut truth.data.measured[100..] {
        measured[0] += 3.0;
    }
    let tuning = tuning(&[[1.0, 0.001]], &[], &[0.3]);
    let rows = rows(&problem, &tuning, &truth.data);
    let alarms: Vec<(usize, InnovationAlarm)> =
        rows.iter().enumerate().filter_map(|(k, row)| Some((k, row.alarm?))).collect();
    assert!(
        matches!(alarms[..], [(100..120, InnovationAlarm::Diverged { ratio, .. })] if ratio > 1.5)
    );
}

/// Where the model cannot be evaluated the row says so, and a good sample brings the filter back; many such
/// rows on end are an error.
#[test]
fn a_step_that_fails_is_told_and_survived() {
    let text = "\
model drain
parameter a [1] = 0.1
state x [1] = 1
equation drain: der(x) * 1 [s] = -a*sqrt(x)
output y [1] = x  noise 0.1 [1]
";
    let system = system(text, &["a"]);
    let p = declared(&system);
    let problem = FilterProblem { free: vec![false; 2], ..FilterProblem::new(&system, &p) };
    let tuning = tuning(&[[1.0, 0.1]], &[], &[0.1]);
    let run = |measured: &dyn Fn(usize) -> f64| {
        let first = FilterSample { t: 0.0, u: &[], measured: &[measured(0)] };
        let (mut filter, _) = RunningFilter::begin(&problem, &tuning, first).expect("a filter");
        (1..30)
            .map(|k| filter.step(FilterSample { t: k as f64, u: &[], measured: &[measured(k)] }))
            .collect::<Vec<_>>()
    };
    let survived = run(&|k| if k == 3 { -5.0 } else { 0.8 });
    let rows: Vec<&TrackedRow> = survived.iter().map(|row| row.as_ref().expect("a row")).collect();
    let failed: Vec<f64> =
        rows.iter().filter(|row| row.failure.is_some()).map(|row| row.t).collect();
    assert!(!failed.is_empty() && failed.iter().all(|t| (4.0..10.0).contains(t)), "{failed:?}");
    close(rows[28].states[0].value, 0.8, 0.2);
    let stuck = run(&|k| if k >= 3 { -5.0 } else { 0.8 });
    let error = stuck.iter().find_map(|row| row.as_ref().err()).expect("an end");
    assert!(matches!(error, FilterError::Stuck { rows: 10, .. }), "{error}");
}

/// Two tanks: a heater with two modes that the state switches and one that an input does, a counter that
/// starts anew, a level that cannot fall below zero, and an unknown that is a state in one mode only.
const HYBRID: &str = "\
model hybrid
input u [1] hold
parameter a [1] = 0.6
parameter b [1] = 0.35
parameter k [1] = 0.9
state x [1] = 0.1
state n [1] = 0
state h [1] = 0.3
state v [1] = u
modes heater {
  on  { equation heat: der(x) * 1 [s] = 1 - a*x }
  off { equation heat: der(x) * 1 [s] = -a*x }
  on -> off when x rises above 0.8
  off -> on when x falls below 0.2
}
modes line {
  full     { equation outlet: v = u + 0.5*x }
  draining { equation outlet: der(v) * 1 [s] = -k*v + b*h }
  full -> draining when u falls below 0.7
  draining -> full when v falls below 0.05
}
saturate h >= 0
equation count: der(n) * 1 [s] = b + 0.2*v
when n rises above 1 { reset n = 0.1*x }
equation level: der(h) * 1 [s] = 0.6*u - 0.5 - 0.2*b*x
output y [1] = x + v  noise 0.1 [1]
output q [1] = h + n  noise 0.1 [1]
";

/// Rows at irregular times; the input jumps to and fro.
fn hybrid_data() -> Data {
    let n = 90;
    let t: Vec<f64> =
        (0..n).map(|k| f64::from(k) * 0.25 + if k % 3 == 1 { 0.07 } else { 0.0 }).collect();
    let u = |k: usize| vec![[1.3, 0.4, 0.2, 1.0][k / 13 % 4]];
    Data { u: (0..t.len()).map(u).collect(), measured: vec![vec![f64::NAN; 2]; t.len()], t }
}

/// Estimates are the run's, and their covariance is S P₀ Sᵀ with its sensitivities.
#[track_caller]
fn predicts_like(
    system: &LoadedSystem,
    data: &Data,
    solution: &dgd_runtime::Solution,
    states: &[f64],
    parameters: &[f64],
) {
    let p = declared(system);
    let walks = |all: &[f64]| all.iter().map(|start| [*start, 0.0]).collect::<Vec<_>>();
    let noise = vec![0.1; system.signature().outputs.len()];
    let tuning = tuning(&walks(states), &walks(parameters), &noise);
    let mut left = parameters.iter();
    let sigma = |direction: &dgd_runtime::Direction| match direction {
        dgd_runtime::Direction::Start(i) => states[*i],
        dgd_runtime::Direction::Parameter(_) => *left.next().expect("one for each free parameter"),
    };
    let sigma: Vec<f64> = system.signature().directions.iter().map(sigma).collect();
    for estimator in [FilterAlgorithm::ExtendedKalman, recursive(1.0)] {
        let problem =
            FilterProblem { estimator, options: tight(), ..FilterProblem::new(system, &p) };
        assert_eq!(problem.states(), (0..states.len()).collect::<Vec<_>>());
        for (k, row) in rows(&problem, &tuning, data).iter().enumerate() {
            assert_eq!(row.failure, None);
            let s = solution.s(k);
            for (i, state) in row.states.iter().enumerate() {
                close(state.value, solution.y(k)[i], 1e-8);
                let variance = |(j, sigma): (usize, &f64)| (s[j * solution.n + i] * sigma).powi(2);
                let std = sigma.iter().enumerate().map(variance).sum::<f64>().sqrt();
                close(state.std, std, 1e-6 * (1e-3 + std));
            }
        }
    }
}

/// A pendulum in Cartesian coordinates, of which now one and now the other coordinate is a state.
#[test]
fn states_that_constraints_choose_are_all_carried() {
    let path = support::root().join("models/pendulum_cartesian.dgd");
    let system = system(&std::fs::read_to_string(path).expect("a model file"), &["g", "l"]);
    let p = declared(&system);
    let t: Vec<f64> = (0..30).map(|k| 0.1 * f64::from(k)).collect();
    let run = dgd_runtime::Problem {
        system: &system,
        p: &p,
        inputs: &dgd_runtime::Inputs::none(),
        start: &[],
    };
    let solution = dgd_runtime::simulate_with_sensitivities(&run, &t, &tight()).expect("a run");
    let chosen: Vec<&[f64]> = (0..30).map(|k| solution.z(k)).collect();
    assert!(chosen.windows(2).any(|pair| pair[0] != pair[1]), "{chosen:?}");
    let data = Data { u: vec![vec![]; 30], measured: vec![vec![f64::NAN; 4]; 30], t };
    predicts_like(&system, &data, &solution, &[1e-3, 2e-3, 3e-3, 4e-3], &[5e-3, 6e-3]);
}

/// Without samples a filter only predicts: from row to row it is in the modes that one run over all rows is
/// in, and its covariance is S P₀ Sᵀ with the sensitivities of that run, through all of its events.
#[test]
fn modes_go_along_with_the_prediction_and_so_does_the_covariance() {
    let system = system(HYBRID, &["a", "b", "k"]);
    let p = declared(&system);
    let data = hybrid_data();
    let inputs = held_inputs(&data);
    let run = dgd_runtime::Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    // v depends on x at the start, so it has no start value of its own.
    let solution =
        dgd_runtime::simulate_with_sensitivities(&run, &data.t, &tight()).expect("a run");
    let automata =
        |kind: &str| solution.events.iter().filter(|event| event.automaton == kind).count();
    assert!(automata("heater") >= 4 && automata("line") >= 3, "{:?}", solution.events);
    assert!(automata("saturate h") >= 2 && solution.events.len() > 12, "{:?}", solution.events);
    assert!(solution.undefined.is_empty(), "{:?}", solution.undefined);

    predicts_like(&system, &data, &solution, &[1e-3, 2e-3, 3e-3, 4e-3], &[5e-3, 6e-3, 7e-3]);
    // Sigma points without a spread go through the same modes.
    let none = self::tuning(&[[0.0, 0.0]; 4], &[[0.0, 0.0]; 3], &[0.1, 0.1]);
    let estimator = FilterAlgorithm::Unscented(SigmaSpread::default());
    let problem = FilterProblem { estimator, options: tight(), ..FilterProblem::new(&system, &p) };
    for (k, row) in rows(&problem, &none, &data).iter().enumerate() {
        for (state, y) in row.states.iter().zip(solution.y(k)) {
            close(state.value, *y, 1e-8);
        }
    }
}

/// A ball that is dropped: after a bounce at t_b, in closed form,
///
/// ```text
///   s = √(v² + 2 g h),   t_b = (v + s)/g,   height = e s (t − t_b) − g/2 (t − t_b)²
/// ```
///
/// so that the covariance after the bounce is known from derivatives of that, which are what the saltation
/// matrix stands for. Then its height is measured, and what is estimated is as uncertain as the filter says.
#[test]
fn a_ball_bounces_with_the_covariance_of_the_closed_form() {
    let text = "\
model ball
parameter e [1] = 0.8  in 0 .. 1
parameter g [m/s^2] = 10
state h [m] = 5
state v [m/s] = 0  nominal 1
equation height: der(h) = v
equation fall: der(v) = -g
when h falls below 0 { reset v = -e*v }
output y [m] = h  noise 0.01 [m]
";
    let system = system(text, &["e"]);
    let p = declared(&system);
    let problem = FilterProblem { options: tight(), ..FilterProblem::new(&system, &p) };
    // The first bounce is after 1 s, six of its standard deviations from any row, the second after 2.6 s.
    let height = |h: f64, v: f64, e: f64, t: f64| {
        let (g, s) = (10.0, (v * v + 20.0 * h).sqrt());
        let tau = t - (v + s) / g;
        if tau < 0.0 {
            [h + v * t - 5.0 * t * t, v - g * t]
        } else {
            [e * s * tau - 5.0 * tau * tau, e * s - g * tau]
        }
    };
    let t: Vec<f64> = (0..21).map(|k| 0.12 * f64::from(k)).collect();
    let std = [0.02, 0.05, 0.03];
    let tuning = tuning(&[[std[0], 0.0], [std[1], 0.0]], &[[std[2], 0.0]], &[0.01]);
    let nothing =
        |measured: Vec<Vec<f64>>| Data { t: t.clone(), u: vec![vec![]; t.len()], measured };
    let silent = rows(&problem, &tuning, &nothing(vec![vec![f64::NAN]; t.len()]));
    for (row, t) in silent.iter().zip(&t) {
        // Central differences of the closed form, their error h² f‴/6.
        let step = 1e-5;
        for i in 0..2 {
            let by = |dh: f64, dv: f64, de: f64| height(5.0 + dh, dv, 0.8 + de, *t)[i];
            let slopes = [
                by(step, 0.0, 0.0) - by(-step, 0.0, 0.0),
                by(0.0, step, 0.0) - by(0.0, -step, 0.0),
                by(0.0, 0.0, step) - by(0.0, 0.0, -step),
            ];
            let variance: f64 =
                slopes.iter().zip(&std).map(|(d, s)| (d / (2.0 * step) * s).powi(2)).sum();
            close(row.states[i].value, height(5.0, 0.0, 0.8, *t)[i], 1e-8);
            close(row.states[i].std, variance.sqrt(), 1e-7);
        }
    }

    let runs = 80;
    let (mut nis, mut samples, mut of_e) = ([0.0; 2], 0, [0.0; 2]);
    for seed in 0..runs {
        let mut random = Normal::new(700 + seed);
        let (h, v) = (5.0 + std[0] * random.next(), std[1] * random.next());
        let e = 0.8 + std[2] * random.next();
        let read = |t: &f64| vec![height(h, v, e, *t)[0] + 0.01 * random.next()];
        let data = nothing(t.iter().map(read).collect());
        let estimators =
            [FilterAlgorithm::ExtendedKalman, FilterAlgorithm::Unscented(SigmaSpread::default())];
        for (k, estimator) in estimators.into_iter().enumerate() {
            let problem = FilterProblem { estimator, ..problem.clone() };
            let found = rows(&problem, &tuning, &data);
            nis[k] += found.iter().map(|row| row.normalised_square).sum::<f64>();
            let last = found.last().expect("rows").parameters[0];
            assert!(last.std < 0.3 * std[2], "{}", last.std);
            of_e[k] += ((last.value - e) / last.std).powi(2);
        }
        samples += t.len();
    }
    println!("innovations {nis:?} of {samples}, restitution {of_e:?} of {runs}");
    for k in 0..2 {
        consistent(nis[k], samples as f64);
        consistent(of_e[k], runs as f64);
    }
}

/// Without uncertainty a filter is a simulation: inputs that hold, go in straight lines, jump between two rows
/// with one time, and arrive late are what they are to a run over all rows.
#[test]
fn without_uncertainty_a_filter_is_a_simulation() {
    let text = "\
model mixer
input u [1] hold
input v [1] linear
parameter a [1] = 0.4
state x [1] = u + 1
state z [1] = 0.5
equation fast: der(x) * 1 [s] = u - a*x + delay(v, 2.6 [s])
equation slow: der(z) * 3 [s] = x*x - z + time/1 [s]*0.01
output y [1] = x + u + v  noise 0.1 [1]
output q [1] = z*x        noise 0.1 [1]
";
    let system = system(text, &[]);
    let p = declared(&system);
    // Rows at irregular times; u and v jump at 8 and 15.
    let times = [0.0, 0.5, 1.7, 2.0, 4.1, 6.0, 8.0, 8.0, 8.9, 11.0, 12.5, 15.0, 15.0, 16.0, 19.0];
    let u: Vec<f64> = times.iter().enumerate().map(|(k, _)| [1.0, 0.3, 2.0][k / 7]).collect();
    let v: Vec<f64> = (0..times.len()).map(|k| (k as f64 * 1.3).sin()).collect();
    let column =
        |name, values, interpolation| dgd_runtime::InputColumn { name, interpolation, values };
    let columns = [
        column("u", &u[..], dgd_runtime::Interpolation::Hold),
        column("v", &v[..], dgd_runtime::Interpolation::Linear),
    ];
    let inputs = dgd_runtime::Inputs::recorded(&times, &columns).expect("inputs");
    let run = dgd_runtime::Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let solution = dgd_runtime::simulate(&run, &times, &tight()).expect("a run");
    let simulated = dgd_runtime::observe(&run, &solution);
    let data = Data {
        t: times.to_vec(),
        u: (0..times.len()).map(|k| vec![u[k], v[k]]).collect(),
        measured: (0..times.len()).map(|k| vec![k as f64, 2.0]).collect(),
    };
    let tuning = tuning(&[[0.0, 0.0], [0.0, 0.0]], &[], &[0.1, 0.1]);
    for estimator in [
        FilterAlgorithm::ExtendedKalman,
        FilterAlgorithm::Unscented(SigmaSpread::default()),
        recursive(1.0),
    ] {
        let problem = FilterProblem {
            free: vec![false; system.signature().directions.len()],
            estimator,
            options: tight(),
            ..FilterProblem::new(&system, &p)
        };
        for (k, row) in rows(&problem, &tuning, &data).iter().enumerate() {
            close(row.states[0].value, solution.y(k)[0], 1e-8);
            close(row.states[1].value, solution.y(k)[1], 1e-8);
            assert_eq!(row.states[1].std, 0.0);
            // The left values of a jump are those of the row's own inputs.
            if times.get(k + 1) != Some(&times[k]) {
                let innovation = row.innovations[0].expect("measured");
                close(innovation.value, data.measured[k][0] - simulated.w(k)[0], 1e-8);
                close(innovation.std, 0.1, 1e-12);
            }
        }
    }
}
