//! Models and recordings, ready to be simulated.

use std::path::Path;

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::effects::{Effect, EffectApplication, EffectBlending, apply};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{SensitivityDirections, compile_asts, load};
use dgd_compiler::source::{SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::Name;
use dgd_compiler::syntax::parse;
use dgd_execute::LoadedSystem;
use dgd_identify::Recording;
use dgd_runtime::{
    InputColumn, Inputs, Observations, Options, Problem, Signature, Solution, System,
};
use dgd_runtime::{observe, simulate};

use crate::chapters::Fallible;

/// A compiled model with values of its parameters, SI.
pub(crate) struct Model {
    pub(crate) system: LoadedSystem,
    pub(crate) p: Vec<f64>,
}

/// What is chosen when a model is compiled.
#[derive(Default)]
pub(crate) struct Choices<'a> {
    pub(crate) variants: &'a [(&'a str, &'a str)],
    /// Files of effects.
    pub(crate) effects: &'a [&'a str],
    /// Parameters to be differentiated to; all that are not `fixed` where none is named.
    pub(crate) free: &'a [&'a str],
}

impl Model {
    /// Compiles a model file; paths are relative to the repository's root.
    pub(crate) fn load(path: &str, choices: &Choices<'_>) -> Fallible<Model> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let source = |path: &str| -> Fallible<SourceText> {
            let path = root.join(path);
            let text = std::fs::read_to_string(&path)
                .map_err(|error| format!("{}: {error}", path.display()))?;
            Ok(SourceText { name: path.display().to_string(), text })
        };
        let main = source(path)?;
        let effects: Vec<SourceText> =
            choices.effects.iter().map(|path| source(path)).collect::<Fallible<_>>()?;
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let mut read = |path: &str| std::fs::read_to_string(path).map_err(|e| e.to_string());
        let compiled = load(main, &mut read, &mut sources, &mut diagnostics).and_then(|asts| {
            let effects: Vec<Effect> = effects
                .into_iter()
                .map(|effect| {
                    let id = sources.add(effect);
                    Effect::read(parse(id, &sources, &mut diagnostics)?, &mut diagnostics)
                })
                .collect::<Result<_, _>>()?;
            let applications: Vec<EffectApplication<'_>> = effects
                .iter()
                .map(|effect| EffectApplication {
                    effect,
                    arguments: Vec::new(),
                    span: effect.name.span,
                })
                .collect();
            let asts = if applications.is_empty() {
                asts
            } else {
                apply(&asts, &applications, EffectBlending::Applied, &mut diagnostics)?.asts
            };
            let name = |text: &str| Name { text: text.to_owned(), span: Span::default() };
            let variants = choices.variants.iter().map(|(v, c)| (name(v), name(c))).collect();
            let options = ModelOptions { variants, ..ModelOptions::default() };
            let free = choices.free.iter().map(|free| name(free)).collect();
            let directions = SensitivityDirections::Estimated { free, fixed: Vec::new() };
            compile_asts(asts, &options, &directions, &mut diagnostics)
        });
        let compiled = compiled.map_err(|_| {
            render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain)
        })?;
        let system = LoadedSystem::new(compiled.program);
        let p = system.signature().parameters.iter().map(|parameter| parameter.value).collect();
        Ok(Model { system, p })
    }

    pub(crate) fn signature(&self) -> &Signature {
        self.system.signature()
    }

    /// Sets parameters by name, SI.
    pub(crate) fn with(mut self, values: &[(&str, f64)]) -> Fallible<Model> {
        for (name, value) in values {
            let at = self.parameter(name)?;
            self.p[at] = *value;
        }
        Ok(self)
    }

    /// Position of a parameter.
    pub(crate) fn parameter(&self, name: &str) -> Fallible<usize> {
        let parameters = &self.signature().parameters;
        let at = parameters.iter().position(|parameter| *parameter.name == *name);
        at.ok_or_else(|| format!("the model has no parameter `{name}`").into())
    }

    /// Position of an unknown.
    pub(crate) fn unknown(&self, name: &str) -> Fallible<usize> {
        let unknowns = &self.signature().unknowns;
        let at = (0..unknowns.len()).find(|i| unknowns.name(*i) == name);
        at.ok_or_else(|| format!("the model has no unknown `{name}`").into())
    }

    /// Inputs and outputs of the model among some columns, SI, as a recording; start values by name.
    pub(crate) fn recording(
        &self,
        times: &[f64],
        columns: &[(&str, &[f64])],
        start: &[(&str, f64)],
    ) -> Fallible<Recording> {
        let signature = self.signature();
        let column = |name: &str| columns.iter().find(|(other, _)| *other == name);
        let inputs: Vec<InputColumn<'_>> = signature
            .inputs
            .iter()
            .map(|input| {
                let (_, values) = column(&input.name)
                    .ok_or_else(|| format!("nothing was recorded for `{}`", input.name))?;
                let interpolation = input.interpolation;
                Ok(InputColumn { name: &input.name, interpolation, values })
            })
            .collect::<Fallible<_>>()?;
        let inputs = Inputs::recorded(times, &inputs)?;
        let outputs = signature.outputs.iter();
        let measured = outputs.map(|o| column(&o.name).map(|(_, values)| values.to_vec()));
        let mut recording = Recording::new(times.to_vec(), inputs, measured.collect());
        for (name, value) in start {
            recording.start.push((self.unknown(name)?, *value));
        }
        Ok(recording)
    }

    /// Simulates the model at the samples of a recording.
    pub(crate) fn run(&self, recording: &Recording) -> Fallible<Run> {
        let problem = Problem {
            system: &self.system,
            p: &self.p,
            inputs: &recording.inputs,
            start: &recording.start,
        };
        let solution = simulate(&problem, &recording.times, &Options::default())
            .map_err(|failure| failure.to_string())?;
        let observations = observe(&problem, &solution);
        let signature = self.signature();
        let unknowns =
            (0..signature.unknowns.len()).map(|i| signature.unknowns.name(i).to_string());
        let outputs = signature.outputs.iter().map(|output| output.name.to_string());
        Ok(Run { unknowns: unknowns.collect(), outputs: outputs.collect(), solution, observations })
    }
}

/// Trajectories of unknowns and outputs, SI.
pub(crate) struct Run {
    unknowns: Vec<String>,
    outputs: Vec<String>,
    solution: Solution,
    observations: Observations,
}

impl Run {
    /// An unknown over time.
    pub(crate) fn unknown(&self, name: &str) -> Fallible<Vec<f64>> {
        let at = self.unknowns.iter().position(|other| other == name);
        let at = at.ok_or_else(|| format!("the model has no unknown `{name}`"))?;
        Ok((0..self.solution.len()).map(|k| self.solution.y(k)[at]).collect())
    }

    /// An output over time.
    pub(crate) fn output(&self, name: &str) -> Fallible<Vec<f64>> {
        let at = self.outputs.iter().position(|other| other == name);
        let at = at.ok_or_else(|| format!("the model has no output `{name}`"))?;
        Ok((0..self.solution.len()).map(|k| self.observations.w(k)[at]).collect())
    }
}
