//! Reads Parquet files with the `parquet` crate, which supports the whole format.
//!
//! Columns that do not hold single numbers, times or texts (lists, binary data) become text, so that they are refused
//! only if a model reads them.

use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind};

use bytes::Bytes;
use jiff::Timestamp;
use jiff::tz::Offset;
use parquet::basic::{
    Compression, ConvertedType, LogicalType, TimeUnit, TimestampType, Type as Physical,
};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::{ParquetError, Result as Read};
use parquet::file::metadata::{ColumnChunkMetaData, ParquetMetaData, RowGroupMetaData};
use parquet::file::reader::{ChunkReader, FileReader, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;

use super::{ColumnChunk, RandomAccess, TakesColumns};

thread_local! {
    /// Whether this thread is in the library.
    static CATCHES: Cell<bool> = const { Cell::new(false) };
}

/// Whether a panic of this thread is caught here.
pub(super) fn catches_panics() -> bool {
    CATCHES.get()
}

/// Reads a file column by column within groups of rows. An error names the column and the group, counted from 0.
pub(crate) fn read(place: RandomAccess, table: &mut dyn TakesColumns) -> Result<(), String> {
    let length = place.len().map_err(|error| error.to_string())?;
    let at = RefCell::default();
    // The library panics on some damaged files that `verify` does not detect. Their data is then discarded.
    CATCHES.set(true);
    let read = catch_unwind(AssertUnwindSafe(|| match place {
        RandomAccess::Memory(bytes) => columns_of(Bytes::from(bytes), length, table, &at),
        RandomAccess::File(file) => columns_of(file, length, table, &at),
    }))
    .unwrap_or_else(|_| Err(damaged()));
    CATCHES.set(false);
    read.map_err(|error| {
        let place: Option<String> = at.into_inner();
        place.into_iter().chain([message(error)]).collect::<Vec<_>>().join(": ")
    })
}

/// An error of the library, without its category.
fn message(error: ParquetError) -> String {
    match error {
        ParquetError::General(message) | ParquetError::EOF(message) => message,
        other => other.to_string(),
    }
}

fn damaged() -> ParquetError {
    ParquetError::General("the file is damaged".to_owned())
}

/// Checks that all columns are within the file.
fn verify(metadata: &ParquetMetaData, length: u64) -> Read<()> {
    let within = |column: &ColumnChunkMetaData| {
        let start = column.dictionary_page_offset().unwrap_or(column.data_page_offset());
        let end = u64::try_from(start)
            .ok()
            .zip(u64::try_from(column.compressed_size()).ok())
            .and_then(|(start, size)| start.checked_add(size));
        end.is_some_and(|end| end <= length)
    };
    let is_within = metadata.row_groups().iter().flat_map(RowGroupMetaData::columns).all(within);
    if is_within { Ok(()) } else { Err(damaged()) }
}

/// Refuses compressions that the library was built without.
fn verify_codec(codec: Compression) -> Read<()> {
    match codec {
        Compression::UNCOMPRESSED | Compression::SNAPPY | Compression::ZSTD(_) => Ok(()),
        other => {
            let name = other.to_string();
            let name = name.split('(').next().unwrap_or_default();
            Err(ParquetError::General(format!(
                "it is compressed with {name}: write the file with Snappy or Zstandard"
            )))
        }
    }
}

fn columns_of<R: ChunkReader + 'static>(
    file: R,
    length: u64,
    table: &mut dyn TakesColumns,
    at: &RefCell<Option<String>>,
) -> Read<()> {
    let file = SerializedFileReader::new(file)?;
    verify(file.metadata(), length)?;
    let schema = file.metadata().file_metadata().schema_descr_ptr();
    let of_group = |group: &RowGroupMetaData| {
        usize::try_from(group.num_rows())
            .map_err(|_| ParquetError::General("a negative number of rows".to_owned()))
    };
    let groups = file.metadata().row_groups().iter().map(of_group).collect::<Read<Vec<usize>>>()?;
    let n_rows =
        groups.iter().try_fold(0_usize, |sum, n| sum.checked_add(*n)).ok_or_else(damaged)?;
    if n_rows > 0 && schema.columns().iter().all(|column| other(column).is_some()) {
        return Err(ParquetError::General("no column holds numbers".to_owned()));
    }
    let names: Vec<String> =
        schema.columns().iter().map(|column| column.name().to_owned()).collect();
    let Some(wanted) = table.begin(&names, n_rows, length) else { return Ok(()) };
    for (k, column) in schema.columns().iter().enumerate().filter(|(k, _)| wanted[*k]) {
        if let Some(what) = other(column) {
            table.take(k, ColumnChunk::Other(what, n_rows));
            continue;
        }
        for (group, n_rows) in groups.iter().enumerate() {
            at.replace(Some(format!("column `{}`, row group {group}", column.name())));
            verify_codec(file.metadata().row_group(group).column(k).compression())?;
            let reader = file.get_row_group(group)?.get_column_reader(k)?;
            column_of(reader, column, *n_rows, &mut |cells| table.take(k, cells))?;
        }
    }
    Ok(())
}

/// The text for every row of a column that holds neither numbers nor texts.
fn other(column: &ColumnDescriptor) -> Option<&'static str> {
    if column.max_rep_level() > 0 {
        return Some("a list");
    }
    (column.physical_type() == Physical::FIXED_LEN_BYTE_ARRAY).then_some("binary data")
}

/// Rows per batch.
const BATCH: usize = 1 << 16;

/// Reads a column of a group of rows.
fn column_of(
    reader: ColumnReader,
    column: &ColumnDescriptor,
    n_rows: usize,
    take: &mut dyn FnMut(ColumnChunk),
) -> Read<()> {
    let logical = logical_type(column);
    match reader {
        ColumnReader::BoolColumnReader(reader) => batches(reader, column, n_rows, |values| {
            take(numbers(values, |value| f64::from(u8::from(value))));
        }),
        ColumnReader::Int32ColumnReader(reader) => {
            batches(reader, column, n_rows, |values| match &logical {
                Some(LogicalType::Date) => {
                    const DAY: i128 = 86_400_000_000_000;
                    take(texts(values, |days| stamp(i128::from(days) * DAY, false)));
                }
                _ => take(numbers(values, |value| {
                    integer(value.into(), logical.as_ref(), u32::MAX.into())
                })),
            })
        }
        ColumnReader::Int64ColumnReader(reader) => {
            batches(reader, column, n_rows, |values| match &logical {
                Some(LogicalType::Timestamp(TimestampType { unit, is_adjusted_to_u_t_c })) => {
                    let nanoseconds = match unit {
                        TimeUnit::MILLIS => 1_000_000,
                        TimeUnit::MICROS => 1_000,
                        TimeUnit::NANOS => 1,
                    };
                    take(texts(values, |time| {
                        stamp(i128::from(time) * nanoseconds, *is_adjusted_to_u_t_c)
                    }));
                }
                _ => take(numbers(values, |value| integer(value, logical.as_ref(), u64::MAX))),
            })
        }
        ColumnReader::Int96ColumnReader(reader) => batches(reader, column, n_rows, |values| {
            take(texts(values, |time| stamp(time.to_nanos().into(), false)));
        }),
        ColumnReader::FloatColumnReader(reader) => {
            batches(reader, column, n_rows, |values| take(numbers(values, f64::from)))
        }
        ColumnReader::DoubleColumnReader(reader) => {
            batches(reader, column, n_rows, |values| take(numbers(values, |value| value)))
        }
        ColumnReader::ByteArrayColumnReader(reader) => batches(reader, column, n_rows, |values| {
            take(texts(values, |value| String::from_utf8_lossy(value.data()).into_owned()));
        }),
        ColumnReader::FixedLenByteArrayColumnReader(_) => {
            take(ColumnChunk::Other("binary data", n_rows));
            Ok(())
        }
    }
}

/// The logical type of a column; older files encode it differently.
fn logical_type(column: &ColumnDescriptor) -> Option<LogicalType> {
    column.logical_type_ref().cloned().or_else(|| match column.converted_type() {
        ConvertedType::DATE => Some(LogicalType::Date),
        ConvertedType::TIMESTAMP_MILLIS => Some(LogicalType::timestamp(true, TimeUnit::MILLIS)),
        ConvertedType::TIMESTAMP_MICROS => Some(LogicalType::timestamp(true, TimeUnit::MICROS)),
        ConvertedType::UINT_32 => Some(LogicalType::integer(32, false)),
        ConvertedType::UINT_64 => Some(LogicalType::integer(64, false)),
        ConvertedType::DECIMAL => {
            Some(LogicalType::decimal(column.type_scale(), column.type_precision()))
        }
        _ => None,
    })
}

/// Passes on the values of a column without lists in batches; `None` for missing ones.
fn batches<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    column: &ColumnDescriptor,
    n_rows: usize,
    mut take: impl FnMut(Vec<Option<T::T>>),
) -> Read<()> {
    // A value is present if it has the highest definition level.
    let there = column.max_def_level();
    let mut left = n_rows;
    while left > 0 {
        let (mut values, mut levels) = (Vec::new(), Vec::new());
        let batch = left.min(BATCH);
        let (n, ..) = reader.read_records(batch, Some(&mut levels), None, &mut values)?;
        if n == 0 {
            return Err(ParquetError::EOF("a column ends early".to_owned()));
        }
        let mut values = values.into_iter();
        let optional: Vec<_> = if there == 0 {
            values.map(Some).collect()
        } else {
            levels.iter().map(|&level| if level == there { values.next() } else { None }).collect()
        };
        if optional.len() != n {
            return Err(ParquetError::General("columns of different lengths".to_owned()));
        }
        take(optional);
        left -= n;
    }
    Ok(())
}

fn numbers<T>(values: Vec<Option<T>>, number: impl Fn(T) -> f64) -> ColumnChunk {
    ColumnChunk::Numbers(values.into_iter().map(|value| value.map_or(f64::NAN, &number)).collect())
}

fn texts<T>(values: Vec<Option<T>>, text: impl Fn(T) -> String) -> ColumnChunk {
    ColumnChunk::Texts(
        values.into_iter().map(|value| value.map(&text).unwrap_or_default()).collect(),
    )
}

/// An integer according to its column: signed or unsigned, or a decimal. `mask` is the largest unsigned integer of its
/// size.
fn integer(value: i64, logical: Option<&LogicalType>, mask: u64) -> f64 {
    match logical {
        Some(LogicalType::Integer(kind)) if !kind.is_signed => (value as u64 & mask) as f64,
        Some(LogicalType::Decimal(decimal)) => value as f64 / 10_f64.powi(decimal.scale),
        _ => value as f64,
    }
}

/// An ISO 8601 timestamp from nanoseconds since 1970.
fn stamp(nanoseconds: i128, utc: bool) -> String {
    match Timestamp::from_nanosecond(nanoseconds) {
        Ok(stamp) if utc => stamp.to_string(),
        Ok(stamp) => Offset::UTC.to_datetime(stamp).to_string(),
        Err(_) => format!("{nanoseconds} ns since 1970"),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;
    use std::sync::Arc;

    use dgd_compiler::diagnostics::Diagnostics;
    use dgd_compiler::source::SourceMap;
    use parquet::basic::Repetition;
    use parquet::data_type::{ByteArrayType, DoubleType, Int64Type};
    use parquet::file::writer::SerializedFileWriter;
    use parquet::schema::types::Type;

    use super::*;
    use crate::parquet::{ChunkText, ParquetWriter, written};
    use crate::read_from;

    /// The CSV text equivalent to a file.
    fn to_csv(file: Vec<u8>) -> Result<String, String> {
        let mut text = ChunkText::default();
        let read = read(RandomAccess::Memory(file), &mut text);
        read.map(|()| text.to_csv())
    }

    /// Three rows of a timestamp, an optional number, and a text.
    fn file() -> Read<Vec<u8>> {
        let field = |name, physical, repetition, logical| {
            let field = Type::primitive_type_builder(name, physical);
            field.with_repetition(repetition).with_logical_type(logical).build().map(Arc::new)
        };
        let stamps = Some(LogicalType::timestamp(true, TimeUnit::NANOS));
        let fields = vec![
            field("time", Physical::INT64, Repetition::REQUIRED, stamps)?,
            field("x [lpm]", Physical::DOUBLE, Repetition::OPTIONAL, None)?,
            field("note", Physical::BYTE_ARRAY, Repetition::REQUIRED, Some(LogicalType::String))?,
        ];
        let schema = Arc::new(Type::group_type_builder("table").with_fields(fields).build()?);
        let mut bytes = Vec::new();
        let mut file = SerializedFileWriter::new(&mut bytes, schema, Arc::default())?;
        let mut group = file.next_row_group()?;
        while let Some(mut column) = group.next_column()? {
            match column.untyped() {
                parquet::column::writer::ColumnWriter::Int64ColumnWriter(_) => {
                    let times = [1_000_000_000, 1_500_000_000, 3_000_000_000];
                    column.typed::<Int64Type>().write_batch(&times, None, None)?;
                }
                parquet::column::writer::ColumnWriter::DoubleColumnWriter(_) => {
                    let column = column.typed::<DoubleType>();
                    column.write_batch(&[0.1, 1583.7], Some(&[1, 0, 1]), None)?;
                }
                _ => {
                    let texts = ["a,b".into(), "".into(), "c".into()];
                    column.typed::<ByteArrayType>().write_batch(&texts, None, None)?;
                }
            }
            column.close()?;
        }
        group.close()?;
        file.close()?;
        Ok(bytes)
    }

    #[test]
    fn a_parquet_file_is_read_as_the_csv_it_stands_for() {
        let file = file().expect("to memory");
        assert_eq!(
            to_csv(file.clone()).expect("a file just written"),
            "time,x [lpm],note\n\
             1970-01-01T00:00:01Z,0.1,\"a,b\"\n\
             1970-01-01T00:00:01.5Z,NaN,\n\
             1970-01-01T00:00:03Z,1583.7,c\n"
        );
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let table = read_from("a.parquet", file.as_slice(), &mut sources, &mut diagnostics)
            .expect("a recording");
        assert_eq!(table.time.as_deref(), Some([0.0, 0.5, 2.0].as_slice()));
        assert_eq!(table.columns[0].values[2], 1583.7);
    }

    #[test]
    fn a_file_cut_short_is_refused() {
        let file = file().expect("to memory");
        for length in [4, 8, 12, file.len() / 2, file.len() - 1] {
            assert!(to_csv(file[..length].to_vec()).is_err());
        }
    }

    #[test]
    fn a_damaged_file_does_not_make_it_panic() {
        let file = file().expect("to memory");
        for at in 4..file.len() {
            for flip in [0x01, 0x80, 0xff] {
                let mut damaged = file.clone();
                damaged[at] ^= flip;
                let _ = to_csv(damaged);
            }
        }
    }

    #[test]
    fn a_table_is_read_as_it_was_written() {
        let table = "time [s],\"q, \"\"a\"\" [lpm]\",unit\n\
                     0,0.1,1\n1e-300,NaN,1/s\n2,NaN,\"a,b\"\n3,-inf,\n4,-0,x\n";
        assert_eq!(to_csv(written(table)).as_deref(), Ok(table));
        // Several groups of rows, and runs of missing values.
        let cell = |i: i32| if i / 1000 % 2 == 0 { "NaN".to_owned() } else { i.to_string() };
        let row = |i: i32| format!("{i},{}\n", vec![cell(i); 60].join(","));
        let names: Vec<String> = (0..60).map(|j| format!(",c{j}")).collect();
        let head = names.concat();
        let long = format!("time [s]{head}\n{}", (0..50_000).map(row).collect::<String>());
        assert!(to_csv(written(&long)).as_deref() == Ok(long.as_str()));
        assert_eq!(to_csv(written("x [m]\n")).as_deref(), Ok("x [m]\n"));
    }

    #[test]
    fn a_text_among_numbers_of_an_earlier_group_is_not_dropped() {
        let mut out = Vec::new();
        let mut writer = ParquetWriter::new(&mut out);
        let text = format!("x\n{}a\n", "1\n".repeat(1 << 21));
        writer.write_all(text.as_bytes()).expect("to memory");
        let error = writer.finish().expect_err("a column has one type").to_string();
        assert_eq!(error, "column `x` holds numbers, and then a text");
    }

    #[test]
    fn another_compression_is_refused_with_its_name() {
        // The codec follows the path of the column in the metadata.
        let mut file = written("x [m]\n1\n");
        let path = file.windows(6).rposition(|bytes| bytes == b"x [m]\x15");
        file[path.expect("a path and a codec") + 6] = 4;
        let error = "column `x [m]`, row group 0: it is compressed with GZIP: \
                     write the file with Snappy or Zstandard";
        assert_eq!(to_csv(file), Err(error.to_owned()));
    }

    #[test]
    fn an_error_names_the_column_and_the_group_of_rows() {
        let mut file = written(&format!("x [m],y [m]\n{}", "1,2\n".repeat((1 << 20) + 2)));
        let end = file.windows(8).rposition(|bytes| bytes == 2.0_f64.to_le_bytes());
        // The header of the last page of `y`, which has two rows.
        let end = end.expect("y has values") - 8;
        file[end - 24..end].fill(0xff);
        let error = to_csv(file).expect_err("a damaged page");
        assert!(error.starts_with("column `y [m]`, row group 1: "), "{error}");
    }
}
