//! Shared by the tests: reproducible noise, and models as text.

#![allow(dead_code, reason = "no test binary uses all of it")]

#[path = "../../../../tests/support/normal.rs"]
mod normal;

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::{Model, ModelOptions, resolve};
use dgd_compiler::pipeline::load;
use dgd_compiler::source::{SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::Name;
use dgd_discover::MissingTerms;
use dgd_execute::Engine;

pub(crate) use normal::Normal;

/// 0, 1, …, n − 1 seconds.
pub(crate) fn seconds(n: usize) -> Vec<f64> {
    (0..n).map(|k| k as f64).collect()
}

/// A model from its text, with unknown inputs.
pub(crate) fn with_missing_terms(text: &str, variants: &[(&str, &str)]) -> MissingTerms {
    let mut diagnostics = Diagnostics::default();
    let mut sources = SourceMap::default();
    let model = resolved(text, variants, &mut sources, &mut diagnostics);
    model
        .and_then(|model| MissingTerms::new(&model, Engine::Auto, &mut diagnostics).ok())
        .unwrap_or_else(|| {
            panic!(
                "{}",
                render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain)
            )
        })
}

fn resolved(
    text: &str,
    variants: &[(&str, &str)],
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Option<Model> {
    let name = |text: &str| Name { text: text.to_owned(), span: Span::default() };
    let options = ModelOptions {
        variants: variants.iter().map(|(v, c)| (name(v), name(c))).collect(),
        ..ModelOptions::default()
    };
    let main = SourceText { name: "test.dgd".to_owned(), text: text.to_owned() };
    let mut read = |path: &str| Err(format!("`{path}` is not needed"));
    let asts = load(main, &mut read, sources, diagnostics).ok()?;
    resolve(&asts, &options, diagnostics).ok()
}

/// The text of a model of the repository.
pub(crate) fn model_text(name: &str) -> String {
    let path = format!("{}/../../models/{name}.dgd", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).expect("a model of the repository")
}
