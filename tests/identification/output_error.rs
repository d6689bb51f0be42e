//! Fits to recordings that were made with known parameters, start values and noise.

#[path = "densities.rs"]
mod densities;
#[path = "linearised.rs"]
mod linearised;
#[path = "priors.rs"]
mod priors;
#[path = "robust.rs"]
mod robust;
#[path = "start_equations.rs"]
mod start_equations;
#[path = "steady.rs"]
mod steady;

use std::num::NonZeroU32;
use std::sync::Mutex;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_execute::InterpretedSystem;
use dgd_identify::{
    BoundReached, EstimateError, Fit, FitStepping, Monitor, NoiseCorrelation, NoiseSource,
    OutputErrorProblem, PointEnd, Prior, Progress, Recording, Termination, TrialFailure, bootstrap,
    counts_from, evaluate, fit, fit_from, fit_starts, outputs_with_sensitivities, profile,
    profiles,
};
use dgd_runtime::{
    InputColumn, Inputs, Interpolation, MethodKind, Options, PerSample, Steps, System, find_method,
};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use crate::normal;

const HEATER: &str = "\
model heater
input u [1] hold
parameter gain [1] = 0.8  in 0 ..
parameter tau  [s] = 40   in 1 .. 1000, log
state x [1] = 1
equation heat: tau * der(x) = gain*u - x
output y [1] = x  noise 0.02 [1]
output z [1] = 3*x + u  noise 0.05 [1]
";

/// True values of `gain`, `tau` and `x(0)`.
const TRUTH: [f64; 3] = [0.5, 20.0, 2.0];
const SIGMA: [f64; 2] = [0.02, 0.05];

fn system(text: &str) -> InterpretedSystem {
    let main = SourceText { name: "model".into(), text: text.into() };
    let directions = SensitivityDirections::Estimated { free: Vec::new(), fixed: Vec::new() };
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let options = ModelOptions::default();
    let read = &mut |_: &str| Err(String::new());
    let compiled = compile(main, &options, &directions, read, &mut sources, &mut diagnostics);
    InterpretedSystem::new(compiled.expect("the model is right").program)
}

fn declared(system: &InterpretedSystem) -> Vec<f64> {
    system.signature().parameters.iter().map(|parameter| parameter.value).collect()
}

/// A recording of the heater, one sample a second: its input steps every 25 s. The outputs are
/// those of the solution x⁺ = gain u + (x − gain u) exp(−1/tau), not of a solver.
fn heated(seed: u64, x0: f64, sigma: [f64; 2]) -> Recording {
    let [gain, tau, _] = TRUTH;
    let times: Vec<f64> = (0..200).map(f64::from).collect();
    let u: Vec<f64> = (0..200).map(|k| [4.0, 1.0, 6.0, 3.0][k / 25 % 4]).collect();
    let mut random = Pcg64::new(u128::from(seed), 0);
    let (mut y, mut z, mut x) = (Vec::new(), Vec::new(), x0);
    for u in &u {
        y.push(x + sigma[0] * normal(&mut random));
        z.push(3.0 * x + u + sigma[1] * normal(&mut random));
        x = gain * u + (x - gain * u) * (-1.0 / tau).exp();
    }
    let column = InputColumn { name: "u", interpolation: Interpolation::Hold, values: &u };
    let inputs = Inputs::recorded(&times, &[column]).expect("inputs");
    Recording::new(times, inputs, vec![Some(y), Some(z)])
}

fn known() -> Vec<Option<NoiseSource>> {
    SIGMA.iter().map(|sigma| Some(NoiseSource::Known(*sigma))).collect()
}

fn values(fit: &Fit) -> Vec<f64> {
    fit.estimates.iter().map(|estimate| estimate.value).collect()
}

#[track_caller]
fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} against {expected}");
}

#[test]
fn a_wrong_length_is_an_error_that_says_of_what() {
    let system = system(HEATER);
    let (p, good) = (declared(&system), [heated(1, TRUTH[2], SIGMA)]);
    let mut short = good.clone();
    short[0].measured[1] = Some(vec![1.0; 3]);
    let problem = |p, recordings| OutputErrorProblem::new(&system, p, recordings);
    let refused = |problem: &OutputErrorProblem<'_>| match fit(problem) {
        Err(EstimateError::Length(wrong)) => wrong.to_string(),
        other => panic!("{other:?}"),
    };
    let refusals = [
        refused(&problem(&p[..1], &good)),
        refused(&OutputErrorProblem { free: vec![true], ..problem(&p, &good) }),
        refused(&OutputErrorProblem { noise: Vec::new(), ..problem(&p, &good) }),
        refused(&problem(&p, &short)),
    ];
    assert_eq!(
        refusals,
        [
            "1 values of parameters are given, and 2 are needed",
            "1 marks of what is free are given, and 3 are needed",
            "0 noises of outputs are given, and 2 are needed",
            "3 samples of an output are given, and 200 are needed",
        ]
    );
    assert!(fit_starts(&problem(&p, &good), &[]).is_err());
}

#[test]
fn estimates_scatter_as_their_covariance_says() {
    let system = system(HEATER);
    let p = declared(&system);
    let seeds = 60;
    let mut squares = [0.0; 3];
    let mut product = 0.0;
    let mut correlation = 0.0;
    for seed in 0..seeds {
        let recordings = [heated(seed, TRUTH[2], SIGMA)];
        let problem = OutputErrorProblem {
            noise: known(),
            ..OutputErrorProblem::new(&system, &p, &recordings)
        };
        let fit = fit(&problem).expect("a fit");
        assert!(fit.termination.is_converged());
        let errors: Vec<f64> = (0..3)
            .map(|i| (fit.estimates[i].value - TRUTH[i]) / fit.estimates[i].std.expect("known"))
            .collect();
        for (sum, error) in squares.iter_mut().zip(&errors) {
            *sum += error * error;
        }
        product += errors[0] * errors[1];
        correlation = fit.correlation(0, 1).expect("both are determined");
    }
    // Sums of so many squared normal deviates: mean n, standard deviation √(2n). Five of them, and
    // a tenth for tau's being no linear parameter.
    let n = seeds as f64;
    for sum in squares {
        close(sum, n, 5.0 * (2.0 * n).sqrt() + 0.1 * n);
    }
    // Products of two: mean nρ, standard deviation √(n (1 + ρ²)).
    close(product, n * correlation, 5.0 * (n * (1.0 + correlation.powi(2))).sqrt());
    assert!(correlation.abs() > 0.05, "the test would not see a lost correlation: {correlation}");
}

#[test]
fn noise_is_found_in_the_residuals() {
    let system = system(HEATER);
    let p = declared(&system);
    let recordings = [heated(3, TRUTH[2], SIGMA), heated(4, 0.5, SIGMA)];
    let fit = fit(&OutputErrorProblem::new(&system, &p, &recordings)).expect("a fit");
    for (found, sigma) in fit.noise.iter().zip(SIGMA) {
        // σ from n samples scatters by σ/√(2n); five of those, and the rule's 1 %.
        let n = 400.0_f64;
        close(found.expect("fitted"), sigma, sigma * (5.0 / (2.0 * n).sqrt() + 0.01));
    }
    // Re-estimated noise leaves one per degree of freedom, to the rule's 1 % of σ.
    close(fit.reduced_chi_square().expect("many samples"), 1.0, 0.02);
}

#[test]
fn every_recording_has_its_start_and_any_number_of_threads_gives_the_same_bits() {
    let system = system(HEATER);
    let p = declared(&system);
    let starts = [2.0, 0.5, 3.5];
    let recordings: Vec<Recording> =
        starts.iter().zip(10..).map(|(x0, seed)| heated(seed, *x0, SIGMA)).collect();
    let problem =
        OutputErrorProblem { noise: known(), ..OutputErrorProblem::new(&system, &p, &recordings) };
    let alone = fit(&problem).expect("a fit");
    for (r, x0) in starts.iter().enumerate() {
        let estimate = &alone.estimates[2 + r];
        assert_eq!((estimate.name.as_str(), estimate.recording), ("x(0)", Some(r)));
        close(estimate.value, *x0, 5.0 * estimate.std.expect("determined"));
        assert_eq!(alone.starts[r], [(0, estimate.value)]);
    }
    for threads in [2, 3, 8] {
        let together = fit(&OutputErrorProblem { threads, ..problem.clone() }).expect("a fit");
        assert_eq!(values(&alone), values(&together));
        assert_eq!(alone.cost.to_bits(), together.cost.to_bits());
    }
    // The block of one recording's start knows nothing of another's data: what couples them is
    // shared parameters only, so that with those known the starts are uncorrelated.
    let free = vec![false, false, true];
    let starts_only = fit(&OutputErrorProblem { free, ..problem }).expect("a fit");
    assert_eq!(starts_only.correlation(0, 1), Some(0.0));
}

#[test]
fn at_a_bound_the_rest_is_as_if_the_parameter_were_known() {
    let bounded = system(&HEATER.replace("in 0 ..\n", "in 0 .. 0.4\n").replace("= 0.8", "= 0.3"));
    let recordings = [heated(5, TRUTH[2], SIGMA)];
    let p = declared(&bounded);
    let problem =
        OutputErrorProblem { noise: known(), ..OutputErrorProblem::new(&bounded, &p, &recordings) };
    let found = fit(&problem).expect("a fit");
    let gain = &found.estimates[0];
    assert_eq!((gain.value, gain.std, gain.at_bound), (0.4, None, Some(BoundReached::Upper)));

    let p = [0.4, 40.0];
    let free = vec![false, true, true];
    let given = fit(&OutputErrorProblem { p: &p, free, ..problem }).expect("a fit");
    let left = given.reduced_chi_square().expect("many samples").sqrt();
    for (bounded, given) in found.estimates[1..].iter().zip(&given.estimates) {
        let std = given.std.expect("determined");
        // Both stop within √1e-6 of a standard deviation, for residuals of the size that is left.
        close(bounded.value, given.value, 4e-3 * std * left);
        close(bounded.std.expect("determined"), std, 1e-3 * std * left);
    }
}

#[test]
fn missing_samples_are_as_if_never_taken() {
    let system = system(HEATER);
    let p = declared(&system);
    let whole = heated(6, TRUTH[2], SIGMA);
    let taken = |k: usize| k == 0 || k % 3 == 1;
    let mut gaps = whole.clone();
    for samples in gaps.measured.iter_mut().flatten() {
        for (k, sample) in samples.iter_mut().enumerate().filter(|(k, _)| !taken(*k)) {
            *sample = if k % 2 == 0 { f64::NAN } else { f64::INFINITY };
        }
    }
    let thin = |values: &[f64]| -> Vec<f64> {
        values.iter().enumerate().filter(|(k, _)| taken(*k)).map(|(_, v)| *v).collect()
    };
    let outputs = whole.measured.iter().map(|samples| samples.as_deref().map(thin)).collect();
    let few = Recording::new(thin(&whole.times), whole.inputs.clone(), outputs);
    let with = |recording: Recording| {
        let recordings = [recording];
        fit(&OutputErrorProblem {
            noise: known(),
            ..OutputErrorProblem::new(&system, &p, &recordings)
        })
        .expect("a fit")
    };
    let (gaps, few) = (with(gaps), with(few));
    assert_eq!(gaps.samples, few.samples);
    for (gaps, few) in gaps.estimates.iter().zip(&few.estimates) {
        close(gaps.value, few.value, 4e-3 * few.std.expect("determined"));
    }
}

#[test]
fn what_no_output_sees_is_named() {
    let system = system(
        "model product\ninput u [1]\nparameter a [1] = 2\nparameter b [1] = 3\n\
         parameter unused [1] = 7\nstate x [1] = 0 fixed\n\
         equation e: 1 [s] * der(x) = a*b*u - x\noutput y [1] = x\n",
    );
    let p = declared(&system);
    let times: Vec<f64> = (0..20).map(f64::from).collect();
    let u = [1.0; 20];
    let column = InputColumn { name: "u", interpolation: Interpolation::Hold, values: &u };
    let inputs = Inputs::recorded(&times, &[column]).expect("inputs");
    // a b = 12: x = 12 (1 − exp(−t)).
    let y = times.iter().map(|t| 12.0 * (1.0 - (-t).exp())).collect();
    let recordings = [Recording::new(times, inputs, vec![Some(y)])];
    let noise = vec![Some(NoiseSource::Known(0.01))];
    let found =
        fit(&OutputErrorProblem { noise, ..OutputErrorProblem::new(&system, &p, &recordings) })
            .expect("a fit");
    close(found.p[0] * found.p[1], 12.0, 1e-3);
    assert!(found.estimates.iter().all(|estimate| estimate.std.is_none()));
    let [unused, product] = found.undetermined.as_slice() else {
        panic!("{:?}", found.undetermined)
    };
    assert_eq!((unused.terms.len(), unused.terms[0].estimate), (1, 2));
    // Δ(a b) = 0: relative changes of a and b, in units of their declared sizes 2 and 3.
    let changes: Vec<f64> = product.terms.iter().map(|term| term.change).collect();
    let [of_a, of_b] = changes.as_slice() else { panic!("{changes:?}") };
    close(of_a * 2.0 * found.p[1] + of_b * 3.0 * found.p[0], 0.0, 1e-3);
}

/// A recording of the heater with an input that changes at every sample, without noise.
fn heated_by_the_second(x0: f64) -> Recording {
    let [gain, tau, _] = TRUTH;
    let times: Vec<f64> = (0..300).map(f64::from).collect();
    let u: Vec<f64> = times.iter().map(|t| 3.0 + 2.0 * (0.3 * t).sin()).collect();
    let (mut y, mut z, mut x) = (Vec::new(), Vec::new(), x0);
    for u in &u {
        y.push(x);
        z.push(3.0 * x + u);
        x = gain * u + (x - gain * u) * (-1.0 / tau).exp();
    }
    let column = InputColumn { name: "u", interpolation: Interpolation::Hold, values: &u };
    let inputs = Inputs::recorded(&times, &[column]).expect("inputs");
    Recording::new(times, inputs, vec![Some(y), Some(z)])
}

#[test]
fn steps_per_sample_lead_to_the_same_fit() {
    let system = system(HEATER);
    let p = declared(&system);
    let recordings = [heated_by_the_second(2.0), heated_by_the_second(3.0)];
    let fitted = |steps: Steps, threads: usize| {
        let problem = OutputErrorProblem::new(&system, &p, &recordings);
        let options = Options { steps, ..problem.options };
        let problem = OutputErrorProblem { noise: known(), options, threads, ..problem };
        fit(&problem).expect("a fit")
    };
    let locked = fitted(Steps::Automatic, 1);
    let FitStepping::PerSample(choice) = locked.stepping else { panic!("{:?}", locked.stepping) };
    // tau = 40 s: one step of a second along a series of few terms is accurate enough, and cheapest.
    assert_eq!(choice.steps.get(), 1);
    let is_series = matches!(choice.method.kind, MethodKind::Taylor(Some(2..=6)));
    assert!(is_series, "{}", choice.method.name);
    let adaptive = fitted(Steps::Adaptive, 1);
    assert!(matches!(adaptive.stepping, FitStepping::Adaptive));
    for (a, b) in locked.estimates.iter().zip(&adaptive.estimates) {
        // Both solve to 1e-6; what that moves an estimate by is far below its uncertainty.
        close(a.value, b.value, 1e-2 * a.std.expect("determined"));
    }
    let bits = |fit: &Fit| values(fit).iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&locked), bits(&fitted(Steps::Automatic, 2)));

    // Where inputs rest for most samples, long steps are better.
    let resting = [heated(1, 2.0, SIGMA)];
    let problem = OutputErrorProblem::new(&system, &p, &resting);
    let found = fit(&problem).expect("a fit");
    assert!(matches!(found.stepping, FitStepping::Adaptive), "{:?}", found.stepping);
}

#[test]
fn steps_per_sample_suffice_where_the_fit_ends() {
    // tau starts at 40 s and is 0.4 s: there a sample is no longer one step.
    let system = system(HEATER.replace("in 1 .. 1000", "in 0.01 .. 1000").as_str());
    let p = declared(&system);
    let mut recording = heated_by_the_second(2.0);
    let (gain, tau) = (0.5, 0.4);
    let mut x: f64 = 2.0;
    for (k, t) in recording.times.iter().enumerate() {
        let u = 3.0 + 2.0 * (0.3 * t).sin();
        recording.measured[0].as_mut().expect("measured")[k] = x;
        recording.measured[1].as_mut().expect("measured")[k] = 3.0 * x + u;
        x = gain * u + (x - gain * u) * f64::exp(-1.0 / tau);
    }
    let recordings = [recording];
    let problem = OutputErrorProblem::new(&system, &p, &recordings);
    let automatic = Steps::PerSample(PerSample::Automatic);
    let method = find_method("tsit5").expect("a method");
    let options = Options { steps: automatic, method, ..problem.options };
    let found = fit(&OutputErrorProblem { noise: known(), options, ..problem }).expect("a fit");
    let FitStepping::PerSample(choice) = found.stepping else { panic!("{:?}", found.stepping) };
    assert!(choice.steps.get() > 1, "{choice:?}");
    // The data is exact: what is left is the error of the simulation.
    close(found.p[1], tau, 1e-5);
}

#[test]
fn cost_and_gradient_belong_to_the_same_steps() {
    let system = system(HEATER);
    let recordings = [heated_by_the_second(2.0)];
    let p = [0.7, 0.8];
    let start = [(0, 1.5)];
    let steps = Steps::PerSample(PerSample::Exactly(std::num::NonZeroU32::MIN));
    for method in ["tsit5", "rodas5p"] {
        let method = find_method(method).expect("a method");
        let options = Options { steps, method, ..Options::default() };
        let cost = |p: &[f64]| {
            let problem = OutputErrorProblem::new(&system, p, &recordings);
            let problem = OutputErrorProblem { noise: known(), options, ..problem };
            evaluate(&problem, p, &[start.to_vec()]).expect("a simulation").cost
        };
        let run = outputs_with_sensitivities(&system, &recordings[0], &p, &start, &options)
            .expect("a simulation");
        for (j, name) in ["gain", "tau"].iter().enumerate() {
            let mut gradient = 0.0;
            for k in 0..recordings[0].times.len() {
                for (i, sigma) in SIGMA.iter().enumerate() {
                    let measured = recordings[0].measured[i].as_ref().expect("measured")[k];
                    let e = run.w(k)[i] - measured;
                    gradient += 2.0 * e * run.dw(k)[j * 2 + i] / (sigma * sigma);
                }
            }
            let d = 1e-3 * p[j];
            let at = |times: f64| {
                let mut p = p;
                p[j] += times * d;
                cost(&p)
            };
            // Of order (d/p)⁴ = 1e-12; rounding of the cost over d/p is 1e-13.
            let difference = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * d);
            close(gradient / difference, 1.0, 1e-7);
            assert!(gradient != 0.0, "{name}");
        }
    }
}

const EXPLOSION: &str = "\
model explosion
parameter k [1/s] = 0
state x [1] = 1  fixed
equation growth: der(x) = k*x*x
output y [1] = x
";

/// x = 1/(1 − k t) with k = 0.9, up to t = 1: from k = 1 on there is no solution.
fn growing() -> Recording {
    let times: Vec<f64> = (0..=20).map(|k| f64::from(k) / 20.0).collect();
    let y = times.iter().map(|t| 1.0 / (1.0 - 0.9 * t)).collect();
    Recording::new(times, Inputs::none(), vec![Some(y)])
}

#[test]
fn trials_that_explode_are_steps_too_far() {
    let system = system(EXPLOSION);
    let recordings = [growing()];
    let noise = vec![Some(NoiseSource::Known(0.01))];
    let problem =
        OutputErrorProblem { noise, ..OutputErrorProblem::new(&system, &[0.0], &recordings) };
    let found = fit(&problem).expect("a fit");
    assert!(found.failures > 0, "the first full step goes beyond k = 1");
    assert!(found.termination.is_converged(), "{:?}", found.termination);
    // The solver's 1e-6 of x ≤ 10 is 1e-5; dx/dk = t x² there is 100.
    close(found.p[0], 0.9, 1e-6);

    let Err(EstimateError::Start(failed)) =
        fit(&OutputErrorProblem { p: &[1.5], ..problem.clone() })
    else {
        panic!("there is no solution where it starts")
    };
    assert!(matches!(failed.reason, TrialFailure::Simulation(_)));
    // Of several starting points one that cannot be simulated is passed over.
    let points = [vec![(0, 1.5)], vec![(0, 0.5)]];
    let found = fit_from(&problem, &points).expect("the second succeeds");
    assert_eq!(found.best, 1);
    close(found.fit.p[0], 0.9, 1e-6);
    assert!(matches!(found.ends[0], PointEnd::Failed(EstimateError::Start(_))));
}

/// Stops when it has been told so many times of something.
#[derive(Debug)]
struct Patience {
    what: &'static str,
    times: usize,
    told: Mutex<Vec<Progress>>,
}

impl Patience {
    fn with(what: &'static str, times: usize) -> Self {
        Self { what, times, told: Mutex::default() }
    }

    /// All that it was told of what it waits for.
    fn told(&self) -> Vec<Progress> {
        let told = self.told.lock().expect("no thread has panicked");
        told.iter().copied().filter(|progress| progress.what == self.what).collect()
    }
}

impl Monitor for Patience {
    fn advanced(&self, progress: Progress) {
        self.told.lock().expect("no thread has panicked").push(progress);
    }

    fn is_stopped(&self) -> bool {
        self.told().len() >= self.times
    }
}

#[test]
fn a_fit_that_is_stopped_gives_the_best_so_far() {
    let system = system(HEATER);
    let recordings = [heated(1, TRUTH[2], SIGMA), heated(2, TRUTH[2], SIGMA)];
    let p = declared(&system);
    // Equal steps, with sensitivities and without, so that costs can be compared.
    let steps = Steps::PerSample(PerSample::Exactly(NonZeroU32::MIN));
    let problem = OutputErrorProblem {
        noise: known(),
        threads: 2,
        options: Options { steps, ..Options::default() },
        ..OutputErrorProblem::new(&system, &p, &recordings)
    };
    let whole = fit(&problem).expect("a fit");
    assert!(whole.iterations >= 3, "there is something to stop: {}", whole.iterations);
    let at_start = evaluate(&problem, &p, &[vec![], vec![]]).expect("it can be simulated").cost;
    let mut before = at_start;
    for simulations in 0..whole.evaluations {
        let watch = Patience::with("simulations", simulations);
        let found = fit(&OutputErrorProblem { watch: &watch, ..problem.clone() }).expect("a fit");
        let told = watch.told();
        assert!(told.iter().map(|progress| progress.done).eq(2..2 + told.len()), "{told:?}");
        if found.termination.is_converged() {
            // Asked to stop when it had nothing left to do.
            assert_eq!(values(&found), values(&whole));
            continue;
        }
        assert_eq!(found.termination, Termination::Stopped);
        // That at the start comes first.
        assert_eq!(found.evaluations, simulations + 1);
        assert!(
            found.cost <= before * (1.0 + 1e-12),
            "{simulations}: {} after {before}",
            found.cost
        );
        let again = evaluate(&problem, &found.p, &found.starts).expect("it can be simulated");
        close(again.cost, found.cost, 1e-12 * found.cost);
        before = found.cost;
    }
    assert!(before < 1e-3 * at_start, "the last of them is nearly there");
}

#[test]
fn of_starts_profiles_and_data_sets_those_are_given_that_are_complete() {
    let system = system(HEATER);
    let recordings = [heated(3, TRUTH[2], SIGMA)];
    let p = declared(&system);
    let problem =
        OutputErrorProblem { noise: known(), ..OutputErrorProblem::new(&system, &p, &recordings) };
    let stopped = |watch| OutputErrorProblem { watch, ..problem.clone() };
    let whole = fit(&problem).expect("a fit");

    // The second start is the better one, and is not tried; the first is fitted to the end.
    let points = [vec![(1, 500.0)], vec![(1, 21.0)]];
    let first = fit_from(&problem, &points[..1]).expect("a fit").fit;
    let watch = Patience::with("starts", 1);
    let found = fit_from(&stopped(&watch), &points).expect("a fit");
    assert_eq!((found.best, values(&found.fit)), (0, values(&first)));
    assert_eq!(watch.told().len(), 1);

    let random = |replicate: usize| {
        let mut random = Pcg64::new(7, replicate as u128);
        move || random.next_u64()
    };
    let all = bootstrap(&problem, &whole, 12, random).expect("resampled");
    assert_eq!((all.replicates.len(), all.failures, all.left_out), (12, 0, 0));
    let watch = Patience::with("resampled data sets", 5);
    let some = bootstrap(&stopped(&watch), &whole, 12, random).expect("resampled");
    assert_eq!((&some.replicates[..], some.failures, some.left_out), (&all.replicates[..5], 0, 7));

    let all = profiles(&problem, &whole, &[0, 1, 2]).expect("profiles");
    let watch = Patience::with("profiles", 2);
    let some = profiles(&stopped(&watch), &whole, &[0, 1, 2]).expect("profiles");
    // It is asked behind each: the second is there when it says so.
    assert_eq!(some, all[..2]);
    let at_once = Patience::with("profiles", 0);
    assert_eq!(profile(&stopped(&at_once), &whole, 0), Err(EstimateError::Stopped));
}

#[test]
fn a_prior_counts_as_one_more_measurement() {
    // y = k with one sample a second, n of them: 1/var = n/σ² + 1/std², mean weighted alike.
    let system = system(
        "model constant_value\nparameter k [1] = 1\nstate x [1] = 0 fixed\n\
         equation e: 1 [s] * der(x) = -x\noutput y [1] = k\n",
    );
    let times: Vec<f64> = (0..10).map(f64::from).collect();
    let recordings = [Recording::new(times, Inputs::none(), vec![Some(vec![5.0; 10])])];
    let problem = OutputErrorProblem {
        noise: vec![Some(NoiseSource::Known(2.0))],
        priors: vec![Prior::normal(0, 3.0, 0.5)],
        ..OutputErrorProblem::new(&system, &[1.0], &recordings)
    };
    let found = fit(&problem).expect("a fit");
    let (data, prior) = (10.0 / 4.0, 4.0);
    close(found.p[0], (data * 5.0 + prior * 3.0) / (data + prior), 1e-3);
    close(found.estimates[0].std.expect("determined"), (1.0_f64 / (data + prior)).sqrt(), 1e-9);
}

#[test]
fn held_out_recordings_get_their_starts_from_their_beginnings() {
    let system = system(HEATER);
    let p = [TRUTH[0], TRUTH[1]];
    let recordings = [heated(8, 3.0, SIGMA)];
    let problem =
        OutputErrorProblem { noise: known(), ..OutputErrorProblem::new(&system, &p, &recordings) };
    let starts = fit_starts(&problem, &[60.5]).expect("a simulation");
    // x(0) from y and z over 61 s: information Σ exp(−2t/τ) (1/σ₁² + 9/σ₂²).
    let information: f64 = (0..=60)
        .map(|t| (-2.0 * f64::from(t) / TRUTH[1]).exp())
        .map(|decay| decay * (SIGMA[0].powi(-2) + 9.0 * SIGMA[1].powi(-2)))
        .sum();
    let [(0, x0)] = starts[0].as_slice() else { panic!("{starts:?}") };
    close(*x0, 3.0, 5.0 / information.sqrt());

    let later = [Recording { counts_from: 60.5, ..recordings[0].clone() }];
    let problem = OutputErrorProblem { recordings: &later, ..problem };
    let found = evaluate(&problem, &p, &starts).expect("a simulation");
    for (misfit, sigma) in found.misfits[0].iter().zip(SIGMA) {
        assert_eq!(misfit.samples, 139);
        close(misfit.rms().expect("samples"), sigma, 5.0 * sigma / (2.0 * 139.0_f64).sqrt());
    }
}

/// When a recording of two rooms of which one is measured begins to count, in samples, of which there is one in so
/// many seconds; so are the time constants of both rooms.
fn rooms(spacing: f64, own: f64, hidden: f64, noise: NoiseCorrelation) -> f64 {
    let text = format!(
        "model rooms\nparameter tau [s] = {} fixed\nparameter slow [s] = {} fixed\nstate x [1] = 1\n\
         state hidden [1] = 2\nequation own: tau*der(x) = hidden - x\n\
         equation other: slow*der(hidden) = -hidden\noutput x [1]\n",
        own * spacing,
        hidden * spacing,
    );
    let system = system(&text);
    let p = declared(&system);
    let times: Vec<f64> = (0..2000).map(|k| f64::from(k) * spacing).collect();
    // x = c e^(−t/slow) + (1 − c) e^(−t/tau), c = 2/(1 − tau/slow)
    let c = 2.0 / (1.0 - own / hidden);
    let mut random = Pcg64::new(1, 0);
    let x = (0..2000).map(|k| {
        let k = f64::from(k);
        let x = c * (-k / hidden).exp() + (1.0 - c) * (-k / own).exp();
        x + 0.02 * normal(&mut random)
    });
    let recordings = [Recording::new(times, Inputs::none(), vec![Some(x.collect())])];
    let known = vec![Some(NoiseSource::Known(0.02))];
    let problem =
        OutputErrorProblem { noise: known, ..OutputErrorProblem::new(&system, &p, &recordings) };
    counts_from(&problem, &[noise])[0] / spacing
}

#[test]
fn validation_counts_from_sixty_readings_on_in_all_units_of_time() {
    for spacing in [0.01, 1.0, 360.0] {
        let from = rooms(spacing, 20.0, 30.0, NoiseCorrelation::NONE);
        assert!((from - 60.0).abs() < 1e-6, "{from} at {spacing} s");
    }
}

#[test]
fn what_readings_show_late_takes_a_longer_beginning() {
    // The hidden room is seen through a ramp of a 300th of it a sample: its variance after n samples is 12·300²/n³ of
    // the noise's, 0.6 after 120 and 0.08 after 240. Later it is felt at nearly its full size.
    for spacing in [0.01, 1.0, 360.0] {
        let from = rooms(spacing, 300.0, 20_000.0, NoiseCorrelation::NONE);
        assert!((from - 240.0).abs() < 1e-6, "{from} at {spacing} s");
    }
}

#[test]
fn correlated_noise_takes_a_longer_beginning() {
    // Half of it with a memory of five samples: means scatter by 0.5 + 0.5·2·5 times as much as those of white noise,
    // and the variance of the hidden room is 0.43 of the noise's after 240 samples and 0.05 after 480.
    for spacing in [0.01, 1.0, 360.0] {
        let noise = NoiseCorrelation { share: 0.5, memory: 5.0 * spacing };
        let from = rooms(spacing, 300.0, 20_000.0, noise);
        assert!((from - 480.0).abs() < 1e-6, "{from} at {spacing} s");
    }
}

#[test]
fn what_cannot_be_fitted_is_said() {
    let system = system(HEATER);
    let p = declared(&system);
    let recordings = [heated(9, 2.0, SIGMA)];
    let problem = OutputErrorProblem::new(&system, &p, &recordings);
    let refused = |problem: OutputErrorProblem<'_>| fit(&problem).unwrap_err();
    let free = vec![false; 3];
    assert_eq!(refused(OutputErrorProblem { free, ..problem.clone() }), EstimateError::NothingFree);
    let noise = vec![None, None];
    let nothing = refused(OutputErrorProblem { noise, ..problem.clone() });
    assert_eq!(nothing, EstimateError::NothingMeasured);
    let noise = vec![Some(NoiseSource::Known(0.0)), None];
    let zero = refused(OutputErrorProblem { noise, ..problem.clone() });
    assert!(matches!(zero, EstimateError::Noise { output, .. } if output == "y"));
    let short = [Recording { counts_from: 199.0, ..recordings[0].clone() }];
    let noise = vec![Some(NoiseSource::Known(0.1)), None];
    let few = refused(OutputErrorProblem { noise, recordings: &short, ..problem });
    assert_eq!(few, EstimateError::TooFewSamples { samples: 1, free: 3 });
}

#[test]
fn criteria_count_what_is_estimated() {
    let system = system(HEATER);
    let p = declared(&system);
    let recordings = [heated(3, TRUTH[2], SIGMA)];
    let problem = OutputErrorProblem::new(&system, &p, &recordings);
    let estimated = fit(&problem).expect("a fit");
    let known = fit(&OutputErrorProblem { noise: known(), ..problem.clone() }).expect("a fit");
    let n = 400.0_f64;
    // gain, tau and x(0); two levels of noise where they are estimated.
    for (found, k) in [(&estimated, 5.0), (&known, 3.0)] {
        let is_estimated = k == 5.0;
        let deviance: f64 = (0..2)
            .map(|i| {
                let misfit = found.misfits[0][i];
                // Estimated noise is where the likelihood is largest.
                let likely = misfit.squares / misfit.samples as f64;
                let known = found.noise[i].expect("fitted").powi(2);
                let variance = if is_estimated { likely } else { known };
                let each = (std::f64::consts::TAU * variance).ln();
                misfit.samples as f64 * each + misfit.squares / variance
            })
            .sum();
        let criteria = found.criteria.expect("squares and no priors");
        close(criteria.aic, deviance + 2.0 * k, 1e-8 * deviance.abs());
        close(criteria.bic, deviance + k * n.ln(), 1e-8 * deviance.abs());
        let more = 2.0 * k * (k + 1.0) / (n - k - 1.0);
        close(criteria.aicc.expect("400 samples"), criteria.aic + more, 1e-8 * deviance.abs());
    }
    let priors = vec![Prior::normal(0, 0.5, 0.1)];
    let held = fit(&OutputErrorProblem { priors, ..problem.clone() }).expect("a fit");
    assert_eq!(held.criteria, None);
    let robust = OutputErrorProblem { loss: dgd_identify::Loss::Huber, ..problem };
    assert_eq!(fit(&robust).expect("a fit").criteria, None);
}
