//! Points of tables from files: `table eta(q [lpm]) [1] from "eta.csv"`.
//!
//! A file has a header line, `q [lpm],eta [1]`, with a column for each argument and one for the table, in any order;
//! other columns are ignored. Lines that begin with `#` are remarks. Numbers keep their places, so that errors show
//! their rows.

use std::collections::BTreeSet;

use super::ast::{
    Ast, Expr, ExprKind, FormalArgument, ItemKind, Name, TablePoint, TablePoints, WrittenUnit,
};
use super::visit;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported, suggestion};
use crate::source::{SourceId, SourceMap, Span};

/// File extensions of tables.
pub(super) const ENDINGS: [&str; 2] = [".csv", ".csv.gz"];

/// A cell: its text without blanks and quotes around it, and its place.
#[derive(Debug, Clone, Copy)]
struct FileCell<'a> {
    text: &'a str,
    span: Span,
}

/// The points for a table in a file.
pub(super) fn points(
    item: &ItemKind,
    file: SourceId,
    sources: &SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<TablePoint>, ErrorReported> {
    let ItemKind::Table { name, arguments, .. } = item else {
        unreachable!("only tables have points")
    };
    let text = sources.get(file).text.as_str();
    let mut rows = rows(text, file);
    let Some((header, place)) = rows.next() else {
        let span = Span { source: file, start: 0, end: 0 };
        return Err(diagnostics.error(
            Diagnostic::new(Code::MalformedHeader, span, "the file has no header")
                .help(header_of(name, arguments)),
        ));
    };
    let columns = columns(name, arguments, &header, place, diagnostics)?;
    let mut points = Vec::new();
    let mut failed = None;
    for (cells, span) in rows {
        match point(&cells, span, header.len(), &columns, diagnostics) {
            Ok(point) => points.push(point),
            Err(reported) => failed = Some(reported),
        }
    }
    failed.map_or(Ok(()), Err)?;
    if points.is_empty() {
        let message = "the file has a header and no rows";
        return Err(diagnostics.error(Diagnostic::new(Code::NoRows, place, message)));
    }
    Ok(points)
}

/// Position and unit of each number of a point.
fn columns(
    name: &Name,
    arguments: &[FormalArgument],
    header: &[FileCell<'_>],
    place: Span,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<(usize, WrittenUnit)>, ErrorReported> {
    let mut columns = Vec::new();
    for wanted in arguments.iter().map(|a| &a.name).chain([name]) {
        let mut matching = header.iter().enumerate().filter(|(_, cell)| {
            cell.text.split('[').next().is_some_and(|own| own.trim() == wanted.text)
        });
        let Some((position, cell)) = matching.next() else {
            let names = header.iter().filter_map(|cell| cell.text.split('[').next());
            let near = suggestion(&wanted.text, names.map(str::trim));
            let help = near.map_or_else(
                || header_of(name, arguments),
                |near| format!("did you mean `{near}`? {}", header_of(name, arguments)),
            );
            let message = format!("the file has no column `{}`", wanted.text);
            return Err(diagnostics.error(
                Diagnostic::new(Code::InvalidTablePoints, place, message)
                    .about(&wanted.text)
                    .label(wanted.span, "the table needs it")
                    .help(help),
            ));
        };
        if let Some((_, again)) = matching.next() {
            let message = format!("two columns are called `{}`", wanted.text);
            return Err(diagnostics.error(
                Diagnostic::new(Code::MalformedHeader, again.span, message)
                    .label(cell.span, "first here"),
            ));
        }
        columns.push((position, unit_of(cell, diagnostics)?));
    }
    Ok(columns)
}

/// The unit between the brackets of a header.
fn unit_of(
    cell: &FileCell<'_>,
    diagnostics: &mut Diagnostics,
) -> Result<WrittenUnit, ErrorReported> {
    let inside = cell.text.split_once('[').and_then(|(_, rest)| rest.strip_suffix(']'));
    let Some(inside) = inside else {
        let message = format!("`{}` says no unit", cell.text);
        return Err(diagnostics.error(
            Diagnostic::new(Code::MalformedHeader, cell.span, message)
                .help("write it between brackets behind the name, `[1]` for plain numbers"),
        ));
    };
    Ok(WrittenUnit::new(cell.span, inside.trim()))
}

/// The expected header.
fn header_of(name: &Name, arguments: &[FormalArgument]) -> String {
    let names = arguments.iter().map(|argument| &argument.name).chain([name]);
    let columns: Vec<String> = names.map(|name| format!("{} [unit]", name.text)).collect();
    format!("the header is `{}`", columns.join(","))
}

fn point(
    cells: &[FileCell<'_>],
    span: Span,
    expected: usize,
    columns: &[(usize, WrittenUnit)],
    diagnostics: &mut Diagnostics,
) -> Result<TablePoint, ErrorReported> {
    if cells.len() != expected {
        let message = format!("this row has {} cells and the header {expected}", cells.len());
        return Err(diagnostics.error(Diagnostic::new(Code::RowLength, span, message)));
    }
    let mut numbers = Vec::with_capacity(columns.len());
    for (position, unit) in columns {
        let FileCell { text, span } = cells[*position];
        let Some(value) = text.parse::<f64>().ok().filter(|value| value.is_finite()) else {
            let message = if text.is_empty() {
                "a table has no gaps, and this cell is empty".to_owned()
            } else {
                format!("`{text}` is not a number")
            };
            return Err(diagnostics.error(
                Diagnostic::new(Code::NotANumber, span, message)
                    .help("decimals are separated by points; leave out rows without values"),
            ));
        };
        let (text, unit) = (text.to_owned(), Some(unit.clone()));
        numbers.push(Expr { span, kind: ExprKind::Number { value, text, unit } });
    }
    Ok(TablePoint { span, numbers })
}

/// Lines that are neither blank nor remarks, split at commas.
fn rows(text: &str, source: SourceId) -> impl Iterator<Item = (Vec<FileCell<'_>>, Span)> {
    let mut start = 0;
    text.split_inclusive('\n').filter_map(move |line| {
        let begin = start;
        start += line.len();
        let line = line.trim_end();
        let is_remark = line.is_empty() || line.starts_with('#');
        (!is_remark).then(|| {
            let span = place(source, begin, begin + line.len());
            let mut position = begin;
            let cells = line.split(',').map(|cell| {
                let cell_start = position;
                position += cell.len() + 1;
                let blank = |c: char| c.is_whitespace() || c == '"' || c == '\u{feff}';
                let text = cell.trim_matches(blank);
                let first = cell_start + (cell.len() - cell.trim_start_matches(blank).len());
                FileCell { text, span: place(source, first, first + text.len()) }
            });
            (cells.collect(), span)
        })
    })
}

fn place(source: SourceId, start: usize, end: usize) -> Span {
    let byte_position = |byte: usize| u32::try_from(byte).unwrap_or(u32::MAX);
    Span { source, start: byte_position(start), end: byte_position(end) }
}

/// The files of the tables in these trees.
pub fn files(asts: &[Ast]) -> BTreeSet<SourceId> {
    let mut files = BTreeSet::new();
    for ast in asts {
        visit::items(&ast.items, &mut |item| {
            if let ItemKind::Table {
                points: TablePoints::File { rows: Some(Ok(rows)), .. }, ..
            } = &item.kind
            {
                files.extend(rows.first().map(|row| row.span.source));
            }
        });
    }
    files
}

/// The points of a table that are read from a file.
pub(super) fn file_of(item: &mut ItemKind) -> Option<&mut TablePoints> {
    match item {
        ItemKind::Table { points: points @ TablePoints::File { .. }, .. } => Some(points),
        _ => None,
    }
}
