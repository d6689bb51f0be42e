//! One unit for comparable columns: those of one name, and those of one quantity.

use std::path::PathBuf;

use dgd_compiler::argument::Argument;
use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use dgd_compiler::sentence;
use dgd_compiler::units::{Dimension, Unit, convert};
use dgd_data::{DataColumn, DataTable};

/// Converts columns to the unit of the first column of their name, and those that measure the `same` quantity to that
/// of the first of them.
///
/// # Errors
///
/// A unit does not convert (E604), or a column has none where another one has (E609).
pub(crate) fn unify(
    tables: &mut [(PathBuf, DataTable)],
    same: &[[String; 2]],
    diagnostics: &mut Diagnostics,
) -> Result<(), ErrorReported> {
    // Copies without values, which may be long.
    let mut firsts: Vec<DataColumn> = Vec::new();
    for column in tables.iter().flat_map(|(_, table)| &table.columns) {
        if !firsts.iter().any(|first| first.name == column.name) {
            firsts.push(DataColumn {
                name: column.name.clone(),
                unit: column.unit.clone(),
                values: Vec::new(),
                place: column.place,
                fault: column.fault.clone(),
                missing: None,
                not_numbers: None,
            });
        }
    }
    // For each name, the name whose unit it takes.
    let mut leader: Vec<usize> = (0..firsts.len()).collect();
    for [one, other] in same {
        let position = |name: &String| firsts.iter().position(|first| first.name == *name);
        let (Some(one), Some(other)) = (position(one), position(other)) else { continue };
        let (to, from) = (leader[one], leader[other]);
        leader.iter_mut().filter(|leader| **leader == from).for_each(|leader| *leader = to);
    }
    let mut unified = Ok(());
    for column in tables.iter_mut().flat_map(|(_, table)| &mut table.columns) {
        let first = firsts.iter().position(|first| first.name == column.name);
        let Some(first) = first.map(|at| &firsts[leader[at]]) else { continue };
        if let Err(diagnostic) = to_unit_of(column, first) {
            unified = Err(diagnostics.error(*diagnostic));
        }
    }
    unified
}

/// Converts a column to the unit of another one.
fn to_unit_of(column: &mut DataColumn, first: &DataColumn) -> Result<(), Box<Diagnostic>> {
    let plain = |unit: &Unit| unit.dimension == Dimension::ONE && unit.factor == 1.0;
    match (&column.unit, &first.unit) {
        (None, None) => Ok(()),
        (Some(unit), None) | (None, Some(unit))
            if plain(unit) && column.fault.is_none() && first.fault.is_none() =>
        {
            column.unit.clone_from(&first.unit);
            Ok(())
        }
        (Some(from), Some(to)) if from.dimension == to.dimension => {
            if from.symbol != to.symbol {
                for value in &mut column.values {
                    *value = convert(*value, from, to);
                }
                column.unit = Some(to.clone());
            }
            Ok(())
        }
        (Some(from), Some(to)) => {
            let message = format!(
                "the column `{}` is in `{}`, which does not convert to `{}`",
                column.name, from.symbol, to.symbol
            );
            Err(Box::new(
                Diagnostic::new(Code::IncompatibleColumnUnit, column.place, message)
                    .label(first.place, format!("`{}` is in `{}` here", first.name, to.symbol))
                    .help(sentence![
                        "what is put side by side needs one kind of unit: screen them apart, or give a column another \
                         name by ",
                        Argument::Rename
                    ]),
            ))
        }
        (Some(unit), None) => Err(Box::new(without_unit(first, column, unit))),
        (None, Some(unit)) => Err(Box::new(without_unit(column, first, unit))),
    }
}

fn without_unit(column: &DataColumn, other: &DataColumn, unit: &Unit) -> Diagnostic {
    column.fault.clone().unwrap_or_else(|| {
        let message = format!("the column `{}` has no unit", column.name);
        Diagnostic::new(Code::MalformedHeader, column.place, message)
            .about(&column.name)
            .label(other.place, format!("`{}` is in `{}` here", other.name, unit.symbol))
            .help(format!("write `{} [{}]`", column.name, unit.symbol))
    })
}
