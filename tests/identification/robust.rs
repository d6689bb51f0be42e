//! Losses that bear outliers, and fits from several starting points.

use dgd_identify::{
    DrawnFrom, LocalMinimum, Loss, MultiStart, NoiseSource, OutputErrorProblem, PointEnd, Prior,
    Recording, Starts, Termination, bootstrap, fit, fit_from, fit_from_drawn, profile,
    starting_points,
};
use dgd_runtime::{InputColumn, Inputs, Interpolation};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use super::{HEATER, Patience, SIGMA, TRUTH, close, declared, heated, normal, system, values};

const ROBUST: [Loss; 3] = [Loss::Huber, Loss::Cauchy, Loss::Tukey];

fn density(r: f64) -> f64 {
    (-0.5 * r * r).exp() / std::f64::consts::TAU.sqrt()
}

/// The mean of a function of a normal deviate, by the trapezoidal rule.
fn mean(of: impl Fn(f64) -> f64) -> f64 {
    let h = 1e-4;
    (-100_000..=100_000).map(|k| f64::from(k) * h).map(|r| of(r) * density(r) * h).sum()
}

#[test]
fn losses_are_what_their_table_says() {
    for loss in ROBUST {
        let c = loss.tuning().expect("not squares");
        for r in [-9.0, -4.0, -1.4, -0.5, 0.3, 1.2, 2.0, 4.6, 20.0] {
            let d = 1e-5;
            let (below, at, above) = (loss.evaluate(r - d), loss.evaluate(r), loss.evaluate(r + d));
            close(at.weight * r, (above.value - below.value) / (4.0 * d), 1e-8);
            let psi = |r: f64| loss.evaluate(r).weight * r;
            close(at.curvature, (psi(r + d) - psi(r - d)) / (2.0 * d), 1e-7);
            assert!(at.weight <= 1.0 && at.value <= r * r, "no larger than squares: {loss:?} {r}");
        }
        // The same where it leaves the parabola as squares are there, and continuous.
        close(loss.evaluate(1e-4).value, 1e-8, 1e-15);
        close(loss.evaluate(c - 1e-9).value, loss.evaluate(c + 1e-9).value, 1e-7);
        // Asymptotic variance for normal noise, over that of squares: 1/0.95.
        let influence = mean(|r| (loss.evaluate(r).weight * r).powi(2));
        let curvature = mean(|r| loss.evaluate(r).curvature);
        close(curvature * curvature / influence, 0.95, 2e-4);
        close(
            mean(|r| f64::from(u8::from(loss.evaluate(r).weight < 0.5))),
            loss.light_share(),
            1e-5,
        );
    }
}

/// Air flow, temperature of the cooling water, acid concentration, and loss of a stack: Brownlee,
/// Statistical Theory and Methodology in Science and Engineering (1965) 454.
const STACK: [[f64; 4]; 21] = [
    [80.0, 27.0, 89.0, 42.0],
    [80.0, 27.0, 88.0, 37.0],
    [75.0, 25.0, 90.0, 37.0],
    [62.0, 24.0, 87.0, 28.0],
    [62.0, 22.0, 87.0, 18.0],
    [62.0, 23.0, 87.0, 18.0],
    [62.0, 24.0, 93.0, 19.0],
    [62.0, 24.0, 93.0, 20.0],
    [58.0, 23.0, 87.0, 15.0],
    [58.0, 18.0, 80.0, 14.0],
    [58.0, 18.0, 89.0, 14.0],
    [58.0, 17.0, 88.0, 13.0],
    [58.0, 18.0, 82.0, 11.0],
    [58.0, 19.0, 93.0, 12.0],
    [50.0, 18.0, 89.0, 8.0],
    [50.0, 18.0, 86.0, 7.0],
    [50.0, 19.0, 72.0, 8.0],
    [50.0, 19.0, 79.0, 8.0],
    [50.0, 20.0, 80.0, 9.0],
    [56.0, 20.0, 82.0, 15.0],
    [70.0, 20.0, 91.0, 15.0],
];

#[test]
fn published_robust_regressions_come_out() {
    let system = system(
        "model stack\ninput air [1]\ninput water [1]\ninput acid [1]\n\
         parameter c0 [1] = 0\nparameter c1 [1] = 0\nparameter c2 [1] = 0\nparameter c3 [1] = 0\n\
         output loss [1] = c0 + c1*air + c2*water + c3*acid\n",
    );
    let p = declared(&system);
    let times: Vec<f64> = (0..21).map(f64::from).collect();
    let column = |j: usize| STACK.iter().map(|row| row[j]).collect::<Vec<f64>>();
    let inputs = [column(0), column(1), column(2)];
    let columns: Vec<InputColumn<'_>> = ["air", "water", "acid"]
        .iter()
        .zip(&inputs)
        .map(|(name, values)| InputColumn { name, interpolation: Interpolation::Hold, values })
        .collect();
    let inputs = Inputs::recorded(&times, &columns).expect("inputs");
    let recordings = [Recording::new(times, inputs, vec![Some(column(3))])];
    let fitted = |loss: Loss, noise: NoiseSource| {
        let problem = OutputErrorProblem {
            noise: vec![Some(noise)],
            loss,
            ..OutputErrorProblem::new(&system, &p, &recordings)
        };
        fit(&problem).expect("a fit")
    };
    // `rlm` of R's package MASS, its scale, values and standard errors as they are printed.
    let published = [
        (Loss::Huber, 2.441, [-41.0265, 0.8294, 0.9261, -0.1278], [9.8073, 0.1112, 0.3034, 0.1289]),
        (Loss::Tukey, 2.282, [-42.2853, 0.9275, 0.6507, -0.1123], [9.5045, 0.1077, 0.2940, 0.1249]),
    ];
    for (loss, scale, coefficients, errors) in published {
        let found = fitted(loss, NoiseSource::Known(scale));
        assert!(found.termination.is_converged(), "{:?}", found.termination);
        for ((estimate, value), error) in found.estimates.iter().zip(coefficients).zip(errors) {
            // To the digits of the scale.
            close(estimate.value, value, 2e-3 * error + 5e-5);
            // `rlm` ends where residuals change by a part of 1e-4, which Huber's scatter hardly sees.
            let ended = if loss == Loss::Huber { 1e-3 } else { 4e-3 };
            close(estimate.std.expect("determined"), error, ended * error);
        }
        // Its scale is the median over 0.6745, without our factor for so few degrees of freedom.
        let own = fitted(loss, NoiseSource::Estimated).noise[0].expect("fitted");
        let factor = (21.0_f64 / 17.0).sqrt();
        assert!((0.9..1.2).contains(&(own / factor / scale)), "{own} against {scale}");
    }
}

/// The heater's recording, in which every tenth sample of `y`, more or less, and every twentieth of `z` is
/// an outlier, mostly to one side.
fn spoilt(seed: u64) -> Recording {
    let mut recording = heated(seed, TRUTH[2], SIGMA);
    let mut random = Pcg64::new(u128::from(seed), 77);
    let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    for (samples, (share, from, until)) in
        recording.measured.iter_mut().flatten().zip([(0.1, 0.2, 2.0), (0.05, -5.0, 1.0)])
    {
        for sample in samples {
            if uniform() < share {
                *sample += from + (until - from) * uniform();
            }
        }
    }
    recording
}

#[test]
fn outliers_hardly_move_estimates_and_their_scatter_is_known() {
    let system = system(HEATER);
    let p = declared(&system);
    let seeds = 60;
    let squares_of = |loss: Loss| {
        let mut squares = [0.0; 3];
        let mut size = [0.0; 3];
        for seed in 0..seeds {
            let recordings = [spoilt(seed)];
            let problem =
                OutputErrorProblem { loss, ..OutputErrorProblem::new(&system, &p, &recordings) };
            let found = fit(&problem).expect("a fit");
            assert!(found.termination.is_converged(), "{loss:?} {seed}: {:?}", found.termination);
            for (i, estimate) in found.estimates.iter().enumerate() {
                let std = estimate.std.expect("determined");
                squares[i] += ((estimate.value - TRUTH[i]) / std).powi(2);
                size[i] += std / seeds as f64;
            }
        }
        (squares, size)
    };
    let recordings: Vec<Recording> = vec![heated(0, TRUTH[2], SIGMA)];
    let clean = fit(&OutputErrorProblem::new(&system, &p, &recordings)).expect("a fit");
    let (_, of_squares) = squares_of(Loss::Squares);
    for loss in ROBUST {
        let (squares, size) = squares_of(loss);
        let n = seeds as f64;
        for (i, sum) in squares.into_iter().enumerate() {
            // As `estimates_scatter_as_their_covariance_says`; Huber's is pulled a little to one side.
            let bias = if loss == Loss::Huber { 0.3 * n } else { 0.1 * n };
            close(sum, n, 5.0 * (2.0 * n).sqrt() + bias);
            let without = clean.estimates[i].std.expect("determined");
            assert!(size[i] < 1.4 * without, "{loss:?}: {} for {without}", size[i]);
            assert!(of_squares[i] > 4.0 * size[i], "{loss:?}: {} by squares", of_squares[i]);
        }
    }
}

#[test]
fn intervals_are_those_of_the_loss() {
    let system = system(HEATER);
    let p = declared(&system);
    let recordings = [spoilt(11), spoilt(12)];
    for loss in ROBUST {
        let problem = OutputErrorProblem {
            loss,
            threads: 2,
            ..OutputErrorProblem::new(&system, &p, &recordings)
        };
        let found = fit(&problem).expect("a fit");
        let random = |replicate: usize| {
            let mut random = Pcg64::new(5, replicate as u128);
            move || random.next_u64()
        };
        let resampled = bootstrap(&problem, &found, 200, random).expect("resampled");
        for (i, estimate) in found.estimates.iter().enumerate() {
            let std = estimate.std.expect("determined");
            // 200 replicates give a standard deviation to 5 %; the median that scales them also moves.
            close(resampled.std(i).expect("many") / std, 1.0, 0.25);
            let along = profile(&problem, &found, i).expect("a profile");
            let (Some(low), Some(high)) = along.interval() else { panic!("{along:?}") };
            // Few samples leave or enter the straight part on the way.
            close((high - low) / (2.0 * 1.96 * std), 1.0, 0.1);
        }
        let alone = fit(&OutputErrorProblem { threads: 1, ..problem.clone() }).expect("a fit");
        assert_eq!(values(&found), values(&alone));
        // One of ten of `y` in two recordings of 200, one of twenty of `z`; a few of them are small.
        assert!((25..=55).contains(&found.light_samples[0]), "{:?}", found.light_samples);
        assert!((10..=35).contains(&found.light_samples[1]), "{:?}", found.light_samples);
        assert_eq!(found.reduced_chi_square(), None);
    }
    let squares = fit(&OutputErrorProblem::new(&system, &p, &recordings)).expect("a fit");
    assert_eq!(squares.light_samples, [0, 0]);
}

/// A sine of which the frequency, and another with a factor of which the sign cannot be seen.
const WAVES: &str = "\
model waves
input s [s]
parameter w [1/s] = 3  in 0.5 .. 20
parameter a [1] = 0.4  in -2 .. 2
output y [1] = sin(w*s)  noise 0.05 [1]
output z [1] = a^2*s/(1 [s])  noise 0.05 [1]
";

fn waves() -> [Recording; 1] {
    let times: Vec<f64> = (0..80).map(|k| 0.1 * f64::from(k)).collect();
    let mut random = Pcg64::new(3, 0);
    let y = times.iter().map(|t| (5.7 * t).sin() + 0.05 * normal(&mut random)).collect();
    let z = times.iter().map(|t| 1.44 * t + 0.05 * normal(&mut random)).collect();
    let column = InputColumn { name: "s", interpolation: Interpolation::Linear, values: &times };
    let inputs = Inputs::recorded(&times, &[column]).expect("inputs");
    [Recording::new(times, inputs, vec![Some(y), Some(z)])]
}

fn random(seed: u64) -> impl FnMut() -> u64 {
    let mut random = Pcg64::new(u128::from(seed), 1);
    move || random.next_u64()
}

#[test]
fn of_many_minima_the_best_is_found_and_its_equals_are_named() {
    let system = system(WAVES);
    let p = declared(&system);
    let recordings = waves();
    let noise = vec![Some(NoiseSource::Known(0.05)); 2];
    let problem = OutputErrorProblem { noise, ..OutputErrorProblem::new(&system, &p, &recordings) };
    // The nearest minimum is another one.
    let alone = fit(&problem).expect("a fit");
    assert!((alone.p[0] - 5.7).abs() > 0.5, "{:?}", alone.p);

    let points = starting_points(&problem, 200, DrawnFrom::Values, random(1));
    let points: Vec<Starts> = (0..points.len()).map(|k| points.draw(k, 0)).collect();
    let found = fit_from(&problem, &points).expect("a fit");
    close(found.fit.p[0], 5.7, 4.0 * found.fit.estimates[0].std.expect("determined"));
    close(found.fit.p[1].abs(), 1.2, 0.01);
    let minima = found.minima();
    assert!(minima.len() > 4, "{minima:?}");
    let LocalMinimum { points: led, above } = &minima[0];
    assert_eq!((led[0], *above), (found.best, 0.0));
    // The second has the other sign, and is as good.
    let other = found.fit_of(minima[1].points[0]).expect("a fit");
    close(minima[1].above, 0.0, 1e-6);
    close(other.p[1], -found.fit.p[1], 1e-4);
    assert!(minima[2].above > 100.0, "{minima:?}");
    let reached: usize = minima.iter().map(|minimum| minimum.points.len()).sum();
    // Where little of the wave is explained, steps by sensitivities alone come slowly to the minimum.
    let is_slow = |end: &&PointEnd| match end {
        PointEnd::Fitted(fit) => fit.termination == Termination::EvaluationLimit,
        PointEnd::Failed(_) | PointEnd::LeftOut => false,
    };
    let slow = found.ends.iter().filter(is_slow).count();
    assert_eq!(reached + slow, 200, "each led somewhere");
    assert!(slow < 20, "{slow}");

    let ends = |found: &MultiStart| {
        let end = |end: &PointEnd| match end {
            PointEnd::Fitted(fit) => values(fit).iter().map(|value| value.to_bits()).collect(),
            PointEnd::Failed(_) | PointEnd::LeftOut => Vec::new(),
        };
        found.ends.iter().map(end).collect::<Vec<_>>()
    };
    for threads in [2, 3, 64] {
        let again = fit_from(&OutputErrorProblem { threads, ..problem.clone() }, &points);
        let again = again.expect("a fit");
        assert_eq!((again.best, ends(&again)), (found.best, ends(&found)));
    }

    // Fits not reached before the stop are left out.
    let watch = Patience::with("starts", 7);
    let some = fit_from(&OutputErrorProblem { watch: &watch, ..problem.clone() }, &points);
    let some = some.expect("a fit");
    assert_eq!(ends(&some)[..7], ends(&found)[..7]);
    assert!(some.ends[7..].iter().all(|end| matches!(end, PointEnd::LeftOut)));
}

#[test]
fn starting_points_fill_the_ranges_of_all_parameters() {
    let system = system(
        "model ranges\ninput u [1]\n\
         parameter both [1] = 3 in -10 .. 30\nparameter above [1] = 50 in 20 ..\n\
         parameter zero [m] = 0 nominal 4\nparameter log [1] = 1e-3 in 1e-5 .. 1, log\n\
         parameter prior [1] = 7\nparameter minus [1] = -2\nparameter fixed [1] = 9\n\
         output y [1] = (both + above + log + prior + minus + fixed)*u + zero/(1 [m])\n",
    );
    let p = declared(&system);
    let recordings = waves();
    let mut problem = OutputErrorProblem::new(&system, &p, &recordings);
    problem.priors = vec![Prior::normal(4, 6.0, 0.5)];
    problem.free[6] = false;
    let n = 33;
    let draw = |seed| {
        let points = starting_points(&problem, n, DrawnFrom::Values, random(seed));
        (0..points.len()).map(|k| points.draw(k, 0)).collect::<Vec<Starts>>()
    };
    let points = draw(2);
    assert_eq!((points.len(), points[0].len()), (n, 0), "the first is the problem's own");
    let linear = |from: f64, until: f64| move |value: f64| (value - from) / (until - from);
    let log = |from: f64, until: f64| move |value: f64| (value / from).ln() / (until / from).ln();
    let places: [Box<dyn Fn(f64) -> f64>; 6] = [
        Box::new(linear(-10.0, 30.0)),
        Box::new(log(20.0, 500.0)),
        Box::new(linear(-4.0, 4.0)),
        Box::new(log(1e-4, 1e-2)),
        Box::new(linear(5.0, 7.0)),
        Box::new(log(-0.2, -20.0)),
    ];
    for (i, place) in places.iter().enumerate() {
        let mut strata: Vec<usize> = points[1..]
            .iter()
            .map(|point| {
                let (parameter, value) = point[i];
                assert_eq!(parameter, i);
                let place = place(value);
                assert!((0.0..=1.0 + 1e-12).contains(&place), "{value} of {i}");
                ((place * 32.0).ceil() as usize).clamp(1, 32)
            })
            .collect();
        strata.sort_unstable();
        assert_eq!(strata, (1..=32).collect::<Vec<_>>(), "one in each part of {i}");
    }
    assert!(points[1..].iter().all(|point| point.len() == 6), "what is fixed stays");
    assert_ne!(points, draw(3));
    assert_eq!(points, draw(2));
}

#[test]
fn points_of_bounds_lie_anywhere_between_them() {
    let system = system(
        "model ranges\ninput u [1]\n\
         parameter both [1] = 3 in 1 .. 1001\nparameter above [1] = 50 in 20 ..\n\
         parameter log [1] = 1e-3 in 1e-5 .. 1, log\noutput y [1] = (both + above + log)*u\n",
    );
    let p = declared(&system);
    let recordings = waves();
    let problem = OutputErrorProblem::new(&system, &p, &recordings);
    let points = starting_points(&problem, 101, DrawnFrom::Bounds, random(2));
    let quantile = |i: usize, part: f64| {
        let mut all: Vec<f64> = (1..101).map(|k| points.draw(k, 0)[i].1).collect();
        all.sort_by(f64::total_cmp);
        all[(part * 100.0) as usize]
    };
    // Of 100 points, one in each hundredth: a quantile is within a hundredth of the range.
    close(quantile(0, 0.5), 501.0, 11.0);
    close(quantile(0, 0.1), 101.0, 11.0);
    // From a half to ten times of its value, as by values.
    close(quantile(1, 0.5).ln(), (20.0_f64 * 500.0).ln() / 2.0, 0.04);
    close(quantile(2, 0.5).log10(), -2.5, 0.06);
    close(quantile(2, 0.9).log10(), -0.5, 0.06);
}

/// A model whose simulation fails for k above 4: a state beyond all numbers.
const BURSTING: &str = "\
model bursting
parameter k [1/s] = 1 in 0.01 .. 10
state x [1] = 1
equation growth: der(x) = k * x + if k > 4 [1/s] then 1e300 * x * x / (1 [s]) else 0 [1/s]
output y [1] = exp(-x)
";

#[test]
fn a_point_that_cannot_be_simulated_is_drawn_again_in_its_stratum() {
    let system = system(BURSTING);
    let p = declared(&system);
    let times: Vec<f64> = (0..20).map(|k| 0.05 * f64::from(k)).collect();
    let y = times.iter().map(|t| (-(1.5 * t).exp()).exp()).collect();
    let inputs = Inputs::none();
    let recordings = [Recording::new(times, inputs, vec![Some(y)])];
    let noise = vec![Some(NoiseSource::Known(0.01))];
    let problem = OutputErrorProblem {
        noise,
        free: vec![true, false],
        ..OutputErrorProblem::new(&system, &p, &recordings)
    };
    // Strata are quarters: the one that holds 4 has draws of both kinds, those above have none that can be simulated.
    let points = starting_points(&problem, 5, DrawnFrom::Bounds, random(1));
    let found = fit_from_drawn(&problem, &points).expect("a fit");
    let failed = found.ends.iter().filter(|end| matches!(end, PointEnd::Failed(_))).count();
    assert_eq!(failed, 2, "the quarters above 5");
    assert!(found.failed_draws >= 40, "{}", found.failed_draws);
    close(found.fit.p[0], 1.5, 1e-3);
    let again = fit_from_drawn(&OutputErrorProblem { threads: 3, ..problem.clone() }, &points);
    let again = again.expect("a fit");
    assert_eq!((again.best, again.failed_draws), (found.best, found.failed_draws));
    // Nothing was drawn that could have been nearer than a quarter, so that 3 of N is not said of two.
    assert_eq!(found.found_volume(), None);
}
