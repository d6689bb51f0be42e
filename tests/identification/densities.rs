//! Noise that is more than a number: estimates, standard errors and likelihoods against SciPy's.

use dgd_execute::InterpretedSystem;
use dgd_identify::{
    EstimateError, Fit, Loss, NoiseSource, OutputErrorProblem, Recording, TrialFailed,
    TrialFailure, WrongReading, fit, profile,
};
use dgd_runtime::{Inputs, Options, System};

use super::{declared, system};

/// Readings of c = c0 exp(−k t) every 2 s, with scatter by `numpy.random.default_rng`: c + (0.05 + 0.05 c) ε.
const NORMAL: [f64; 40] = [
    4.7594, 4.3308, 4.3671, 4.2852, 4.2134, 3.7299, 3.3644, 3.1171, 3.2472, 3.2336, 2.7951, 2.3632,
    2.2692, 2.5554, 2.1906, 1.7702, 1.9023, 1.64, 1.6131, 1.5357, 1.4166, 1.4852, 1.3283, 1.1913,
    1.2294, 1.2034, 0.8822, 0.964, 0.8371, 0.8613, 0.7087, 0.7802, 0.7298, 0.6646, 0.5637, 0.5803,
    0.4906, 0.4385, 0.5284, 0.3995,
];

/// c exp(0.1 ε).
const LOG: [f64; 40] = [
    5.6208, 5.0586, 3.6315, 4.2916, 3.5228, 3.7164, 3.5036, 2.6928, 3.0225, 2.8402, 3.0212, 2.2963,
    2.6202, 2.0535, 2.0882, 1.869, 2.2129, 1.9084, 2.1654, 1.7051, 1.6388, 1.5427, 1.2571, 1.2491,
    1.3559, 1.0723, 1.0707, 0.9874, 0.9904, 0.8462, 0.814, 0.7975, 0.7406, 0.6331, 0.7111, 0.5377,
    0.5114, 0.4777, 0.5633, 0.4646,
];

/// c + 0.05 ε, with ε of Student's distribution with 4 degrees of freedom.
const STUDENT: [f64; 40] = [
    4.9105, 4.6038, 4.3599, 4.1514, 3.9024, 3.7217, 3.4393, 3.2652, 3.1514, 2.9427, 2.7453, 2.5308,
    2.4185, 2.2316, 2.0665, 2.0625, 1.9499, 1.8241, 1.7305, 1.5414, 1.5268, 1.3748, 1.2989, 1.1399,
    1.3075, 1.098, 1.059, 0.9033, 0.8814, 0.9553, 0.8583, 0.7431, 0.7257, 0.7426, 0.6272, 0.5813,
    0.6254, 0.5683, 0.5099, 0.5811,
];

/// 0.05 + 0.06 c, as standard deviations that are recorded.
const STD: [f64; 40] = [
    0.35, 0.333, 0.316, 0.301, 0.286, 0.272, 0.259, 0.247, 0.236, 0.225, 0.215, 0.205, 0.196,
    0.188, 0.18, 0.172, 0.165, 0.158, 0.152, 0.146, 0.14, 0.135, 0.13, 0.125, 0.121, 0.117, 0.113,
    0.109, 0.106, 0.103, 0.1, 0.097, 0.094, 0.091, 0.089, 0.087, 0.085, 0.083, 0.081, 0.079,
];

/// c + 0.05 ε.
const ONE: [f64; 40] = [
    4.9131, 4.642, 4.3665, 4.1588, 3.8175, 3.6946, 3.4405, 3.3299, 3.1418, 2.9834, 2.7824, 2.5816,
    2.4768, 2.3673, 2.1259, 2.0634, 1.9123, 1.875, 1.6561, 1.584, 1.5241, 1.4312, 1.2537, 1.2759,
    1.1787, 1.1037, 1.0429, 1.0004, 0.8411, 0.9552, 0.7834, 0.6663, 0.7289, 0.7632, 0.6242, 0.6898,
    0.6545, 0.4999, 0.3882, 0.4199,
];

/// 2 c + 0.1 ε.
const TWO: [f64; 40] = [
    9.9197, 9.4419, 8.7036, 8.4183, 7.9806, 7.3629, 7.0198, 6.5956, 6.1484, 5.7412, 5.2849, 5.3096,
    4.8628, 4.8363, 4.3997, 4.0935, 3.7632, 3.7452, 3.3453, 3.3552, 2.9721, 2.8551, 2.5191, 2.7501,
    2.3599, 2.1928, 2.1824, 1.8898, 1.9405, 1.6381, 1.7075, 1.4523, 1.2824, 1.3213, 1.1539, 1.2799,
    1.1554, 1.137, 1.032, 0.9279,
];

fn decay(noise: &str) -> InterpretedSystem {
    system(&format!(
        "model decay\n\
         parameter c0 [mol/m^3] = 4.5 in 0.1 .. 100\n\
         parameter k [1/s] = 0.025 in 0.001 .. 1\n\
         {noise}\n\
         state c [mol/m^3] = c0 fixed\n\
         equation decay: der(c) = -k*c\n"
    ))
}

fn recorded(system: &InterpretedSystem, readings: &[(&str, &[f64])]) -> Recording {
    let times: Vec<f64> = (0..40).map(|k| 2.0 * f64::from(k)).collect();
    let of = |name: &str| readings.iter().find(|(of, _)| *of == name).map(|(_, all)| all.to_vec());
    let measured = system.signature().outputs.iter().map(|output| of(&output.name));
    Recording::new(times, Inputs::none(), measured.collect())
}

fn problem<'a>(
    system: &'a InterpretedSystem,
    p: &'a [f64],
    recordings: &'a [Recording],
) -> OutputErrorProblem<'a> {
    let signature = system.signature();
    let noise = |i: usize| {
        recordings[0].measured[i].as_ref()?;
        let density = signature.density(i).map(NoiseSource::Density);
        let is_recorded = recordings[0].deviations_of(i).is_some();
        let given = is_recorded.then_some(NoiseSource::Recorded);
        Some(density.or(given).unwrap_or(NoiseSource::Estimated))
    };
    OutputErrorProblem {
        noise: (0..signature.outputs.len()).map(noise).collect(),
        negligible_reduction: 1e-16,
        options: Options { rtol: 1e-11, atol: 1e-12, ..Options::default() },
        ..OutputErrorProblem::new(system, p, recordings)
    }
}

/// To six digits.
#[track_caller]
fn close(found: f64, wanted: f64) {
    assert!((found / wanted - 1.0).abs() < 1e-6, "{found} against {wanted}");
}

/// Value and standard error of each estimate, then −2 ln of the likelihood at its maximum.
///
/// SciPy's are of `scipy.optimize.minimize` (Nelder–Mead, then Newton's steps) on the formulas that are beside them;
/// standard errors are roots of the diagonal of the inverse expected information.
#[track_caller]
fn agrees(fit: &Fit, estimates: &[(f64, f64)], deviance: f64) {
    assert!(fit.termination.is_converged(), "{:?}", fit.termination);
    assert_eq!(fit.estimates.len(), estimates.len());
    for (estimate, (value, std)) in fit.estimates.iter().zip(estimates) {
        close(estimate.value, *value);
        close(estimate.std.expect("determined"), *std);
    }
    close(fit.deviance, deviance);
    let k = estimates.len() as f64;
    let criteria = fit.criteria.expect("a likelihood has criteria");
    close(criteria.aic, deviance + 2.0 * k);
    close(criteria.bic, deviance + k * (fit.samples as f64).ln());
}

/// w = c0 exp(−k t), σ = a + b |w|: Σ ((w − y)/σ)² + ln 2πσ².
#[test]
fn noise_in_parts_of_the_reading_is_estimated() {
    let system = decay(
        "parameter a [mol/m^3] = 0.05 in 1e-6 .. 10\n\
         parameter b [%] = 3 in 0 .. 100\n\
         output c [mol/m^3]  noise a + b*abs(c)",
    );
    let (p, recordings) = (declared(&system), [recorded(&system, &[("c", &NORMAL)])]);
    let problem = problem(&system, &p, &recordings);
    let found = fit(&problem).expect("it can be simulated");
    agrees(
        &found,
        &[
            (5.057_961_03, 0.102_160_153),
            (0.031_183_984_1, 0.000_497_375_576),
            (0.015_035_780_5, 0.014_870_115_3),
            (0.058_400_745_9, 0.013_351_933_8),
        ],
        -66.018_246_4,
    );
    // Along an estimate −2 ln of the likelihood rises from its least value, to 1.959964² at the ends.
    let along = profile(&problem, &found, 3).expect("it can be simulated");
    let (Some(low), Some(high)) = along.interval() else { panic!("closed: {along:?}") };
    assert!(along.deviance.iter().all(|d| *d > -1e-9), "{:?}", along.deviance);
    assert!(low < found.estimates[3].value && found.estimates[3].value < high, "{low} {high}");
}

/// σ of ln y: Σ ((ln w − ln y)/σ)² + ln 2πσ² + 2 ln y.
#[test]
fn log_normal_noise_is_estimated() {
    let system =
        decay("parameter s [1] = 0.2 in 1e-3 .. 10, log\noutput c [mol/m^3]  noise lognormal(s)");
    let (p, recordings) = (declared(&system), [recorded(&system, &[("c", &LOG)])]);
    let found = fit(&problem(&system, &p, &recordings)).expect("it can be simulated");
    agrees(
        &found,
        &[
            (4.997_987_58, 0.148_517_589),
            (0.030_026_759_5, 0.000_655_665_749),
            (0.095_736_180_7, 0.010_703_630_4),
        ],
        -39.138_298_1,
    );
}

/// −2 Σ `scipy.stats.t.logpdf((w − y)/σ, 4)` − ln σ; the expected information as in Lange, Little and Taylor.
#[test]
fn noise_with_student_s_tails_is_estimated() {
    let system = decay(
        "parameter s [mol/m^3] = 0.1 in 1e-3 .. 10, log\n\
         output c [mol/m^3]  noise student(4, s)",
    );
    let (p, recordings) = (declared(&system), [recorded(&system, &[("c", &STUDENT)])]);
    let found = fit(&problem(&system, &p, &recordings)).expect("it can be simulated");
    agrees(
        &found,
        &[
            (4.930_496_64, 0.024_019_563_5),
            (0.029_641_922_3, 0.000_227_635_882),
            (0.042_594_985_2, 0.006_299_883_28),
        ],
        -122.459_253,
    );
    assert_eq!(found.reduced_chi_square(), None);
}

/// One σ for two sensors of which one has twice the noise: Σ ((w − y₁)/σ)² + ((2w − y₂)/2σ)² + ln 2πσ² + ln 8πσ².
#[test]
fn outputs_share_a_parameter_of_their_noise() {
    let system = decay(
        "parameter s [mol/m^3] = 0.1 in 1e-3 .. 10\n\
         output c [mol/m^3]  noise s\noutput twice [mol/m^3] = 2*c  noise 2*s",
    );
    let recordings = [recorded(&system, &[("c", &ONE), ("twice", &TWO)])];
    let p = declared(&system);
    let found = fit(&problem(&system, &p, &recordings)).expect("it can be simulated");
    agrees(
        &found,
        &[
            (4.973_854_99, 0.018_512_535_6),
            (0.029_814_676, 0.000_174_696_649),
            (0.054_828_328_6, 0.004_334_559_97),
        ],
        -182.085_784,
    );
    close(found.noise[1].expect("fitted"), 2.0 * 0.054_828_328_6);
}

/// Σ ((w − y)/σ)² + ln 2πσ² with σ row by row.
#[test]
fn each_reading_has_its_own_deviation() {
    let system = decay("output c [mol/m^3]  noise 0.3");
    let mut recording = recorded(&system, &[("c", &NORMAL)]);
    recording.deviations = vec![Some(STD.to_vec())];
    let (p, mut recordings) = (declared(&system), [recording]);
    let found = fit(&problem(&system, &p, &recordings)).expect("it can be simulated");
    agrees(
        &found,
        &[(5.029_561_81, 0.126_077_963), (0.030_986_152, 0.000_720_513_349)],
        -57.076_519_5,
    );
    recordings[0].deviations = vec![Some([&[0.3; 5][..], &[0.0], &STD[6..]].concat())];
    let error = fit(&problem(&system, &p, &recordings)).expect_err("one of them is zero");
    let wrong = WrongReading::Deviation(0.0);
    assert_eq!(error, EstimateError::Reading { output: "c".into(), recording: 0, t: 10.0, wrong });
}

/// The same standard deviation as a number and as a formula: the fits agree.
#[test]
fn a_formula_that_is_a_number_weighs_as_the_number_does() {
    let number = decay("output c [mol/m^3]  noise 0.1");
    let formula = decay("output c [mol/m^3]  noise 0.1 [mol/m^3] + 0*abs(c)");
    let fitted = |system: &InterpretedSystem| {
        let (p, recordings) = (declared(system), [recorded(system, &[("c", &ONE)])]);
        let mut problem = problem(system, &p, &recordings);
        for noise in &mut problem.noise {
            *noise = noise.map(|noise| match noise {
                NoiseSource::Estimated => NoiseSource::Known(0.1),
                other => other,
            });
        }
        fit(&problem).expect("it can be simulated")
    };
    let (number, formula) = (fitted(&number), fitted(&formula));
    assert_eq!(formula.estimates.len(), 2);
    for (a, b) in number.estimates.iter().zip(&formula.estimates) {
        close(b.value, a.value);
        close(b.std.expect("determined"), a.std.expect("determined"));
    }
    close(formula.deviance, number.deviance);
    close(formula.cost, number.cost);
}

#[test]
fn what_a_density_cannot_be_is_refused() {
    let system = decay("output c [mol/m^3]  noise lognormal(0.1)");
    let mut readings = LOG;
    readings[7] = -0.01;
    let (p, recordings) = (declared(&system), [recorded(&system, &[("c", &readings)])]);
    let found = fit(&problem(&system, &p, &recordings));
    let wrong = WrongReading::NotPositive(-0.01);
    let refused = EstimateError::Reading { output: "c".into(), recording: 0, t: 14.0, wrong };
    assert_eq!(found.expect_err("no logarithm"), refused);

    let sound = [recorded(&system, &[("c", &LOG)])];
    let robust = OutputErrorProblem { loss: Loss::Huber, ..problem(&system, &p, &sound) };
    let refused = EstimateError::LossOfDensity { output: "c".into() };
    assert_eq!(fit(&robust).expect_err("two losses"), refused);

    // σ that is not positive where the fit starts.
    let system = decay("output c [mol/m^3]  noise 0.1 [mol/m^3] - 1 [%]*time/1 [s]*c");
    let (p, recordings) = (declared(&system), [recorded(&system, &[("c", &ONE)])]);
    let found = fit(&problem(&system, &p, &recordings)).expect_err("σ is negative");
    let EstimateError::Start(TrialFailed {
        reason: TrialFailure::Deviation { output, t, .. }, ..
    }) = &found
    else {
        panic!("{found:?}")
    };
    assert_eq!((output.as_str(), *t), ("c", 4.0));
}
