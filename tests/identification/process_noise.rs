//! Process noise that the model declares, against a Kalman filter's likelihood by SciPy.

use dgd_identify::Recording;
use dgd_identify::filter::{NoiseLevelSource, PredictionErrorProblem, prediction_error};
use dgd_runtime::{Inputs, System};

use super::filtering::{declared, system};

/// dx = (1 − x)/20 s dt + 0.05 dβ from x = 3, one reading in 2 s with noise of 0.06: `numpy.random.default_rng(11)`.
const READINGS: [f64; 60] = [
    3.0021, 2.9747, 2.6681, 2.5242, 2.3892, 2.1861, 2.0225, 1.8563, 1.8761, 1.7251, 1.6584, 1.5647,
    1.3292, 1.3193, 1.1444, 1.268, 1.1335, 1.2301, 1.1817, 1.1926, 1.1516, 1.2009, 0.996, 0.8718,
    1.0183, 1.0213, 1.0371, 1.0839, 0.9712, 0.8751, 0.9913, 1.032, 1.0721, 1.0236, 1.0113, 1.0135,
    0.9833, 1.1127, 1.0598, 1.2269, 1.1133, 1.1661, 1.3351, 1.1067, 1.0395, 1.2458, 0.9584, 1.1357,
    1.0206, 1.0781, 1.0138, 1.0969, 1.0514, 0.9429, 1.0445, 1.0338, 1.1203, 0.9709, 0.9807, 1.0344,
];

/// The exact filter of x with m(0) = 3, P(0) = 0: m ← 1 + (m − 1)a, P ← a²P + q²τ/2 (1 − a²), a = e^(−2 s/τ);
/// Σ ln 2πS + ε²/S is smallest by `scipy.optimize.minimize`. Standard errors are of Σ ε′²/S + ½ (S′/S)².
#[test]
fn a_rate_and_a_noise_that_are_parameters_are_estimated() {
    let system = system(
        "model settling\n\
         parameter tau [s] = 25 in 1 .. 1000\n\
         parameter q [m/s^(1/2)] = 0.1 in 0.001 .. 10\n\
         parameter s [m] = 0.1 in 0.001 .. 10\n\
         state x [m] = 3  noise q\n\
         equation settling: tau*der(x) = 1 [m] - x\n\
         output level [m] = x  noise s\n",
        &["tau", "q", "s"],
    );
    let times = (0..60).map(|k| 2.0 * f64::from(k)).collect();
    let measured = vec![Some(READINGS.to_vec()), None];
    let recordings = [Recording::new(times, Inputs::none(), measured)];
    let p = declared(&system);
    let mut problem = PredictionErrorProblem::new(system.as_model(), &p, &recordings);
    let signature = system.signature();
    let is_parameter =
        |j: usize| matches!(signature.directions[j], dgd_runtime::Direction::Parameter(_));
    problem.free = (0..signature.directions.len()).map(is_parameter).collect();
    problem.rates = vec![NoiseLevelSource::Parameter(1)];
    problem.noise = vec![Some(NoiseLevelSource::Parameter(2)), None];
    let found = prediction_error(&problem).expect("it can be filtered");
    assert!(found.termination.is_converged(), "{:?}", found.termination);
    let wanted = [
        (17.635_960_6, 1.782_089_12),
        (0.032_366_400_7, 0.008_319_192_87),
        (0.067_762_014_3, 0.009_531_567_94),
    ];
    for (estimate, (value, std)) in found.estimates.iter().zip(wanted) {
        // A search ends where it promises 1e-6 of the deviance: a thousandth of a standard deviation.
        assert!((estimate.value - value).abs() < 1e-3 * std, "{}: {value}", estimate.value);
        let found = estimate.std.expect("determined");
        assert!((found / std - 1.0).abs() < 1e-4, "std {found}: {std}");
    }
    assert!((found.deviance - (-120.033_585)).abs() < 1e-6, "{}", found.deviance);
    assert_eq!(found.rates[0].value, found.p[1]);
    assert_eq!(found.rates[0].log_std, None);
}
