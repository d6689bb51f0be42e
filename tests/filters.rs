//! Filters against closed forms, against each other, and against the statistics that they promise.

mod support;

use std::path::Path;

use dgd::identify::Noise;
use dgd::identify::filter::{
    Alarm, Estimator, Filter, FilterError, FilterProblem, Row, Sample, Spread, Tuning, Walk,
    usual_tuning,
};
use dgd::{Options, System};
use dgd_compiler::pipeline::Directions;
use dgd_execute::Loaded;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;
use support::compiled_text;

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

/// A tight solver, so that what is compared is the filter.
fn tight() -> Options {
    Options { rtol: 1e-12, atol: 1e-12, ..Options::default() }
}

fn system(text: &str, free: &[&str]) -> Loaded {
    let free = free.iter().map(|text| support::name(text)).collect();
    let directions = Directions::Tracked { free, fixed: Vec::new() };
    Loaded::new(compiled_text(Path::new("m.dgd"), text.to_owned(), (&[], &[]), &directions).program)
}

fn declared(system: &Loaded) -> Vec<f64> {
    system.signature().parameters.iter().map(|parameter| parameter.value).collect()
}

/// Normal deviates by Box and Muller.
struct Normal(Pcg64);

impl Normal {
    fn new(seed: u64) -> Self {
        Normal(Pcg64::new(u128::from(seed), 0))
    }

    fn next(&mut self) -> f64 {
        let mut uniform = || ((self.0.next_u64() >> 11) + 1) as f64 / (1u64 << 53) as f64;
        (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
    }
}

/// Rows of inputs and outputs.
struct Data {
    t: Vec<f64>,
    u: Vec<Vec<f64>>,
    measured: Vec<Vec<f64>>,
}

fn rows(problem: &FilterProblem<'_, Loaded>, tuning: &Tuning, data: &Data) -> Vec<Row> {
    let sample = |k: usize| Sample { t: data.t[k], u: &data.u[k], measured: &data.measured[k] };
    let (mut filter, first) = Filter::begin(problem, tuning, sample(0)).expect("a filter");
    let rest = (1..data.t.len()).map(|k| filter.step(sample(k)).expect("a row"));
    let rest: Vec<Row> = rest.collect();
    std::iter::once(first).chain(rest).collect()
}

#[track_caller]
fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} against {expected}");
}

fn tuning(states: &[[f64; 2]], parameters: &[[f64; 2]], noise: &[f64]) -> Tuning {
    let walk = |[start, rate]: &[f64; 2]| Walk { start: *start, rate: *rate };
    Tuning {
        states: states.iter().map(walk).collect(),
        parameters: parameters.iter().map(walk).collect(),
        noise: noise.iter().map(|sigma| Some(*sigma)).collect(),
    }
}

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
    for estimator in [Estimator::ExtendedKalman, Estimator::Unscented(Spread::default())] {
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
        let all = Data { measured: vec![vec![1.0]; n as usize], ..Data { t: data.t.clone(), u: data.u.clone(), measured: Vec::new() } };
        let (r, a) = (sigma * sigma, phi * phi);
        let b = q + r - a * r;
        let steady = (-b + (b * b + 4.0 * a * q * r).sqrt()) / (2.0 * a);
        let last = rows(&problem, &tuning, &all).pop().expect("rows");
        close(last.states[0].std, steady.sqrt(), 1e-9);
    }
}
