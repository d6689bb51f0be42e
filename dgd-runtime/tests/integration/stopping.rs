//! Runs that are stopped by their callers, and that report their progress.

use std::num::NonZeroU32;
use std::time::{Duration, Instant};

use dgd_runtime::{
    Failure, InputColumn, Inputs, IntegrateError, Interpolation, Options, PerSample, Problem,
    RunMonitor, Solution, Steps, find_method, simulate, simulate_with_sensitivities,
};

use crate::support::problems::Relaxation;
use crate::support::{Heaped, parameters};

/// Samples of an input that kinks at each: at least one step between any two.
const SAMPLES: usize = 3_000_000;

fn inputs() -> Inputs {
    let times: Vec<f64> = (0..SAMPLES).map(|k| k as f64).collect();
    let values: Vec<f64> = (0..SAMPLES).map(|k| (k % 7) as f64).collect();
    let column = InputColumn { name: "u", interpolation: Interpolation::Linear, values: &values };
    Inputs::recorded(&times, &[column]).expect("a recording")
}

/// The result of a run that is stopped midway, and how long it takes to stop.
fn stopped(
    watched: &'static RunMonitor,
    run: impl FnOnce() -> Result<Solution, Failure>,
) -> (Failure, Duration) {
    watched.tell(0.0);
    std::thread::scope(|scope| {
        let stop = scope.spawn(|| {
            while watched.reached() == 0.0 {
                std::thread::yield_now();
            }
            watched.stop();
            Instant::now()
        });
        let failure = run().expect_err("it is stopped");
        let ended = Instant::now();
        let asked = stop.join().expect("the thread ends");
        watched.reset();
        (failure, ended.saturating_duration_since(asked))
    })
}

#[test]
fn a_run_stops_before_its_next_step() {
    static WATCHED: RunMonitor = RunMonitor::new();
    let inputs = inputs();
    let system = Heaped::of::<Relaxation>();
    let p = parameters::<Relaxation>();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let times = [0.0, (SAMPLES - 1) as f64];
    let one = Steps::PerSample(PerSample::Exactly(NonZeroU32::MIN));
    for (method, steps) in
        [("rodas5p", Steps::Adaptive), ("tsit5", one), ("rodas5p", one), ("bdf", Steps::Adaptive)]
    {
        let options = Options {
            method: find_method(method).expect("a method"),
            steps,
            max_steps: usize::MAX,
            watched: Some(&WATCHED),
            ..Options::default()
        };
        for with_sensitivities in [false, true] {
            let (failure, took) = stopped(&WATCHED, || {
                if with_sensitivities {
                    simulate_with_sensitivities(&problem, &times, &options)
                } else {
                    simulate(&problem, &times, &options)
                }
            });
            let IntegrateError::Stopped { t } = failure.error else { panic!("{failure}") };
            assert!(0.0 < t && t < times[1], "{method}: {t}");
            assert_eq!(failure.partial.times, [0.0], "{method}: what was asked for until then");
            // A step takes microseconds; the margin is for a busy machine.
            assert!(took < Duration::from_secs(2), "{method}: {took:?}");
        }
    }
}

#[test]
fn who_looks_on_changes_nothing() {
    static WATCHED: RunMonitor = RunMonitor::new();
    let inputs = Inputs::constant(&[3.0]);
    let system = Heaped::of::<Relaxation>();
    let p = parameters::<Relaxation>();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let alone = simulate(&problem, &[0.0, 1.0], &Options::default()).expect("it runs");
    let options = Options { watched: Some(&WATCHED), ..Options::default() };
    WATCHED.tell(0.0);
    let watched = simulate(&problem, &[0.0, 1.0], &options).expect("it runs");
    assert_eq!((watched.times, watched.y), (alone.times, alone.y));
    assert!((WATCHED.reached() - 1.0).abs() < 1e-12, "it tells where it ended");
    // A digest of options does not depend on it.
    assert_eq!(format!("{options:?}"), format!("{:?}", Options::default()));
}
