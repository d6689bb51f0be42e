//! A model and a library of effects as texts, and what a discovery makes of a rig's recordings.

#![allow(dead_code, reason = "no test binary uses all of it")]

use std::path::{Path, PathBuf};

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::effects::Effect;
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{CompiledStages, SensitivityDirections, compile_asts, load};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::parse;
use dgd_discover::{BaseModel, Discovery, DiscoveryOptions, OutputScales, discover, templates};
use dgd_execute::{Engine, LoadedSystem};
use dgd_identify::journal::NoJournal;
use dgd_identify::{NoMonitor, Recording};
use dgd_runtime::{InputColumn, Inputs, Options, Problem, Signature, System, start_from_outputs};

/// Texts of a model and of effects, each with the name of its file.
#[derive(Debug, Clone)]
pub(crate) struct Texts {
    pub(crate) model: (String, String),
    pub(crate) effects: Vec<(String, String)>,
}

/// A recording as its file has it: times, s, and columns by name in the units that the model declares.
#[derive(Debug, Clone)]
pub(crate) struct Samples {
    pub(crate) times: Vec<f64>,
    pub(crate) columns: Vec<(String, Vec<f64>)>,
}

/// What a discovery is asked, but for the recordings.
#[derive(Debug)]
pub(crate) struct Examined {
    pub(crate) sources: SourceMap,
    pub(crate) base: BaseModel,
    pub(crate) library: Vec<Effect>,
    pub(crate) templates: Vec<Effect>,
    pub(crate) compiled: CompiledStages,
}

impl Samples {
    /// Those of a file, whose columns are in the units that the model declares.
    pub(crate) fn of_file(path: &Path) -> Samples {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let table = dgd_data::read(path, &mut sources, &mut diagnostics).expect("a table");
        let times = table.time.clone().expect("a column of times");
        let columns = table.columns.into_iter().map(|column| (column.name, column.values));
        Samples { times, columns: columns.collect() }
    }

    /// The rows before a time.
    pub(crate) fn until(&self, t: f64) -> Samples {
        let rows = self.times.partition_point(|time| *time < t);
        let columns = self.columns.iter();
        let columns = columns.map(|(name, values)| (name.clone(), values[..rows].to_vec()));
        Samples { times: self.times[..rows].to_vec(), columns: columns.collect() }
    }

    /// Those of a recording's text, `time [s]` first.
    pub(crate) fn of_csv(csv: &str) -> Samples {
        let mut lines = csv.lines();
        let header = lines.next().unwrap_or_default();
        let rows: Vec<Vec<f64>> = lines
            .map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect())
            .collect();
        let column = |at: usize| -> Vec<f64> { rows.iter().map(|row| row[at]).collect() };
        let names = header.split(',').filter_map(|cell| cell.split_whitespace().next());
        let columns = names.enumerate().skip(1).map(|(at, name)| (name.to_owned(), column(at)));
        Samples { times: column(0), columns: columns.collect() }
    }
}

impl Texts {
    /// The circulation model of the repository, and the effects beside it in order of path.
    pub(crate) fn of_the_repository() -> Texts {
        let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
        let read = |path: &Path| {
            let text = std::fs::read_to_string(path).expect("a file of the repository");
            let name = path.strip_prefix(&models).expect("a path below `models`");
            (name.display().to_string(), text)
        };
        let mut paths = Vec::new();
        collect(&models.join("effects"), &mut paths);
        paths.sort();
        Texts {
            model: read(&models.join("mud_circulation.dgd")),
            effects: paths.iter().map(|path| read(path)).collect(),
        }
    }

    /// The same without the files of an effect.
    pub(crate) fn without(&self, effect: &str) -> Texts {
        let is_other = |(name, _): &&(String, String)| {
            !Path::new(name).components().any(|part| {
                Path::new(part.as_os_str()).file_stem().is_some_and(|stem| stem == effect)
            })
        };
        let effects: Vec<_> = self.effects.iter().filter(is_other).cloned().collect();
        assert!(effects.len() < self.effects.len(), "{effect} is in the library");
        Texts { effects, ..self.clone() }
    }

    /// The same with other texts and names of files.
    pub(crate) fn map(&self, f: &dyn Fn(&str) -> String) -> Texts {
        let both = |(name, text): &(String, String)| (f(name), f(text));
        Texts { model: both(&self.model), effects: self.effects.iter().map(both).collect() }
    }

    pub(crate) fn read(&self) -> Examined {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let source =
            |(name, text): &(String, String)| SourceText { name: name.clone(), text: text.clone() };
        let mut nothing = |path: &str| Err(format!("{path} is not read here"));
        let asts = load(source(&self.model), &mut nothing, &mut sources, &mut diagnostics);
        let mut library = Vec::new();
        for text in &self.effects {
            let id = sources.add(source(text));
            let effect = parse(id, &sources, &mut diagnostics)
                .and_then(|ast| Effect::read(ast, &mut diagnostics));
            library.extend(effect);
        }
        let templates = templates(&mut sources, &mut diagnostics).expect("texts of the library");
        let compiled = asts.and_then(|asts| {
            diagnostics.check()?;
            let options = ModelOptions::default();
            compile_asts(asts, &options, &SensitivityDirections::None, &mut diagnostics)
        });
        let compiled = compiled.unwrap_or_else(|_| panic!("{}", shown(&diagnostics, &sources)));
        let base = BaseModel {
            asts: compiled.asts.clone(),
            options: ModelOptions::default(),
            free: Vec::new(),
            fix: Vec::new(),
            engine: Engine::Auto,
            scales: OutputScales::default(),
        };
        Examined { sources, base, library, templates, compiled }
    }
}

impl Examined {
    pub(crate) fn system(&self) -> LoadedSystem {
        LoadedSystem::new(self.compiled.program.clone())
    }

    /// A recording in SI, its start as its first row shows it.
    pub(crate) fn recording(&self, samples: &Samples) -> Recording {
        let system = self.system();
        let mut recording = self.recording_without_start(samples);
        let first: Vec<f64> = recording.measured.iter().flatten().map(|values| values[0]).collect();
        recording.start = start(&system, &declared(system.signature()), &recording.inputs, &first);
        recording
    }

    /// A recording in SI that starts as the model says.
    pub(crate) fn recording_without_start(&self, samples: &Samples) -> Recording {
        let system = self.system();
        let signature = system.signature();
        let times = samples.times.clone();
        let in_si = |name: &str, factor: f64, offset: f64| -> Vec<f64> {
            let column = samples.columns.iter().find(|(column, _)| column == name);
            let (_, values) = column.unwrap_or_else(|| panic!("{name} is recorded"));
            values.iter().map(|value| value * factor + offset).collect()
        };
        let inputs: Vec<Vec<f64>> = signature
            .inputs
            .iter()
            .map(|input| in_si(&input.name, input.unit.factor, input.unit.offset))
            .collect();
        let columns: Vec<InputColumn<'_>> = signature
            .inputs
            .iter()
            .zip(&inputs)
            .map(|(input, values)| InputColumn {
                name: &input.name,
                interpolation: input.interpolation,
                values,
            })
            .collect();
        let inputs = Inputs::recorded(&times, &columns).expect("inputs at all times");
        let measured: Vec<Option<Vec<f64>>> = signature
            .outputs
            .iter()
            .enumerate()
            .map(|(i, output)| {
                let in_si = || in_si(&output.name, output.unit.factor, output.unit.offset);
                (!signature.is_deviation(i)).then(in_si)
            })
            .collect();
        Recording::new(times, inputs, measured)
    }

    /// What is found with recordings to fit to and recordings held out.
    pub(crate) fn discover(
        &self,
        train: &[Recording],
        valid: &[Recording],
        threads: usize,
    ) -> Discovery {
        self.discover_seeded(train, valid, threads, 1)
    }

    /// The same with a seed of resampling.
    pub(crate) fn discover_seeded(
        &self,
        train: &[Recording],
        valid: &[Recording],
        threads: usize,
        seed: u64,
    ) -> Discovery {
        let names = |part: &str, n: usize| -> Vec<String> {
            (1..=n).map(|k| format!("{part}{k}")).collect()
        };
        let (train_names, valid_names) = (names("train", train.len()), names("valid", valid.len()));
        let request = DiscoveryOptions {
            base: &self.base,
            library: &self.library,
            templates: &self.templates,
            sources: &self.sources,
            train: (train, &train_names),
            valid: (valid, &valid_names),
            options: Options { rtol: 1e-6, atol: 1e-6, ..Options::default() },
            is_method_named: false,
            threads,
            seed,
            budget: None,
            journal: &NoJournal,
            watch: &NoMonitor,
        };
        let mut diagnostics = Diagnostics::default();
        discover(&request, &mut diagnostics)
            .unwrap_or_else(|error| panic!("{error}\n{}", shown(&diagnostics, &self.sources)))
    }
}

/// Parameters as the model declares them.
pub(crate) fn declared(signature: &Signature) -> Vec<f64> {
    signature.parameters.iter().map(|parameter| parameter.value).collect()
}

/// Start values from the outputs at the first time.
pub(crate) fn start(
    system: &LoadedSystem,
    p: &[f64],
    inputs: &Inputs,
    first: &[f64],
) -> Vec<(usize, f64)> {
    let signature = system.signature();
    let problem = Problem { system, p, inputs, start: &[] };
    let first: Vec<Option<f64>> = first.iter().copied().map(Some).collect();
    let noise: Vec<f64> = signature
        .outputs
        .iter()
        .map(|output| output.noise.expect("the model says how noisy its outputs are"))
        .collect();
    start_from_outputs(&problem, 0.0, &first, &noise, &Options::default())
        .expect("outputs that determine the start")
}

pub(crate) fn shown(diagnostics: &Diagnostics, sources: &SourceMap) -> String {
    render::render(&diagnostics.sorted(), sources, render::RenderStyle::Plain)
}

fn collect(folder: &Path, paths: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("a readable folder").path();
        if path.is_dir() {
            collect(&path, paths);
        } else {
            paths.push(path);
        }
    }
}
