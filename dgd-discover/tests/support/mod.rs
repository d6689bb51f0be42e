//! What the tests share: noise that is the same in every run, and models as text.

#![allow(dead_code, reason = "no test binary uses all of it")]

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::{Model, ModelOptions, resolve};
use dgd_compiler::pipeline::load;
use dgd_compiler::source::{Source, Sources, Span};
use dgd_compiler::syntax::ast::Name;
use dgd_discover::MissingTerms;
use dgd_execute::Engine;

/// Standard normal numbers: SplitMix64 (Steele, Lea, Flood 2014) and Box and Muller's transform.
pub(crate) struct Normal(u64);

impl Normal {
    pub(crate) fn new(seed: u64) -> Self {
        // One step apart, neighbouring seeds would give one sequence shifted by a number.
        Normal(seed.wrapping_mul(0x2545_F491_4F6C_DD1D))
    }

    /// In (0, 1].
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        ((z >> 11) + 1) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn next(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (2.0 * std::f64::consts::PI * self.uniform()).cos()
    }

    pub(crate) fn many(&mut self, n: usize, std: f64) -> Vec<f64> {
        (0..n).map(|_| std * self.next()).collect()
    }
}

/// 0, 1, …, n − 1 seconds.
pub(crate) fn seconds(n: usize) -> Vec<f64> {
    (0..n).map(|k| k as f64).collect()
}

/// A model from its text, with room for what is missing.
pub(crate) fn with_missing_terms(text: &str, variants: &[(&str, &str)]) -> MissingTerms {
    let mut diagnostics = Diagnostics::default();
    let mut sources = Sources::default();
    let model = resolved(text, variants, &mut sources, &mut diagnostics);
    model
        .and_then(|model| MissingTerms::new(&model, Engine::Auto, &mut diagnostics).ok())
        .unwrap_or_else(|| {
            panic!("{}", render::render(&diagnostics.sorted(), &sources, render::Style::Plain))
        })
}

fn resolved(
    text: &str,
    variants: &[(&str, &str)],
    sources: &mut Sources,
    diagnostics: &mut Diagnostics,
) -> Option<Model> {
    let name = |text: &str| Name { text: text.to_owned(), span: Span::default() };
    let options = ModelOptions {
        variants: variants.iter().map(|(v, c)| (name(v), name(c))).collect(),
        ..ModelOptions::default()
    };
    let main = Source { name: "test.dgd".to_owned(), text: text.to_owned() };
    let mut read = |path: &str| Err(format!("`{path}` is not needed"));
    let asts = load(main, &mut read, sources, diagnostics).ok()?;
    resolve(&asts, &options, diagnostics).ok()
}

/// The text of a model of the repository.
pub(crate) fn model_text(name: &str) -> String {
    let path = format!("{}/../models/{name}.dgd", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).expect("a model of the repository")
}
