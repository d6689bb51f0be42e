//! Fits of data sets, and what their intervals hold.

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_execute::LoadedSystem;
use dgd_identify::filter::{
    NoiseLevelSource, PredictionErrorProblem, prediction_error, prediction_error_profiles,
};
use dgd_identify::{
    NoiseSource, OutputErrorProblem, Profile, ProfileEnd, Recording, fit, profiles,
};
use dgd_runtime::System;

use super::data::Problem;

/// What an interval says of the truth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Held {
    pub(super) holds: bool,
    pub(super) is_open: bool,
}

/// The model of a problem.
pub(super) fn system(problem: Problem) -> LoadedSystem {
    let directions = match problem {
        Problem::Substrate | Problem::Siphon => {
            SensitivityDirections::Estimated { free: Vec::new(), fixed: Vec::new() }
        }
        Problem::Room => SensitivityDirections::Tracked { free: Vec::new(), fixed: Vec::new() },
    };
    let name = format!("{}.dgd", problem.name());
    let main = SourceText { name, text: problem.model().to_owned() };
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let mut imports = |path: &str| Err(format!("there is no {path}"));
    let options = ModelOptions::default();
    let compiled =
        compile(main, &options, &directions, &mut imports, &mut sources, &mut diagnostics);
    LoadedSystem::new(compiled.expect("the models of this example have no mistakes").program)
}

/// Whether the intervals of a data set hold the truth; nothing where the fit does not converge.
pub(super) fn held(
    problem: Problem,
    system: &LoadedSystem,
    recording: Recording,
) -> Option<Vec<Held>> {
    let p: Vec<f64> = system.signature().parameters.iter().map(|p| p.value).collect();
    let recordings = [recording];
    let all: Vec<usize> = (0..problem.estimates().len()).collect();
    let (names, profiles): (Vec<String>, Vec<Profile>) = match problem {
        Problem::Substrate | Problem::Siphon => {
            let sigma = system.signature().outputs[0].noise.expect("noise is declared");
            let problem = OutputErrorProblem {
                noise: vec![Some(NoiseSource::Known(sigma))],
                ..OutputErrorProblem::new(system, &p, &recordings)
            };
            let found = fit(&problem).ok().filter(|fit| fit.termination.is_converged())?;
            let names = found.estimates.iter().map(|estimate| estimate.name.clone());
            (names.collect(), profiles(&problem, &found, &all).ok()?)
        }
        Problem::Room => {
            let problem = PredictionErrorProblem {
                rates: vec![NoiseLevelSource::Estimated],
                noise: vec![Some(NoiseLevelSource::Estimated)],
                ..PredictionErrorProblem::new(system, &p, &recordings)
            };
            let found = prediction_error(&problem).ok()?;
            let found = found.termination.is_converged().then_some(found)?;
            let names = found.estimates.iter().map(|estimate| estimate.name.clone());
            (names.collect(), prediction_error_profiles(&problem, &found, &all).ok()?)
        }
    };
    assert_eq!(names, problem.estimates(), "the order of estimates");
    Some(profiles.iter().zip(problem.truth()).map(|(profile, truth)| of(profile, *truth)).collect())
}

fn of(profile: &Profile, truth: f64) -> Held {
    let is_closed = |end: ProfileEnd| matches!(end, ProfileEnd::Interval(_));
    let above = !is_closed(profile.lower) || profile.lower.value() <= truth;
    let below = !is_closed(profile.upper) || truth <= profile.upper.value();
    Held { holds: above && below, is_open: !is_closed(profile.lower) || !is_closed(profile.upper) }
}
