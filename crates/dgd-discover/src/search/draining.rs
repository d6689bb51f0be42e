//! Test support: a draining tank, with effects that each add an inflow from some time on.

use std::sync::OnceLock;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::effects::Effect;
use dgd_compiler::model::{ModelOptions, resolve};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::parse;
use dgd_execute::Engine;
use dgd_identify::Recording;
use dgd_runtime::{Inputs, Observations, Options};
use dgd_screen::noise::SensorNoise;

use crate::fit::{FittedStructure, SearchBudget, SearchData, WorkJournal};
use crate::library::{
    BaseModel, CarriedValues, EffectCandidate, ModelStructure, OutputScales, StructureId,
    candidates,
};

const MODEL: &str = "\
model tank
parameter a [1/s] = 0.1 fixed
state h [m] = 1 fixed
equation level: der(h) = -a*h
output h [m]
";

/// Samples of the recording, one a second.
pub(super) const SAMPLES: usize = 1000;

pub(super) fn id(effects: &[usize]) -> StructureId {
    effects.iter().copied().collect()
}

/// Calls `judge` with the model, effects of these names (`NAME` or `NAME/FORM`) as candidates, and a recording of
/// zeros.
pub(super) fn with_effects<T>(
    names: [&str; 3],
    judge: impl FnOnce(&BaseModel, &[EffectCandidate<'_>], SearchData<'_>) -> T,
) -> T {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let mut parsed = |text: String| {
        let id = sources.add(SourceText { name: "test.dgd".to_owned(), text });
        parse(id, &sources, &mut diagnostics).expect("it is sound")
    };
    let asts = vec![parsed(MODEL.to_owned())];
    let effect = |name: &str| {
        let (name, form) = name
            .split_once('/')
            .map_or((name, String::new()), |(name, form)| (name, format!("form {form}\n")));
        format!(
            "effect {name} on tank\nkind plant\n{form}parameter by_{name} [m/s] = 0\n\
             parameter since_{name} [s] = 0\nnull by_{name} = 0\n\
             add if time > since_{name} then by_{name} else 0 [m/s] to level\n"
        )
    };
    let library = names.map(|name| parsed(effect(name)));
    let library = library.map(|ast| Effect::read(ast, &mut diagnostics).expect("an effect"));
    let options = ModelOptions::default();
    let model = resolve(&asts, &options, &mut diagnostics).expect("a model");
    let candidates = candidates(&library, &asts, &model);
    let (free, fix) = (Vec::new(), Vec::new());
    let base = BaseModel {
        asts,
        options,
        free,
        fix,
        engine: Engine::Interpreter,
        scales: OutputScales::default(),
    };
    let times: Vec<f64> = (0..SAMPLES).map(|k| k as f64).collect();
    let measured = vec![Some(vec![0.0; SAMPLES])];
    let data = SearchData {
        train: &[Recording::new(times, Inputs::none(), measured)],
        valid: &[],
        noise: vec![Some(SensorNoise::known(1.0))],
        counts_from: Vec::new(),
        options: Options::default(),
        explicit: None,
        own_weights: false,
        scales: &OutputScales::default(),
        budget: SearchBudget::default(),
        keeping: WorkJournal::NONE,
    };
    judge(&base, &candidates, data)
}

/// A fit of a structure with a residual mean square of `left`, relative to the noise.
pub(super) fn leaving(left: f64, structure: ModelStructure) -> FittedStructure {
    FittedStructure {
        structure,
        values: CarriedValues::default(),
        p: Vec::new(),
        estimates: Vec::new(),
        moments: Vec::new(),
        is_converged: true,
        is_cut_short: false,
        error: (left * SAMPLES as f64, SAMPLES),
        train: vec![Observations { n_w: 1, n_s: 0, w: vec![left.sqrt(); SAMPLES], dw: Vec::new() }],
        valid: None,
        cancelling: OnceLock::from(None),
        foreseen: OnceLock::from(None),
    }
}
