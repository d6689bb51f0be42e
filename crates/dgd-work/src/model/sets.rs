//! Sets of parameters and initial values: one for each row of a table.

use std::path::Path;

use dgd_compiler::dae::Dae;
use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported, suggestion};
use dgd_compiler::source::SourceMap;
use dgd_data::{DataTable, FileSystem, ReadOptions, Sha256Digest, select};

/// One set, SI.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ParameterSet {
    /// All parameters; those of the model if the table has none.
    pub p: Vec<f64>,
    /// Initial values that replace the model's, by index of the unknown.
    pub start: Vec<(usize, f64)>,
}

/// The sets of a table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ParameterSets {
    pub(crate) all: Vec<ParameterSet>,
    /// Digest of the file.
    pub(crate) digest: Option<Sha256Digest>,
}

/// Reads sets; columns are parameters, and states for their initial values. An empty cell keeps the value of the model.
pub(crate) fn read(
    files: &dyn FileSystem,
    path: &Path,
    dae: &Dae,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<ParameterSets, ErrorReported> {
    let table = ReadOptions::default().read(files, path, sources, diagnostics)?;
    let parameters = dae.parameters.iter().map(|parameter| select::DeclaredColumn {
        name: &parameter.declared.name,
        unit: &parameter.declared.unit,
        place: Some(parameter.declared.span),
    });
    let unknowns = dae.unknowns.iter().map(|unknown| select::DeclaredColumn {
        name: &unknown.name,
        unit: &unknown.unit,
        place: None,
    });
    let known: Vec<select::DeclaredColumn<'_>> = parameters.chain(unknowns).collect();
    let named = verify_names(&table, &known, diagnostics);
    let columns = select::measured(&table, &known, diagnostics);
    named?;
    let columns = columns?;
    let (of_parameters, of_states) = columns.split_at(dae.parameters.len());
    let value = |column: &Option<Vec<f64>>, row: usize| {
        column.as_ref().map(|values| values[row]).filter(|value| !value.is_nan())
    };
    let set = |row: usize| ParameterSet {
        p: (dae.parameters.iter().zip(of_parameters))
            .map(|(parameter, column)| value(column, row).unwrap_or(parameter.value))
            .collect(),
        start: (of_states.iter().enumerate())
            .filter_map(|(i, column)| Some((i, value(column, row)?)))
            .collect(),
    };
    Ok(ParameterSets { all: (0..table.len()).map(set).collect(), digest: table.digest })
}

/// Reports columns that are neither a parameter nor a state.
fn verify_names(
    table: &DataTable,
    known: &[select::DeclaredColumn<'_>],
    diagnostics: &mut Diagnostics,
) -> Result<(), ErrorReported> {
    let mut verified = Ok(());
    if table.time.is_some() {
        let message = "a set of parameters has no time";
        verified = Err(diagnostics.error(
            Diagnostic::new(Code::UnknownSetColumn, table.header, message)
                .help("each row is a set, and all of them are run over the same times"),
        ));
    }
    let names: Vec<&str> = known.iter().map(|declared| declared.name).collect();
    for column in select::unknown(table, &names) {
        let message = format!("`{}` is neither a parameter nor a state", column.name);
        let absent = names.iter().copied().filter(|name| table.column(name).is_none());
        let meant = suggestion(&column.name, absent)
            .map(|name| format!("is `{}` meant to be `{name}`?", column.name));
        let diagnostic =
            Diagnostic::new(Code::UnknownSetColumn, column.place, message).maybe_help(meant);
        verified = Err(diagnostics.error(diagnostic));
    }
    verified
}
