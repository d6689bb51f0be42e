//! The header line: `name [unit]` in every cell.

use std::collections::BTreeMap;
use std::ops::Range;

use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use dgd_compiler::source::{SourceMap, Span};
use dgd_compiler::units::{Unit, parse_unit, read_unit};

use crate::cell::quoted;
use crate::csv::kept::ShownText;
use crate::csv::records::CsvRecord;
use crate::table::DataColumn;

/// The header line of a file.
pub(crate) struct CsvHeader {
    /// Its range in the text.
    pub(crate) place: Range<usize>,
    pub(crate) cells: Vec<HeaderCell>,
    open_quote: bool,
}

/// A cell of a header line.
pub(crate) struct HeaderCell {
    /// Its text in the file.
    pub(crate) text: String,
    /// Its range in the text.
    pub(crate) place: Range<usize>,
    /// Another name for the column.
    pub(crate) renamed: Option<ColumnRename>,
}

/// Another name for a column, which replaces that of the header.
pub(crate) struct ColumnRename {
    pub(crate) name: String,
    /// Replaces the unit of the file, if any.
    pub(crate) unit: Option<Unit>,
}

impl CsvHeader {
    /// From names in one line, in the format of [`line`](Self::line).
    pub(crate) fn named<'n>(names: impl IntoIterator<Item = &'n str>) -> CsvHeader {
        let mut position = 0;
        let cell = |text: &str| {
            let end = position + quoted(text).len();
            let place = position..end;
            position = end + 1;
            HeaderCell { text: text.to_owned(), place, renamed: None }
        };
        let cells: Vec<HeaderCell> = names.into_iter().map(cell).collect();
        let end = cells.last().map_or(0, |cell| cell.place.end);
        CsvHeader { place: 0..end, cells, open_quote: false }
    }

    /// These names in one line.
    pub(crate) fn line<'n>(names: impl IntoIterator<Item = &'n str>) -> String {
        names.into_iter().map(quoted).collect::<Vec<_>>().join(",")
    }

    pub(crate) fn from_record(record: &CsvRecord<'_>) -> CsvHeader {
        let cells = (0..record.len()).map(|cell| HeaderCell {
            text: record.text(cell),
            place: record.place(cell),
            renamed: None,
        });
        CsvHeader {
            place: record.place_from(0),
            cells: cells.collect(),
            open_quote: record.open_quote,
        }
    }

    /// The columns, without values.
    pub(crate) fn columns(&self, kept: ShownText, sources: &SourceMap) -> Vec<DataColumn> {
        let mut columns: Vec<DataColumn> = Vec::with_capacity(self.cells.len());
        for cell in &self.cells {
            let place = kept.span(&cell.place);
            let parsed = parse(&cell.text);
            let new = cell.renamed.as_ref();
            let (mut unit, mut fault) = (new.and_then(|new| new.unit.clone()), None);
            if unit.is_none() {
                fault = parsed.fault.map(|fault| {
                    Diagnostic::new(
                        Code::MalformedHeader,
                        place,
                        format!("malformed column header: {fault}"),
                    )
                    .help("a column is headed `name [unit]`")
                });
                match parsed.unit.map(|unit| unit_at(unit, place, sources)).transpose() {
                    Ok(read) => unit = read,
                    Err(diagnostic) => fault = Some(*diagnostic),
                }
            }
            columns.push(DataColumn {
                name: new.map_or(parsed.name, |new| &new.name).to_owned(),
                unit,
                values: Vec::new(),
                place,
                fault,
                missing: None,
                not_numbers: None,
            });
        }
        let mut first_of: BTreeMap<&str, usize> = BTreeMap::new();
        let mut twice = Vec::new();
        for (at, column) in columns.iter().enumerate() {
            let first = *first_of.entry(&column.name).or_insert(at);
            if first != at {
                let message = format!("two columns are called `{}`", column.name);
                let diagnostic = Diagnostic::new(Code::MalformedHeader, column.place, message)
                    .label(columns[first].place, "the first of them");
                twice.push((first, diagnostic));
            }
        }
        // Lookup by name finds the first one.
        for (first, diagnostic) in twice {
            columns[first].fault.get_or_insert(diagnostic);
        }
        columns
    }

    /// Reports mistakes that invalidate the whole file.
    pub(crate) fn verify(
        &self,
        columns: &[DataColumn],
        kept: ShownText,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let HeaderCell { text: first, place: first_place, .. } = &self.cells[0];
        if self.open_quote {
            let place = self.cells.last().map_or(&self.place, |cell| &cell.place);
            let message = "a quoted cell is not closed";
            return Err(diagnostics.error(Diagnostic::new(
                Code::MalformedHeader,
                kept.span(place),
                message,
            )));
        }
        let separator = [(';', "semicolons"), ('\t', "tabs")]
            .into_iter()
            .find(|(separator, _)| self.cells.len() == 1 && first.contains(*separator));
        if let Some((_, name)) = separator {
            let message = format!("the columns are separated by {name}");
            let place = kept.span(first_place);
            return Err(diagnostics.error(
                Diagnostic::new(Code::MalformedHeader, place, message)
                    .help("separate them by commas, and write decimals with a point"),
            ));
        }
        let time = columns.iter().position(|column| column.name == "time");
        match time {
            None | Some(0) => Ok(()),
            Some(at) => {
                let message = "the time is not in the first column";
                Err(diagnostics.error(
                    Diagnostic::new(Code::MalformedHeader, columns[at].place, message)
                        .help("move `time` to the front"),
                ))
            }
        }
    }
}

/// Uses a first column called `t` or `Time` as the time if there is no `time`, and returns a note.
///
/// A `t` without a unit counts seconds.
pub(crate) fn take_as_time(columns: &mut [DataColumn]) -> Option<Diagnostic> {
    if columns.iter().any(|column| column.name == "time") {
        return None;
    }
    let first = columns.first_mut()?;
    let is_short = first.name == "t";
    if !is_short && !first.name.eq_ignore_ascii_case("time") {
        return None;
    }
    let name = std::mem::replace(&mut first.name, "time".to_owned());
    let mut message = format!("the column `{name}` is taken as the time");
    if is_short && first.unit.is_none() && first.fault.is_none() {
        first.unit = parse_unit("s").ok();
        message.push_str(", in seconds");
    }
    Some(Diagnostic::new(Code::NoTimeColumn, first.place, message))
}

/// A parsed header cell.
#[derive(Debug, PartialEq)]
pub(crate) struct ParsedHeaderCell<'a> {
    /// The name; for a malformed cell, the text at its place.
    pub(crate) name: &'a str,
    /// The text between the brackets.
    pub(crate) unit: Option<&'a str>,
    /// The syntax error, if any.
    pub(crate) fault: Option<&'static str>,
}

/// The unit at the end of the text in this span.
pub(crate) fn unit_at(
    text: &str,
    place: Span,
    sources: &SourceMap,
) -> Result<Unit, Box<Diagnostic>> {
    // The last bracket opens the unit; earlier ones belong to the name.
    let bracket = sources.text(place).rfind('[').unwrap_or_default() as u32;
    let span = Span { start: place.start + bracket, ..place };
    read_unit(text, span, sources)
}

/// Parses a header cell.
///
/// As in a model, brackets directly after a name with numbers only are an index, `p[1]`, and belong to the name.
pub(crate) fn parse(cell: &str) -> ParsedHeaderCell<'_> {
    let cell = cell.trim();
    let plain = |name| ParsedHeaderCell { name, unit: None, fault: None };
    let broken = |name, fault| ParsedHeaderCell { name, unit: None, fault: Some(fault) };
    if cell.is_empty() {
        return broken(cell, "this column has no name");
    }
    let (open, close) = (cell.matches('[').count(), cell.matches(']').count());
    if open != close {
        let fault = if open > close { "a `[` is not closed" } else { "a `]` was not opened" };
        let name = cell.split(['[', ']']).next().unwrap_or(cell).trim_end();
        return broken(name, fault);
    }
    let Some((name, inside)) = cell.strip_suffix(']').and_then(|rest| rest.rsplit_once('[')) else {
        return match cell.split_once(" [") {
            Some((name, _)) => broken(name.trim_end(), "text after the unit"),
            None => plain(cell),
        };
    };
    let is_number = |text: &str| {
        let text = text.trim();
        !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
    };
    if !name.is_empty() && !name.ends_with(char::is_whitespace) && inside.split(',').all(is_number)
    {
        return plain(cell);
    }
    match (name.trim_end(), inside.trim()) {
        (name @ "", _) => broken(name, "this column has no name"),
        (name, "") => broken(name, "the brackets are empty"),
        (name, unit) if unit.contains(']') => broken(name, "brackets inside brackets"),
        (name, unit) => ParsedHeaderCell { name, unit: Some(unit), fault: None },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_and_its_unit() {
        for (cell, name, unit) in [
            ("q_boost [lpm]", "q_boost", Some("lpm")),
            ("q[lpm]", "q", Some("lpm")),
            ("  T  [ degC ]", "T", Some("degC")),
            ("ratio [1]", "ratio", Some("1")),
            ("ratio", "ratio", None),
            ("p[1] [bar]", "p[1]", Some("bar")),
            ("p[12]", "p[12]", None),
            ("p[1, 2]", "p[1, 2]", None),
            ("d(h_r)/d(c0) [m/m]", "d(h_r)/d(c0)", Some("m/m")),
            ("d(p[3])/d(c0)", "d(p[3])/d(c0)", None),
            ("bit depth (m)", "bit depth (m)", None),
        ] {
            assert_eq!(parse(cell), ParsedHeaderCell { name, unit, fault: None }, "{cell}");
        }
    }

    #[test]
    fn a_first_column_called_t_or_time_is_the_time() {
        let column = |name: &str, unit: Option<&str>| DataColumn {
            name: name.to_owned(),
            unit: unit.and_then(|unit| parse_unit(unit).ok()),
            values: Vec::new(),
            place: Span::default(),
            fault: None,
            missing: None,
            not_numbers: None,
        };
        for (name, unit, told) in [
            ("t", None, Some("the column `t` is taken as the time, in seconds")),
            ("t", Some("h"), Some("the column `t` is taken as the time")),
            ("Time", Some("s"), Some("the column `Time` is taken as the time")),
            ("T", Some("K"), None),
            ("time", Some("s"), None),
        ] {
            let mut columns = [column(name, unit), column("x", None)];
            let note = take_as_time(&mut columns);
            assert_eq!(note.as_ref().map(|note| note.message.as_str()), told, "{name}");
            assert_eq!(columns[0].name == "time", told.is_some() || name == "time");
        }
        // A column called `time` takes precedence, wherever it is.
        let mut columns = [column("t", None), column("time", Some("s"))];
        assert!(take_as_time(&mut columns).is_none());
    }

    #[test]
    fn malformed_cells_keep_a_name_to_be_found_by() {
        for (cell, name) in [
            ("", ""),
            ("[lpm]", ""),
            ("q []", "q"),
            ("q [lpm", "q"),
            ("q lpm]", "q lpm"),
            ("q [lpm] raw", "q"),
            ("q [l]pm]]x[", "q"),
        ] {
            let header = parse(cell);
            assert_eq!((header.name, header.unit), (name, None), "{cell}");
            assert!(header.fault.is_some(), "{cell}");
        }
    }
}
