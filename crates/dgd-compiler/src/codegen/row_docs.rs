//! The comments above the rows of the right-hand side.

use dgd_signature::arrays::{Array, Family};

use crate::program::{Program, UnknownRow};
use crate::source::SourceMap;

/// The comment above the row of an unknown or an element.
pub(super) fn doc_of_row(program: &Program, row: usize, sources: &SourceMap) -> String {
    match program.source.rows.get(row) {
        Some(own) => row_doc(program, row, *own, sources),
        None => family_doc(program, row, false, sources),
    }
}

/// The comment above a row: its equation, its source position and its left side.
fn row_doc(program: &Program, row: usize, own: UnknownRow, sources: &SourceMap) -> String {
    let (line, _) = sources.line_column(own.span);
    let unknown = &program.signature.unknowns.single[row];
    let left = match (own.by_mode, unknown.differential) {
        (true, _) => format!("0 or der({})", unknown.name),
        (false, true) => format!("der({})", unknown.name),
        (false, false) => "0".to_owned(),
    };
    let file = &sources.get(own.span.source).name;
    format!(" `{}` ({file}:{line}): {left} =", program.signature.equations.get(row))
}

/// The comment above the rows of elements; for rounds, without the first index.
pub(super) fn family_doc(
    program: &Program,
    row: usize,
    in_rounds: bool,
    sources: &SourceMap,
) -> String {
    let unknowns = &program.signature.unknowns;
    let mut rows = unknowns.families.iter().zip(&program.source.families);
    let mut before = unknowns.single.len();
    let equation_of_row = rows.find(|(family, _)| {
        before += family.count;
        row < before
    });
    let Some((Family { equation, differential, .. }, span)) = equation_of_row else {
        return String::new();
    };
    let name = array_of(&unknowns.arrays, row - unknowns.single.len());
    let shown = |name| if in_rounds { without_indices(name) } else { name };
    let (equation, name) = (shown(equation), shown(name));
    let (line, _) = sources.line_column(*span);
    let file = &sources.get(span.source).name;
    let left = if *differential { format!("der({name})") } else { "0".to_owned() };
    format!(" `{equation}` ({file}:{line}): {left} =")
}

/// `T` of `T[2][1]`.
fn without_indices(mut name: &str) -> &str {
    while let Some((array, _)) = name.strip_suffix(']').and_then(|name| name.rsplit_once('[')) {
        name = array;
    }
    name
}

/// The name of the array that has an element, counted over all of them.
fn array_of(arrays: &[Array], element: usize) -> &str {
    let mut before = 0;
    let holder = arrays.iter().find(|array| {
        before += array.count;
        element < before
    });
    holder.map_or("", |array| &array.name)
}
