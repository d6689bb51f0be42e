//! Reads columns of numbers into a [`DataTable`]: the counterpart of [`rows`](super::rows) without text.

use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use dgd_compiler::source::{SourceMap, SourceText};
use sha2::{Digest, Sha256};

use crate::columns::DataColumns;
use crate::csv::header::CsvHeader;
use crate::csv::kept::ShownText;
use crate::csv::rows::CsvRows;
use crate::read::ReadOptions;
use crate::sha256::Sha256Digest;
use crate::table::DataTable;

/// Reads columns like a file with this name.
pub(crate) fn read(
    columns: &DataColumns,
    name: &str,
    reading: ReadOptions<'_>,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<DataTable, ErrorReported> {
    let source = sources.add(SourceText { name: name.to_owned(), text: columns.headers() });
    let kept = ShownText { source, whole: false };
    let mut header = CsvHeader::named(columns.names());
    if let Err(diagnostic) = verify(columns, &header, kept) {
        return Err(diagnostics.error(*diagnostic));
    }
    header.rename(reading.renames, kept, sources, diagnostics)?;
    let mut rows = CsvRows::below(&header, reading, kept, sources, diagnostics)?;
    rows.take_columns(&columns.all);
    let mut table = rows.finish(diagnostics)?;
    table.digest = Some(digest(columns));
    Ok(table)
}

/// Checks that there are columns of equal lengths.
fn verify(
    columns: &DataColumns,
    header: &CsvHeader,
    kept: ShownText,
) -> Result<(), Box<Diagnostic>> {
    let Some((first, values)) = columns.all.first() else {
        let message = "the table has no columns";
        return Err(Box::new(Diagnostic::new(Code::NoRows, kept.span(&header.place), message)));
    };
    let uneven = columns.all.iter().zip(&header.cells);
    for ((other, others), cell) in uneven {
        if others.len() != values.len() {
            let (n, of_first) = (others.len(), values.len());
            let message =
                format!("the column `{other}` has {n} rows, and `{first}` has {of_first}");
            return Err(Box::new(Diagnostic::new(
                Code::RowLength,
                kept.span(&cell.place),
                message,
            )));
        }
    }
    Ok(())
}

/// Digest of headers and numbers.
fn digest(columns: &DataColumns) -> Sha256Digest {
    let mut hasher = Sha256::new();
    for (header, values) in &columns.all {
        hasher.update(header);
        // A byte that headers cannot contain separates them from the numbers.
        hasher.update([0]);
        for value in values {
            hasher.update(value.to_le_bytes());
        }
    }
    Sha256Digest::finished(hasher)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use dgd_compiler::argument::neutral;
    use dgd_compiler::diagnostics::render::entry;

    use super::*;
    use crate::{InMemory, Rename, read_from};

    const NAN: f64 = f64::NAN;

    fn columns(all: &[(&str, &[f64])]) -> DataColumns {
        let column = |(header, values): &(&str, &[f64])| ((*header).to_owned(), values.to_vec());
        DataColumns { all: all.iter().map(column).collect() }
    }

    /// The result of `read`, or each mistake as `code line:column message; text`.
    fn read(columns: &DataColumns, renames: &[Rename]) -> Result<DataTable, Vec<String>> {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let files = InMemory::default().with_columns("data 1", columns.clone());
        let reading = ReadOptions::default().renamed(renames);
        let table = reading.read(&files, Path::new("data 1"), &mut sources, &mut diagnostics);
        let messages = diagnostics.sorted().into_iter().map(|diagnostic| {
            let entry = entry(diagnostic, &sources, neutral);
            let place = &entry.places[0];
            assert_eq!(place.file, "data 1");
            let words = format!("{}; {}", entry.message, place.text);
            format!("{} {}:{} {words}", entry.code, place.line, place.column)
        });
        table.map_err(|_| messages.collect())
    }

    /// Times, then names, units and bits of the columns.
    type Facts = (Option<Vec<u64>>, Vec<(String, Option<String>, Vec<u64>, Option<usize>)>);

    fn facts(table: &DataTable) -> Facts {
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        let column = |column: &crate::DataColumn| {
            let unit = column.unit.as_ref().map(|unit| unit.symbol.clone());
            let missing = column.missing.as_ref().map(|cells| cells.count);
            (column.name.clone(), unit, bits(&column.values), missing)
        };
        (table.time.as_deref().map(bits), table.columns.iter().map(column).collect())
    }

    #[test]
    fn columns_are_read_as_their_text_is() {
        let awkward = [0.1 + 0.2, -1e-300, NAN, 5e-324];
        let tables: &[&[(&str, &[f64])]] = &[
            &[
                ("time [min]", &[0.1, 0.3, 0.3, 7.7]),
                ("p_r [bar]", &awkward),
                ("\"odd\", x", &awkward),
            ],
            &[("a [1]", &[1.0, NAN]), ("p[2] [barg]", &[2.0, 1e22])],
        ];
        for tables in tables {
            let columns = columns(tables);
            let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
            let text = columns.to_csv();
            let of_text = read_from("a.csv", text.as_bytes(), &mut sources, &mut diagnostics);
            let of_text = of_text.unwrap_or_else(|_| panic!("{text}"));
            let of_numbers = read(&columns, &[]).expect("the same without text");
            assert_eq!(facts(&of_numbers), facts(&of_text), "{text}");
            assert_eq!(of_numbers.len(), of_text.len());
        }
    }

    #[test]
    fn a_file_in_memory_can_be_opened_as_text() {
        let files = InMemory::default().with_columns("x", columns(&[("time [s]", &[0.0, 0.5])]));
        let mut text = String::new();
        let file = crate::FileSystem::open(&files, Path::new("./x"));
        std::io::Read::read_to_string(&mut file.expect("it is there"), &mut text).expect("text");
        assert_eq!(text, "time [s]\n0\n0.5\n");
    }

    #[test]
    fn mistakes_name_rows() {
        let mistakes = |all: &[(&str, &[f64])]| read(&columns(all), &[]).expect_err("a mistake");
        assert_eq!(
            mistakes(&[("time [s]", &[0.0, 2.0, 1.0]), ("x", &[0.0; 3])]),
            ["E605 1:1 time runs backwards: `1` comes after `2`; row 2"]
        );
        assert_eq!(
            mistakes(&[("time [s]", &[0.0, 1.0, 1.0, 0.5])]),
            ["E605 1:1 time runs backwards: `0.5` comes after `1`; row 3"]
        );
        assert_eq!(
            mistakes(&[("time [s]", &[0.0, NAN, f64::INFINITY])]),
            ["E607 1:1 this row has no time; row 1, and one more row"]
        );
        assert_eq!(
            mistakes(&[("time", &[0.0, 1.0])]),
            ["E607 1:1 `0` has no unit of time; row 0, and one more row"]
        );
        assert_eq!(
            mistakes(&[("time [s]", &[0.0, 1.0]), ("x [m]", &[1.0])]),
            ["E610 1:10 the column `x [m]` has 1 rows, and `time [s]` has 2; "]
        );
        assert_eq!(mistakes(&[("time [s]", &[])]), ["E612 1:1 the table has no rows; "]);
        assert_eq!(mistakes(&[]), ["E612 1:1 the table has no columns; "]);
        let infinite = read(&columns(&[("x [m]", &[1.0, f64::INFINITY])]), &[]).expect("a table");
        let cells = infinite.columns[0].not_numbers.as_ref().expect("infinity is not a number");
        assert_eq!((cells.text.as_str(), cells.count), ("inf", 1));
    }

    #[test]
    fn columns_can_be_renamed_and_told_apart() {
        let one = columns(&[("time [s]", &[0.0, 1.0]), ("P_RIS", &[1.0, 2.0])]);
        let rename = Rename { column: "P_RIS".to_owned(), name: "p_r [barg]".to_owned() };
        let table = read(&one, &[rename]).expect("a table");
        assert_eq!(table.columns[0].name, "p_r");
        let other = columns(&[("time [s]", &[0.0, 1.0]), ("P_RIS", &[1.0, 3.0])]);
        assert_ne!(digest(&one), digest(&other));
    }
}
