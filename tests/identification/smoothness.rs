//! `smooth` of a table whose values are fitted, against Bayesian linear regression in closed form: hat functions of the
//! knots, second differences of them, and the inverse of the normal equations by Gauss and Jordan.

use std::path::Path;

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_execute::LoadedSystem;
use dgd_identify::filter::{NoiseLevelSource, PredictionErrorProblem, prediction_error};
use dgd_identify::regression::{RegressionMethod, RegressionProblem, regress};
use dgd_identify::{
    DrawnFrom, Fit, NoiseSource, OutputErrorProblem, Prior, Recording, bootstrap, fit, information,
    starting_points,
};
use dgd_runtime::signature::PriorDensity;
use dgd_runtime::{Direction, InputColumn, Inputs, Interpolation, Options, System};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use crate::{normal, support};

const KNOTS: [f64; 9] = [0.0, 1.0, 2.5, 3.0, 4.5, 6.0, 7.0, 8.5, 10.0];
/// The first value is known.
const FIRST: f64 = 1.5;
/// Standard deviation of readings.
const SIGMA: f64 = 0.1;
/// Standard deviation of points from the lines between their neighbours.
const TAU: f64 = 0.2;
/// What is estimated, in the order of the model: the last value is twice its parameter.
const N: usize = 8;

fn model(smooth: &str) -> String {
    format!(
        "model curve\n\
         input x [m] linear\n\
         parameter y[2..8] [kg] = (1, 1, 1, 1, 1, 1, 1)\n\
         parameter half [kg] = 1 in 0.01 .. 100, log\n\
         table f(x [m]) [kg] at (0, 1, 2.5, 3, 4.5, 6, 7, 8.5, 10) =\n\
         (1.5, y[2], y[3], y[4], y[5], y[6], y[7], y[8], 2*half)  linear{smooth}\n\
         output w [kg] = f(x)  noise 0.1\n"
    )
}

/// A model, what it says of its parameters, and readings.
struct Case {
    system: LoadedSystem,
    priors: Vec<Prior>,
    p: Vec<f64>,
    x: Vec<f64>,
    recordings: [Recording; 1],
}

/// Values of the table at 60 places up to the last.
fn readings(last: f64) -> (Vec<f64>, Vec<f64>) {
    let mut random = Pcg64::new(1, 0);
    let x: Vec<f64> = (0..60).map(|k| last * (f64::from(k) + 0.5) / 60.0).collect();
    let of = |x: &f64| FIRST + (0.6 * x).sin() + 0.1 * x + SIGMA * normal(&mut random);
    let y = x.iter().map(of).collect();
    (x, y)
}

impl Case {
    fn new(text: &str, last: f64) -> Self {
        let (x, y) = readings(last);
        let times: Vec<f64> = (0..x.len()).map(|k| k as f64).collect();
        let column = InputColumn { name: "x", interpolation: Interpolation::Linear, values: &x };
        let inputs = Inputs::recorded(&times, &[column]).expect("inputs");
        let recordings = [Recording::new(times, inputs, vec![Some(y)])];
        Self::of(text, x, recordings)
    }

    fn of(text: &str, x: Vec<f64>, recordings: [Recording; 1]) -> Self {
        let directions = SensitivityDirections::Estimated { free: Vec::new(), fixed: Vec::new() };
        let path = Path::new("model.dgd");
        let compiled = support::compiled_text(path, text.to_owned(), (&[], &[]), &directions);
        let prior = |of: &dgd_compiler::model::Smoothness| Prior {
            weights: of.weights.iter().map(|(i, weight)| (*i as usize, *weight)).collect(),
            density: PriorDensity::Normal { mean: of.mean, std: of.std },
        };
        let priors = compiled.dae.smoothness.iter().map(prior).collect();
        let p = compiled.dae.parameters.iter().map(|parameter| parameter.value).collect();
        Self { system: LoadedSystem::new(compiled.program), priors, p, x, recordings }
    }

    fn problem(&self) -> OutputErrorProblem<'_> {
        OutputErrorProblem {
            noise: vec![Some(NoiseSource::Known(SIGMA))],
            priors: self.priors.clone(),
            negligible_reduction: 1e-16,
            options: Options { rtol: 1e-9, atol: 1e-9, ..Options::default() },
            ..OutputErrorProblem::new(&self.system, &self.p, &self.recordings)
        }
    }

    fn fit(&self) -> Fit {
        let found = fit(&self.problem()).expect("it can be simulated");
        assert!(found.termination.is_converged(), "{:?}", found.termination);
        found
    }

    /// Rows over what is estimated, and what they come to: readings over their σ.
    fn rows(&self) -> Vec<Row> {
        let measured = self.recordings[0].measured[0].as_ref().expect("readings");
        let rows = self.x.iter().zip(measured);
        rows.map(|(x, y)| Row::new(&hats(*x), *y, SIGMA)).collect()
    }
}

/// A row of a linear regression, weighted.
#[derive(Clone)]
struct Row {
    slopes: Vec<f64>,
    value: f64,
}

impl Row {
    /// Of Σ weight · value over all knots.
    fn new(weights: &[f64], value: f64, std: f64) -> Self {
        let own = |j: usize| if j == 0 { 2.0 * weights[8] } else { weights[j] };
        Row {
            slopes: (0..N).map(|j| own(j) / std).collect(),
            value: (value - FIRST * weights[0]) / std,
        }
    }
}

/// How much of each value the broken line has at x.
fn hats(x: f64) -> Vec<f64> {
    let of = |k: usize| {
        let rising =
            k.checked_sub(1).map_or(1.0, |before| (x - KNOTS[before]) / (KNOTS[k] - KNOTS[before]));
        let falling = KNOTS.get(k + 1).map_or(1.0, |after| (after - x) / (after - KNOTS[k]));
        rising.min(falling).max(0.0)
    };
    (0..KNOTS.len()).map(of).collect()
}

/// A row for each inner knot: the knot less the line between its neighbours.
fn second_differences(tau: f64) -> Vec<Row> {
    let of = |k: usize| {
        let [a, b, c] = [KNOTS[k - 1], KNOTS[k], KNOTS[k + 1]];
        let mut weights = vec![0.0; KNOTS.len()];
        weights[k] = 1.0;
        weights[k - 1] = -(c - b) / (c - a);
        weights[k + 1] = -(b - a) / (c - a);
        Row::new(&weights, 0.0, tau)
    };
    (1..KNOTS.len() - 1).map(of).collect()
}

/// Estimates and their covariance.
fn solved(rows: &[Row]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let sum = |of: &dyn Fn(&Row) -> f64| rows.iter().map(of).sum::<f64>();
    // [AᵀA | I] becomes [I | (AᵀA)⁻¹].
    let mut both: Vec<Vec<f64>> = (0..N)
        .map(|i| {
            let own = (0..N).map(|j| sum(&|row| row.slopes[i] * row.slopes[j]));
            own.chain((0..N).map(|j| f64::from(i == j))).collect()
        })
        .collect();
    for k in 0..N {
        let pivot = both[k][k];
        both[k].iter_mut().for_each(|entry| *entry /= pivot);
        let own = both[k].clone();
        for (_, row) in both.iter_mut().enumerate().filter(|(i, _)| *i != k) {
            let factor = row[k];
            row.iter_mut().zip(&own).for_each(|(entry, own)| *entry -= factor * own);
        }
    }
    let covariance: Vec<Vec<f64>> = both.into_iter().map(|row| row[N..].to_vec()).collect();
    let right: Vec<f64> = (0..N).map(|i| sum(&|row| row.slopes[i] * row.value)).collect();
    let estimate = |row: &Vec<f64>| row.iter().zip(&right).map(|(c, b)| c * b).sum();
    (covariance.iter().map(estimate).collect(), covariance)
}

/// The same, searched for without logarithms and bounds.
fn linear(text: &str) -> String {
    text.replace("in 0.01 .. 100, log", "")
}

fn smooth() -> String {
    model(&format!(", smooth {TAU}"))
}

/// Values and standard deviations against the closed form.
#[track_caller]
fn agrees(found: impl IntoIterator<Item = (f64, Option<f64>)>, rows: &[Row], tolerance: f64) {
    let (values, covariance) = solved(rows);
    let found: Vec<(f64, Option<f64>)> = found.into_iter().collect();
    assert_eq!(found.len(), N);
    for (j, (value, std)) in found.into_iter().enumerate() {
        let (wanted, own) = (values[j], covariance[j][j].sqrt());
        assert!((value / wanted - 1.0).abs() < tolerance, "{j}: {value}, and not {wanted}");
        let std = std.expect("determined");
        assert!((std / own - 1.0).abs() < tolerance, "std {j}: {std}, and not {own}");
    }
}

#[test]
fn a_fit_is_bayesian_linear_regression() {
    // Of the knots from 7 m on nothing is read in the second case.
    for last in [10.0, 6.5] {
        let case = Case::new(&smooth(), last);
        let rows = [case.rows(), second_differences(TAU)].concat();
        let found = case.fit();
        assert_eq!(found.estimates[0].name, "half");
        assert_eq!(found.degrees_of_freedom, 60 + 7 - N);
        assert_eq!(found.undetermined, []);
        agrees(found.estimates.iter().map(|e| (e.value, e.std)), &rows, 1e-6);

        let problem = RegressionProblem {
            noise: vec![Some(NoiseSource::Known(SIGMA))],
            priors: case.priors.clone(),
            ..RegressionProblem::new(&case.system, &case.p, &case.recordings)
        };
        for method in [RegressionMethod::LeastSquares, RegressionMethod::VariableProjection] {
            let found = regress(&problem, method).expect("a regression");
            assert_eq!(found.rank, N);
            agrees(found.estimates.iter().map(|e| (e.value, e.std)), &rows, 1e-6);
        }
    }
}

#[test]
fn what_no_reading_tells_is_undetermined_without_it() {
    let found = Case::new(&model(""), 6.5).fit();
    // The knots at 8.5 and 10 m; that at 7 m is read a little.
    assert_eq!(found.undetermined.len(), 2);
    let unknown = found.estimates.iter().filter(|estimate| estimate.std.is_none());
    assert_eq!(unknown.map(|e| e.name.as_str()).collect::<Vec<_>>(), ["half", "y[8]"]);
}

#[test]
fn parts_of_the_information_are_those_of_the_covariance() {
    let case = Case::new(&smooth(), 6.5);
    let readings = case.rows();
    let (_, covariance) = solved(&[readings.clone(), second_differences(TAU)].concat());
    let kinds = [vec![0; 60]];
    let found = information(&case.problem(), &case.fit(), &kinds, 1).expect("sensitivities");
    for one in &found {
        let own = &covariance[one.estimate];
        let along = |row: &Row| row.slopes.iter().zip(own).map(|(a, b)| a * b).sum::<f64>();
        let share = readings.iter().map(|row| along(row).powi(2)).sum::<f64>() / own[one.estimate];
        assert!((one.recordings[0] - share).abs() < 1e-6, "{one:?}, and not {share}");
    }
}

#[test]
fn refits_scatter_as_they_should() {
    // A bound would cut off what lies beyond it.
    let case = Case::new(&linear(&smooth()), 6.5);
    let (_, covariance) = solved(&[case.rows(), second_differences(TAU)].concat());
    let random = |k| {
        let mut random = Pcg64::new(2, k as u128);
        move || random.next_u64()
    };
    let found = bootstrap(&case.problem(), &case.fit(), 400, random).expect("refits");
    for (j, own) in covariance.iter().enumerate() {
        let (std, own) = (found.std(j).expect("many refits"), own[j].sqrt());
        assert!((std / own - 1.0).abs() < 0.2, "{j}: {std}, and not {own}");
    }
}

#[test]
fn units_do_not_matter() {
    let wanted = Case::new(&smooth(), 6.5).fit();
    let grams = model(", smooth 200")
        .replace("f(x [m]) [kg]", "f(x [cm]) [g]")
        .replace(
            "(0, 1, 2.5, 3, 4.5, 6, 7, 8.5, 10)",
            "(0, 100, 250, 300, 450, 600, 700, 850, 1000)",
        )
        .replace("(1.5,", "(1500,");
    for text in [grams, model(", smooth 200 [g]")] {
        let found = Case::new(&text, 6.5).fit();
        for (found, wanted) in found.estimates.iter().zip(&wanted.estimates) {
            let (std, own) = (found.std.expect("determined"), wanted.std.expect("determined"));
            assert!((found.value / wanted.value - 1.0).abs() < 1e-9, "{found:?}");
            assert!((std / own - 1.0).abs() < 1e-9, "{found:?}");
        }
    }
}

#[test]
fn it_leads_from_a_straight_line_to_what_readings_say() {
    let case = Case::new(&linear(&model(", smooth 1e-5")), 10.0);
    let measured = case.recordings[0].measured[0].as_ref().expect("readings");
    // The line through the first value that is nearest to the readings.
    let rise = |(x, y): (&f64, &f64)| x * (y - FIRST);
    let slope = case.x.iter().zip(measured).map(rise).sum::<f64>()
        / case.x.iter().map(|x| x * x).sum::<f64>();
    for (j, estimate) in case.fit().estimates.iter().enumerate() {
        let knot = if j == 0 { 0.5 * (FIRST + slope * KNOTS[8]) } else { FIRST + slope * KNOTS[j] };
        assert!((estimate.value - knot).abs() < 1e-5, "{}, and not {knot}", estimate.value);
    }

    let free = Case::new(&model(""), 10.0).fit();
    let loose = Case::new(&model(", smooth 1e5"), 10.0).fit();
    for (free, loose) in free.estimates.iter().zip(&loose.estimates) {
        assert!((free.value / loose.value - 1.0).abs() < 1e-8, "{free:?} {loose:?}");
    }
}

/// The table is read along a run.
#[test]
fn filters_take_it_in() {
    let text = linear(&smooth())
        .replace("input x [m] linear\n", "state x [m] = 0.05\nequation x: der(x) = 0.1 [m/s]\n")
        .replace("linear, smooth", "linear, beyond extend, smooth");
    let (x, y) = readings(6.0);
    let times = (0..x.len()).map(|k| k as f64).collect();
    let case = Case::of(&text, x, [Recording::new(times, Inputs::none(), vec![Some(y)])]);
    let rows = [case.rows(), second_differences(TAU)].concat();
    let directions = case.system.signature().directions.iter();
    let problem = PredictionErrorProblem {
        free: directions.map(|of| matches!(of, Direction::Parameter(_))).collect(),
        rates: vec![NoiseLevelSource::Known(0.0)],
        noise: vec![Some(NoiseLevelSource::Known(SIGMA))],
        priors: case.priors.clone(),
        ..PredictionErrorProblem::new(&case.system, &case.p, &case.recordings)
    };
    let found = prediction_error(&problem).expect("it can be filtered");
    agrees(found.estimates.iter().map(|e| (e.value, e.std)), &rows, 1e-4);
}

/// Only what is said of one parameter is where it may start.
#[test]
fn searches_begin_where_they_would_without_it() {
    let (with, without) = (Case::new(&smooth(), 6.5), Case::new(&model(""), 6.5));
    let points = |case: &Case| {
        let mut random = Pcg64::new(3, 0);
        let random = || random.next_u64();
        format!("{:?}", starting_points(&case.problem(), 5, DrawnFrom::Values, random))
    };
    assert_eq!(points(&with), points(&without));
}
