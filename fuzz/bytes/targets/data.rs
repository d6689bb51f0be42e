//! Arbitrary bytes as a recording: it is read or refused.
#![no_main]

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::source::SourceMap;
use dgd_data as data;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let table = data::read_from("d.csv", bytes, &mut sources, &mut diagnostics);
    assert_eq!(table.is_err(), !diagnostics.sorted().is_empty());
    if let Ok(table) = &table {
        for column in &table.columns {
            assert_eq!(column.values.len(), table.len());
        }
        let _ = table.recording(&mut diagnostics);
    }
    let _ = render::render(&diagnostics.sorted(), &sources, render::Style::Plain);
});
