//! Reads the columns of a Parquet file into a [`DataTable`], some rows at a time: the counterpart of
//! [`rows`](super::rows) without text.

use dgd_compiler::diagnostics::{Diagnostics, ErrorReported};
use dgd_compiler::source::{SourceMap, SourceText};

use crate::csv::header::CsvHeader;
use crate::csv::kept::ShownText;
use crate::csv::rows::CsvRows;
use crate::parquet::{self, ColumnChunk, RandomAccess, TakesColumns};
use crate::read::{ReadOptions, unreadable};
use crate::table::DataTable;

/// Reads a file of this name.
pub(crate) fn read(
    place: RandomAccess,
    name: &str,
    reading: ReadOptions<'_>,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<DataTable, ErrorReported> {
    let mut taking = GroupReader { name, reading, sources, diagnostics, rows: None };
    let read = parquet::read(place, &mut taking);
    let GroupReader { rows, .. } = taking;
    match (read, rows) {
        // Mistakes in the header come before later ones.
        (_, Some(Err(reported))) => Err(reported),
        (Ok(()), Some(Ok(rows))) => rows.finish(diagnostics),
        (Ok(()), None) => Err(diagnostics.error(unreadable(name, "", sources, "it is empty"))),
        (Err(why), _) => Err(diagnostics.error(unreadable(name, "", sources, &why))),
    }
}

struct GroupReader<'a> {
    name: &'a str,
    reading: ReadOptions<'a>,
    sources: &'a mut SourceMap,
    diagnostics: &'a mut Diagnostics,
    rows: Option<Result<CsvRows, ErrorReported>>,
}

impl GroupReader<'_> {
    fn below(&mut self, names: &[String]) -> Result<CsvRows, ErrorReported> {
        let names = || names.iter().map(String::as_str);
        let source = SourceText { name: self.name.to_owned(), text: CsvHeader::line(names()) };
        let kept = ShownText { source: self.sources.add(source), whole: false };
        let mut header = CsvHeader::named(names());
        header.rename(self.reading.renames, kept, self.sources, self.diagnostics)?;
        CsvRows::below(&header, self.reading, kept, self.sources, self.diagnostics)
    }
}

impl TakesColumns for GroupReader<'_> {
    fn begin(&mut self, names: &[String], n_rows: usize, bytes: u64) -> Option<Vec<bool>> {
        if names.is_empty() {
            return None;
        }
        let below = self.below(names);
        let rows = self.rows.insert(below).as_mut().ok()?;
        rows.expect(n_rows, bytes);
        Some((0..names.len()).map(|at| rows.wants(at)).collect())
    }

    fn take(&mut self, column: usize, cells: ColumnChunk) {
        let Some(Ok(rows)) = &mut self.rows else { return };
        match cells {
            ColumnChunk::Numbers(numbers) => rows.take_numbers(column, &numbers),
            ColumnChunk::Texts(texts) => rows.take_texts(column, texts.iter().map(String::as_str)),
            ColumnChunk::Other(what, n) => rows.take_texts(column, std::iter::repeat_n(what, n)),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::fs;

    use dgd_compiler::argument::neutral;
    use dgd_compiler::diagnostics::render::entry;

    use super::*;
    use crate::parquet::written;
    use crate::{DiskFiles, read_from};

    /// All contents of a table, numbers bit by bit, or each mistake as `code message; text`.
    fn read(bytes: &[u8], reading: ReadOptions<'_>) -> Result<String, Vec<String>> {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("a");
        fs::write(&path, bytes).expect("writable");
        let table = reading.read(&DiskFiles, &path, &mut sources, &mut diagnostics);
        let messages = diagnostics.sorted().into_iter().map(|diagnostic| {
            let entry = entry(diagnostic, &sources, neutral);
            format!("{} {}; {}", entry.code, entry.message, entry.places[0].text)
        });
        let table = table.map_err(|_| messages.collect::<Vec<_>>())?;
        let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        let mut text = format!("{} {:?} {:?}\n", table.len(), table.epoch, table.disorder);
        let _ = writeln!(text, "{:?}", table.time.as_deref().map(bits));
        let replicates = table.replicates.iter();
        let replicates: Vec<_> = replicates.map(|one| (one.row, one.first)).collect();
        let _ = writeln!(text, "{replicates:?}");
        for column in &table.columns {
            let count = |cells: &Option<crate::CellRange>| {
                cells.as_ref().map(|c| (c.count, c.text.clone()))
            };
            let (missing, others) = (count(&column.missing), count(&column.not_numbers));
            // The text of a missing number is not kept.
            let missing = missing.map(|(count, _)| count);
            let unit = column.unit.as_ref().map(|unit| &unit.symbol);
            let values = bits(&column.values);
            let _ = writeln!(text, "{} {unit:?} {missing:?} {others:?} {values:?}", column.name);
        }
        Ok(text)
    }

    const TABLES: [&str; 8] = [
        "time [s],x [m],note\n0,0.1,a\n0.1,NaN,\n1e-1,-0,\"b,c\"\n7.7,1e22,7\n",
        "time [min],x [m]\n5,5e-324\n5,1\n5,1\n5,1\n6,inf\n",
        "time,x [m]\n2026-11-21T10:00:00Z,1\n2026-11-21T10:00:01.5Z,2\n2026-11-21T10:00:01.5Z,3\n",
        "time,x [m]\n2026-11-21,1\n2026-11-22,2\n",
        "t,y [1]\n3,1\n4,na\n5, 7 \n",
        "x [m],y [bar]\n1,2\nNaN,\n",
        "time [s],a,b [xx],c [m,c [m]\n0,1,2,3,4\n",
        "time [s],x [m]\n0,1\n5,2\n1,3\n2,4\n2,5\n2,6\n3,7\n",
    ];

    #[test]
    fn columns_are_read_as_the_text_that_they_stand_for() {
        for csv in TABLES {
            let reading = ReadOptions::default().as_it_is();
            let of_text = read(csv.as_bytes(), reading).unwrap_or_else(|e| panic!("{csv}: {e:?}"));
            assert_eq!(read(&written(csv), reading), Ok(of_text), "{csv}");
        }
    }

    #[test]
    fn several_groups_of_rows_are_one_table() {
        // Replicates and a jump across the end of a group, and a time that goes back in the last one.
        let mut csv = "time [s]".to_owned();
        (0..40).for_each(|k| write!(csv, ",c{k} [m]").expect("to a string"));
        csv.push('\n');
        let ends = (1 << 21) / 41 + 1;
        for row in 0..2 * ends + 50 {
            let t = match row {
                row if (ends - 2..ends + 2).contains(&row) => ends,
                row if row == 2 * ends + 1 => 3,
                row => row,
            };
            let _ = write!(csv, "{}", f64::from(t) * 0.1);
            for k in 0..40 {
                let _ = write!(csv, ",{}", f64::from(row * k) * 0.01);
            }
            csv.push('\n');
        }
        let file = written(&csv);
        let reading = ReadOptions::default().as_it_is().with_columns(&["c1", "c39"]);
        assert!(read(&file, reading) == read(csv.as_bytes(), reading));
        let refused =
            read(&file, ReadOptions::default().with_columns(&["c1"])).expect_err("it goes back");
        let words = format!("`0.30000000000000004` comes after `{}`", f64::from(2 * ends) * 0.1);
        let place = format!("row {}", 2 * ends + 1);
        assert_eq!(refused, [format!("E605 time runs backwards: {words}; {place}")]);
    }

    #[test]
    fn columns_that_nobody_asks_for_are_not_read() {
        let csv = "time [s],x [m],y [m]\n0,1,2\n1,3,4\n";
        let reading = ReadOptions::default().with_columns(&["y"]);
        for file in [written(csv), csv.as_bytes().to_vec()] {
            let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
            let folder = tempfile::tempdir().expect("a folder for the test");
            let path = folder.path().join("a");
            fs::write(&path, &file).expect("writable");
            let table =
                reading.read(&DiskFiles, &path, &mut sources, &mut diagnostics).expect("sound");
            let values: Vec<&[f64]> = table.columns.iter().map(|c| c.values.as_slice()).collect();
            assert_eq!(values, [[].as_slice(), &[2.0, 4.0]]);
            let whole = read_from("a", file.as_slice(), &mut sources, &mut diagnostics);
            assert_eq!(table.digest, whole.expect("sound").digest, "which is that of all bytes");
        }
        // Damage in a chunk is not noticed without reading it.
        let mut damaged = written(csv);
        let position = damaged.windows(8).position(|bytes| bytes == 3.0_f64.to_le_bytes());
        // It is preceded by the first number, the definition levels, and the page header.
        let head = position.expect("x has a 3") - 28;
        damaged[head..head + 10].fill(0xff);
        assert!(read(&damaged, reading).is_ok());
        assert!(read(&damaged, ReadOptions::default()).is_err());
    }

    #[test]
    fn mistakes_name_rows() {
        let messages =
            |csv: &str| read(&written(csv), ReadOptions::default()).expect_err("a mistake");
        assert_eq!(
            messages("time [s],x [m]\n0,1\n2,1\n1,1\n"),
            ["E605 time runs backwards: `1` comes after `2`; row 2"]
        );
        assert_eq!(messages("time [s],x [m]\n0,1\nNaN,1\n"), ["E607 this row has no time; row 1"]);
        assert_eq!(messages("time [s],x [m]\n"), ["E612 the table has no rows; "]);
        assert_eq!(
            messages("x [m],time [s]\n0,1\n"),
            ["E609 the time is not in the first column; "]
        );
    }
}
