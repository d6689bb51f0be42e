//! What the integration tests share: models of the repository as systems.

#![allow(dead_code, reason = "no test binary uses all of it")]

#[path = "normal.rs"]
pub(crate) mod normal;

use std::path::{Path, PathBuf};

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::{ModelOptions, Setting};
use dgd_compiler::pipeline::{CompiledStages, SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::Name;
use dgd_compiler::syntax::parse_setting;
use dgd_execute::{Engine, InterpretedSystem, LoadedSystem};
use dgd_runtime::{DelayedInput, Input, Interpolation, Signature};

#[allow(unused_imports, reason = "no test binary uses all of it")]
pub(crate) use normal::Noise;

/// The repository's root.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every model file in `models/` and in `models/test_set/`, in order of name.
pub(crate) fn model_files() -> Vec<PathBuf> {
    let folders = [root().join("models"), root().join("models/test_set")];
    let mut files: Vec<PathBuf> = folders
        .iter()
        .flat_map(|folder| std::fs::read_dir(folder).expect("the repository has models"))
        .map(|entry| entry.expect("a readable folder").path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "dgd"))
        .collect();
    files.sort();
    files
}

/// A name without a place.
pub(crate) fn name(text: &str) -> Name {
    Name { text: text.to_owned(), span: Span::default() }
}

/// Compiles a model of the repository with the given choices and all sensitivities.
pub(crate) fn compiled(path: &Path, variants: &[(&str, &str)]) -> CompiledStages {
    compiled_with(path, variants, &SensitivityDirections::All)
}

/// Compiles a model of the repository with the given choices and sensitivities.
pub(crate) fn compiled_with(
    path: &Path,
    variants: &[(&str, &str)],
    directions: &SensitivityDirections,
) -> CompiledStages {
    let path = root().join(path);
    let text = std::fs::read_to_string(&path).expect("a model file");
    compiled_text(&path, text, (variants, &[]), directions)
}

/// Compiles a text as if it stood at `path`, with the given choices and `NAME=VALUE`s.
pub(crate) fn compiled_text(
    path: &Path,
    text: String,
    (variants, settings): (&[(&str, &str)], &[&str]),
    directions: &SensitivityDirections,
) -> CompiledStages {
    let mut sources = SourceMap::default();
    let mut diagnostics = Diagnostics::default();
    let settings = settings.iter().map(|text| {
        let source = SourceText { name: (*text).to_owned(), text: (*text).to_owned() };
        let id = sources.add(source);
        let (name, value) = parse_setting(id, &sources, &mut diagnostics).expect("NAME=VALUE");
        Setting { name, value }
    });
    let settings = settings.collect();
    let variants = variants.iter().map(|(v, c)| (name(v), name(c))).collect();
    let options = ModelOptions { variants, settings, ..ModelOptions::default() };
    let main = SourceText { name: path.display().to_string(), text };
    compile(
        main,
        &options,
        directions,
        &mut |path| std::fs::read_to_string(path).map_err(|error| error.to_string()),
        &mut sources,
        &mut diagnostics,
    )
    .unwrap_or_else(|_| {
        panic!("{}", render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain))
    })
}

/// A model of the repository, interpreted.
pub(crate) fn interpreted(path: &str, variants: &[(&str, &str)]) -> InterpretedSystem {
    InterpretedSystem::new(compiled(Path::new(path), variants).program)
}

/// A model of the repository as machine code made at run time.
pub(crate) fn native(path: &str, variants: &[(&str, &str)]) -> LoadedSystem {
    let loaded =
        LoadedSystem::with_engine(compiled(Path::new(path), variants).program, Engine::Native);
    loaded.compile().expect("tests run where native code can be had");
    loaded
}

/// Bits of a number; all NaNs have the same. Which of them an operation gives is left
/// open by Rust, as its compiler may exchange operands.
pub(crate) fn bits_of(x: f64) -> u64 {
    if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() }
}

/// Every model of the repository in each of its variants, one choice changed at a time:
/// (description, choices).
pub(crate) fn every_variant(path: &Path) -> Vec<Vec<(String, String)>> {
    let model = compiled(path, &[]).model;
    let mut all = vec![Vec::new()];
    for variant in &model.variants {
        for choice in variant.choices.iter().skip(1) {
            all.push(vec![(variant.name.clone(), choice.clone())]);
        }
    }
    all
}

/// u from one number for each declared input, one for each delayed one, and one for its slope; the
/// names are those of the inputs, with the delay or `slope` behind.
pub(crate) fn input_values(
    signature: &Signature,
    mut value: impl FnMut(&str, &Input) -> f64,
    mut slope: impl FnMut(&str, &Input) -> f64,
) -> Vec<f64> {
    let late = |delayed: &DelayedInput| {
        let input = &signature.inputs[delayed.input];
        (format!("{} late by {}", input.name, signature.delays[delayed.delay]), input)
    };
    let mut u: Vec<f64> = signature.inputs.iter().map(|input| value(&input.name, input)).collect();
    for (name, input) in signature.delayed_inputs.iter().map(late) {
        u.push(value(&name, input));
    }
    for (name, input) in signature.delayed_inputs.iter().map(late) {
        u.push(slope(&format!("{name}, slope"), input));
    }
    let past: Vec<(String, Input)> = (signature.delayed_unknowns.iter())
        .map(|delayed| {
            let unknown = signature.unknowns.get(delayed.unknown);
            // Not by its delay, whose text may hold a number that was rounded otherwise.
            let name = format!("{} late", unknown.name);
            let (unit, interpolation) = (unknown.unit.clone(), Interpolation::Linear);
            (name, Input { name: unknown.name.clone(), unit, interpolation })
        })
        .collect();
    u.resize(u.len() + past.len(), 1.0);
    u.extend(past.iter().map(|(name, input)| value(name, input)));
    let slopes = 2 + 2 * signature.directions.len();
    for number in 0..slopes {
        u.extend(past.iter().map(|(name, input)| slope(&format!("{name}, {number}"), input)));
    }
    u
}
