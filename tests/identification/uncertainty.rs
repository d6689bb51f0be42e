//! How sure fits are: intervals cover the truth as often as they say, and open ones are open.

#[path = "../../examples/drilling_rig/mod.rs"]
mod drilling_rig;

use std::path::Path;

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_execute::LoadedSystem;
use dgd_identify::{
    Bootstrap, BoundReached, Fit, NoiseSource, OutputErrorProblem, Prior, ProfileEnd, Recording,
    THRESHOLD, bootstrap, evaluate, fit, information, profile, profiles,
};
use dgd_runtime::{
    InputColumn, Inputs, Interpolation, Options, Problem, System, observe, simulate,
};
use drilling_rig::plant::{LPM, Plant};
use drilling_rig::recording::Row;
use drilling_rig::{Scenario, record};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use crate::examined;
use crate::normal;
use crate::support;
use crate::support::compiled_text;

const HEATER: &str = "\
model heater
input u [1] hold
parameter gain [1] = 0.8  in 0 ..
parameter tau  [s] = 40   in 1 .. 1000, log
state x [1] = 1
equation heat: tau * der(x) = gain*u - x
output y [1] = x  noise 0.2 [1]
";

/// True values of `gain`, `tau` and `x(0)`.
const TRUTH: [f64; 3] = [0.5, 20.0, 2.0];
const SIGMA: f64 = 0.2;
const SEEDS: u64 = 60;

fn system(text: &str) -> LoadedSystem {
    let directions = SensitivityDirections::Estimated { free: Vec::new(), fixed: Vec::new() };
    let compiled = compiled_text(Path::new("m.dgd"), text.to_owned(), (&[], &[]), &directions);
    LoadedSystem::new(compiled.program)
}

fn declared(system: &LoadedSystem) -> Vec<f64> {
    system.signature().parameters.iter().map(|parameter| parameter.value).collect()
}

/// The heater's reading once a second, from the solution and not from a solver, with noise that is
/// a·(what it was) + innovations, of standard deviation `SIGMA`.
fn heated(seed: u64, n: u32, a: f64) -> Recording {
    let [gain, tau, mut x] = TRUTH;
    let times: Vec<f64> = (0..n).map(f64::from).collect();
    let u: Vec<f64> = (0..n).map(|k| [4.0, 1.0, 6.0, 3.0][k as usize / 25 % 4]).collect();
    let mut random = Pcg64::new(u128::from(seed), 77);
    let mut noise = SIGMA * normal(&mut random);
    let mut y = Vec::new();
    for u in &u {
        y.push(x + noise);
        noise = a * noise + (1.0 - a * a).sqrt() * SIGMA * normal(&mut random);
        x = gain * u + (x - gain * u) * (-1.0 / tau).exp();
    }
    let column = InputColumn { name: "u", interpolation: Interpolation::Hold, values: &u };
    let inputs = Inputs::recorded(&times, &[column]).expect("inputs");
    Recording::new(times, inputs, vec![Some(y)])
}

fn resampled(problem: &OutputErrorProblem<'_>, fit: &Fit, seed: u64, n: usize) -> Bootstrap {
    let random = |k: usize| {
        let mut random = Pcg64::new(u128::from(seed), k as u128);
        move || random.next_u64()
    };
    bootstrap(problem, fit, n, random).expect("refits")
}

/// How often an interval of 95 % may cover in `SEEDS` repeats: outside of these counts it does so by
/// chance less than once in a thousand. Binomial(60, 0.95): P(≤ 50) = 0.0008; 60 of 60 is 0.046.
fn covers(what: &str, counts: [usize; 3]) {
    for (count, name) in counts.iter().zip(["gain", "tau", "x(0)"]) {
        assert!(*count >= 51, "{what} of {name}: {count} of {SEEDS}");
    }
    // And not all of all: 180 of 180 has a probability of 1e-4.
    assert!(counts.iter().sum::<usize>() < 180, "{what}: {counts:?}");
}

#[test]
fn intervals_cover_the_truth_as_often_as_they_say() {
    let system = system(HEATER);
    let p = declared(&system);
    let (mut asymptotic, mut by_profile, mut by_bootstrap) = ([0; 3], [0; 3], [0; 3]);
    for seed in 0..SEEDS {
        let recordings = [heated(seed, 100, 0.0)];
        let problem = OutputErrorProblem::new(&system, &p, &recordings);
        let fit = fit(&problem).expect("a fit");
        let profiles = profiles(&problem, &fit, &[0, 1, 2]).expect("profiles");
        let again = resampled(&problem, &fit, seed, 199);
        assert_eq!(again.failures, 0);
        for (i, truth) in TRUTH.iter().enumerate() {
            let estimate = &fit.estimates[i];
            let std = estimate.std.expect("determined");
            asymptotic[i] += usize::from((estimate.value - truth).abs() <= 1.959_964 * std);
            let (low, high) = profiles[i].interval();
            let (low, high) = (low.expect("closed"), high.expect("closed"));
            assert!(low < estimate.value && estimate.value < high);
            by_profile[i] += usize::from((low..=high).contains(truth));
            let (low, high) = again.interval(i, 0.95).expect("enough");
            by_bootstrap[i] += usize::from((low..=high).contains(truth));
        }
    }
    println!("asymptotic {asymptotic:?}, profile {by_profile:?}, bootstrap {by_bootstrap:?}");
    covers("asymptotic", asymptotic);
    covers("profile", by_profile);
    covers("bootstrap", by_bootstrap);
}

/// A file of the rig's recordings, with the model's outputs in SI.
fn of_the_rig(system: &LoadedSystem, rows: &[Row]) -> Recording {
    let column = |of: fn(&Row) -> f64| -> Vec<f64> { rows.iter().map(of).collect() };
    let times = column(|row| row.time);
    let values =
        [column(|r| r.w_ssp / 100.0), column(|r| r.q_boost * LPM), column(|r| r.q_tf * LPM)];
    let columns: Vec<InputColumn<'_>> = system
        .signature()
        .inputs
        .iter()
        .zip(&values)
        .map(|(of, values)| InputColumn { name: &of.name, interpolation: of.interpolation, values })
        .collect();
    let inputs = Inputs::recorded(&times, &columns).expect("inputs");
    // p_out and p_in are gauge in the model as well.
    let measured = [
        column(|r| r.p_r * 1e5),
        column(|r| r.p_in * 1e5),
        column(|r| r.p_out * 1e5),
        column(|r| r.q_ssp * LPM),
    ];
    Recording::new(times, inputs, measured.into_iter().map(Some).collect())
}

/// The same with the start that its first row shows, as `dgd fit` begins.
fn started(system: &LoadedSystem, p: &[f64], recording: Recording) -> Recording {
    let first: Vec<f64> = recording.measured.iter().flatten().map(|w| w[0]).collect();
    let start = examined::start(system, p, &recording.inputs, &first);
    Recording { start, ..recording }
}

fn circulation() -> LoadedSystem {
    let path = support::root().join("models/mud_circulation.dgd");
    system(&std::fs::read_to_string(path).expect("a model file"))
}

fn named(system: &LoadedSystem, name: &str) -> usize {
    let parameters = &system.signature().parameters;
    parameters.iter().position(|parameter| parameter.name == name).expect("a parameter")
}

/// Runs the repeats on all cores, in the order of their seeds.
fn repeated<T: Send>(
    system: &LoadedSystem,
    n: u64,
    one: impl Fn(&LoadedSystem, u64) -> T + Sync,
) -> Vec<T> {
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get) as u64;
    std::thread::scope(|scope| {
        let parts: Vec<_> = (0..threads)
            .map(|part| {
                let (system, one) = (system.clone(), &one);
                scope.spawn(move || {
                    let own = (part..n).step_by(threads as usize);
                    own.map(|k| (k, one(&system, k))).collect::<Vec<_>>()
                })
            })
            .collect();
        let mut all: Vec<(u64, T)> =
            parts.into_iter().flat_map(|part| part.join().expect("a thread")).collect();
        all.sort_by_key(|(k, _)| *k);
        all.into_iter().map(|(_, found)| found).collect()
    })
}

/// The drilling model itself makes 200 recordings, under the controls of a rig whose booster pump stops:
/// of each parameter and start value, 180 to 198 intervals of 95 % cover. Binomial(200, 0.95) is below with
/// a probability of 0.0009, and above with 0.0004.
#[test]
fn intervals_of_the_drilling_model_cover_the_truth_in_200_repeats() {
    let system = circulation();
    let declared = declared(&system);
    let rig = record(&Scenario::new(41, 15.0, Vec::new()));
    let controls = of_the_rig(&system, &rig.train.rows);
    let mut truth = declared.clone();
    for (name, value) in [("M_ssp", 1.3e8), ("c0", 292.0), ("c2", 8.4e3), ("F2", 1.6e8)] {
        truth[named(&system, name)] = value;
    }
    let start = [(0, rig.train.hidden[0].h_r), (1, rig.train.hidden[0].q_ssp)];
    let problem = Problem { system: &system, p: &truth, inputs: &controls.inputs, start: &start };
    let tight = Options { rtol: 1e-9, atol: 1e-9, ..Options::default() };
    let solution = simulate(&problem, &controls.times, &tight).expect("a run");
    let exact = observe(&problem, &solution);
    let noise: Vec<f64> =
        system.signature().outputs.iter().map(|w| w.noise.expect("declared")).collect();

    let estimates = repeated(&system, 200, |system, seed| {
        let mut random = Pcg64::new(u128::from(seed), 200);
        let mut recording = controls.clone();
        for (i, samples) in recording.measured.iter_mut().flatten().enumerate() {
            for (k, value) in samples.iter_mut().enumerate() {
                *value = exact.w(k)[i] + noise[i] * normal(&mut random);
            }
        }
        let recordings = [started(system, &declared, recording)];
        let fit = fit(&OutputErrorProblem::new(system, &declared, &recordings)).expect("a fit");
        assert!(fit.undetermined.is_empty(), "{:?}", fit.undetermined);
        fit.estimates
    });
    for (i, first) in estimates[0].iter().enumerate() {
        let true_value = match first.of {
            dgd_runtime::Direction::Parameter(p) => truth[p],
            dgd_runtime::Direction::Start(x) => start[x].1,
        };
        let off = |all: &Vec<dgd_identify::ParameterEstimate>| {
            (all[i].value - true_value) / all[i].std.expect("determined")
        };
        let count = estimates.iter().filter(|all| off(all).abs() <= 1.959_964).count();
        let mean = estimates.iter().map(off).sum::<f64>() / 200.0;
        let square = estimates.iter().map(|all| off(all).powi(2)).sum::<f64>() / 200.0;
        println!("{}: {count} of 200, mean {mean:.3}, square {square:.3}", first.name);
        assert!((180..=198).contains(&count), "{}: {count} of 200", first.name);
    }
    assert_eq!(estimates[0].len(), 6);
}

/// Rigs with nothing hidden, from a simulator that knows more than the model (a controller on noisy readings,
/// a pump that takes a moment, an inertia that depends on the level): head and friction come within 2 % and
/// four standard deviations, the inertia within 5 %.
#[test]
fn rigs_with_nothing_hidden_give_their_parameters() {
    let system = circulation();
    let p = declared(&system);
    let position = ["M_ssp", "c0", "c2", "F2"].map(|name| named(&system, name));
    let found = repeated(&system, 12, |system, k| {
        let rig = record(&Scenario::drawn(900 + k, 45.0, &[]).expect("no effects"));
        let recordings = [started(system, &p, of_the_rig(system, &rig.train.rows))];
        let fit = fit(&OutputErrorProblem::new(system, &p, &recordings)).expect("a fit");
        let Plant { inertia, c0, c2, f2, .. } = rig.rig.plant;
        let truth = [inertia, c0, c2, f2];
        std::array::from_fn::<_, 4, _>(|i| {
            let of = dgd_runtime::Direction::Parameter(position[i]);
            let estimate = fit.estimates.iter().find(|e| e.of == of).expect("estimated");
            let off = estimate.value - truth[i];
            [off / truth[i], off / estimate.std.expect("determined")]
        })
    });
    for (k, of_rig) in found.iter().enumerate() {
        println!("{k}: {of_rig:.3?}");
    }
    for [inertia, rest @ ..] in &found {
        assert!(inertia[0].abs() < 0.05, "{found:?}");
        assert!(rest.iter().all(|[part, stds]| part.abs() < 0.02 && stds.abs() < 4.0), "{found:?}");
    }
}

#[test]
fn blocks_know_of_coloured_noise_what_the_covariance_does_not() {
    let system = system(HEATER);
    let p = declared(&system);
    let (mut scatter, mut asymptotic, mut by_bootstrap) = (0.0, 0.0, 0.0);
    for seed in 0..SEEDS {
        let recordings = [heated(seed, 400, 0.7)];
        let problem = OutputErrorProblem::new(&system, &p, &recordings);
        let fit = fit(&problem).expect("a fit");
        let again = resampled(&problem, &fit, seed, 99);
        assert!(again.block_lengths[0] > 1.5, "{:?}", again.block_lengths);
        scatter += (fit.estimates[0].value - TRUTH[0]).powi(2);
        asymptotic += fit.estimates[0].std.expect("determined").powi(2);
        by_bootstrap += again.std(0).expect("enough").powi(2);
    }
    let n = SEEDS as f64;
    let [scatter, asymptotic, by_bootstrap] =
        [scatter, asymptotic, by_bootstrap].map(|sum: f64| (sum / n).sqrt());
    println!("gain scatters by {scatter}; asymptotic {asymptotic}, bootstrap {by_bootstrap}");
    // A standard deviation from n repeats is known to 1/√(2n): 9 %. Colour of 0.7 makes a mean √5.7
    // times as uncertain as white noise.
    assert!(asymptotic < scatter / 1.5, "{asymptotic} of {scatter}");
    assert!(
        by_bootstrap > 0.65 * scatter && by_bootstrap < 1.3 * scatter,
        "{by_bootstrap} of {scatter}"
    );
    assert!(by_bootstrap > 1.3 * asymptotic);
}

const LEVEL: &str = "\
model level
parameter a [1] = 1
output y [1] = a
output z [1] = a
";

/// Readings of a level of 1 with noise of 0.1: `y` in some rows only, `z` never.
fn levels(n: u32, seed: u64, a: f64, is_read: impl Fn(u32) -> bool) -> Recording {
    let times: Vec<f64> = (0..n).map(f64::from).collect();
    let inputs = Inputs::recorded(&times, &[]).expect("none");
    let mut random = Pcg64::new(u128::from(seed), 78);
    let mut noise = normal(&mut random);
    let y = (0..n).map(|k| {
        if !is_read(k) {
            return f64::NAN;
        }
        noise = a * noise + (1.0 - a * a).sqrt() * normal(&mut random);
        1.0 + 0.1 * noise
    });
    Recording::new(times.clone(), inputs, vec![Some(y.collect()), None])
}

#[test]
fn gaps_take_no_part_in_a_bootstrap() {
    let system = system(LEVEL);
    let p = declared(&system);
    // Nothing in the first half: the mean of n = 500 readings scatters by 0.1/√n, around the estimate.
    let (mut off, mut spread) = (0.0f64, 0.0);
    for seed in 0..5 {
        let recordings = [levels(1000, seed, 0.0, |k| k >= 500)];
        let problem = OutputErrorProblem::new(&system, &p, &recordings);
        let fit = fit(&problem).expect("a fit");
        let again = resampled(&problem, &fit, seed, 200);
        let mean = again.replicates.iter().map(|found| found[0]).sum::<f64>() / 200.0;
        off = off.max((mean - fit.estimates[0].value).abs());
        spread += again.std(0).expect("enough") / 5.0;
    }
    let std = 0.1 / 500f64.sqrt();
    // A mean of 200 is known to std/√200 = 0.07 std, and is 4 of these away once in 16 000.
    assert!(off < 0.3 * std, "{off} of {std}");
    assert!((spread / std - 1.0).abs() < 0.2, "{spread} of {std}");
}

#[test]
fn blocks_are_as_long_for_a_slow_sensor() {
    let system = system(LEVEL);
    let p = declared(&system);
    // Every tenth row, and what was is 0.9 of what comes: a mean is √((1 + a)/(1 − a)) = 4.4 times as
    // uncertain as with white noise.
    let (mut every_tenth, mut every) = (0.0, 0.0);
    for seed in 0..10 {
        let std = |recording: Recording| {
            let recordings = [recording];
            let problem = OutputErrorProblem::new(&system, &p, &recordings);
            let fit = fit(&problem).expect("a fit");
            resampled(&problem, &fit, seed, 100).std(0).expect("enough")
        };
        every_tenth += std(levels(5000, seed, 0.9, |k| k % 10 == 0));
        every += std(levels(500, seed, 0.9, |_| true));
    }
    assert!((every_tenth / every - 1.0).abs() < 0.1, "{every_tenth} against {every}");
    let white = 10.0 * 0.1 / 500f64.sqrt();
    assert!(every_tenth > 3.0 * white, "{every_tenth} against {white}");
}

const LINE: &str = "\
model line
input u [1] hold
parameter a [1] = 1
parameter b [1] = 1
output y [1] = a + b*u
";

/// Rows of y = 1 + 2u with noise of 0.1.
fn rows(seed: u64) -> Recording {
    let times: Vec<f64> = (0..40).map(f64::from).collect();
    let u: Vec<f64> = (0..40).map(|k| f64::from(k % 8)).collect();
    let mut random = Pcg64::new(u128::from(seed), 3);
    let y = u.iter().map(|u| 1.0 + 2.0 * u + 0.1 * normal(&mut random)).collect();
    let column = InputColumn { name: "u", interpolation: Interpolation::Hold, values: &u };
    let inputs = Inputs::recorded(&times, &[column]).expect("inputs");
    Recording::new(times, inputs, vec![Some(y)])
}

#[test]
fn a_linear_model_has_a_parabola_for_a_profile() {
    let system = system(LINE);
    let p = declared(&system);
    let recordings = [rows(1)];
    let problem = OutputErrorProblem {
        noise: vec![Some(NoiseSource::Known(0.1))],
        ..OutputErrorProblem::new(&system, &p, &recordings)
    };
    let fit = fit(&problem).expect("a fit");
    for i in 0..2 {
        let profile = profile(&problem, &fit, i).expect("a profile");
        let (value, std) = (fit.estimates[i].value, fit.estimates[i].std.expect("determined"));
        for (at, deviance) in profile.values.iter().zip(&profile.deviance) {
            let expected = ((at - value) / std).powi(2);
            assert!((deviance - expected).abs() < 1e-6 * (1.0 + expected), "{deviance} {expected}");
        }
        let (low, high) = profile.interval();
        let half = THRESHOLD.sqrt() * std;
        for (end, expected) in [(low, value - half), (high, value + half)] {
            assert!((end.expect("closed") - expected).abs() < 2e-3 * half);
        }
        assert!(profile.values.windows(2).all(|pair| pair[0] < pair[1]), "{profile:?}");
        assert!(profile.values.len() > 8 && profile.values.len() < 30, "{}", profile.values.len());
    }
}

#[test]
fn parameters_that_cancel_have_open_profiles_that_name_each_other() {
    let text = LINE.replace("a + b*u", "a*b*u");
    let system = system(&text);
    let p = declared(&system);
    let recordings = [rows(2)];
    let problem = OutputErrorProblem::new(&system, &p, &recordings);
    let fit = fit(&problem).expect("a fit");
    assert_eq!(fit.undetermined.len(), 1);
    let profile = profile(&problem, &fit, 0).expect("a profile");
    // a·b is what matters: a can go as far as one likes on the side away from zero, and below it comes
    // near zero, where b would be infinite.
    assert!(matches!(profile.upper, ProfileEnd::Open(_)), "{:?}", profile.upper);
    assert!(profile.deviance.iter().zip(&profile.values).all(|(d, a)| *a < 0.1 || d.abs() < 1e-3));
    let followers = &profile.with_upper;
    assert_eq!(followers.len(), 1);
    assert!(followers[0].estimate == 1 && followers[0].change < 0.0, "{followers:?}");
    // What is left of b keeps the product.
    let product = profile.upper.value() * profile.at_upper[1];
    let found = fit.estimates[0].value * fit.estimates[1].value;
    assert!((product / found - 1.0).abs() < 1e-3, "{product} {found}");
}

#[test]
fn bounds_close_a_profile_and_priors_count() {
    let system = system(&LINE.replace("a [1] = 1", "a [1] = 1 in 0.99 .. 1.01"));
    let p = declared(&system);
    let recordings = [rows(1)];
    let problem = OutputErrorProblem {
        noise: vec![Some(NoiseSource::Known(0.1))],
        priors: vec![Prior::normal(1, 2.0, 1e-3)],
        ..OutputErrorProblem::new(&system, &p, &recordings)
    };
    let fit = fit(&problem).expect("a fit");
    let found = profiles(&problem, &fit, &[0, 1]).expect("profiles");
    let ends =
        [(found[0].lower, BoundReached::Lower, 0.99), (found[0].upper, BoundReached::Upper, 1.01)];
    for (end, bound, value) in ends {
        assert!(
            end == ProfileEnd::Bound(value) || fit.estimates[0].at_bound == Some(bound),
            "{end:?}, {bound:?}"
        );
    }
    // The prior is a measurement of b ten times better than the data; drawn again, it scatters.
    let again = resampled(&problem, &fit, 9, 400);
    let std = again.std(1).expect("enough");
    assert!((std / 1e-3 - 1.0).abs() < 0.25, "{std}");
    let (low, high) = found[1].interval();
    let half = 0.5 * (high.expect("closed") - low.expect("closed"));
    assert!(half < 1.96e-3 && half > 1.7e-3, "{half}");
}

#[test]
fn any_number_of_threads_gives_the_same_numbers() {
    let system = system(HEATER);
    let p = declared(&system);
    let recordings = [heated(1, 100, 0.3), heated(2, 100, 0.3)];
    let one = OutputErrorProblem::new(&system, &p, &recordings);
    let three = OutputErrorProblem { threads: 3, ..one.clone() };
    let fit = fit(&one).expect("a fit");
    let all: Vec<usize> = (0..fit.estimates.len()).collect();
    assert_eq!(
        profiles(&one, &fit, &all).expect("one"),
        profiles(&three, &fit, &all).expect("three")
    );
    let first = resampled(&one, &fit, 5, 21);
    assert_eq!(first, resampled(&three, &fit, 5, 21));
    assert_ne!(first, resampled(&three, &fit, 6, 21));
    assert!(first.interval(0, 0.95).is_none(), "21 refits have no percentile beyond 2.5 %");
}

#[test]
fn information_adds_up_and_lies_where_it_should() {
    let system = system(HEATER);
    let p = declared(&system);
    let recordings = [heated(1, 100, 0.0)];
    let problem = OutputErrorProblem {
        noise: vec![Some(NoiseSource::Known(SIGMA))],
        ..OutputErrorProblem::new(&system, &p, &recordings)
    };
    let fit = fit(&problem).expect("a fit");
    // The last ten seconds of each stretch of 25 s against the rest.
    let kinds = [(0..100).map(|k| usize::from(k % 25 >= 15)).collect::<Vec<usize>>()];
    let found = information(&problem, &fit, &kinds, 2).expect("sensitivities");
    assert_eq!(found.len(), 3);
    for one in &found {
        for parts in [&one.recordings, &one.outputs, &one.kinds] {
            assert!((parts.iter().sum::<f64>() - 1.0).abs() < 1e-6, "{one:?}");
        }
    }
    // x(0) alone is seen as exp(−t/tau), with the declared tau of 40 s, and tells most at the start.
    let start = OutputErrorProblem { free: vec![false, false, true], ..problem.clone() };
    let only = dgd_identify::fit(&start).expect("a fit");
    let found = information(&start, &only, &kinds, 2).expect("sensitivities");
    assert_eq!(found[0].best, Some((0, 0, 0)));
    let squares = |kind| -> f64 {
        let of_kind = kinds[0].iter().enumerate().filter(|(_, k)| **k == kind);
        of_kind.map(|(k, _)| (-2.0 * k as f64 / 40.0).exp()).sum()
    };
    let expected = squares(1) / (squares(0) + squares(1));
    assert!((found[0].kinds[1] - expected).abs() < 1e-4, "{:?} {expected}", found[0]);

    // The part of some samples is what their loss takes of the information about one parameter where
    // the others are known: with `gain` alone free, 1/variance without them.
    let alone = OutputErrorProblem { free: vec![true, false, false], ..problem.clone() };
    let all = dgd_identify::fit(&alone).expect("a fit");
    let found = information(&alone, &all, &kinds, 2).expect("sensitivities");
    let mut first = recordings[0].clone();
    let kept = kinds[0].clone();
    for samples in first.measured.iter_mut().flatten() {
        for (value, _) in samples.iter_mut().zip(&kept).filter(|(_, kind)| **kind == 1) {
            *value = f64::NAN;
        }
    }
    let first = [first];
    let without = dgd_identify::fit(&OutputErrorProblem { recordings: &first, ..alone.clone() });
    let std = |fit: &Fit| fit.estimates[0].std.expect("determined");
    let expected = (std(&all) / std(&without.expect("a fit"))).powi(2);
    // Linear in gain: sensitivities are the same at both estimates.
    assert!((found[0].kinds[0] - expected).abs() < 1e-6, "{} {expected}", found[0].kinds[0]);
}

#[test]
fn what_more_of_a_kind_would_do_is_what_it_does() {
    // A second output reads the same, and is measured where more is wanted.
    let system = system(&format!("{HEATER}output again [1] = x\n"));
    let p = declared(&system);
    let mut recording = heated(1, 100, 0.0);
    recording.measured.push(None);
    // What the model gives, so that estimates stay where they are with more of it.
    let noise = vec![Some(NoiseSource::Known(SIGMA)), None];
    let recordings = [recording.clone()];
    let problem = OutputErrorProblem { noise, ..OutputErrorProblem::new(&system, &p, &recordings) };
    let first = fit(&problem).expect("a fit");
    let given = evaluate(&problem, &first.p, &first.starts).expect("a simulation").observations;
    let measured: Vec<f64> = (0..100).map(|k| given[0].w(k)[0]).collect();
    recording.measured[0] = Some(measured.clone());
    let kinds = [(0..100).map(|k| usize::from(k % 25 >= 15)).collect::<Vec<usize>>()];
    let fitted = |recordings: &[Recording], sigma_again: f64| {
        let noise = vec![Some(NoiseSource::Known(SIGMA)), Some(NoiseSource::Known(sigma_again))];
        let problem =
            OutputErrorProblem { noise, ..OutputErrorProblem::new(&system, &p, recordings) };
        let fit = fit(&problem).expect("a fit");
        let found = information(&problem, &fit, &kinds, 2).expect("sensitivities");
        (fit, found)
    };
    let (alone, found) = fitted(&[recording.clone()], SIGMA);
    let stds = |fit: &Fit| -> Vec<f64> {
        fit.estimates.iter().map(|estimate| estimate.std.expect("determined")).collect()
    };
    let with = |wanted: &dyn Fn(usize) -> bool, sigma_again: f64| -> Vec<f64> {
        let mut recording = recording.clone();
        let all = measured.iter().enumerate();
        let again = all.map(|(k, value)| if wanted(k) { *value } else { f64::NAN }).collect();
        recording.measured[1] = Some(again);
        let (more, _) = fitted(&[recording], sigma_again);
        stds(&more).iter().zip(stds(&alone)).map(|(more, alone)| more / alone).collect()
    };
    for (one, expected) in found.iter().zip(with(&|_| true, SIGMA)) {
        assert!((expected - 0.5_f64.sqrt()).abs() < 1e-6, "{expected}");
        assert!((one.all_again - expected).abs() < 1e-6, "{} {expected}", one.all_again);
    }
    for kind in 0..2 {
        let samples = kinds[0].iter().filter(|found| **found == kind).count() as f64;
        // As many as there are all together, by the weight of each.
        let sigma = SIGMA * (samples / 100.0).sqrt();
        let ratios = with(&|k| kinds[0][k] == kind, sigma);
        for (one, expected) in found.iter().zip(ratios) {
            let again = one.again[kind].expect("samples");
            assert!((again - expected).abs() < 1e-5, "{kind}: {again} {expected}");
        }
    }
}
