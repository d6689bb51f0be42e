//! Models written in a test.

#![allow(dead_code, reason = "no test binary uses all of it")]

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{CompiledStages, SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_execute::InterpretedSystem;

/// A model as a system, with sensitivities to all of its parameters.
pub(crate) fn system(text: &str) -> InterpretedSystem {
    InterpretedSystem::new(compiled(text).program)
}

/// A model, with sensitivities to all of its parameters.
pub(crate) fn compiled(text: &str) -> CompiledStages {
    let main = SourceText { name: "inline.dgd".to_owned(), text: text.to_owned() };
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let compiled = compile(
        main,
        &ModelOptions::default(),
        &SensitivityDirections::All,
        &mut |path| Err(format!("{path} is not read here")),
        &mut sources,
        &mut diagnostics,
    );
    compiled.unwrap_or_else(|_| {
        panic!("{}", render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain))
    })
}
