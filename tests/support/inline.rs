//! Models written in a test.

#![allow(dead_code, reason = "no test binary uses all of it")]

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{Compiled, Directions, compile};
use dgd_compiler::source::{Source, Sources};
use dgd_execute::Interpreted;

/// A model as a system, with sensitivities to all of its parameters.
pub(crate) fn system(text: &str) -> Interpreted {
    Interpreted::new(compiled(text).program)
}

/// A model, with sensitivities to all of its parameters.
pub(crate) fn compiled(text: &str) -> Compiled {
    let main = Source { name: "inline.dgd".to_owned(), text: text.to_owned() };
    let (mut sources, mut diagnostics) = (Sources::default(), Diagnostics::default());
    let compiled = compile(
        main,
        &ModelOptions::default(),
        &Directions::All,
        &mut |path| Err(format!("{path} is not read here")),
        &mut sources,
        &mut diagnostics,
    );
    compiled.unwrap_or_else(|_| {
        panic!("{}", render::render(&diagnostics.sorted(), &sources, render::Style::Plain))
    })
}
