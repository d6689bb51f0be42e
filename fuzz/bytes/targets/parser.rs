//! Arbitrary bytes as a model: it is read or refused, a parsed model prints as itself, and the rest of the compiler
//! reports errors without a panic.
#![no_main]

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::places::without_places;
use dgd_compiler::syntax::print::print;
use dgd_compiler::syntax::{layout, parse};

fn read(text: &str) -> Option<dgd_compiler::syntax::ast::Ast> {
    let mut sources = SourceMap::default();
    let id = sources.add(SourceText { name: "m.dgd".to_owned(), text: text.to_owned() });
    parse(id, &sources, &mut Diagnostics::default()).ok()
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let id = sources.add(SourceText { name: "m.dgd".to_owned(), text: text.to_owned() });
    if let Ok(ast) = parse(id, &sources, &mut diagnostics) {
        let printed = read(&print(&ast)).expect("what is printed can be read");
        assert_eq!(without_places(&printed), without_places(&ast), "{}", print(&ast));
        let once =
            layout::format(id, &sources, &mut diagnostics).expect("what is read has a layout");
        let again = read(&once).expect("what is laid out can be read");
        assert_eq!(without_places(&again), without_places(&ast), "{once}");
    }
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let main = SourceText { name: "m.dgd".to_owned(), text: text.to_owned() };
    let compiled = compile(
        main,
        &ModelOptions::default(),
        &SensitivityDirections::All,
        &mut |path| Err(format!("{path} is not read here")),
        &mut sources,
        &mut diagnostics,
    );
    let mistakes = diagnostics.sorted();
    assert_eq!(compiled.is_err(), !mistakes.is_empty());
    let _ = render::render(&mistakes, &sources, render::Style::Plain);
});
