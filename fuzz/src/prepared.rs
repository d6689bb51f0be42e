//! A compiled and loaded case.

use dgd_compiler::diagnostics::{Diagnostics, ErrorReported, render};
use dgd_compiler::effects::{Effect, EffectApplication, EffectBlending, apply};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{CompiledStages, SensitivityDirections, compile, compile_asts, load};
use dgd_compiler::source::{SourceMap, SourceText, Span};
use dgd_compiler::syntax::parse;
use dgd_execute::{Engine, InterpretedSystem, LoadedSystem};
use dgd_runtime::{
    Failure, InputColumn, Inputs, Options, Problem, Signature, Solution, System, find_method,
    simulate, simulate_with_sensitivities,
};

use crate::case::Case;
use crate::oracle::Finding;

/// Maximum number of steps of a run.
const MOST_STEPS: usize = 40_000;

/// A case ready to run.
pub(crate) struct Prepared {
    pub compiled: CompiledStages,
    pub system: InterpretedSystem,
    /// Compiled on first use.
    pub native: LoadedSystem,
    pub inputs: Inputs,
    pub p: Vec<f64>,
    pub times: Vec<f64>,
}

/// The file of an effect that is applied to the model.
pub(crate) const EFFECT: &str = "applied.dgd";

/// Runs stages 1 to 4 on a case's text, with its effect applied if there is one.
pub(crate) fn compiled(
    case: &Case,
    directions: &SensitivityDirections,
) -> Result<(CompiledStages, SourceMap), Finding> {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let made = stages(case, directions, &mut sources, &mut diagnostics);
    if let Ok(compiled) = made {
        return Ok((compiled, sources));
    }
    let sorted = diagnostics.sorted();
    let code = sorted.first().map_or_else(String::new, |first| first.code.to_string());
    let text = render::render(&sorted, &sources, render::RenderStyle::Plain);
    Err(Finding::new("accepted", code, text))
}

fn stages(
    case: &Case,
    directions: &SensitivityDirections,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<CompiledStages, ErrorReported> {
    let main = SourceText { name: "m.dgd".to_owned(), text: case.model.clone() };
    let mut read = |path: &str| {
        case.files.get(path).cloned().ok_or_else(|| "there is no such file".to_owned())
    };
    let Some(text) = case.files.get(EFFECT) else {
        return compile(
            main,
            &ModelOptions::default(),
            directions,
            &mut read,
            sources,
            diagnostics,
        );
    };
    let asts = load(main, &mut read, sources, diagnostics)?;
    let id = sources.add(SourceText { name: EFFECT.to_owned(), text: text.clone() });
    let effect = Effect::read(parse(id, sources, diagnostics)?, diagnostics)?;
    let application =
        EffectApplication { effect: &effect, arguments: Vec::new(), span: Span::default() };
    let applied = apply(&asts, &[application], EffectBlending::Applied, diagnostics)?;
    compile_asts(applied.asts, &ModelOptions::default(), directions, diagnostics)
}

impl Prepared {
    pub(crate) fn new(case: &Case) -> Result<Self, Finding> {
        let (compiled, _) = compiled(case, &SensitivityDirections::All)?;
        let system = InterpretedSystem::new(compiled.program.clone());
        let native = LoadedSystem::with_engine(compiled.program.clone(), Engine::Native);
        let signature = system.signature();
        let inputs = inputs(case, signature)
            .map_err(|reason| Finding::new("accepted", "recording", reason))?;
        let p = signature.parameters.iter().map(|parameter| parameter.value).collect();
        Ok(Self { times: case.times(), compiled, system, native, inputs, p })
    }

    pub(crate) fn signature(&self) -> &Signature {
        self.system.signature()
    }

    pub(crate) fn problem<'a>(&'a self, p: &'a [f64]) -> Problem<'a, LoadedSystem> {
        Problem { system: &self.native, p, inputs: &self.inputs, start: &[] }
    }

    /// A run with this tolerance.
    pub(crate) fn run(
        &self,
        p: &[f64],
        method: &str,
        tolerance: f64,
        sensitivities: bool,
    ) -> Result<Solution, Failure> {
        self.run_at(&self.times, p, method, tolerance, sensitivities)
    }

    /// The same run with rows at other times.
    pub(crate) fn run_at(
        &self,
        times: &[f64],
        p: &[f64],
        method: &str,
        tolerance: f64,
        sensitivities: bool,
    ) -> Result<Solution, Failure> {
        let options = options(method, tolerance);
        let problem = self.problem(p);
        if sensitivities {
            simulate_with_sensitivities(&problem, times, &options)
        } else {
            simulate(&problem, times, &options)
        }
    }
}

/// Options of a run with a named method.
pub(crate) fn options(method: &str, tolerance: f64) -> Options {
    Options {
        rtol: tolerance,
        atol: tolerance,
        method: find_method(method).unwrap_or_else(|name| panic!("a method {name:?}")),
        max_steps: MOST_STEPS,
        ..Options::default()
    }
}

/// The recording as the model's inputs.
fn inputs(case: &Case, signature: &Signature) -> Result<Inputs, String> {
    if signature.inputs.is_empty() {
        return Ok(Inputs::none());
    }
    let (times, columns) = case.recording();
    let mut values = Vec::new();
    for input in signature.inputs.iter() {
        let column =
            columns.get(&*input.name).ok_or_else(|| format!("no column {}", input.name))?;
        values.push(
            column.iter().map(|x| x * input.unit.factor + input.unit.offset).collect::<Vec<f64>>(),
        );
    }
    let columns: Vec<InputColumn<'_>> = (signature.inputs.iter().zip(&values))
        .map(|(input, values)| InputColumn {
            name: &input.name,
            interpolation: input.interpolation,
            values,
        })
        .collect();
    Inputs::recorded(&times, &columns).map_err(|error| error.to_string())
}
