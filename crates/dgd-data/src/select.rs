//! Selects the columns that a model reads, in SI units.
//!
//! A column is converted from the unit in its header to SI. If header and model name different references of a pressure
//! scale, the standard atmosphere is added or subtracted.

use std::borrow::Cow;
use std::collections::HashSet;

use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported, suggestion};
use dgd_compiler::source::Span;
use dgd_compiler::units::{Dimension, Unit, convert};

use crate::table::{DataColumn, DataTable, Replicate, SHOWN};

/// The declaration of an input, output or state in the model.
#[derive(Debug, Clone, Copy)]
pub struct DeclaredColumn<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its unit.
    pub unit: &'a Unit,
    /// Where it is declared, if that can be shown.
    pub place: Option<Span>,
}

/// The columns of a model's inputs, in the order of `declared` and in SI.
///
/// # Errors
///
/// An input has no column (E603), or one with missing values (E608), or one that cannot be read as declared (E604,
/// E607, E609), or differs among three or more rows at one time (E606).
pub fn inputs(
    table: &DataTable,
    declared: &[DeclaredColumn<'_>],
    diagnostics: &mut Diagnostics,
) -> Result<Vec<Vec<f64>>, ErrorReported> {
    inputs_with(table, declared, &[], GapPolicy::Refused, diagnostics)
}

/// Treatment of missing values of an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GapPolicy {
    /// They are a mistake.
    Refused,
    /// They are NaN.
    Kept,
}

/// [`inputs`], possibly with gaps. A column whose name is `known` is not taken for a misspelt input.
///
/// # Errors
///
/// Those of [`inputs`].
pub fn inputs_with(
    table: &DataTable,
    declared: &[DeclaredColumn<'_>],
    known: &[&str],
    gaps: GapPolicy,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<Vec<f64>>, ErrorReported> {
    let mut columns = Vec::with_capacity(declared.len());
    let mut reported = Ok(());
    for input in declared {
        let Some(column) = table.column(input.name) else {
            reported = Err(diagnostics.error(no_column(table, input, known)));
            continue;
        };
        match converted(column, input) {
            Ok(values) => {
                if let Some(diagnostic) = differing_replicate(table, input.name, &values) {
                    reported = Err(diagnostics.error(diagnostic));
                }
                columns.push(values);
            }
            Err(diagnostic) => reported = Err(diagnostics.error(diagnostic)),
        }
        if gaps == GapPolicy::Refused
            && let Some(missing) = &column.missing
        {
            let nowhere = missing.count == table.len();
            let place = if nowhere { "in any row" } else { "here" };
            let message = format!("the input `{}` has no value {place}", input.name);
            let diagnostic = missing
                .diagnostic(Code::MissingInputValue, message)
                .help("an input is needed at every time: fill the gap, or cut the recording");
            reported = Err(diagnostics.error(diagnostic));
        }
    }
    reported.map(|()| columns)
}

/// The first replicate whose value of an input differs from that of the first row at its time.
fn differing_replicate(table: &DataTable, name: &str, values: &[f64]) -> Option<Diagnostic> {
    // Missing values are reported separately.
    let differs = |a: f64, b: f64| a != b && !a.is_nan() && !b.is_nan();
    let replicate = table.replicates.iter().find(|replicate| {
        let Replicate { row, first, .. } = **replicate;
        values[first..=row].iter().any(|value| differs(*value, values[first]))
    })?;
    let message = format!(
        "three rows or more have the time `{}` and differ in the input `{name}`",
        replicate.time.text
    );
    Some(replicate.time.diagnostic(Code::DifferingReplicates, message).help(
        "two rows with one time are the left and right values of a jump; more of them are replicates, \
         which agree in all inputs",
    ))
}

/// The columns of outputs that may have been measured, in the order of `declared` and in SI; `None` without a column.
/// NaN marks missing values.
///
/// # Errors
///
/// A column cannot be read as declared (E604, E607, E609).
pub fn measured(
    table: &DataTable,
    declared: &[DeclaredColumn<'_>],
    diagnostics: &mut Diagnostics,
) -> Result<Vec<Option<Vec<f64>>>, ErrorReported> {
    let read = |output: &DeclaredColumn<'_>| {
        table.column(output.name).map(|column| converted(column, output)).transpose()
    };
    of_each(declared, read, diagnostics)
}

/// The result of `read` for each output, or all mistakes.
fn of_each<T>(
    declared: &[DeclaredColumn<'_>],
    read: impl Fn(&DeclaredColumn<'_>) -> Result<T, Diagnostic>,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<T>, ErrorReported> {
    let mut columns = Vec::with_capacity(declared.len());
    let mut reported = Ok(());
    for output in declared {
        match read(output) {
            Ok(values) => columns.push(values),
            Err(diagnostic) => reported = Err(diagnostics.error(diagnostic)),
        }
    }
    reported.map(|()| columns)
}

/// The name of the column with an output's standard deviations.
pub fn deviation(output: &str) -> String {
    format!("std({output})")
}

/// The columns of the standard deviations of outputs, in the order of `declared` and in SI; `None` without a column.
/// NaN marks missing values.
///
/// # Errors
///
/// A column cannot be read as declared (E604, E607, E609).
pub fn deviations(
    table: &DataTable,
    declared: &[DeclaredColumn<'_>],
    diagnostics: &mut Diagnostics,
) -> Result<Vec<Option<Vec<f64>>>, ErrorReported> {
    let read = |output: &DeclaredColumn<'_>| {
        let Some(column) = table.column(&deviation(output.name)) else { return Ok(None) };
        // Differences have no offset: 0.5 °C is half a kelvin.
        let factor = verify(column, output)?.map_or(1.0, |unit| unit.factor);
        Ok(Some(column.values.iter().map(|value| value * factor).collect()))
    };
    of_each(declared, read, diagnostics)
}

/// The columns whose names are not among `known`, in the order of the file.
pub fn unknown<'t>(table: &'t DataTable, known: &[&str]) -> Vec<&'t DataColumn> {
    let known: HashSet<&str> = known.iter().copied().collect();
    table.columns.iter().filter(|column| !known.contains(column.name.as_str())).collect()
}

/// Most columns listed by name; beyond that only their number is given.
const NAMED: usize = 8;

/// A note on the columns that are not among `known`: they are not used.
pub fn unknown_note(table: &DataTable, known: &[&str]) -> Option<Diagnostic> {
    let unknown = unknown(table, known);
    let (first, others) = unknown.split_first()?;
    let named = if unknown.len() > NAMED + 1 { NAMED } else { unknown.len() };
    let names: Vec<_> =
        unknown.iter().take(named).map(|column| format!("`{}`", shortened(&column.name))).collect();
    let names = names.join(", ");
    let message = match unknown.len() - named {
        0 if others.is_empty() => {
            format!("the model does not know the column {names}, which is not used")
        }
        0 => format!("the model does not know the columns {names}, which are not used"),
        more => {
            format!(
                "the model does not know the columns {names} and {more} more, which are not used"
            )
        }
    };
    let mut note = Diagnostic::new(Code::UnknownColumn, first.place, message);
    for column in &others[..named - 1] {
        note = note.label(column.place, "");
    }
    // Only names without a column can have been meant.
    let there: HashSet<&str> = table.columns.iter().map(|column| column.name.as_str()).collect();
    let absent: Vec<&str> = known.iter().copied().filter(|name| !there.contains(name)).collect();
    let meant = unknown
        .iter()
        .find_map(|column| Some((column, suggestion(&column.name, absent.iter().copied())?)));
    Some(match meant {
        Some((column, name)) => note.help(format!("is `{}` meant to be `{name}`?", column.name)),
        None => note,
    })
}

/// A name, shortened for a message.
fn shortened(name: &str) -> Cow<'_, str> {
    match name.char_indices().nth(SHOWN) {
        Some((end, _)) => Cow::Owned(format!("{}…", &name[..end])),
        None => Cow::Borrowed(name),
    }
}

fn no_column(table: &DataTable, input: &DeclaredColumn<'_>, known: &[&str]) -> Diagnostic {
    let message = format!("there is no column for the input `{}`", input.name);
    let mut diagnostic = Diagnostic::new(Code::NoInputColumn, table.header, message);
    if let Some(place) = input.place {
        diagnostic = diagnostic.label(place, "declared here");
    }
    let names = unknown(table, known).into_iter().map(|column| column.name.as_str());
    diagnostic.help(match suggestion(input.name, names) {
        Some(name) => format!("is the column `{name}` meant to be `{}`?", input.name),
        None => format!("add a column `{} [{}]`", input.name, input.unit.symbol),
    })
}

/// The values of a column in SI, in the model's convention.
pub fn converted(
    column: &DataColumn,
    declared: &DeclaredColumn<'_>,
) -> Result<Vec<f64>, Diagnostic> {
    let Some(unit) = verify(column, declared)? else {
        return Ok(column.values.clone());
    };
    // The model's convention: SI, relative to the zero of the declared unit.
    let si = Unit { factor: 1.0, offset: 0.0, ..declared.unit.clone() };
    Ok(column.values.iter().map(|&value| convert(value, unit, &si)).collect())
}

/// The unit of a column that can be read as declared; `None` if both are plain numbers.
fn verify<'c>(
    column: &'c DataColumn,
    declared: &DeclaredColumn<'_>,
) -> Result<Option<&'c Unit>, Diagnostic> {
    if let Some(fault) = &column.fault {
        return Err(fault.clone());
    }
    let unit = match &column.unit {
        Some(unit) if unit.dimension == declared.unit.dimension => Some(unit),
        Some(unit) => {
            let message = format!(
                "the column `{}` is in `{}`, which does not convert to `{}`",
                column.name, unit.symbol, declared.unit.symbol
            );
            let mut diagnostic =
                Diagnostic::new(Code::IncompatibleColumnUnit, column.place, message);
            if let Some(place) = declared.place {
                let text = format!("declared in `{}`", declared.unit.symbol);
                diagnostic = diagnostic.label(place, text);
            }
            return Err(diagnostic);
        }
        // A plain number must be declared as one: 53 might be per cent or a factor.
        None if declared.unit.dimension == Dimension::ONE && declared.unit.factor == 1.0 => None,
        None => {
            let message = format!("the column `{}` has no unit", column.name);
            return Err(Diagnostic::new(Code::MalformedHeader, column.place, message)
                .about(&column.name)
                .help(format!("write `{} [{}]`", column.name, declared.unit.symbol)));
        }
    };
    if let Some(cells) = &column.not_numbers {
        let diagnostic =
            cells.diagnostic(Code::NotANumber, format!("`{}` is not a number", cells.text));
        let decimal_comma = cells.text.contains(',');
        return Err(
            diagnostic.maybe_help(decimal_comma.then(|| "write decimals with a point".to_owned()))
        );
    }
    Ok(unit)
}
