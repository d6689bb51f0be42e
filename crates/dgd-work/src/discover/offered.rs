//! Recorded columns that the model does not read: each may act in an equation.
//!
//! During a search they are declared as inputs. The declarations that no term reads are removed afterwards.

use std::collections::BTreeSet;

use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::CompiledStages;
use dgd_compiler::syntax::ast::{Ast, ItemKind};
use dgd_compiler::syntax::{layout, visit};
use dgd_data::{DataColumn, DataTable, FileSystem, ReadOptions};

use super::{base_model, directions, folders};
use crate::error::WorkError;
use crate::model::Compilation;
use crate::model::effects::load_folder;
use crate::request::DiscoverRequest;

/// The recorded columns that a search can use.
#[derive(Debug, Default)]
pub(super) struct OfferedColumns {
    /// The names of the columns that all recordings have; none if no effect can use one that the model does not read.
    pub(super) columns: Option<Vec<String>>,
    /// Declarations of those that the model does not declare.
    pub(super) inputs: Vec<OfferedInput>,
}

/// An input that the model does not declare.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct OfferedInput {
    pub(super) name: String,
    /// Its line in a model.
    line: String,
}

/// Reads the columns of the recordings of a request. Faults of a model or a file are reported when it is read next; so
/// is a file that can be read only once.
pub(super) fn offered(request: &DiscoverRequest, files: &dyn FileSystem) -> OfferedColumns {
    let paths: Vec<_> = request.data.iter().chain(&request.valid).collect();
    if !paths.iter().all(|path| files.is_file(path)) {
        return OfferedColumns::default();
    }
    let mut probe = Compilation::new(files);
    let Ok(options) = probe.options(&request.choices) else { return OfferedColumns::default() };
    let options = ModelOptions { columns: Some(Vec::new()), ..options };
    let Ok(compiled) = base_model(request, &options, &mut probe) else {
        return OfferedColumns::default();
    };
    let is_read = |name: &str| compiled.dae.inputs.iter().any(|i| i.declared.name == name);
    let has_unread = compiled.asts[0]
        .items
        .iter()
        .any(|item| matches!(&item.kind, ItemKind::Input { name, .. } if !is_read(&name.text)));
    let mut tables: Vec<DataTable> = Vec::new();
    for path in paths {
        let Compilation { sources, diagnostics, .. } = &mut probe;
        let reading = ReadOptions::default().renamed(&request.solve.rename);
        match reading.read(files, path, sources, diagnostics) {
            Ok(table) => tables.push(table),
            Err(_) => return OfferedColumns::default(),
        }
    }
    let Some((first, others)) = tables.split_first() else { return OfferedColumns::default() };
    let common: Vec<&DataColumn> = (first.columns.iter())
        .filter(|column| others.iter().all(|table| table.column(&column.name).is_some()))
        .collect();
    let text = &probe.sources.get(compiled.asts[0].source).text;
    let mut known = words(text);
    let of_effects = declared_by_effects(request, files);
    known.extend(of_effects.iter().map(String::as_str));
    let is_offered = |column: &&&DataColumn| {
        let of_all: Vec<&DataColumn> =
            tables.iter().filter_map(|table| table.column(&column.name)).collect();
        !known.contains(column.name.as_str()) && is_signal(&of_all, request.data.len())
    };
    let mut inputs: Vec<OfferedInput> =
        common.iter().filter(is_offered).map(|column| OfferedInput::from_column(column)).collect();
    let compiles = |inputs: &[OfferedInput]| {
        let mut trial = Compilation::new(files);
        let Ok(options) = trial.options(&request.choices) else { return false };
        let compiled = base_model(request, &options, &mut trial);
        compiled
            .and_then(|compiled| with_inputs(compiled, inputs, request, &options, &mut trial))
            .is_ok()
    };
    // A header may not be a name, or may be a reserved word.
    if !compiles(&inputs) {
        inputs.retain(|own| compiles(std::slice::from_ref(own)));
    }
    let columns = common.iter().map(|column| column.name.clone()).collect();
    OfferedColumns { columns: (has_unread || !inputs.is_empty()).then_some(columns), inputs }
}

/// The names that effects of the library declare; the model must not use them.
fn declared_by_effects(request: &DiscoverRequest, files: &dyn FileSystem) -> BTreeSet<String> {
    let mut probe = Compilation::new(files);
    let mut names = BTreeSet::new();
    for folder in folders(request, files) {
        let Compilation { sources, diagnostics, .. } = &mut probe;
        for effect in load_folder(files, &folder, sources, diagnostics).into_iter().flatten() {
            visit::items(&effect.ast.items, &mut |item| {
                names.extend(item.kind.value_name().map(|name| name.text.clone()));
            });
        }
    }
    names
}

/// Whether a column has no missing values, and varies in the training recordings.
fn is_signal(of_all: &[&DataColumn], training: usize) -> bool {
    let is_whole = |column: &&DataColumn| {
        column.fault.is_none() && column.values.iter().all(|value| value.is_finite())
    };
    let moves = |column: &&DataColumn| column.values.windows(2).any(|pair| pair[0] != pair[1]);
    of_all.iter().all(is_whole) && of_all[..training.min(of_all.len())].iter().any(moves)
}

impl OfferedInput {
    fn from_column(column: &DataColumn) -> Self {
        let unit = column.unit.as_ref().map_or("1", |unit| &unit.symbol);
        let kind = if column.is_held() { "hold" } else { "linear" };
        Self { name: column.name.clone(), line: format!("input {} [{unit}] {kind}", column.name) }
    }
}

/// A model with further inputs in its text.
pub(super) fn with_inputs(
    compiled: CompiledStages,
    inputs: &[OfferedInput],
    request: &DiscoverRequest,
    options: &ModelOptions,
    compilation: &mut Compilation<'_>,
) -> Result<CompiledStages, WorkError> {
    if inputs.is_empty() {
        return Ok(compiled);
    }
    let ast = &compiled.asts[0];
    let text = with(ast, &compilation.sources.get(ast.source).text, inputs);
    let text = layout::like(ast.source, &compilation.sources, text);
    let directions = directions(request, compilation);
    let compiled = compilation.compile_source(&request.model, text, options, &directions);
    compiled
        .map_err(|_| WorkError::diagnosed(&compilation.diagnostics, compilation.sources.clone()))
}

/// The text of a model with declarations added after its inputs, or after its first line.
fn with(ast: &Ast, text: &str, declarations: &[OfferedInput]) -> String {
    let header = ast.model.as_ref().map_or(0, |header| header.name.span.end);
    // Declarations inside a variant belong to one choice only.
    let inputs = ast.items.iter().filter(|item| matches!(item.kind, ItemKind::Input { .. }));
    let after = inputs.map(|item| item.span.end).fold(header, u32::max) as usize;
    let line_end = text[after..].find('\n').map_or(text.len(), |at| after + at);
    let lines: Vec<&str> = declarations.iter().map(|own| own.line.as_str()).collect();
    format!("{}\n{}{}", &text[..line_end], lines.join("\n"), &text[line_end..])
}

/// The text of a model without those declarations that nothing in it reads, whatever its layout.
pub(super) fn without_unread(text: &str, declarations: &[OfferedInput]) -> String {
    let is_of = |line: &str, own: &OfferedInput| {
        let mut words = line.split_whitespace();
        words.next() == Some("input") && words.next() == Some(own.name.as_str())
    };
    let unread = |own: &&OfferedInput| {
        let others: String =
            text.lines().filter(|line| !is_of(line, own)).flat_map(|line| [line, "\n"]).collect();
        !words(&others).contains(own.name.as_str())
    };
    let unread: Vec<&OfferedInput> = declarations.iter().filter(unread).collect();
    let kept = |line: &&str| !unread.iter().any(|own| is_of(line, own));
    text.split_inclusive('\n').filter(kept).collect()
}

/// The names in a text, comments left out.
fn words(text: &str) -> BTreeSet<&str> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let code = text.lines().map(|line| {
        let end = ["//", "#"].iter().filter_map(|mark| line.find(mark)).min();
        &line[..end.unwrap_or(line.len())]
    });
    code.flat_map(|line| line.split(move |c| !is_part(c))).filter(|word| !word.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn declaration(name: &str) -> OfferedInput {
        OfferedInput { name: name.to_owned(), line: format!("input {name} [1] hold") }
    }

    #[test]
    fn words_of_comments_are_none() {
        let words = words("input P [W] hold # not G\n/// the sun S\nlet a_1 = 2*b\n");
        assert!(["input", "P", "W", "a_1", "b"].iter().all(|word| words.contains(word)));
        assert!(!words.contains("G") && !words.contains("S"));
    }

    #[test]
    fn what_nothing_reads_leaves_the_text() {
        let text = "model m\ninput u [1]\ninput  v  [1] hold\ninput w [1] hold\n\nequation a: der(x) = u + w\n";
        let stripped = without_unread(text, &[declaration("v"), declaration("w")]);
        assert_eq!(stripped, text.replace("input  v  [1] hold\n", ""));
    }
}
