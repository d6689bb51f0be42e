//! Fits of linear models close to an operating point.

use std::path::Path;

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_execute::InterpretedSystem;
use dgd_identify::{
    EstimateError, Fit, FitStepping, NoiseSource, NonlinearModel, OutputErrorProblem, OutputMisfit,
    Recording, TrialFailed, TrialFailure, fit, nonlinear, outputs_with_sensitivities,
};
use dgd_runtime::linearize::{LinearAt, NotLinearised, SteadyStateError};
use dgd_runtime::{Direction, InputColumn, Inputs, Interpolation, Options, System};
use rand_pcg::Pcg64;

use super::{HEATER, SIGMA, close, declared, heated, known, normal, system};

use crate::support::compiled_with;

/// The problem with the linear models of its recordings.
fn linearised(recordings: &[Recording], at: impl Fn(&Recording) -> LinearAt) -> Vec<Recording> {
    let of = |recording: &Recording| Recording { linear: Some(at(recording)), ..recording.clone() };
    recordings.iter().map(of).collect()
}

/// At rest with the mean of the recording's inputs.
fn at_mean(recording: &Recording) -> LinearAt {
    let (from, until) = (recording.times[0], recording.times[recording.times.len() - 1]);
    LinearAt::Rest(recording.inputs.mean(from, until))
}

/// The parts of a simulation that fits see, at p and start, against extrapolated differences of the outputs
/// alone, relative to the largest of each column. Returns the largest difference.
fn worst_derivative(
    system: &InterpretedSystem,
    recording: &Recording,
    p: &[f64],
    start: &[(usize, f64)],
) -> f64 {
    let options = Options { rtol: 1e-10, atol: 1e-10, ..Options::default() };
    let signature = system.signature();
    let run = |p: &[f64], start: &[(usize, f64)]| {
        outputs_with_sensitivities(system, recording, p, start, &options).expect("a simulation")
    };
    let found = run(p, start);
    let (n_w, n_t) = (found.n_w, recording.times.len());
    let mut worst = 0.0_f64;
    for (j, direction) in signature.directions.iter().enumerate() {
        let difference = |relative: f64| -> Vec<f64> {
            let side = |sign: f64| {
                let (mut p, mut start) = (p.to_vec(), start.to_vec());
                let value = match *direction {
                    Direction::Parameter(i) => &mut p[i],
                    Direction::Start(i) => {
                        let at = start.iter().position(|(unknown, _)| *unknown == i);
                        &mut start[at.expect("a start value")].1
                    }
                };
                let before = *value;
                *value *= 1.0 + sign * relative;
                let moved = *value - before;
                (run(&p, &start).w, moved)
            };
            let ((above, up), (below, down)) = (side(1.0), side(-1.0));
            above.iter().zip(&below).map(|(above, below)| (above - below) / (up - down)).collect()
        };
        let (coarse, fine) = (difference(2e-3), difference(1e-3));
        for i in 0..n_w {
            let column = |k: usize| found.dw(k)[j * n_w + i];
            let most =
                |of: &dyn Fn(usize) -> f64| (0..n_t).map(|k| of(k).abs()).fold(0.0, f64::max);
            // Where an output does not depend on θ, differences leave rounding of the output.
            let value = match *direction {
                Direction::Parameter(parameter) => p[parameter],
                Direction::Start(_) => 1.0,
            };
            let scale = most(&column).max(1e-3 * most(&|k| found.w(k)[i]) / value.abs());
            for k in 0..n_t {
                let at = k * n_w + i;
                let expected = (4.0 * fine[at] - coarse[at]) / 3.0;
                worst = worst.max((column(k) - expected).abs() / scale);
            }
        }
    }
    worst
}

#[test]
fn a_linear_model_is_its_own_linear_model() {
    let system = system(HEATER);
    let p = declared(&system);
    // Samples at odd times, some twice where the input jumps.
    let recordings = [heated(31, 2.0, SIGMA), heated(32, 0.5, SIGMA)];
    let fitted = |recordings: &[Recording]| {
        let problem = OutputErrorProblem::new(&system, &p, recordings);
        let options = Options { rtol: 1e-11, atol: 1e-11, ..problem.options };
        fit(&OutputErrorProblem { noise: known(), options, ..problem }).expect("a fit")
    };
    let itself = fitted(&recordings);
    for linear in [
        fitted(&linearised(&recordings, at_mean)),
        fitted(&linearised(&recordings, |_| LinearAt::Reached(30.0))),
    ] {
        assert!(matches!(linear.stepping, FitStepping::Exact));
        assert!(linear.termination.is_converged());
        for (i, (a, b)) in linear.estimates.iter().zip(&itself.estimates).enumerate() {
            close(a.value, b.value, 1e-8 * b.value.abs());
            for j in 0..itself.estimates.len() {
                let of = |fit: &Fit| fit.covariance(i, j).expect("determined");
                let scale =
                    a.std.expect("determined") * linear.estimates[j].std.expect("determined");
                close(of(&linear), of(&itself), 1e-8 * scale);
            }
        }
        close(linear.cost, itself.cost, 1e-8 * itself.cost);
    }
}

/// A tank that empties through a hole, on which a float moves: nothing is linear. The meter multiplies,
/// and the level is read late.
const TANK: &str = "\
model tank
input inflow [m^3/s] linear
input pull   [1]     hold
parameter area  [m^2]    = 2      in 0.1 ..
parameter hole  [m^2/s] = 0.05   in 1e-4 .., log
parameter gain  [1]      = 1.3    in 0 ..
parameter lag   [s]      = 4      in 0.1 ..
parameter late  [s]      = 3      in 0 ..
parameter dead  [s]      = 2      in 0 ..
state level [m] = 4
state float [m] = 4
unknown q [m^3/s] = 0.1
equation outflow: q = hole*sqrt(level*(1 [m]))
equation balance: area*der(level) = delay(inflow, dead) - q
equation follows: lag*der(float) = level*(1 + 0.1*delay(pull, dead)) - float
output flow  [m^3/s] = gain*q*level/(1 [m])  noise 1e-3 [m^3/s]
output depth [m] = delay(float + gain*0.1*level^2/(1 [m]), late)  noise 1e-3 [m]
";

/// A recording of the tank around an inflow of 0.1 m³/s, without noise.
fn tank(system: &InterpretedSystem, p: &[f64], amplitude: f64) -> Recording {
    let times: Vec<f64> = (0..240).map(|k| 1.5 * f64::from(k)).collect();
    let inflow: Vec<f64> = times
        .iter()
        .map(|t| 0.1 * (1.0 + amplitude * ((0.021 * t).sin() + 0.7 * (0.083 * t).cos())))
        .collect();
    let pull: Vec<f64> = (0..240).map(|k| amplitude * [1.0, -1.0, 0.5, 0.0][k / 15 % 4]).collect();
    let columns = [
        InputColumn { name: "inflow", interpolation: Interpolation::Linear, values: &inflow },
        InputColumn { name: "pull", interpolation: Interpolation::Hold, values: &pull },
    ];
    let inputs = Inputs::recorded(&times, &columns).expect("inputs");
    let mut recording = Recording::new(times, inputs, vec![None, None]);
    let options = Options { rtol: 1e-11, atol: 1e-11, ..Options::default() };
    let start = [(0, 4.0 * (1.0 + 0.5 * amplitude)), (1, 4.0)];
    let run = outputs_with_sensitivities(system, &recording, p, &start, &options).expect("a run");
    for (i, samples) in recording.measured.iter_mut().enumerate() {
        *samples = Some((0..run.w.len() / run.n_w).map(|k| run.w(k)[i]).collect());
    }
    recording
}

#[test]
fn derivatives_of_linear_models_are_those_of_differences() {
    let system = system(TANK);
    let p = declared(&system);
    let recording = tank(&system, &p, 0.3);
    let start = [(0, 5.0), (1, 3.0)];
    // Away from where the data is from, so that nothing happens to be zero.
    let p: Vec<f64> = p.iter().enumerate().map(|(i, p)| p * (1.1 + 0.03 * i as f64)).collect();
    for at in [at_mean(&recording), LinearAt::Reached(0.0), LinearAt::Reached(100.3)] {
        let linear = Recording { linear: Some(at.clone()), ..recording.clone() };
        let worst = worst_derivative(&system, &linear, &p, &start);
        assert!(worst < 1e-7, "{at:?}: {worst:e}");
    }
}

/// Outputs of the tank with noise of this size, in units of what it declares.
fn noisy(mut recording: Recording, seed: u64, size: f64) -> Recording {
    let mut random = Pcg64::new(u128::from(seed), 7);
    for sample in recording.measured.iter_mut().flatten().flatten() {
        *sample += size * 1e-3 * normal(&mut random);
    }
    recording
}

fn fit_tank(system: &InterpretedSystem, p: &[f64], recordings: &[Recording]) -> Fit {
    let noise = vec![Some(NoiseSource::Known(1e-3)); 2];
    let found =
        fit(&OutputErrorProblem { noise, ..OutputErrorProblem::new(system, p, recordings) })
            .expect("a fit");
    assert!(found.termination.is_converged(), "{:?}", found.termination);
    found
}

#[test]
fn what_linearising_costs_goes_with_the_amplitude() {
    let system = system(TANK);
    let truth = declared(&system);
    let first: Vec<f64> = truth.iter().map(|p| 1.1 * p).collect();
    // Without noise, estimates are off for the missing curvature alone.
    let biases: Vec<Vec<f64>> = [0.1, 0.05, 0.025]
        .iter()
        .map(|amplitude| {
            let recordings = linearised(&[tank(&system, &truth, *amplitude)], at_mean);
            let found = fit_tank(&system, &first, &recordings);
            found.p.iter().zip(&truth).map(|(found, truth)| found / truth - 1.0).collect()
        })
        .collect();
    let size = |bias: &Vec<f64>| bias.iter().map(|bias| bias * bias).sum::<f64>().sqrt();
    for (large, small) in biases.iter().zip(&biases[1..]) {
        // Of first order: half the amplitude, half the bias, and what is of second order besides.
        let ratio = size(large) / size(small);
        assert!((1.7..2.8).contains(&ratio), "{ratio}: {biases:?}");
    }

    // With signals so small that the bias is below the uncertainty, estimates are as those of the model.
    let recording = noisy(tank(&system, &truth, 0.01), 3, 1.0);
    let recordings = [recording];
    let linear = fit_tank(&system, &first, &linearised(&recordings, at_mean));
    let model = fit_tank(&system, &first, &recordings);
    for (linear, model) in linear.estimates.iter().zip(&model.estimates) {
        let std = model.std.expect("determined");
        close(linear.value, model.value, 4.0 * std);
        close(linear.std.expect("determined"), std, 0.3 * std);
    }
}

#[test]
fn the_mud_circulation_is_found_close_to_its_operating_point() {
    let path = Path::new("models/mud_circulation.dgd");
    let directions = SensitivityDirections::Estimated { free: Vec::new(), fixed: Vec::new() };
    let system = InterpretedSystem::new(compiled_with(path, &[], &directions).program);
    let truth = declared(&system);
    let lpm = 1e-3 / 60.0;
    // Steps of the pump's speed by a hundredth, and slow changes of the boost.
    let times: Vec<f64> = (0..900).map(f64::from).collect();
    let speed: Vec<f64> =
        (0..900).map(|k| 0.52 + 0.002 * [0.0, 1.0, -1.0, 0.4, -0.6][k / 60 % 5]).collect();
    let boost: Vec<f64> = times.iter().map(|t| (1850.0 + 8.0 * (0.011 * t).sin()) * lpm).collect();
    let fill: Vec<f64> = (0..900).map(|k| (290.0 + [0.0, 4.0][k / 150 % 2]) * lpm).collect();
    let columns = [
        InputColumn { name: "w_ssp", interpolation: Interpolation::Hold, values: &speed },
        InputColumn { name: "q_boost", interpolation: Interpolation::Linear, values: &boost },
        InputColumn { name: "q_tf", interpolation: Interpolation::Hold, values: &fill },
    ];
    let inputs = Inputs::recorded(&times, &columns).expect("inputs");
    let mut recording = Recording::new(times, inputs, vec![None; 4]);
    let options = Options { rtol: 1e-9, atol: 1e-9, ..Options::default() };
    let run = outputs_with_sensitivities(&system, &recording, &truth, &[(0, 47.6)], &options);
    let run = run.expect("a run");
    let sigma = [1e3, 1e3, 1e3, 15.0 * lpm];
    let mut random = Pcg64::new(11, 0);
    for (i, samples) in recording.measured.iter_mut().enumerate() {
        let own = (0..recording.times.len()).map(|k| run.w(k)[i]);
        *samples = Some(own.map(|w| w + sigma[i] * normal(&mut random)).collect());
    }
    // Inertia, shut-off head, its fall and friction, from elsewhere.
    let free = ["M_ssp", "c0", "c2", "F2"];
    let first: Vec<f64> = truth
        .iter()
        .zip(system.signature().parameters.iter())
        .map(|(p, of)| if of.name == "M_ssp" { 2.0 * p } else { 1.1 * p })
        .collect();
    let noise = sigma.map(|sigma| Some(NoiseSource::Known(sigma))).to_vec();
    let recordings = linearised(&[recording], at_mean);
    let problem = OutputErrorProblem::new(&system, &first, &recordings);
    let found = fit(&OutputErrorProblem { noise, ..problem.clone() }).expect("a fit");
    assert!(found.termination.is_converged());
    assert!(found.undetermined.is_empty());
    for name in free {
        let estimate = found.estimates.iter().find(|e| e.name == name).expect("it is free");
        let Direction::Parameter(i) = estimate.of else { panic!("a parameter") };
        close(estimate.value, truth[i], 4.0 * estimate.std.expect("determined"));
        assert!(estimate.std.expect("determined") < 0.3 * truth[i], "{name} is seen");
    }
    // The linear model is as good as the model, to a tenth of the noise.
    let itself = nonlinear(&problem, &found.p, &found.starts).expect("a run");
    for ((linear, model), sigma) in
        found.misfits[0].iter().zip(&itself.evaluation.misfits[0]).zip(sigma)
    {
        let rms = |misfit: &OutputMisfit| misfit.rms().expect("samples");
        close(rms(linear), rms(model), 0.1 * sigma);
    }
}

/// Three coefficients of a pressure drop, at flows close to 2: level and slope are what is seen there.
const PIPE: &str = "\
model pipe
input q [m^3/s] hold
parameter f0  [bar]           = 1
parameter f1  [bar*s/m^3]     = 1
parameter f2  [bar*s^2/m^6]   = 1
parameter lag [s]             = 5  in 0.1 ..
state p [bar] = 7
equation pressure: lag*der(p) = f0 + f1*q + f2*q^2 - p
output p [bar]  noise 0.01 [bar]
";

fn pipe(system: &InterpretedSystem, around: f64) -> Recording {
    let times: Vec<f64> = (0..200).map(f64::from).collect();
    let q: Vec<f64> =
        (0..200).map(|k| around * (1.0 + [0.05, -0.05, 0.0, -0.1, 0.1][k / 20 % 5])).collect();
    let column = InputColumn { name: "q", interpolation: Interpolation::Hold, values: &q };
    let inputs = Inputs::recorded(&times, &[column]).expect("inputs");
    let mut recording = Recording::new(times, inputs, vec![None]);
    let p = declared(system);
    let run = outputs_with_sensitivities(system, &recording, &p, &[], &Options::default());
    recording.measured = vec![Some(run.expect("a run").w)];
    recording
}

#[test]
fn what_one_operating_point_does_not_determine_is_named() {
    let system = system(PIPE);
    let p = declared(&system);
    let both = linearised(&[pipe(&system, 2.0), pipe(&system, 3.0)], at_mean);
    let fitted = |recordings: &[Recording]| {
        let noise = vec![Some(NoiseSource::Known(1e3))];
        fit(&OutputErrorProblem { noise, ..OutputErrorProblem::new(&system, &p, recordings) })
            .expect("a fit")
    };
    let one = fitted(&both[..1]);
    let [combination] = one.undetermined.as_slice() else { panic!("{:?}", one.undetermined) };
    // (q − q₀)² = q₀² − 2 q₀ q + q² is zero at q₀, and so is its slope. All are in units of 1 bar.
    let LinearAt::Rest(mean) = at_mean(&both[0]) else { panic!("at rest") };
    let expected =
        [mean[0] * mean[0], -2.0 * mean[0], 1.0].map(|change| change / (mean[0] * mean[0]));
    assert_eq!(combination.terms.len(), 3);
    for (i, (term, expected)) in combination.terms.iter().zip(expected).enumerate() {
        assert_eq!(one.estimates[term.estimate].name, ["f0", "f1", "f2"][i]);
        let first = combination.terms[0].change;
        close(term.change / first, expected, 1e-4);
    }
    assert!(one.estimates[..3].iter().all(|estimate| estimate.std.is_none()));
    assert!(one.estimates[3].std.is_some(), "the lag is seen");

    // A second point makes up for it.
    let two = fitted(&both);
    assert!(two.undetermined.is_empty(), "{:?}", two.undetermined);
    for (estimate, truth) in two.estimates[..3].iter().zip(&p) {
        close(estimate.value, *truth, 0.1 * truth);
    }
    // The model also sees the curvature at one point.
    let itself = fitted(&[pipe(&system, 2.0)]);
    assert!(itself.undetermined.is_empty());
}

fn refused(text: &str, at: &dyn Fn(&Recording) -> LinearAt) -> NotLinearised {
    let system = system(text);
    let p = declared(&system);
    let times: Vec<f64> = (0..50).map(f64::from).collect();
    let u: Vec<f64> = times.iter().map(|t| 1.0 + 0.1 * (0.3 * t).sin()).collect();
    let column = InputColumn { name: "u", interpolation: Interpolation::Linear, values: &u };
    let inputs = Inputs::recorded(&times, &[column]).expect("inputs");
    let recordings = [Recording::new(times, inputs, vec![Some(u)])];
    let recordings = linearised(&recordings, at);
    match fit(&OutputErrorProblem::new(&system, &p, &recordings)) {
        Err(EstimateError::Start(TrialFailed {
            recording: 0,
            reason: TrialFailure::NotLinearised(reason),
        })) => *reason,
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_has_no_linear_model_is_refused_by_name() {
    let of = |equations: &str| {
        format!(
            "model m\ninput u [1] linear\nparameter k [1/s] = 0.1\nparameter tau [s] = 3 in 0 ..\n\
             state x [1] = 1\n{equations}\noutput y [1] = x\n"
        )
    };
    let late = refused(&of("equation e: der(x) = k*(u - delay(x, tau))"), &at_mean);
    assert_eq!(late, NotLinearised::LateUnknown { unknown: "x".to_owned() });
    let timed = refused(&of("equation e: der(x) = k*(u - x)*(1 + time/tau)"), &at_mean);
    assert_eq!(timed, NotLinearised::ReadsTime { equation: "e".to_owned() });
    let unstable = refused(&of("equation e: der(x) = k*(x*x*x - u)"), &at_mean);
    let NotLinearised::Unstable { re, .. } = unstable else { panic!("{unstable:?}") };
    // d(k x³)/dx at x = u^⅓.
    close(re, 0.3, 0.02);
    let open = refused(&of("equation e: der(x) = k*u"), &at_mean);
    // The input drives an integral: at its mean nothing rests.
    let NotLinearised::NoSteadyState(SteadyStateError::Drifts { unknown, .. }) = open else {
        panic!("{open:?}")
    };
    assert_eq!(unknown, "x");
    // A point of a run need not be one of rest.
    let never = refused(&of("equation e: der(x) = k*u"), &|_| LinearAt::Reached(-3.0));
    assert!(matches!(never, NotLinearised::Run(_)), "{never:?}");
}

#[test]
fn the_model_itself_says_how_far_its_linear_one_holds() {
    let system = system(TANK);
    let p = declared(&system);
    let recordings = linearised(&[tank(&system, &p, 0.3)], at_mean);
    let problem = OutputErrorProblem::new(&system, &p, &recordings);
    let starts = [vec![(0, 4.0 * 1.15), (1, 4.0)]];
    let NonlinearModel { evaluation, points, departures } =
        nonlinear(&problem, &p, &starts).expect("a run");
    // The data is the model's own.
    for misfit in &evaluation.misfits[0] {
        assert!(misfit.rms().expect("samples") < 1e-5);
    }
    assert_eq!(departures, [None]);
    // Rest with a mean inflow Q: hole √level = Q.
    let LinearAt::Rest(mean) = at_mean(&recordings[0]) else { panic!("at rest") };
    let point = points[0].as_ref().expect("a point");
    close(point.y[0], (mean[0] / p[1]).powi(2), 1e-8);

    // A valve that opens at a level: the run is in another mode than the point.
    let valve = super::system(
        "model valve\ninput u [1] hold\nparameter k [1/s] = 0.2\nstate x [1] = 1\n\
         modes gate {\n  closed { equation e: der(x) = k*(u - x) }\n\
         open { equation e: der(x) = k*(u - 2*x) }\n\
         closed -> open when x rises above 1.5\n}\noutput y [1] = x\n",
    );
    let p = declared(&valve);
    let times: Vec<f64> = (0..60).map(f64::from).collect();
    let u: Vec<f64> = (0..60).map(|k| if k < 50 { 1.0 } else { 4.0 }).collect();
    let column = InputColumn { name: "u", interpolation: Interpolation::Hold, values: &u };
    let inputs = Inputs::recorded(&times, &[column]).expect("inputs");
    let recording = Recording::new(times, inputs, vec![Some(u)]);
    let recordings = linearised(&[recording], |_| LinearAt::Rest(vec![1.0]));
    let problem = OutputErrorProblem::new(&valve, &p, &recordings);
    let found = nonlinear(&problem, &p, &[Vec::new()]).expect("a run");
    let departure = found.departures[0].as_ref().expect("the gate opens");
    let names = [&departure.automaton, &departure.at_point, &departure.in_run].map(|name| &**name);
    assert_eq!(names, ["gate", "closed", "open"]);
    // x = 4 − 3 exp(−k (t − 50)) is 1.5 after ln(3/2.5)/k.
    close(departure.t, 50.0 + (3.0_f64 / 2.5).ln() / 0.2, 1e-4);
}
