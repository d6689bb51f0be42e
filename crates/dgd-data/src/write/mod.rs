//! Writes tables as CSV, and from there as Parquet, in the units that a model declares.
//!
//! Numbers have the fewest digits that read back to the same number. A value is converted from SI to its unit by a
//! division, and back by a multiplication, both with rounding. Therefore, of the numbers near the quotient, one is
//! written that reads back to the same SI value, if there is one. Otherwise (neighbours are further apart in the unit
//! than in SI), the SI value that is read back is off by one unit in the last place of the value or, if larger, of the
//! unit's offset.

mod format;

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;

use dgd_runtime::Unit;
use flate2::Compression;
use flate2::write::GzEncoder;

use crate::cell::{push_number, quoted};
use crate::csv::clock::Epoch;
use crate::files::{WriteError, write_whole};
#[cfg(feature = "parquet")]
use crate::parquet::ParquetWriter;

pub use format::{TableFormat, UnwritableFormat};

/// A column to write.
#[derive(Debug, Clone, Copy)]
pub struct OutputColumn<'a> {
    /// Its name.
    pub name: &'a str,
    /// The unit it is written in.
    pub unit: &'a Unit,
    /// Values in SI; NaN marks a missing one.
    pub values: &'a [f64],
    /// The timestamp of zero, for times that are written as timestamps.
    pub epoch: Option<Epoch>,
}

impl<'a> OutputColumn<'a> {
    /// A column of numbers.
    pub fn new(name: &'a str, unit: &'a Unit, values: &'a [f64]) -> Self {
        Self { name, unit, values, epoch: None }
    }
}

/// Writes a table: the time, if it has one, in seconds, then the columns.
///
/// # Panics
///
/// If the columns have different lengths.
pub fn write_table(
    out: &mut (impl Write + ?Sized),
    time: Option<&[f64]>,
    columns: &[OutputColumn<'_>],
) -> io::Result<()> {
    let seconds = Unit { symbol: "s".into(), factor: 1.0, offset: 0.0 };
    let time = time.map(|values| OutputColumn::new("time", &seconds, values));
    let columns: Vec<_> = time.into_iter().chain(columns.iter().copied()).collect();
    verify_lengths(&columns);
    write_header(out, &columns)?;
    write_rows(out, &columns)
}

/// Writes a table with these times, in seconds; with an epoch, as timestamps.
///
/// # Panics
///
/// If the columns have different lengths.
pub fn write_table_at(
    out: &mut (impl Write + ?Sized),
    times: &[f64],
    epoch: Option<Epoch>,
    columns: &[OutputColumn<'_>],
) -> io::Result<()> {
    let seconds = Unit { symbol: "s".into(), factor: 1.0, offset: 0.0 };
    let is_stamp = |epoch: &Epoch| times.iter().all(|time| epoch.stamp(*time).is_some());
    let time = OutputColumn {
        epoch: epoch.filter(is_stamp),
        ..OutputColumn::new("time", &seconds, times)
    };
    let columns: Vec<_> = [time].into_iter().chain(columns.iter().copied()).collect();
    verify_lengths(&columns);
    write_header(out, &columns)?;
    write_rows(out, &columns)
}

fn verify_lengths(columns: &[OutputColumn<'_>]) {
    let n_rows = columns.first().map_or(0, |column| column.values.len());
    assert!(
        columns.iter().all(|column| column.values.len() == n_rows),
        "columns of one table have one length"
    );
}

fn push_cell(line: &mut String, column: &OutputColumn<'_>, row: usize) {
    let value = column.values[row];
    match column.epoch {
        Some(epoch) => line.push_str(&epoch.stamp(value).unwrap_or_default()),
        None if value.is_nan() => {}
        None => push_in_unit(line, value, column.unit),
    }
}

/// Writes the header line of these columns.
pub fn write_header(
    out: &mut (impl Write + ?Sized),
    columns: &[OutputColumn<'_>],
) -> io::Result<()> {
    let header = |column: &OutputColumn<'_>| match column.epoch {
        // Timestamps have no unit.
        Some(_) => quoted(column.name),
        None => quoted(&format!("{} [{}]", column.name, column.unit.symbol)),
    };
    let headers: Vec<_> = columns.iter().map(header).collect();
    writeln!(out, "{}", headers.join(","))
}

/// Writes the rows of these columns.
///
/// # Panics
///
/// If a column is shorter than the first.
pub fn write_rows(out: &mut (impl Write + ?Sized), columns: &[OutputColumn<'_>]) -> io::Result<()> {
    let n_rows = columns.first().map_or(0, |column| column.values.len());
    let mut line = String::new();
    for row in 0..n_rows {
        line.clear();
        for (i, column) in columns.iter().enumerate() {
            if i > 0 {
                line.push(',');
            }
            push_cell(&mut line, column, row);
        }
        // An empty line would not be a row.
        if line.is_empty() {
            line.push_str("NaN");
        }
        line.push('\n');
        out.write_all(line.as_bytes())?;
    }
    Ok(())
}

/// Writes a table atomically to a file; compressed if its name ends in `.gz`.
///
/// # Panics
///
/// If the columns have different lengths.
pub fn save_table(
    path: &Path,
    time: Option<&[f64]>,
    columns: &[OutputColumn<'_>],
) -> Result<(), WriteError> {
    save(path, |out| write_table(out, time, columns))
}

/// Writes a file atomically; compressed if its name ends in `.gz`.
pub fn save(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    write_whole(path, |out| {
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz")) {
            // The gzip header contains neither name nor time, so that equal tables give equal files.
            let mut compressed = GzEncoder::new(out, Compression::default());
            write(&mut compressed)?;
            compressed.finish()?;
            Ok(())
        } else {
            write(out)
        }
    })
}

/// Whether this build reads and writes Parquet.
pub const HAS_PARQUET: bool = cfg!(feature = "parquet");

/// Writes a Parquet file atomically; `write_csv` writes the table as CSV.
#[cfg(feature = "parquet")]
fn save_parquet(
    path: &Path,
    write_csv: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    save(path, |out| {
        let mut table = ParquetWriter::new(out);
        write_csv(&mut table)?;
        table.finish()
    })
}

/// Refuses to write a Parquet file.
#[cfg(not(feature = "parquet"))]
fn save_parquet(
    path: &Path,
    _: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    let error = io::Error::new(io::ErrorKind::Unsupported, "this build does not write Parquet");
    Err(WriteError::Failed { path: path.to_owned(), error })
}

/// Appends an SI value in a unit.
fn push_in_unit(line: &mut String, si: f64, unit: &Unit) {
    let value = read_back(si, unit, line);
    push_number(line, value);
}

/// An SI value in a unit: among the numbers that read back to it, one with few digits.
pub fn in_unit(si: f64, unit: &Unit) -> f64 {
    read_back(si, unit, &mut String::new())
}

fn read_back(si: f64, unit: &Unit, space: &mut String) -> f64 {
    if unit.factor == 1.0 && unit.offset == 0.0 {
        return si;
    }
    let quotient = unit.from_si(si);
    let reads_back = |value: &f64| value * unit.factor + unit.offset == si;
    // 1583.7 instead of 1583.7000000000003, if both read back as the same SI value.
    [15, 16]
        .into_iter()
        .map(|digits| rounded(quotient, digits, space))
        .find(reads_back)
        .or_else(|| {
            let around = [quotient, quotient.next_down(), quotient.next_up()];
            around.into_iter().find(reads_back)
        })
        .unwrap_or(quotient)
}

/// The number rounded to this many decimal digits; `space` is left unchanged.
fn rounded(value: f64, digits: usize, space: &mut String) -> f64 {
    let start = space.len();
    // Writing to a string cannot fail.
    let _ = write!(space, "{value:.*e}", digits - 1);
    let rounded = space[start..].parse().unwrap_or(value);
    space.truncate(start);
    rounded
}

#[cfg(test)]
mod tests {
    use dgd_compiler::diagnostics::Diagnostics;
    use dgd_compiler::source::SourceMap;
    use dgd_compiler::units::parse_unit;

    use super::*;
    use crate::select::{DeclaredColumn, inputs};
    use crate::{DataTable, read};

    /// A unit in the types of the compiler and of a compiled model.
    fn units(symbol: &str) -> (dgd_compiler::units::Unit, Unit) {
        let unit = parse_unit(symbol).expect("a unit of the catalogue");
        let symbol = symbol.to_owned().into();
        let compiled = Unit { symbol, factor: unit.factor, offset: unit.offset };
        (unit, compiled)
    }

    fn written(si: f64, unit: &Unit) -> String {
        let mut text = String::new();
        push_in_unit(&mut text, si, unit);
        text
    }

    #[test]
    fn numbers_are_short_and_read_back() {
        for (value, text) in [
            (0.1, "0.1"),
            (-0.0, "-0"),
            (1e-5, "0.00001"),
            (2.5e-7, "2.5e-7"),
            (1e16, "1e16"),
            (123_456_789.25, "123456789.25"),
            (f64::MAX, "1.7976931348623157e308"),
            (5e-324, "5e-324"),
        ] {
            let mut written = String::new();
            push_number(&mut written, value);
            assert_eq!(written, text);
            assert_eq!(text.parse(), Ok(value));
        }
    }

    #[test]
    fn what_was_read_is_written_as_it_was() {
        for (symbol, texts) in [
            ("lpm", ["1583.7", "0.1", "82.985"]),
            ("bara", ["27.578", "0.003", "101.33"]),
            ("%", ["53.069", "7", "0.07"]),
            ("degC", ["20", "-273.1", "36.6"]),
            ("degF", ["68.1", "0", "-40"]),
        ] {
            let (_, unit) = units(symbol);
            for text in texts {
                let value: f64 = text.parse().expect("a number");
                assert_eq!(written(value * unit.factor + unit.offset, &unit), text, "{symbol}");
            }
        }
    }

    #[test]
    fn a_table_is_read_as_it_was_written() {
        // A pseudorandom walk through many magnitudes (Knuth's 64-bit linear congruential generator).
        let mut state = 7_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let symbols = ["m^3/s", "lpm", "bara", "psig", "degC", "%", "1", "kg/m^4"];
        let units: Vec<_> = symbols.iter().map(|symbol| units(symbol)).collect();
        let n = 500;
        let time: Vec<f64> = (0..n).map(|i| f64::from(i / 2) * 0.1).collect();
        let values: Vec<Vec<f64>> = symbols
            .iter()
            .map(|_| {
                (0..n).map(|_| (next() - 0.3) * 10_f64.powi((next() * 12.0) as i32 - 6)).collect()
            })
            .collect();
        let names: Vec<_> = (1..=symbols.len()).map(|i| format!("p[{i},\"a\"]")).collect();
        let columns: Vec<_> = values
            .iter()
            .zip(&units)
            .zip(&names)
            .map(|((values, (_, unit)), name)| OutputColumn::new(name, unit, values))
            .collect();

        let folder = tempfile::tempdir().expect("a folder for the test");
        let files = ["a.csv", "a.csv.gz", "a.parquet"];
        for file in files.into_iter().filter(|file| HAS_PARQUET || !file.ends_with("parquet")) {
            let path = folder.path().join(file);
            let rows = |out: &mut dyn Write| write_table(out, Some(&time), &columns);
            let saved =
                if file == "a.parquet" { save_parquet(&path, rows) } else { save(&path, rows) };
            saved.expect("the folder is writable");
            let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
            let table: DataTable = read(&path, &mut sources, &mut diagnostics).expect("a table");
            assert_eq!(table.time.as_ref(), Some(&time));
            let declared: Vec<_> = units
                .iter()
                .zip(&names)
                .map(|((unit, _), name)| DeclaredColumn { name, unit, place: None })
                .collect();
            let read = inputs(&table, &declared, &mut diagnostics).expect("all are there");
            for ((read, values), (unit, _)) in read.iter().zip(&values).zip(&units) {
                for (read, value) in read.iter().zip(values) {
                    let ulp = f64::EPSILON * value.abs().max(unit.offset);
                    assert!((read - value).abs() <= ulp, "{}: {value:e} {read:e}", unit.symbol);
                }
            }
            let exact = |at: usize| read[at] == values[at];
            assert!(exact(0) && exact(6) && exact(7), "SI values are kept to the last bit");
        }
    }

    #[test]
    fn missing_values_are_empty_cells() {
        let (_, unit) = units("m");
        let values = [1.0, f64::NAN];
        let column = OutputColumn::new("h", &unit, &values);
        let mut out = Vec::new();
        write_table(&mut out, Some(&[0.0, 1.0]), &[column, column]).expect("to memory");
        assert_eq!(String::from_utf8_lossy(&out), "time [s],h [m],h [m]\n0,1,1\n1,,\n");
        out.clear();
        write_table(&mut out, None, &[column]).expect("to memory");
        assert_eq!(String::from_utf8_lossy(&out), "h [m]\n1\nNaN\n");
    }
}
