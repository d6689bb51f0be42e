//! What is known of a parameter beforehand, of every law, against SciPy's greatest posterior density.

use dgd_execute::InterpretedSystem;
use dgd_identify::{Fit, NoiseSource, OutputErrorProblem, Prior, Recording, fit};
use dgd_runtime::signature::PriorDensity;
use dgd_runtime::{Inputs, Options};

use super::{declared, system};

/// c = c0 exp(−k t) every 2 s with noise of 0.05.
const READINGS: [f64; 12] =
    [4.9131, 4.642, 4.3665, 4.1588, 3.8175, 3.6946, 3.4405, 3.3299, 3.1418, 2.9834, 2.7824, 2.5816];

fn decay() -> InterpretedSystem {
    system(
        "model decay\n\
         parameter c0 [mol/m^3] = 4.5 in 0.1 .. 100\n\
         parameter k [1/s] = 0.025 in 0.001 .. 1, log\n\
         state c [mol/m^3] = c0 fixed\n\
         equation decay: der(c) = -k*c\n\
         output c [mol/m^3]  noise 0.05\n",
    )
}

fn fitted(density: PriorDensity) -> Fit {
    let system = decay();
    let times = (0..12).map(|k| 2.0 * f64::from(k)).collect();
    let recordings = [Recording::new(times, Inputs::none(), vec![Some(READINGS.to_vec())])];
    let p = declared(&system);
    let problem = OutputErrorProblem {
        noise: vec![Some(NoiseSource::Known(0.05))],
        priors: vec![Prior::for_parameter(1, density)],
        negligible_reduction: 1e-16,
        options: Options { rtol: 1e-11, atol: 1e-12, ..Options::default() },
        ..OutputErrorProblem::new(&system, &p, &recordings)
    };
    let found = fit(&problem).expect("it can be simulated");
    assert!(found.termination.is_converged(), "{:?}", found.termination);
    assert_eq!(found.criteria.map(|criteria| criteria.aic), None);
    found
}

/// Value and standard deviation of c0 and k.
#[track_caller]
fn agrees(density: PriorDensity, wanted: [(f64, f64); 2]) {
    let found = fitted(density);
    for (estimate, (value, std)) in found.estimates.iter().zip(wanted) {
        let found = estimate.std.expect("determined");
        assert!((estimate.value / value - 1.0).abs() < 1e-6, "{}: {value}", estimate.value);
        assert!((found / std - 1.0).abs() < 1e-6, "std {found}: {std}");
    }
}

/// Σ ((w − y)/0.05)² + ((k − 0.035)/0.0005)².
#[test]
fn a_normal_prior_is_one_more_measurement() {
    agrees(
        PriorDensity::Normal { mean: 0.035, std: 0.0005 },
        [(5.055_866_46, 0.025_034_280_2), (0.032_264_309, 0.000_382_900_232)],
    );
}

/// … + (ln(k/0.035)/0.02)² + 2 ln k.
#[test]
fn a_log_normal_prior_is_one_of_the_parameter() {
    agrees(
        PriorDensity::LogNormal { median: 0.035, sigma: 0.02 },
        [(5.021_886_52, 0.026_234_008_5), (0.031_413_994_2, 0.000_431_476_6)],
    );
}

/// … + 2 |k − 0.035|/0.0005.
#[test]
fn laplace_s_prior_pulls_alike_from_near_and_far() {
    agrees(
        PriorDensity::Laplace { median: 0.035, scale: 0.0005 },
        [(4.928_230_46, 0.024_674_445_9), (0.029_099_337_8, 0.000_381_167_353)],
    );
}

/// … + 2k/10⁻⁵ − 2 · 3499 ln k.
#[test]
fn a_gamma_prior_has_its_shape() {
    agrees(
        PriorDensity::Gamma { shape: 3500.0, scale: 1e-5 },
        [(5.039_780_35, 0.025_413_092_7), (0.031_861_040_4, 0.000_399_175_719)],
    );
}

/// Where the readings pull less than the prior holds, the estimate is its median.
#[test]
fn a_fit_ends_at_the_kink_of_laplace_s_prior() {
    let found = fitted(PriorDensity::Laplace { median: 0.03, scale: 1e-5 });
    let k = &found.estimates[1];
    assert!((k.value / 0.03 - 1.0).abs() < 1e-8, "{}", k.value);
    // The density's information there, 1/scale², is nearly all that is known.
    assert!((k.std.expect("determined") / 1e-5 - 1.0).abs() < 1e-3, "{:?}", k.std);
}
