//! Arbitrary bytes as an imported file and the model that imports it, separated by a zero byte.
#![no_main]

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    let mut part = || String::from_utf8_lossy(parts.next().unwrap_or_default()).into_owned();
    let (imported, rest) = (part(), part());
    let text =
        format!("model m\nimport \"a.dgd\"\nstate x = 1\nequation e: der(x) = -x/1 [s]\n{rest}");
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let compiled = compile(
        SourceText { name: "m.dgd".to_owned(), text },
        &ModelOptions::default(),
        &SensitivityDirections::All,
        &mut |_| Ok(imported.clone()),
        &mut sources,
        &mut diagnostics,
    );
    let mistakes = diagnostics.sorted();
    assert_eq!(compiled.is_err(), !mistakes.is_empty());
    let _ = render::render(&mistakes, &sources, render::Style::Plain);
});
