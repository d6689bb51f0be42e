//! What the tests of filters share: models with what they estimate, rows of readings, and what a filter makes of them.

use std::path::Path;

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_execute::LoadedSystem;
use dgd_identify::filter::{
    FilterAlgorithm, FilterProblem, FilterSample, FilterTuning, RandomWalk, RunningFilter,
    TrackedRow,
};
use dgd_runtime::{InputColumn, Inputs, Interpolation, Options, System};
use rand_pcg::Pcg64;

use crate::normal;
use crate::support::{self, compiled_text};

/// A tight solver, so that what is compared is the filter.
pub(crate) fn tight() -> Options {
    Options { rtol: 1e-12, atol: 1e-12, ..Options::default() }
}

/// A model, with sensitivities to the parameters and start values of these names.
pub(crate) fn system(text: &str, free: &[&str]) -> LoadedSystem {
    let free = free.iter().map(|text| support::name(text)).collect();
    let directions = SensitivityDirections::Tracked { free, fixed: Vec::new() };
    LoadedSystem::new(
        compiled_text(Path::new("m.dgd"), text.to_owned(), (&[], &[]), &directions).program,
    )
}

/// The model's own parameters.
pub(crate) fn declared(system: &LoadedSystem) -> Vec<f64> {
    system.signature().parameters.iter().map(|parameter| parameter.value).collect()
}

/// Normal deviates by Box and Muller.
pub(crate) struct Normal(Pcg64);

impl Normal {
    pub(crate) fn new(seed: u64) -> Self {
        Normal(Pcg64::new(u128::from(seed), 0))
    }

    pub(crate) fn next(&mut self) -> f64 {
        normal(&mut self.0)
    }
}

/// Rows of inputs and outputs.
pub(crate) struct Data {
    pub(crate) t: Vec<f64>,
    pub(crate) u: Vec<Vec<f64>>,
    pub(crate) measured: Vec<Vec<f64>>,
}

/// What a filter makes of data.
pub(crate) fn rows(
    problem: &FilterProblem<'_>,
    tuning: &FilterTuning,
    data: &Data,
) -> Vec<TrackedRow> {
    let sample =
        |k: usize| FilterSample { t: data.t[k], u: &data.u[k], measured: &data.measured[k] };
    let (mut filter, first) = RunningFilter::begin(problem, tuning, sample(0)).expect("a filter");
    let rest = (1..data.t.len()).map(|k| filter.step(sample(k)).expect("a row"));
    let rest: Vec<TrackedRow> = rest.collect();
    std::iter::once(first).chain(rest).collect()
}

#[track_caller]
pub(crate) fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} against {expected}");
}

/// Standard deviations at the start and rates of states and parameters, and noise of outputs.
pub(crate) fn tuning(states: &[[f64; 2]], parameters: &[[f64; 2]], noise: &[f64]) -> FilterTuning {
    let walk = |[start, rate]: &[f64; 2]| RandomWalk { start: *start, rate: *rate };
    FilterTuning {
        states: states.iter().map(walk).collect(),
        parameters: parameters.iter().map(walk).collect(),
        noise: noise.iter().map(|sigma| Some(*sigma)).collect(),
    }
}

pub(crate) fn recursive(forgetting_factor: f64) -> FilterAlgorithm {
    FilterAlgorithm::Recursive { forgetting_factor, most_covariance: 1.0 }
}

/// The inputs of data with one, held between its rows.
pub(crate) fn held_inputs(data: &Data) -> Inputs {
    let u: Vec<f64> = data.u.iter().map(|u| u[0]).collect();
    let column = InputColumn { name: "u", interpolation: Interpolation::Hold, values: &u };
    Inputs::recorded(&data.t, &[column]).expect("inputs")
}
